//! Twin of lookup.wgsl: from a virtual uv and a level to a texel of a tile.

use vastex_core::{AddressMode, PagePos, Slot};

use super::Texture;

/// A place in the pool.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// The slot.
    pub slot: Slot,
    /// The place in the slot's tile, in texels of the sampled layer from the first of its border.
    pub tile_texel: [f32; 2],
    /// The level that lies there.
    pub level: u8,
}

/// A texel of level 0, and how far into it; beyond an edge that is clamped or has a border colour, less than 0 or more than 1.
#[derive(Clone, Copy, Debug)]
pub(super) struct Position {
    pub(super) texel: [u32; 2],
    pub(super) fraction: [f32; 2],
    /// -1 where a mirrored texture runs backwards, else 1.
    pub(super) way: [f32; 2],
}

fn folded_uv(uv: f32, mode: AddressMode) -> f32 {
    match mode {
        AddressMode::Clamp | AddressMode::Border => uv.clamp(-8.0, 9.0),
        AddressMode::Wrap => uv - uv.floor(),
        AddressMode::Mirror => {
            let turn = uv - 2.0 * (0.5 * uv).floor();
            if turn > 1.0 { 2.0 - turn } else { turn }
        }
    }
}

/// Which way a coordinate runs once it is folded.
fn folded_way(uv: f32, mode: AddressMode) -> f32 {
    let turn = uv - 2.0 * (0.5 * uv).floor();
    if mode == AddressMode::Mirror && turn > 1.0 { -1.0 } else { 1.0 }
}

impl Texture<'_> {
    pub(super) fn position_from_uv(&self, uv: [f32; 2]) -> Position {
        let (size, address) = (self.geometry.size(), self.geometry.address());
        let texel = [0, 1].map(|a| folded_uv(uv[a], address[a]) * size[a] as f32);
        let whole = [0, 1].map(|a| (texel[a].floor() as u32).min(size[a] - 1));
        Position {
            texel: whole,
            fraction: [0, 1].map(|a| texel[a] - whole[a] as f32),
            way: [0, 1].map(|a| folded_way(uv[a], address[a])),
        }
    }

    /// The page of a level finer than the tail that covers a position.
    pub(super) fn page_from_position(&self, position: Position, level: u8) -> PagePos {
        let (at, page) = (self.geometry.level(level), self.geometry.page());
        let coord = |a: usize| (position.texel[a] / at.scale[a] as u32 / page[a]).min(at.pages[a] - 1);
        PagePos::new_2d(level, coord(0), coord(1))
    }

    /// Where the finest resident page that covers `uv` at `wanted`, a level of the texture, has it.
    pub fn place(&self, uv: [f32; 2], wanted: u8) -> Place {
        self.place_of(self.position_from_uv(uv), wanted)
    }

    /// `vastex_place`: the same for a position.
    pub(super) fn place_of(&self, position: Position, wanted: u8) -> Place {
        if wanted >= self.geometry.tail().first_level() {
            return self.place_in_tail(position, wanted);
        }
        let entry = self.table.lookup(self.page_from_position(position, wanted));
        if entry.level() >= self.geometry.tail().first_level() {
            return self.place_in_tail(position, entry.level());
        }
        let (level, page) = (entry.level(), self.page_from_position(position, entry.level()).coords());
        let (scale, page_size) = (self.geometry.level(level).scale, self.geometry.page());
        let border = self.geometry.border();
        let tile_texel = [0, 1].map(|a| {
            let page_texel = page[a] * page_size[a];
            let from_page = (position.texel[a] - page_texel * scale[a] as u32) as f32 + position.fraction[a];
            border[a] as f32 + self.level_texel(a, from_page, page_texel, level)
        });
        self.place_in_slot(entry.slot(), tile_texel, level)
    }

    fn place_in_tail(&self, position: Position, level: u8) -> Place {
        let first = self.geometry.tile_texel_from_tail_texel(level, [0; 3]);
        let tile_texel = [0, 1].map(|a| {
            let texel = position.texel[a] as f32 + position.fraction[a];
            first[a] as f32 + self.level_texel(a, texel, 0, level)
        });
        self.place_in_slot(self.table.lookup(self.geometry.tail_pos()).slot(), tile_texel, level)
    }

    /// Where a position lies in a level along an axis, in the level's texels from `first`, one of them; `from_first` are
    /// texels of level 0. Beyond the edges it goes as far as the border colour is mixed with nothing.
    fn level_texel(&self, axis: usize, from_first: f32, first: u32, level: u8) -> f32 {
        let at = self.geometry.level(level);
        let end = at.size[axis].next_multiple_of(self.layer_scale) - first;
        let reach = 0.5 * self.layer_scale as f32;
        let offset = self.geometry.sample_offset(level)[axis] as f32;
        let texel = from_first / at.scale[axis] as f32 + offset;
        texel.clamp(-(first as f32) - reach, end as f32 + reach)
    }

    fn place_in_slot(&self, slot: Slot, tile_texel: [f32; 2], level: u8) -> Place {
        Place { slot, tile_texel: tile_texel.map(|texel| texel / self.layer_scale as f32), level }
    }
}
