//! All levels of a texture from one pass over the rows of the finest.
//!
//! Rows go in at the top ([`Pyramid::push`]); each level takes two rows of the level before it to make one of its own;
//! and as soon as a band of pages has all its rows, borders included, its tiles can be cut ([`Pyramid::cut_ready`]).
//! A row is stored with what the address mode puts to its left and right, so that a tile's row is one copy and
//! the filter knows no edges.
//!
//! The order of the tiles depends on the image and the pages alone: after every [`Pyramid::push`] the bands that are
//! ready, the finest level first, each from left to right; the tail is last.

use rayon::prelude::*;
use vastex_core::{AddressMode, Geometry, LayerFormat, PagePos, fold};

use crate::bands::Bands;
use crate::convert::layer_row_from_image_row;
use crate::filter::Filter;
use crate::readers::PixelFormat;
use crate::rows::Rows;

/// Bytes of rows below which it does not pay to share work among threads.
const PARALLEL_BYTES: usize = 64 << 10;
/// Bytes of the rows that are read and filtered at once.
const BLOCK_BYTES: usize = 1 << 20;

/// Rows of level 0 that are best pushed at once: even, and a function of the width alone.
pub(crate) fn block_rows(geometry: &Geometry, format: LayerFormat) -> u32 {
    let rows = BLOCK_BYTES / row_bytes(geometry, format, 0);
    (rows as u32).clamp(2, 256) & !1
}

/// Bytes that a pyramid holds at most. A function of the width and of the pages, but not of the height.
pub(crate) fn memory(geometry: &Geometry, format: LayerFormat) -> u64 {
    let block = block_rows(geometry, format);
    let tail = geometry.tail().first_level();
    let levels = 0..=geometry.coarsest();
    levels
        .map(|level| {
            let tile = geometry.tile()[1];
            let looks_back = if geometry.address()[1] == AddressMode::Mirror { tile } else { 0 };
            let window = tile + looks_back + Bands::head_rows(geometry, level) + 4 * block;
            let height = geometry.level(level).size[1];
            let rows = if level >= tail { height } else { window.min(height.next_multiple_of(block)) };
            u64::from(rows) * row_bytes(geometry, format, level) as u64
        })
        .sum()
}

/// Bytes of a row of a level as it is stored: as far as its tiles reach.
fn row_bytes(geometry: &Geometry, format: LayerFormat, level: u8) -> usize {
    let texels = if level >= geometry.tail().first_level() {
        u64::from(geometry.level_box_of_tail(level).size[0])
    } else {
        u64::from(geometry.level(level).pages[0]) * u64::from(geometry.page()[0])
            + 2 * u64::from(geometry.border()[0])
    };
    texels as usize * format.texel_bytes()
}

/// The levels of one texture while its rows pass by.
pub(crate) struct Pyramid<'a> {
    geometry: &'a Geometry,
    filter: Filter,
    levels: Vec<LevelRows<'a>>,
}

struct LevelRows<'a> {
    rows: Rows,
    layout: RowLayout,
    height: u32,
    /// Rows from which the next level has been made.
    filtered: u32,
    /// Nothing for a level of the tail.
    bands: Option<Bands<'a>>,
}

impl<'a> Pyramid<'a> {
    pub(crate) fn new(geometry: &'a Geometry, format: LayerFormat, linear_light: bool) -> Pyramid<'a> {
        let block_rows = block_rows(geometry, format);
        let level_rows = |level: u8| {
            let height = geometry.level(level).size[1];
            let in_tail = level >= geometry.tail().first_level();
            let head_rows = if in_tail { height } else { Bands::head_rows(geometry, level) };
            LevelRows {
                rows: Rows::new(height, row_bytes(geometry, format, level), block_rows, head_rows),
                layout: RowLayout::new(geometry, format, level),
                height,
                filtered: 0,
                bands: (!in_tail).then(|| Bands::new(geometry, level)),
            }
        };
        let levels = (0..=geometry.coarsest()).map(level_rows).collect();
        Pyramid { geometry, filter: Filter::new(format, linear_light), levels }
    }

    /// Whether every row has been pushed.
    pub(crate) fn is_complete(&self) -> bool {
        self.levels[0].rows.filled() == self.levels[0].height
    }

    /// Bytes of rows held; never falls.
    pub(crate) fn allocated(&self) -> u64 {
        self.levels.iter().map(|level| level.rows.allocated()).sum()
    }

    /// Takes the next rows of the image, which are [`block_rows`] except at its end, and makes of them what can be
    /// made of all coarser levels.
    pub(crate) fn push(&mut self, image_rows: &[u8], format: PixelFormat) {
        let level = &mut self.levels[0];
        let image_row_bytes = level.layout.width * format.texel_bytes();
        let row_bytes = level.rows.row_bytes();
        let layout = &level.layout;
        let count = (image_rows.len() / image_row_bytes) as u32;
        level
            .rows
            .grow(count)
            .par_chunks_exact_mut(row_bytes)
            .zip(image_rows.par_chunks_exact(image_row_bytes))
            .with_min_len(PARALLEL_BYTES.div_ceil(row_bytes))
            .for_each(|(row, image_row)| {
                layer_row_from_image_row(layout.payload_mut(row), image_row, format);
                layout.pad(row);
            });
        for level in 1..self.levels.len() {
            self.filter_into(level);
        }
    }

    /// Makes the rows of a level for which the finer level has two rows, or its last one.
    fn filter_into(&mut self, level: usize) {
        let (finer, coarser) = self.levels.split_at_mut(level);
        let (finer, coarse) = (&mut finer[level - 1], &mut coarser[0]);
        let is_last = finer.rows.filled() == finer.height;
        let (filter, address) = (self.filter, self.geometry.address()[1]);
        loop {
            let available = match is_last {
                true => coarse.height - finer.filtered.div_ceil(2),
                false => (finer.rows.filled() - finer.filtered) / 2,
            };
            let count = available.min(coarse.rows.room());
            if count == 0 {
                return;
            }
            let (first, row_bytes) = (coarse.rows.filled(), coarse.rows.row_bytes());
            let (source, layout) = (&*finer, &coarse.layout);
            let make = |(i, row): (usize, &mut [u8])| {
                let y = 2 * (first + i as u32);
                let below = fold(address, i64::from(y) + 1, source.height);
                let pair = |y| source.layout.pairs(source.rows.row(y), layout.width);
                filter.row(layout.payload_mut(row), pair(y), pair(below));
                layout.pad(row);
            };
            let rows = coarse.rows.grow(count);
            let tasks = rows.par_chunks_exact_mut(row_bytes).enumerate();
            tasks.with_min_len(PARALLEL_BYTES.div_ceil(row_bytes)).for_each(make);
            finer.filtered = (finer.filtered + 2 * count).min(finer.height);
        }
    }

    /// Hands every band that is ready to `cut`, then gives up the rows that nothing needs any more. Stops at the
    /// first error.
    pub(crate) fn cut_ready<E>(&mut self, mut cut: impl FnMut(&Band<'_>) -> Result<(), E>) -> Result<(), E> {
        for (number, level) in (0..).zip(&mut self.levels) {
            let Some(bands) = &mut level.bands else { continue };
            let mut any = false;
            while let Some(y) = bands.next(level.rows.filled()) {
                let rows = Bands::rows(self.geometry, number, y).map(|row| level.rows.row(row)).collect();
                cut(&Band { geometry: self.geometry, level: number, y, rows, texel: level.layout.texel })?;
                any = true;
            }
            if any {
                level.rows.forget_before(bands.keep_from().min(level.filtered));
            }
        }
        Ok(())
    }

    /// The rows of a level of the tail, once it is complete; for [`crate::tail`].
    pub(crate) fn tail_row(&self, level: u8, y: u32) -> &[u8] {
        self.levels[usize::from(level)].rows.row(y)
    }
}

/// A row of pages, all of whose rows are there.
pub(crate) struct Band<'a> {
    geometry: &'a Geometry,
    level: u8,
    y: u32,
    /// Rows of a tile, from its first to its last.
    rows: Vec<&'a [u8]>,
    texel: usize,
}

impl Band<'_> {
    /// Pages in the band.
    pub(crate) fn pages(&self) -> u32 {
        self.geometry.level(self.level).pages[0]
    }

    /// The band's page in column `x`.
    pub(crate) fn pos(&self, x: u32) -> PagePos {
        PagePos::new_2d(self.level, x, self.y)
    }

    /// The texels of its tile.
    pub(crate) fn tile_texels(&self, x: u32) -> Vec<u8> {
        let start = x as usize * self.geometry.page()[0] as usize * self.texel;
        let len = self.geometry.tile()[0] as usize * self.texel;
        let mut texels = Vec::with_capacity(len * self.rows.len());
        for row in &self.rows {
            texels.extend_from_slice(&row[start..start + len]);
        }
        texels
    }
}

/// Where the texels of a level lie in a stored row, and what lies around them.
struct RowLayout {
    /// Texels of the level.
    width: usize,
    /// Bytes of a texel.
    texel: usize,
    /// Texels before the first one of the level.
    left: usize,
    /// For each padding texel, left ones first, the texel of the stored row that it repeats.
    sources: Vec<u32>,
}

impl RowLayout {
    fn new(geometry: &Geometry, format: LayerFormat, level: u8) -> RowLayout {
        let (mode, width, left) =
            (geometry.address()[0], geometry.level(level).size[0], geometry.border()[0]);
        let texel = format.texel_bytes();
        let texels = (row_bytes(geometry, format, level) / texel) as i64;
        let (first, last) = (-i64::from(left), texels - i64::from(left));
        let padding = (first..0).chain(i64::from(width)..last);
        let sources = padding.map(|i| fold(mode, i, width) + left).collect();
        RowLayout { width: width as usize, texel, left: left as usize, sources }
    }

    fn payload_mut<'r>(&self, row: &'r mut [u8]) -> &'r mut [u8] {
        &mut row[self.left * self.texel..][..self.width * self.texel]
    }

    /// Twice as many texels as the next level has, the padding included that its odd edge needs.
    fn pairs<'r>(&self, row: &'r [u8], coarse_width: usize) -> &'r [u8] {
        &row[self.left * self.texel..][..2 * coarse_width * self.texel]
    }

    /// Fills what lies left and right of the payload.
    fn pad(&self, row: &mut [u8]) {
        match self.texel {
            1 => self.pad_texels::<1>(row),
            2 => self.pad_texels::<2>(row),
            _ => self.pad_texels::<4>(row),
        }
    }

    fn pad_texels<const TEXEL: usize>(&self, row: &mut [u8]) {
        let texels = row.as_chunks_mut::<TEXEL>().0;
        let targets = (0..self.left).chain(self.left + self.width..texels.len());
        for (target, &source) in targets.zip(&self.sources) {
            texels[target] = texels[source as usize];
        }
    }
}
