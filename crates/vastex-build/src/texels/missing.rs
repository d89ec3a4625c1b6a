//! Which texels are without data, in rows of images and of layers: those whose colours all have one value,
//! and among floats those that are no numbers.
//!
//! What has data and comes out as that value when it is mixed or converted is moved by the least that the
//! format can tell.

use half::f16;
use vastex_core::{LayerFormat, NodataValue};

use crate::image::{PixelFormat, Sample};

/// How texels without data look in one format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Missing {
    sample: Sample,
    /// Samples of a texel, and how many of them, the first ones, are colours.
    channels: usize,
    colors: usize,
    value: NodataValue,
}

impl Missing {
    /// In a layer of a format, decoded where it is compressed.
    pub(crate) fn of_layer(format: LayerFormat, value: NodataValue) -> Missing {
        use LayerFormat::{R16, R16Float, R32Float, Rgba16, Rgba16Float};
        let format = format.decoded();
        let sample = match format {
            R16 | Rgba16 => Sample::U16,
            R16Float | Rgba16Float => Sample::F16,
            R32Float => Sample::F32,
            _ => Sample::U8,
        };
        Missing::of(sample, format.channels(), value)
    }

    /// In the rows of an image.
    pub(crate) fn of_image(format: PixelFormat, value: NodataValue) -> Missing {
        Missing::of(format.sample(), format.channels().into(), value)
    }

    fn of(sample: Sample, channels: usize, value: NodataValue) -> Missing {
        // Two are grey and alpha, four have alpha.
        let colors = if channels < 3 { 1 } else { 3 };
        Missing { sample, channels, colors, value }
    }

    /// What each channel is.
    pub(crate) fn sample(&self) -> Sample {
        self.sample
    }

    /// Bytes of a texel.
    pub(crate) fn texel_bytes(&self) -> usize {
        self.channels * self.sample.bytes()
    }

    /// Returns true if a texel is without data.
    pub(crate) fn is(&self, texel: &[u8]) -> bool {
        let value = self.value.value();
        let is_missing = |sample: f32| sample == value || sample.is_nan();
        let bytes = self.sample.bytes();
        texel.chunks_exact(bytes).take(self.colors).all(|sample| is_missing(number(sample, self.sample)))
    }

    /// Makes a texel one without data, opaque.
    pub(crate) fn write(&self, texel: &mut [u8]) {
        for (channel, to) in texel.chunks_exact_mut(self.sample.bytes()).enumerate() {
            match channel < self.colors {
                true => store(to, self.value.value(), self.sample),
                false => to.copy_from_slice(self.sample.one()),
            }
        }
    }

    /// Moves a texel that has data and looks as if it had none by the least that can be told.
    pub(crate) fn step_off(&self, texel: &mut [u8]) {
        if !self.is(texel) {
            return;
        }
        let first = &mut texel[..self.sample.bytes()];
        let value = number(first, self.sample);
        let other = match self.sample {
            Sample::U8 if value >= 255.0 => 254.0,
            Sample::U16 if value >= 65535.0 => 65534.0,
            Sample::U8 | Sample::U16 => value + 1.0,
            Sample::F16 => f16_beside(value),
            Sample::F32 => {
                if value < f32::MAX {
                    value.next_up()
                } else {
                    value.next_down()
                }
            }
        };
        store(first, other, self.sample);
    }
}

/// The next larger half float, or the next smaller one of the largest.
fn f16_beside(value: f32) -> f32 {
    let half = f16::from_f32(value);
    let bits = match half {
        _ if half == f16::ZERO => 1,
        _ if half >= f16::MAX => half.to_bits() - 1,
        _ if half.is_sign_negative() => half.to_bits() - 1,
        _ => half.to_bits() + 1,
    };
    f16::from_bits(bits).to_f32()
}

/// A sample as a number: whole ones as they are stored.
pub(crate) fn number(bytes: &[u8], sample: Sample) -> f32 {
    match (sample, bytes) {
        (Sample::U16, &[a, b]) => u16::from_le_bytes([a, b]).into(),
        (Sample::F16, &[a, b]) => f16::from_le_bytes([a, b]).to_f32(),
        (Sample::F32, &[a, b, c, d]) => f32::from_le_bytes([a, b, c, d]),
        (_, bytes) => bytes.first().map_or(0.0, |&byte| byte.into()),
    }
}

/// Stores a value as a sample; whole numbers are rounded.
pub(crate) fn store(to: &mut [u8], value: f32, sample: Sample) {
    match sample {
        Sample::U8 => to[0] = value.round() as u8,
        Sample::U16 => to.copy_from_slice(&(value.round() as u16).to_le_bytes()),
        Sample::F16 => to.copy_from_slice(&f16::from_f32(value).to_le_bytes()),
        Sample::F32 => to.copy_from_slice(&value.to_le_bytes()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_colours_of_a_texel_have_the_value_and_what_has_data_is_moved_off_it() {
        let black = Missing::of_layer(LayerFormat::Rgba8Srgb, NodataValue::new(0.0));
        assert!(black.is(&[0, 0, 0, 255]) && black.is(&[0, 0, 0, 7]) && !black.is(&[0, 0, 1, 255]));
        let mut texel = [9, 9, 9, 9];
        black.write(&mut texel);
        assert_eq!(texel, [0, 0, 0, 255]);
        black.step_off(&mut texel);
        assert_eq!(texel, [1, 0, 0, 255]);
        for format in LayerFormat::ALL.into_iter().filter(|format| !format.is_compressed()) {
            let values: &[f32] = match format {
                LayerFormat::R32Float => &[-9999.0, f32::MAX, f32::MIN, 0.0, f32::NAN, f32::INFINITY],
                LayerFormat::R16Float | LayerFormat::Rgba16Float => {
                    &[-10000.0, 65504.0, 0.0, f32::NEG_INFINITY]
                }
                LayerFormat::R16 | LayerFormat::Rgba16 => &[0.0, 32768.0, 65535.0],
                _ => &[0.0, 128.0, 255.0],
            };
            for value in values {
                let missing = Missing::of_layer(format, NodataValue::new(*value));
                let mut texel = vec![0x55; missing.texel_bytes()];
                assert_eq!(texel.len(), format.texel_bytes());
                missing.write(&mut texel);
                assert!(missing.is(&texel), "{format:?} {value}");
                missing.step_off(&mut texel);
                assert!(!missing.is(&texel) || value.is_nan(), "{format:?} {value}");
            }
        }
        let grey = Missing::of_image(PixelFormat::GREY_ALPHA16, NodataValue::new(256.0));
        assert!(grey.is(&[0, 1, 9, 9]) && !grey.is(&[1, 1, 9, 9]));
        let number = Missing::of_layer(LayerFormat::R32Float, NodataValue::new(1.0));
        assert!(number.is(&f32::NAN.to_le_bytes()));
    }
}
