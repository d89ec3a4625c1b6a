//! Which page gives up its slot: Vastex's rule, and those that it is measured against.
//!
//! A policy is told of each frame's set and asked for victims; what may be a victim at all is not its choice:
//! no page of the frame's set, none with a resident descendant, no tail.
//! [`residency::retention`](crate::residency::retention) is shared with the pager; the rest serves replays.

mod clock;
mod ranked;
mod s3_fifo;
mod vastex;

use crate::lab::pool::Pool;

pub(crate) use ranked::{Farthest, LeastRecent, LevelFirst, Ranked};

use clock::Clock;
use s3_fifo::S3Fifo;
use vastex::Vastex;

/// A rule by which pages give up their slots.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Policy {
    /// The page wanted least recently.
    Lru,
    /// The next page round the pool that was not wanted since the hand passed it.
    Clock,
    /// Three queues: new pages on trial, pages that came back, and a memory of those that left.
    S3Fifo,
    /// The finest page, of those the one wanted least recently.
    LruLevel,
    /// The page expected back last, as the wanted regions move; a share of what left long ago stays for views
    /// that return.
    Vastex,
}

impl Policy {
    /// Every policy.
    pub const ALL: [Policy; 5] =
        [Policy::Lru, Policy::Clock, Policy::S3Fifo, Policy::LruLevel, Policy::Vastex];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Policy::Lru => "lru",
            Policy::Clock => "clock",
            Policy::S3Fifo => "s3fifo",
            Policy::LruLevel => "lru-level",
            Policy::Vastex => "vastex",
        }
    }

    /// Something that follows the policy in a pool.
    pub(crate) fn evictor(self, pool: &Pool<'_>) -> Box<dyn Evictor> {
        match self {
            Policy::Lru => Box::new(Ranked::new(LeastRecent)),
            Policy::Clock => Box::new(Clock::new(pool.pages())),
            Policy::S3Fifo => Box::new(S3Fifo::new(pool.pages(), pool.slots())),
            Policy::LruLevel => Box::new(Ranked::new(LevelFirst)),
            Policy::Vastex => Box::new(Ranked::new(Vastex::new(pool.pages()))),
        }
    }
}

/// Chooses victims in a replay. Pages are numbered as the replay numbers them.
pub(crate) trait Evictor {
    /// A frame begins: `pool` knows its set already.
    fn begin_frame(&mut self, pool: &Pool<'_>);

    /// A page takes a slot.
    fn admit(&mut self, page: u32);

    /// The page to give up its slot next: one that [`Pool::may_evict`], `None` if there is none.
    fn victim(&mut self, pool: &Pool<'_>) -> Option<u32>;
}
