//! What an application wants to know.

use crate::page::PageId;
use crate::pool::PoolId;

/// Something that happened; see [`crate::Pagers::poll_event`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Event {
    /// For a whole jitter cycle no page was newly wanted, and none was missing at the bias in force, in any pool.
    Converged {
        /// The frame.
        frame: u64,
    },
    /// The pool's working set does not fit; said when the bias rises.
    Oversubscribed {
        /// The pool.
        pool: PoolId,
        /// Pages of the working set at bias 0, with their ancestors and the pins.
        wanted: u32,
        /// Slots of the pool.
        slots: u32,
        /// The bias now in force, in eighths of a level.
        bias_eighths: u16,
    },
    /// A tile could not be had; said once, until it recovers. It is tried again with back-off, its ancestor stays on screen.
    Failed {
        /// The pool of its texture.
        pool: PoolId,
        /// The page.
        page: PageId,
        /// What its source said.
        why: String,
    },
    /// A tile that had failed is here.
    Recovered {
        /// The pool of its texture.
        pool: PoolId,
        /// The page.
        page: PageId,
    },
}
