//! The tail: the coarsest levels of a texture, each with its border, packed into one tile.
//!
//! The tail starts at the finest level from which all that are coarser fit too. Its levels are laid out by a
//! fixed shelf rule, finest first: along x while there is room, then on a new shelf along y, then on a new
//! slab along z. Every offset is a multiple of the geometry's `tail_align`, so that a level begins on a whole
//! block of every block-compressed layer, whatever its share of the resolution. The rule is part of the
//! container format: changing it makes old files unreadable.

use crate::texture::geometry::{GeometrySpec, Level, tile_box};

/// Which levels the tail holds, and where each lies.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TailLayout {
    first_level: u8,
    offsets: Vec<[u32; 3]>,
}

impl TailLayout {
    pub(crate) fn new(spec: &GeometrySpec, levels: &[Level]) -> TailLayout {
        let tile = tile_box(spec);
        let border: [u32; 3] = std::array::from_fn(|a| if tile[a] == 1 { 0 } else { spec.border });
        let last = levels.len() - 1;
        let mut layout = TailLayout { first_level: last as u8, offsets: vec![[0; 3]] };
        for first in (0..=last).rev() {
            let boxes = levels[first..].iter().map(|l| std::array::from_fn(|a| l.size[a] + 2 * border[a]));
            let Some(offsets) = shelve(tile, spec.tail_align, boxes) else { break };
            layout = TailLayout { first_level: first as u8, offsets };
        }
        layout
    }

    /// The finest level of the tail.
    pub fn first_level(&self) -> u8 {
        self.first_level
    }

    /// This layout for a layer with one texel along each `scale`.
    pub(crate) fn divided(&self, scale: u32) -> TailLayout {
        let offsets = self.offsets.iter().map(|offset| offset.map(|n| n / scale)).collect();
        TailLayout { first_level: self.first_level, offsets }
    }

    /// Where the box of a level, border included, begins in the tail's tile, in texels. `level` is in the
    /// tail.
    pub fn offset(&self, level: u8) -> [u32; 3] {
        self.offsets[usize::from(level - self.first_level)]
    }
}

/// Places boxes in a tile by the shelf rule; `None` if they do not all fit.
fn shelve(tile: [u32; 3], align: u32, boxes: impl Iterator<Item = [u32; 3]>) -> Option<Vec<[u32; 3]>> {
    let (mut cursor, mut shelf_end, mut slab_end) = ([0u32; 3], 0, 0);
    let align = |texels: u32| texels.next_multiple_of(align);
    let fits = |at: u32, size: u32, axis: usize| at.checked_add(size).is_some_and(|end| end <= tile[axis]);
    let mut offsets = Vec::new();
    for size in boxes {
        if !fits(cursor[0], size[0], 0) {
            cursor = [0, shelf_end, cursor[2]];
        }
        if !fits(cursor[1], size[1], 1) {
            cursor = [0, 0, slab_end];
            shelf_end = 0;
        }
        if (0..3).any(|a| !fits(cursor[a], size[a], a)) {
            return None;
        }
        offsets.push(cursor);
        shelf_end = shelf_end.max(align(cursor[1] + size[1]));
        slab_end = slab_end.max(if tile[2] == 1 { 1 } else { align(cursor[2] + size[2]) });
        cursor[0] = align(cursor[0] + size[0]);
    }
    Some(offsets)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::texture::geometry::Geometry;
    use crate::texture::page::Dims;
    use proptest::prelude::*;

    fn image(width: u32, height: u32, page: u32) -> Geometry {
        Geometry::new(GeometrySpec { page, ..GeometrySpec::image(width, height) }).unwrap()
    }

    #[test]
    fn a_128_texel_page_holds_the_levels_from_64_down() {
        let geometry = image(1024, 1024, 128);
        let tail = geometry.tail();
        assert_eq!(geometry.level(tail.first_level()).size, [64, 64, 1]);
        let offsets: Vec<_> = (tail.first_level()..=geometry.coarsest()).map(|l| tail.offset(l)).collect();
        assert_eq!(
            offsets,
            [[0, 0, 0], [72, 0, 0], [112, 0, 0], [0, 72, 0], [16, 72, 0], [28, 72, 0], [40, 72, 0]]
        );
    }

    #[test]
    fn a_texture_of_one_texel_is_all_tail() {
        let geometry = image(1, 1, 128);
        assert_eq!((geometry.tail().first_level(), geometry.page_count()), (0, 1));
    }

    #[test]
    fn the_smallest_page_still_holds_the_coarsest_level() {
        let geometry = image(1000, 10, 8);
        assert_eq!(geometry.tail().first_level(), geometry.coarsest());
    }

    proptest! {
        #[test]
        fn levels_of_the_tail_never_overlap(w in 1u32..5000, h in 1u32..5000, d in 1u32..200, page in 8u32..200, border in 1u32..5, volume: bool) {
            let (dims, size) = if volume { (Dims::D3, [w, h, d]) } else { (Dims::D2, [w, h, 1]) };
            let geometry = Geometry::new(GeometrySpec { dims, size, page, border, ..GeometrySpec::image(1, 1) }).unwrap();
            let (tile, border) = (geometry.tile(), geometry.border());
            let boxes: Vec<_> = (geometry.tail().first_level()..=geometry.coarsest()).map(|level| {
                let lo = geometry.tail().offset(level);
                (lo, std::array::from_fn::<u32, 3, _>(|a| lo[a] + geometry.level(level).size[a] + 2 * border[a]))
            }).collect();
            for (i, (lo, hi)) in boxes.iter().enumerate() {
                prop_assert!((0..3).all(|a| hi[a] <= tile[a] && (a == 2 || lo[a] % 4 == 0)));
                for (other_lo, other_hi) in &boxes[..i] {
                    prop_assert!((0..3).any(|a| hi[a] <= other_lo[a] || other_hi[a] <= lo[a]));
                }
            }
        }
    }
}
