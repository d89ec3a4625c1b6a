//! Who is told of a source while it is opened: how far it is, and what can be looked at meanwhile.

#![cfg_attr(
    not(all(feature = "build", feature = "view")),
    allow(dead_code, reason = "nothing is built, or nobody looks on, so nothing is told of it")
)]

use std::cell::Cell;
use std::ops::ControlFlow;
#[cfg(feature = "build")]
use std::sync::Arc;

use super::looked::Looked;

/// What becomes of a cached image of which a tile turned out to be damaged.
pub(crate) enum Mending {
    /// It is being built anew, as the text says.
    Begun(String),
    /// It is whole again: what failed is to be tried again.
    Done,
    /// It stays damaged, for the reason that the text gives; stderr has it already.
    Failed(String),
}

/// Is told of that, from any thread and long after the image was opened.
#[cfg(feature = "build")]
pub(crate) type MendObserver = Arc<dyn Fn(Mending) + Send + Sync>;

/// Is told of what is found of a file while its tiles are read, from any thread and long after it was opened.
#[cfg(feature = "build")]
pub(crate) type NoteObserver = Arc<dyn Fn(&str) + Send + Sync>;

/// Is told of a source that takes its time to open, and may have it broken off. Called on the thread that
/// opens it.
pub(crate) trait OpenObserver {
    /// Returns true if a person looks at something meanwhile, so that what is built gives way to that.
    fn is_watched(&self) -> bool {
        false
    }

    /// What was found already at the path that is opened.
    fn looked(&self) -> Option<&Looked> {
        None
    }

    /// Returns true if previews are wanted at all.
    fn wants_preview(&self) -> bool {
        false
    }

    /// Here is a picture to look at, of an image of `size` texels: a smaller one, or one that grows.
    #[cfg(feature = "build")]
    fn preview(&self, picture: &Arc<vastex_build::MemoryImage>, size: [u32; 2]) {
        let _ = (picture, size);
    }

    /// So much of it is done, from 0 to 1. `Break` breaks it off.
    fn advance(&self, share: f64) -> ControlFlow<()> {
        let _ = share;
        ControlFlow::Continue(())
    }

    /// The same of what is read where it lies, so that nothing is built or decoded as a whole.
    fn advance_in_place(&self, share: f64) -> ControlFlow<()> {
        self.advance(share)
    }

    /// Who is told of a cached image that is found damaged. Reads of its damaged tiles then fail while it is
    /// built anew, and are to be tried again; where nobody is told, they wait.
    #[cfg(feature = "build")]
    fn mending(&self) -> Option<MendObserver> {
        None
    }

    /// Something of the file that a person should know, as a text that names it; stderr has it already.
    fn note(&self, note: &str) {
        let _ = note;
    }

    /// Who is told of what is only found while tiles are read; stderr has it already.
    #[cfg(feature = "build")]
    fn later_notes(&self) -> Option<NoteObserver> {
        None
    }

    /// The image of `size` texels will be there at a share of its size, for the reason that `note` gives;
    /// stderr has it already.
    fn reduced(&self, size: [u32; 2], note: &str) {
        let _ = (size, note);
    }
}

/// For commands that show nothing before all is there.
impl OpenObserver for () {}

/// For those that looked at a file before, and show nothing before all is there.
impl OpenObserver for Looked {
    fn looked(&self) -> Option<&Looked> {
        Some(self)
    }
}

/// Hands all on, and keeps how large the image is that is opened.
pub(super) struct Measured<'a> {
    observer: &'a dyn OpenObserver,
    /// Where the source has fewer texels.
    image: Cell<Option<[u32; 2]>>,
}

impl<'a> Measured<'a> {
    pub(super) fn new(observer: &'a dyn OpenObserver) -> Measured<'a> {
        Measured { observer, image: Cell::default() }
    }

    /// Columns and rows of the image, of which the source has so many.
    pub(super) fn image(&self, source: [u32; 2]) -> [u32; 2] {
        self.image.get().unwrap_or(source)
    }
}

impl OpenObserver for Measured<'_> {
    fn is_watched(&self) -> bool {
        self.observer.is_watched()
    }

    fn looked(&self) -> Option<&Looked> {
        self.observer.looked()
    }

    fn wants_preview(&self) -> bool {
        self.observer.wants_preview()
    }

    #[cfg(feature = "build")]
    fn preview(&self, picture: &Arc<vastex_build::MemoryImage>, size: [u32; 2]) {
        self.observer.preview(picture, size);
    }

    fn advance(&self, share: f64) -> ControlFlow<()> {
        self.observer.advance(share)
    }

    fn advance_in_place(&self, share: f64) -> ControlFlow<()> {
        self.observer.advance_in_place(share)
    }

    #[cfg(feature = "build")]
    fn mending(&self) -> Option<MendObserver> {
        self.observer.mending()
    }

    fn note(&self, note: &str) {
        self.observer.note(note);
    }

    #[cfg(feature = "build")]
    fn later_notes(&self) -> Option<NoteObserver> {
        self.observer.later_notes()
    }

    fn reduced(&self, size: [u32; 2], note: &str) {
        self.image.set(Some(size));
        self.observer.reduced(size, note);
    }
}

/// Hands on how far it is, and nothing else: of an image that something else is made of.
pub(super) struct WithoutPreview<'a>(pub(super) &'a dyn OpenObserver);

impl OpenObserver for WithoutPreview<'_> {
    fn is_watched(&self) -> bool {
        self.0.is_watched()
    }

    fn advance(&self, share: f64) -> ControlFlow<()> {
        self.0.advance(share)
    }

    fn advance_in_place(&self, share: f64) -> ControlFlow<()> {
        self.0.advance_in_place(share)
    }

    #[cfg(feature = "build")]
    fn mending(&self) -> Option<MendObserver> {
        self.0.mending()
    }

    fn note(&self, note: &str) {
        self.0.note(note);
    }

    #[cfg(feature = "build")]
    fn later_notes(&self) -> Option<NoteObserver> {
        self.0.later_notes()
    }
}
