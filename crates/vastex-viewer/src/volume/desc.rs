//! What is drawn of a volume, and how many bricks its rays meet.

use glam::DVec3;
use vastex::{RAY_ANSWERS, RAY_TURNS};

use super::camera::{VolumeBox, VolumeClip, VolumeView};
#[cfg(doc)]
use super::channel::MOST_CHANNELS;
use super::channel::VolumeChannel;
use super::labels::VolumeLabels;

/// What becomes of the samples along a ray.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum VolumeMode {
    /// The largest.
    #[default]
    Mip,
    /// The smallest.
    Minip,
    /// The mean of the samples.
    Average,
    /// Emission and absorption: all samples glow, and hide what is behind them.
    Emission,
    /// The surface at which a value is reached.
    Iso,
}

impl VolumeMode {
    /// Every mode.
    pub const ALL: [VolumeMode; 5] =
        [VolumeMode::Mip, VolumeMode::Minip, VolumeMode::Average, VolumeMode::Emission, VolumeMode::Iso];

    /// The mode's name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            VolumeMode::Mip => "mip",
            VolumeMode::Minip => "minip",
            VolumeMode::Average => "average",
            VolumeMode::Emission => "emission",
            VolumeMode::Iso => "iso",
        }
    }
}

/// What is drawn of a volume.
#[derive(Clone, Debug, PartialEq)]
pub struct VolumeDesc {
    /// The volume's box.
    pub of: VolumeBox,
    /// The channels that are shown: 1 to [`MOST_CHANNELS`], of textures of one geometry and one format; none
    /// where there are labels alone.
    ///
    /// Along rays all are sampled where the first one's level, with the bias of its
    /// [`LevelRule`](vastex::LevelRule), has samples, since light is added up from samples of all channels at
    /// one place, each weighed by one step. So a bias of another channel acts on slices alone; its `finest`
    /// and `coarsest` act along rays, too, and keep it coarser or finer than the first.
    pub channels: Vec<VolumeChannel>,
    /// The labels that are shown over them.
    pub labels: Option<VolumeLabels>,
    /// What becomes of samples along a ray; slices have none.
    pub mode: VolumeMode,
    /// How far samples along a ray are apart, in sides of a voxel of the level that is wanted: 1, 1/3 and 1/5
    /// have samples in the middles of voxels where rays go along an axis.
    pub step: f64,
    /// How dense a volume is in emission: 1 where a ray of a hundredth of the longest side of the box passes
    /// 1 - opacity.
    pub density: f64,
    /// The value at which a surface is, as shaders sample it.
    pub iso: f32,
    /// True if samples are blended by the shader in single precision, and not by the device's filter.
    pub is_exact: bool,
    /// What is left of it for rays.
    pub clip: VolumeClip,
    /// Of how many pictures that of a camera which rests is the mean, where the host goes on with it
    /// ([`VolumeRenderer::go_on`](super::VolumeRenderer::go_on)); 1 for no other picture than the first. What
    /// frames draw by themselves never hangs on it.
    pub passes: u32,
}

impl VolumeDesc {
    /// Channels of a volume by [`VolumeMode::Mip`].
    pub fn new(of: VolumeBox, channels: Vec<VolumeChannel>) -> VolumeDesc {
        let mode = VolumeMode::default();
        let (labels, clip) = (None, VolumeClip::default());
        let (step, density, iso, is_exact, passes) = (1.0, 1.0, 0.5, false, 1);
        VolumeDesc { of, channels, labels, mode, step, density, iso, is_exact, clip, passes }
    }

    /// An upper estimate of the bricks of `brick` voxels a side that one ray of a picture meets: 1 to 120, as
    /// many as a view asks for ([`vastex::ViewMut::set_bricks_of_a_ray`]).
    pub fn bricks_of_a_ray(&self, view: &VolumeView, brick: u32, picture: [u32; 2]) -> u32 {
        if view.is_slice() {
            return 1 + u32::from(self.labels.is_some());
        }
        let rays = view.rays(&self.of, picture);
        let extent = self.of.extent();
        // The part of the rays that can lie in the box.
        let (near, far) = match view {
            VolumeView::Around(camera) => {
                let beside = (camera.eye - camera.eye.clamp(DVec3::ZERO, extent)).length();
                (beside, beside + extent.length())
            }
            _ => (0.0, rays.toward[0].normalize_or_zero().abs().dot(extent)),
        };
        // Up to where voxels of level 0 are seen; from there on voxels are half of a pixel at least.
        let side = self.of.voxel.min_element() * f64::from(brick.max(1));
        let fine = if rays.growth > 0.0 {
            (self.of.voxel.min_element() - rays.pixel) / rays.growth
        } else {
            f64::MAX
        };
        let bricks = match rays.growth > 0.0 {
            true => {
                let begin = near.max(fine).max(f64::MIN_POSITIVE);
                let of_octaves = 2.0 / (rays.growth * f64::from(brick.max(1))) * (far / begin).max(1.0).ln();
                (far.min(fine) - near).max(0.0) / side + of_octaves
            }
            false => (far - near) / side / (rays.pixel / self.of.voxel.min_element() / 2.0).max(1.0),
        };
        // Rays go across bricks, and through one more along each axis that they go along.
        let axes = rays.toward[0].abs().to_array().into_iter().filter(|along| *along > 1e-9).count() as f64;
        // What is asked for of labels is asked for in turn with that of the image.
        let of_labels = if self.labels.is_some() { 2.0 } else { 1.0 };
        ((bricks * axes.sqrt() + axes) * of_labels).ceil().clamp(1.0, f64::from(MOST_BRICKS)) as u32
    }
}

/// Frames in a row without news after which [`vastex::Inspect::is_converged`] speaks of what a view that
/// rests sees now, and not of what it saw before.
pub const QUIET_FRAMES: u64 = 4;

/// As many bricks as a view can ask for along one ray.
const MOST_BRICKS: u32 = RAY_ANSWERS * RAY_TURNS;
