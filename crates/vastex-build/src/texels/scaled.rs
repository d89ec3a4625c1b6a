//! An image in another size: for layers of a texture whose images do not fit one another.
//!
//! A tent as wide as the larger of both texels, along rows first, so that what is held are rows of the new
//! width. [`Blend`] says what mixing means for a layer: for labels, say, nothing, and then each texel is the
//! nearest one.

use std::collections::VecDeque;
use std::sync::Arc;

use half::f16;

use super::filter::{LEAST_WEIGHT, unit};
use super::srgb::{linear_from_srgb, srgb_from_linear};
use super::taps::Taps;
use super::texel::{each, each_back, finite, whole};
use crate::image::{Beginning, Helpers, ImageHeader, InputFault, Notice, RowReader, Sample};

/// How texels of a layer are mixed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Blend {
    /// As they are stored.
    Stored,
    /// As light, weighted by alpha.
    Color,
    /// As vectors, which are made as long as one again.
    Normal,
    /// Not mixed: each texel is the nearest one of the image.
    Pick,
}

/// An image, resampled.
pub(crate) struct Scaled {
    inner: Box<dyn RowReader>,
    header: ImageHeader,
    mix: Mix,
    /// The taps of a new texel: its number along an axis, the number of new texels there, and that of the
    /// image's.
    taps: fn(u32, u32, u32) -> Taps,
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
    /// Numbers that are mixed for a texel.
    mixed: usize,
    /// True if colours are sRGB-encoded.
    is_encoded: bool,
    is_weighted: bool,
    is_normal: bool,
    /// The length of a vector of length 1, where it is stored as signed numbers.
    unit: f32,
}

impl Scaled {
    /// `inner` in the size `to`, which is a texture's, divided by `scale`. Where it `wraps`, the first column
    /// follows the last.
    pub(crate) fn new(
        inner: Box<dyn RowReader>,
        to: [u32; 2],
        scale: u32,
        blend: Blend,
        wraps: bool,
    ) -> Scaled {
        let mut header = inner.header().clone();
        let (from, format) = ([header.width, header.height], header.format);
        let (is_color, is_normal) = (blend == Blend::Color, blend == Blend::Normal && format.channels() > 1);
        let mix = Mix {
            sample: format.sample(),
            channels: format.channels().into(),
            // The third channel of vectors is mixed even where it is not stored.
            mixed: usize::from(format.channels()).max(if is_normal { 3 } else { 1 }),
            is_encoded: is_color && !header.linear && !format.sample().is_float(),
            is_weighted: is_color && format.has_alpha(),
            is_normal,
            unit: header.range.map_or(1.0, |[_, most]| most as f32),
        };
        [header.width, header.height] = to;
        header.notices.push(Notice::LayerResampled { from, to, scale });
        let taps = if blend == Blend::Pick { Taps::nearest } else { Taps::new };
        let columns: Vec<Taps> =
            (0..to[0]).map(|x| wrapped(taps(x, to[0], from[0]), from[0], wraps)).collect();
        let held = 2 * u64::from(from[1].div_ceil(to[1])) + 2;
        let row = u64::from(to[0]) * (4 * mix.mixed as u64);
        let of_columns: u64 = columns.iter().map(|taps| 4 * taps.weights.len() as u64 + 40).sum();
        // A row as it is stored, and as numbers.
        let read = inner.header().row_bytes() as u64 + 8 * u64::from(from[0]) * mix.mixed as u64;
        let own = (held + 1) * row + of_columns + read;
        header.memory = header.memory.saturating_add(own);
        let seen = inner.header().notices.len();
        let (rows, stored) = (VecDeque::new(), vec![0; inner.header().row_bytes()]);
        Scaled { inner, header, mix, taps, columns, rows, first: 0, stored, next_row: 0, seen }
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
        let channels = self.mix.mixed;
        let texel = self.mix.channels * self.mix.sample.bytes();
        let mut values = vec![0.0; self.stored.len() / texel * channels];
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

    fn beginning(&self) -> Option<Arc<Beginning>> {
        self.inner.beginning()
    }

    fn read_rows(&mut self, rows: &mut [u8]) -> Result<(), InputFault> {
        let (from, to) = (self.inner.header().height, self.header.height);
        let last_of = |y: i64| y.clamp(0, i64::from(from) - 1) as u32;
        let mut sum = Vec::new();
        for row in rows.chunks_exact_mut(self.header.row_bytes()) {
            let taps = (self.taps)(self.next_row, to, from);
            self.hold(last_of(taps.first), last_of(taps.last()))?;
            sum.clear();
            sum.resize(self.columns.len() * self.mix.mixed, 0.0);
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
        if self.mixed == self.channels {
            self.decode(stored, values);
        } else {
            let mut narrow = vec![0.0; values.len() / self.mixed * self.channels];
            self.decode(stored, &mut narrow);
            let texels = values.chunks_exact_mut(self.mixed).zip(narrow.chunks_exact(self.channels));
            texels.for_each(|(to, from)| to[..self.channels].copy_from_slice(from));
        }
        let colors = self.colors();
        if self.is_normal {
            values.chunks_exact_mut(self.mixed).for_each(|texel| self.make_vector(texel));
        } else if self.is_encoded || self.is_weighted {
            for texel in values.chunks_exact_mut(self.channels) {
                let weight = self.weight(texel);
                for color in &mut texel[..colors] {
                    *color = weight * if self.is_encoded { linear_from_srgb(*color) } else { *color };
                }
            }
        }
    }

    fn finish(self, values: &mut [f32], row: &mut [u8]) {
        let colors = self.colors();
        if self.is_normal {
            values.chunks_exact_mut(self.mixed).for_each(|texel| self.unmake_vector(texel));
        } else if self.is_encoded || self.is_weighted {
            for texel in values.chunks_exact_mut(self.channels) {
                let weight = self.weight(texel);
                for color in &mut texel[..colors] {
                    let light = *color / weight;
                    *color = if self.is_encoded { srgb_from_linear(light) } else { light };
                }
            }
        }
        let texel = self.channels * self.sample.bytes();
        if self.mixed == self.channels {
            return self.encode(values, row);
        }
        for (to, from) in row.chunks_exact_mut(texel).zip(values.chunks_exact(self.mixed)) {
            self.encode(&from[..self.channels], to);
        }
    }

    fn weight(self, texel: &[f32]) -> f32 {
        if self.is_weighted { texel[self.channels - 1].max(0.0) + LEAST_WEIGHT } else { 1.0 }
    }

    /// The vector that a texel stands for: whole numbers of 0 to 1 are -1 to 1, of two channels the third is
    /// found.
    fn make_vector(self, texel: &mut [f32]) {
        let vector = |value: f32| if self.sample.is_float() { value / self.unit } else { 2.0 * value - 1.0 };
        let stored = self.channels.min(3);
        texel[..stored].iter_mut().for_each(|value| *value = vector(*value));
        if stored < 3 {
            texel[2] = (1.0 - texel[0] * texel[0] - texel[1] * texel[1]).max(0.0).sqrt();
        }
    }

    fn unmake_vector(self, texel: &mut [f32]) {
        let stored = |value: f32| if self.sample.is_float() { value * self.unit } else { 0.5 * value + 0.5 };
        let vector = unit([texel[0], texel[1], texel[2]]).map(stored);
        texel[..3].copy_from_slice(&vector);
    }

    fn decode(self, stored: &[u8], values: &mut [f32]) {
        match self.sample {
            Sample::U8 => values.iter_mut().zip(stored).for_each(|(to, v)| *to = f32::from(*v) / 255.0),
            Sample::U16 => each(values, stored, |v| f32::from(u16::from_le_bytes(v)) / 65535.0),
            Sample::F16 => each(values, stored, |v| finite(f16::from_le_bytes(v).to_f32(), f32::MAX)),
            Sample::F32 => each(values, stored, |v| finite(f32::from_le_bytes(v), f32::MAX)),
        }
    }

    fn encode(self, values: &[f32], row: &mut [u8]) {
        match self.sample {
            Sample::U8 => row.iter_mut().zip(values).for_each(|(to, v)| *to = whole(*v, 255.0) as u8),
            Sample::U16 => each_back(row, values, |v| whole(v, 65535.0).to_le_bytes()),
            Sample::F16 => each_back(row, values, |v| f16::from_f32(v).to_le_bytes()),
            Sample::F32 => each_back(row, values, f32::to_le_bytes),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::PixelFormat;

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
        blend: Blend,
        wraps: bool,
        texels: &[u8],
    ) -> Vec<u8> {
        let header = ImageHeader::new(from[0].into(), from[1].into(), format).unwrap();
        let rows = Rows { header, texels: texels.to_vec(), at: 0 };
        let mut scaled = Scaled::new(Box::new(rows), to, 1, blend, wraps);
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
                    let blend = if is_color { Blend::Color } else { Blend::Stored };
                    for blend in [blend, Blend::Pick] {
                        let out = scaled(format, [7, 5], to, blend, wraps, &texel.repeat(35));
                        assert_eq!(out, texel.repeat((to[0] * to[1]) as usize), "{format} {to:?} {blend:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn edges_go_on_or_wrap_and_colours_are_light() {
        let grey =
            |wraps| scaled(PixelFormat::GREY8, [4, 1], [8, 1], Blend::Stored, wraps, &[0, 100, 200, 100]);
        assert_eq!(grey(true), [25, 25, 75, 125, 175, 175, 125, 75]);
        assert_eq!(grey(false), [0, 25, 75, 125, 175, 175, 125, 100]);
        let black_and_white = [[0; 3], [255; 3]].concat();
        assert_eq!(
            scaled(PixelFormat::RGB8, [2, 1], [1, 1], Blend::Color, false, &black_and_white),
            [188; 3]
        );
        assert_eq!(
            scaled(PixelFormat::RGB8, [2, 1], [1, 1], Blend::Stored, false, &black_and_white),
            [128; 3]
        );
        let half_clear = [[200, 0, 0, 255], [0, 99, 0, 0]].concat();
        let out = scaled(PixelFormat::RGBA8, [2, 1], [1, 1], Blend::Color, false, &half_clear);
        assert_eq!(out, [200, 0, 0, 128]);
    }

    #[test]
    fn vectors_stay_as_long_as_they_are() {
        // To the right and up, at right angles: their mean is shorter than both.
        let stored = |v: [f32; 3]| v.map(|c| (127.5 * c + 128.0) as u8);
        let two = [stored([1.0, 0.0, 0.0]), stored([0.0, 0.0, 1.0])].concat();
        let between = stored([0.5f32.sqrt(), 0.0, 0.5f32.sqrt()]);
        let out = scaled(PixelFormat::RGB8, [2, 1], [1, 1], Blend::Normal, false, &two);
        assert!(out.iter().zip(between).all(|(a, b)| a.abs_diff(b) <= 1), "{out:?} {between:?}");
        // Of two channels the third is found, and counts.
        let two = [&two[..2], &two[3..5]].concat();
        let out = scaled(PixelFormat::GREY_ALPHA8, [2, 1], [1, 1], Blend::Normal, false, &two);
        assert!(out.iter().zip(between).all(|(a, b)| a.abs_diff(b) <= 1), "{out:?} {between:?}");
        let floats = PixelFormat::RGB8.with_sample(Sample::F32);
        let two: Vec<u8> = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0f32].iter().flat_map(|v| v.to_le_bytes()).collect();
        let out = scaled(floats, [2, 1], [1, 1], Blend::Normal, false, &two);
        let half = 0.5f32.sqrt();
        let near = |(bytes, to): (&[u8; 4], f32)| (f32::from_le_bytes(*bytes) - to).abs() < 1e-6;
        assert!(out.as_chunks::<4>().0.iter().zip([half, half, 0.0]).all(near), "{out:?}");
    }

    #[test]
    fn what_is_not_mixed_is_picked() {
        let labels = [3, 200, 7, 90];
        let pick = |to, texels: &[u8]| scaled(PixelFormat::GREY8, [4, 1], [to, 1], Blend::Pick, true, texels);
        assert_eq!(pick(8, &labels), [3, 3, 200, 200, 7, 7, 90, 90]);
        assert_eq!(pick(2, &labels), [200, 90]);
        assert!(pick(7, &labels).iter().all(|label| labels.contains(label)));
    }
}
