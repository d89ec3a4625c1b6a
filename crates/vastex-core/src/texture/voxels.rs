//! Where the voxels of a volume's levels lie: in the world, and in the tiles of its pages.
//!
//! Levels of volumes are stored by others, who halve as they like: by 2 along x and y and not along z, by 3,
//! by a ratio of sizes such as 271/135, with first voxels that begin elsewhere. Pages have to nest all the
//! same, or else no page could stand in for another. So a volume has two grids at each level, and this file
//! is what is between them:
//!
//! - *Texels* are what [`Geometry`] counts: its factors are whole numbers, and its pages nest. They are where
//!   the volume is cut, and no values.
//! - *Voxels* are what is stored. Voxel `i` of a level fills `origin + i * scale` to `origin + (i + 1) *
//!   scale` of the world, and its value lies at the middle.
//!
//! A level's texels are never larger than its voxels: along each axis the factors are rounded down. So the
//! box that a page has in the world is never longer than as many voxels as a page has texels, and the tile,
//! with its border, has room for all voxels that a filter needs anywhere in that box, wherever they begin.
//! The first of them is, along each axis,
//!
//! ```text
//! first = floor(page * step + offset)
//! ```
//!
//! in fixed point of 32 bits below the voxel, so that shaders find the same number by whole-number
//! arithmetic. Where factors are whole and levels begin together, as in most files, that is `page * 64 - 1`
//! for pages of 64 and a border of 1, what [`Geometry::tile_boxes`] says, and the level [is
//! aligned](VoxelLevel::is_aligned). A place in the tile is then `(place in the world - origin) / scale -
//! first`, in voxels from the tile's corner.

use std::f64::consts::SQRT_2;

use crate::texture::geometry::{Geometry, GeometryError, GeometrySpec, MAX_LEVELS, MAX_TEXELS};

/// By how much a texel may be larger than a voxel, as a share: what scales written as decimals come to.
const TOLERANCE: f64 = 1.0 / (1 << 18) as f64;
/// The bits of [`VoxelLevel::step`] and [`VoxelLevel::offset`] below the voxel.
pub const VOXEL_FRACTION_BITS: u32 = 32;
/// Voxels that a level may begin away from level 0: what is further off is that far off.
const MOST_OFFSET: f64 = (1 << 30) as f64;

/// A level as it is stored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StoredLevel {
    /// Voxels along x, y and z: 1 to 2^31.
    pub size: [u64; 3],
    /// Sides of a voxel in the world: above 0, and finite.
    pub scale: [f64; 3],
    /// The corner of the first voxel in the world.
    pub origin: [f64; 3],
}

/// Where the voxels of one level lie.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VoxelLevel {
    /// Voxels along x, y and z.
    pub size: [u32; 3],
    /// Sides of a voxel in the world.
    pub scale: [f64; 3],
    /// The corner of the first voxel in the world.
    pub origin: [f64; 3],
    /// Voxels from a page to the next, with 32 bits below the voxel.
    pub step: [i64; 3],
    /// Where page 0 would begin, with 32 bits below the voxel. The first voxel of its
    /// tile is the whole number below.
    pub offset: [i64; 3],
    /// True if each page begins where [`Geometry::tile_boxes`] says: the page's first texel less the border.
    pub is_aligned: bool,
    /// Which of the levels that were named it is; `None` of those that are made of the coarsest one.
    pub stored: Option<u16>,
}

impl VoxelLevel {
    /// The voxel at the corner of a page's tile: may lie outside of the level, whose last voxels are repeated
    /// there. Of a level in the tail, `coords` are 0.
    pub fn first_voxel(&self, coords: [u32; 3]) -> [i64; 3] {
        std::array::from_fn(|axis| {
            (i64::from(coords[axis]) * self.step[axis] + self.offset[axis]) >> VOXEL_FRACTION_BITS
        })
    }

    /// A place in the world in voxels: the first voxel's corner is 0, its middle 0.5.
    pub fn voxel_from_world(&self, world: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|axis| (world[axis] - self.origin[axis]) / self.scale[axis])
    }

    /// The place in the world of a place in voxels.
    pub fn world_from_voxel(&self, voxel: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|axis| self.origin[axis] + voxel[axis] * self.scale[axis])
    }
}

/// Why levels are no volume.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum VoxelLevelsError {
    /// There is no level.
    #[error("a volume needs a level")]
    None,
    /// A level's numbers are impossible.
    #[error(
        "level {0} has a side of no voxels or of more than 2^31, or a scale or an origin that is no finite number above 0"
    )]
    Level(usize),
    /// A side has more voxels than bricks can be told apart along it.
    #[error(
        "a side of {voxels} voxels: {most} at most can be drawn in bricks of {brick}; {}",
        if *brick < 64 { "take larger bricks, a coarser level, or a part of it" } else { "take a coarser level, or a part of it" }
    )]
    Side {
        /// Voxels along the side.
        voxels: u32,
        /// The most that a side may have.
        most: u64,
        /// Voxels along a side of a brick.
        brick: u32,
    },
    /// The shape is impossible.
    #[error(transparent)]
    Geometry(GeometryError),
}

impl From<GeometryError> for VoxelLevelsError {
    fn from(error: GeometryError) -> VoxelLevelsError {
        match error {
            GeometryError::Pages { texels, page, max, .. } => {
                VoxelLevelsError::Side { voxels: texels, most: u64::from(max) * u64::from(page), brick: page }
            }
            error => VoxelLevelsError::Geometry(error),
        }
    }
}

/// The levels of a volume: those that are stored, finest first, and below them those that are to be made,
/// down to one voxel.
///
/// Each that is made halves the axes along which voxels are shortest, until voxels are as near to cubes as
/// halves make them, and then all: a level of which voxels are long along one axis alone would suit no pixel
/// until it is too coarse along the others. Axes of one voxel count for nothing.
#[derive(Clone, Debug, PartialEq)]
pub struct VoxelLevels {
    levels: Vec<VoxelLevel>,
    left_out: Vec<usize>,
}

impl VoxelLevels {
    /// The geometry and the levels of a volume of these stored levels, finest first, in pages of `page`
    /// texels with `border` texels on each side.
    ///
    /// A level is [left out](VoxelLevels::left_out) if its voxels are smaller along an axis than those of the
    /// level before it, or larger along none.
    pub fn new(
        stored: &[StoredLevel],
        page: u32,
        border: u32,
    ) -> Result<(Geometry, VoxelLevels), VoxelLevelsError> {
        let finest = stored.first().ok_or(VoxelLevelsError::None)?;
        if let Some(level) = stored.iter().position(|level| !is_possible(level)) {
            return Err(VoxelLevelsError::Level(level));
        }
        let spec = GeometrySpec { page, border, ..GeometrySpec::volume(finest.size.map(|side| side as u32)) };
        let plan = Plan::of(stored);
        let geometry = Geometry::with_factors(spec, &plan.factors)?;
        let place = |(n, &(level, stored)): (usize, &(StoredLevel, Option<u16>))| {
            placed(&geometry, n as u8, finest, &level, stored)
        };
        let levels = plan.levels.iter().enumerate().map(place).collect();
        Ok((geometry, VoxelLevels { levels, left_out: plan.left_out }))
    }

    /// The levels, as many as the geometry has.
    pub fn levels(&self) -> &[VoxelLevel] {
        &self.levels
    }

    /// One level; `level` must exist.
    pub fn level(&self, level: u8) -> &VoxelLevel {
        &self.levels[usize::from(level)]
    }

    /// How many of the levels are stored; the others are made.
    pub fn stored(&self) -> usize {
        self.levels.iter().filter(|level| level.stored.is_some()).count()
    }

    /// Which of the levels that were named are left out.
    pub fn left_out(&self) -> &[usize] {
        &self.left_out
    }

    /// The volume's box in the world, which is that of level 0: its first and last corners.
    pub fn world_box(&self) -> [[f64; 3]; 2] {
        let finest = &self.levels[0];
        [finest.origin, finest.world_from_voxel(finest.size.map(f64::from))]
    }

    /// The level that a width in the world wants, that of a pixel for one: the coarsest whose voxels are no
    /// larger than it along any axis, but for axes along which those of level 0 are larger already.
    pub fn wanted_level(&self, width: f64) -> u8 {
        let finest = self.levels[0].scale;
        let suits = |level: &VoxelLevel| {
            (0..3).all(|axis| level.scale[axis] <= width.max(finest[axis]) * (1.0 + 1e-12))
        };
        self.levels.iter().rposition(suits).unwrap_or(0) as u8
    }
}

fn is_possible(level: &StoredLevel) -> bool {
    level.size.iter().all(|&side| (1..=u64::from(MAX_TEXELS)).contains(&side))
        && level.scale.iter().all(|&scale| scale.is_finite() && scale > 0.0)
        && level.origin.iter().all(|origin| origin.is_finite())
}

/// Which levels there are, and the factors between them.
struct Plan {
    levels: Vec<(StoredLevel, Option<u16>)>,
    factors: Vec<[u32; 3]>,
    left_out: Vec<usize>,
}

impl Plan {
    fn of(stored: &[StoredLevel]) -> Plan {
        let finest = stored[0];
        let mut plan = Plan { levels: vec![(finest, Some(0))], factors: Vec::new(), left_out: Vec::new() };
        // Texels of level 0 along one of the level before, and how many texels that one has.
        let (mut product, mut texels) = ([1_u64; 3], finest.size);
        for (n, level) in stored.iter().enumerate().skip(1) {
            let before = plan.levels[plan.levels.len() - 1].0;
            let grows = |axis: usize| level.scale[axis] / before.scale[axis] - 1.0;
            let factor: [u32; 3] = std::array::from_fn(|axis| {
                let ratio = level.scale[axis] / finest.scale[axis] * (1.0 + TOLERANCE);
                (ratio / product[axis] as f64).floor().clamp(1.0, f64::from(u32::MAX)) as u32
            });
            let halvings = |axis: usize| bits(texels[axis].div_ceil(factor[axis].into()));
            // Those that are made need places, too.
            let has_room = (0..3).all(|axis| plan.levels.len() + 1 + halvings(axis) <= MAX_LEVELS);
            let is_coarser =
                (0..3).all(|axis| grows(axis) >= -TOLERANCE) && (0..3).any(|axis| grows(axis) > TOLERANCE);
            if !is_coarser || !has_room {
                plan.left_out.push(n);
                continue;
            }
            for axis in 0..3 {
                product[axis] = product[axis].saturating_mul(factor[axis].into());
                texels[axis] = texels[axis].div_ceil(factor[axis].into());
            }
            plan.factors.push(factor);
            plan.levels.push((*level, Some(n as u16)));
        }
        while texels != [1; 3] {
            let (before, _) = plan.levels[plan.levels.len() - 1];
            let factor = halving(texels, before.scale, MAX_LEVELS - plan.levels.len());
            let size = std::array::from_fn(|axis| before.size[axis].div_ceil(factor[axis].into()));
            let scale = std::array::from_fn(|axis| before.scale[axis] * f64::from(factor[axis]));
            texels = std::array::from_fn(|axis| texels[axis].div_ceil(factor[axis].into()));
            plan.factors.push(factor);
            plan.levels.push((StoredLevel { size, scale, origin: before.origin }, None));
        }
        plan
    }
}

/// By what the next level that is made divides each side, where so many more levels may be made with it.
fn halving(texels: [u64; 3], scale: [f64; 3], left: usize) -> [u32; 3] {
    let is_long = |axis: &usize| texels[*axis] > 1;
    let least = (0..3).filter(is_long).map(|axis| scale[axis]).fold(f64::INFINITY, f64::min);
    std::array::from_fn(|axis| {
        // Nearer to the shortest as it is than halved; or it would not be one texel in time.
        let is_due = scale[axis] <= SQRT_2 * least || bits(texels[axis]) >= left;
        if is_long(&axis) && is_due { 2 } else { 1 }
    })
}

/// How often a side is halved, rounding up, until it is 1.
fn bits(side: u64) -> usize {
    (u64::BITS - (side - 1).leading_zeros()) as usize
}

/// Where a level's voxels lie in tiles.
fn placed(
    geometry: &Geometry,
    n: u8,
    finest: &StoredLevel,
    level: &StoredLevel,
    stored: Option<u16>,
) -> VoxelLevel {
    let one = (1_i64 << VOXEL_FRACTION_BITS) as f64;
    let (page, border) = (geometry.page(), geometry.border());
    let shape = geometry.level(n);
    let step: [i64; 3] = std::array::from_fn(|axis| {
        let voxels = shape.scale[axis] as f64 * finest.scale[axis] / level.scale[axis];
        (f64::from(page[axis]) * voxels.min(1.0 + TOLERANCE) * one).round() as i64
    });
    let offset: [i64; 3] = std::array::from_fn(|axis| {
        // A filter reaches half a voxel beyond the box; the border has that many voxels more.
        let begin = (finest.origin[axis] - level.origin[axis]) / level.scale[axis];
        let begin = begin.clamp(-MOST_OFFSET, MOST_OFFSET) - 0.5 - f64::from(border[axis] - 1);
        (begin * one).round() as i64
    });
    let mut placed = VoxelLevel {
        size: level.size.map(|side| side as u32),
        scale: level.scale,
        origin: level.origin,
        step,
        offset,
        is_aligned: false,
        stored,
    };
    let last = match n >= geometry.tail().first_level() {
        true => [0; 3],
        false => shape.pages.map(|pages| pages - 1),
    };
    // What pages are off grows evenly from the first to the last.
    placed.is_aligned = [[0; 3], last].into_iter().all(|coords: [u32; 3]| {
        let first = placed.first_voxel(coords);
        (0..3).all(|a| first[a] == i64::from(coords[a]) * i64::from(page[a]) - i64::from(border[a]))
    });
    placed
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn level(size: [u64; 3], scale: [f64; 3]) -> StoredLevel {
        StoredLevel { size, scale, origin: [0.0; 3] }
    }

    fn of(levels: &[StoredLevel]) -> (Geometry, VoxelLevels) {
        VoxelLevels::new(levels, 64, 1).unwrap()
    }

    #[test]
    fn halves_are_aligned_and_go_on_to_one_voxel() {
        let (geometry, levels) =
            of(&[level([300, 200, 90], [0.5, 0.5, 2.0]), level([150, 100, 90], [1.0, 1.0, 2.0])]);
        let sizes: Vec<_> = levels.levels().iter().map(|level| level.size).collect();
        assert_eq!(sizes[..4], [[300, 200, 90], [150, 100, 90], [75, 50, 90], [38, 25, 45]]);
        assert_eq!((sizes[sizes.len() - 1], levels.stored()), ([1; 3], 2));
        for (n, level) in levels.levels().iter().enumerate() {
            assert!(level.is_aligned && geometry.level(n as u8).size == level.size, "{n}");
            assert_eq!(level.first_voxel([0; 3]), [-1; 3]);
        }
        assert_eq!(levels.level(1).first_voxel([2, 1, 0]), [127, 63, -1]);
        assert_eq!(levels.world_box(), [[0.0; 3], [150.0, 100.0, 180.0]]);
    }

    #[test]
    fn ratios_of_sizes_have_texels_that_are_no_larger_than_their_voxels() {
        // As ome-zarr-py writes them: 271 / 135.
        let (geometry, levels) = of(&[
            level([271, 4001, 5], [1.0; 3]),
            level([135, 1333, 5], [271.0 / 135.0, 4001.0 / 1333.0, 1.0]),
            level([90, 1000, 5], [271.0 / 90.0, 4001.0 / 1000.0, 1.0]),
        ]);
        assert_eq!(geometry.level(1).factor, [2, 3, 1]);
        // 3.01 is once 2, 4.001 once 3.
        assert_eq!(geometry.level(2).factor, [1, 1, 1]);
        assert_eq!((levels.level(2).size, geometry.level(2).size), ([90, 1000, 5], [136, 1334, 5]));
        assert!(!levels.level(2).is_aligned);
    }

    #[test]
    fn decimals_are_what_they_are_meant_to_be() {
        let (geometry, levels) = of(&[
            level([5000; 3], [0.1083; 3]),
            level([2500; 3], [0.216_599_99; 3]),
            level([1250; 3], [0.4332; 3]),
        ]);
        assert_eq!(geometry.level(2).scale, [4; 3]);
        assert!(levels.levels().iter().all(|level| level.is_aligned));
    }

    #[test]
    fn what_is_no_coarser_level_is_left_out() {
        let (_, levels) = of(&[
            level([100; 3], [1.0; 3]),
            level([90; 3], [1.0; 3]),
            level([50, 50, 200], [2.0, 2.0, 0.5]),
            level([50; 3], [2.0; 3]),
        ]);
        assert_eq!((levels.left_out(), levels.stored()), (&[1, 2][..], 2));
        assert_eq!(levels.level(1).stored, Some(3));
        for odd in [
            level([0, 1, 1], [1.0; 3]),
            level([1; 3], [0.0, 1.0, 1.0]),
            level([1; 3], [f64::NAN, 1.0, 1.0]),
            level([1 << 32, 1, 1], [1.0; 3]),
            StoredLevel { origin: [f64::INFINITY, 0.0, 0.0], ..level([1; 3], [1.0; 3]) },
        ] {
            assert_eq!(VoxelLevels::new(&[odd], 64, 1).unwrap_err(), VoxelLevelsError::Level(0));
        }
        assert_eq!(VoxelLevels::new(&[], 64, 1).unwrap_err(), VoxelLevelsError::None);
        let error = VoxelLevels::new(&[level([1 << 31, 1, 1], [1.0; 3])], 64, 1).unwrap_err().to_string();
        assert!(error.contains("4194304 at most") && error.contains("coarser level"), "{error}");
        let error = VoxelLevels::new(&[level([1, 4_000_000, 1], [1.0; 3])], 32, 1).unwrap_err().to_string();
        assert!(error.contains("2097152 at most") && error.contains("larger bricks"), "{error}");
    }

    /// Sizes of all levels, those that are made halved by this rule.
    fn sizes_of(size: [u64; 3], scale: [f64; 3]) -> Vec<[u32; 3]> {
        of(&[level(size, scale)]).1.levels().iter().map(|level| level.size).collect()
    }

    #[test]
    fn levels_that_are_made_halve_the_shortest_sides_of_voxels_first() {
        let flat = [level([600, 600, 12], [0.35, 0.35, 100.0])];
        let (geometry, levels) = of(&flat);
        let sides: Vec<_> = levels.levels().iter().map(|level| (level.size, level.scale[2])).collect();
        assert_eq!(sides[1..4], [([300, 300, 12], 100.0), ([150, 150, 12], 100.0), ([75, 75, 12], 100.0)]);
        // From 89.6 on they are as near to cubes as they come.
        assert_eq!(sides[8..11], [([3, 3, 12], 100.0), ([2, 2, 6], 200.0), ([1, 1, 3], 400.0)]);
        assert_eq!(sides[sides.len() - 1].0, [1; 3]);
        // What a picture of 60x60 pixels wants is a few bricks in the place of a hundred.
        let wanted = levels.wanted_level(3.5);
        assert_eq!(
            (wanted, geometry.level(wanted).page_count(), geometry.level(0).page_count()),
            (3, 4, 100)
        );
        // Of cubes, and of what is nearly that, all axes are halved as ever.
        for scale in [[1.0; 3], [0.26, 0.26, 0.29], [1.0, 1.4, 1.2]] {
            let sizes = sizes_of([300, 200, 90], scale);
            assert_eq!((sizes[1], sizes[2], sizes.len()), ([150, 100, 45], [75, 50, 23], 10), "{scale:?}");
        }
        // An axis of one voxel counts for nothing, and each axis may be the one that waits.
        assert_eq!(sizes_of([64, 64, 1], [1.0, 1.0, 50.0])[1], [32, 32, 1]);
        assert_eq!(sizes_of([64, 1, 64], [1.0, 0.01, 1.0])[1], [32, 1, 32]);
        assert_eq!(sizes_of([64, 64, 64], [4.0, 1.0, 1.0])[1..4], [[64, 32, 32], [64, 16, 16], [32, 8, 8]]);
        assert_eq!(sizes_of([100, 100, 80], [1.0, 1.0, 0.2])[1..3], [[100, 100, 40], [100, 100, 20]]);
        // However long voxels are, the levels are no more than there can be.
        let (geometry, levels) = of(&[level([4_000_000, 1, 4_000_000], [1.0, 1.0, 1e12])]);
        assert!(levels.levels().len() == geometry.levels().len() && geometry.levels().len() <= MAX_LEVELS);
        assert_eq!(levels.level(1).size, [2_000_000, 1, 4_000_000]);
    }

    #[test]
    fn more_levels_than_there_can_be_are_left_out() {
        let stored: Vec<_> = (0..60).map(|n| level([4_000_000, 1, 1], [1.2_f64.powi(n), 1.0, 1.0])).collect();
        let (geometry, levels) = of(&stored);
        assert_eq!(geometry.levels().len(), levels.levels().len());
        assert!(geometry.levels().len() <= MAX_LEVELS && !levels.left_out().is_empty());
    }

    #[test]
    fn a_width_wants_the_coarsest_level_that_is_fine_enough() {
        let (_, levels) = of(&[
            level([400, 400, 40], [1.0, 1.0, 10.0]),
            level([200, 200, 40], [2.0, 2.0, 10.0]),
            level([100, 100, 20], [4.0, 4.0, 20.0]),
        ]);
        let wanted = [0.1, 1.0, 1.9, 2.0, 4.0, 19.9, 20.0, 1e9].map(|width| levels.wanted_level(width));
        // z never holds a level up as long as it is what it is at level 0.
        // Of those that are made, two have voxels of 20 along z, too.
        assert_eq!(wanted[..7], [0, 0, 0, 1, 1, 1, 4]);
        assert_eq!(usize::from(wanted[7]), levels.levels().len() - 1);
    }

    proptest! {
        /// Wherever a place is in a page's box, the voxels that a filter mixes there are in the page's tile.
        #[test]
        fn a_tile_has_what_a_filter_needs(
            size in prop::array::uniform3(1u64..3000),
            ratios in prop::collection::vec(prop::array::uniform3(1.0f64..3.3), 1..5),
            away in prop::array::uniform3(-3.0f64..3.0),
            page in prop::sample::select(vec![8u32, 32, 64]),
            border in 1u32..3,
            picks in prop::collection::vec((any::<prop::sample::Index>(), prop::array::uniform3(0.0f64..1.0)), 20),
        ) {
            let mut stored = vec![StoredLevel { size, scale: [0.7, 0.7, 3.1], origin: [5.0, -7.0, 0.0] }];
            for ratio in &ratios {
                let finer = stored[stored.len() - 1];
                stored.push(StoredLevel {
                    size: std::array::from_fn(|a| ((finer.size[a] as f64 / ratio[a]) as u64).max(1)),
                    scale: std::array::from_fn(|a| finer.scale[a] * ratio[a]),
                    origin: std::array::from_fn(|a| finer.origin[a] + away[a]),
                });
            }
            let (geometry, levels) = VoxelLevels::new(&stored, page, border).unwrap();
            let finest = levels.level(0);
            for (pick, within) in picks {
                let n = pick.index(levels.levels().len()) as u8;
                let (shape, level) = (geometry.level(n), levels.level(n));
                let is_tail = n >= geometry.tail().first_level();
                let pages = if is_tail { [1; 3] } else { shape.pages };
                let coords: [u32; 3] = std::array::from_fn(|a| pick.index(pages[a] as usize) as u32);
                // The page's box in voxels of level 0; of a level in the tail, the level.
                let side: [f64; 3] = std::array::from_fn(|a| match is_tail {
                    true => f64::from(shape.size[a]) * shape.scale[a] as f64,
                    false => f64::from(page) * shape.scale[a] as f64,
                });
                let at = std::array::from_fn(|a| (f64::from(coords[a]) + within[a]) * side[a]);
                let voxel = level.voxel_from_world(finest.world_from_voxel(at));
                let first = level.first_voxel(coords);
                for a in 0..3 {
                    let tile = if is_tail { shape.size[a] + 2 * border } else { page + 2 * border };
                    let least = (voxel[a] - 0.5 + 1e-4).floor() as i64;
                    let most = (voxel[a] - 0.5 - 1e-4).floor() as i64 + 1;
                    prop_assert!(least >= first[a] && most < first[a] + i64::from(tile), "level {n}, axis {a}");
                }
            }
        }
    }
}
