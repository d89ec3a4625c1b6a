//! Replays a trace under a policy, beside Belady's optimum.
//!
//! A frame's set is what its feedback wanted, with all ancestors; tails are pinned and never loaded. Without
//! latency or limit every frame's set becomes resident in that frame: there is no bias, no prefetch, and the
//! count of loads is the policy's alone. With them, loads take their time, and it also matters how soon a
//! view is complete.
//!
//! Whatever the policy, no page of the present set is evicted, and none that has a resident descendant.

mod run;

use crate::lab::pages::Pages;
use crate::lab::policies::{Evictor, Farthest, Policy, Ranked};
use crate::lab::pool::Pool;
use crate::record::trace::Trace;
use run::{Delivery, Run};

/// The size of the pool of a replay.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PoolSize {
    /// So many tiles, tails included.
    Tiles(u64),
    /// So many times the largest frame's set, rounded down; at least 1.
    Share(f64),
}

/// How a trace is replayed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReplaySettings {
    /// Which page gives up its slot.
    pub policy: Policy,
    /// The pool.
    pub pool: PoolSize,
    /// Frames that a load takes; 0: it is there in the frame that wants it.
    pub latency_frames: u64,
    /// Loads begun per frame; `None` for as many as are wanted.
    pub tiles_per_frame: Option<u64>,
}

impl ReplaySettings {
    /// A replay without latency or limit.
    pub fn new(policy: Policy, pool: PoolSize) -> ReplaySettings {
        ReplaySettings { policy, pool, latency_frames: 0, tiles_per_frame: None }
    }
}

/// What a replay counted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Replay {
    /// Frames of the trace.
    pub frames: u64,
    /// Distinct pages of the trace, ancestors and tails included.
    pub pages: u64,
    /// Pages of the largest frame's set, tails included.
    pub working_set_max: u64,
    /// Tiles that the pool held at most, tails included.
    pub pool_tiles: u64,
    /// Tiles loaded; tails are not counted.
    pub loads: u64,
    /// Tiles that have to be loaded when the future is known, without latency or limit.
    pub loads_optimum: u64,
    /// Tiles that lost their slots.
    pub evictions: u64,
    /// Loads of tiles that had been loaded before.
    pub reloads: u64,
    /// Tiles that came too late to be of use, and found the pool full.
    pub wasted: u64,
    /// Views that began: the first, and each frame that shares less than half of its set with the frame
    /// before.
    pub cuts: u64,
    /// Frames from the beginning of a view until its set was resident (or the next began), summed over the
    /// views.
    pub frames_to_full: u64,
    /// Frames that this takes at least from what was resident or under way, when what will be wanted is
    /// known.
    pub frames_to_full_bound: u64,
    /// Levels missing at a feedback pixel, averaged over the pixels of a frame and summed over the frames.
    pub missing_level_frames: f64,
}

impl Replay {
    /// Loads divided by those of the optimum.
    pub fn ratio(&self) -> f64 {
        if self.loads == self.loads_optimum { 1.0 } else { self.loads as f64 / self.loads_optimum as f64 }
    }
}

/// Why a trace cannot be replayed so.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ReplayError {
    /// The pool does not hold the largest frame's set.
    #[error(
        "a pool of {tiles} tiles is below the largest frame's set of {needed}; give it at least {needed}, or a share of 1"
    )]
    PoolTooSmall {
        /// Tiles of the pool.
        tiles: u64,
        /// Pages of the largest frame's set.
        needed: u64,
    },
    /// The share is no share.
    #[error("a pool of {0} times the largest frame's set: the share must be a number from 1 to 1e6")]
    Share(f64),
    /// Nothing could ever be loaded.
    #[error("0 tiles per frame load nothing; allow at least 1, or leave the limit out")]
    NoTiles,
}

/// Replays a trace. Costs a visit of every page of every frame, and of the pool in each frame that evicts.
pub fn replay(trace: &Trace, settings: &ReplaySettings) -> Result<Replay, ReplayError> {
    let pages = Pages::of(trace);
    let pool_tiles = pool_tiles(settings.pool, pages.working_set_max())?;
    if settings.tiles_per_frame == Some(0) {
        return Err(ReplayError::NoTiles);
    }
    let slots = usize::try_from(pool_tiles - pages.pins()).unwrap_or(usize::MAX);
    let play = |evictor: fn(Policy, &Pool<'_>) -> Box<dyn Evictor>, delivery| {
        let pool = Pool::new(&pages, slots);
        let evictor = evictor(settings.policy, &pool);
        Run::new(pool, evictor, delivery).play()
    };
    let delivery = Delivery {
        latency_frames: settings.latency_frames,
        tiles_per_frame: settings.tiles_per_frame.unwrap_or(u64::MAX),
    };
    let optimum = play(|_, pool| Box::new(Ranked::new(Farthest::new(pool))), Delivery::AT_ONCE);
    let counts = play(Policy::evictor, delivery);
    Ok(Replay {
        frames: trace.frames().len() as u64,
        pages: pages.len() as u64 + pages.pins(),
        working_set_max: pages.working_set_max(),
        pool_tiles,
        loads: counts.loads,
        loads_optimum: optimum.loads,
        evictions: counts.evictions,
        reloads: counts.reloads,
        wasted: counts.wasted,
        cuts: counts.cuts,
        frames_to_full: counts.frames_to_full,
        frames_to_full_bound: counts.frames_to_full_bound,
        missing_level_frames: counts.missing_level_frames,
    })
}

fn pool_tiles(size: PoolSize, needed: u64) -> Result<u64, ReplayError> {
    let tiles = match size {
        PoolSize::Tiles(tiles) => tiles,
        PoolSize::Share(share) if (1.0..=1e6).contains(&share) => (share * needed as f64) as u64,
        PoolSize::Share(share) => return Err(ReplayError::Share(share)),
    };
    if tiles < needed { Err(ReplayError::PoolTooSmall { tiles, needed }) } else { Ok(tiles) }
}

#[cfg(test)]
mod tests;
