//! How many samples, bricks and labels rays through a volume meet, and whether what draws takes as many: a
//! ray that is cut is told of before anything is drawn.

use anyhow::{Result, bail};
use glam::DVec3;
use vastex::{RAY_BRICKS, VoxelLevels};
use vastex_viewer::volume::{RAY_SAMPLES, VolumeBox, VolumeClip, VolumeMode, VolumeRays, VolumeView};
use vastex_volume::{VolumeAbout, VolumeOptions, levels_of};

use super::box_of;
use crate::args::RenderVolumeArgs;
use crate::commands::render_labels::Labels;

/// A software driver ends a pixel without a word after 65,535 turns of loops, of all loops together; some of
/// these are counted nowhere here.
const MOST_TURNS: f64 = 64_000.0;
/// Turns in which a change of the level is found along a ray in perspective (steps.wgsl).
const TURNS_PER_LEVEL: f64 = 50.0;

/// Voxels that are drawn, and where.
pub(super) struct Voxels {
    of: VolumeBox,
    /// The corners of what is left of them, in the world.
    shown: [DVec3; 2],
    levels: VoxelLevels,
    brick: u32,
}

/// How rays are sampled.
pub(super) struct Sampling {
    mode: VolumeMode,
    channels: usize,
    step: f64,
    /// Whether a processor draws.
    is_processor: bool,
    image: Voxels,
    /// Labels over it, and how often a ray is looked along for them.
    labels: Option<(Voxels, u32)>,
}

impl Sampling {
    /// Of so many channels of what is left of a volume, in bricks of so many voxels a side.
    pub(super) fn new(
        args: &RenderVolumeArgs,
        is_processor: bool,
        ((about, channels, clip), brick): ((&VolumeAbout, usize, &VolumeClip), u32),
        labels: Option<&Labels>,
    ) -> Result<Sampling> {
        let (_, levels) = levels_of(about, brick, VolumeOptions::default().border)?;
        let labels = labels.map(|labels| {
            let (of, begin) = labels.place();
            let levels = VoxelLevels::clone(labels.source.levels());
            (Voxels::new(of, begin.into(), (levels, brick), clip), labels.looks(args))
        });
        Ok(Sampling {
            mode: args.look.mode(),
            channels,
            step: args.look.step(),
            is_processor,
            image: Voxels::new(box_of(about)?, DVec3::ZERO, (levels, brick), clip),
            labels,
        })
    }

    /// Fails where rays of a view may meet more than is taken.
    pub(super) fn check(&self, view: &VolumeView, size: [u32; 2]) -> Result<()> {
        if view.is_slice() {
            return Ok(());
        }
        let rays = view.rays(&self.image.of, size);
        let image = if self.channels > 0 { self.image.met(&rays, &self.image) } else { Met::default() };
        let (labels, looks) = match &self.labels {
            Some((labels, looks)) => (labels.met(&rays, &self.image), f64::from(*looks)),
            None => (Met::default(), 0.0),
        };
        let bricks = image.bricks.max(labels.bricks).floor();
        if bricks > f64::from(RAY_BRICKS) {
            bail!(
                "rays would meet up to {bricks} bricks, and {RAY_BRICKS} are shown at most; draw a smaller picture, of which \
                 coarser levels are seen, look along a shorter side, or give a larger --pool-mib, which makes bricks larger"
            );
        }
        let who = if self.is_processor { "this adapter, a processor," } else { "a ray" };
        // Turns of loops for labels, for what a sample takes, and for what all samples take beside it.
        let beside_labels = 2.0 * labels.bricks + 30.0;
        let of_labels = looks * (labels.crossed + beside_labels);
        if self.is_processor && self.labels.is_some() && of_labels > MOST_TURNS {
            let most = (MOST_TURNS / looks - beside_labels).max(0.0).floor();
            bail!(
                "rays would pass up to {:.0} voxels of labels, and {who} takes {most} at most; draw a smaller picture, of which \
                 coarser levels are seen, look along a shorter side, or leave the labels out",
                labels.crossed
            );
        }
        let channels = self.channels as f64;
        let (of_sample, beside) = match self.mode {
            // They are added to one another, 16 at a time, and fewer where a brick ends.
            VolumeMode::Emission => {
                let of_chunk = 2.0 * channels + 3.0;
                (channels + 1.0 + of_chunk / 16.0, of_chunk * image.bricks + TURNS_PER_LEVEL * image.changes)
            }
            _ => (channels, channels * (2.0 * image.bricks + TURNS_PER_LEVEL * image.changes)),
        };
        let samples = image.voxels / self.step;
        let most = match self.is_processor {
            true => ((MOST_TURNS - of_labels - beside) / of_sample.max(1.0)).min(f64::from(RAY_SAMPLES)),
            false => f64::from(RAY_SAMPLES),
        };
        if self.channels == 0 || samples <= most {
            return Ok(());
        }
        let taken = most.max(0.0).floor();
        let advice = match most >= 1.0 {
            true => format!("write {} or more", (image.voxels / most * 100.0).ceil() / 100.0),
            false => "no step is long enough; show fewer channels, or no labels".to_owned(),
        };
        bail!(
            "--step {}: rays would have up to {samples:.0} samples, and {who} takes {taken} at most; {advice}",
            self.step
        );
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

impl Voxels {
    /// Those of a box whose first corner is at `begin`, of which a clip leaves a part.
    fn new(of: VolumeBox, begin: DVec3, (levels, brick): (VoxelLevels, u32), clip: &VolumeClip) -> Voxels {
        let [low, high] = clip.corners;
        // The plane of a clip is not heeded: it can only hide more.
        let low = begin.max(low);
        Voxels { of, shown: [low, (begin + of.extent()).min(high).max(low)], levels, brick }
    }

    /// What rays meet of them, of each level where it is wanted; only within the box of an image is anything
    /// drawn.
    fn met(&self, rays: &VolumeRays, image: &Voxels) -> Met {
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
    use vastex_viewer::volume::{VolumeCamera, VolumeFace};

    use super::*;

    const FACE: VolumeView = VolumeView::Face(VolumeFace::PlusZ);

    fn voxels(size: [u64; 3], brick: u32) -> Voxels {
        let level = StoredLevel { size, scale: [2.0; 3], origin: [0.0; 3] };
        let (_, levels) = VoxelLevels::new(&[level], brick, 1).unwrap();
        let of = VolumeBox::new(size.map(|side| side as u32), [1.0; 3]);
        Voxels::new(of, DVec3::ZERO, (levels, brick), &VolumeClip::default())
    }

    /// Of 2 x 2 voxels and so many along z, in mip.
    fn of(is_processor: bool, step: f64, depth: u64) -> Sampling {
        let image = voxels([2, 2, depth], 64);
        Sampling { mode: VolumeMode::Mip, channels: 1, step, is_processor, image, labels: None }
    }

    fn checked(sampling: &Sampling, view: VolumeView, size: [u32; 2]) -> Result<(), String> {
        sampling.check(&view, size).map_err(|error| error.to_string())
    }

    #[test]
    fn a_step_of_which_rays_have_too_many_samples_is_refused_with_one_that_is_taken() {
        let deep = |sampling: Sampling| checked(&sampling, FACE, [2, 2]);
        deep(of(false, 1.0, 262_000)).unwrap();
        let error = deep(of(false, 0.2, 262_000)).unwrap_err();
        assert!(error.contains("1310000 samples") && error.ends_with("write 1 or more"), "{error}");
        assert!(deep(of(true, 1.0, 70_000)).unwrap_err().ends_with("write 1.14 or more"));
        deep(of(true, 1.14, 70_000)).unwrap();
        assert!(deep(Sampling { channels: 2, ..of(true, 1.14, 70_000) }).is_err());
        let emission = |step| deep(Sampling { mode: VolumeMode::Emission, ..of(true, step, 30_000) });
        assert!(emission(1.0).is_err() && emission(4.0).is_ok());
        // Along a short side there are few.
        checked(&of(true, 1.0, 70_000), VolumeView::Face(VolumeFace::PlusX), [70_000, 2]).unwrap();
    }

    #[test]
    fn rays_of_more_bricks_than_feedback_asks_for_are_refused_whatever_the_step() {
        let small = |depth| {
            let image = voxels([2, 2, depth], 32);
            checked(&Sampling { image, ..of(false, 9.0, depth) }, FACE, [2, 2])
        };
        small(131_000).unwrap();
        let error = small(132_000).unwrap_err();
        assert!(error.contains("4126 bricks") && !error.contains("--step"), "{error}");
        assert!(checked(&of(false, 100.0, 4_194_304), FACE, [2, 2]).is_err());
        // Of what is cut away nothing is met.
        let whole = of(false, 100.0, 4_194_304);
        let clip = VolumeClip { corners: [DVec3::ZERO, DVec3::splat(200_000.0)], plane: None };
        let Voxels { of, levels, brick, .. } = whole.image;
        let image = Voxels::new(of, DVec3::ZERO, (levels, brick), &clip);
        checked(&Sampling { image, ..whole }, FACE, [2, 2]).unwrap();
    }

    #[test]
    fn the_levels_that_are_wanted_along_rays_are_counted() {
        let large = Sampling { image: voxels([100_000; 3], 64), ..of(true, 1.0, 1) };
        checked(&large, FACE, [125, 125]).unwrap();
        assert!(checked(&large, FACE, [100_000, 100_000]).is_err());
        let around = VolumeCamera::around(&large.image.of, [1.0, 0.7, 0.5], [0.0, 0.0, 1.0]);
        checked(&large, VolumeView::Around(around), [125, 125]).unwrap();
        // Near the eye the finest level is wanted, and coarser ones soon.
        let within = VolumeCamera { eye: large.image.of.extent() * 0.4, ..around };
        let met =
            large.image.met(&VolumeView::Around(within).rays(&large.image.of, [125, 125]), &large.image);
        assert!((500.0..5000.0).contains(&met.voxels), "{met:?}");
        checked(&large, VolumeView::Around(within), [125, 125]).unwrap();
        assert!(checked(&large, VolumeView::Around(within), [100_000, 100_000]).is_err());
        checked(&large, VolumeView::Slice { axis: 2, voxel: 5 }, [100_000, 100_000]).unwrap();
    }

    #[test]
    fn labels_take_of_what_is_left_for_samples() {
        let with = |step, depth, looks| {
            let labels = Some((voxels([2, 2, depth], 64), looks));
            checked(&Sampling { labels, ..of(true, step, depth) }, FACE, [2, 2])
        };
        checked(&of(true, 1.0, 30_000), FACE, [2, 2]).unwrap();
        with(1.0, 30_000, 1).unwrap();
        let error = with(1.0, 31_900, 1).unwrap_err();
        assert!(error.ends_with("write 1.07 or more"), "{error}");
        with(1.07, 31_900, 1).unwrap();
        let error = with(1.0, 31_900, 2).unwrap_err();
        assert!(error.contains("31900 voxels of labels") && !error.contains("--step"), "{error}");
        // 32,000 turns a look, of which 499 or 500 bricks take two each.
        let most: u32 = error.split(" takes ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
        assert!((30_900..31_000).contains(&most), "{error}");
        let alone =
            Sampling { channels: 0, labels: Some((voxels([2, 2, 40_000], 64), 1)), ..of(true, 0.1, 9) };
        checked(&Sampling { image: voxels([2, 2, 40_000], 64), ..alone }, FACE, [2, 2]).unwrap();
    }
}
