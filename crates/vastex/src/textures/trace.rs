//! Traces of what views want.

use vastex_core::{CameraPosition, Trace};

use super::{Ahead, Textures};
use crate::error::Error;

/// The trace of what views want; [`Ahead::trace`] gives it.
pub struct TraceControl<'a> {
    textures: &'a mut Textures,
}

impl<'a> Ahead<'a> {
    /// The trace of what views want, of which [prefetch sets](crate::prefetch::PrefetchSets) are learnt.
    pub fn trace(self) -> TraceControl<'a> {
        TraceControl { textures: self.textures }
    }
}

impl TraceControl<'_> {
    /// Says where the camera is in this frame, for traces from which prefetch sets are learnt: its position,
    /// or any other three numbers that say best what it sees. See
    /// [`prefetch::PrefetchSets`](crate::prefetch::PrefetchSets).
    pub fn set_camera_position(&mut self, place: CameraPosition) {
        self.textures.watch.set_camera_position(self.textures.paging.frame(), place);
    }

    /// Begins a trace: from now on what each feedback wants is kept. A trace that was under way is dropped.
    pub fn record(&mut self) {
        self.textures.watch.record_trace();
    }

    /// The trace since [`TraceControl::record`], which ends it; `None` if none was begun.
    pub fn take(&mut self) -> Result<Option<Trace>, Error> {
        self.textures.watch.take_trace()
    }
}
