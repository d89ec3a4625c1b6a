//! Pictures of a volume by the real pager, pools and shaders, frame by frame, on whatever drives the frames.
//!
//! A page in a browser drives them (`page`, the only part that is of the browser alone), and so does a test;
//! `cargo xtask test web` compares what the two have drawn. The volume is a container of `vastex build`,
//! whose bytes the host has fetched.

#[cfg(target_family = "wasm")]
mod page;
mod show;
mod source;

pub use show::{Drawn, Show, ShowError};
