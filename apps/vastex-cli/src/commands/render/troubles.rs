//! What keeps a picture from being as sharp as it should be, until there is something to say of it.

use std::collections::BTreeMap;

use vastex::{Event, PageId, PoolId, Textures};
use vastex_core::Dims;

use crate::parts::PartsWatch;
use crate::{report, shortage};

/// What keeps the picture from being as sharp as it should be.
#[derive(Default)]
pub(crate) struct Troubles {
    /// The pages that failed and have not recovered, and why.
    failed: BTreeMap<PageId, String>,
    /// The newest of each pool that is too small.
    shortages: BTreeMap<PoolId, Event>,
    /// What there is to say of those that were too small for a part of a picture.
    of_parts: BTreeMap<PoolId, String>,
}

/// What keeps any part from being sharp keeps the picture from it.
impl PartsWatch for Troubles {
    fn note(&mut self, _: &Textures, events: Vec<Event>) {
        Troubles::note(self, events);
    }

    fn end_part(&mut self, textures: &Textures) {
        let short: Vec<(PoolId, String)> = self.short(textures).collect();
        self.of_parts.extend(short);
    }
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
        let short: BTreeMap<PoolId, String> = self.short(textures).chain(self.of_parts.clone()).collect();
        failed.chain(short.into_values().map(|short| format!("{source}: {short}"))).collect()
    }

    /// What there is to say of pools that are too small now. Where the view has come to fit meanwhile, the
    /// picture is as it should be.
    fn short(&self, textures: &Textures) -> impl Iterator<Item = (PoolId, String)> {
        let coarse = textures.stats().pools.into_iter().filter(|pool| pool.pager.bias_eighths > 0);
        coarse.filter_map(|pool| {
            let text = shortage::text(self.shortages.get(&pool.pool)?, textures)?;
            Some((pool.pool, text))
        })
    }
}
