//! What a volume says at a point, asked on the CPU.

use vastex_core::{Dims, VoxelLevels};
use vastex_wgpu::twins::Bricks;

use super::{CpuSample, CpuSampler, Found};
use crate::settings::Filter;

impl CpuSampler<'_> {
    /// What a volume says at `place`, in voxels of level 0 from its first corner, at a whole level: blended
    /// of the eight voxels around it as `vastex_brick_exact(brick, offset)` does on the GPU, or with
    /// [`Filter::Nearest`] the voxel in which it lies. Outside of the volume its last voxels go on.
    /// [`CpuSample::level`] is the level of the answer: `level`, within those that there are, where its brick
    /// is in memory; else a coarser one. `voxels` says where the voxels of levels lie, as
    /// [`TextureSettings::voxels`](crate::TextureSettings::voxels) did when the volume was added; `None`
    /// where nothing was said.
    ///
    /// `None` for an image, for labels, which are no numbers to be blended, and for a place that is no
    /// number. Costs what [`Cpu::sample`](crate::Cpu::sample) does.
    pub fn volume(&mut self, place: [f64; 3], level: u8, voxels: Option<&VoxelLevels>) -> Option<CpuSample> {
        self.tiles.make_room();
        let tiles = &self.tiles;
        let (texture, format) = tiles.texture(tiles.filter);
        let geometry = texture.geometry;
        if geometry.dims() != Dims::D3 || format.is_whole_number() || place.iter().any(|at| at.is_nan()) {
            return None;
        }
        let bricks = Bricks { geometry, voxels, format };
        let wanted = level.min(geometry.coarsest());
        let tail = geometry.tail().first_level();
        let page = bricks.page(place, wanted);
        let in_tail = || Found { page, level: wanted, texels: None };
        let found = if wanted < tail { tiles.find(page) } else { in_tail() };
        let level = found.level.max(wanted);
        let texels = match &found.texels {
            Some(texels) => &texels[..],
            None => tiles.tail.get_or_init(|| tiles.texels_of_tail()),
        };
        let value = match tiles.filter {
            Filter::Nearest => bricks.nearest(place, level, texels),
            _ => bricks.blended(place, level, texels),
        };
        Some(CpuSample { value, level: level.into() })
    }
}
