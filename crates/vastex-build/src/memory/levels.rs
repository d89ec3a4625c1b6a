//! The levels of an image in memory, which grow row by row: each pair of rows makes one of the next coarser level.

use vastex_core::LayerFormat;

use crate::image::ImageHeader;
use crate::texels::convert::Conversion;
use crate::texels::filter::{Filter, LayerFilter};

/// From rows of the image to rows of level 0.
pub(super) struct Rows {
    conversion: Conversion,
    filter: Filter,
    /// Bytes of a texel of the image, and of one of the layer.
    texel: [usize; 2],
    /// Columns and rows of the image.
    size: [u32; 2],
    factor: u32,
    /// The next row of the image.
    next: u32,
    /// The texels of the upper row that the next row of level 0 is made of.
    upper: Vec<u8>,
    /// The last row that was made.
    made: Vec<u8>,
}

impl Rows {
    pub(super) fn new(header: &ImageHeader, factor: u32) -> Rows {
        let conversion = Conversion::usual(header);
        let format = conversion.layer();
        Rows {
            conversion,
            filter: of_color(format),
            texel: [header.format.texel_bytes(), format.texel_bytes()],
            size: [header.width, header.height],
            factor,
            next: 0,
            upper: Vec::new(),
            made: vec![0; header.width.div_ceil(factor) as usize * format.texel_bytes()],
        }
    }

    /// Bytes of a row of the image.
    pub(super) fn row_bytes(&self) -> usize {
        self.size[0] as usize * self.texel[0]
    }

    /// Takes the next row of the image; the row of level 0 that it completes, if it does.
    pub(super) fn next(&mut self, row: &[u8]) -> Option<&[u8]> {
        let [_, height] = self.size;
        if self.next == height {
            return None;
        }
        let (place, is_last) = (self.next % self.factor, self.next == height - 1);
        self.next += 1;
        if self.factor == 1 {
            self.conversion.row(&mut self.made, row);
            return Some(&self.made);
        }
        // Of `factor` rows two, about a quarter from the edges; what ends early has its last row twice.
        let [upper, lower] = picked(self.factor);
        let is_upper = place == upper || is_last && place < upper;
        if is_upper {
            self.upper = self.thinned(row);
        }
        if place != lower && !(is_last && place < lower) {
            return None;
        }
        let lower = if is_upper { self.upper.clone() } else { self.thinned(row) };
        self.filter.row(&mut self.made, &[&self.upper, &lower]);
        Some(&self.made)
    }

    /// Of each `factor` texels of a row two, as texels of the layer.
    fn thinned(&self, row: &[u8]) -> Vec<u8> {
        let ([texel, of_layer], last) = (self.texel, self.size[0] - 1);
        let firsts = (0..self.size[0]).step_by(self.factor as usize);
        let columns = firsts.flat_map(|first| picked(self.factor).map(|place| (first + place).min(last)));
        let mut thin = Vec::with_capacity(2 * self.made.len() / of_layer * texel);
        for column in columns {
            let at = column as usize * texel;
            thin.extend_from_slice(&row[at..at + texel]);
        }
        let mut converted = vec![0; 2 * self.made.len()];
        self.conversion.row(&mut converted, &thin);
        converted
    }
}

/// The two of `factor` texels whose mean stands for all.
fn picked(factor: u32) -> [u32; 2] {
    [factor / 4, factor - 1 - factor / 4]
}

/// Levels as far as they are there.
pub(super) struct Levels {
    levels: Vec<Level>,
    filter: Filter,
    texel: usize,
    /// Whether the first column is the last one's neighbour.
    wraps: bool,
}

struct Level {
    size: [u32; 2],
    texels: Vec<u8>,
}

impl Level {
    fn row_bytes(&self, texel: usize) -> usize {
        self.size[0] as usize * texel
    }

    fn rows(&self, texel: usize) -> u32 {
        (self.texels.len() / self.row_bytes(texel)) as u32
    }
}

impl Levels {
    pub(super) fn new(sizes: Vec<[u32; 2]>, format: LayerFormat, wraps: bool) -> Levels {
        let levels = sizes.into_iter().map(|size| Level { size, texels: Vec::new() }).collect();
        Levels { levels, filter: of_color(format), texel: format.texel_bytes(), wraps }
    }

    /// Rows of level 0 that are there.
    pub(super) fn rows(&self) -> u32 {
        self.levels[0].rows(self.texel)
    }

    /// A row of a level, if it is there.
    pub(super) fn row(&self, level: u8, row: u32) -> Option<&[u8]> {
        let level = self.levels.get(usize::from(level))?;
        let bytes = level.row_bytes(self.texel);
        level.texels.get(row as usize * bytes..(row as usize + 1) * bytes)
    }

    /// Adds the next row of level 0, and the rows of coarser levels that it completes.
    pub(super) fn push(&mut self, row: &[u8]) {
        if self.levels[0].texels.is_empty() {
            // At once, so that nothing is copied as they grow. The system gives memory as it is written to.
            for level in &mut self.levels {
                let bytes = level.row_bytes(self.texel).saturating_mul(level.size[1] as usize);
                let _ = level.texels.try_reserve_exact(bytes);
            }
        }
        self.levels[0].texels.extend_from_slice(row);
        for number in 1..self.levels.len() {
            let (finer, coarser) = self.levels.split_at_mut(number);
            let (finer, coarser) = (&finer[number - 1], &mut coarser[0]);
            let (rows, height) = (finer.rows(self.texel), finer.size[1]);
            if rows % 2 == 1 && rows != height {
                return;
            }
            // The last of an odd number of rows is its own neighbour; that of columns has the first one beside it where they wrap.
            let (bytes, wide) = (finer.row_bytes(self.texel), 2 * coarser.row_bytes(self.texel));
            let lines = [rows - 1 - u32::from(rows % 2 == 0), rows - 1].map(|row| {
                let mut line = finer.texels[row as usize * bytes..][..bytes].to_vec();
                let beyond = if self.wraps { 0 } else { bytes - self.texel };
                line.extend_from_within(beyond..beyond + self.texel);
                line.truncate(wide);
                line
            });
            let start = coarser.texels.len();
            coarser.texels.resize(start + wide / 2, 0);
            self.filter.row(&mut coarser.texels[start..], &[&lines[0], &lines[1]]);
        }
    }
}

fn of_color(format: LayerFormat) -> Filter {
    Filter::new(LayerFilter::for_layer("color", format, true), format, 2)
}
