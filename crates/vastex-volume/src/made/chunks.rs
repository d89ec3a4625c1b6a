//! Chunks of made levels, to be read as those of stored ones are.

use super::Made;
use crate::chunks::{ChunkFuture, ChunkSource, Presence, PresenceFuture};

/// The chunks of a made level.
pub(crate) struct MadeChunks<'a> {
    pub(super) made: &'a Made,
    pub(super) level: usize,
    pub(super) asks: bool,
}

impl ChunkSource for MadeChunks<'_> {
    fn read<'a>(&'a self, coords: &'a [u64]) -> ChunkFuture<'a> {
        let at = [coords[2], coords[1], coords[0]];
        Box::pin(async move { self.made.chunk(self.level, at, self.asks).await })
    }

    fn fill(&self) -> [u8; 8] {
        self.made.base.volume.shared(self.made.base.level).fill()
    }

    fn presence(&self, _: usize) -> PresenceFuture<'_> {
        Box::pin(async { Ok(Presence::All) })
    }
}
