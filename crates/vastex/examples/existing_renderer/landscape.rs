//! A source of tiles of one's own: a landscape of 65,536 texels per side that is computed where it is looked at.

use std::sync::Arc;

use vastex::source::{Codec, ReadError, ReadFuture, Tile};
use vastex::survey::Box3;
use vastex::{Description, Geometry, GeometryError, GeometrySpec, LayerFormat, PagePos, TileSource};

/// Texels per side.
const SIDE: u32 = 65_536;
/// Colours from the sea floor to the peaks, at equal steps of height.
const RAMP: [[f32; 3]; 8] = [
    [14.0, 38.0, 76.0],
    [26.0, 78.0, 124.0],
    [92.0, 152.0, 168.0],
    [206.0, 190.0, 138.0],
    [104.0, 138.0, 66.0],
    [62.0, 96.0, 50.0],
    [120.0, 108.0, 96.0],
    [240.0, 242.0, 246.0],
];

pub(crate) struct Landscape(Arc<Description>);

impl Landscape {
    pub(crate) fn new() -> Result<Landscape, GeometryError> {
        let geometry = Geometry::new(GeometrySpec::image(SIDE, SIDE))?;
        Ok(Landscape(Arc::new(Description::one_layer(geometry, LayerFormat::Rgba8Srgb))))
    }

    /// The tile of a page: its texels and those around it, or for the tail every level in its place.
    fn tile(&self, pos: PagePos) -> Tile {
        let geometry = &self.0.geometry;
        let mut texels = vec![0; self.0.tile_bytes()];
        if geometry.is_tail(pos) {
            for level in pos.level..=geometry.coarsest() {
                self.fill(
                    level,
                    geometry.level_box_of_tail(level),
                    geometry.tail().offset(level),
                    &mut texels,
                );
            }
        } else {
            self.fill(pos.level, geometry.level_box_of_tile(pos), [0; 3], &mut texels);
        }
        Tile { codec: Codec::Raw, bytes: texels.into() }
    }

    fn fill(&self, level: u8, level_box: Box3, offset: [u32; 3], texels: &mut [u8]) {
        let row = self.0.geometry.tile()[0];
        for (y, x) in (0..level_box.size[1]).flat_map(|y| (0..level_box.size[0]).map(move |x| (y, x))) {
            let [level_x, level_y, _] = level_box.origin;
            let beyond_edges = [level_x + i64::from(x), level_y + i64::from(y), 0];
            let [level_x, level_y, _] = self.0.geometry.fold_texel(level, beyond_edges);
            let at = 4 * ((offset[1] + y) * row + offset[0] + x) as usize;
            texels[at..at + 4].copy_from_slice(&colour(level, [level_x, level_y]));
        }
    }
}

impl TileSource for Landscape {
    fn description(&self) -> &Arc<Description> {
        &self.0
    }

    fn read(&self, pos: PagePos) -> ReadFuture<'_> {
        let known = self.0.geometry.contains(pos);
        Box::pin(async move { if known { Ok(self.tile(pos)) } else { Err(ReadError::NoSuchTile { pos }) } })
    }
}

fn colour(level: u8, texel: [u32; 2]) -> [u8; 4] {
    let scale = (1u64 << level) as f32;
    let at = texel.map(|n| (n as f32 + 0.5) * scale);
    // Waves shorter than two texels are left out, so that a level is a smooth picture of the one below it.
    let (mut height, mut length, mut share) = (0.5, SIDE as f32 / 5.0, 0.6);
    while length > 2.0 * scale {
        height += share * (noise(at.map(|n| n / length)) - 0.5);
        (length, share) = (length / 2.0, share * 0.68);
    }
    let step = height.clamp(0.0, 0.999) * (RAMP.len() - 1) as f32;
    let (lower, upper, part) = (RAMP[step as usize], RAMP[step as usize + 1], step.fract());
    let [r, g, b] = std::array::from_fn(|i| (lower[i] + (upper[i] - lower[i]) * part) as u8);
    [r, g, b, 255]
}

/// Smooth noise from 0 to 1, one wave for each unit.
fn noise(at: [f32; 2]) -> f32 {
    let corner = at.map(|n| n.floor() as u32);
    let [u, v] = at.map(f32::fract).map(|t| t * t * (3.0 - 2.0 * t));
    let random = |x: u32, y: u32| {
        let mixed = (x.wrapping_mul(0x9e37_79b1) ^ y.wrapping_mul(0x85eb_ca6b)).wrapping_mul(0xc2b2_ae35);
        ((mixed ^ mixed >> 15).wrapping_mul(0x27d4_eb2f) >> 8) as f32 / (1 << 24) as f32
    };
    let row = |y: u32| {
        let (left, right) = (random(corner[0], y), random(corner[0] + 1, y));
        left + (right - left) * u
    };
    let (upper, lower) = (row(corner[1]), row(corner[1] + 1));
    upper + (lower - upper) * v
}
