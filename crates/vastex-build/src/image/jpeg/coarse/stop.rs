//! Why a small picture ends before its last row.

use std::io;

/// Why nothing more comes of a scan.
#[derive(Debug)]
pub(super) enum Stop {
    /// The file ends.
    Ended,
    /// The data makes no sense; what of it.
    Damaged(&'static str),
    Io(io::Error),
}

impl From<io::Error> for Stop {
    fn from(error: io::Error) -> Stop {
        match error.kind() {
            io::ErrorKind::UnexpectedEof => Stop::Ended,
            _ => Stop::Io(error),
        }
    }
}
