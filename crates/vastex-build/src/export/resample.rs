//! Rows of another size, for grids that cannot hold a texture's own.
//!
//! Which texels make one, and with what weights, [`Taps`] say; how they are mixed, [`crate::texels::blend`].
//! What lies west of the first column is the last one: only planets are resampled. Only formats that tiles
//! can hold come here: integers of 8 and 16 bits.

use vastex_core::LayerFormat;

use super::ExportError;
use super::level_rows::{RowSource, Window, Work};
use crate::texels::blend::{add_weighted, append_sum};
use crate::texels::taps::Taps;
use crate::threads;

/// Rows that are made side by side.
const BATCH: u32 = 16;

/// A level, resampled from a stored one.
pub(super) struct Resampled<'a> {
    from: Window<'a>,
    format: LayerFormat,
    size: [u32; 2],
    /// For each column the columns that it is made of, with their weights.
    columns: Vec<Taps>,
    next_row: u32,
}

impl<'a> Resampled<'a> {
    pub(super) fn new(from: Window<'a>, format: LayerFormat, size: [u32; 2]) -> Resampled<'a> {
        let columns = (0..size[0]).map(|x| Taps::new(x, size[0], from.size()[0])).collect();
        Resampled { from, format, size, columns, next_row: 0 }
    }

    fn row(&self, taps: &Taps) -> Vec<u8> {
        let [width, height] = self.from.size().map(i64::from);
        let channels = self.format.channels();
        let mut blended = vec![0f32; width as usize * channels];
        for (y, weight) in (taps.first..).zip(&taps.weights) {
            let row = self.from.row(y.clamp(0, height - 1) as u32);
            add_weighted(&mut blended, row, self.format, *weight);
        }
        let mut out = Vec::with_capacity(self.size[0] as usize * self.texel_bytes());
        for taps in &self.columns {
            let mut texel = [0f32; 4];
            for (x, weight) in (taps.first..).zip(&taps.weights) {
                let from = &blended[x.rem_euclid(width) as usize * channels..][..channels];
                texel.iter_mut().zip(from).for_each(|(sum, value)| *sum += weight * value);
            }
            append_sum(&mut out, texel, self.format);
        }
        out
    }
}

impl RowSource for Resampled<'_> {
    fn size(&self) -> [u32; 2] {
        self.size
    }

    fn texel_bytes(&self) -> usize {
        self.format.texel_bytes()
    }

    fn append(&mut self, rows: &mut Vec<u8>, work: &Work<'_>) -> Result<(), ExportError> {
        let height = self.from.size()[1];
        let end = self.size[1].min(self.next_row + BATCH);
        let taps: Vec<_> = (self.next_row..end).map(|y| Taps::new(y, self.size[1], height)).collect();
        let inside = |y: i64| y.clamp(0, i64::from(height) - 1) as u32;
        if let (Some(first), Some(last)) = (taps.first(), taps.last()) {
            self.from.hold(inside(first.first)..inside(last.last()) + 1, work)?;
        }
        let made = work.pool.install(|| threads::map(&taps, 1, |taps| self.row(taps)));
        made.iter().for_each(|row| rows.extend_from_slice(row));
        self.next_row = end;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Rows {
        size: [u32; 2],
        format: LayerFormat,
        texels: Vec<u8>,
    }

    impl RowSource for Rows {
        fn size(&self) -> [u32; 2] {
            self.size
        }

        fn texel_bytes(&self) -> usize {
            self.format.texel_bytes()
        }

        fn append(&mut self, rows: &mut Vec<u8>, _: &Work<'_>) -> Result<(), ExportError> {
            rows.append(&mut self.texels);
            Ok(())
        }
    }

    fn resampled(format: LayerFormat, from: [u32; 2], texels: Vec<u8>, to: [u32; 2]) -> Vec<u8> {
        let rows = Window::new(Box::new(Rows { size: from, format, texels }));
        let mut resampled = Resampled::new(rows, format, to);
        let mut out = Vec::new();
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        while resampled.next_row < to[1] {
            resampled.append(&mut out, &Work { pool: &pool, go_on: &|| Ok(()) }).unwrap();
        }
        out
    }

    #[test]
    fn one_colour_stays_at_any_size() {
        for (format, texel) in [
            (LayerFormat::R8, &[77][..]),
            (LayerFormat::R16, &[0x34, 0x12]),
            (LayerFormat::Rgba8, &[1, 128, 255, 9]),
            (LayerFormat::Rgba8Srgb, &[3, 128, 250, 255]),
            (LayerFormat::Rg8, &[3, 250]),
            (LayerFormat::Rgba16, &[3, 0, 0x34, 0x12, 0xff, 0xff, 0x01, 0x80]),
        ] {
            for to in [[8, 4], [10, 7], [5, 40], [3, 2]] {
                let out = resampled(format, [7, 5], texel.repeat(35), to);
                assert_eq!(out, texel.repeat((to[0] * to[1]) as usize), "{format:?} {to:?}");
            }
        }
    }

    #[test]
    fn a_slope_stays_a_slope_and_the_globe_is_round() {
        // West to east 0, 100, 200, 100: between the last and the first lies their mean.
        let out = resampled(LayerFormat::R8, [4, 1], vec![0, 100, 200, 100], [8, 1]);
        assert_eq!(out, [25, 25, 75, 125, 175, 175, 125, 75]);
    }

    #[test]
    fn colour_is_blended_as_light_and_by_alpha() {
        let (black, white) = ([0, 0, 0, 255], [255; 4]);
        let out = resampled(LayerFormat::Rgba8Srgb, [2, 1], [black, white].concat(), [1, 1]);
        assert_eq!(out, [188, 188, 188, 255]);
        let out = resampled(LayerFormat::Rgba8, [2, 1], [[200, 0, 0, 255], [0, 99, 0, 0]].concat(), [1, 1]);
        assert_eq!(out, [200, 0, 0, 128]);
    }

    #[test]
    fn sixteen_bits_are_blended_as_they_are_and_by_alpha() {
        let words = |texels: &[[u16; 4]]| {
            texels.as_flattened().iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>()
        };
        let out = resampled(LayerFormat::Rgba16, [2, 1], words(&[[0, 0, 0, 65535], [65535; 4]]), [1, 1]);
        assert_eq!(out, words(&[[32768, 32768, 32768, 65535]]));
        let texels = words(&[[50_001, 7, 0, 65535], [0, 9000, 0, 0]]);
        let out = resampled(LayerFormat::Rgba16, [2, 1], texels, [1, 1]);
        assert_eq!(out, words(&[[50_001, 7, 0, 32768]]));
    }
}
