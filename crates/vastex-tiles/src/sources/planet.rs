//! A generated planet: an image of the whole planet, and detail below the image's texels that goes on down to
//! any size.
//!
//! A page is generated when it is read, from its position alone, so that the texture may have 2^31 texels
//! round the equator (on the Earth, 2 cm each) and takes no more memory than the image. Detail is noise in
//! octaves, each with cells twice as large as those of the octave before. A level shows the octaves whose
//! cells are at least two of its texels wide, so that it looks like the next finer level seen from farther
//! off. Cells are found by integer arithmetic, so that neighbours fit across pages and round the date line.
//!
//! How the planet is drawn is an application's business.

use std::sync::Arc;

use vastex_core::{
    AddressMode, Box3, Description, Geometry, GeometryError, GeometrySpec, LayerFormat, PagePos,
};

use super::{ReadError, ReadFuture, TileSource};
use crate::tile::{Codec, Tile};

/// How much an octave of detail lightens or darkens land, as a share.
const CONTRAST: f32 = 0.13;
/// How much an octave of detail lightens or darkens the sea, as a share.
const CONTRAST_AT_SEA: f32 = 0.02;

/// An image of a whole planet in plate carrée projection, sRGB with alpha, row by row.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlanetImage {
    /// Width and height in texels.
    pub size: [u32; 2],
    /// The texels, row by row from the north.
    pub texels: Vec<[u8; 4]>,
}

/// Why a planet cannot be made.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PlanetError {
    /// The number of texels is 0, or not the product of width and height.
    #[error("an image of {}x{} with {texels} texels", size[0], size[1])]
    Image {
        /// Width and height of the image in texels.
        size: [u32; 2],
        /// Texels that the image has.
        texels: usize,
    },
    /// The planet would have too many texels, or too few.
    #[error("a planet of 2^{bits} texels round the equator: there must be 2^8 to 2^31")]
    Size {
        /// The binary logarithm of the texels round the equator.
        bits: u32,
    },
    /// A texture cannot have this shape.
    #[error(transparent)]
    Geometry(#[from] GeometryError),
}

/// A source that generates a planet from an image: one layer, RGBA8 in sRGB. Each page is generated when it
/// is read, so that the texture may be far larger than memory.
#[derive(Clone, Debug)]
pub struct PlanetSource {
    description: Arc<Description>,
    /// The image and its coarser levels.
    images: Arc<Vec<PlanetImage>>,
    /// The coarsest octave has cells of 2^this texels of level 0, about a texel of the image.
    coarsest_octave: u32,
}

impl PlanetSource {
    /// Texels round the equator that any page id can name, as a binary logarithm.
    pub const MOST_BITS: u32 = 31;

    /// A planet of 2^`bits` texels round the equator and half as many from pole to pole.
    pub fn new(image: PlanetImage, bits: u32) -> Result<PlanetSource, PlanetError> {
        let [width, height] = image.size;
        if width == 0 || height == 0 || image.texels.len() as u64 != u64::from(width) * u64::from(height) {
            return Err(PlanetError::Image { size: image.size, texels: image.texels.len() });
        }
        if !(8..=PlanetSource::MOST_BITS).contains(&bits) {
            return Err(PlanetError::Size { bits });
        }
        let address = [AddressMode::Wrap, AddressMode::Clamp, AddressMode::Clamp];
        let spec = GeometrySpec { address, ..GeometrySpec::image(1 << bits, 1 << (bits - 1)) };
        let description = Description::one_layer(Geometry::new(spec)?, LayerFormat::Rgba8Srgb);
        let mut images = vec![image];
        while let Some(coarser) = images.last().and_then(PlanetImage::halved) {
            images.push(coarser);
        }
        let coarsest_octave = bits.saturating_sub(width.ilog2());
        Ok(PlanetSource { description: Arc::new(description), images: Arc::new(images), coarsest_octave })
    }

    /// The colours of texels of a level: each of `columns` in each of `rows`, row by row. All of these texels
    /// exist.
    pub fn colors(&self, level: u8, columns: &[u32], rows: &[u32]) -> Vec<[u8; 4]> {
        let mut detail = vec![0.0; columns.len() * rows.len()];
        for octave in u32::from(level) + 1..=self.coarsest_octave {
            self.add_octave(octave, octave - u32::from(level), columns, rows, &mut detail);
        }
        let [width, height, _] = self.description.geometry.level(level).size.map(f64::from);
        // The image's level with about as many texels as this one.
        let nth = (f64::from(self.images[0].size[0]) / width).log2().round().max(0.0) as usize;
        let image = &self.images[nth.min(self.images.len() - 1)];
        let across: Vec<_> = columns.iter().map(|&x| image.taps(0, (f64::from(x) + 0.5) / width)).collect();
        let down: Vec<_> = rows.iter().map(|&y| image.taps(1, (f64::from(y) + 0.5) / height)).collect();
        let places = down.iter().flat_map(|down| across.iter().map(move |across| (across, down)));
        places
            .zip(detail)
            .map(|((across, down), detail)| shaded(image.blended(across, down), detail))
            .collect()
    }

    /// Adds an octave with cells of 2^`octave` texels of level 0, 2^`shift` of the level's.
    fn add_octave(&self, octave: u32, shift: u32, columns: &[u32], rows: &[u32], detail: &mut [f32]) {
        let [width, height, _] = self.description.geometry.size().map(|side| (side >> octave).max(1));
        let (corners_x, across) = cells(columns, shift, |next| next % width);
        let (corners_y, down) = cells(rows, shift, |next| next.min(height));
        let corner = |y: u32| corners_x.iter().map(move |&x| noise(x, y, octave));
        let corners: Vec<f32> = corners_y.iter().flat_map(|&y| corner(y)).collect();
        let stride = corners_x.len();
        for (row, &(y, weight_y)) in detail.chunks_exact_mut(columns.len()).zip(&down) {
            let (upper, lower) = (&corners[y * stride..], &corners[(y + 1) * stride..]);
            for (detail, &(x, weight_x)) in row.iter_mut().zip(&across) {
                let mixed = |line: &[f32]| line[x] + (line[x + 1] - line[x]) * weight_x;
                *detail += mixed(upper) + (mixed(lower) - mixed(upper)) * weight_y;
            }
        }
    }

    fn tile(&self, pos: PagePos) -> Option<Tile> {
        let geometry = &self.description.geometry;
        if !geometry.contains(pos) {
            return None;
        }
        let mut texels = vec![0; self.description.tile_bytes()];
        for (level, level_box, offset) in geometry.tile_boxes(pos) {
            self.fill(level, level_box, offset, &mut texels);
        }
        Some(Tile { codec: Codec::Raw, bytes: texels.into() })
    }

    /// Writes the texels of a box into a tile, from `offset` on.
    fn fill(&self, level: u8, level_box: Box3, offset: [u32; 3], texels: &mut [u8]) {
        let geometry = &self.description.geometry;
        let inside = |axis: usize, n: u32| {
            let mut texel = level_box.origin;
            texel[axis] += i64::from(n);
            geometry.fold_texel(level, texel)[axis]
        };
        let columns: Vec<u32> = (0..level_box.size[0]).map(|n| inside(0, n)).collect();
        let rows: Vec<u32> = (0..level_box.size[1]).map(|n| inside(1, n)).collect();
        let colors = self.colors(level, &columns, &rows);
        let width = geometry.tile()[0] as usize;
        for (y, line) in colors.chunks_exact(columns.len()).enumerate() {
            let first = ((offset[1] as usize + y) * width + offset[0] as usize) * 4;
            texels[first..first + line.len() * 4].copy_from_slice(line.as_flattened());
        }
    }
}

/// The cells of 2^`shift` texels that coordinates lie in. Returns the corners at which noise is needed, and
/// for each coordinate the index of the first of its two corners and the weight of the second.
fn cells(coords: &[u32], shift: u32, beyond: impl Fn(u32) -> u32) -> (Vec<u32>, Vec<(usize, f32)>) {
    let mut corners: Vec<u32> = Vec::new();
    let size = f64::from(1u32 << shift);
    let place = |&coord: &u32| {
        let cell = coord >> shift;
        if corners.len() < 2 || corners[corners.len() - 2] != cell {
            corners.extend([cell, beyond(cell + 1)]);
        }
        let into = ((f64::from(coord & ((1 << shift) - 1)) + 0.5) / size) as f32;
        (corners.len() - 2, into * into * (3.0 - 2.0 * into))
    };
    let places = coords.iter().map(place).collect();
    (corners, places)
}

/// Noise at a corner of cells: -1 to 1.
fn noise(x: u32, y: u32, octave: u32) -> f32 {
    let mut hash = (x ^ octave.wrapping_mul(0x9e37_79b9)).wrapping_mul(0x85eb_ca6b);
    hash = (hash ^ hash >> 15 ^ y).wrapping_mul(0xc2b2_ae35);
    hash = (hash ^ hash >> 13).wrapping_mul(0x27d4_eb2f);
    ((hash ^ hash >> 16) >> 8) as f32 / (1 << 23) as f32 - 1.0
}

/// A colour of the image, with detail; the sea is smoother than land.
fn shaded([red, green, blue, alpha]: [f32; 4], detail: f32) -> [u8; 4] {
    let land = ((red - blue + 34.0) / 15.0).clamp(0.0, 1.0);
    let light = (1.0 + detail * (CONTRAST_AT_SEA + (CONTRAST - CONTRAST_AT_SEA) * land)).clamp(0.25, 1.9);
    // Where it is lighter it is a little warmer, as dry ground is.
    let warm = 1.0 + 0.12 * (light - 1.0) * land;
    [red * light * warm, green * light, blue * light / warm, alpha].map(|value| (value + 0.5) as u8)
}

impl PlanetImage {
    /// The next coarser level, or `None` for a level of one texel.
    fn halved(&self) -> Option<PlanetImage> {
        if self.size == [1, 1] {
            return None;
        }
        let size = self.size.map(|side| (side / 2).max(1));
        let mean = |x: u32, y: u32| {
            let texels = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(dx, dy)| self.texel(2 * x + dx, 2 * y + dy));
            std::array::from_fn(|c| (texels.iter().map(|texel| u32::from(texel[c])).sum::<u32>() / 4) as u8)
        };
        let texels = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x, y)));
        Some(PlanetImage { size, texels: texels.map(|(x, y)| mean(x, y)).collect() })
    }

    fn texel(&self, x: u32, y: u32) -> [u8; 4] {
        let [x, y] = [x.min(self.size[0] - 1), y.min(self.size[1] - 1)];
        self.texels[y as usize * self.size[0] as usize + x as usize]
    }

    /// The two texels beside a position along an axis (0 to 1), round the planet or as far as the poles, and
    /// the weight of the second.
    fn taps(&self, axis: usize, place: f64) -> ([u32; 2], f32) {
        let at = place * f64::from(self.size[axis]) - 0.5;
        let first = at.floor();
        let fold = |texel: f64| match axis {
            0 => texel.rem_euclid(f64::from(self.size[0])) as u32,
            _ => texel.max(0.0) as u32,
        };
        ([fold(first), fold(first + 1.0)], (at - first) as f32)
    }

    fn blended(&self, (xs, weight_x): &([u32; 2], f32), (ys, weight_y): &([u32; 2], f32)) -> [f32; 4] {
        let line = |y: u32| {
            let [a, b] = xs.map(|x| self.texel(x, y).map(f32::from));
            std::array::from_fn::<f32, 4, _>(|c| a[c] + (b[c] - a[c]) * weight_x)
        };
        let (upper, lower) = (line(ys[0]), line(ys[1]));
        std::array::from_fn(|c| upper[c] + (lower[c] - upper[c]) * weight_y)
    }
}

/// Tiles are generated when they are read, faster than they could be kept, and every page has a tile.
impl TileSource for PlanetSource {
    fn description(&self) -> &Arc<Description> {
        &self.description
    }

    fn read(&self, pos: PagePos) -> ReadFuture<'_> {
        Box::pin(async move { self.tile(pos).ok_or(ReadError::NoSuchTile { pos }) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Land and sea.
    fn planet(bits: u32) -> PlanetSource {
        let texel = |n: u32| if (n / 8).is_multiple_of(3) { [20, 40, 120, 255] } else { [120, 110, 60, 255] };
        PlanetSource::new(PlanetImage { size: [64, 32], texels: (0..64 * 32).map(texel).collect() }, bits)
            .unwrap()
    }

    #[test]
    fn pages_fit_their_neighbours_round_the_date_line_too() {
        for bits in [12, 31] {
            let source = planet(bits);
            let side = (1u32 << bits) / 128;
            let tile = |x: u32, y: u32| source.tile(PagePos::new_2d(0, x, y)).unwrap().bytes;
            for (left, right) in [(0, 1), (side - 1, 0), (side / 2 - 1, side / 2)] {
                let (left, right) = (tile(left, side / 4), tile(right, side / 4));
                // The last payload columns of the left one are the border of the right one, and the other way
                // round.
                for y in 0..136 {
                    let at = |tile: &[u8], x: usize| tile[(y * 136 + x) * 4..][..4].to_vec();
                    assert_eq!(at(&left, 128), at(&right, 0), "2^{bits}, row {y}");
                    assert_eq!(at(&left, 132), at(&right, 4), "2^{bits}, row {y}");
                }
            }
        }
    }

    /// A texel is about the mean of those below it: what a level shows stays when a finer one comes.
    #[test]
    fn levels_agree() {
        let source = planet(31);
        for level in [1, 5, 15, 24] {
            let size = source.description.geometry.level(level).size;
            let (x, y) = (size[0] / 3, size[1] / 3);
            let coarse = source.colors(level, &[x, x + 1, x + 2], &[y, y + 1, y + 2]);
            let below = |at: u32| (2 * at..2 * at + 6).collect::<Vec<_>>();
            let fine = source.colors(level - 1, &below(x), &below(y));
            let mean = |colors: &[[u8; 4]]| {
                colors.iter().map(|c| f64::from(c[0])).sum::<f64>() / colors.len() as f64
            };
            assert!(
                (mean(&coarse) - mean(&fine)).abs() < 25.0,
                "level {level}: {} {}",
                mean(&coarse),
                mean(&fine)
            );
        }
    }

    #[test]
    fn there_is_detail_at_every_level() {
        let land = PlanetImage { size: [64, 32], texels: vec![[120, 110, 60, 255]; 64 * 32] };
        let source = PlanetSource::new(land, 31).unwrap();
        for level in 0..18 {
            let columns: Vec<u32> = (1000..1064).collect();
            let colors = source.colors(level, &columns, &columns);
            let (low, high) = (colors.iter().map(|c| c[1]).min(), colors.iter().map(|c| c[1]).max());
            assert!(high.unwrap() - low.unwrap() > 14, "level {level}: {low:?} to {high:?}");
        }
    }

    #[test]
    fn what_is_no_planet_is_refused() {
        let image = |size: [u32; 2], texels: usize| PlanetImage { size, texels: vec![[0; 4]; texels] };
        assert!(matches!(PlanetSource::new(image([4, 2], 7), 20), Err(PlanetError::Image { .. })));
        assert!(matches!(PlanetSource::new(image([0, 0], 0), 20), Err(PlanetError::Image { .. })));
        for bits in [0, 7, 32, u32::MAX] {
            assert_eq!(PlanetSource::new(image([4, 2], 8), bits).unwrap_err(), PlanetError::Size { bits });
        }
        let whole = PlanetSource::new(image([4, 2], 8), 8).unwrap();
        crate::conformance(&whole).unwrap();
    }
}
