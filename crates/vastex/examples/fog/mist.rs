//! A bank of mist of 2048 x 2048 x 128 voxels that is computed where it is looked at: a source of bricks of
//! one's own.

use std::sync::Arc;

use vastex::source::{Codec, ReadError, ReadFuture, Tile};
use vastex::{Description, Geometry, GeometryError, GeometrySpec, LayerFormat, PagePos, TileSource};

/// Voxels along x, y and z, which is upward.
pub(crate) const SIZE: [u32; 3] = [2048, 2048, 128];

pub(crate) struct Mist {
    description: Arc<Description>,
}

impl Mist {
    pub(crate) fn new() -> Result<Mist, GeometryError> {
        let spec = GeometrySpec { page: 32, border: 1, ..GeometrySpec::volume(SIZE) };
        Ok(Mist { description: Arc::new(Description::one_layer(Geometry::new(spec)?, LayerFormat::R8)) })
    }

    /// The brick of a page: its voxels and those around it, or for the tail every level in its place.
    fn brick(&self, pos: PagePos) -> Tile {
        let geometry = &self.description.geometry;
        let [row, rows, _] = geometry.tile();
        let mut voxels = vec![0; self.description.tile_bytes()];
        for (level, level_box, offset) in geometry.tile_boxes(pos) {
            let scale = geometry.level(level).scale.map(|scale| scale as f32);
            let [width, height, depth] = level_box.size;
            for (z, y) in (0..depth).flat_map(|z| (0..height).map(move |y| (z, y))) {
                for x in 0..width {
                    let at = [x, y, z];
                    let middle =
                        |a: usize| ((level_box.origin[a] + i64::from(at[a])) as f32 + 0.5) * scale[a];
                    let [to_x, to_y, to_z] = [0, 1, 2].map(|a: usize| offset[a] + at[a]);
                    let to = ((to_z * rows + to_y) * row + to_x) as usize;
                    voxels[to] = (255.0 * density([middle(0), middle(1), middle(2)])) as u8;
                }
            }
        }
        Tile { codec: Codec::Raw, bytes: voxels.into() }
    }
}

/// How dense the mist is at a place in voxels, 0 to 1: billows that thin out upward.
fn density([x, y, z]: [f32; 3]) -> f32 {
    let swell = (x * 0.011).sin() * (y * 0.013).cos() + 0.5 * (x * 0.031 + y * 0.027).sin();
    let curl = (x * 0.09 + z * 0.11).sin() * (y * 0.08 - z * 0.13).sin();
    let top = 52.0 + 22.0 * swell + 8.0 * curl;
    ((top - z) / 40.0).clamp(0.0, 1.0)
}

impl TileSource for Mist {
    fn description(&self) -> &Arc<Description> {
        &self.description
    }

    fn read(&self, pos: PagePos) -> ReadFuture<'_> {
        let known = self.description.geometry.contains(pos);
        Box::pin(async move { if known { Ok(self.brick(pos)) } else { Err(ReadError::NoSuchTile { pos }) } })
    }
}
