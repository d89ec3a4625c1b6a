//! The decoded tiles that queries on the CPU go through: the ones used last, within a budget of bytes, and
//! those of layers that are kept for as long as they are in the pool.
//!
//! Which tile answers a query is `sample`'s business.

use std::sync::{Mutex, MutexGuard, PoisonError};

use bytes::Bytes;
use rustc_hash::FxHashMap;
use vastex_core::{Geometry, PagePos, PoolId, Region, Slot, SlotMove, TextureNumber};
use vastex_tiles::decode_layer;

use crate::ids::LayerId;

/// What queries on the CPU have found so far, and what is held for them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CpuStats {
    /// Tiles of layers that are held decoded because they were asked for; the bytes never exceed
    /// [`Settings::cpu_cache_bytes`](crate::Settings::cpu_cache_bytes).
    pub tiles: u64,
    /// Bytes of those decoded tiles.
    pub bytes: u64,
    /// Tiles of layers that [`TextureMut::keep_for_cpu`](crate::TextureMut::keep_for_cpu) holds.
    pub kept_tiles: u64,
    /// Bytes of the kept tiles: at most the layer's part of its pool.
    pub kept_bytes: u64,
    /// Times that a decoded tile was at hand.
    pub hits: u64,
    /// Times that an encoded one was, and had to be decoded.
    pub decoded: u64,
    /// Times that neither was, so that a coarser tile had to be looked for.
    pub misses: u64,
}

/// The decoded tiles that queries go through.
#[derive(Debug)]
pub(crate) struct CpuTiles {
    budget: u64,
    used: Mutex<Used>,
    kept_layers: Vec<LayerId>,
    /// Texels of layers, by their numbers.
    kept: FxHashMap<(PoolId, Slot), Vec<(usize, Bytes)>>,
}

/// The tiles used last.
#[derive(Debug, Default)]
struct Used {
    /// Each with the use that was its last.
    tiles: FxHashMap<(LayerId, PagePos), (Bytes, u64)>,
    uses: u64,
    stats: CpuStats,
}

impl CpuTiles {
    pub(crate) fn new(budget: u64) -> CpuTiles {
        CpuTiles { budget, used: Mutex::default(), kept_layers: Vec::new(), kept: FxHashMap::default() }
    }

    /// Each change is made whole under the lock, so a panic elsewhere does no harm.
    fn used(&self) -> MutexGuard<'_, Used> {
        self.used.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(crate) fn stats(&self) -> CpuStats {
        let bytes =
            |kept: &Vec<(usize, Bytes)>| kept.iter().map(|(_, texels)| texels.len() as u64).sum::<u64>();
        CpuStats {
            kept_tiles: self.kept.values().map(|kept| kept.len() as u64).sum(),
            kept_bytes: self.kept.values().map(bytes).sum(),
            ..self.used().stats
        }
    }

    /// The texels of a page, if they were asked for lately; else those that `decode` gives, if it gives any.
    pub(crate) fn find(
        &self,
        layer: LayerId,
        pos: PagePos,
        decode: impl FnOnce() -> Option<Bytes>,
    ) -> Option<Bytes> {
        let mut used = self.used();
        used.uses += 1;
        let now = used.uses;
        if let Some((texels, last_use)) = used.tiles.get_mut(&(layer, pos)) {
            *last_use = now;
            let texels = texels.clone();
            used.stats.hits += 1;
            return Some(texels);
        }
        let Some(texels) = decode() else {
            used.stats.misses += 1;
            return None;
        };
        used.stats.decoded += 1;
        used.insert((layer, pos), &texels, self.budget);
        Some(texels)
    }

    /// From now on, keeps what comes of a layer; or no longer.
    pub(crate) fn keep(&mut self, layer: LayerId, keep: bool) {
        self.kept_layers.retain(|&kept| kept != layer);
        if keep {
            self.kept_layers.push(layer);
        }
        if self.kept_layers.is_empty() {
            self.kept.clear();
        }
    }

    pub(crate) fn keeps(&self, layer: LayerId) -> bool {
        self.kept_layers.contains(&layer)
    }

    /// What is kept of a layer in a slot.
    pub(crate) fn kept(&self, pool: PoolId, slot: Slot, layer: LayerId) -> Option<Bytes> {
        let kept = self.kept.get(&(pool, slot))?;
        let (_, texels) = kept.iter().find(|(index, _)| *index == layer.index())?;
        Some(texels.clone())
    }

    /// A tile goes into a slot, its layers as `description` says. Textures of a pool share slots, so
    /// whichever it is for, the layers that any of them keeps are kept.
    pub(crate) fn uploaded(
        &mut self,
        (pool, slot): (PoolId, Slot),
        description: &vastex_core::Description,
        tile: &Bytes,
        pool_of: impl Fn(TextureNumber) -> Option<PoolId>,
    ) {
        if self.kept_layers.is_empty() {
            return;
        }
        let here = self.kept_layers.iter().filter(|layer| pool_of(layer.number()) == Some(pool));
        let mut indices: Vec<usize> = here.map(|layer| layer.index()).collect();
        indices.sort_unstable();
        indices.dedup();
        let texels = |index| (index, owned(&decode_layer(description, index, tile)));
        self.kept.insert((pool, slot), indices.into_iter().map(texels).collect());
    }

    /// Tiles of a pool are in other slots now, and those that are not named are in none.
    pub(crate) fn moved(&mut self, pool: PoolId, moves: &[SlotMove]) {
        let (mut left, rest): (FxHashMap<_, _>, FxHashMap<_, _>) =
            self.kept.drain().partition(|((of, _), _)| *of == pool);
        self.kept = rest;
        for SlotMove { from, to } in moves {
            if let Some(kept) = left.remove(&(pool, *from)) {
                self.kept.insert((pool, *to), kept);
            }
        }
    }

    /// The pools are empty.
    pub(crate) fn tiles_lost(&mut self) {
        self.kept.clear();
    }

    /// The content of a region has changed; what is in slots is replaced there.
    pub(crate) fn forget(&self, texture: TextureNumber, geometry: &Geometry, region: &Region) {
        self.used().retain(|layer, pos| layer.number() != texture || !region.concerns(geometry, pos));
    }

    /// A texture is gone.
    pub(crate) fn remove(&mut self, texture: TextureNumber) {
        self.used().retain(|layer, _| layer.number() != texture);
        self.kept_layers.retain(|layer| layer.number() != texture);
        if self.kept_layers.is_empty() {
            self.kept.clear();
        }
    }
}

impl Used {
    /// A tile beyond the whole budget is not held.
    fn insert(&mut self, key: (LayerId, PagePos), texels: &Bytes, budget: u64) {
        let cost = texels.len() as u64;
        if cost > budget {
            return;
        }
        while self.stats.bytes + cost > budget {
            // Beside the decoding that made it necessary, looking through all of them is cheap.
            let Some(oldest) = self.tiles.iter().min_by_key(|(_, (_, last_use))| *last_use) else { return };
            let oldest = *oldest.0;
            self.retain(|layer, pos| (layer, pos) != oldest);
        }
        self.tiles.insert(key, (texels.clone(), self.uses));
        self.stats.tiles += 1;
        self.stats.bytes += cost;
    }

    fn retain(&mut self, keep: impl Fn(LayerId, PagePos) -> bool) {
        self.tiles.retain(|&(layer, pos), _| keep(layer, pos));
        self.stats.tiles = self.tiles.len() as u64;
        self.stats.bytes = self.tiles.values().map(|(texels, _)| texels.len() as u64).sum();
    }
}

/// A copy of these bytes alone: a slice keeps all of the tile that it is cut from.
pub(crate) fn owned(texels: &Bytes) -> Bytes {
    Bytes::copy_from_slice(texels)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layer() -> LayerId {
        LayerId::new(crate::ids::TextureId::new(TextureNumber::new(3).unwrap(), 1), 0)
    }

    fn pos(x: u32) -> PagePos {
        PagePos::new_2d(0, x, 0)
    }

    fn tile(fill: u8) -> Option<Bytes> {
        Some(Bytes::from(vec![fill; 100]))
    }

    #[test]
    fn the_budget_holds_and_the_oldest_goes_first() {
        let tiles = CpuTiles::new(250);
        for x in [0, 1, 0, 2] {
            assert_eq!(tiles.find(layer(), pos(x), || tile(x as u8)), tile(x as u8));
        }
        let stats = tiles.stats();
        assert_eq!((stats.tiles, stats.bytes, stats.hits, stats.decoded), (2, 200, 1, 3));
        assert_eq!(tiles.find(layer(), pos(0), || None), tile(0));
        assert_eq!(tiles.find(layer(), pos(1), || None), None, "it was used longest ago");
        assert_eq!(tiles.stats().misses, 1);
    }

    #[test]
    fn a_tile_beyond_the_budget_is_passed_through() {
        let tiles = CpuTiles::new(99);
        assert_eq!(tiles.find(layer(), pos(0), || tile(7)), tile(7));
        assert_eq!(tiles.stats().bytes, 0);
    }

    #[test]
    fn tiles_that_move_are_found_where_they_are() {
        let (mut tiles, pool) = (CpuTiles::new(0), PoolId::default());
        tiles.keep(layer(), true);
        for slot in 0..3u8 {
            let texels = vec![(0, Bytes::from(vec![slot]))];
            tiles.kept.insert((pool, Slot::new(slot.into())), texels);
        }
        let [a, b, c] = [0, 1, 2].map(Slot::new);
        // Two change places.
        tiles.moved(pool, &[SlotMove { from: a, to: b }, SlotMove { from: b, to: a }]);
        let kept = [a, b, c].map(|slot| tiles.kept(pool, slot, layer()));
        assert_eq!(kept, [Some(Bytes::from(vec![1])), Some(Bytes::from(vec![0])), None]);
    }
}
