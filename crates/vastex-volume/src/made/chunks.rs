//! Chunks of made levels, to be read as those of stored ones are; and the stored ones that they are made of.

use super::Made;
use crate::chunks::{Chunk, ChunkFuture, ChunkSource, Presence, PresenceFuture};
use crate::volume::Shared;

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

/// Stored chunks, of which those that cannot be read are absent. What is known to be absent is not looked
/// for.
pub(super) struct Lenient<'a> {
    pub(super) made: &'a Made,
    pub(super) shared: Shared<'a>,
}

impl ChunkSource for Lenient<'_> {
    fn read<'a>(&'a self, coords: &'a [u64]) -> ChunkFuture<'a> {
        Box::pin(async move {
            if self.made.is_not_stored(coords) {
                return Ok(None);
            }
            Ok(self.shared.read(coords).await.unwrap_or_else(|error| {
                self.made.fault(error);
                None
            }))
        })
    }

    fn at_hand(&self, coords: &[u64], axes: usize) -> Vec<Option<Option<Chunk>>> {
        self.shared.at_hand(coords, axes)
    }

    fn is_under_way(&self, coords: &[u64]) -> bool {
        self.shared.is_under_way(coords)
    }

    fn fill(&self) -> [u8; 8] {
        self.shared.fill()
    }

    fn presence(&self, most: usize) -> PresenceFuture<'_> {
        self.shared.presence(most)
    }
}
