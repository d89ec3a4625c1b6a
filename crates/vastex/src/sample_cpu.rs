//! What a texture says at a point, asked on the CPU while the GPU draws it: for physics, for walking on terrain, for picking.
//!
//! Queries never read a file nor wait. They are answered from tiles that are in main memory, by the finest there is, and say how
//! fine that was. The arithmetic is that of the shaders' twins in `vastex-wgpu`. [`crate::CpuTexture`] is for those who would rather
//! wait than have a coarser answer.

use std::cell::OnceCell;
use std::fmt;

use bytes::Bytes;
use vastex_core::{PageId, PagePos, PageState, PageTable, PoolId, Slot, TableEntry, Upload};
use vastex_tiles::decode_layer;
use vastex_wgpu::twins::{Sampler, Texture};

use crate::cpu_tiles::{CpuStats, owned};
use crate::layer::LayerId;
use crate::settings::Filter;
use crate::textures::{TextureState, Textures};

/// What a texture says at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CpuSample {
    /// What a shader would get: linear, 0 to 1 but for floats.
    pub value: [f32; 4],
    /// The level of the answer: the one that was asked for, within those that there are, where its tiles are in memory; else a
    /// coarser one. Between two levels the answer is blended of both.
    pub level: f32,
}

impl Textures {
    /// What a layer says at `uv`, `level` levels coarser than level 0, as `vastex_sample_level(uv, level)` does on the GPU, with the same
    /// filter and address modes, and across pages. The level is taken as it is: neither the texture's bias nor its pool's is
    /// added ([`Textures::bias_eighths`] tells the latter, for who wants what is drawn).
    ///
    /// It never reads nor waits: the answer comes from the tiles of [`Textures::keep_for_cpu`], from the RAM cache
    /// ([`crate::Settings::ram_cache_bytes`]) or from the tail, whichever is finest, and [`CpuSample::level`] says how fine that is. A
    /// tile in the pool answers if it is kept, or has not left the RAM cache; one that was seen before answers as long as
    /// the RAM cache has it. Nothing where the texture was removed or has no such layer.
    ///
    /// Costs about a microsecond where decoded tiles are at hand; a tile that has to be decoded, once, as much as
    /// the loader takes for it. Decoded tiles are held within [`crate::Settings::cpu_cache_bytes`]. For many points see
    /// [`Textures::cpu_sampler`].
    ///
    /// ```no_run
    /// # fn walk(textures: &vastex::Textures, island: vastex::TextureId, uv: [f32; 2]) -> Option<()> {
    /// let ground = textures.sample_cpu(textures.layer(island, "height")?, uv, 0.0)?;
    /// let metres = ground.value[0] * 65535.0 - 11_000.0;
    /// if ground.level > 2.0 { /* too coarse to stand on: it is on its way, or worth a prefetch */ }
    /// # let _ = metres;
    /// # Some(()) }
    /// ```
    pub fn sample_cpu(&self, layer: impl Into<LayerId>, uv: [f32; 2], level: f32) -> Option<CpuSample> {
        Some(self.cpu_sampler(layer)?.sample(uv, level))
    }

    /// For many points at once: what is found for one is at hand for the next.
    pub fn cpu_sampler(&self, layer: impl Into<LayerId>) -> Option<CpuSampler<'_>> {
        let layer = layer.into();
        let state = self.textures.get(usize::from(layer.texture().number()))?.as_ref()?;
        let held = state.source.description();
        held.layers.get(layer.index())?;
        Some(CpuSampler {
            tiles: AtHand { textures: self, state, layer, tail: OnceCell::new(), found: Default::default() },
        })
    }

    /// Keeps the layer's texels of every tile in the pool in main memory too, decoded, so that what can be seen can be asked for,
    /// whatever the RAM cache still has; or no longer. Counts for tiles that come from now on, so it is best said when the texture
    /// is added. Costs at most the layer's part of the pool once more, and a copy of each tile that is uploaded. Says
    /// whether there is such a layer.
    pub fn keep_for_cpu(&mut self, layer: impl Into<LayerId>, keep: bool) -> bool {
        let layer = layer.into();
        let exists = self.cpu_sampler(layer).is_some();
        if exists {
            self.cpu_tiles.keep(layer, keep);
        }
        exists
    }

    /// What queries on the CPU have found so far, and what is held for them.
    pub fn cpu_stats(&self) -> CpuStats {
        self.cpu_tiles.stats()
    }

    /// A tile goes to the GPU.
    pub(crate) fn note_for_cpu(&mut self, pool: PoolId, upload: &Upload) {
        let number = usize::from(upload.page.texture().number());
        let Some(Some(state)) = self.textures.get_mut(number) else { return };
        if upload.page.level() >= state.description.geometry.tail().first_level() {
            state.tail = upload.bytes.clone();
        }
        let pager = &self.pager;
        let pool_of = |texture| pager.pool_of(texture);
        self.cpu_tiles.uploaded((pool, upload.slot), state.source.description(), &upload.bytes, pool_of);
    }

    /// The tail's texels of a layer: as they are, or decoded once for many queries.
    fn texels_of_tail(&self, state: &TextureState, layer: LayerId) -> Bytes {
        let held = state.source.description();
        let texels = || decode_layer(held, layer.index(), &state.tail);
        if !held.layers[layer.index()].format.is_compressed() {
            return texels();
        }
        let found = self.cpu_tiles.find(layer, state.description.geometry.tail_pos(), || Some(texels()));
        found.unwrap_or_else(texels)
    }

    /// The texels of a page of a layer, if they are in main memory.
    fn texels_at_hand(&self, state: &TextureState, layer: LayerId, pos: PagePos) -> Option<Bytes> {
        if self.cpu_tiles.keeps(layer) {
            let page = PageId::new(layer.texture(), state.description.geometry.dims(), pos).ok()?;
            let kept = match (self.state(page), self.pool_of(layer.texture())) {
                (PageState::Resident(slot), Some(pool)) => self.cpu_tiles.kept(pool, slot, layer),
                _ => None,
            };
            if kept.is_some() {
                return kept;
            }
        }
        let held = state.source.description();
        self.cpu_tiles.find(layer, pos, || {
            let tile = state.source.at_hand(pos)?.decode(held).ok()?;
            Some(owned(&decode_layer(held, layer.index(), &tile)))
        })
    }
}

/// Answers for one layer, from what is in main memory; see [`Textures::sample_cpu`].
#[derive(Debug)]
pub struct CpuSampler<'a> {
    tiles: AtHand<'a>,
}

impl CpuSampler<'_> {
    /// As [`Textures::sample_cpu`].
    pub fn sample(&mut self, uv: [f32; 2], level: f32) -> CpuSample {
        self.tiles.make_room();
        let (tiles, textures) = (&self.tiles, self.tiles.textures);
        let description = tiles.state.source.description();
        let (geometry, layer) = (&description.geometry, &description.layers[tiles.layer.index()]);
        let mut texture = Texture::new(geometry, tiles, tiles.layer.texture());
        let filter = textures.filter(tiles.layer);
        (texture.filter, texture.layer_scale) = (filter, layer.scale);
        let tile = |slot: Slot| tiles.texels(slot);
        let value = Sampler { texture, format: layer.format, tile: &tile }.sample_level(uv, level);
        let level = texture.level(level);
        let found = |level: f32| f32::from(texture.place(uv, level as u8).level);
        let finer = found(level.floor());
        let level = match filter {
            Filter::Nearest | Filter::Bilinear => finer,
            _ => {
                let coarser = found((level.floor() + 1.0).min(f32::from(geometry.coarsest())));
                finer + (coarser - finer) * level.fract()
            }
        };
        CpuSample { value, level }
    }
}

/// Tiles that queries have found so far.
const FOUND: usize = 16;
/// Of those, as many as one query may need.
const OF_ONE_QUERY: usize = 8;

/// In the place of a page table: which tile in memory stands for a page. The slot of a tile is its place here.
struct AtHand<'a> {
    textures: &'a Textures,
    state: &'a TextureState,
    layer: LayerId,
    /// Its texels of the layer.
    tail: OnceCell<Bytes>,
    found: [OnceCell<Found>; FOUND],
}

/// The finest tile in memory that covers a page.
struct Found {
    page: PagePos,
    level: u8,
    /// Nothing where it is the tail.
    texels: Option<Bytes>,
}

/// The slot that stands for the tail.
const TAIL: Slot = Slot::new(FOUND as u32);

impl AtHand<'_> {
    /// Forgets what was found where the next query might need more room than there is.
    fn make_room(&mut self) {
        if self.found[FOUND - OF_ONE_QUERY].get().is_some() {
            self.found = Default::default();
        }
    }

    fn texels(&self, slot: Slot) -> &[u8] {
        let found = self.found.get(slot.index() as usize).and_then(OnceCell::get);
        let tail = || self.tail.get_or_init(|| self.textures.texels_of_tail(self.state, self.layer));
        found.and_then(|found| found.texels.as_ref()).unwrap_or_else(tail)
    }

    fn find(&self, page: PagePos) -> Found {
        let geometry = &self.state.description.geometry;
        let tail = geometry.tail().first_level();
        let at_hand = |level| {
            let pos = geometry.ancestor(page, level);
            let texels = self.textures.texels_at_hand(self.state, self.layer, pos)?;
            Some(Found { page, level, texels: Some(texels) })
        };
        (page.level..tail).find_map(at_hand).unwrap_or(Found { page, level: tail, texels: None })
    }
}

impl PageTable for AtHand<'_> {
    fn lookup(&self, page: PagePos) -> TableEntry {
        let tail = self.state.description.geometry.tail().first_level();
        if page.level >= tail {
            return TableEntry::new(tail, TAIL);
        }
        for (place, cell) in (0..).zip(&self.found) {
            let found = cell.get_or_init(|| self.find(page));
            if found.page == page {
                let slot = if found.texels.is_some() { Slot::new(place) } else { TAIL };
                return TableEntry::new(found.level, slot);
            }
        }
        TableEntry::new(tail, TAIL)
    }
}

impl fmt::Debug for AtHand<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("AtHand").field("layer", &self.layer).finish_non_exhaustive()
    }
}
