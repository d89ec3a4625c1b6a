//! What a pager has decided, as values for the loader and the GPU.

use bytes::Bytes;

use crate::table::pool::Slot;
use crate::texture::page::{PageId, PagePos};

/// A tile to load.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Request {
    /// The page.
    pub page: PageId,
    /// The page within its texture.
    pub pos: PagePos,
    /// The request's place in the order of loading at this moment; the lowest is best. A later request may
    /// overtake it.
    pub rank: u64,
}

/// A tile to copy into its slot.
#[derive(Clone, Debug, PartialEq)]
pub struct Upload {
    /// The page.
    pub page: PageId,
    /// The slot that the page's tile goes into.
    pub slot: Slot,
    /// The tile, all layers.
    pub bytes: Bytes,
    /// The page that gave up the slot, of several that shared it the last.
    pub evicted: Option<PageId>,
}
