//! Transforms between spaces, and all border arithmetic.
//!
//! Spaces, in the order in which a sample meets them: virtual uv, level texel, page texel (from the first
//! payload texel of the page), tile texel (from the first border texel), slot, atlas texel. Transforms are
//! named `target_from_source`. The same arithmetic stands in WGSL in `vastex-wgpu`, beside its CPU twin.

use crate::texture::geometry::{AddressMode, Geometry};
use crate::texture::page::PagePos;

/// A box of texels of one level; `origin` may lie outside the level, where address modes decide.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Box3 {
    /// First texel.
    pub origin: [i64; 3],
    /// Texels along each axis.
    pub size: [u32; 3],
}

/// The texel inside `0..size` that `texel` stands for under an address mode. `size` is not 0.
///
/// Beyond an edge of [`AddressMode::Border`] there is no texel but a colour; then this is the
/// nearest texel, so that whoever only asks for places needs no third answer.
///
/// ```
/// use vastex_core::{AddressMode, fold};
/// assert_eq!([-2, -1, 0, 2, 3, 4].map(|i| fold(AddressMode::Clamp, i, 3)), [0, 0, 0, 2, 2, 2]);
/// assert_eq!([-2, -1, 0, 2, 3, 4].map(|i| fold(AddressMode::Wrap, i, 3)), [1, 2, 0, 2, 0, 1]);
/// assert_eq!([-2, -1, 0, 2, 3, 4].map(|i| fold(AddressMode::Mirror, i, 3)), [1, 0, 0, 2, 2, 1]);
/// ```
pub fn fold(mode: AddressMode, texel: i64, size: u32) -> u32 {
    let n = i64::from(size);
    let inside = match mode {
        AddressMode::Clamp | AddressMode::Border => texel.clamp(0, n - 1),
        AddressMode::Wrap => texel.rem_euclid(n),
        AddressMode::Mirror => {
            let i = texel.rem_euclid(2 * n);
            if i < n { i } else { 2 * n - 1 - i }
        }
    };
    inside as u32
}

/// Returns true if the border colour lies at `texel`, and no texel of `0..size`.
pub fn is_border_color(mode: AddressMode, texel: i64, size: u32) -> bool {
    mode == AddressMode::Border && !(0..i64::from(size)).contains(&texel)
}

/// Texels side by side along an axis, as an address mode has them ([`fold_runs`]).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TexelRun {
    /// The first texel of the run, whose neighbours follow in order; `None` where all of them have
    /// the border colour.
    pub first: Option<u32>,
    /// How many there are, 1 at least.
    pub len: u32,
}

/// The texels that stand for `count` texels from `first` on, of an axis with `size` texels, in as few runs as
/// they make. Costs a step for each texel.
///
/// ```
/// use vastex_core::{AddressMode, TexelRun, fold_runs};
/// let runs = fold_runs(AddressMode::Wrap, 10, -2, 5);
/// assert_eq!(runs, [TexelRun { first: Some(8), len: 2 }, TexelRun { first: Some(0), len: 3 }]);
/// ```
pub fn fold_runs(mode: AddressMode, size: u32, first: i64, count: u32) -> Vec<TexelRun> {
    let mut runs: Vec<TexelRun> = Vec::new();
    for texel in (first..).take(count as usize) {
        let is_colour = is_border_color(mode, texel, size);
        let from = (!is_colour).then(|| fold(mode, texel, size));
        match runs.last_mut() {
            Some(TexelRun { first: None, len }) if is_colour => *len += 1,
            Some(TexelRun { first: Some(first), len }) if from == Some(*first + *len) => *len += 1,
            _ => runs.push(TexelRun { first: from, len: 1 }),
        }
    }
    runs
}

impl Geometry {
    /// The first payload texel of a page finer than the tail, in texels of its level.
    pub fn level_texel_from_page(&self, pos: PagePos) -> [u64; 3] {
        let (page, coords) = (self.page(), pos.coords());
        std::array::from_fn(|a| u64::from(coords[a]) * u64::from(page[a]))
    }

    /// The texels of its level that the tile of a page finer than the tail holds, borders included.
    pub fn level_box_of_tile(&self, pos: PagePos) -> Box3 {
        let (first, border) = (self.level_texel_from_page(pos), self.border());
        Box3 { origin: std::array::from_fn(|a| first[a] as i64 - i64::from(border[a])), size: self.tile() }
    }

    /// The texels of a level of the tail that the tail's tile holds, borders included.
    pub fn level_box_of_tail(&self, level: u8) -> Box3 {
        let (size, border) = (self.level(level).size, self.border());
        Box3 { origin: border.map(|b| -i64::from(b)), size: std::array::from_fn(|a| size[a] + 2 * border[a]) }
    }

    /// The boxes of texels that the tile of a page holds, borders included: the level, the box in it, and
    /// where the box begins in the tile. A page finer than the tail has one box, the tail one for each of its
    /// levels.
    pub fn tile_boxes(&self, pos: PagePos) -> impl Iterator<Item = (u8, Box3, [u32; 3])> + '_ {
        let is_tail = self.is_tail(pos);
        let levels = if is_tail { pos.level..=self.coarsest() } else { pos.level..=pos.level };
        levels.map(move |level| match is_tail {
            true => (level, self.level_box_of_tail(level), self.tail().offset(level)),
            false => (level, self.level_box_of_tile(pos), [0; 3]),
        })
    }

    /// Where the payload texel `page_texel` of a page finer than the tail lies in its tile.
    pub fn tile_texel_from_page_texel(&self, page_texel: [u32; 3]) -> [u32; 3] {
        let border = self.border();
        std::array::from_fn(|a| page_texel[a] + border[a])
    }

    /// Where texel `level_texel` of a level of the tail lies in the tail's tile.
    pub fn tile_texel_from_tail_texel(&self, level: u8, level_texel: [u32; 3]) -> [u32; 3] {
        let (offset, border) = (self.tail().offset(level), self.border());
        std::array::from_fn(|a| offset[a] + border[a] + level_texel[a])
    }

    /// The texel of the level, inside it, that `texel` stands for under the texture's address modes.
    pub fn fold_texel(&self, level: u8, texel: [i64; 3]) -> [u32; 3] {
        let (size, address) = (self.level(level).size, self.address());
        std::array::from_fn(|a| fold(address[a], texel[a], size[a]))
    }

    /// Returns true if the border colour lies at a place of the level, and no texel.
    pub fn is_border_color(&self, level: u8, texel: [i64; 3]) -> bool {
        let (size, address) = (self.level(level).size, self.address());
        (0..3).any(|a| is_border_color(address[a], texel[a], size[a]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::texture::geometry::GeometrySpec;

    #[test]
    fn a_tile_reaches_its_border_beyond_the_page() {
        let geometry =
            Geometry::new(GeometrySpec { page: 100, border: 3, ..GeometrySpec::image(250, 120) }).unwrap();
        let tile = geometry.level_box_of_tile(PagePos::new_2d(0, 2, 1));
        assert_eq!(tile, Box3 { origin: [197, 97, 0], size: [106, 106, 1] });
        assert_eq!(geometry.fold_texel(0, [303, -3, 0]), [249, 0, 0]);
        assert_eq!(geometry.tile_texel_from_page_texel([0, 99, 0]), [3, 102, 0]);
    }

    #[test]
    fn a_level_of_the_tail_carries_its_own_border() {
        let geometry = Geometry::new(GeometrySpec::image(1000, 777)).unwrap();
        let level = geometry.coarsest();
        assert_eq!(geometry.level_box_of_tail(level), Box3 { origin: [-4, -4, 0], size: [9, 9, 1] });
        let offset = geometry.tail().offset(level);
        assert_eq!(geometry.tile_texel_from_tail_texel(level, [0; 3]), [offset[0] + 4, offset[1] + 4, 0]);
    }
}
