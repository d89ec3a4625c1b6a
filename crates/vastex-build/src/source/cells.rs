//! Levels that are stored in cells, and any rectangle of one put together from the cells that it overlaps.

use vastex_core::{AddressMode, fold};

use super::interpolate;
use crate::image::{InputFault, PixelFormat};
use crate::texels::missing::Missing;

/// The levels that are read in cells: level 0 is the finest, each further one half as large, rounded up.
pub(super) trait Cells: Send + Sync {
    /// What texels are, in memory.
    fn format(&self) -> PixelFormat;

    /// How texels without data look, if there are any.
    fn missing(&self) -> Option<Missing> {
        None
    }

    /// Levels that are read, at least 1. Coarser ones are made when the source is opened.
    fn levels(&self) -> u32;

    /// Texels of a level, at least one. A writer may have rounded down what is rounded up here.
    fn size(&self, level: u32) -> [u32; 2];

    /// Texels of a cell of a level; those of the last column and row may be fewer.
    fn cell(&self, level: u32) -> [u32; 2];

    /// Returns true if a level is made of the next finer one whenever a page of it is asked for. Its edges
    /// are clamped.
    fn is_reduced(&self, level: u32) -> bool {
        let _ = level;
        false
    }

    /// Copies `size` texels of one cell of a level into `target`, whose rows are `stride` bytes apart. The
    /// level is not reduced, and `first` its texel of the upper left corner.
    fn copy(
        &self,
        level: u32,
        first: [u32; 2],
        size: [u32; 2],
        target: &mut [u8],
        stride: usize,
        address: [AddressMode; 2],
    ) -> Result<(), InputFault>;
}

/// Texels of a level, all within it.
#[derive(Clone, Copy)]
pub(super) struct Rectangle {
    pub(super) first: [u32; 2],
    pub(super) size: [u32; 2],
}

/// Texels side by side in a level, within one cell, that lie side by side in what is put together, too.
struct Run {
    from: u32,
    to: u32,
    len: u32,
}

/// A rectangle of a level that is not reduced, which may reach beyond its edges: rows of texels without
/// padding.
pub(super) fn rectangle(
    cells: &(impl Cells + ?Sized),
    address: [AddressMode; 2],
    level: u32,
    origin: [i64; 2],
    size: [u32; 2],
) -> Result<Vec<u8>, InputFault> {
    let texel = cells.format().texel_bytes();
    let stride = size[0] as usize * texel;
    let mut texels = vec![0; stride * size[1] as usize];
    let (of_level, cell) = (cells.size(level), cells.cell(level));
    let runs = |axis: usize| runs(address[axis], of_level[axis], cell[axis], origin[axis], size[axis]);
    let columns = runs(0);
    for y in runs(1) {
        for x in &columns {
            let target = &mut texels[y.to as usize * stride + x.to as usize * texel..];
            cells.copy(level, [x.from, y.from], [x.len, y.len], target, stride, address)?;
        }
    }
    Ok(texels)
}

fn runs(address: AddressMode, size: u32, cell: u32, origin: i64, len: u32) -> Vec<Run> {
    let mut runs: Vec<Run> = Vec::new();
    for to in 0..len {
        let from = fold(address, origin + i64::from(to), size);
        match runs.last_mut() {
            Some(run) if run.from + run.len == from && !from.is_multiple_of(cell) => run.len += 1,
            _ => runs.push(Run { from, to, len: 1 }),
        }
    }
    runs
}

/// Fills texels of one cell by what a level `shift` levels coarser gives.
pub(super) fn interpolated(
    cells: &(impl Cells + ?Sized),
    address: [AddressMode; 2],
    level: u32,
    shift: u32,
    Rectangle { first, size }: Rectangle,
    target: &mut [u8],
    stride: usize,
) -> Result<(), InputFault> {
    let [x, y] = [0, 1].map(|axis| interpolate::Between::new(first[axis], size[axis], shift));
    let coarse = rectangle(cells, address, level + shift, [x.origin(), y.origin()], [x.count(), y.count()])?;
    interpolate::fill(target, stride, (cells.format(), cells.missing()), &coarse, &x, &y);
    Ok(())
}
