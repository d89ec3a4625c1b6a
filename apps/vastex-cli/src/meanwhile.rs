//! How an image is opened that has to be built or decoded first, and who is told of it meanwhile.

use std::ops::ControlFlow;
#[cfg(feature = "build")]
use std::sync::Arc;

use crate::args::CacheArgs;

/// How an image is built that is to be shown.
#[derive(Clone, Copy)]
#[cfg_attr(not(feature = "build"), expect(dead_code, reason = "nothing can be built"))]
pub(crate) struct BuiltWith<'a> {
    /// Where its container is kept.
    pub(crate) cache: &'a CacheArgs,
    /// Whether its left and right edges are neighbours, as on a globe.
    pub(crate) wraps: bool,
    /// Who shows something meanwhile.
    pub(crate) meanwhile: &'a dyn Meanwhile,
}

/// Who is told how far an image is that takes its time to open, and may have it broken off.
pub(crate) trait Meanwhile {
    /// Here is a picture to look at, of an image of `size` texels: a smaller one, or one that grows.
    #[cfg(feature = "build")]
    fn show(&self, picture: &Arc<vastex_build::MemoryImage>, size: [u32; 2]) {
        let _ = (picture, size);
    }

    /// Whether pictures are shown at all.
    fn shows(&self) -> bool {
        false
    }

    /// So much of it is done, from 0 to 1. `Break` breaks it off.
    fn advance(&self, share: f64) -> ControlFlow<()> {
        let _ = share;
        ControlFlow::Continue(())
    }

    /// Something that a person should know; it is said on stderr, too.
    fn note(&self, note: &str) {
        let _ = note;
    }
}

/// For commands that show nothing before all is there.
impl Meanwhile for () {}
