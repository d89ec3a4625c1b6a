//! Which levels a volume gets: sizes, and how many voxels of the next finer level one is made of.

/// A level.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Level {
    /// Voxels along x, y and z.
    pub(super) size: [u64; 3],
    /// Voxels of the next finer level along one of this level, 1 or 2; 1 at level 0.
    pub(super) factor: [u64; 3],
    /// Voxels of level 0 along one of this level.
    pub(super) scale: [u64; 3],
}

/// Levels that a volume can have: each halves a side, and sides have at most 2^31 voxels.
const MOST: usize = 32;

/// The levels of a volume of so many voxels, whose sides are `spacing`, down to the first one that is
/// `enough`. Each halves every axis that has more than one voxel, rounding up. With `keeps_z` z is left as it
/// is while its voxels are larger than those along x and y, as long as one of these can be halved. `None`
/// where that takes more levels than there can be.
pub(super) fn levels(
    size: [u64; 3],
    spacing: [f64; 3],
    keeps_z: bool,
    enough: impl Fn([u64; 3]) -> bool,
) -> Option<Vec<Level>> {
    let mut levels = vec![Level { size, factor: [1; 3], scale: [1; 3] }];
    while let Some(finer) = levels.last().copied().filter(|level| !enough(level.size)) {
        if levels.len() == MOST {
            return None;
        }
        let spacing: [f64; 3] = std::array::from_fn(|axis| spacing[axis] * finer.scale[axis] as f64);
        let is_flat = finer.size[0] == 1 && finer.size[1] == 1;
        let stays = keeps_z && !is_flat && spacing[2] > spacing[0].max(spacing[1]);
        let factor: [u64; 3] = std::array::from_fn(|axis| match finer.size[axis] {
            1 => 1,
            _ if axis == 2 && stays => 1,
            _ => 2,
        });
        levels.push(Level {
            size: std::array::from_fn(|axis| finer.size[axis].div_ceil(factor[axis])),
            factor,
            scale: std::array::from_fn(|axis| finer.scale[axis] * factor[axis]),
        });
    }
    Some(levels)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sides_are_halved_and_rounded_up() {
        let all = levels([197, 5, 1], [1.0; 3], false, |size| size == [1; 3]).unwrap();
        let sizes: Vec<_> = all.iter().map(|level| level.size).collect();
        assert_eq!(sizes[..4], [[197, 5, 1], [99, 3, 1], [50, 2, 1], [25, 1, 1]]);
        assert_eq!((all.len(), all[8].scale), (9, [256, 8, 1]));
        assert_eq!(
            levels([64; 3], [1.0; 3], false, |size| size.iter().all(|side| *side <= 64)).unwrap().len(),
            1
        );
    }

    #[test]
    fn z_waits_until_the_others_are_as_coarse() {
        let enough = |size: [u64; 3]| size.iter().all(|side| *side <= 32);
        let all = levels([400, 400, 100], [0.5, 0.5, 2.0], true, enough).unwrap();
        let factors: Vec<u64> = all.iter().map(|level| level.factor[2]).collect();
        assert_eq!(factors, [1, 1, 1, 2, 2]);
        // What is flat along x and y is halved along z all the same.
        let flat = levels([1, 1, 100], [1.0, 1.0, 9.0], true, enough).unwrap();
        assert_eq!(flat.last().unwrap().size, [1, 1, 25]);
        assert!(levels([1 << 31, 1, 1 << 31], [1.0, 1.0, 1e9], true, |size| size == [1; 3]).is_none());
    }
}
