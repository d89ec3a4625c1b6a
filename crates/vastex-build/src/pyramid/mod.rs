//! All levels of a texture from one pass over the rows of the finest.
//!
//! Rows go in at the top ([`Pyramid::push`]); each level takes rows of a finer one to make its own
//! ([`descent`]), or all take those of level 0 ([`straight`]); and as soon as a band of pages has all its
//! rows, borders included, its tiles can be cut ([`Pyramid::cut_band`]). A row is stored with what the
//! address mode puts to its left and right ([`layout`]), so that a tile's row is one copy.
//!
//! Which of the bands that are ready is cut when, and what the layers of a tile have to do with one another,
//! is [`stack`]'s business.

mod descent;
mod layout;
mod rows;
mod schedule;
pub(crate) mod shared;
pub(crate) mod stack;
mod straight;
mod tail;

use std::ops::Range;

use vastex_core::{AddressMode, Geometry, LayerFormat, PagePos};

use crate::texels::blocks::{SIDE, Strip};
use crate::texels::convert::Conversion;
use crate::texels::filter::{Filter, LayerFilter, LevelsFrom};
use crate::texels::texel::texel_of_color;
use crate::threads;
use descent::{Descent, PARALLEL_BYTES, factor, row_orders};
use layout::{RowLayout, row_bytes};
use rows::{Row, RowOrder, Rows};
use schedule::{Schedule, late_bands};
use straight::Straight;

/// Bytes of the rows that are read and filtered at once.
const BLOCK_BYTES: usize = 1 << 20;

/// What a pyramid is made for.
#[derive(Clone, Copy)]
pub(crate) struct Shape<'a> {
    pub(crate) geometry: &'a Geometry,
    pub(crate) format: LayerFormat,
    pub(crate) filter: LayerFilter,
    pub(crate) border_color: [u8; 4],
}

impl Shape<'_> {
    /// Rows of level 0 that are best pushed at once: even, whole blocks if they are more than two, and a
    /// function of the width alone.
    pub(crate) fn block_rows(self) -> u32 {
        let rows = BLOCK_BYTES / row_bytes(self.geometry, self.format, 0);
        let rows = (rows as u32).clamp(2, 256);
        if rows < SIDE as u32 { 2 } else { rows / SIDE as u32 * SIDE as u32 }
    }

    /// Bands at the top of each level that this pyramid can only cut when the level is complete.
    pub(crate) fn late_bands(self) -> u32 {
        let first = row_orders(self.geometry, self.filter).iter().map(|order| order.first).max();
        late_bands(self.geometry, first.unwrap_or(0))
    }

    /// Bytes that a pyramid holds at most, of which `block` rows are pushed at once and `late` bands cut
    /// last, and into which `ahead` times so many rows are pushed while bands that were cut before are held.
    /// A function of the width and of the pages, but not of the height.
    pub(crate) fn memory(self, block: u32, late: u32, ahead: u32) -> u64 {
        let geometry = self.geometry;
        let tail = geometry.tail().first_level();
        let orders = row_orders(geometry, self.filter);
        let of_level = |level: u8| {
            let tile = geometry.tile()[1];
            let looks_back = if geometry.address()[1] == AddressMode::Mirror { tile } else { 0 };
            let made = if level > 0 { self.making_memory(level) } else { 0 };
            let reach = |coarse| self.filter.kernel.stretched(factor(self.filter.from, coarse)).count as u32;
            let reach = self.made_from(level).map(reach).max().unwrap_or(0);
            let window = tile + looks_back + self.head_rows(&orders, level, late) + 2 * reach + 4 * block;
            let height = geometry.level(level).size[1];
            let rows = if level >= tail { height } else { window.min(height.next_multiple_of(block)) };
            // Blocks that come while others are held, and copies of those of which rows are held.
            let newer = (ahead * block).checked_shr(level.into()).unwrap_or(0);
            let beside = match ahead {
                1.. if level < tail => newer.div_ceil(block) + newer / geometry.page()[1] + 2,
                _ => 0,
            };
            made + u64::from(rows + beside * block) * row_bytes(geometry, self.format, level) as u64
        };
        (0..=geometry.coarsest()).map(of_level).sum()
    }

    /// Bytes that making a level, which is not 0, takes besides its rows.
    fn making_memory(self, level: u8) -> u64 {
        let Shape { geometry, format, filter, .. } = self;
        if filter.from == LevelsFrom::Finest {
            return straight::memory(geometry, format, filter, level);
        }
        let filter = Filter::new(filter, format, factor(filter.from, level));
        descent::memory(&filter, geometry.level(level).size[0])
    }

    /// The levels that are made from the rows of a level as they are kept.
    fn made_from(self, level: u8) -> impl Iterator<Item = u8> {
        let from = self.filter.from;
        let coarser = level + 1..=self.geometry.coarsest();
        coarser.filter(move |&coarse| from != LevelsFrom::Finest && from.source(coarse) == level)
    }

    /// Rows at the top of a level that must be kept to its end.
    fn head_rows(self, orders: &[RowOrder], level: u8, late: u32) -> u32 {
        let (geometry, from) = (self.geometry, self.filter.from);
        let height = geometry.level(level).size[1];
        if level >= geometry.tail().first_level() {
            return height;
        }
        let for_coarser = self.made_from(level).map(|coarse| {
            let reach = Filter::new(self.filter, self.format, factor(from, coarse)).reach;
            descent::head_rows(geometry.address()[1], reach, height, orders[usize::from(coarse)])
        });
        for_coarser.fold(Schedule::head_rows(geometry, level, late), u32::max)
    }
}

/// The levels of one texture while its rows pass by.
pub(crate) struct Pyramid<'a> {
    geometry: &'a Geometry,
    levels: Vec<LevelRows<'a>>,
    /// What makes the levels that are made straight from level 0.
    straight: Option<Straight>,
}

struct LevelRows<'a> {
    rows: Rows,
    layout: RowLayout,
    /// Rows that are never forgotten.
    head: u32,
    /// Nothing for level 0, and for levels made straight from it.
    descent: Option<Descent>,
    /// Nothing for a level of the tail.
    bands: Option<Schedule<'a>>,
    /// A row of the border colour; empty where that stands neither above nor below.
    row_beyond: Row,
}

impl<'a> Pyramid<'a> {
    /// For pushes of `block_rows` rows, which is even. `late` is at least [`Shape::late_bands`], and the same
    /// for all layers of a texture.
    pub(crate) fn new(shape: Shape<'a>, block_rows: u32, late: u32) -> Pyramid<'a> {
        let Shape { geometry, format, filter, border_color } = shape;
        let (orders, color) = (row_orders(geometry, filter), texel_of_color(format, border_color));
        let level_rows = |(level, order): (u8, &RowOrder)| {
            let in_tail = level >= geometry.tail().first_level();
            let (head, row_bytes) =
                (shape.head_rows(&orders, level, late), row_bytes(geometry, format, level));
            let descent = (level > 0 && filter.from != LevelsFrom::Finest).then(|| {
                let source = orders[usize::from(filter.from.source(level))];
                Descent::new(geometry, format, filter, level, source, &color)
            });
            let row_beyond = match geometry.address()[1] {
                AddressMode::Border => color.repeat(row_bytes / color.len()),
                _ => Vec::new(),
            };
            LevelRows {
                rows: Rows::new(*order, row_bytes, block_rows, head),
                layout: RowLayout::new(geometry, format, level, &color),
                head,
                descent,
                bands: (!in_tail).then(|| Schedule::new(geometry, level, *order, late)),
                row_beyond: Row::alone(row_beyond),
            }
        };
        let levels = (0..).zip(&orders).map(level_rows).collect();
        let straight =
            (filter.from == LevelsFrom::Finest).then(|| Straight::new(geometry, format, filter, &color));
        Pyramid { geometry, levels, straight }
    }

    /// Returns true if every row has been pushed.
    pub(crate) fn is_complete(&self) -> bool {
        self.levels[0].rows.is_complete()
    }

    /// Bytes of rows held; never falls.
    pub(crate) fn allocated(&self) -> u64 {
        let lines = |level: &LevelRows<'_>| level.descent.as_ref().map_or(0, Descent::allocated);
        let rows: u64 = self.levels.iter().map(|level| level.rows.allocated() + lines(level)).sum();
        rows + self.straight.as_ref().map_or(0, Straight::allocated)
    }

    /// Takes the next rows of the image, which are as many as [`Pyramid::new`] was told except at its end,
    /// and makes of them what can be made of all coarser levels.
    pub(crate) fn push(&mut self, image_rows: &[u8], conversion: &Conversion) {
        let level = &mut self.levels[0];
        let image_row_bytes = level.layout.width * conversion.image_texel_bytes();
        let row_bytes = level.rows.row_bytes();
        let layout = &level.layout;
        let count = (image_rows.len() / image_row_bytes) as u32;
        let first = level.rows.filled();
        let rows = level.rows.grow(count).chunks_exact_mut(row_bytes);
        let rows = rows.zip(image_rows.chunks_exact(image_row_bytes));
        threads::map(rows, PARALLEL_BYTES.div_ceil(row_bytes), |(row, image_row)| {
            conversion.row(layout.payload_mut(row), image_row);
            layout.pad(row);
        });
        for level in 1..self.levels.len() {
            self.make(level);
        }
        self.make_straight(first..first + count);
    }

    /// Makes what can be made straight from level 0, of which these rows are new.
    fn make_straight(&mut self, rows: Range<u32>) {
        let (Some(straight), Some((finest, coarser))) = (&mut self.straight, self.levels.split_first_mut())
        else {
            return;
        };
        for start in rows.clone().step_by(straight::ROWS_AT_ONCE as usize) {
            let batch = start..rows.end.min(start + straight::ROWS_AT_ONCE);
            let texels: Vec<_> = batch.map(|y| finest.layout.payload(finest.rows.row(y))).collect();
            straight.add(&texels);
            for (level, LevelRows { rows, layout, .. }) in (1..).zip(&mut *coarser) {
                straight.finish(level, rows, layout);
            }
        }
    }

    /// Makes the rows of a level that can be made.
    fn make(&mut self, level: usize) {
        let (finer, coarser) = self.levels.split_at_mut(level);
        let LevelRows { rows, layout, descent: Some(descent), .. } = &mut coarser[0] else { return };
        let source = &finer[descent.source];
        descent.make(rows, layout, &source.rows, &source.layout);
    }

    /// Returns true if the next band of a level has all its rows.
    pub(crate) fn has_band(&self, level: u8) -> bool {
        let level = &self.levels[usize::from(level)];
        level.bands.as_ref().is_some_and(|bands| bands.is_ready(level.rows.filled()))
    }

    /// The next band of a level, if it has all its rows; it counts as cut from here on. Its rows stay as they
    /// are for as long as it is held, whatever is pushed and forgotten meanwhile.
    pub(crate) fn cut_band(&mut self, number: u8) -> Option<Band<'a>> {
        let level = &mut self.levels[usize::from(number)];
        let y = level.bands.as_mut()?.next(level.rows.filled())?;
        let row = |y: Option<u32>| y.map_or_else(|| level.row_beyond.clone(), |y| level.rows.held(y));
        let rows = Schedule::rows(self.geometry, number, y).map(row).collect();
        Some(Band { geometry: self.geometry, level: number, y, rows, texel: level.layout.texel })
    }

    /// Gives up the rows of a level that neither its bands nor coarser levels need any more.
    pub(crate) fn forget(&mut self, level: u8) {
        let level = usize::from(level);
        let LevelRows { bands: Some(bands), head, .. } = &self.levels[level] else { return };
        let coarser = self.levels[level + 1..].iter().filter_map(|coarse| {
            let descent = coarse.descent.as_ref().filter(|descent| descent.source == level)?;
            Some(descent.keep_from(&coarse.rows, *head))
        });
        let keep = coarser.fold(bands.keep_from(), u32::min);
        self.levels[level].rows.forget_before(keep);
    }

    /// The rows of a level of the tail, once it is complete, or what stands above and below it; for [`tail`].
    pub(crate) fn tail_row(&self, level: u8, y: Option<u32>) -> &[u8] {
        let level = &self.levels[usize::from(level)];
        y.map_or(level.row_beyond.bytes(), |y| level.rows.row(y))
    }
}

/// A row of pages, all of whose rows are there.
pub(crate) struct Band<'a> {
    geometry: &'a Geometry,
    level: u8,
    y: u32,
    /// Rows of a tile, from its first to its last.
    rows: Vec<Row>,
    texel: usize,
}

impl<'a> Band<'a> {
    /// The texture's shape.
    pub(crate) fn geometry(&self) -> &'a Geometry {
        self.geometry
    }

    /// Pages in the band.
    pub(crate) fn pages(&self) -> u32 {
        self.geometry.level(self.level).pages[0]
    }

    /// The band's page in column `x`.
    pub(crate) fn pos(&self, x: u32) -> PagePos {
        PagePos::new_2d(self.level, x, self.y)
    }

    /// Returns true if the last quarter of each of its tile's texels is zero: alpha, where a texel has four
    /// channels.
    pub(crate) fn is_transparent(&self, x: u32) -> bool {
        let bytes = self.tile_bytes(&(x..x + 1));
        let alpha = self.texel - self.texel / 4;
        let mut texels = self.rows.iter().flat_map(|row| row.bytes()[bytes.clone()].chunks_exact(self.texel));
        texels.all(|texel| texel[alpha..].iter().all(|&byte| byte == 0))
    }

    /// The rows of its tile.
    pub(crate) fn tile_rows(&self, x: u32) -> Vec<&[u8]> {
        let bytes = self.tile_bytes(&(x..x + 1));
        self.rows.iter().map(|row| &row.bytes()[bytes.clone()]).collect()
    }

    /// Along the tiles of some columns, borders included: the rows of texels from which rows of blocks are
    /// made.
    pub(crate) fn strips(&self, columns: &Range<u32>) -> Vec<Strip<'_>> {
        let bytes = self.tile_bytes(columns);
        let fours = self.rows.as_chunks::<SIDE>().0.iter();
        fours
            .map(|rows| Strip::new(rows.each_ref().map(Row::bytes), Row::joined(rows)).cut(bytes.clone()))
            .collect()
    }

    /// The bytes of a row that the tiles of some columns show, their borders included.
    fn tile_bytes(&self, columns: &Range<u32>) -> Range<usize> {
        let ([page, ..], [border, ..]) = (self.geometry.page(), self.geometry.border());
        let texels = columns.start as usize * page as usize
            ..columns.end as usize * page as usize + 2 * border as usize;
        texels.start * self.texel..texels.end * self.texel
    }
}
