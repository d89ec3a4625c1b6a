//! The levels of an image in memory, which grow row by row: each pair of rows makes one of the next coarser
//! level.

use vastex_core::{Layer, LayerFormat, NodataValue};

use crate::texels::filter::{Filter, LayerFilter};

/// Levels as far as they are there.
pub(super) struct Levels {
    levels: Vec<Level>,
    filter: Filter,
    texel: usize,
    /// True if the first column is the last one's neighbour.
    wraps: bool,
    /// True if rows that are not there yet repeat the last one.
    repeats: bool,
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
    pub(super) fn new(sizes: Vec<[u32; 2]>, layer: &Layer, wraps: bool) -> Levels {
        let levels = sizes.into_iter().map(|size| Level { size, texels: Vec::new() }).collect();
        Levels {
            levels,
            filter: of_color(layer.format, layer.nodata),
            texel: layer.format.texel_bytes(),
            wraps,
            repeats: !matches!(layer.format.channels(), 2 | 4),
        }
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

    /// The same, or the last row that is there of a level without an alpha.
    pub(super) fn row_or_last(&self, level: u8, row: u32) -> Option<&[u8]> {
        let last = || {
            let rows = self.levels.get(usize::from(level))?.rows(self.texel);
            self.row(level, rows.checked_sub(1).filter(|_| self.repeats)?)
        };
        self.row(level, row).or_else(last)
    }

    /// Adds the next row of level 0, and the rows of coarser levels that it completes.
    pub(super) fn push(&mut self, row: &[u8]) {
        if self.levels[0].texels.is_empty() {
            // At once, so that nothing is copied as they grow; the system gives memory as it is written to.
            // Where it promises less, levels grow as rows come.
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
            // The last of an odd number of rows is its own neighbour; that of columns has the first one
            // beside it where they wrap.
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

/// What halves an image's rows, as a build does by default.
pub(super) fn of_color(format: LayerFormat, nodata: Option<NodataValue>) -> Filter {
    Filter::new(LayerFilter { nodata, ..LayerFilter::for_layer("color", format, true) }, format, 2)
}

#[cfg(test)]
mod tests {
    use pollster::block_on;
    use vastex_core::{AddressMode, fold};
    use vastex_tiles::{ImageOptions, ImageSource, Reduction, TileSource};

    use super::*;

    /// Bytes of all kinds: opaque and transparent, alike and not, numbers and none.
    fn noise(bytes: usize) -> Vec<u8> {
        let mut state = 11u32;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 24) as u8
        };
        let mut pixels: Vec<u8> = (0..bytes).map(|_| next()).collect();
        for alpha in pixels.iter_mut().skip(3).step_by(4) {
            *alpha = [*alpha, 255, 0, 255][usize::from(*alpha) % 4];
        }
        pixels
    }

    #[test]
    fn pixels_in_memory_have_the_levels_that_a_build_makes_of_them() {
        let (size, mut seen) = ([301u32, 157], 0);
        let formats = LayerFormat::ALL.into_iter().filter(|format| !format.is_compressed());
        for format in formats {
            for (wraps, reduction) in
                [(false, Reduction::usual(format)), (true, Reduction::Values), (true, Reduction::Labels)]
            {
                let filter = match reduction {
                    Reduction::Color => LayerFilter::for_layer("color", format, true),
                    Reduction::Values => LayerFilter::for_layer("height", format, true),
                    Reduction::Labels => LayerFilter::for_layer("labels", format, true),
                };
                let texel = format.texel_bytes();
                let pixels = noise(size[0] as usize * size[1] as usize * texel);
                let x = if wraps { AddressMode::Wrap } else { AddressMode::Clamp };
                let options = ImageOptions {
                    address: [x, AddressMode::Clamp],
                    reduction: Some(reduction),
                    page: 64,
                    ..ImageOptions::default()
                };
                let source = ImageSource::new(format, size, pixels.clone(), &options).unwrap();
                let geometry = &source.description().geometry;
                let sizes = geometry.levels().iter().map(|level| [level.size[0], level.size[1]]).collect();
                let layer = Layer::new("color", format);
                let mut levels =
                    Levels { filter: Filter::new(filter, format, 2), ..Levels::new(sizes, &layer, wraps) };
                pixels.chunks_exact(size[0] as usize * texel).for_each(|row| levels.push(row));
                for pos in geometry.pages() {
                    let tile = block_on(source.read(pos)).unwrap().bytes;
                    for (level, level_box, offset) in geometry.tile_boxes(pos) {
                        let [width, height, _] = geometry.level(level).size;
                        for (row, column) in (0..level_box.size[1])
                            .flat_map(|row| (0..level_box.size[0]).map(move |column| (row, column)))
                        {
                            let at = |n: usize, by: u32| level_box.origin[n] + i64::from(by);
                            let (x, y) =
                                (fold(x, at(0, column), width), fold(AddressMode::Clamp, at(1, row), height));
                            let expected = &levels.row(level, y).unwrap()[x as usize * texel..][..texel];
                            let place = (offset[1] + row) as usize * geometry.tile()[0] as usize
                                + (offset[0] + column) as usize;
                            let read = &tile[place * texel..][..texel];
                            assert_eq!(
                                read, expected,
                                "{format:?} {reduction:?}: {pos}, level {level}, texel {x},{y}"
                            );
                            seen += u32::from(level > 0);
                        }
                    }
                }
            }
        }
        assert!(seen > 100_000, "{seen}");
    }
}
