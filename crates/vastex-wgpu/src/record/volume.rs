//! The record of a volume, or of a group of volumes, in the array that shaders read by number.
//!
//! What its fields mean stands with the WGSL structs `VastexiVolume` and `VastexiVolumeLevel` in
//! volume_records.wgsl, which takes it apart; it is at most as long as an image's (`record`).

use vastex_core::{Geometry, TexelPositions, VOXEL_FRACTION_BITS, VoxelLevel, shader_constants};

use super::{RecordOf, packed_placement};
use crate::mirror::{RECORD_LEVEL, RECORD_VOLUME_LEVEL};
use crate::tables::Placement;

/// Stands for the logarithm of a scale that is no power of two.
const NO_SHIFT: u32 = 31;
/// Levels of a volume at most whose voxels are no texels, since more have no room in a record: a volume of
/// 2^17 voxels a side has 18.
pub const MOST_UNALIGNED_LEVELS: usize =
    RECORD_LEVEL * shader_constants::MAX_LEVELS as usize / RECORD_VOLUME_LEVEL;

/// `tail` is the first level whose bricks are named as the whole level.
pub(super) fn volume_record(of: &RecordOf<'_>, tail: u8) -> Vec<[u32; 4]> {
    let (geometry, rule) = (of.geometry, of.rule);
    let [width, height, depth] = geometry.size();
    let tail_entry = (u32::from(tail) << shader_constants::ENTRY_SLOT_BITS) | of.tail_slot.index();
    let levels = [geometry.coarsest(), of.placement.finest, rule.finest, rule.coarsest];
    let levels = levels.iter().rev().fold(0, |packed, &level| (packed << 5) | u32::from(level) & 31);
    // Those that have no room are drawn as if their voxels were texels; who adds them is told before.
    let voxels = of
        .voxels
        .map(|voxels| voxels.levels())
        .filter(|levels| levels.len() == geometry.levels().len())
        .filter(|levels| levels.len() <= MOST_UNALIGNED_LEVELS)
        .filter(|levels| !levels.iter().all(|level| level.is_aligned));
    let flags = levels | u32::from(voxels.is_some()) << 20;
    let mut words = vec![
        [width, height, !of.id, depth],
        [rule.bias.to_bits(), tail_entry, 0, packed_placement(of)],
        [geometry.page()[0], geometry.border()[0], flags, 0],
    ];
    for index in 0..=geometry.coarsest() {
        // Scales are those of the file, also where the tiles are cut alike.
        let level = of.voxels.map(|voxels| (voxels.level(0), voxels.levels().get(usize::from(index))));
        let level = level.and_then(|(finest, level)| Some((finest, level?)));
        words.extend(level_words(of, index, tail, level));
        if let Some(level) = voxels.map(|voxels| &voxels[usize::from(index)]) {
            words.extend(voxel_words(geometry, index, level));
        }
    }
    words
}

fn level_words(
    of: &RecordOf<'_>,
    index: u8,
    tail: u8,
    voxels: Option<(&VoxelLevel, &VoxelLevel)>,
) -> [[u32; 4]; RECORD_LEVEL] {
    let geometry = of.geometry;
    let level = geometry.level(index);
    let first_entry = if index < tail { of.placement.first_entry(index) } else { Placement::NONE };
    let [columns, rows, _] = level.pages;
    let (scale, begin): ([f64; 3], [f64; 3]) = match voxels {
        Some((finest, level)) => (
            std::array::from_fn(|axis| level.scale[axis] / finest.scale[axis]),
            level.voxel_from_world(finest.origin),
        ),
        None => (level.scale.map(|scale| scale as f64), geometry.sample_offset(index)),
    };
    let is_kept = geometry.spec().positions == TexelPositions::Kept;
    let shifts = (0..3).rev().fold(0, |packed, axis| {
        let begins_alike = begin[axis] == 0.0 && !(is_kept && scale[axis] != 1.0);
        (packed << 5) | if begins_alike { shift(scale[axis]) } else { NO_SHIFT }
    });
    let inverse: [u32; 3] = scale.map(|scale| ((1.0 / scale) as f32).to_bits());
    let first: [u32; 3] = begin.map(|begin| (begin as f32).to_bits());
    // Beyond the volume nothing is told apart, and a brick's side must not wrap.
    let texels: [u32; 3] = std::array::from_fn(|axis| {
        u32::try_from(level.scale[axis]).unwrap_or(u32::MAX).min(geometry.size()[axis])
    });
    let is_tail = index >= geometry.tail().first_level();
    let base: [u32; 3] = match (is_tail, voxels) {
        (true, Some((_, level))) => {
            let (offset, first) = (geometry.tail().offset(index), level.first_voxel([0; 3]));
            std::array::from_fn(|axis| (i64::from(offset[axis]) - first[axis]) as u32)
        }
        (true, None) => geometry.tile_texel_from_tail_texel(index, [0; 3]),
        (false, _) => geometry.border(),
    };
    [
        [first_entry, columns, rows, shifts],
        [inverse[0], inverse[1], inverse[2], first[0]],
        [first[1], first[2], texels[0], texels[1]],
        [texels[2], base[0], base[1], base[2]],
    ]
}

/// Where the voxels of a level begin in its bricks; of a level of the tail, where its part of the tile does.
fn voxel_words(
    geometry: &Geometry,
    index: u8,
    level: &VoxelLevel,
) -> [[u32; 4]; RECORD_VOLUME_LEVEL - RECORD_LEVEL] {
    if index >= geometry.tail().first_level() {
        let [x, y, z] = geometry.tail().offset(index);
        return [[x, y, z, 0], [0; 4], [0; 4]];
    }
    let below = |fixed: i64| fixed as u32;
    let whole = |fixed: i64| (fixed >> VOXEL_FRACTION_BITS) as u32;
    let (step, offset) = (level.step, level.offset);
    [
        [below(step[0]), below(step[1]), below(step[2]), whole(step[0])],
        [below(offset[0]), below(offset[1]), below(offset[2]), whole(step[1])],
        [whole(offset[0]), whole(offset[1]), whole(offset[2]), whole(step[2])],
    ]
}

/// The logarithm of a scale that is a power of two.
fn shift(scale: f64) -> u32 {
    let log = scale.log2();
    match log.fract() == 0.0 && (0.0..f64::from(NO_SHIFT)).contains(&log) {
        true => log as u32,
        false => NO_SHIFT,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mirror::RECORD_HEAD;
    use crate::record::{RECORD_WORDS, group_record, texture_record};
    use vastex_core::{GeometrySpec, LevelRule, Slot, StoredLevel, VoxelLevels};

    fn words(geometry: &Geometry, voxels: Option<&VoxelLevels>, id: u32) -> Vec<[u32; 4]> {
        let (rule, placement) = (LevelRule::default().within(geometry), Placement::without_entries(0));
        let (tail_slot, placement) = (Slot::new(0), &placement);
        texture_record(&RecordOf { geometry, voxels, id, tail_slot, rule, placement })
    }

    fn shifts(words: &[[u32; 4]], level: usize) -> [u32; 3] {
        let shifts = words[RECORD_HEAD + RECORD_LEVEL * level][3];
        [shifts & 31, (shifts >> 5) & 31, (shifts >> 10) & 31]
    }

    #[test]
    fn the_largest_volume_fits_a_record() {
        let spec = GeometrySpec { page: 4096, border: 1, ..GeometrySpec::volume([1 << 28; 3]) };
        let words = group_record(&Geometry::new(spec).unwrap(), 7);
        assert!(words.len() as u32 <= RECORD_WORDS && words.len() > 100, "{}", words.len());
    }

    #[test]
    fn no_image_is_taken_for_a_volume() {
        let id = 0x1805;
        let volume = Geometry::new(GeometrySpec::volume([300, 200, 100])).unwrap();
        let image = Geometry::new(GeometrySpec::image(300, 200)).unwrap();
        let record = |geometry: &Geometry| words(geometry, None, id)[0];
        assert_eq!((record(&volume)[2], record(&image)[2]), (!id, id));
        assert_eq!([record(&volume)[0], record(&volume)[1], record(&volume)[3]], [300, 200, 100]);
    }

    #[test]
    fn scales_that_are_no_powers_of_two_are_computed() {
        let spec = GeometrySpec { page: 16, border: 1, ..GeometrySpec::volume([9, 8, 2]) };
        let factors = [[3, 2, 1], [3, 2, 2], [1, 2, 1]];
        let words = words(&Geometry::with_factors(spec, &factors).unwrap(), None, 1);
        assert_eq!(shifts(&words, 0), [0, 0, 0]);
        assert_eq!(shifts(&words, 1), [NO_SHIFT, 1, 0]);
        assert_eq!(shifts(&words, 3), [NO_SHIFT, 3, 1]);
    }

    #[test]
    fn levels_that_are_not_aligned_say_where_their_voxels_begin() {
        let stored = |size, scale| StoredLevel { size: [size; 3], scale: [scale; 3], origin: [0.0; 3] };
        let (geometry, voxels) =
            VoxelLevels::new(&[stored(1355, 1.0), stored(451, 1355.0 / 451.0)], 16, 1).unwrap();
        let words = words(&geometry, Some(&voxels), 1);
        assert_eq!(words.len(), RECORD_HEAD + RECORD_VOLUME_LEVEL * geometry.levels().len());
        assert!(words.len() as u32 <= RECORD_WORDS);
        let level = &words[RECORD_HEAD + RECORD_VOLUME_LEVEL..][..RECORD_VOLUME_LEVEL];
        assert_eq!(f32::from_bits(level[1][0]), (451.0 / 1355.0) as f32);
        let step = i64::from(level[4][0]) | i64::from(level[4][3]) << 32;
        assert_eq!(step, voxels.level(1).step[0]);
    }
}
