//! Ranks: where a load belongs in the loader's queue, also when its place in the order of loading changes later.
//!
//! A request carries the rank that its page had when it was asked for. Frames later the page may have come into view, have left
//! it, or have become one of the best; with its old rank it would wait for tiles that matter less, or others for it. So
//! [`Pager::poll_rerank`] hands out loads that the loader still has with the rank that they should have from now on:
//!
//! - where the band changes (in view, a refresh in view, everything else), at once and in both directions, so that the loader
//!   never begins a load that is not for the view while one that is waits;
//! - within a band, where the class of the place is a better one than that of the rank it has. The classes are the places 0, 1,
//!   2 to 3, 4 to 7 and so on, so that a load gets another rank a few times at most, however often the order is made anew.
//!
//! A rerank is no request: it charges no budget, and the load is answered once.

use crate::pager::Pagers;
use crate::pager::decision::Request;
use crate::pager::pool::Pager;
use crate::residency::Residency;
use crate::residency::rank::{Band, RankClass, rank_of};
use crate::residency::records::RecordHint;
use crate::texture::page::PageId;

/// Loads that are to be ranked anew, and the ranks that the last decision gave them.
#[derive(Debug, Default)]
pub(crate) struct Reranks(Vec<(PageId, u64)>);

impl Reranks {
    /// A decision begins. What was not handed out is noted again where it still holds.
    pub(crate) fn clear(&mut self) {
        self.0.clear();
    }

    /// The page has this rank in the order now.
    pub(crate) fn note(&mut self, residency: &Residency, page: PageId, rank: u64) {
        if residency.is_ranked_worse(page, rank) {
            self.0.push((page, rank));
        }
    }
}

impl Pager {
    /// A load that the loader has and should move within its queue: the request again, with the rank that it has from now on. What
    /// the loader has begun or ended already stays as it is, and each load is answered once all the same.
    ///
    /// To be asked for in each frame before [`Pager::poll_request`]; what is left when the next decision is made is forgotten, and
    /// comes again if it still holds.
    pub fn poll_rerank(&mut self) -> Option<Request> {
        while let Some((page, rank)) = self.reranks.0.pop() {
            let is_due = self.residency.is_ranked_worse(page, rank);
            let Some((_, pos)) = self.textures.pos(page).filter(|_| is_due) else { continue };
            if let Some(record) = self.residency.records.get_mut(page) {
                record.rank = RankClass::of(rank);
            }
            if RankClass::of(rank).is_for_view() {
                self.residency.fly_for_view(page);
            }
            return Some(Request { page, pos, rank });
        }
        None
    }

    /// The rank of a place among what comes after what is missing in view.
    pub(crate) fn rank_by_hand(&self, place: usize) -> u64 {
        let is_in_view = |page: &PageId| self.residency.is_wanted(*page, RecordHint::default());
        let band = if self.by_hand.get(place).is_some_and(is_in_view) {
            Band::RefreshInView
        } else {
            Band::AfterView
        };
        rank_of(band, place)
    }
}

impl Pagers {
    /// A load that the loader should move within its queue; see [`Pager::poll_rerank`]. Its rank compares with those of all pools.
    pub fn poll_rerank(&mut self) -> Option<Request> {
        self.iter_mut().find_map(Pager::poll_rerank)
    }
}
