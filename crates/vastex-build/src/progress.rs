//! What the caller is told while work goes on, and by which it stops the work.

use std::ops::ControlFlow;
use std::path::Path;

use crate::image::Notice;

/// Told how far a build is, and asked whether to go on. Called on the thread that called [`crate::build()`].
pub trait Progress {
    /// `rows_done` of `rows_total` rows are read and `bytes_written` bytes of tiles are written. `Break` cancels the
    /// build, which then leaves nothing behind, unless it can be resumed.
    fn advance(&self, rows_done: u64, rows_total: u64, bytes_written: u64) -> ControlFlow<()>;

    /// What is known of an image before its first row is read, such as what it costs; also among what the report says at the end.
    fn note(&self, image: &Path, notice: &Notice) {
        let _ = (image, notice);
    }
}

/// Nobody watches, nobody cancels.
impl Progress for () {
    fn advance(&self, _: u64, _: u64, _: u64) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}
