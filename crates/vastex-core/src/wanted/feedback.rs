//! What a rendered view wanted: the pages, how sharply, and over how many pixels.
//!
//! How it is drawn, compacted and read back is the GPU crate's business; what follows from it the pager's.

use crate::shader_constants::STEPS_PER_LEVEL;
use crate::texture::page::PageId;
use crate::texture::textures::Textures;
use crate::wanted::view::ViewId;

/// How sharply a page is needed, in eighths of a level: `8 * level + eighth`. Smaller is sharper.
///
/// It is the level before any bias of the pool, so the page wanted at a bias of `b` eighths is the ancestor
/// at level `(need + b) / 8`.
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

impl WantedPage {
    /// What is wanted where this page, which exists, is wanted: the page itself, or the nearest ancestor that
    /// has a tile, as sharply as there is anything.
    pub(crate) fn present(self, textures: &Textures) -> WantedPage {
        let page = textures.present_page(self.page);
        if page == self.page { self } else { WantedPage { page, eighth: 0, ..self } }
    }
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
    /// True if it names nothing but what was not there when it was drawn, of any pixel of the picture: the
    /// *gaps* of a view that rests. It says nothing of what else the view wants.
    pub gaps: bool,
}

impl Feedback {
    /// The main view's feedback of a frame from pages in any order. Of a page that is named several times the
    /// pixels are added, and the sharpest need counts.
    pub fn of_pages(frame: u64, mut pages: Vec<WantedPage>) -> Feedback {
        merge_same(&mut pages);
        Feedback { frame, pages, ..Feedback::default() }
    }
}

/// Makes one entry of those of the same page, for which several that have no tiles may stand.
pub(crate) fn merge_same(pages: &mut Vec<WantedPage>) {
    pages.sort_unstable();
    pages.dedup_by(|next, first| {
        let same = next.page == first.page;
        if same {
            first.pixels = first.pixels.saturating_add(next.pixels);
            first.eighth = first.eighth.min(next.eighth);
        }
        same
    });
}
