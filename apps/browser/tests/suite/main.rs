//! The pictures drawn natively. `cargo xtask test web` has them written, to compare a browser's with them.

mod pictures;
