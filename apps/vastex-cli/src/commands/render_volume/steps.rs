//! How many samples rays through a volume have, and whether what draws takes as many: a ray that is cut is
//! told of before it is drawn.

use anyhow::{Result, bail};
use glam::DVec3;
use vastex::VoxelLevels;
use vastex_viewer::volume::{VolumeBox, VolumeMode, VolumeView};

/// Samples of a ray beyond which it is not looked at further (volume.wgsl).
const MOST_SAMPLES: f64 = 16_777_216.0;
/// A software driver ends a pixel without a word after 65,535 turns of loops, of all loops together; some of
/// these are of bricks.
const MOST_TURNS: f64 = 62_000.0;

/// How rays are sampled.
pub(super) struct Sampling {
    pub(super) mode: VolumeMode,
    pub(super) channels: usize,
    pub(super) step: f64,
    /// Whether a processor draws.
    pub(super) is_processor: bool,
}

impl Sampling {
    /// Fails where rays of a view may have more samples than are taken.
    pub(super) fn check(
        &self,
        (of, levels): (&VolumeBox, &VoxelLevels),
        (view, size): (&VolumeView, [u32; 2]),
    ) -> Result<()> {
        if view.is_slice() {
            return Ok(());
        }
        // A step apart, a ray has no more than the longest side has voxels, of the finest level that is
        // wanted.
        let longest_side = levels.level(0).scale.into_iter().fold(0.0, f64::max);
        let level = levels.wanted_level(narrowest_pixel(of, view, size) * longest_side);
        let samples = f64::from(levels.level(level).size.into_iter().max().unwrap_or(1)) / self.step;
        let most = self.most().floor();
        if samples > most {
            let least = (self.step * samples / most * 100.0).ceil() / 100.0;
            let who = if self.is_processor { "this adapter, a processor," } else { "a ray" };
            bail!(
                "--step {}: rays would have up to {samples:.0} samples, and {who} takes {most} at most; write {least} or more",
                self.step
            );
        }
        Ok(())
    }

    fn most(&self) -> f64 {
        let channels = self.channels.max(1) as f64;
        match (self.is_processor, self.mode) {
            (false, _) => MOST_SAMPLES,
            // What is gathered of all channels is begun and added in loops, too.
            (true, VolumeMode::Emission) => MOST_TURNS / (channels + 2.0),
            (true, _) => MOST_TURNS / channels,
        }
    }
}

/// The side of a pixel in the world where a ray first meets the box, at least.
fn narrowest_pixel(of: &VolumeBox, view: &VolumeView, size: [u32; 2]) -> f64 {
    let rays = view.rays(of, size);
    let eye = rays.origin[0];
    rays.pixel + rays.growth * (eye - eye.clamp(DVec3::ZERO, of.extent())).length()
}

#[cfg(test)]
mod tests {
    use vastex::StoredLevel;
    use vastex_viewer::volume::{VolumeCamera, VolumeFace};

    use super::*;

    fn checked(sampling: &Sampling, size: [u64; 3], view: VolumeView, picture: [u32; 2]) -> Result<()> {
        let level = StoredLevel { size, scale: [2.0; 3], origin: [0.0; 3] };
        let (_, levels) = VoxelLevels::new(&[level], 64, 1)?;
        let of = VolumeBox::new(size.map(|side| side as u32), [1.0; 3]);
        sampling.check((&of, &levels), (&view, picture))
    }

    #[test]
    fn a_step_of_which_rays_have_too_many_samples_is_refused_with_one_that_is_taken() {
        let face = VolumeView::Face(VolumeFace::PlusZ);
        let gpu = |step| Sampling { mode: VolumeMode::Mip, channels: 3, step, is_processor: false };
        checked(&gpu(1.0), [2, 2, 4_194_304], face, [2, 2]).unwrap();
        let error = checked(&gpu(0.2), [2, 2, 4_194_304], face, [2, 2]).unwrap_err().to_string();
        assert!(error.contains("20971520 samples") && error.ends_with("write 0.25 or more"), "{error}");
        checked(&gpu(0.25), [2, 2, 4_194_304], face, [2, 2]).unwrap();
        let processor = |mode, step, channels| Sampling { mode, channels, step, is_processor: true };
        let deep = |mode, step, channels| {
            checked(&processor(mode, step, channels), [2, 2, 70_000], face, [2, 2]).map_err(|e| e.to_string())
        };
        assert!(deep(VolumeMode::Mip, 1.0, 1).unwrap_err().ends_with("write 1.13 or more"));
        assert!(deep(VolumeMode::Mip, 1.13, 1).is_ok() && deep(VolumeMode::Mip, 1.13, 2).is_err());
        assert!(deep(VolumeMode::Emission, 1.13, 1).is_err());
        // Of what is smaller than a pixel coarser levels are sampled, and in perspective, too; slices have no
        // rays.
        let of = processor(VolumeMode::Mip, 1.0, 1);
        checked(&of, [100_000; 3], face, [125, 125]).unwrap();
        assert!(checked(&of, [100_000; 3], face, [100_000, 100_000]).is_err());
        let large = VolumeBox::new([100_000; 3], [1.0; 3]);
        let around = VolumeCamera::around(&large, [1.0, 0.7, 0.5], [0.0, 0.0, 1.0]);
        checked(&of, [100_000; 3], VolumeView::Around(around), [125, 125]).unwrap();
        let within = VolumeCamera { eye: large.extent() * 0.4, ..around };
        assert!(checked(&of, [100_000; 3], VolumeView::Around(within), [125, 125]).is_err());
        checked(&of, [100_000; 3], VolumeView::Slice { axis: 2, voxel: 5 }, [100_000, 100_000]).unwrap();
    }
}
