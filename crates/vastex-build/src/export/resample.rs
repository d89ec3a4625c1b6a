//! Rows of another size, for grids that cannot hold a texture's own.
//!
//! A tent as wide as the larger of both texels, along each axis. Colour is blended in linear light and weighted by
//! alpha, everything else as it is. What lies west of the first column is the last one: only planets are resampled.

use std::sync::LazyLock;

use rayon::prelude::*;
use vastex_core::LayerFormat;

use super::ExportError;
use super::level_rows::{RowSource, Window};

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

/// A run of texels and the weight of each; the weights' sum is 1.
struct Taps {
    first: i64,
    weights: Vec<f32>,
}

impl<'a> Resampled<'a> {
    pub(super) fn new(from: Window<'a>, format: LayerFormat, size: [u32; 2]) -> Resampled<'a> {
        let columns = (0..size[0]).map(|x| Taps::new(x, size[0], from.size()[0])).collect();
        Resampled { from, format, size, columns, next_row: 0 }
    }

    fn row(&self, taps: &Taps) -> Vec<u8> {
        let [width, height] = self.from.size().map(i64::from);
        let channels = channels(self.format);
        let mut blended = vec![0f32; width as usize * channels];
        for (y, weight) in (taps.first..).zip(&taps.weights) {
            let row = self.from.row(y.clamp(0, height - 1) as u32);
            accumulate(&mut blended, row, self.format, *weight);
        }
        let mut out = Vec::with_capacity(self.size[0] as usize * self.texel_bytes());
        for taps in &self.columns {
            let mut texel = [0f32; 4];
            for (x, weight) in (taps.first..).zip(&taps.weights) {
                let from = &blended[x.rem_euclid(width) as usize * channels..][..channels];
                texel.iter_mut().zip(from).for_each(|(sum, value)| *sum += weight * value);
            }
            encode(&mut out, texel, self.format);
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

    fn append(&mut self, rows: &mut Vec<u8>) -> Result<(), ExportError> {
        let height = self.from.size()[1];
        let end = self.size[1].min(self.next_row + BATCH);
        let taps: Vec<_> = (self.next_row..end).map(|y| Taps::new(y, self.size[1], height)).collect();
        let inside = |y: i64| y.clamp(0, i64::from(height) - 1) as u32;
        if let (Some(first), Some(last)) = (taps.first(), taps.last()) {
            let last = last.first + last.weights.len() as i64 - 1;
            self.from.hold(inside(first.first)..inside(last) + 1)?;
        }
        let made: Vec<_> = taps.par_iter().map(|taps| self.row(taps)).collect();
        made.iter().for_each(|row| rows.extend_from_slice(row));
        self.next_row = end;
        Ok(())
    }
}

impl Taps {
    /// For texel `at` of `to` texels, made of `from`.
    fn new(at: u32, to: u32, from: u32) -> Taps {
        let scale = f64::from(from) / f64::from(to);
        let (center, radius) = ((f64::from(at) + 0.5) * scale - 0.5, scale.max(1.0));
        let first = (center - radius).ceil() as i64;
        let last = (center + radius).floor() as i64;
        let weights: Vec<f64> =
            (first..=last).map(|i| (1.0 - (i as f64 - center).abs() / radius).max(0.0)).collect();
        let sum: f64 = weights.iter().sum();
        Taps { first, weights: weights.iter().map(|weight| (weight / sum) as f32).collect() }
    }
}

fn channels(format: LayerFormat) -> usize {
    match format {
        LayerFormat::R16 => 1,
        other => other.texel_bytes(),
    }
}

/// Adds a row, weighted. Colours come linear and multiplied by alpha.
fn accumulate(sum: &mut [f32], row: &[u8], format: LayerFormat, weight: f32) {
    match format {
        LayerFormat::R16 => {
            for (sum, sample) in sum.iter_mut().zip(row.as_chunks::<2>().0) {
                *sum += weight * f32::from(u16::from_le_bytes(*sample));
            }
        }
        LayerFormat::Rgba8 | LayerFormat::Rgba8Srgb => {
            let srgb = (format == LayerFormat::Rgba8Srgb).then(|| &*SRGB);
            for (sum, &[r, g, b, a]) in sum.as_chunks_mut::<4>().0.iter_mut().zip(row.as_chunks::<4>().0) {
                let alpha = weight * f32::from(a);
                for (sum, value) in sum.iter_mut().zip([r, g, b]) {
                    let linear =
                        srgb.map_or(f32::from(value) / 255.0, |srgb| srgb.linear[usize::from(value)]);
                    *sum += alpha * linear;
                }
                sum[3] += alpha;
            }
        }
        _ => {
            sum.iter_mut().zip(row).for_each(|(sum, value)| *sum += weight * f32::from(*value));
        }
    }
}

fn encode(out: &mut Vec<u8>, texel: [f32; 4], format: LayerFormat) {
    let byte = |value: f32| (value + 0.5) as u8;
    match format {
        LayerFormat::R16 => out.extend_from_slice(&((texel[0] + 0.5) as u16).to_le_bytes()),
        LayerFormat::R8 => out.push(byte(texel[0])),
        LayerFormat::Rgba8 | LayerFormat::Rgba8Srgb => {
            let alpha = texel[3];
            let color = |c: usize| {
                let linear = if alpha > 0.0 { texel[c] / alpha } else { 0.0 };
                match format {
                    LayerFormat::Rgba8Srgb => SRGB.encoded[(linear * 65535.0 + 0.5) as u16 as usize],
                    _ => byte(linear * 255.0),
                }
            };
            out.extend([color(0), color(1), color(2), byte(alpha)]);
        }
        _ => out.extend([byte(texel[0]), byte(texel[1])]),
    }
}

/// The transfer curve of sRGB: light of each of 256 values, and the value for each of 65,536 steps of light.
struct Srgb {
    linear: [f32; 256],
    encoded: Vec<u8>,
}

static SRGB: LazyLock<Srgb> = LazyLock::new(|| {
    let linear = |s: f64| if s <= 0.04045 { s / 12.92 } else { ((s + 0.055) / 1.055).powf(2.4) };
    let srgb = |l: f64| if l <= 0.003_130_8 { l * 12.92 } else { 1.055 * l.powf(1.0 / 2.4) - 0.055 };
    Srgb {
        linear: std::array::from_fn(|v| linear(v as f64 / 255.0) as f32),
        encoded: (0..=65535).map(|l| (srgb(f64::from(l) / 65535.0) * 255.0).round() as u8).collect(),
    }
});

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

        fn append(&mut self, rows: &mut Vec<u8>) -> Result<(), ExportError> {
            rows.append(&mut self.texels);
            Ok(())
        }
    }

    fn resampled(format: LayerFormat, from: [u32; 2], texels: Vec<u8>, to: [u32; 2]) -> Vec<u8> {
        let rows = Window::new(Box::new(Rows { size: from, format, texels }));
        let mut resampled = Resampled::new(rows, format, to);
        let mut out = Vec::new();
        while resampled.next_row < to[1] {
            resampled.append(&mut out).unwrap();
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
}
