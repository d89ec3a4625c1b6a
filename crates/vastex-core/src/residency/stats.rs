//! What is counted of a pool, and what is measured.

/// Totals since the pager was made, and gauges of the moment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Stats {
    /// Slots of the pool.
    pub slots: u32,
    /// Slots that hold a tile.
    pub occupied: u32,
    /// Pages whose tiles are in slots: more than `occupied`, where pages of the same content share one.
    pub resident: u32,
    /// Slots that hold a tail.
    pub tails: u32,
    /// Slots that are not given up whatever is in view: those that hold a tail, and those of pages pinned by
    /// hand.
    pub locked: u32,
    /// Tiles of the working set at mip bias 0: last jitter cycle, ancestors and pins; pages of the same
    /// content have one.
    pub wanted: u32,
    /// Tiles of the working set at the bias in force, pins included.
    pub wanted_at_bias: u32,
    /// The mip bias in force, in eighths of a level.
    pub bias_eighths: u16,
    /// Tiles wanted and neither resident nor failed.
    pub missing: u32,
    /// Wanted tiles that could not be had, so far.
    pub failed: u32,
    /// Tiles with the loader or waiting for the upload budget.
    pub in_flight: u32,
    /// Bytes of those tiles.
    pub in_flight_bytes: u64,
    /// Loads begun.
    pub requests: u64,
    /// Loads called off.
    pub cancelled: u64,
    /// Loads that failed.
    pub failures: u64,
    /// Tiles put into slots, tails not counted.
    pub loaded: u64,
    /// Bytes of those tiles.
    pub uploaded_bytes: u64,
    /// Pages that became resident because their content was in a slot already: without a load and without an
    /// upload.
    pub shared: u64,
    /// Tiles that lost their slots.
    pub evicted: u64,
    /// Tiles loaded again within 60 frames of their eviction.
    pub reloaded: u64,
    /// Tiles that came and were no longer wanted, or out of date.
    pub wasted: u64,
    /// Frames from a page's being in the working set to its being resident, summed over the tiles that came
    /// while their pages were.
    pub waited_frames: u64,
    /// Feedback pixels of the last jitter cycle.
    pub pixels: u64,
    /// Feedback pixels of the last jitter cycle whose wanted page, at mip bias 0, was resident when the
    /// newest feedback came; a tail always is.
    pub pixels_at_wanted: u64,
    /// Levels by which resident pages were coarser than wanted at mip bias 0, summed over these pixels.
    pub levels_short: u64,
    /// Tiles put over older ones of the same pages, whose content had changed.
    pub refreshed: u64,
}

impl Stats {
    /// Counters since an earlier moment, and the present state.
    pub fn since(self, earlier: &Stats) -> Stats {
        Stats {
            requests: self.requests - earlier.requests,
            cancelled: self.cancelled - earlier.cancelled,
            failures: self.failures - earlier.failures,
            loaded: self.loaded - earlier.loaded,
            uploaded_bytes: self.uploaded_bytes - earlier.uploaded_bytes,
            shared: self.shared - earlier.shared,
            evicted: self.evicted - earlier.evicted,
            reloaded: self.reloaded - earlier.reloaded,
            wasted: self.wasted - earlier.wasted,
            refreshed: self.refreshed - earlier.refreshed,
            waited_frames: self.waited_frames - earlier.waited_frames,
            ..self
        }
    }

    /// The share of the feedback pixels whose wanted page, at mip bias 0, is resident, 0 to 1; 1 where there
    /// are none.
    pub fn share_at_wanted(&self) -> f64 {
        if self.pixels == 0 { 1.0 } else { self.pixels_at_wanted as f64 / self.pixels as f64 }
    }

    /// Levels by which what is resident is coarser than what is wanted at mip bias 0, on average over the
    /// feedback pixels.
    pub fn mean_levels_short(&self) -> f64 {
        self.levels_short as f64 / self.pixels.max(1) as f64
    }

    /// Of two pools together; the mip bias is the larger one.
    pub(crate) fn joined(self, other: Stats) -> Stats {
        Stats {
            slots: self.slots + other.slots,
            occupied: self.occupied + other.occupied,
            resident: self.resident + other.resident,
            tails: self.tails + other.tails,
            locked: self.locked + other.locked,
            wanted: self.wanted + other.wanted,
            wanted_at_bias: self.wanted_at_bias + other.wanted_at_bias,
            bias_eighths: self.bias_eighths.max(other.bias_eighths),
            missing: self.missing + other.missing,
            failed: self.failed + other.failed,
            in_flight: self.in_flight + other.in_flight,
            in_flight_bytes: self.in_flight_bytes + other.in_flight_bytes,
            requests: self.requests + other.requests,
            cancelled: self.cancelled + other.cancelled,
            failures: self.failures + other.failures,
            loaded: self.loaded + other.loaded,
            uploaded_bytes: self.uploaded_bytes + other.uploaded_bytes,
            shared: self.shared + other.shared,
            evicted: self.evicted + other.evicted,
            reloaded: self.reloaded + other.reloaded,
            wasted: self.wasted + other.wasted,
            waited_frames: self.waited_frames + other.waited_frames,
            pixels: self.pixels + other.pixels,
            pixels_at_wanted: self.pixels_at_wanted + other.pixels_at_wanted,
            levels_short: self.levels_short + other.levels_short,
            refreshed: self.refreshed + other.refreshed,
        }
    }
}
