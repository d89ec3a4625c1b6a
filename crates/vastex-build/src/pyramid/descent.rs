//! From one level to a coarser one: which rows can be made, from which, and making them.

use std::collections::BTreeMap;

use vastex_core::{AddressMode, Geometry, LayerFormat};

use super::layout::{Reached, RowLayout};
use super::rows::{RowOrder, Rows};
use super::schedule::row_at;
use crate::texels::filter::{Filter, LayerFilter, LevelsFrom, Method, Quad, Reach};
use crate::threads;

/// Bytes of rows below which it does not pay to share work among threads.
pub(crate) const PARALLEL_BYTES: usize = 64 << 10;
/// Rows that are made at once by filters that keep lines.
const ROWS_AT_ONCE: u32 = 32;

/// Texels of the level that `level` is made from, along one of its own.
pub(crate) fn factor(from: LevelsFrom, level: u8) -> u32 {
    1 << (level - from.source(level))
}

/// The order in which the rows of each level are made. Where a wrapping edge puts a level's last rows before
/// its first, the rows that are made of those come last.
pub(crate) fn row_orders(geometry: &Geometry, filter: LayerFilter) -> Vec<RowOrder> {
    let mut orders: Vec<RowOrder> = Vec::new();
    for level in 0..=geometry.coarsest() {
        let height = geometry.level(level).size[1];
        let first = match geometry.address()[1] {
            AddressMode::Wrap if level > 0 => {
                let source = orders[usize::from(filter.from.source(level))];
                let factor = factor(filter.from, level);
                let reaches_up = i64::from(source.first) - filter.kernel.stretched(factor).first;
                u32::try_from(reaches_up).unwrap_or(0).div_ceil(factor)
            }
            _ => 0,
        };
        // Where all rows are, they may as well come from the top.
        orders.push(RowOrder { height, first: if first < height { first } else { 0 } });
    }
    orders
}

/// Rows at the top of a level of `height` rows that a coarser one needs when it is complete.
pub(crate) fn head_rows(mode: AddressMode, reach: Reach, height: u32, coarse: RowOrder) -> u32 {
    if mode != AddressMode::Wrap {
        return 0;
    }
    let overhang = reach.of(coarse.height - 1).end - i64::from(height);
    let late = if coarse.first > 0 { reach.of(coarse.first - 1).end } else { 0 };
    overhang.max(late).clamp(0, height.into()) as u32
}

/// Bytes that making a level of `width` texels takes.
pub(crate) fn memory(filter: &Filter, width: u32) -> u64 {
    let Method::Separable(separable) = &filter.method else { return 0 };
    let lines = filter.reach.factor * ROWS_AT_ONCE + 2 * filter.reach.count + 1;
    u64::from(lines) * u64::from(width) * separable.channels() as u64 * 4
}

/// How one level is made from another.
pub(crate) struct Descent {
    /// Number of the other level.
    pub(crate) source: usize,
    filter: Filter,
    mode: AddressMode,
    /// Of the other level.
    order: RowOrder,
    /// What a line is made from.
    reached: Reached,
    /// A texel of the border colour.
    color: Vec<u8>,
    /// Lines of the other level, by their rows, that are needed again.
    lines: BTreeMap<u32, Vec<f32>>,
    /// A line, or a row, of the border colour; empty where that stands neither above nor below.
    line_beyond: Vec<f32>,
    row_beyond: Vec<u8>,
    allocated: u64,
}

impl Descent {
    /// For `level`, which is not 0, of the rows in the order `order` of the level that it is made from.
    pub(crate) fn new(
        geometry: &Geometry,
        format: LayerFormat,
        filter: LayerFilter,
        level: u8,
        order: RowOrder,
        color: &[u8],
    ) -> Descent {
        let source = filter.from.source(level);
        let filter = Filter::new(filter, format, factor(filter.from, level));
        let (width, coarse_width) = (geometry.level(source).size[0], geometry.level(level).size[0]);
        let texels = filter.reach.of_run(&(0..coarse_width));
        let mode = geometry.address()[1];
        let row_beyond = match mode {
            AddressMode::Border => color.repeat((texels.end - texels.start) as usize),
            _ => Vec::new(),
        };
        let line_beyond = match &filter.method {
            Method::Separable(separable) if !row_beyond.is_empty() => {
                separable.along(&row_beyond, coarse_width as usize)
            }
            _ => Vec::new(),
        };
        Descent {
            source: source.into(),
            filter,
            mode,
            order,
            reached: Reached::new(geometry.address()[0], width, &texels),
            color: color.to_vec(),
            lines: BTreeMap::new(),
            line_beyond,
            row_beyond,
            allocated: 0,
        }
    }

    /// Bytes of lines held at once.
    pub(crate) fn allocated(&self) -> u64 {
        self.allocated
    }

    /// The rows that row `y` is made of; nothing for the border colour.
    fn sources(&self, y: u32) -> impl Iterator<Item = Option<u32>> + '_ {
        self.filter.reach.of(y).map(|row| row_at(self.mode, row, self.order.height))
    }

    /// The first row, but for the `head`, that a row of `coarse` still to be made needs.
    pub(crate) fn keep_from(&self, coarse: &Rows, head: u32) -> u32 {
        let (order, made) = (coarse.order(), coarse.filled());
        // Rows in between need later rows than the next one; only those at the edges look back.
        let edges = order.height.saturating_sub(order.first + self.filter.reach.count)..order.height;
        std::iter::once(made)
            .chain(edges)
            .filter(|rank| (made..order.height).contains(rank))
            .flat_map(|rank| self.sources(order.row(rank)))
            .flatten()
            .filter(|&row| row >= head)
            .min()
            .unwrap_or(u32::MAX)
    }

    /// Makes every row that can be made now.
    pub(crate) fn make(
        &mut self,
        coarse: &mut Rows,
        layout: &RowLayout,
        source: &Rows,
        source_layout: &RowLayout,
    ) {
        while !coarse.is_complete() {
            let first = coarse.next();
            let can_be_made = |y: &u32| {
                let mut sources = self.sources(*y).flatten();
                sources.all(|row| self.order.rank(row) < source.filled())
            };
            let end = first + coarse.room();
            let count = (first..end).take_while(can_be_made).count() as u32;
            if count == 0 {
                return;
            }
            match &self.filter.method {
                Method::Quad(quad) => {
                    let quad = *quad;
                    self.make_quads(quad, coarse, count, layout, source, source_layout);
                }
                Method::Separable(_) => {
                    let count = count.min(ROWS_AT_ONCE);
                    self.find_lines(first..first + count, layout, source, source_layout);
                    self.cross_lines(coarse, count, layout);
                    self.forget_lines(coarse);
                }
            }
        }
    }

    fn make_quads(
        &self,
        quad: Quad,
        coarse: &mut Rows,
        count: u32,
        layout: &RowLayout,
        source: &Rows,
        source_layout: &RowLayout,
    ) {
        let (first, row_bytes) = (coarse.next(), coarse.row_bytes());
        let make = |(i, row): (usize, &mut [u8])| {
            let pair = |y: i64| match row_at(self.mode, y, self.order.height) {
                Some(y) => source_layout.pairs(source.row(y), layout.width),
                None => &self.row_beyond,
            };
            let y = 2 * i64::from(first + i as u32);
            quad.row(layout.payload_mut(row), pair(y), pair(y + 1));
            layout.pad(row);
        };
        let rows = coarse.grow(count).chunks_exact_mut(row_bytes).enumerate();
        threads::map(rows, PARALLEL_BYTES.div_ceil(row_bytes), make);
    }

    /// Makes the lines that rows need and that are not there.
    fn find_lines(
        &mut self,
        rows: std::ops::Range<u32>,
        layout: &RowLayout,
        source: &Rows,
        source_layout: &RowLayout,
    ) {
        let mut missing: Vec<u32> = rows.flat_map(|y| self.sources(y)).flatten().collect();
        missing.sort_unstable();
        missing.dedup();
        missing.retain(|row| !self.lines.contains_key(row));
        let Method::Separable(separable) = &self.filter.method else { return };
        let line = |row: u32| {
            let texels = self.reached.texels(source_layout.payload(source.row(row)), &self.color);
            (row, separable.along(&texels, layout.width))
        };
        let least = PARALLEL_BYTES.div_ceil(source.row_bytes());
        self.lines.extend(threads::map(missing, least, line));
        let line_bytes = layout.width * separable.channels() * size_of::<f32>();
        self.allocated = self.allocated.max((self.lines.len() * line_bytes) as u64);
    }

    fn cross_lines(&self, coarse: &mut Rows, count: u32, layout: &RowLayout) {
        let Method::Separable(separable) = &self.filter.method else { return };
        let (first, row_bytes) = (coarse.next(), coarse.row_bytes());
        let make = |(i, row): (usize, &mut [u8])| {
            let lines = self.sources(first + i as u32).map(|row| match row {
                Some(row) => self.lines.get(&row).map_or(&[][..], Vec::as_slice),
                None => &self.line_beyond,
            });
            separable.across(lines, layout.payload_mut(row));
            layout.pad(row);
        };
        let least = PARALLEL_BYTES.div_ceil(row_bytes * self.filter.reach.count as usize);
        threads::map(coarse.grow(count).chunks_exact_mut(row_bytes).enumerate(), least, make);
    }

    /// Keeps only the lines that the next row needs.
    fn forget_lines(&mut self, coarse: &Rows) {
        let kept: Vec<u32> = match coarse.is_complete() {
            true => Vec::new(),
            false => self.sources(coarse.next()).flatten().collect(),
        };
        self.lines.retain(|row, _| kept.contains(row));
    }
}
