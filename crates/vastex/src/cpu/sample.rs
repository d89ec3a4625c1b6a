//! What a texture says at a point, asked on the CPU while the GPU draws it: for physics, for walking on
//! terrain, for picking.
//!
//! Queries never read a file nor wait. They are answered from tiles that are in main memory, by the finest
//! there is, and say how fine that was. The arithmetic is that of the shaders' twins in `vastex-wgpu`.
//! [`CpuTexture`](crate::CpuTexture) is for those who would rather wait than have a coarser answer.

mod volume;

use std::cell::OnceCell;
use std::fmt;

use bytes::Bytes;
use vastex_core::{LayerFormat, PageId, PagePos, PageState, PageTable, Slot, TableEntry};
use vastex_tiles::decode_layer;
use vastex_wgpu::twins::{Sampler, Texture};

use super::tiles::{CpuTiles, owned};
use crate::ids::LayerId;
use crate::paging::{PagedTexture, Paging};
use crate::settings::Filter;

/// What a texture says at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CpuSample {
    /// What a shader would get: linear, 0 to 1 but for floats.
    pub value: [f32; 4],
    /// The level of the answer: the one that was asked for, within those that there are, where its tiles are
    /// in memory; else a coarser one. Between two levels the answer is blended of both.
    pub level: f32,
}

/// Answers for one layer, from what is in main memory; see [`Cpu::sample`](crate::Cpu::sample).
#[derive(Debug)]
pub struct CpuSampler<'a> {
    tiles: AtHand<'a>,
}

impl<'a> CpuSampler<'a> {
    /// For a layer that its texture has, blended by `filter`.
    pub(super) fn new(
        cpu: &'a CpuTiles,
        paging: &'a Paging,
        state: &'a PagedTexture,
        layer: LayerId,
        filter: Filter,
    ) -> CpuSampler<'a> {
        let (tail, found) = (OnceCell::new(), Default::default());
        CpuSampler { tiles: AtHand { cpu, paging, state, layer, filter, tail, found } }
    }

    /// As [`Cpu::sample`](crate::Cpu::sample).
    pub fn sample(&mut self, uv: [f32; 2], level: f32) -> CpuSample {
        self.tiles.make_room();
        let (tiles, filter) = (&self.tiles, self.tiles.filter);
        let (texture, format) = tiles.texture(filter);
        let (geometry, tile) = (texture.geometry, |slot: Slot| tiles.texels(slot));
        let value = Sampler { texture, format, tile: &tile }.sample_level(uv, level);
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

    /// The texel of a level in which a texel of level 0 lies, as it is stored and blended with nothing,
    /// whatever the filter is; exact for textures of any size. Texels beyond the texture are taken as the
    /// address modes say. [`CpuSample::level`] is the level of the answer: `level`, within those that there
    /// are, where its tile is in memory; else a coarser one.
    pub fn texel(&mut self, texel: [u32; 2], level: u8) -> CpuSample {
        self.tiles.make_room();
        let tiles = &self.tiles;
        let (texture, format) = tiles.texture(Filter::Nearest);
        let level = level.min(texture.geometry.coarsest());
        let found = texture.place_of_texel(texel, level).level;
        let tile = |slot: Slot| tiles.texels(slot);
        let sampler = Sampler { texture, format, tile: &tile };
        CpuSample { value: sampler.sample_fixed_level(texel, [0.5; 2], level.into()), level: found.into() }
    }

    /// The finest level at which a texel of level 0, one that the texture has, is on the GPU; levels that are
    /// always there count as the first of them. Costs a look for each level, and decodes nothing.
    pub fn resident_level(&self, texel: [u32; 2]) -> u8 {
        let AtHand { state, paging, layer, .. } = &self.tiles;
        let (geometry, pager) = (&state.description.geometry, paging.pager());
        let page = geometry.page();
        let finest = PagePos { level: 0, x: texel[0] / page[0], y: texel[1] / page[1], z: 0 };
        let is_resident = |level: &u8| {
            let id = PageId::new(layer.number(), geometry.dims(), geometry.ancestor(finest, *level));
            id.is_ok_and(|id| matches!(pager.state(id), PageState::Resident(_)))
        };
        let tail = geometry.tail().first_level();
        (0..tail).find(is_resident).unwrap_or(tail)
    }
}

/// Tiles that queries have found so far.
const FOUND: usize = 16;
/// Of those, as many as one query may need.
const OF_ONE_QUERY: usize = 8;

/// In the place of a page table: which tile in memory stands for a page. The slot of a tile is its place
/// here.
struct AtHand<'a> {
    cpu: &'a CpuTiles,
    paging: &'a Paging,
    state: &'a PagedTexture,
    layer: LayerId,
    filter: Filter,
    /// The layer's texels in the tail.
    tail: OnceCell<Bytes>,
    found: [OnceCell<Found>; FOUND],
}

/// The finest tile in memory that covers a page.
struct Found {
    page: PagePos,
    level: u8,
    /// `None` if it is the tail.
    texels: Option<Bytes>,
}

/// The slot that stands for the tail.
const TAIL: Slot = Slot::new(FOUND as u32);

impl AtHand<'_> {
    /// The texture as the layer sees it, through these tiles, and the format of its texels.
    fn texture(&self, filter: Filter) -> (Texture<'_>, LayerFormat) {
        let description = self.state.source.description();
        let layer = &description.layers[self.layer.index()];
        let mut texture = Texture::new(&description.geometry, self, self.layer.number());
        (texture.filter, texture.layer_scale) = (filter, layer.scale);
        (texture, layer.format)
    }

    /// The tail's texels of a layer: as they are, or decoded once for many queries.
    fn texels_of_tail(&self) -> Bytes {
        let (state, layer) = (self.state, self.layer);
        let held = state.source.description();
        let texels = || decode_layer(held, layer.index(), &state.tail);
        if !held.layers[layer.index()].format.is_compressed() {
            return texels();
        }
        let found = self.cpu.find(layer, state.description.geometry.tail_pos(), || Some(texels()));
        found.unwrap_or_else(texels)
    }

    /// The texels of a page of a layer, if they are in main memory.
    fn texels_at_hand(&self, pos: PagePos) -> Option<Bytes> {
        let (state, layer) = (self.state, self.layer);
        if self.cpu.keeps(layer) {
            let page = PageId::new(layer.number(), state.description.geometry.dims(), pos).ok()?;
            let pager = self.paging.pager();
            let kept = match (pager.state(page), pager.pool_of(layer.number())) {
                (PageState::Resident(slot), Some(pool)) => self.cpu.kept(pool, slot, layer),
                _ => None,
            };
            if kept.is_some() {
                return kept;
            }
        }
        let held = state.source.description();
        self.cpu.find(layer, pos, || {
            let tile = state.source.at_hand(pos)?.decode(held).ok()?;
            Some(owned(&decode_layer(held, layer.index(), &tile)))
        })
    }

    /// Forgets what was found where the next query might need more room than there is.
    fn make_room(&mut self) {
        if self.found[FOUND - OF_ONE_QUERY].get().is_some() {
            self.found = Default::default();
        }
    }

    fn texels(&self, slot: Slot) -> &[u8] {
        let found = self.found.get(slot.index() as usize).and_then(OnceCell::get);
        let tail = || self.tail.get_or_init(|| self.texels_of_tail());
        found.and_then(|found| found.texels.as_ref()).unwrap_or_else(tail)
    }

    fn find(&self, page: PagePos) -> Found {
        let geometry = &self.state.description.geometry;
        let tail = geometry.tail().first_level();
        let at_hand = |level| {
            let pos = geometry.ancestor(page, level);
            let texels = self.texels_at_hand(pos)?;
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
