//! What the caller is told while work goes on, and by which it stops the work.

use std::ops::ControlFlow;
use std::panic::resume_unwind;
use std::path::Path;
use std::sync::Arc;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread::{self, Builder};
use std::time::Duration;

use crate::image::{Beginning, ImageHeader, InputFault, Notice, RowReader};

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

    /// A further file of an image of many is about to be opened or looked at, such as a piece of a mosaic,
    /// before any row is read. `Break` is as that of [`Progress::advance`].
    fn opening(&self) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    /// So much is done, from 0 to 1, of what must be decoded of an image before its first row is there: of
    /// the first layer's, and of each inset, mask and image that replaces another. Called about ten times a
    /// second until it is, of images where that takes long. `Break` is as that of [`Progress::advance`].
    fn beginning(&self, share: f64) -> ControlFlow<()> {
        let _ = share;
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

/// How long nobody is told of a beginning.
const EVERY: Duration = Duration::from_millis(100);
/// How much is read at once where a thread is started for it.
const WATCHED_BYTES: usize = 1 << 20;

/// How many rows [`read_watched`] should read at once for those who want one after the other: several only
/// where it starts a thread each time.
pub(crate) fn rows_at_once(reader: &dyn RowReader) -> usize {
    let image = reader.header();
    match reader.beginning() {
        Some(beginning) if beginning.is_of_all_rows() => {
            (WATCHED_BYTES / image.row_bytes()).clamp(1, image.height as usize)
        }
        _ => 1,
    }
}

/// Does something that takes its time before it gives out rows, on a thread of its own, while `tell` is
/// called on this one, which says whether it goes on. `None` where it was broken off.
pub(crate) fn watched<T: Send, W: FnOnce() -> T + Send>(
    beginnings: &[Arc<Beginning>],
    tell: &dyn Fn() -> ControlFlow<()>,
    work: W,
) -> Option<T> {
    if beginnings.is_empty() {
        return Some(work());
    }
    // What cannot be started is lost with all that it was given, so it is given later.
    let (give, given) = channel::<W>();
    let (ended, end) = channel::<()>();
    let done = thread::scope(|scope| {
        let started = Builder::new().spawn_scoped(scope, move || {
            let done = given.recv().ok().map(|work| work());
            drop(ended);
            done
        });
        let Ok(worker) = started else { return Some(work()) };
        if let Err(back) = give.send(work) {
            return Some(back.0());
        }
        loop {
            if tell().is_break() {
                beginnings.iter().for_each(|beginning| beginning.break_off());
            }
            if end.recv_timeout(EVERY) != Err(RecvTimeoutError::Timeout) {
                return worker.join().unwrap_or_else(|panic| resume_unwind(panic));
            }
        }
    });
    done.filter(|_| !beginnings.iter().any(|beginning| beginning.is_broken_off()))
}

/// Reads the first rows of an image, while `progress` hears on this thread of the work before them: how much
/// of it is done ([`Progress::beginning`]), or, where that is not known, that no row is done yet
/// ([`Progress::advance`]). `None` where it was broken off.
pub fn read_first_rows(
    reader: &mut dyn RowReader,
    rows: &mut [u8],
    progress: &dyn Progress,
) -> Option<Result<(), InputFault>> {
    let height = reader.header().height.into();
    let tell = |share: Option<f64>| match share {
        Some(share) => progress.beginning(share),
        None => progress.advance(0, height, 0),
    };
    read_watched(reader, rows, true, &tell)
}

/// Reads rows after the first ones, which take long where pieces of a mosaic begin: `tell` is called on this
/// thread about ten times a second meanwhile, and says whether to go on. `None` where it was broken off.
pub fn read_further_rows(
    reader: &mut dyn RowReader,
    rows: &mut [u8],
    tell: &dyn Fn() -> ControlFlow<()>,
) -> Option<Result<(), InputFault>> {
    read_watched(reader, rows, false, &|_| tell())
}

/// Reads rows of an image, the first ones or others, while `tell` is called on this thread about ten times a
/// second if that may take long, with the share that is done of the work before the first row, where that is
/// known; it says whether to go on. `None` where the rows were broken off.
pub(crate) fn read_watched(
    reader: &mut dyn RowReader,
    rows: &mut [u8],
    are_first: bool,
    tell: &dyn Fn(Option<f64>) -> ControlFlow<()>,
) -> Option<Result<(), InputFault>> {
    let beginning = reader.beginning().filter(|beginning| are_first || beginning.is_of_all_rows());
    let told = || {
        let known = beginning.as_ref().filter(|beginning| !beginning.is_of_all_rows());
        tell(known.map(|beginning| beginning.share()))
    };
    watched(beginning.as_slice(), &told, || reader.read_rows(rows))
}

/// For callers that neither watch nor cancel.
impl Progress for () {
    fn advance(&self, _: u64, _: u64, _: u64) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}
