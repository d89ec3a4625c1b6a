//! What keeps a picture from being as sharp as it should be, until there is something to say of it.

use std::collections::BTreeMap;

use vastex::{Event, PageId, PoolId, Textures};
use vastex_core::Dims;

use crate::{report, shortage};

/// What keeps the picture from being as sharp as it should be.
#[derive(Default)]
pub(crate) struct Troubles {
    /// The pages that failed and have not recovered, and why.
    failed: BTreeMap<PageId, String>,
    /// The newest of each pool that is too small.
    shortages: BTreeMap<PoolId, Event>,
}

impl Troubles {
    pub(crate) fn note(&mut self, events: Vec<Event>) {
        for event in events {
            match event {
                Event::Failed { page, why, .. } => drop(self.failed.insert(page, why)),
                Event::Recovered { page, .. } => drop(self.failed.remove(&page)),
                Event::Oversubscribed { pool, .. } | Event::PoolReduced { pool, .. } => {
                    self.shortages.insert(pool, event);
                }
                _ => {}
            }
        }
    }

    /// What there is to say of them at the end, a sentence each.
    pub(crate) fn texts(&self, source: &str, textures: &Textures) -> Vec<String> {
        let failed = self.failed.iter().map(|(page, why)| {
            let (pos, file) = (page.pos(Dims::D2), report::file_of(textures, *page).unwrap_or(source));
            format!("{file}: {pos} failed, a coarser one is shown instead: {why}")
        });
        // Where the view has come to fit meanwhile, the picture is as it should be.
        let pools = textures.stats().pools;
        let coarse = pools.iter().filter(|pool| pool.pager.bias_eighths > 0);
        let short = coarse.filter_map(|pool| shortage::text(self.shortages.get(&pool.pool)?, textures));
        failed.chain(short.map(|short| format!("{source}: {short}"))).collect()
    }
}
