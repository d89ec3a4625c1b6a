//! The pages of a source whose levels are read in cells: borders from the cells that lie around a page,
//! levels that the source lacks from those that it has.
//!
//! Pages and cells need not have the same size. Levels that are coarser than the coarsest cells are filtered
//! when the source is opened, and kept; a finer one that is missing is filtered page by page. Which levels
//! there are is [`Cells`]' business.

use std::ops::ControlFlow;
use std::sync::Arc;

use vastex_core::{
    AddressMode, Box3, Description, Dims, Geometry, GeometryError, GeometrySpec, LayerFormat, PagePos, fold,
};
use vastex_tiles::{Codec, ReadError, Tile};

use super::SourceError;
use super::cells::{Cells, rectangle};
use super::losses::{LossListener, Losses};
use crate::image::{ImageHeader, InputFault, Notice};
use crate::texels::convert::{Conversion, layer_format};
use crate::texels::filter::{Filter, LayerFilter};

/// Texels of border of the pages.
const BORDER: u32 = 4;
/// Cells of fewer texels per side have pages of 128 texels, others of 256.
const SMALL_CELL: u32 = 256;
/// Bytes that the levels which a source lacks may take.
const MAX_MADE_BYTES: u64 = 256 << 20;

/// What pages are to be like; by default what is shown at once.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shape {
    /// Texels of payload per side; `None` for what suits the cells.
    pub(crate) page: Option<u32>,
    pub(crate) border: u32,
    /// What lies beyond the edges. A planet's neighbours across the date line are its neighbours in any case.
    pub(crate) address: [AddressMode; 2],
    /// To what the places of levels in the tail are aligned.
    pub(crate) tail_align: u32,
}

impl Default for Shape {
    fn default() -> Shape {
        let tail_align = GeometrySpec::image(1, 1).tail_align;
        Shape { page: None, border: BORDER, address: [AddressMode::Clamp; 2], tail_align }
    }
}

/// Hears how much of what is read at opening is there, 0 to 1; `Break` breaks it off.
pub(super) type OpeningWatch<'a> = &'a dyn Fn(f64) -> ControlFlow<()>;

/// Lets it go on.
pub(super) fn unwatched(_: f64) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

/// Why there are no pages.
pub(super) enum NoPages {
    BrokenOff,
    Input(InputFault),
    Geometry(GeometryError),
}

impl NoPages {
    /// With the file that it is about.
    pub(super) fn at(self, path: &std::path::Path) -> SourceError {
        match self {
            NoPages::Input(fault) => SourceError::Input { path: path.into(), fault },
            NoPages::Geometry(error) => SourceError::Geometry(error),
            NoPages::BrokenOff => SourceError::BrokenOff { path: path.into() },
        }
    }
}

/// Pages of what the header describes, of cells that need not be read for that.
pub(super) fn described(
    cells: &impl Cells,
    header: &ImageHeader,
    wraps: bool,
    shape: &Shape,
) -> Result<Arc<Description>, GeometryError> {
    let [x, y] = shape.address;
    let x = if wraps && x == AddressMode::Clamp { AddressMode::Wrap } else { x };
    let is_small = cells.cell(0).into_iter().min().is_some_and(|side| side < SMALL_CELL);
    let geometry = Geometry::new(GeometrySpec {
        dims: Dims::D2,
        page: shape.page.unwrap_or(if is_small { 128 } else { 256 }),
        border: shape.border,
        address: [x, y, AddressMode::Clamp],
        tail_align: shape.tail_align,
        ..GeometrySpec::image(header.width, header.height)
    })?;
    let mut description = Description::one_layer(geometry, layer_format(header));
    description.layers[0].nodata = header.nodata.and_then(|value| Conversion::usual(header).nodata(value));
    Ok(Arc::new(description))
}

/// Cells as pages of 128 or 256 texels.
pub(super) struct Pages<C> {
    pub(super) cells: C,
    pub(super) description: Arc<Description>,
    conversion: Conversion,
    losses: Losses,
    address: [AddressMode; 2],
    filter: Filter,
    /// Bytes of a texel of the layer.
    texel: usize,
    /// The levels that the source lacks at the coarse end, finest first, as texels of the layer.
    made: Vec<Vec<u8>>,
}

impl<C: Cells> Pages<C> {
    /// Pages of what the header describes. Reads the coarsest level where there must be coarser ones, as long
    /// as nobody breaks that off.
    pub(super) fn new(
        cells: C,
        header: &ImageHeader,
        wraps: bool,
        (shape, watch): (&Shape, OpeningWatch<'_>),
    ) -> Result<Pages<C>, NoPages> {
        let description = described(&cells, header, wraps, shape).map_err(NoPages::Geometry)?;
        let (format, nodata) = (description.layers[0].format, description.layers[0].nodata);
        let [x, y, _] = description.geometry.address();
        let filter = LayerFilter { nodata, ..LayerFilter::for_layer("color", format, true) };
        let filter = Filter::new(filter, format, 2);
        let mut pages = Pages {
            cells,
            description,
            conversion: Conversion::usual(header),
            losses: Losses::new(format),
            address: [x, y],
            filter,
            texel: format.texel_bytes(),
            made: Vec::new(),
        };
        pages.make_levels(watch)?;
        Ok(pages)
    }

    /// What there is to say of the texels that were read so far, as a layer of a format.
    pub(super) fn losses(&self, format: LayerFormat) -> Vec<Notice> {
        self.losses.notices(format)
    }

    /// Has told what texels lose in the layer, once each, as soon as it is read.
    pub(super) fn tell_losses(&self, listener: LossListener) {
        self.losses.listen(listener);
    }

    /// The tile of a page; `fault_at` says where a fault is.
    pub(super) fn tile(
        &self,
        pos: PagePos,
        error: impl Fn(PagePos, &InputFault) -> ReadError,
    ) -> Result<Tile, ReadError> {
        let geometry = &self.description.geometry;
        if !geometry.contains(pos) {
            return Err(ReadError::NoSuchTile { pos });
        }
        let mut tile = vec![0; self.description.tile_bytes()];
        let side = geometry.tile()[0] as usize;
        for (level, level_box, offset) in geometry.tile_boxes(pos) {
            let start = (offset[1] as usize * side + offset[0] as usize) * self.texel;
            let rows = tile[start..].chunks_mut(side * self.texel);
            self.fill(level.into(), level_box, rows).map_err(|fault| error(pos, &fault))?;
        }
        Ok(Tile { codec: Codec::Raw, bytes: tile.into() })
    }

    /// Writes the texels of `level_box` to the beginnings of rows.
    fn fill<'a>(
        &self,
        level: u32,
        level_box: Box3,
        rows: impl Iterator<Item = &'a mut [u8]>,
    ) -> Result<(), InputFault> {
        let ([x, y, _], [width, height, _]) = (level_box.origin, level_box.size);
        let row_bytes = width as usize * self.texel;
        let rows = rows.map(|row| &mut row[..row_bytes]);
        if level < self.cells.levels() && !self.cells.is_reduced(level) {
            let image = rectangle(&self.cells, self.address, level, [x, y], [width, height])?;
            let image_row = width as usize * self.cells.format().texel_bytes();
            self.losses.look_at(&self.conversion, &image);
            for (row, image) in rows.zip(image.chunks_exact(image_row)) {
                self.conversion.row(row, image);
            }
            return Ok(());
        }
        let texels = self.texels(level, [x, y], [width, height])?;
        for (row, texels) in rows.zip(texels.chunks_exact(row_bytes)) {
            row.copy_from_slice(texels);
        }
        Ok(())
    }

    /// A rectangle of a level as texels of the layer, which may reach beyond its edges.
    fn texels(&self, level: u32, origin: [i64; 2], size: [u32; 2]) -> Result<Vec<u8>, InputFault> {
        match level.checked_sub(self.cells.levels()) {
            Some(made) => Ok(self.texels_of_made(made as usize, level, origin, size)),
            None if self.cells.is_reduced(level) => self.reduced(level, origin, size),
            None => {
                let image = rectangle(&self.cells, self.address, level, origin, size)?;
                let mut texels = vec![0; size[0] as usize * size[1] as usize * self.texel];
                self.losses.look_at(&self.conversion, &image);
                self.conversion.row(&mut texels, &image);
                Ok(texels)
            }
        }
    }

    fn level_size(&self, level: u32) -> [u32; 2] {
        let [width, height, _] = self.description.geometry.level(level as u8).size;
        [width, height]
    }

    fn texels_of_made(&self, made: usize, level: u32, origin: [i64; 2], size: [u32; 2]) -> Vec<u8> {
        let of_level = self.level_size(level);
        let mut texels = Vec::with_capacity(size[0] as usize * size[1] as usize * self.texel);
        for y in (origin[1]..).take(size[1] as usize) {
            let row = fold(self.address[1], y, of_level[1]) as usize * of_level[0] as usize;
            for x in (origin[0]..).take(size[0] as usize) {
                let at = (row + fold(self.address[0], x, of_level[0]) as usize) * self.texel;
                texels.extend_from_slice(&self.made[made][at..at + self.texel]);
            }
        }
        texels
    }

    /// A rectangle of a level that is filtered from the next finer one: the part within the level, and what
    /// lies beyond its edges as the address modes say.
    fn reduced(&self, level: u32, origin: [i64; 2], size: [u32; 2]) -> Result<Vec<u8>, InputFault> {
        let of_level = self.level_size(level);
        let is_inside = |axis: usize| {
            let end = origin[axis] + i64::from(size[axis]);
            self.address[axis] == AddressMode::Clamp || origin[axis] >= 0 && end <= i64::from(of_level[axis])
        };
        if let Some(axis) = [0, 1].into_iter().find(|&axis| !is_inside(axis)) {
            return self.reduced_across(level, origin, size, axis);
        }
        let inside: [[i64; 2]; 2] = [0, 1].map(|axis| {
            let last = i64::from(of_level[axis]) - 1;
            [origin[axis], origin[axis] + i64::from(size[axis]) - 1].map(|at| at.clamp(0, last))
        });
        let count = inside.map(|[first, last]| (last - first + 1) as u32);
        let fine =
            self.texels(level - 1, inside.map(|[first, _]| 2 * first), count.map(|count| 2 * count))?;
        let coarse = self.filtered(&fine, count[0]);
        let index = |axis: usize, n: u32| {
            let [first, last] = inside[axis];
            ((origin[axis] + i64::from(n)).clamp(first, last) - first) as usize
        };
        let mut texels = Vec::with_capacity(size[0] as usize * size[1] as usize * self.texel);
        for y in 0..size[1] {
            let row = index(1, y) * count[0] as usize;
            for x in 0..size[0] {
                let at = (row + index(0, x)) * self.texel;
                texels.extend_from_slice(&coarse[at..at + self.texel]);
            }
        }
        Ok(texels)
    }

    /// As [`Pages::reduced`], of a rectangle that reaches beyond an edge whose other side is seen there: line
    /// by line along that axis, each where it lies within the level. Only borders reach there.
    fn reduced_across(
        &self,
        level: u32,
        origin: [i64; 2],
        size: [u32; 2],
        axis: usize,
    ) -> Result<Vec<u8>, InputFault> {
        let (of_level, row) = (self.level_size(level), size[0] as usize * self.texel);
        let mut texels = vec![0; row * size[1] as usize];
        let (mut done, mut line_size) = (0, size);
        while done < size[axis] {
            let folded =
                |n: u32| i64::from(fold(self.address[axis], origin[axis] + i64::from(n), of_level[axis]));
            let first = folded(done);
            let left = size[axis] - done;
            line_size[axis] = (1..left).find(|&n| folded(done + n) != first + i64::from(n)).unwrap_or(left);
            let mut place = origin;
            place[axis] = first;
            let lines = self.reduced(level, place, line_size)?;
            let bytes = line_size[0] as usize * self.texel;
            let to = if axis == 0 { done as usize * self.texel } else { done as usize * row };
            for (target, line) in texels[to..].chunks_mut(row).zip(lines.chunks_exact(bytes)) {
                target[..bytes].copy_from_slice(line);
            }
            done += line_size[axis];
        }
        Ok(texels)
    }

    /// Rows of `width` texels, each of two rows of twice as many.
    fn filtered(&self, fine: &[u8], width: u32) -> Vec<u8> {
        let (row, fine_row) = (width as usize * self.texel, 2 * width as usize * self.texel);
        let mut coarse = vec![0; fine.len() / 4];
        for (row, pair) in coarse.chunks_exact_mut(row).zip(fine.chunks_exact(2 * fine_row)) {
            let (upper, lower) = pair.split_at(fine_row);
            self.filter.row(row, &[upper, lower]);
        }
        coarse
    }

    /// Makes the levels that are coarser than the source's, by the mean of 2x2 texels.
    fn make_levels(&mut self, watch: OpeningWatch<'_>) -> Result<(), NoPages> {
        let count = self.description.geometry.levels().len() as u32;
        let texels = |level: u32| self.level_size(level).map(f64::from).iter().product::<f64>();
        let (mut done, all) = (0.0, (self.cells.levels()..count).map(texels).sum::<f64>());
        for level in self.cells.levels()..count {
            let ([width, height], finer) = (self.level_size(level), self.level_size(level - 1));
            let bytes = u64::from(width) * u64::from(height) * self.texel as u64;
            if bytes > MAX_MADE_BYTES {
                return Err(NoPages::Input(InputFault::Unsupported {
                    what: format!("no level that is coarser than {}x{} texels", finer[0], finer[1]),
                    remedy: "add coarser levels, or make a container of it with `vastex build`",
                }));
            }
            let mut coarse = Vec::with_capacity(bytes as usize);
            // As many rows at a time as a row of cells has; two of them make one.
            let strip = (self.cells.cell(self.cells.levels() - 1)[1] / 2).clamp(1, height);
            for top in (0..height).step_by(strip as usize) {
                if watch(done / all).is_break() {
                    return Err(NoPages::BrokenOff);
                }
                let rows = strip.min(height - top);
                let fine = self.texels(level - 1, [0, (2 * top).into()], [2 * width, 2 * rows]);
                coarse.extend(self.filtered(&fine.map_err(NoPages::Input)?, width));
                done += f64::from(width) * f64::from(rows);
            }
            self.made.push(coarse);
        }
        Ok(())
    }
}
