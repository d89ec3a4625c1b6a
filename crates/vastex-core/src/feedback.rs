//! What a rendered view wanted: the pages, how sharply, and over how many pixels.
//!
//! How it is drawn, compacted and read back is the GPU crate's business; what follows from it the pager's.

use crate::page::PageId;
use crate::shared::STEPS_PER_LEVEL;
use crate::views::ViewId;
use crate::working_set::merge_same;

/// How sharply a page is needed, in eighths of a level: `8 * level + eighth`. Smaller is sharper.
///
/// It is the level before any bias of the pool, so the page wanted at a bias of `b` eighths is the ancestor at level
/// `(need + b) / 8`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Need(u16);

impl Need {
    /// Less sharp than any.
    pub(crate) const LEAST: Need = Need(u16::MAX);

    /// `eighth` (0 to 7) eighths into `level`.
    pub const fn new(level: u8, eighth: u8) -> Need {
        Need(level as u16 * STEPS_PER_LEVEL as u16 + eighth as u16)
    }

    /// The level wanted at a bias, in eighths of a level.
    pub const fn level_at(self, bias: u16) -> u8 {
        ((self.0 + bias) / STEPS_PER_LEVEL as u16) as u8
    }

    /// The need in eighths of a level.
    pub const fn eighths(self) -> u16 {
        self.0
    }
}

/// A page that a view wants at mip bias 0. 12 bytes on the way from the GPU.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct WantedPage {
    /// The page; in a tail, the tail's page.
    pub page: PageId,
    /// Feedback pixels that want it.
    pub pixels: u32,
    /// How far into the page's level the sharpest of them is, 0 to 7 eighths.
    pub eighth: u8,
}

/// The feedback of one view in one frame.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Feedback {
    /// The view.
    pub view: ViewId,
    /// The frame in which it was drawn.
    pub frame: u64,
    /// Distinct pages, in ascending order of page id.
    pub pages: Vec<WantedPage>,
    /// Pixels whose gradients were zero, infinite or no numbers, which wanted nothing.
    pub degenerate: u32,
}

impl Feedback {
    /// The main view's feedback of a frame from pages in any order. Of a page that is named several times the pixels are added, and the sharpest
    /// need counts.
    pub fn of_pages(frame: u64, mut pages: Vec<WantedPage>) -> Feedback {
        merge_same(&mut pages);
        Feedback { frame, pages, ..Feedback::default() }
    }
}
