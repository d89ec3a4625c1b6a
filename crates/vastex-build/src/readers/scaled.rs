//! An image in another size: for layers of a texture whose images do not fit one another.
//!
//! A tent as wide as the larger of both texels, along rows first, so that what is held are rows of the new width. Colours are
//! mixed as light and weighted by alpha; all else as it is.

use std::collections::VecDeque;

use half::f16;

use super::ahead::Helpers;
use super::{ImageHeader, RowReader, Sample};
use crate::error::InputFault;
use crate::notice::Notice;
use crate::srgb::{linear_from_srgb, srgb_from_linear};
use crate::tent::Taps;

/// Added to alpha as a weight, so that colours of what is transparent count where nothing else is there.
const LEAST_WEIGHT: f32 = 1.0 / (1 << 20) as f32;

/// An image, resampled.
pub(crate) struct Scaled {
    inner: Box<dyn RowReader>,
    header: ImageHeader,
    mix: Mix,
    /// For each column those of the image that it is made of.
    columns: Vec<Taps>,
    /// Rows of the image in the new width, ready to be mixed; the first is row `first`.
    rows: VecDeque<Vec<f32>>,
    first: u32,
    stored: Vec<u8>,
    next_row: u32,
    /// Notices of `inner` that are among the own ones.
    seen: usize,
}

/// What is done to texels before they are mixed, and after.
#[derive(Clone, Copy, Debug)]
struct Mix {
    sample: Sample,
    channels: usize,
    /// Whether colours are sRGB-encoded.
    is_encoded: bool,
    is_weighted: bool,
}

impl Scaled {
    /// `inner` in the size `to`, which is a texture's, divided by `scale`. Where it `wraps`, the first column follows the last.
    pub(crate) fn new(
        inner: Box<dyn RowReader>,
        to: [u32; 2],
        scale: u32,
        is_color: bool,
        wraps: bool,
    ) -> Scaled {
        let mut header = inner.header().clone();
        let (from, format) = ([header.width, header.height], header.format);
        let mix = Mix {
            sample: format.sample(),
            channels: format.channels().into(),
            is_encoded: is_color && !header.linear && !format.sample().is_float(),
            is_weighted: is_color && format.has_alpha(),
        };
        [header.width, header.height] = to;
        header.notices.push(Notice::LayerResampled { from, to, scale });
        let columns: Vec<Taps> =
            (0..to[0]).map(|x| wrapped(Taps::new(x, to[0], from[0]), from[0], wraps)).collect();
        let held = 2 * u64::from(from[1].div_ceil(to[1])) + 2;
        let row = u64::from(to[0]) * (4 * mix.channels as u64);
        let taps: u64 = columns.iter().map(|taps| 4 * taps.weights.len() as u64 + 40).sum();
        let own = (held + 1) * row + taps + inner.header().row_bytes() as u64;
        header.memory = header.memory.saturating_add(own);
        let seen = inner.header().notices.len();
        let (rows, stored) = (VecDeque::new(), vec![0; inner.header().row_bytes()]);
        Scaled { inner, header, mix, columns, rows, first: 0, stored, next_row: 0, seen }
    }

    /// Reads the image's rows up to `last`, and forgets those before `first`.
    fn hold(&mut self, first: u32, last: u32) -> Result<(), InputFault> {
        while self.first + (self.rows.len() as u32) <= last {
            self.inner.read_rows(&mut self.stored)?;
            self.header.add_notices_of(self.inner.header(), &mut self.seen);
            let row = self.narrowed();
            self.rows.push_back(row);
            self.forget_before(first);
        }
        self.forget_before(first);
        Ok(())
    }

    fn forget_before(&mut self, first: u32) {
        while self.first < first && self.rows.pop_front().is_some() {
            self.first += 1;
        }
    }

    /// The row that was read, in the new width.
    fn narrowed(&self) -> Vec<f32> {
        let channels = self.mix.channels;
        let mut values = vec![0.0; self.stored.len() / self.mix.sample.bytes()];
        self.mix.prepare(&self.stored, &mut values);
        let width = values.len() / channels;
        let mut row = vec![0.0; self.columns.len() * channels];
        for (to, taps) in row.chunks_exact_mut(channels).zip(&self.columns) {
            for (x, weight) in taps.iter() {
                // Beyond an edge that does not wrap its texel goes on; one that does was made to lie inside.
                let x = x.rem_euclid(width as i64) as usize;
                let from = &values[x * channels..][..channels];
                to.iter_mut().zip(from).for_each(|(sum, value)| *sum += weight * value);
            }
        }
        row
    }
}

/// Taps whose texels lie inside, if the edge does not wrap: those beyond it count as the last.
fn wrapped(taps: Taps, width: u32, wraps: bool) -> Taps {
    let last = i64::from(width) - 1;
    if wraps || (taps.first >= 0 && taps.last() <= last) {
        return taps;
    }
    let first = taps.first.clamp(0, last);
    let mut weights = vec![0.0; (taps.last().clamp(0, last) - first + 1) as usize];
    for (x, weight) in taps.iter() {
        weights[(x.clamp(0, last) - first) as usize] += weight;
    }
    Taps { first, weights }
}

impl RowReader for Scaled {
    fn header(&self) -> &ImageHeader {
        &self.header
    }

    fn tolerate(&mut self) {
        self.inner.tolerate();
    }

    fn memory_ahead(&self, pieces: usize) -> u64 {
        self.inner.memory_ahead(pieces)
    }

    fn take_help(&mut self, helpers: &Helpers) {
        self.inner.take_help(helpers);
    }

    fn read_rows(&mut self, rows: &mut [u8]) -> Result<(), InputFault> {
        let (from, to) = (self.inner.header().height, self.header.height);
        let last_of = |y: i64| y.clamp(0, i64::from(from) - 1) as u32;
        let mut sum = Vec::new();
        for row in rows.chunks_exact_mut(self.header.row_bytes()) {
            let taps = Taps::new(self.next_row, to, from);
            self.hold(last_of(taps.first), last_of(taps.last()))?;
            sum.clear();
            sum.resize(self.columns.len() * self.mix.channels, 0.0);
            for (y, weight) in taps.iter() {
                let from = &self.rows[(last_of(y) - self.first) as usize];
                sum.iter_mut().zip(from).for_each(|(sum, value)| *sum += weight * value);
            }
            self.mix.finish(&mut sum, row);
            self.next_row += 1;
        }
        // The image is whole only when its last row is read.
        if self.next_row == to {
            self.hold(from - 1, from - 1)?;
        }
        Ok(())
    }
}

impl Mix {
    /// Channels that are colours.
    fn colors(self) -> usize {
        self.channels - usize::from(self.channels.is_multiple_of(2))
    }

    fn prepare(self, stored: &[u8], values: &mut [f32]) {
        match self.sample {
            Sample::U8 => values.iter_mut().zip(stored).for_each(|(to, v)| *to = f32::from(*v) / 255.0),
            Sample::U16 => each(values, stored, |v| f32::from(u16::from_le_bytes(v)) / 65535.0),
            Sample::F16 => each(values, stored, |v| finite(f16::from_le_bytes(v).to_f32())),
            Sample::F32 => each(values, stored, |v| finite(f32::from_le_bytes(v))),
        }
        let colors = self.colors();
        if !self.is_encoded && !self.is_weighted {
            return;
        }
        for texel in values.chunks_exact_mut(self.channels) {
            let weight =
                if self.is_weighted { texel[self.channels - 1].max(0.0) + LEAST_WEIGHT } else { 1.0 };
            for color in &mut texel[..colors] {
                *color = weight * if self.is_encoded { linear_from_srgb(*color) } else { *color };
            }
        }
    }

    fn finish(self, values: &mut [f32], row: &mut [u8]) {
        let colors = self.colors();
        for texel in values.chunks_exact_mut(self.channels) {
            let weight =
                if self.is_weighted { texel[self.channels - 1].max(0.0) + LEAST_WEIGHT } else { 1.0 };
            for color in &mut texel[..colors] {
                let light = *color / weight;
                *color = if self.is_encoded { srgb_from_linear(light) } else { light };
            }
        }
        let whole = |v: f32, most: f32| (v.clamp(0.0, 1.0) * most + 0.5) as u16;
        match self.sample {
            Sample::U8 => row.iter_mut().zip(values).for_each(|(to, v)| *to = whole(*v, 255.0) as u8),
            Sample::U16 => each_back(row, values, |v| whole(v, 65535.0).to_le_bytes()),
            Sample::F16 => each_back(row, values, |v| f16::from_f32(v).to_le_bytes()),
            Sample::F32 => each_back(row, values, f32::to_le_bytes),
        }
    }
}

/// What is no number counts as 0, what is infinite as the largest number, so that one bad texel does not spread.
fn finite(value: f32) -> f32 {
    if value.is_nan() { 0.0 } else { value.clamp(f32::MIN, f32::MAX) }
}

fn each<const B: usize>(values: &mut [f32], row: &[u8], decode: impl Fn([u8; B]) -> f32) {
    values.iter_mut().zip(row.as_chunks::<B>().0).for_each(|(to, &from)| *to = decode(from));
}

fn each_back<const B: usize>(row: &mut [u8], values: &[f32], encode: impl Fn(f32) -> [u8; B]) {
    row.as_chunks_mut::<B>().0.iter_mut().zip(values).for_each(|(to, &from)| *to = encode(from));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::readers::PixelFormat;

    struct Rows {
        header: ImageHeader,
        texels: Vec<u8>,
        at: usize,
    }

    impl RowReader for Rows {
        fn header(&self) -> &ImageHeader {
            &self.header
        }

        fn read_rows(&mut self, rows: &mut [u8]) -> Result<(), InputFault> {
            rows.copy_from_slice(&self.texels[self.at..self.at + rows.len()]);
            self.at += rows.len();
            Ok(())
        }
    }

    fn scaled(
        format: PixelFormat,
        from: [u32; 2],
        to: [u32; 2],
        is_color: bool,
        wraps: bool,
        texels: &[u8],
    ) -> Vec<u8> {
        let header = ImageHeader::new(from[0].into(), from[1].into(), format).unwrap();
        let rows = Rows { header, texels: texels.to_vec(), at: 0 };
        let mut scaled = Scaled::new(Box::new(rows), to, 1, is_color, wraps);
        let row = scaled.header().row_bytes();
        let mut out = vec![0; row * to[1] as usize];
        out.chunks_mut(3 * row).for_each(|rows| scaled.read_rows(rows).unwrap());
        out
    }

    #[test]
    fn one_colour_stays_at_any_size() {
        for (format, texel) in [
            (PixelFormat::GREY8, &[77][..]),
            (PixelFormat::RGB8, &[1, 128, 250]),
            (PixelFormat::RGBA8, &[3, 128, 250, 9]),
            (PixelFormat::GREY16, &[0x34, 0x12]),
        ] {
            for to in [[14, 10], [7, 3], [3, 9], [1, 1], [40, 41]] {
                for (is_color, wraps) in [(false, false), (true, true)] {
                    // Light has 16 bits, of which dark colours of 16 bits need more.
                    let is_color = is_color && format.sample() == Sample::U8;
                    let out = scaled(format, [7, 5], to, is_color, wraps, &texel.repeat(35));
                    assert_eq!(out, texel.repeat((to[0] * to[1]) as usize), "{format} {to:?} {is_color}");
                }
            }
        }
    }

    #[test]
    fn edges_go_on_or_wrap_and_colours_are_light() {
        let grey = |wraps| scaled(PixelFormat::GREY8, [4, 1], [8, 1], false, wraps, &[0, 100, 200, 100]);
        assert_eq!(grey(true), [25, 25, 75, 125, 175, 175, 125, 75]);
        assert_eq!(grey(false), [0, 25, 75, 125, 175, 175, 125, 100]);
        let black_and_white = [[0; 3], [255; 3]].concat();
        assert_eq!(scaled(PixelFormat::RGB8, [2, 1], [1, 1], true, false, &black_and_white), [188; 3]);
        assert_eq!(scaled(PixelFormat::RGB8, [2, 1], [1, 1], false, false, &black_and_white), [128; 3]);
        let half_clear = [[200, 0, 0, 255], [0, 99, 0, 0]].concat();
        let out = scaled(PixelFormat::RGBA8, [2, 1], [1, 1], true, false, &half_clear);
        assert_eq!(out, [200, 0, 0, 128]);
    }
}
