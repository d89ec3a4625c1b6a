//! Images that are an affine function of the place, on every level, each with a colour of its own: whatever samples one rightly gives that.

use std::sync::Arc;

use vastex::source::{Codec, ReadError, ReadFuture, Tile};
use vastex::survey::Box3;
use vastex::{Description, Geometry, GeometryError, GeometrySpec, LayerFormat, PagePos, TileSource};

pub(crate) struct Plain {
    description: Arc<Description>,
    nth: usize,
}

impl Plain {
    pub(crate) fn new(nth: usize, side: u32, page: u32) -> Result<Plain, GeometryError> {
        let geometry = Geometry::new(GeometrySpec { page, ..GeometrySpec::image(side, side) })?;
        Ok(Plain { description: Arc::new(Description::one_layer(geometry, LayerFormat::Rgba8)), nth })
    }

    /// The light at a place of the image, each channel 0 to 1.
    pub(crate) fn light(nth: usize, [u, v]: [f32; 2]) -> [f32; 3] {
        let own = (nth * 37 % 101) as f32 / 101.0;
        [0.2 + 0.5 * own + 0.2 * u, 0.8 - 0.4 * own - 0.2 * v, 0.3 + 0.3 * (u * (1.0 - own) + v * own)]
    }

    fn fill(&self, level: u8, of_level: Box3, offset: [u32; 3], tile: &mut [u8]) {
        let geometry = &self.description.geometry;
        let (scale, size) = (geometry.level(level).scale, geometry.size());
        for (y, x) in (0..of_level.size[1]).flat_map(|y| (0..of_level.size[0]).map(move |x| (y, x))) {
            let texel = std::array::from_fn(|a| of_level.origin[a] + i64::from([x, y, 0][a]));
            let folded = geometry.fold_texel(level, texel);
            let place = |a: usize| (folded[a] as f32 + 0.5) * scale[a] as f32 / size[a] as f32;
            let light = Plain::light(self.nth, [place(0), place(1)]);
            let at = 4 * ((offset[1] + y) * geometry.tile()[0] + offset[0] + x) as usize;
            tile[at..at + 3].copy_from_slice(&light.map(|n| (n * 255.0).round() as u8));
        }
    }
}

impl TileSource for Plain {
    fn description(&self) -> &Arc<Description> {
        &self.description
    }

    fn read(&self, pos: PagePos) -> ReadFuture<'_> {
        let geometry = &self.description.geometry;
        if !geometry.contains(pos) {
            return Box::pin(async move { Err(ReadError::NoSuchTile { pos }) });
        }
        let mut tile = vec![255; self.description.tile_bytes()];
        if geometry.is_tail(pos) {
            for level in pos.level..=geometry.coarsest() {
                let of_level = geometry.level_box_of_tail(level);
                self.fill(level, of_level, geometry.tail().offset(level), &mut tile);
            }
        } else {
            self.fill(pos.level, geometry.level_box_of_tile(pos), [0; 3], &mut tile);
        }
        Box::pin(async move { Ok(Tile { codec: Codec::Raw, bytes: tile.into() }) })
    }
}
