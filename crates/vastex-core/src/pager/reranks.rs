//! Loads that the loader should move within its queue, as the last decision ranks them.
//!
//! A request has the rank that its page had when it was asked for. Frames later the page may have come
//! into view, have left it, or have become one of the best; with its old rank it would wait for tiles that
//! matter less, or others for it. When a load gets another rank is said in `residency::rank`. A rerank is no
//! request: it charges no budget, and the load is answered once.

use crate::residency::Residency;
use crate::texture::page::PageId;

/// The pages, and the ranks that the last decision gave them.
#[derive(Debug, Default)]
pub(crate) struct Reranks(Vec<(PageId, u64)>);

impl Reranks {
    /// A decision begins. What was not handed out is noted again where it still holds.
    pub(crate) fn clear(&mut self) {
        self.0.clear();
    }

    /// The page has this rank in the order now.
    pub(crate) fn note(&mut self, residency: &Residency, page: PageId, rank: u64) {
        if residency.needs_rerank(page, rank) {
            self.0.push((page, rank));
        }
    }

    /// A page that the loader still has with another rank than it should have, and that rank.
    pub(crate) fn pop(&mut self, residency: &Residency) -> Option<(PageId, u64)> {
        while let Some((page, rank)) = self.0.pop() {
            if residency.needs_rerank(page, rank) {
                return Some((page, rank));
            }
        }
        None
    }
}
