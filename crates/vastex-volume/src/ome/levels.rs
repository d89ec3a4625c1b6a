//! Levels: their order, their scales where none are given, and where their first voxels lie.

use crate::fault::Oddities;
use crate::volume::Convention;

/// A level that is stored, as its metadata and its array have it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Stored {
    pub(super) path: String,
    pub(super) size: [u64; 3],
    /// `None` if nothing says so.
    pub(super) scale: Option<[f64; 3]>,
    pub(super) translation: [f64; 3],
}

/// Puts the finest level first, by size; says so where that was not the order. Gives the order, as places in
/// the list.
pub(super) fn sorted(levels: &[Stored], oddities: &mut Oddities) -> Vec<usize> {
    let voxels = |place: &usize| levels[*place].size.iter().map(|side| u128::from(*side)).product::<u128>();
    let mut order: Vec<usize> = (0..levels.len()).collect();
    order.sort_by_key(|place| std::cmp::Reverse(voxels(place)));
    if !order.is_sorted() {
        oddities.push(
            "levels are not listed from the finest to the coarsest; they are taken by their sizes".into(),
        );
    }
    order
}

/// Scales for all levels: where one is not given, it follows from the sizes, as a whole factor where one
/// fits.
pub(super) fn scales(levels: &[Stored], oddities: &mut Oddities) -> Vec<[f64; 3]> {
    let first = levels[0].scale.unwrap_or([1.0; 3]);
    let mut scales = Vec::new();
    for (n, level) in levels.iter().enumerate() {
        let scale = level.scale.unwrap_or_else(|| {
            let derived =
                std::array::from_fn(|axis| first[axis] * factor(levels[0].size[axis], level.size[axis]));
            if n > 0 {
                oddities.push(format!(
                    "no scale is given of the level '{}'; {} follows from its size",
                    level.path,
                    derived.map(|side: f64| side.to_string()).join(", ")
                ));
            }
            derived
        });
        scales.push(scale);
    }
    scales
}

/// How many voxels of a side of level 0 are one of a coarser level.
fn factor(fine: u64, coarse: u64) -> f64 {
    let ratio = fine as f64 / coarse as f64;
    let whole = ratio.round().max(1.0);
    let cut = fine as f64 / whole;
    let fits = cut.floor() == coarse as f64 || cut.ceil() == coarse as f64;
    if fits { whole } else { ratio }
}

/// What translations are of. Where a coarser level lies by half of what its voxels are larger beside the
/// finer one, they are of middles; else of corners, but for one level of a version that states middles.
pub(super) fn convention(scales: &[[f64; 3]], translations: &[[f64; 3]], states_middles: bool) -> Convention {
    let mut is_seen = false;
    for n in 1..scales.len() {
        for axis in 0..3 {
            let grown = scales[n][axis] - scales[n - 1][axis];
            if grown.abs() <= 1e-6 * scales[n][axis] {
                continue;
            }
            let moved = translations[n][axis] - translations[n - 1][axis];
            if (moved - 0.5 * grown).abs() > 0.02 * grown.abs() {
                return Convention::Corner;
            }
            is_seen = true;
        }
    }
    match is_seen || (states_middles && scales.len() == 1) {
        true => Convention::Center,
        false => Convention::Corner,
    }
}

/// The corners of the first voxels.
pub(super) fn origins(
    scales: &[[f64; 3]],
    translations: &[[f64; 3]],
    convention: Convention,
) -> Vec<[f64; 3]> {
    let inward = convention.inward();
    let corner = |(scale, moved): (&[f64; 3], &[f64; 3])| {
        std::array::from_fn(|axis| moved[axis] - inward * scale[axis])
    };
    scales.iter().zip(translations).map(corner).collect()
}

/// Says where a level does not cover what the finest one does, by more than a voxel of its own.
pub(super) fn check_cover(
    levels: &[Stored],
    scales: &[[f64; 3]],
    origins: &[[f64; 3]],
    oddities: &mut Oddities,
) {
    for n in 1..levels.len() {
        let is_off = |axis: usize| {
            let end = |n: usize| origins[n][axis] + scales[n][axis] * levels[n].size[axis] as f64;
            let begins = (origins[n][axis] - origins[0][axis]).abs();
            begins.max((end(n) - end(0)).abs()) > scales[n][axis] * 1.001
        };
        if let Some(axis) = (0..3).find(|axis| is_off(*axis)) {
            oddities.push(format!(
                "the level '{}' does not cover along {} what level 0 covers; it is placed where its metadata say",
                levels[n].path,
                ["x", "y", "z"][axis]
            ));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stored(path: &str, side: u64) -> Stored {
        Stored { path: path.into(), size: [side, side, 5], scale: None, translation: [0.0; 3] }
    }

    #[test]
    fn conventions_are_told_from_translations() {
        let scales = [[1.0, 1.0, 3.0], [2.0, 2.0, 3.0], [6.0, 6.0, 6.0]];
        let middles = [[0.0; 3], [0.5, 0.5, 0.0], [2.5, 2.5, 1.5]];
        assert_eq!(convention(&scales, &middles, false), Convention::Center);
        assert_eq!(convention(&scales, &[[0.0; 3]; 3], true), Convention::Corner);
        assert_eq!(convention(&scales[..1], &middles[..1], true), Convention::Center);
        assert_eq!(convention(&scales[..1], &middles[..1], false), Convention::Corner);
        assert_eq!(origins(&scales, &middles, Convention::Center), [[-0.5, -0.5, -1.5]; 3]);
    }

    #[test]
    fn scales_follow_from_sizes_where_none_are_given() {
        let mut odd = Oddities::default();
        let levels = [stored("0", 2854), stored("1", 1427), stored("2", 714), stored("3", 238)];
        let scales = scales(&levels, &mut odd);
        assert_eq!(scales.iter().map(|scale| scale[0]).collect::<Vec<_>>(), [1.0, 2.0, 4.0, 12.0]);
        assert!(scales.iter().all(|scale| scale[2] == 1.0) && odd.into_vec().len() == 3);
    }

    #[test]
    fn levels_come_by_size() {
        let mut odd = Oddities::default();
        let levels = [stored("b", 10), stored("a", 20), stored("c", 10)];
        assert_eq!(sorted(&levels, &mut odd), [1, 0, 2]);
        assert_eq!(odd.into_vec().len(), 1);
    }
}
