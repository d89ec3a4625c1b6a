//! Blocks that neighbouring tiles share, made once.
//!
//! Where pages are whole blocks, the blocks of a tile's border are blocks of the tile beside it too. Tiles beside one another
//! are encoded in long rows of blocks, which encoders that take several blocks at a time also like; the rows of blocks
//! that the tiles below begin with are kept for them. The bytes are the same: a block depends on its own texels alone.

use std::ops::Range;
use std::sync::{Mutex, PoisonError};

use vastex_core::{Geometry, LayerFormat};

use crate::blocks::{Lost, Quality, SIDE, encode_strip};
use crate::pyramid::Band;

/// Tiles of one row of pages that are encoded together.
pub(crate) const NEIGHBOURS: usize = 8;

/// Whether tiles of such pages share whole blocks.
pub(crate) fn shares_blocks(geometry: &Geometry) -> bool {
    geometry.page()[..2].iter().all(|page| page.is_multiple_of(SIDE as u32))
}

/// Bytes that [`Seams`] hold at most.
pub(crate) fn memory(geometry: &Geometry, format: LayerFormat) -> u64 {
    if !format.is_compressed() || !shares_blocks(geometry) {
        return 0;
    }
    let blocks =
        |level: u8| u64::from(geometry.level(level).pages[0]) * u64::from(geometry.tile()[0]) / SIDE as u64;
    let rows = u64::from(2 * geometry.border()[1]) / SIDE as u64;
    (0..geometry.tail().first_level()).map(|level| rows * blocks(level) * format.block_bytes() as u64).sum()
}

/// What was last encoded of each level of a layer, as far as the next row of pages shows it too.
pub(crate) struct Seams {
    /// By level, then by [`NEIGHBOURS`] columns, which one thread at a time encodes.
    levels: Vec<Vec<Mutex<Seam>>>,
}

/// Rows of blocks under some tiles.
#[derive(Default)]
struct Seam {
    /// The row of pages that begins with them, and its columns.
    below: u32,
    columns: Range<u32>,
    blocks: Vec<u8>,
}

impl Seams {
    pub(crate) fn new(geometry: &Geometry) -> Seams {
        let seams = |level| {
            let columns = geometry.level(level).pages[0] as usize;
            (0..columns.div_ceil(NEIGHBOURS)).map(|_| Mutex::default()).collect()
        };
        Seams { levels: (0..geometry.tail().first_level()).map(seams).collect() }
    }

    /// Appends its blocks to each of some neighbouring tiles of a band, from column `first` on, all of which are there.
    /// Pages are whole blocks.
    pub(crate) fn encode(
        &self,
        format: LayerFormat,
        quality: Quality,
        band: &Band<'_>,
        first: u32,
        tiles: &mut [Option<Vec<u8>>],
    ) -> Lost {
        let (geometry, pos) = (band.geometry(), band.pos(first));
        let columns = first..first + tiles.len() as u32;
        let bytes = |texels: u32| texels as usize / SIDE * format.block_bytes();
        let (page, tile) = (bytes(geometry.page()[0]), bytes(geometry.tile()[0]));
        let row_bytes = page * (tiles.len() - 1) + tile;
        let own_rows = geometry.page()[1] as usize / SIDE;
        let mut seam = self.levels[usize::from(pos.level)][first as usize / NEIGHBOURS]
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        let known = seam.take(pos.y, &columns);
        let mut known = known.chunks_exact(row_bytes);
        let (mut lost, mut made) = (Lost::default(), Vec::new());
        for (y, strip) in band.strips(&columns).enumerate() {
            let row = known.next().unwrap_or_else(|| {
                made.clear();
                lost = lost.or(encode_strip(format, quality, &strip, &mut made));
                &made
            });
            for (i, of_tile) in tiles.iter_mut().flatten().enumerate() {
                of_tile.extend_from_slice(&row[i * page..][..tile]);
            }
            if y >= own_rows {
                seam.blocks.extend_from_slice(row);
            }
        }
        (seam.below, seam.columns) = (pos.y + 1, columns);
        lost
    }
}

impl Seam {
    /// The rows of blocks with which tiles begin, if they are known; nothing is kept.
    fn take(&mut self, y: u32, columns: &Range<u32>) -> Vec<u8> {
        let blocks = std::mem::take(&mut self.blocks);
        if self.below == y && self.columns == *columns { blocks } else { Vec::new() }
    }
}

#[cfg(test)]
#[cfg(feature = "bc")]
mod tests {
    use std::convert::Infallible;

    use proptest::prelude::*;
    use vastex_core::{AddressMode, GeometrySpec, Layer};

    use super::*;
    use crate::blocks;
    use crate::convert::Conversion;
    use crate::readers::{ImageHeader, PixelFormat};
    use crate::stack::{self, LayerPlan, Stack};

    /// What an image of bytes becomes.
    fn plan(geometry: Geometry, format: LayerFormat) -> LayerPlan {
        let [width, height, _] = geometry.size().map(u64::from);
        let image = if format == LayerFormat::Bc4 { PixelFormat::GREY8 } else { PixelFormat::RGB8 };
        let header = ImageHeader::new(width, height, image).unwrap();
        LayerPlan {
            layer: Layer::new("color", format),
            conversion: Conversion::new(&header, format, true).unwrap(),
            geometry,
            filter: "box".parse().unwrap(),
            border_color: [9, 8, 7, 255],
            quality: Quality::Normal,
            in_blocks: true,
            lost_alpha: false.into(),
            lost_negatives: false.into(),
        }
    }

    /// An image of which some rows at the top are of one colour.
    fn image(seed: u64, row_bytes: usize, rows: u32, constant_rows: u32) -> Vec<u8> {
        let texel = |i: usize| match (i / row_bytes) < constant_rows as usize {
            true => 100,
            false => (seed.wrapping_mul(i as u64 | 1) >> 56) as u8,
        };
        (0..row_bytes * rows as usize).map(texel).collect()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]
        #[test]
        fn every_tile_is_as_if_encoded_alone(
            [width, height] in [1u32..300, 1u32..120],
            [page, border] in prop::sample::select(vec![[8, 4], [16, 4], [12, 4], [14, 1]]),
            mode in prop::sample::select(vec![
                AddressMode::Clamp, AddressMode::Wrap, AddressMode::Mirror, AddressMode::Border,
            ]),
            format in prop::sample::select(vec![
                LayerFormat::Bc1Srgb, LayerFormat::Bc3, LayerFormat::Bc4, LayerFormat::Bc5, LayerFormat::Bc7,
            ]),
            constant_rows in 0u32..60,
            dropped in 2u32..9,
            seed: u64,
        ) {
            let spec = GeometrySpec { page, border, address: [mode; 3], ..GeometrySpec::image(width, height) };
            let plans = [plan(Geometry::new(spec).unwrap(), format)];
            let mut stack = Stack::new(&plans);
            let row_bytes = plans[0].image_row_bytes();
            let image = image(seed, row_bytes, height, constant_rows);
            for rows in image.chunks(row_bytes * stack::block_rows(&plans) as usize) {
                stack.push(&[rows.to_vec()]);
                let cut = stack.cut_ready(|bands| {
                    let kept: Vec<bool> = (0..bands.pages()).map(|x| (x + 1) % dropped != 0).collect();
                    for first in (0..bands.pages()).step_by(NEIGHBOURS) {
                        let columns = first..bands.pages().min(first + NEIGHBOURS as u32);
                        for (x, tile) in columns.clone().zip(bands.tiles(columns, &kept)) {
                            let mut alone = Vec::new();
                            blocks::encode(format, Quality::Normal, &bands.rows_of(0, x), &mut alone);
                            assert_eq!(tile, kept[x as usize].then_some(alone), "{:?}", bands.pos(x));
                        }
                    }
                    Ok::<_, Infallible>(())
                });
                prop_assert!(cut.is_ok());
            }
        }
    }
}
