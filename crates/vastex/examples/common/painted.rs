//! A source of tiles of one's own: an image of any size whose texels are computed where they are looked at.

use std::sync::Arc;

use vastex::source::{Codec, ReadError, ReadFuture, Tile};
use vastex::survey::Box3;
use vastex::{Description, Geometry, GeometryError, GeometrySpec, LayerFormat, PagePos, TileSource};

/// The colour of a texel: where its middle lies, in texels of level 0, and how many of those it is wide.
type Paint = dyn Fn([f32; 2], f32) -> [u8; 4] + Send + Sync;

pub(crate) struct Painted {
    description: Arc<Description>,
    paint: Box<Paint>,
}

impl Painted {
    pub(crate) fn new(
        spec: GeometrySpec,
        format: LayerFormat,
        paint: impl Fn([f32; 2], f32) -> [u8; 4] + Send + Sync + 'static,
    ) -> Result<Painted, GeometryError> {
        let description = Arc::new(Description::one_layer(Geometry::new(spec)?, format));
        Ok(Painted { description, paint: Box::new(paint) })
    }

    /// The tile of a page: its texels and those around it, or for the tail every level in its place.
    fn tile(&self, pos: PagePos) -> Tile {
        let geometry = &self.description.geometry;
        let mut texels = vec![0; self.description.tile_bytes()];
        if geometry.is_tail(pos) {
            for level in pos.level..=geometry.coarsest() {
                let offset = geometry.tail().offset(level);
                self.fill(level, geometry.level_box_of_tail(level), offset, &mut texels);
            }
        } else {
            self.fill(pos.level, geometry.level_box_of_tile(pos), [0; 3], &mut texels);
        }
        Tile { codec: Codec::Raw, bytes: texels.into() }
    }

    fn fill(&self, level: u8, level_box: Box3, offset: [u32; 3], texels: &mut [u8]) {
        let row = self.description.geometry.tile()[0];
        for (y, x) in (0..level_box.size[1]).flat_map(|y| (0..level_box.size[0]).map(move |x| (y, x))) {
            let [level_x, level_y, _] = level_box.origin;
            let beyond_edges = [level_x + i64::from(x), level_y + i64::from(y), 0];
            let [level_x, level_y, _] = self.description.geometry.fold_texel(level, beyond_edges);
            let at = 4 * ((offset[1] + y) * row + offset[0] + x) as usize;
            texels[at..at + 4].copy_from_slice(&self.colour(level, [level_x, level_y]));
        }
    }

    /// The colour of a texel of a level.
    pub(crate) fn colour(&self, level: u8, texel: [u32; 2]) -> [u8; 4] {
        let scale = self.description.geometry.level(level).scale[0] as f32;
        (self.paint)(texel.map(|n| (n as f32 + 0.5) * scale), scale)
    }
}

impl TileSource for Painted {
    fn description(&self) -> &Arc<Description> {
        &self.description
    }

    fn read(&self, pos: PagePos) -> ReadFuture<'_> {
        let known = self.description.geometry.contains(pos);
        Box::pin(async move { if known { Ok(self.tile(pos)) } else { Err(ReadError::NoSuchTile { pos }) } })
    }
}
