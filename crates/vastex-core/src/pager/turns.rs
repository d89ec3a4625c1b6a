//! Whose turn it is where pools share the budgets of loads and of uploads: each pool with something to do
//! gets the same bytes, whatever the size of its tiles.

use crate::pager::budget::Demand;
use crate::pager::decision::{Request, Upload};
use crate::pager::flight_share::FlightShare;
use crate::pager::pool::PoolPager;
use crate::pager::{Pager, Pool};
use crate::table::pool::PoolId;
use crate::texture::page::PageId;

impl Pool {
    /// What it demands of the in-flight budget where `has_next` finds something, and only tiles that take
    /// fewer bytes than so many go on.
    fn demand(&mut self, below: u64, has_next: impl FnOnce(&mut PoolPager) -> bool) -> Demand {
        match has_next(&mut self.pager) {
            true if self.pager.residency.flight_bytes() < below => Demand::Waits,
            false if !self.pager.load_order.is_held_back() => Demand::Nothing,
            _ => Demand::HeldBack,
        }
    }
}

impl Pager {
    /// The next tile to load, while the in-flight budget allows one. Its rank compares with those of all
    /// pools.
    ///
    /// Pages in view of any pool come before explicit requests of any pool, which get half of the budget. If
    /// several textures have pages, none holds so much of the budget that others cannot begin: a page whose
    /// texture has its share is passed over.
    pub fn poll_request(&mut self) -> Option<Request> {
        let share = self.flight_share();
        let mut below = u64::MAX;
        loop {
            let (who, is_in_view) = self.whose_request(share, below)?;
            let residency = &self.pools[who].pager.residency;
            let (tile_bytes, flight_bytes) = (residency.tile_bytes(), residency.flight_bytes());
            let budget = share.budget / if is_in_view { 1 } else { 2 };
            if share.in_flight == 0 || share.in_flight + flight_bytes <= budget {
                self.requests.serve(who, tile_bytes);
                return self.request_of(who, is_in_view, share);
            }
            // Whose turn it is waits for what it needs, so that small tiles do not keep out large ones; but
            // not for what nobody answers.
            let unanswered: u64 = self.pools().map(|pager| pager.residency.unanswered_bytes()).sum();
            let is_to_be_had = unanswered == 0 || unanswered + flight_bytes <= budget;
            if is_to_be_had || !is_in_view || share.is_alone {
                self.bandwidth.view_waits |= is_in_view;
                return None;
            }
            below = flight_bytes;
        }
    }

    fn flight_share(&self) -> FlightShare {
        FlightShare {
            budget: self.budgets.in_flight_bytes,
            in_flight: self.pools().map(|pager| pager.residency.stats().in_flight_bytes).sum(),
            is_alone: self.pools().map(|pager| pager.textures.with_pages()).sum::<u32>() <= 1,
        }
    }

    /// The pool whose turn it is to ask for a tile that takes fewer bytes than so many, and whether for one
    /// in view.
    fn whose_request(&mut self, share: FlightShare, below: u64) -> Option<(usize, bool)> {
        // A pool that others hold back catches up when they do not. One whose source is silent is held back
        // for long: so much and no more.
        let credit = share.budget;
        let Pager { requests, pools, bandwidth, .. } = self;
        let in_view = requests
            .next_of(credit, |pool| pools[pool].demand(below, |pager| pager.next_in_view(share).is_some()));
        for pool in pools.iter_mut() {
            bandwidth.view_waits |= pool.pager.residency.take_view_waits();
        }
        if let Some(who) = in_view {
            return Some((who, true));
        }
        let after_view = requests
            .next_of(credit, |pool| pools[pool].demand(below, |pager| pager.next_after_view().is_some()));
        after_view.map(|who| (who, false))
    }

    fn request_of(&mut self, who: usize, is_in_view: bool, share: FlightShare) -> Option<Request> {
        let pager = &mut self.pools[who].pager;
        let request = if is_in_view {
            let page = pager.next_in_view(share)?;
            pager.request_in_view(page)
        } else {
            let page = pager.next_after_view()?;
            pager.request_after_view(page)
        };
        self.check_in_flight();
        request
    }

    /// The next tile to copy into a slot, and of which pool, while the upload budget allows one.
    pub fn poll_upload(&mut self) -> Option<(PoolId, Upload)> {
        loop {
            let Pager { uploads, pools, .. } = self;
            let mut turn = |next: fn(&mut PoolPager) -> Option<PageId>| {
                uploads.next(|pool| !pools[pool].is_stuck && next(&mut pools[pool].pager).is_some())
            };
            let in_view = turn(PoolPager::next_upload_in_view);
            let who = in_view.or_else(|| turn(PoolPager::next_upload_after_view))?;
            let pager = &mut pools[who].pager;
            let page = match in_view {
                Some(_) => pager.next_upload_in_view(),
                None => pager.next_upload_after_view(),
            }?;
            let (pool, tile_bytes) = (pager.pool(), pager.residency.tile_bytes());
            if self.bucket.available() < tile_bytes {
                return None;
            }
            if let Some(upload) = pager.upload(page) {
                self.bucket.take(tile_bytes);
                uploads.serve(who, tile_bytes);
                return Some((pool, upload));
            }
            pools[who].is_stuck = true;
        }
    }
}
