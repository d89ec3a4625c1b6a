//! Why a file cannot be read, and what a person can do about it.

use std::io;

/// What stands in messages in the place of an error of the system's while reading: why, and the remedy where
/// one is known.
pub fn read_advice(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::NotFound => "there is no such file; check the path".into(),
        io::ErrorKind::NotADirectory => "its path leads through a file; check the path".into(),
        io::ErrorKind::PermissionDenied => "the file may not be read; change its permissions".into(),
        _ => error.to_string(),
    }
}
