//! Blocks that neighbouring tiles share, made once.
//!
//! Where pages are whole blocks, the blocks of a tile's border are blocks of the tile beside it too. Tiles
//! beside one another are encoded in long rows of blocks, which encoders that take several blocks at a time
//! also like; the rows of blocks that the tiles below begin with are kept for them. The bytes are the same: a
//! block depends on its own texels alone.

use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use vastex_core::{Geometry, LayerFormat};

use super::Band;
use crate::texels::blocks::{SIDE, Strip};
use crate::threads;

/// Tiles of one row of pages that are encoded together at most.
pub(crate) const NEIGHBOURS: usize = 8;

/// Texels that one thread encodes of them at a time, at least, before it looks whether others may help.
const PIECE_TEXELS: usize = 1 << 15;

/// Work that was handed out and that no thread has begun.
///
/// While there is some, every thread is best left to its own: who has others do pieces of a tile waits for
/// them and does their work meanwhile, so that the tile comes late and holds up those behind it.
#[derive(Default)]
pub(crate) struct Waiting(AtomicUsize);

impl Waiting {
    /// One more was handed out.
    pub(crate) fn add(&self) {
        self.0.fetch_add(1, Ordering::Relaxed);
    }

    /// One of them is begun.
    pub(crate) fn begin(&self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }

    /// Returns true if a thread that has nothing to do finds nothing.
    fn is_none(&self) -> bool {
        self.0.load(Ordering::Relaxed) == 0
    }
}

/// Returns true if tiles of such pages share whole blocks.
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
///
/// A thread takes what it needs, encodes, and puts back what it made: no lock is held meanwhile. Where the
/// tile above is still being encoded, its blocks are made once more.
pub(crate) struct Seams {
    /// By level, then by column.
    levels: Vec<Vec<Mutex<Seam>>>,
}

/// Rows of blocks under a tile.
#[derive(Default)]
struct Seam {
    /// The row of pages that begins with them.
    below: u32,
    blocks: Vec<u8>,
}

impl Seams {
    pub(crate) fn new(geometry: &Geometry) -> Seams {
        let seams = |level| (0..geometry.level(level).pages[0]).map(|_| Mutex::default()).collect();
        Seams { levels: (0..geometry.tail().first_level()).map(seams).collect() }
    }

    /// Appends its blocks to each of some neighbouring tiles of a band, from column `first` on, all of which
    /// are there. Pages are whole blocks. `encode` appends a row of blocks. Other threads help while nothing
    /// else is `waiting` for them.
    pub(crate) fn encode(
        &self,
        format: LayerFormat,
        encode: impl Fn(&Strip<'_>, &mut Vec<u8>) + Sync,
        band: &Band<'_>,
        first: u32,
        tiles: &mut [Option<Vec<u8>>],
        waiting: &Waiting,
    ) {
        let (geometry, pos) = (band.geometry(), band.pos(first));
        let rows = |texels: u32| texels as usize / SIDE;
        let tile_row = rows(geometry.tile()[0]) * format.block_bytes();
        let (shared, own) = (rows(2 * geometry.border()[1]), rows(geometry.page()[1]));
        let seams = &self.levels[usize::from(pos.level)][first as usize..][..tiles.len()];
        let mut known: Vec<Vec<u8>> = seams.iter().map(|seam| lock(seam).take(pos.y)).collect();
        let encoder = Rows { format, encode, band, waiting };
        // Rows that are made apart from the others; none where nothing is known, since more threads can share
        // more rows.
        let apart = if known.iter().all(Vec::is_empty) { 0 } else { shared };
        let mut column = first as usize;
        for run in known.chunk_by(|one, next| one.is_empty() == next.is_empty()) {
            let tiles = &mut tiles[column - first as usize..][..run.len()];
            if run[0].is_empty() {
                encoder.append(column as u32, 0..apart, tiles);
            } else {
                let each = tiles.iter_mut().flatten().zip(run);
                each.for_each(|(tile, blocks)| tile.extend_from_slice(blocks));
            }
            column += run.len();
        }
        encoder.append(first, apart..shared + own, tiles);
        for ((seam, tile), blocks) in seams.iter().zip(tiles.iter().flatten()).zip(&mut known) {
            blocks.clear();
            blocks.extend_from_slice(&tile[tile.len() - shared * tile_row..]);
            *lock(seam) = Seam { below: pos.y + 1, blocks: std::mem::take(blocks) };
        }
    }
}

impl Seam {
    /// The rows of blocks with which the tile in row `y` begins, if they are known; nothing is kept.
    fn take(&mut self, y: u32) -> Vec<u8> {
        let mut blocks = std::mem::take(&mut self.blocks);
        if self.below != y {
            blocks.clear();
        }
        blocks
    }
}

fn lock(seam: &Mutex<Seam>) -> MutexGuard<'_, Seam> {
    seam.lock().unwrap_or_else(PoisonError::into_inner)
}

/// What makes rows of blocks along a band.
struct Rows<'a, E> {
    format: LayerFormat,
    encode: E,
    band: &'a Band<'a>,
    waiting: &'a Waiting,
}

impl<E: Fn(&Strip<'_>, &mut Vec<u8>) + Sync> Rows<'_, E> {
    /// Appends some rows of its blocks to each of some neighbouring tiles, from column `first` on. Threads
    /// that have nothing else to do help.
    fn append(&self, first: u32, rows: Range<usize>, tiles: &mut [Option<Vec<u8>>]) {
        let geometry = self.band.geometry();
        let bytes = |texels: u32| texels as usize / SIDE * self.format.block_bytes();
        let (page, tile) = (bytes(geometry.page()[0]), bytes(geometry.tile()[0]));
        let row_bytes = page * (tiles.len() - 1) + tile;
        let strips = self.band.strips(&(first..first + tiles.len() as u32));
        let mut strips = &strips[rows];
        let texels = strips.first().map_or(1, |strip| SIDE * strip.row_bytes() / self.format.texel_bytes());
        let piece = (PIECE_TEXELS / texels).max(1);
        let make = |strips: &[Strip<'_>]| {
            let mut blocks = Vec::with_capacity(strips.len() * row_bytes);
            strips.iter().for_each(|strip| (self.encode)(strip, &mut blocks));
            blocks
        };
        let mut pieces = Vec::new();
        while !strips.is_empty() && !self.waiting.is_none() {
            let (next, others) = strips.split_at(piece.min(strips.len()));
            pieces.push(make(next));
            strips = others;
        }
        pieces.extend(threads::map(strips.chunks(piece), 1, make));
        for row in pieces.iter().flat_map(|blocks| blocks.chunks_exact(row_bytes)) {
            for (i, of_tile) in tiles.iter_mut().flatten().enumerate() {
                of_tile.extend_from_slice(&row[i * page..][..tile]);
            }
        }
    }
}

#[cfg(test)]
#[cfg(feature = "bc")]
mod tests {
    use std::collections::HashSet;
    use std::convert::Infallible;
    use std::sync::Condvar;
    use std::thread;
    use std::time::Duration;

    use proptest::prelude::*;
    use vastex_core::{AddressMode, Description, GeometrySpec, Layer};
    use vastex_tiles::Compression;

    use super::*;
    use crate::image::{ImageHeader, PixelFormat};
    use crate::pyramid::stack::{self, LayerPlan, Stack};
    use crate::texels::blocks::{self, Quality};
    use crate::texels::convert::Conversion;
    use crate::tile::TileEncoder;

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

    /// How many of two threads encode the strips of some tiles while so many portions wait.
    fn threads_that_encode(portions: usize) -> usize {
        /// How long a thread waits for the other, where it may come.
        const PATIENCE: Duration = Duration::from_secs(60);
        let spec = GeometrySpec { page: 128, border: 4, ..GeometrySpec::image(1024, 128) };
        let plans = [plan(Geometry::new(spec).unwrap(), LayerFormat::Bc4)];
        let layers = plans.iter().map(|plan| plan.layer.clone()).collect();
        let description = Description::new(plans[0].geometry.clone(), layers);
        let encoder = TileEncoder::new(description.into(), Compression::None, Quality::Normal);
        let mut stack = Stack::new(&plans, &encoder);
        stack.push(&[image(1, 1024, 128, 0)]);
        let mut bands = None;
        let first = stack.cut_ready(|cut| {
            bands.get_or_insert(cut);
            Ok::<_, Infallible>(())
        });
        assert!(first.is_ok());
        let band = &bands.as_ref().unwrap().layers()[0];
        let waiting = Waiting::default();
        (0..portions).for_each(|_| waiting.add());
        let (came, at_work) = (Condvar::new(), Mutex::new(HashSet::new()));
        let encode = |strip: &Strip<'_>, blocks: &mut Vec<u8>| {
            let mut threads = at_work.lock().unwrap();
            threads.insert(thread::current().id());
            came.notify_all();
            if portions == 0 {
                drop(came.wait_timeout_while(threads, PATIENCE, |threads| threads.len() < 2).unwrap());
            }
            blocks.resize(blocks.len() + strip.row_bytes() / SIDE * 8, 0);
        };
        let mut tiles = vec![Some(Vec::new()); 8];
        let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
        let seams = Seams::new(&plans[0].geometry);
        pool.install(|| seams.encode(LayerFormat::Bc4, encode, band, 0, &mut tiles, &waiting));
        assert!(tiles.iter().flatten().all(|tile| tile.len() == 34 * 34 * 8));
        at_work.into_inner().unwrap().len()
    }

    #[test]
    fn threads_help_to_encode_a_tile_while_nothing_else_waits_for_them() {
        assert_eq!(threads_that_encode(0), 2);
        assert_eq!(threads_that_encode(1), 1);
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
            let layers = plans.iter().map(|plan| plan.layer.clone()).collect();
            let description = Description::new(plans[0].geometry.clone(), layers);
            let encoder = TileEncoder::new(description.into(), Compression::None, Quality::Normal);
            let mut stack = Stack::new(&plans, &encoder);
            let row_bytes = plans[0].image_row_bytes();
            let image = image(seed, row_bytes, height, constant_rows);
            for rows in image.chunks(row_bytes * stack::block_rows(&plans) as usize) {
                stack.push(&[rows.to_vec()]);
                let cut = stack.cut_ready(|bands| {
                    let kept: Vec<bool> = (0..bands.pages()).map(|x| (x + 1) % dropped != 0).collect();
                    for first in (0..bands.pages()).step_by(NEIGHBOURS) {
                        let columns = first..bands.pages().min(first + NEIGHBOURS as u32);
                        for (x, tile) in columns.clone().zip(bands.tiles(columns, &kept, &Waiting::default())) {
                            let mut alone = Vec::new();
                            blocks::encode(blocks::encode_strip, format, Quality::Normal, &bands.rows_of(0, x), &mut alone);
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
