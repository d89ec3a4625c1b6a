//! Boxes of voxels of a level: read from the chunks that they overlap, exactly as they are stored.

use std::fmt::Display;

use super::Volume;
use super::boxes::VoxelBox;
use crate::fault::{VolumeError, VolumeFault};

/// A box of voxels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct VolumeRegion {
    /// The level; 0 is the finest that is stored.
    pub level: usize,
    /// The channel, from 0.
    pub channel: u64,
    /// The time, from 0.
    pub time: u64,
    /// The first voxel: its place along x, y and z.
    pub at: [u64; 3],
    /// Voxels along x, y and z, at least 1 each.
    pub size: [u64; 3],
}

/// Bytes of a box that is read at once.
const MOST_BYTES: u64 = 1 << 31;

impl Volume {
    /// Refuses a region that is not within the volume, with what there is instead. Reads nothing.
    pub fn check(&self, region: &VolumeRegion) -> Result<(), VolumeError> {
        self.refusal(region).map_or(Ok(()), |why| Err(VolumeFault::Request(why).at(&self.about.path)))
    }

    /// A region at another place, which may lie beyond any edge; else why it is refused, as [`Volume::check`]
    /// does. Reads nothing.
    pub fn region_at(&self, region: &VolumeRegion, at: [i64; 3]) -> Result<VolumeRegion, VolumeError> {
        let refusal = match at.map(u64::try_from) {
            [Ok(x), Ok(y), Ok(z)] => {
                let region = VolumeRegion { at: [x, y, z], ..*region };
                return self.check(&region).map(|()| region);
            }
            _ => self.refusal(&VolumeRegion { at: [0; 3], size: [1; 3], ..*region }),
        };
        let why = refusal.unwrap_or_else(|| self.beyond_edge(region, at));
        Err(VolumeFault::Request(why).at(&self.about.path))
    }

    /// Refuses a channel or a time that is not there, with what there is instead.
    pub(crate) fn check_plane(&self, channel: u64, time: u64) -> Result<(), VolumeError> {
        let refusal = self.plane_refusal(channel, time);
        refusal.map_or(Ok(()), |why| Err(VolumeFault::Request(why).at(&self.about.path)))
    }

    fn plane_refusal(&self, channel: u64, time: u64) -> Option<String> {
        let of = |at: u64, count: u64, what: &str| match count {
            _ if at < count => None,
            1 => Some(format!("there is no {what} {at}; there is only {what} 0")),
            _ => Some(format!("there is no {what} {at}; there are {what}s 0 to {}", count - 1)),
        };
        of(channel, self.about.channels, "channel").or_else(|| of(time, self.about.times, "time"))
    }

    fn refusal(&self, region: &VolumeRegion) -> Option<String> {
        let about = &self.about;
        let Some(level) = about.levels.get(region.level) else {
            return Some(format!(
                "there is no level {}; levels 0 to {} are stored",
                region.level,
                about.levels.len() - 1
            ));
        };
        if let Some(why) = self.plane_refusal(region.channel, region.time) {
            return Some(why);
        }
        let fits = |axis: usize| {
            let end = region.at[axis].checked_add(region.size[axis]);
            region.size[axis] > 0 && end.is_some_and(|end| end <= level.size[axis])
        };
        if !(0..3).all(fits) {
            return Some(self.beyond_edge(region, region.at));
        }
        None
    }

    /// What is said of a region of a level that is there, at a place where it does not fit.
    fn beyond_edge(&self, region: &VolumeRegion, at: [impl Display; 3]) -> String {
        let ([w, h, d], [x, y, z]) = (region.size, at);
        let [of_w, of_h, of_d] = self.about.levels[region.level].size;
        format!(
            "{w}x{h}x{d} voxels at {x},{y},{z} reach beyond the edge: level {} has {of_w}x{of_h}x{of_d} voxels; choose a \
             smaller region, or another place",
            region.level
        )
    }

    /// The values of a box, little-endian, x fastest, then y, then z. Chunks that it overlaps are decoded
    /// whole and kept for a while; absent ones are the fill value. Takes the memory of the box, and of up to
    /// 64 MiB of chunks beside what is kept.
    pub async fn read(&self, region: &VolumeRegion) -> Result<Vec<u8>, VolumeError> {
        self.check(region)?;
        let width = self.about.dtype.bytes();
        let bytes = region.size.iter().try_fold(width as u64, |bytes, side| bytes.checked_mul(*side));
        if bytes.is_none_or(|bytes| bytes > MOST_BYTES) {
            let why = format!("the box is larger than {MOST_BYTES} bytes; read it in parts");
            return Err(VolumeFault::TooLarge(why).at(&self.about.path));
        }
        let shared = self.shared(region.level);
        let plane = shared.plane(region.channel, region.time);
        // The box is within the level, whose sides have up to 2^31 voxels.
        let of = VoxelBox { first: region.at.map(|at| at as i64), size: region.size.map(|side| side as u32) };
        Ok(plane.read(&of).await?.values)
    }
}
