//! Boxes of voxels of a level: read from the chunks that they overlap, exactly as they are stored.

use super::{LevelArray, Volume};
use crate::chunks::Chunk;
use crate::fault::{VolumeError, VolumeFault, damaged};

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

    fn refusal(&self, region: &VolumeRegion) -> Option<String> {
        let about = &self.about;
        let Some(level) = about.levels.get(region.level) else {
            return Some(format!(
                "there is no level {}; levels 0 to {} are stored",
                region.level,
                about.levels.len() - 1
            ));
        };
        let last = |count: u64, what: &str| match count {
            1 => format!("there is only {what} 0"),
            _ => format!("there are {what}s 0 to {}", count - 1),
        };
        if region.channel >= about.channels {
            return Some(format!(
                "there is no channel {}; {}",
                region.channel,
                last(about.channels, "channel")
            ));
        }
        if region.time >= about.times {
            return Some(format!("there is no time {}; {}", region.time, last(about.times, "time")));
        }
        let fits = |axis: usize| {
            let end = region.at[axis].checked_add(region.size[axis]);
            region.size[axis] > 0 && end.is_some_and(|end| end <= level.size[axis])
        };
        if !(0..3).all(fits) {
            let ([w, h, d], [x, y, z], [of_w, of_h, of_d]) = (region.size, region.at, level.size);
            return Some(format!(
                "{w}x{h}x{d} voxels at {x},{y},{z} reach beyond the edge: level {} has {of_w}x{of_h}x{of_d} voxels; choose a \
                 smaller region, or another place",
                region.level
            ));
        }
        None
    }

    /// The values of a box, little-endian, x fastest, then y, then z. Chunks that it overlaps are decoded
    /// whole and kept for a while; absent ones are the fill value. Takes the memory of the box and of one
    /// chunk beside what is kept.
    pub async fn read(&self, region: &VolumeRegion) -> Result<Vec<u8>, VolumeError> {
        self.check(region)?;
        let width = self.about.dtype.bytes();
        let bytes = region.size.iter().try_fold(width as u64, |bytes, side| bytes.checked_mul(*side));
        let Some(bytes) = bytes.filter(|bytes| *bytes <= MOST_BYTES) else {
            let why = format!("the box is larger than {MOST_BYTES} bytes; read it in parts");
            return Err(VolumeFault::TooLarge(why).at(&self.about.path));
        };
        let array = &self.arrays[region.level];
        let mut values = Vec::new();
        let reserved = values.try_reserve_exact(bytes as usize);
        reserved.map_err(|error| VolumeFault::TooLarge(error.to_string()).at(&self.about.path))?;
        let fill = array.source.fill();
        for _ in 0..bytes as usize / width {
            values.extend_from_slice(&fill[..width]);
        }
        let chunk = array.grid.chunk_size();
        let range = |axis: usize| {
            region.at[axis] / chunk[axis]..=(region.at[axis] + region.size[axis] - 1) / chunk[axis]
        };
        for z in range(2) {
            for y in range(1) {
                for x in range(0) {
                    self.read_part(array, region, [x, y, z], &mut values).await?;
                }
            }
        }
        Ok(values)
    }

    /// Copies what a chunk has of a box.
    async fn read_part(
        &self,
        array: &LevelArray,
        region: &VolumeRegion,
        place: [u64; 3],
        values: &mut [u8],
    ) -> Result<(), VolumeError> {
        let coords = array.grid.coords(place, region.channel, region.time);
        let key = (region.level, coords);
        let found = match self.cache.find(&key) {
            Some(found) => found,
            None => {
                let found = array.source.read(&key.1).await?;
                self.cache.keep(key, found.clone());
                found
            }
        };
        let Some(chunk) = found else { return Ok(()) };
        let part = Part::new(array, region, place);
        let offset = array.grid.offset(&chunk.strides, region.channel, region.time);
        let strides = array.grid.space().map(|axis| axis.map_or(0, |axis| chunk.strides[axis]));
        part.copy(&chunk, offset, strides, self.about.dtype.bytes(), region.size, values).ok_or_else(|| {
            damaged(format!(
                "the chunk at {place:?} of level {} is smaller than its array says",
                region.level
            ))
            .at(&self.about.path)
        })
    }
}

/// What a chunk and a box have in common.
struct Part {
    /// The first voxel, in the chunk and in the box.
    within: [usize; 3],
    to: [usize; 3],
    size: [usize; 3],
}

impl Part {
    fn new(array: &LevelArray, region: &VolumeRegion, place: [u64; 3]) -> Part {
        let chunk = array.grid.chunk_size();
        let begin: [u64; 3] = std::array::from_fn(|axis| region.at[axis].max(place[axis] * chunk[axis]));
        let end: [u64; 3] = std::array::from_fn(|axis| {
            (region.at[axis] + region.size[axis]).min((place[axis] + 1) * chunk[axis])
        });
        Part {
            within: std::array::from_fn(|axis| (begin[axis] - place[axis] * chunk[axis]) as usize),
            to: std::array::from_fn(|axis| (begin[axis] - region.at[axis]) as usize),
            size: std::array::from_fn(|axis| (end[axis] - begin[axis]) as usize),
        }
    }

    /// Copies it; `None` if the chunk has not the bytes.
    fn copy(
        &self,
        chunk: &Chunk,
        offset: usize,
        strides: [usize; 3],
        width: usize,
        [to_width, to_height, _]: [u64; 3],
        values: &mut [u8],
    ) -> Option<()> {
        let from = |x: usize, y: usize, z: usize| {
            offset
                + (self.within[0] + x) * strides[0]
                + (self.within[1] + y) * strides[1]
                + (self.within[2] + z) * strides[2]
        };
        let row = self.size[0] * width;
        for z in 0..self.size[2] {
            for y in 0..self.size[1] {
                let to =
                    ((self.to[2] + z) * to_height as usize + self.to[1] + y) * to_width as usize + self.to[0];
                let to = values.get_mut(to * width..)?.get_mut(..row)?;
                if strides[0] == width {
                    to.copy_from_slice(chunk.bytes.get(from(0, y, z)..)?.get(..row)?);
                    continue;
                }
                for (x, value) in to.chunks_exact_mut(width).enumerate() {
                    value.copy_from_slice(chunk.bytes.get(from(x, y, z)..)?.get(..width)?);
                }
            }
        }
        Some(())
    }
}
