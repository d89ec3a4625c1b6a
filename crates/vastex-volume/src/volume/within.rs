//! Boxes of voxels of which less is read: the voxels of a box within them, which are repeated around it.

use super::boxes::{BoxValues, MOST_AT_ONCE, Plane, VoxelBox};
use super::gather::Along;
use crate::fault::VolumeError;

impl Plane<'_> {
    /// The values of a box of which nothing is read but `own`, a box within it: its last voxels are repeated
    /// around it. `None` where that would save little: most chunks that the whole box wants beside those of
    /// `own` are at hand, or all of them together are many.
    pub(crate) async fn read_within(
        &self,
        of: &VoxelBox,
        own: &VoxelBox,
    ) -> Result<Option<BoxValues>, VolumeError> {
        let (level, side) = (self.grid.size(), self.grid.chunk_size());
        let whole: [Along; 3] =
            std::array::from_fn(|axis| Along::new(of.first[axis], of.size[axis], level[axis], side[axis]));
        let axes: [Along; 3] = std::array::from_fn(|axis| {
            let last = level[axis] as i64 - 1;
            let end = own.first[axis].saturating_add(i64::from(own.size[axis]) - 1);
            let ends = [own.first[axis].clamp(0, last), end.clamp(0, last)];
            Along::within(of.first[axis], of.size[axis], ends, side[axis])
        });
        let chunk = self.grid.chunk.iter().fold(self.width as u64, |bytes, side| bytes.saturating_mul(*side));
        let bytes = whole.iter().fold(chunk, |bytes, axis| bytes.saturating_mul(axis.count() as u64));
        if bytes > MOST_AT_ONCE {
            return Ok(None);
        }
        let missing = |axes: &[Along; 3]| {
            let (all, rank) = self.places(axes);
            self.chunks.at_hand(&all, rank).iter().filter(|chunk| chunk.is_none()).count()
        };
        let of_own = missing(&axes);
        // At least as many as it has itself.
        if missing(&whole) < (2 * of_own).max(1) {
            return Ok(None);
        }
        self.gather(of, &axes).await.map(Some)
    }

    /// The coordinates of these chunks, one after the other, and how many each has.
    pub(super) fn places(&self, axes: &[Along; 3]) -> (Vec<u64>, usize) {
        let mut coords = self.grid.coords([0; 3], self.channel, self.time);
        let rank = coords.len();
        let mut all = Vec::with_capacity(axes.iter().map(Along::count).product::<usize>() * rank);
        for z in axes[2].chunks.clone() {
            for y in axes[1].chunks.clone() {
                for x in axes[0].chunks.clone() {
                    self.grid.put_place(&mut coords, [x, y, z]);
                    all.extend_from_slice(&coords);
                }
            }
        }
        (all, rank)
    }
}
