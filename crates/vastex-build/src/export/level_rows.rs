//! The rows of a level, from the top: read page by page, and held while tiles are cut from them.

use std::ops::Range;

use bytes::Bytes;
use rayon::ThreadPool;
use vastex_core::PagePos;
use vastex_tiles::TileSource;

use super::ExportError;
use crate::threads;
use crate::tile::LayerOf;

/// Who does the work of an export, and who says whether it goes on.
pub(super) struct Work<'a> {
    pub(super) pool: &'a ThreadPool,
    /// Asked on the thread that exports, between any two pieces of work.
    pub(super) go_on: &'a dyn Fn() -> Result<(), ExportError>,
}

/// Rows without padding, one after the other.
pub(super) trait RowSource: Send + Sync {
    /// Texels per row, and rows.
    fn size(&self) -> [u32; 2];

    /// Bytes of a texel.
    fn texel_bytes(&self) -> usize;

    /// Appends the next row or rows, whole. There are some left.
    fn append(&mut self, rows: &mut Vec<u8>, work: &Work<'_>) -> Result<(), ExportError>;
}

/// A level as the texture holds it.
pub(super) struct StoredLevel<'a> {
    source: &'a dyn TileSource,
    layer: &'a LayerOf,
    level: u8,
    next_row: u32,
}

impl<'a> StoredLevel<'a> {
    pub(super) fn new(source: &'a dyn TileSource, layer: &'a LayerOf, level: u8) -> StoredLevel<'a> {
        StoredLevel { source, layer, level, next_row: 0 }
    }

    /// The tiles that hold the next rows, with the first texel of each in its tile and in the level's rows.
    fn tiles(&self) -> Result<(Vec<Placed>, u32), ExportError> {
        let geometry = self.layer.geometry();
        let [width, height] = self.size();
        if self.level >= geometry.tail().first_level() {
            let tile = self.layer.texels(self.source, geometry.tail_pos())?;
            let from = geometry.tile_texel_from_tail_texel(self.level, [0; 3]);
            return Ok((vec![Placed { tile, from: [from[0], from[1]], column: 0, width }], height));
        }
        let page = geometry.page()[0];
        let y = self.next_row / page;
        let [x0, y0, _] = geometry.tile_texel_from_page_texel([0; 3]);
        let place = |x: u32| -> Result<Placed, ExportError> {
            let tile = self.layer.texels(self.source, PagePos::new_2d(self.level, x, y))?;
            Ok(Placed { tile, from: [x0, y0], column: x * page, width: page.min(width - x * page) })
        };
        let tiles = threads::try_map(0..geometry.level(self.level).pages[0], place)?;
        Ok((tiles, page.min(height - y * page)))
    }
}

/// A tile and the rectangle of it that goes into rows.
struct Placed {
    tile: Bytes,
    from: [u32; 2],
    column: u32,
    width: u32,
}

impl RowSource for StoredLevel<'_> {
    fn size(&self) -> [u32; 2] {
        let [width, height, _] = self.layer.geometry().level(self.level).size;
        [width, height]
    }

    fn texel_bytes(&self) -> usize {
        self.layer.format().texel_bytes()
    }

    fn append(&mut self, rows: &mut Vec<u8>, work: &Work<'_>) -> Result<(), ExportError> {
        (work.go_on)()?;
        let (tiles, count) = work.pool.install(|| self.tiles())?;
        let (texel, side) = (self.texel_bytes(), self.layer.geometry().tile()[0] as usize);
        let stride = self.size()[0] as usize * texel;
        let first = rows.len();
        rows.resize(first + count as usize * stride, 0);
        for Placed { tile, from: [x, y], column, width } in tiles {
            for row in 0..count as usize {
                let from = ((y as usize + row) * side + x as usize) * texel;
                let to = first + row * stride + column as usize * texel;
                let bytes = width as usize * texel;
                rows[to..to + bytes].copy_from_slice(&tile[from..from + bytes]);
            }
        }
        self.next_row += count;
        Ok(())
    }
}

/// A rectangle of texels of a level, which may reach beyond it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Rectangle {
    pub(super) origin: [i64; 2],
    pub(super) size: [u32; 2],
}

/// Some rows of a level; it moves down only.
pub(super) struct Window<'a> {
    source: Box<dyn RowSource + 'a>,
    first: u32,
    held: Vec<u8>,
}

impl<'a> Window<'a> {
    pub(super) fn new(source: Box<dyn RowSource + 'a>) -> Window<'a> {
        Window { source, first: 0, held: Vec::new() }
    }

    pub(super) fn size(&self) -> [u32; 2] {
        self.source.size()
    }

    fn row_bytes(&self) -> usize {
        self.size()[0] as usize * self.source.texel_bytes()
    }

    /// Reads up to the end of `rows` and forgets what lies before them.
    pub(super) fn hold(&mut self, rows: Range<u32>, work: &Work<'_>) -> Result<(), ExportError> {
        let row_bytes = self.row_bytes();
        while self.first + ((self.held.len() / row_bytes) as u32) < rows.end {
            self.forget_before(rows.start);
            let before = self.held.len();
            self.source.append(&mut self.held, work)?;
            debug_assert!(self.held.len() > before && self.held.len().is_multiple_of(row_bytes));
        }
        self.forget_before(rows.start);
        Ok(())
    }

    fn forget_before(&mut self, row: u32) {
        let row_bytes = self.row_bytes();
        let held = self.held.len() / row_bytes;
        let gone = (row.saturating_sub(self.first) as usize).min(held);
        self.held.drain(..gone * row_bytes);
        self.first += gone as u32;
    }

    /// A row that is held.
    pub(super) fn row(&self, y: u32) -> &[u8] {
        let start = (y - self.first) as usize * self.row_bytes();
        &self.held[start..start + self.row_bytes()]
    }

    /// A rectangle whose rows are held. Beyond the edges it repeats the edge or, in x, where the level
    /// `wraps`, goes on at the other side.
    pub(super) fn cut(&self, Rectangle { origin, size }: Rectangle, wraps: bool) -> Vec<u8> {
        let (texel, [width, height]) = (self.source.texel_bytes(), self.size().map(i64::from));
        let mut cut = Vec::with_capacity(size[0] as usize * size[1] as usize * texel);
        let columns = origin[0]..origin[0] + i64::from(size[0]);
        for y in origin[1]..origin[1] + i64::from(size[1]) {
            let row = self.row(y.clamp(0, height - 1) as u32);
            if columns.start >= 0 && columns.end <= width {
                cut.extend_from_slice(&row[columns.start as usize * texel..columns.end as usize * texel]);
                continue;
            }
            for x in columns.clone() {
                let x = if wraps { x.rem_euclid(width) } else { x.clamp(0, width - 1) };
                cut.extend_from_slice(&row[x as usize * texel..][..texel]);
            }
        }
        cut
    }
}
