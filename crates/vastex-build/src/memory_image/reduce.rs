//! An image's rows made fewer and shorter, as texels of the layer: of each square of texels four are taken,
//! and their mean is what stands for all. That is cheap enough to be done beside a build, on the thread that
//! reads.

use super::levels::of_color;
use crate::image::ImageHeader;
use crate::texels::convert::Conversion;
use crate::texels::filter::Filter;

/// From rows of the image to rows of level 0.
pub(super) struct RowReducer {
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

impl RowReducer {
    pub(super) fn new(header: &ImageHeader, halvings: u32) -> RowReducer {
        let (conversion, factor) = (Conversion::usual(header), 1u32 << halvings);
        let format = conversion.layer();
        RowReducer {
            filter: of_color(format, header.nodata.and_then(|value| conversion.nodata(value))),
            conversion,
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

    /// Rows of the image that were taken.
    pub(super) fn taken(&self) -> u32 {
        self.next
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
