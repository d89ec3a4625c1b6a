//! What the caller is told while work goes on, and by which it stops the work.

use std::ops::ControlFlow;
use std::path::Path;

use crate::image::{ImageHeader, Notice};

/// Gets reports of how far a build, a replacement or an export is, and may stop it. Called on the thread that
/// called [`crate::build()`] or its like.
pub trait Progress {
    /// `rows_done` of `rows_total` rows are read and `bytes_written` bytes of tiles are written. `Break`
    /// cancels the build, which then leaves nothing behind, unless it can be resumed.
    fn advance(&self, rows_done: u64, rows_total: u64, bytes_written: u64) -> ControlFlow<()>;

    /// Another program is making what is asked for, which is waited for; called about ten times a second
    /// until it is there. `Break` ends the wait.
    fn wait(&self) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    /// Rows of the first layer's image from `first_row` on, upright and, where the layer holds colours, in
    /// sRGB: `image.row_bytes()` bytes each, for programs that show an image while it is built or decoded.
    /// They come in order, and from 0 again where a build begins anew. The thread that reads waits for it.
    fn rows(&self, image: &ImageHeader, first_row: u32, rows: &[u8]) {
        let _ = (image, first_row, rows);
    }

    /// A notice of an image that is known before the image's first row is read, such as what reading it
    /// costs. The report at the end has it too.
    fn note(&self, image: &Path, notice: &Notice) {
        let _ = (image, notice);
    }
}

/// For callers that neither watch nor cancel.
impl Progress for () {
    fn advance(&self, _: u64, _: u64, _: u64) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}
