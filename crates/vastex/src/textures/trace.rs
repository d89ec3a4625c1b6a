//! Traces of what views want, and telemetry.

use vastex_core::{History, Place, Trace};

use super::Textures;
use crate::error::Error;
use crate::watch::PoolRecord;

impl Textures {
    /// Says where the camera is in this frame, for traces from which prefetch sets are learnt: its position, or any other three
    /// numbers that say best what it sees. See [`crate::PrefetchSets`].
    pub fn set_place(&mut self, place: Place) {
        self.watch.set_place(self.paging.frame(), place);
    }

    /// Begins a trace: from now on what each feedback wants is kept. A trace that was under way is dropped.
    pub fn record_trace(&mut self) {
        self.watch.record_trace();
    }

    /// The trace since [`Textures::record_trace`], which ends it; nothing where none was begun.
    pub fn take_trace(&mut self) -> Result<Option<Trace>, Error> {
        self.watch.take_trace()
    }

    /// Each pool after each of the last [`crate::Settings::telemetry_frames`] frames, oldest first.
    pub fn telemetry(&self) -> &History<PoolRecord> {
        self.watch.telemetry()
    }
}
