//! How many samples, bricks and labels rays through a volume meet at most, and whether what draws takes as
//! many: else what lies behind them is not seen.

use std::sync::Arc;

use glam::DVec3;
use vastex::{RAY_BRICKS, VoxelLevels};

use super::camera::{VolumeBox, VolumeClip, VolumeRays, VolumeView};
use super::desc::VolumeMode;
use super::labels::LabelTurns;
use super::text::RAY_SAMPLES;

/// A software driver ends a pixel without a word after 65,535 turns of loops, of all loops together; some of
/// these are counted nowhere here.
const MOST_TURNS: f64 = 64_000.0;
/// Turns of a lookup in a hashed page table. They are turns of loops within loops, and a driver's one number
/// counts those, too. A brick that is there takes one for its level, and one for each bucket of its probe
/// sequence, 1.5 on average in a table that is half full; one that is not takes one for its level and 2.5
/// buckets before its ancestor is looked up. So this is a brick whose ancestor above it is there. A ray meets
/// so many bricks that it has the average, and where more levels are missing the bricks that are shown are
/// larger, and fewer.
const TURNS_OF_HASHED: f64 = 6.0;
/// Bricks of which any pool has a direct table.
const MOST_DIRECT: f64 = 4_194_304.0;
/// Turns in which a change of the level is found along a ray in perspective (steps.wgsl): ten or so, in each
/// of which levels are gone through.
const TURNS_PER_LEVEL: f64 = 150.0;

/// Voxels that are drawn, and where.
#[derive(Clone, Debug)]
pub struct RayVoxels {
    of: VolumeBox,
    /// The corners of what is left of them, in the world.
    shown: [DVec3; 2],
    levels: Arc<VoxelLevels>,
    brick: u32,
}

/// How rays through a volume are sampled, from which it follows how much they may meet.
#[derive(Clone, Debug)]
pub struct RayBounds {
    /// What is made of the samples of a ray.
    pub mode: VolumeMode,
    /// Channels that are shown.
    pub channels: usize,
    /// Samples are so far apart, in sides of a voxel.
    pub step: f64,
    /// True if a processor draws.
    pub is_processor: bool,
    /// The volume.
    pub image: RayVoxels,
    /// Labels over it, and what a ray takes for them ([`VolumeLabels::turns`](super::VolumeLabels::turns)).
    pub labels: Option<(RayVoxels, LabelTurns)>,
}

/// Of what a ray may meet more than is taken, so that it is cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RayCut {
    /// Bricks: so many, where [`RAY_BRICKS`] are taken.
    Bricks(f64),
    /// Voxels of labels: so many, and so many are taken.
    Labels([f64; 2]),
    /// Samples: so many, and so many are taken; and the least step at which no ray has more, if there is one.
    Samples([f64; 2], Option<f64>),
}

impl RayBounds {
    /// Where rays of a picture of so many pixels may be cut. Nothing is said of slices.
    pub fn cut(&self, view: &VolumeView, size: [u32; 2]) -> Option<RayCut> {
        if view.is_slice() {
            return None;
        }
        let rays = view.rays(&self.image.of, size);
        let image = if self.channels > 0 { self.image.met(&rays, &self.image) } else { Met::default() };
        let (labels, [of_voxel, looks]) = match &self.labels {
            Some((labels, turns)) => {
                (labels.met(&rays, &self.image), [turns.per_voxel, turns.looks].map(f64::from))
            }
            None => (Met::default(), [0.0; 2]),
        };
        let bricks = image.bricks.max(labels.bricks).floor();
        if bricks > f64::from(RAY_BRICKS) {
            return Some(RayCut::Bricks(bricks));
        }
        let channels = self.channels as f64;
        // A direct table has no loop.
        let lookup = if self.may_be_hashed() { TURNS_OF_HASHED } else { 0.0 };
        // Turns of loops for labels, for what a sample takes, and for what all samples take beside it.
        let beside_labels = looks * ((5.0 + lookup) * labels.bricks + 30.0);
        let of_labels = of_voxel * labels.crossed + beside_labels;
        if self.is_processor && self.labels.is_some() && of_labels > MOST_TURNS {
            let most = ((MOST_TURNS - beside_labels) / of_voxel).max(0.0).floor();
            return Some(RayCut::Labels([labels.crossed, most]));
        }
        let (of_sample, beside) = match self.mode {
            // They are added to one another, 16 at a time, and fewer where a brick ends.
            VolumeMode::Emission => {
                let of_chunk = (2.0 + lookup) * channels + 3.0;
                (channels + 1.0 + of_chunk / 16.0, of_chunk * image.bricks + TURNS_PER_LEVEL * image.changes)
            }
            // One walk for all of them: a brick takes a turn, one that leads to it, and two of each channel.
            _ => {
                let of_brick = (2.0 + lookup) * channels + 2.0;
                (channels, of_brick * image.bricks + TURNS_PER_LEVEL * image.changes)
            }
        };
        let samples = image.voxels / self.step;
        let most = match self.is_processor {
            true => ((MOST_TURNS - of_labels - beside) / of_sample.max(1.0)).min(f64::from(RAY_SAMPLES)),
            false => f64::from(RAY_SAMPLES),
        };
        if self.channels == 0 || samples <= most {
            return None;
        }
        let step = (most >= 1.0).then(|| (image.voxels / most * 100.0).ceil() / 100.0);
        Some(RayCut::Samples([samples, most.max(0.0).floor()], step))
    }
}

impl RayBounds {
    /// Returns true if page tables may be hashed: where all textures have more bricks together than a direct
    /// table is kept for, which is what the tables of a pool have room for on any device.
    fn may_be_hashed(&self) -> bool {
        let labels = self.labels.as_ref().map_or(0.0, |(labels, _)| labels.bricks());
        self.channels as f64 * self.image.bricks() + labels > MOST_DIRECT
    }
}

/// What a ray meets at most.
#[derive(Clone, Copy, Debug, Default)]
struct Met {
    /// Voxels along the axis along which it meets most: the samples at a step of 1.
    voxels: f64,
    /// Voxels that it passes, along all axes.
    crossed: f64,
    bricks: f64,
    /// Levels, where they follow from how far it is.
    changes: f64,
}

impl Met {
    /// Adds so many voxels of a level along each axis, in bricks of so many a side.
    fn add(&mut self, voxels: DVec3, brick: u32) {
        self.voxels += voxels.max_element();
        self.crossed += voxels.element_sum();
        self.bricks += voxels.element_sum() / f64::from(brick) + 1.0;
    }
}

impl RayVoxels {
    /// The voxels of a box whose first corner is at `begin`, of which a clip leaves a part; in bricks of so
    /// many voxels along each side.
    pub fn new(
        of: VolumeBox,
        begin: DVec3,
        (levels, brick): (Arc<VoxelLevels>, u32),
        clip: &VolumeClip,
    ) -> RayVoxels {
        let [low, high] = clip.corners;
        // The plane of a clip is not heeded: it can only hide more.
        let low = begin.max(low);
        RayVoxels { of, shown: [low, (begin + of.extent()).min(high).max(low)], levels, brick }
    }

    /// Bricks of all levels.
    fn bricks(&self) -> f64 {
        let along = |side: u32| f64::from(side.div_ceil(self.brick));
        self.levels.levels().iter().map(|level| level.size.map(along).iter().product::<f64>()).sum()
    }

    /// What rays meet of them, of each level where it is wanted; only within the box of an image is anything
    /// drawn.
    fn met(&self, rays: &VolumeRays, image: &RayVoxels) -> Met {
        let mut met = Met::default();
        let levels = 0..self.levels.levels().len();
        if rays.growth == 0.0 {
            // All rays look the same way, and of one level.
            let direction = rays.toward[0].normalize_or(DVec3::Z).abs();
            let length = self.longest(direction).min(image.longest(direction));
            let level = levels.rev().find(|level| self.widest(*level) <= rays.pixel * (1.0 + 1e-12));
            met.add(direction * length / self.voxel(level.unwrap_or(0)), self.brick);
            return met;
        }
        let [own, of_image] = [self.distances(rays.origin[0]), image.distances(rays.origin[0])];
        let (first, mut last) = (own[0].max(of_image[0]), own[1].min(of_image[1]));
        // From the coarsest one on, which begins where a pixel is as large as its voxels.
        for level in levels.rev() {
            let begin = match level {
                0 => first,
                _ => ((self.widest(level) - rays.pixel) / rays.growth).max(first),
            };
            if begin < last {
                let voxel = self.voxel(level);
                let size = self.levels.level(level as u8).size.map(f64::from);
                // A sample more where the level changes.
                met.add(((last - begin) / voxel).min(DVec3::from_array(size)) + 1.0, self.brick);
                met.changes += 1.0;
                last = begin;
            }
        }
        met
    }

    /// The longest way through them.
    fn longest(&self, direction: DVec3) -> f64 {
        // What does not move along an axis is not bounded by it.
        let length = |axis: usize| match direction[axis] {
            0.0 => f64::INFINITY,
            along => (self.shown[1][axis] - self.shown[0][axis]) / along,
        };
        length(0).min(length(1)).min(length(2))
    }

    /// How near to a place they are, and how far they reach from it.
    fn distances(&self, eye: DVec3) -> [f64; 2] {
        let [low, high] = self.shown;
        [(eye - eye.clamp(low, high)).length(), (eye - low).abs().max((high - eye).abs()).length()]
    }

    /// The sides of a voxel of a level.
    fn voxel(&self, level: usize) -> DVec3 {
        let scale = |level: u8| DVec3::from_array(self.levels.level(level).scale);
        scale(level as u8) / scale(0) * self.of.voxel
    }

    /// The side of a pixel from which on a level suits it: that of its longest voxel, but along axes along
    /// which those of level 0 are as long.
    fn widest(&self, level: usize) -> f64 {
        let (voxel, finest) = (self.voxel(level), self.of.voxel);
        let sides = voxel.to_array().into_iter().zip(finest.to_array());
        sides
            .filter(|(side, finest)| *side > finest * (1.0 + 1e-12))
            .map(|(side, _)| side)
            .fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use vastex::StoredLevel;

    use super::*;
    use crate::volume::{VolumeCamera, VolumeFace};

    const FACE: VolumeView = VolumeView::Face(VolumeFace::PlusZ);

    fn voxels(size: [u64; 3], brick: u32) -> RayVoxels {
        let level = StoredLevel { size, scale: [2.0; 3], origin: [0.0; 3] };
        let (_, levels) = VoxelLevels::new(&[level], brick, 1).unwrap();
        let of = VolumeBox::new(size.map(|side| side as u32), [1.0; 3]);
        RayVoxels::new(of, DVec3::ZERO, (Arc::new(levels), brick), &VolumeClip::default())
    }

    /// Of 2 x 2 voxels and so many along z, in mip.
    fn of(is_processor: bool, step: f64, depth: u64) -> RayBounds {
        let image = voxels([2, 2, depth], 64);
        RayBounds { mode: VolumeMode::Mip, channels: 1, step, is_processor, image, labels: None }
    }

    fn least_step(cut: Option<RayCut>) -> Option<f64> {
        let Some(RayCut::Samples(_, step)) = cut else { panic!("{cut:?}") };
        step
    }

    #[test]
    fn a_step_of_which_rays_have_too_many_samples_is_told_with_one_that_is_taken() {
        let deep = |bounds: RayBounds| bounds.cut(&FACE, [2, 2]);
        assert_eq!(deep(of(false, 1.0, 262_000)), None);
        let cut = deep(of(false, 0.2, 262_000));
        assert_eq!(cut, Some(RayCut::Samples([1_310_000.0, 262_144.0], Some(1.0))));
        assert_eq!(least_step(deep(of(true, 1.0, 70_000))), Some(1.18));
        assert_eq!(deep(of(true, 1.18, 70_000)), None);
        assert!(deep(RayBounds { channels: 2, ..of(true, 1.18, 70_000) }).is_some());
        let emission = |step| deep(RayBounds { mode: VolumeMode::Emission, ..of(true, step, 30_000) });
        assert!(emission(1.0).is_some() && emission(4.0).is_none());
        // Along a short side there are few, and a slice has one.
        let deep = of(true, 1.0, 70_000);
        assert_eq!(deep.cut(&VolumeView::Face(VolumeFace::PlusX), [70_000, 2]), None);
        assert_eq!(deep.cut(&VolumeView::Slice { axis: 0, voxel: 1 }, [70_000, 2]), None);
    }

    #[test]
    fn rays_of_more_bricks_than_feedback_asks_for_are_cut_whatever_the_step() {
        let small = |depth| {
            let image = voxels([2, 2, depth], 32);
            RayBounds { image, ..of(false, 9.0, depth) }.cut(&FACE, [2, 2])
        };
        assert_eq!(small(131_000), None);
        assert_eq!(small(132_000), Some(RayCut::Bricks(4126.0)));
        let whole = of(false, 100.0, 4_194_304);
        assert!(whole.cut(&FACE, [2, 2]).is_some());
        // Of what is cut away nothing is met.
        let clip = VolumeClip { corners: [DVec3::ZERO, DVec3::splat(200_000.0)], plane: None };
        let RayVoxels { of, levels, brick, .. } = whole.image;
        let image = RayVoxels::new(of, DVec3::ZERO, (levels, brick), &clip);
        assert_eq!(RayBounds { image, ..whole }.cut(&FACE, [2, 2]), None);
    }

    #[test]
    fn the_levels_that_are_wanted_along_rays_are_counted() {
        let large = RayBounds { image: voxels([100_000; 3], 64), ..of(true, 1.0, 1) };
        assert_eq!(large.cut(&FACE, [125, 125]), None);
        assert!(large.cut(&FACE, [100_000, 100_000]).is_some());
        let around = VolumeCamera::around(&large.image.of, [1.0, 0.7, 0.5], [0.0, 0.0, 1.0]);
        assert_eq!(large.cut(&VolumeView::Around(around), [125, 125]), None);
        // Near the eye the finest level is wanted, and coarser ones soon.
        let within = VolumeCamera { eye: large.image.of.extent() * 0.4, ..around };
        let within = VolumeView::Around(within);
        let met = large.image.met(&within.rays(&large.image.of, [125, 125]), &large.image);
        assert!((500.0..5000.0).contains(&met.voxels), "{met:?}");
        assert_eq!(large.cut(&within, [125, 125]), None);
        assert!(large.cut(&within, [100_000, 100_000]).is_some());
    }

    /// Turns of lookups in hashed tables are turns of a driver's loops as all others are.
    #[test]
    fn lookups_in_hashed_tables_are_counted() {
        // 1001 bricks along a ray, in a table of an entry for each brick or in one of what is there.
        let of_width = |width: u64, channels| {
            let image = voxels([width, width, 16_000], 16);
            RayBounds { image, channels, ..of(true, 1.0, 16_000) }
        };
        let [direct, hashed] = [of_width(64, 3), of_width(2000, 3)];
        assert!(!direct.may_be_hashed() && hashed.may_be_hashed());
        assert_eq!(direct.cut(&FACE, [64, 64]), None);
        let cut = |bounds: &RayBounds| least_step(bounds.cut(&FACE, [2000, 2000]));
        // Of 64,000 turns 8 for each channel of 1001 bricks, and 2 for each brick, are no samples.
        let left = (64_000.0 - 26.0 * 1001.0) / 3.0;
        assert_eq!(cut(&hashed), Some((16_000.0_f64 / left * 100.0).ceil() / 100.0));
        let bounds = RayBounds { mode: VolumeMode::Emission, ..of_width(2000, 3) };
        assert!(
            cut(&bounds).is_some() && RayBounds { step: 4.0, ..bounds }.cut(&FACE, [2000, 2000]).is_none()
        );
    }

    #[test]
    fn labels_take_of_what_is_left_for_samples() {
        let with = |step, depth, looks| {
            let turns = LabelTurns { per_voxel: looks, looks };
            let labels = Some((voxels([2, 2, depth], 64), turns));
            RayBounds { labels, ..of(true, step, depth) }.cut(&FACE, [2, 2])
        };
        assert_eq!(of(true, 1.0, 30_000).cut(&FACE, [2, 2]), None);
        assert_eq!(with(1.0, 29_700, 1), None);
        assert_eq!(least_step(with(1.0, 31_900, 1)), Some(1.16));
        assert_eq!(with(1.16, 31_900, 1), None);
        // 32,000 for each turn of a voxel, of which each of 499 or 500 bricks takes five.
        let Some(RayCut::Labels([31_900.0, most])) = with(1.0, 31_900, 2) else { panic!() };
        assert!((29_400.0..29_500.0).contains(&most), "{most}");
        let image = voxels([2, 2, 40_000], 64);
        let labels = Some((image.clone(), LabelTurns { per_voxel: 1, looks: 1 }));
        let alone = RayBounds { channels: 0, image, labels, ..of(true, 0.1, 9) };
        assert_eq!(alone.cut(&FACE, [2, 2]), None);
    }
}
