//! The record of a texture or a group in the array that shaders read by number, and the ids that name them
//! there.
//!
//! What the fields of an image's mean stands with the WGSL structs `VastexiTexture`, `VastexiEntries` and
//! `VastexiLevel` in records.wgsl, which takes it apart; how they lie in words stands here, at the words.
//! Those of a volume's are `volume`'s business. Tests sample by them, and compare with twins that read none.

use vastex_core::{Dims, Geometry, LevelRule, Slot, TextureNumber, VoxelLevels, shader_constants};

use crate::mirror::{RECORD_HEAD, RECORD_LEVEL, address_code};
use crate::tables::Placement;

mod volume;

pub use volume::MOST_UNALIGNED_LEVELS;

/// Texels along an axis that a 32-bit uv tells apart.
const UV_TEXELS: u32 = 1 << 20;

/// Words of 16 bytes from one record of the array to the next.
pub const RECORD_WORDS: u32 = (RECORD_HEAD + RECORD_LEVEL * shader_constants::MAX_LEVELS as usize) as u32;

/// The id by which shaders name a texture or a group: its number, and above that which of those that have had
/// the number, counted from 1. 0 names none.
///
/// ```
/// use vastex_core::TextureNumber;
/// let number = TextureNumber::new(5).unwrap();
/// assert_ne!(vastex_wgpu::shader_id(number, 1), vastex_wgpu::shader_id(number, 2));
/// ```
pub const fn shader_id(number: TextureNumber, generation: u32) -> u32 {
    let generations = (1 << (32 - shader_constants::TEXTURE_BITS)) - 1;
    let nth = match generation % generations {
        0 => generations,
        nth => nth,
    };
    number.number() as u32 | (nth << shader_constants::TEXTURE_BITS)
}

/// What a record is made of.
#[derive(Clone, Copy)]
pub struct RecordOf<'a> {
    /// The texture's shape.
    pub geometry: &'a Geometry,
    /// The texture's id: [`shader_id`].
    pub id: u32,
    /// Where the voxels of a volume's levels lie, if they are not its texels.
    pub voxels: Option<&'a VoxelLevels>,
    /// The slot of the texture's tail.
    pub tail_slot: Slot,
    /// How the texture's levels are chosen, as far as it has them.
    pub rule: LevelRule,
    /// Where the texture's entries lie in the page table.
    pub placement: &'a Placement,
}

/// The record of a texture.
pub fn texture_record(of: &RecordOf<'_>) -> Vec<[u32; 4]> {
    record(of, of.geometry.tail().first_level())
}

/// The record of a group, whose feedback names pages of all levels of its shape.
pub fn group_record(geometry: &Geometry, id: u32) -> Vec<[u32; 4]> {
    let rule = LevelRule::default().within(geometry);
    let placement = &Placement::without_entries(geometry.coarsest());
    let of = RecordOf { geometry, voxels: None, id, tail_slot: Slot::new(0), rule, placement };
    record(&of, geometry.coarsest())
}

/// The record of a number that nobody has.
pub fn no_record() -> [[u32; 4]; 1] {
    [[0; 4]]
}

/// `tail` is the first level whose pages are told as the whole level.
fn record(of: &RecordOf<'_>, tail: u8) -> Vec<[u32; 4]> {
    let (geometry, rule) = (of.geometry, of.rule);
    if geometry.dims() == Dims::D3 {
        return volume::volume_record(of, tail);
    }
    let [width, height, _] = geometry.size();
    let levels = [geometry.coarsest(), of.placement.finest, rule.finest, rule.coarsest, uv_finest(geometry)];
    let address = [0, 1].map(|axis| address_code(geometry.address()[axis]));
    let flags = levels.iter().rev().fold(0, |flags, &level| (flags << 5) | u32::from(level) & 31);
    let flags = (flags << 4) | (address[1] << 2) | address[0];
    let tail_entry = (u32::from(tail) << shader_constants::ENTRY_SLOT_BITS) | of.tail_slot.index();
    let (page, border) = (geometry.page(), geometry.border());
    let mut words = vec![
        [width, height, of.id, flags],
        [rule.bias.to_bits(), tail_entry, border[0] | (border[1] << 16), packed_placement(of)],
        // Read where sides of pages are not known to be powers of two.
        [page[0], page[1], 0, 0],
    ];
    words.extend((0..=geometry.coarsest()).flat_map(|index| level_words(of, index, tail)));
    words
}

/// Where to look in which arena, and the side of a page, rounded down to a power of two.
pub(crate) fn packed_placement(of: &RecordOf<'_>) -> u32 {
    let [(longer, of_longer), (_, of_others)] = of.placement.former;
    let [end, former_end] = [of.placement.least_length(), longer].map(u32::ilog2);
    let places = [end, former_end, of_longer.into(), of_others.into(), of.geometry.page()[0].ilog2()];
    places.iter().rev().fold(0, |places, place| (places << 5) | place & 31)
}

fn level_words(of: &RecordOf<'_>, index: u8, tail: u8) -> [[u32; 4]; RECORD_LEVEL] {
    let geometry = of.geometry;
    let (level, page, border) = (geometry.level(index), geometry.page(), geometry.border());
    let scale = level.scale.map(|scale| u32::try_from(scale).unwrap_or(u32::MAX));
    // No texel is beyond 2^31.
    let (mut page_texels, mut origin) = ([u32::MAX; 2], border);
    if index < tail {
        page_texels = [0, 1].map(|a| scale[a].saturating_mul(page[a]));
    } else if index >= geometry.tail().first_level() {
        origin = geometry.tile_texel_from_tail_texel(index, [0; 3]);
    }
    let [x, y] = page_texels;
    let inverse = |a: usize| (1.0 / scale[a] as f32).to_bits();
    let base = |a: usize| (f64::from(origin[a]) + geometry.sample_offset(index)[a]) as f32;
    let first_entry = if index < tail { of.placement.first_entry(index) } else { Placement::NONE };
    let [base_x, base_y] = [0, 1].map(|a| base(a).to_bits());
    // Inverses that are powers of two are their exponents: y's lies where a float has it, x's below, then the
    // shifts.
    let exponent = |a: usize| (inverse(a) >> 23) & 0xff;
    let in_one = exponent(1) << 23 | exponent(0) << 15 | y.ilog2() << 5 | x.ilog2();
    [
        // Of sides not known to be powers of two: where entries begin in a direct table, pages along x.
        [first_entry, level.pages[0], 0, 0],
        // Of those, too: what makes the place in a tile of one in its page.
        [inverse(0), inverse(1), base_x, base_y],
        // Of powers of two: all that is needed, in one word, since a lookup waits for each that it reads.
        [first_entry, in_one, base_x, base_y],
        // Of the others again: texels of level 0 along a page, and along a texel.
        [x, y, scale[0], scale[1]],
    ]
}

/// The finest level of which a 32-bit uv tells the texels apart: it has at most 2^20 along each axis. 0 of a
/// texture of no more.
pub(crate) fn uv_finest(geometry: &Geometry) -> u8 {
    let is_told = |index: &u8| geometry.level(*index).size[..2].iter().all(|&texels| texels <= UV_TEXELS);
    (0..=geometry.coarsest()).find(is_told).unwrap_or(geometry.coarsest())
}

#[cfg(test)]
mod tests {
    use super::*;
    use vastex_core::GeometrySpec;

    #[test]
    fn no_id_is_that_of_an_empty_record() {
        let generations = 1 << (32 - shader_constants::TEXTURE_BITS);
        for number in [0, 1, 1029, TextureNumber::MAX] {
            let number = TextureNumber::new(number).unwrap();
            let mut last = 0;
            for generation in [0, 1, 2, generations - 2, generations - 1, generations, u32::MAX] {
                let id = shader_id(number, generation);
                assert!(id >> shader_constants::TEXTURE_BITS != 0 && id != last, "{generation}");
                assert_eq!(id & 2047, u32::from(number.number()));
                last = id;
            }
        }
    }

    #[test]
    fn what_a_uv_cannot_tell_is_not_asked_for() {
        for (size, level) in [([1 << 20, 5], 0), ([(1 << 20) + 1, 5], 1), ([5, 1 << 31], 11), ([1, 1], 0)] {
            assert_eq!(uv_finest(&Geometry::new(GeometrySpec::image(size[0], size[1])).unwrap()), level);
        }
    }

    #[test]
    fn a_group_that_is_sampled_by_mistake_shows_a_tail() {
        let geometry = Geometry::new(GeometrySpec::image(5000, 3000)).unwrap();
        let [[_, _, _, flags], [_, tail_entry, _, places], ..] = group_record(&geometry, 7)[..] else {
            panic!("a record has a head")
        };
        let tail = tail_entry >> shader_constants::ENTRY_SLOT_BITS;
        let looked_up = [flags >> 9, places >> 10, places >> 15].map(|level| level & 31);
        assert_eq!(looked_up, [tail; 3], "no level that is looked up is finer");
    }

    #[test]
    fn the_largest_texture_fits_a_record() {
        let geometry = Geometry::new(GeometrySpec::image(1 << 31, 1 << 31)).unwrap();
        let words = group_record(&geometry, 7);
        assert!(words.len() as u32 <= RECORD_WORDS && words.len() > 100, "{}", words.len());
    }
}
