//! Values of a volume on the CPU: slices, planes that lie as they like, and points. What shaders draw is held
//! against these, so they are written to be right and not to be fast.
//!
//! Nothing is outside of the volume's box, which is that of level 0. Within it, a place between the middles
//! of voxels is mixed of the eight around it, and at a face the last voxels are repeated.

use rustc_hash::FxHashMap;
use vastex_core::VoxelLevel;

use super::{VolumeSource, VoxelValue};
use crate::fault::{VolumeError, VolumeFault};
use crate::volume::VoxelBox;

/// Bytes of a slice that is read at once.
const MOST_BYTES: u64 = 1 << 31;
/// Voxels along each side of what is read at once for places here and there, and how many of these are kept.
const SIDE: i64 = 32;
const MOST_BLOCKS: usize = 1024;

/// The axis that a slice is perpendicular to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SliceAxis {
    /// Right is +y, down is +z.
    X,
    /// Right is +x, down is +z.
    Y,
    /// Right is +x, down is +y.
    Z,
}

impl SliceAxis {
    /// The axis, and those to the right and down: 0 is x.
    pub(super) const fn axes(self) -> [usize; 3] {
        match self {
            SliceAxis::X => [0, 1, 2],
            SliceAxis::Y => [1, 0, 2],
            SliceAxis::Z => [2, 0, 1],
        }
    }
}

/// A picture plane in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VolumePlane {
    /// The outer corner of the first pixel.
    pub corner: [f64; 3],
    /// From a pixel to the next one to the right.
    pub right: [f64; 3],
    /// From a pixel to the next one below.
    pub down: [f64; 3],
    /// Pixels to the right and down.
    pub size: [u32; 2],
}

impl VolumePlane {
    /// The middle of a pixel in the world.
    pub fn world_from_pixel(&self, x: u32, y: u32) -> [f64; 3] {
        let (x, y) = (f64::from(x) + 0.5, f64::from(y) + 0.5);
        std::array::from_fn(|axis| self.corner[axis] + x * self.right[axis] + y * self.down[axis])
    }
}

/// A stored value, and its place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointValue {
    /// The level that the value is of.
    pub level: u8,
    /// True if that level is made and not stored.
    pub is_made: bool,
    /// The voxel of that level.
    pub voxel: [u32; 3],
    /// The voxel's value.
    pub value: VoxelValue,
}

impl VolumeSource {
    /// Voxels of a level to the right and down in a slice. The level exists.
    pub fn slice_size(&self, level: u8, axis: SliceAxis) -> [u32; 2] {
        let [_, right, down] = axis.axes();
        let size = self.levels.level(level).size;
        [size[right], size[down]]
    }

    /// The values of a part of a slice exactly as they are stored, little-endian, row by row: `size` voxels
    /// to the right and down from `at` on. `index` counts voxels of level 0 along the axis; of a coarser
    /// level it is the slice that the middle of that voxel lies in. Refuses what is not within the level, and
    /// more than 2 GiB. Takes the memory of the slice, beside the chunks that are kept.
    pub async fn slice(
        &self,
        level: u8,
        axis: SliceAxis,
        index: u32,
        at: [u32; 2],
        size: [u32; 2],
    ) -> Result<Vec<u8>, VolumeError> {
        let refuse = |why: String| Err(VolumeFault::Request(why).at(&self.volume.about().path));
        let levels = self.levels.levels();
        let Some(of) = levels.get(usize::from(level)) else {
            return refuse(format!("there is no level {level}; there are levels 0 to {}", levels.len() - 1));
        };
        let [along, right, down] = axis.axes();
        if index >= levels[0].size[along] {
            return refuse(format!(
                "there is no slice {index}; there are slices 0 to {}",
                levels[0].size[along] - 1
            ));
        }
        let [width, height] = self.slice_size(level, axis);
        let fits =
            |at: u32, side: u32, of: u32| side > 0 && at.checked_add(side).is_some_and(|end| end <= of);
        if !fits(at[0], size[0], width) || !fits(at[1], size[1], height) {
            return refuse(format!(
                "{}x{} voxels at {},{} reach beyond the slice of {width}x{height}; choose a smaller part, or another",
                size[0], size[1], at[0], at[1]
            ));
        }
        let bytes = u64::from(size[0]) * u64::from(size[1]);
        if bytes.saturating_mul(self.volume.about().dtype.bytes() as u64) > MOST_BYTES {
            return refuse(format!("the slice is larger than {MOST_BYTES} bytes; read it in parts"));
        }
        let mut middle = levels[0].size.map(|side| f64::from(side) / 2.0);
        middle[along] = f64::from(index) + 0.5;
        let slice = nearest(of, levels[0].world_from_voxel(middle))[along];
        let (mut first, mut sides) = ([0; 3], [1; 3]);
        first[along] = slice.into();
        (first[right], first[down]) = (at[0].into(), at[1].into());
        (sides[right], sides[down]) = (size[0], size[1]);
        // Of the three axes the one with a single voxel changes no order: x, then y, then z.
        Ok(self.read_box(level, &VoxelBox { first, size: sides }).await?.values)
    }

    /// The value at a place in the world, of the voxel of a level that it lies in: exactly as it is stored.
    /// `None` outside of the volume. The level exists.
    pub async fn value_at(&self, level: u8, world: [f64; 3]) -> Result<Option<PointValue>, VolumeError> {
        if !self.has_inside(world) {
            return Ok(None);
        }
        let of = self.levels.level(level);
        let voxel = nearest(of, world);
        let found = self.read_box(level, &VoxelBox { first: voxel.map(i64::from), size: [1; 3] }).await?;
        let value = VoxelValue::of(self.volume.about().dtype, &found.values);
        Ok(value.map(|value| PointValue { level, is_made: of.stored.is_none(), voxel, value }))
    }

    /// The value at a place in the world, mixed of the eight voxels of a level around it, in floats of 64
    /// bits and rounded once; of labels, that of the voxel that it lies in. `None` outside of the volume. The
    /// level exists.
    pub async fn sample_at(&self, level: u8, world: [f64; 3]) -> Result<Option<f32>, VolumeError> {
        Blocks::new(self, level).sample(world).await
    }

    /// [`VolumeSource::sample_at`] at the middle of each pixel of a plane, row by row.
    pub async fn sample_plane(
        &self,
        level: u8,
        plane: &VolumePlane,
    ) -> Result<Vec<Option<f32>>, VolumeError> {
        let mut blocks = Blocks::new(self, level);
        let mut values = Vec::new();
        for y in 0..plane.size[1] {
            for x in 0..plane.size[0] {
                values.push(blocks.sample(plane.world_from_pixel(x, y)).await?);
            }
        }
        Ok(values)
    }

    fn has_inside(&self, world: [f64; 3]) -> bool {
        let [begin, end] = self.levels.world_box();
        (0..3).all(|axis| (begin[axis]..=end[axis]).contains(&world[axis]))
    }
}

/// The voxel that a place lies in, or the nearest one.
fn nearest(level: &VoxelLevel, world: [f64; 3]) -> [u32; 3] {
    let voxel = level.voxel_from_world(world);
    std::array::from_fn(|axis| voxel[axis].floor().clamp(0.0, f64::from(level.size[axis] - 1)) as u32)
}

/// Values around places of one level, block by block.
struct Blocks<'a> {
    source: &'a VolumeSource,
    level: u8,
    kept: FxHashMap<[i64; 3], Vec<u8>>,
}

impl<'a> Blocks<'a> {
    fn new(source: &'a VolumeSource, level: u8) -> Blocks<'a> {
        Blocks { source, level, kept: FxHashMap::default() }
    }

    async fn sample(&mut self, world: [f64; 3]) -> Result<Option<f32>, VolumeError> {
        if !self.source.has_inside(world) {
            return Ok(None);
        }
        let of = *self.source.levels.level(self.level);
        if self.source.is_labels {
            let voxel = nearest(&of, world).map(i64::from);
            return Ok(self.value(voxel, [0; 3]).await?.map(|value| value as f32));
        }
        // Values lie at the middles of voxels.
        let place = of.voxel_from_world(world).map(|voxel| voxel - 0.5);
        let first = place.map(f64::floor);
        let share: [f64; 3] = std::array::from_fn(|axis| place[axis] - first[axis]);
        // A level may end before the volume does.
        let first: [i64; 3] =
            std::array::from_fn(|axis| first[axis].clamp(-1.0, f64::from(of.size[axis])) as i64);
        let mut sum = 0.0;
        for n in 0..8_i64 {
            let corner = [n & 1, n >> 1 & 1, n >> 2];
            let weight: f64 =
                (0..3).map(|axis| if corner[axis] == 1 { share[axis] } else { 1.0 - share[axis] }).product();
            // What has no part in the sum may be no number.
            if weight > 0.0 {
                sum += weight * self.value(first, corner).await?.unwrap_or(f64::NAN);
            }
        }
        Ok(Some(sum as f32))
    }

    /// The value of a voxel, or of one beside it; those beyond the level are as its last ones.
    async fn value(&mut self, voxel: [i64; 3], beside: [i64; 3]) -> Result<Option<f64>, VolumeError> {
        let block = voxel.map(|at| at.div_euclid(SIDE));
        let side = SIDE + 1;
        if !self.kept.contains_key(&block) {
            if self.kept.len() >= MOST_BLOCKS {
                self.kept.clear();
            }
            let of = VoxelBox { first: block.map(|at| at * SIDE), size: [side as u32; 3] };
            let values = self.source.read_box(self.level, &of).await?.values;
            self.kept.insert(block, values);
        }
        let [x, y, z] = std::array::from_fn(|axis| voxel[axis].rem_euclid(SIDE) + beside[axis]);
        let dtype = self.source.volume.about().dtype;
        let at = ((z * side + y) * side + x) as usize * dtype.bytes();
        let bytes = self.kept.get(&block).and_then(|values| values.get(at..));
        Ok(bytes.and_then(|bytes| VoxelValue::of(dtype, bytes)).map(VoxelValue::to_f64))
    }
}
