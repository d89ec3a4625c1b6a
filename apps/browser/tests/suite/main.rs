//! The pictures drawn natively. `cargo xtask test web` has them written, to compare a browser's with them.
#![allow(clippy::unwrap_used, clippy::panic, reason = "where a test cannot go on, it fails")]

mod pictures;
