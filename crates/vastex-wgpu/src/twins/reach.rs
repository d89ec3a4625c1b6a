//! Twin of reach.wgsl: what lies beside a position.
//!
//! The shader asks of most filters whether a place is in the slot (`vastexi_are_in_tile`,
//! `vastexi_is_in_tile`), where the twin asks whether it is in the page's payload and border. Both give the
//! same texels: a place that the texture has and that is near a position in the page is never in what else
//! the slot has, as the shader's comment says.

use super::Texture;
use super::lookup::{Place, Position};

impl Texture<'_> {
    /// Between which texels of the tile that has a position at a level four texels around a place are all in
    /// the tile.
    pub(super) fn tile_bounds(&self, position: Position, level: u8) -> [[f32; 2]; 2] {
        if position.fraction.iter().any(|fraction| !(0.0..=1.0).contains(fraction)) {
            return [[0.0; 2]; 2];
        }
        let (size, scale) = (self.geometry.level(level).size, self.layer_scale);
        let (border, page_size) = (self.geometry.border(), self.geometry.page());
        let is_in_tail = level >= self.geometry.tail().first_level();
        let bounds = [0, 1].map(|a| {
            let (first, payload) = if is_in_tail {
                (self.geometry.tail().offset(level)[a], size[a])
            } else {
                let page = self.page_from_position(position, level).coords();
                (0, page_size[a].min(size[a] - page[a] * page_size[a]))
            };
            let last = first / scale + 2 * border[a] / scale + payload.div_ceil(scale);
            [(first / scale) as f32 + 0.5, last as f32 - 0.5]
        });
        [0, 1].map(|end| bounds.map(|bound| bound[end]))
    }

    /// The place `offset` texels of level 0 from a position, whose own place and the bounds of whose tile are
    /// known, where it is in that tile.
    pub(super) fn place_in_tile(
        &self,
        position: Position,
        place: Place,
        [first, last]: [[f32; 2]; 2],
        offset: [f32; 2],
    ) -> Option<Place> {
        let scale = self.geometry.level(place.level).scale;
        let tile_texel =
            [0, 1].map(|a| place.tile_texel[a] + offset[a] / (scale[a] as f32 * self.layer_scale as f32));
        let is_near = |a: usize| {
            let before = position.texel[a] as f32 + position.fraction[a];
            let after = (self.geometry.size()[a] - position.texel[a]) as f32 - position.fraction[a];
            (-before..=after).contains(&offset[a]) && (first[a]..last[a]).contains(&tile_texel[a])
        };
        (is_near(0) && is_near(1)).then_some(Place { tile_texel, ..place })
    }

    /// Where that is beyond the tile, as a position of its own.
    pub(super) fn position_beside(&self, position: Position, offset: [f32; 2]) -> Position {
        let from_texel = [0, 1].map(|a| position.fraction[a] + offset[a]);
        self.position_from_fixed(position.texel, from_texel)
    }
}
