//! Twin of page.wgsl and place.wgsl: from a virtual uv and a level to a texel of a tile.

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

/// A texel of level 0, and how far into it; beyond an edge that is clamped or has a border colour, less than
/// 0 or more than 1.
#[derive(Clone, Copy, Debug)]
pub(super) struct Position {
    pub(super) texel: [u32; 2],
    pub(super) fraction: [f32; 2],
    /// -1 where a mirrored texture runs backwards, else 1.
    pub(super) direction: [f32; 2],
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
fn folded_direction(uv: f32, mode: AddressMode) -> f32 {
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
            direction: [0, 1].map(|a| folded_direction(uv[a], address[a])),
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

    /// `vastexi_place`: the same for a position.
    pub(super) fn place_of(&self, position: Position, wanted: u8) -> Place {
        if wanted >= self.geometry.tail().first_level() {
            return self.place_in_tail(position, wanted);
        }
        let entry = self.table.lookup(self.page_from_position(position, wanted));
        if entry.level() >= self.geometry.tail().first_level() {
            return self.place_in_tail(position, entry.level());
        }
        self.place_in_slot(entry.slot(), self.tile_texel(position, entry.level()), entry.level())
    }

    fn place_in_tail(&self, position: Position, level: u8) -> Place {
        let slot = self.table.lookup(self.geometry.tail_pos()).slot();
        self.place_in_slot(slot, self.tile_texel(position, level), level)
    }

    /// `vastexi_tile_texel`: where a position lies in the tile of its page of a level, in texels of the
    /// texture. Beyond the edges it goes as far as the border colour is mixed with nothing.
    fn tile_texel(&self, position: Position, level: u8) -> [f32; 2] {
        let (first, page_texel) = self.page_in_tile(position, level);
        let texel = self.page_texel(position, level);
        let reach = 0.5 * self.layer_scale as f32;
        std::array::from_fn(|a| {
            let end = self.geometry.level(level).size[a].next_multiple_of(self.layer_scale) - page_texel[a];
            first[a] as f32 + texel[a].clamp(-(page_texel[a] as f32) - reach, end as f32 + reach)
        })
    }

    /// `vastexi_free_tile_texel`: a position in the tile of its page of a level, in texels of the layer, not
    /// clamped to the texture.
    pub(super) fn free_tile_texel(&self, position: Position, level: u8) -> [f32; 2] {
        let (first, _) = self.page_in_tile(position, level);
        let texel = self.page_texel(position, level);
        std::array::from_fn(|a| (first[a] as f32 + texel[a]) / self.layer_scale as f32)
    }

    /// Where a position lies in a level, in the level's texels from the first one of its page.
    fn page_texel(&self, position: Position, level: u8) -> [f32; 2] {
        let (at, offset) = (self.geometry.level(level), self.geometry.sample_offset(level));
        let (_, page_texel) = self.page_in_tile(position, level);
        std::array::from_fn(|a| {
            let from_page =
                (position.texel[a] - page_texel[a] * at.scale[a] as u32) as f32 + position.fraction[a];
            from_page / at.scale[a] as f32 + offset[a] as f32
        })
    }

    /// The first texel of the page that has a position: in its tile, and in the level. The tail's levels are
    /// pages of their own.
    fn page_in_tile(&self, position: Position, level: u8) -> ([u32; 2], [u32; 2]) {
        if level >= self.geometry.tail().first_level() {
            let [x, y, _] = self.geometry.tile_texel_from_tail_texel(level, [0; 3]);
            return ([x, y], [0, 0]);
        }
        let (page, size) = (self.page_from_position(position, level).coords(), self.geometry.page());
        let [x, y, _] = self.geometry.border();
        ([x, y], [page[0] * size[0], page[1] * size[1]])
    }

    fn place_in_slot(&self, slot: Slot, tile_texel: [f32; 2], level: u8) -> Place {
        Place { slot, tile_texel: tile_texel.map(|texel| texel / self.layer_scale as f32), level }
    }
}
