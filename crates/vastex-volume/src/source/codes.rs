//! What stands in tiles for the values of a volume: which format, and which stored value a texel means.

use vastex_core::LayerFormat;

use crate::values::DType;

/// The greatest float that is mixed: the sum of all samples of a ray is still finite, and so is what is
/// steepest between two voxels, per length of the world.
const MOST: f32 = 1e30;

/// How stored values stand in tiles.
///
/// Whole numbers of 8 and 16 bits are shares of their full range, as they are stored; those with a sign are
/// moved so that the least is 0. Floats of 16 and 32 bits are as they are stored. What has more bits becomes
/// the nearest float of 32 bits, of which 24 bits are exact; who needs the others asks for
/// [values](crate::VolumeSource::value_at). Infinite floats, and those beyond 1e30 either way, stand there as
/// 1e30 or -1e30 (of 16 bits, as the greatest or the least that is finite), so that they can be mixed. Labels
/// are whole numbers of 32 or 64 bits, those with a sign in two's complement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ValueCodes {
    /// The format of the layer.
    pub format: LayerFormat,
    /// The stored value of a sampled one is `base + gain * sampled`; of labels, what is read is the label.
    pub base: f64,
    /// See [`ValueCodes::base`].
    pub gain: f64,
    /// True if a tile has every bit of a stored value, of floats of one from -1e30 to 1e30.
    pub is_exact: bool,
    dtype: DType,
}

impl ValueCodes {
    /// Of values that are mixed.
    pub(crate) fn of_values(dtype: DType) -> ValueCodes {
        let (format, base, gain) = match dtype {
            DType::Bool | DType::U8 => (LayerFormat::R8, 0.0, 255.0),
            DType::I8 => (LayerFormat::R8, -128.0, 255.0),
            DType::U16 => (LayerFormat::R16, 0.0, 65535.0),
            DType::I16 => (LayerFormat::R16, -32768.0, 65535.0),
            DType::F16 => (LayerFormat::R16Float, 0.0, 1.0),
            _ => (LayerFormat::R32Float, 0.0, 1.0),
        };
        let is_exact = dtype.bytes() < 4 || dtype == DType::F32;
        ValueCodes { format, base, gain, is_exact, dtype }
    }

    /// Of labels; `None` if these are no whole numbers.
    pub(crate) fn of_labels(dtype: DType) -> Option<ValueCodes> {
        let format = match (dtype.is_float(), dtype.bytes()) {
            (true, _) => return None,
            (false, 8) => LayerFormat::Rg32Uint,
            (false, _) => LayerFormat::R32Uint,
        };
        Some(ValueCodes { format, base: 0.0, gain: 1.0, is_exact: true, dtype })
    }

    /// Values, little-endian, as the bytes of texels.
    pub(crate) fn encode(&self, mut values: Vec<u8>) -> Vec<u8> {
        match (self.format, self.dtype) {
            (LayerFormat::R8, DType::I8) => values.iter_mut().for_each(|value| *value ^= 0x80),
            (LayerFormat::R16, DType::I16) => {
                values.as_chunks_mut::<2>().0.iter_mut().for_each(|[_, high]| *high ^= 0x80);
            }
            (LayerFormat::R32Float, DType::U32) => each(&mut values, |v| u32::from_le_bytes(v) as f32),
            (LayerFormat::R32Float, DType::I32) => each(&mut values, |v| i32::from_le_bytes(v) as f32),
            (LayerFormat::R32Float, DType::U64) => return halved(&values, |v| u64::from_le_bytes(v) as f32),
            (LayerFormat::R32Float, DType::I64) => return halved(&values, |v| i64::from_le_bytes(v) as f32),
            (LayerFormat::R32Float, DType::F64) => {
                return halved(&values, |v| finite(f64::from_le_bytes(v) as f32));
            }
            (LayerFormat::R32Float, DType::F32) => each(&mut values, |v| finite(f32::from_le_bytes(v))),
            (LayerFormat::R16Float, DType::F16) => {
                let halves = values.as_chunks_mut::<2>().0.iter_mut();
                halves.filter(|half| (half[1] & 0x7f, half[0]) == (0x7c, 0)).for_each(|half| {
                    *half = [0xff, (half[1] & 0x80) | 0x7b];
                });
            }
            (LayerFormat::R32Uint, DType::Bool | DType::U8) => {
                return values.iter().flat_map(|value| u32::from(*value).to_le_bytes()).collect();
            }
            (LayerFormat::R32Uint, DType::I8) => {
                return values.iter().flat_map(|value| i32::from(*value as i8).to_le_bytes()).collect();
            }
            (LayerFormat::R32Uint, DType::U16) => {
                let words = values.as_chunks::<2>().0.iter();
                return words.flat_map(|word| u32::from(u16::from_le_bytes(*word)).to_le_bytes()).collect();
            }
            (LayerFormat::R32Uint, DType::I16) => {
                let words = values.as_chunks::<2>().0.iter();
                return words.flat_map(|word| i32::from(i16::from_le_bytes(*word)).to_le_bytes()).collect();
            }
            _ => {}
        }
        values
    }
}

/// What is blended of a float: what is no number stays so.
fn finite(value: f32) -> f32 {
    value.clamp(-MOST, MOST)
}

fn each(values: &mut [u8], float: impl Fn([u8; 4]) -> f32) {
    values.as_chunks_mut::<4>().0.iter_mut().for_each(|value| *value = float(*value).to_le_bytes());
}

fn halved(values: &[u8], float: impl Fn([u8; 8]) -> f32) -> Vec<u8> {
    values.as_chunks::<8>().0.iter().flat_map(|value| float(*value).to_le_bytes()).collect()
}

/// A value as it is stored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum VoxelValue {
    /// A whole number without a sign, or a truth value.
    Unsigned(u64),
    /// A whole number with a sign.
    Signed(i64),
    /// A float.
    Float(f64),
}

impl VoxelValue {
    /// The value that the first bytes are, little-endian; `None` if there are too few.
    pub(crate) fn of(dtype: DType, bytes: &[u8]) -> Option<VoxelValue> {
        let mut wide = [0; 8];
        wide[..dtype.bytes()].copy_from_slice(bytes.get(..dtype.bytes())?);
        let unsigned = u64::from_le_bytes(wide);
        let unused = 64 - 8 * dtype.bytes() as u32;
        Some(match dtype {
            DType::Bool | DType::U8 | DType::U16 | DType::U32 | DType::U64 => VoxelValue::Unsigned(unsigned),
            DType::I8 | DType::I16 | DType::I32 | DType::I64 => {
                VoxelValue::Signed(((unsigned << unused) as i64) >> unused)
            }
            DType::F16 => VoxelValue::Float(half(unsigned as u16)),
            DType::F32 => VoxelValue::Float(f32::from_bits(unsigned as u32).into()),
            DType::F64 => VoxelValue::Float(f64::from_bits(unsigned)),
        })
    }

    /// As a float of 64 bits, the nearest one.
    pub fn to_f64(self) -> f64 {
        match self {
            VoxelValue::Unsigned(value) => value as f64,
            VoxelValue::Signed(value) => value as f64,
            VoxelValue::Float(value) => value,
        }
    }
}

impl std::fmt::Display for VoxelValue {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            VoxelValue::Unsigned(value) => value.fmt(f),
            VoxelValue::Signed(value) => value.fmt(f),
            VoxelValue::Float(value) => value.fmt(f),
        }
    }
}

/// A float of 16 bits.
pub(super) fn half(bits: u16) -> f64 {
    let (sign, exponent, fraction) = (bits >> 15, (bits >> 10) & 0x1f, f64::from(bits & 0x3ff));
    let magnitude = match exponent {
        0 => fraction * f64::powi(2.0, -24),
        31 if fraction > 0.0 => f64::NAN,
        31 => f64::INFINITY,
        _ => (fraction + 1024.0) * f64::powi(2.0, i32::from(exponent) - 25),
    };
    if sign == 1 { -magnitude } else { magnitude }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a texel stands for.
    fn meant(codes: &ValueCodes, texel: &[u8]) -> f64 {
        let word = |bytes: &[u8]| u16::from_le_bytes([bytes[0], bytes[1]]);
        let sampled = match codes.format {
            LayerFormat::R8 => f64::from(texel[0]) / 255.0,
            LayerFormat::R16 => f64::from(word(texel)) / 65535.0,
            LayerFormat::R16Float => half(word(texel)),
            _ => f32::from_le_bytes(texel.try_into().unwrap()).into(),
        };
        codes.base + codes.gain * sampled
    }

    #[test]
    fn texels_stand_for_the_stored_values() {
        for (dtype, bytes) in [
            (DType::Bool, vec![0, 1]),
            (DType::U8, vec![0, 7, 255]),
            (DType::I8, vec![0, 127, 128, 255]),
            (DType::U16, [0_u16, 1, 40_000, 65_535].map(u16::to_le_bytes).concat()),
            (DType::I16, [0_i16, -32_768, -1, 32_767].map(i16::to_le_bytes).concat()),
            (DType::U32, [0_u32, 1 << 23, 77].map(u32::to_le_bytes).concat()),
            (DType::I32, [0_i32, -(1 << 23), 77].map(i32::to_le_bytes).concat()),
            (DType::U64, [0_u64, 1 << 63, 77].map(u64::to_le_bytes).concat()),
            (DType::I64, [0_i64, i64::MIN, 77].map(i64::to_le_bytes).concat()),
            (DType::F16, [0_u16, 0x3c00, 0xbc00, 0x0001, 0x7bff].map(u16::to_le_bytes).concat()),
            (DType::F32, [0.0_f32, -1.5, 1e30].map(f32::to_le_bytes).concat()),
            (DType::F64, [0.0_f64, -1.5, 1e300].map(f64::to_le_bytes).concat()),
        ] {
            let codes = ValueCodes::of_values(dtype);
            let texels = codes.encode(bytes.clone());
            let texel = codes.format.texel_bytes();
            assert_eq!(texels.len() / texel, bytes.len() / dtype.bytes(), "{dtype:?}");
            for (texel, value) in texels.chunks(texel).zip(bytes.chunks(dtype.bytes())) {
                let stored = VoxelValue::of(dtype, value).unwrap().to_f64();
                let expected = if stored == 1e300 { f64::from(MOST) } else { stored };
                let found = meant(&codes, texel);
                assert!(
                    found == expected || (found - expected).abs() < 1e-9,
                    "{dtype:?}: {found}, {expected}"
                );
            }
        }
        assert!(ValueCodes::of_values(DType::I16).is_exact && !ValueCodes::of_values(DType::U32).is_exact);
    }

    #[test]
    fn infinite_values_are_the_ends_of_what_can_be_mixed() {
        let values = [f32::INFINITY, f32::NEG_INFINITY, 3e38, -3e38, 1.5];
        let texels = ValueCodes::of_values(DType::F32).encode(values.map(f32::to_le_bytes).concat());
        assert_eq!(texels, [1e30_f32, -1e30, 1e30, -1e30, 1.5].map(f32::to_le_bytes).concat());
        let values = [f64::INFINITY, f64::NEG_INFINITY, -1e300].map(f64::to_le_bytes).concat();
        let texels = ValueCodes::of_values(DType::F64).encode(values);
        assert_eq!(texels, [1e30_f32, -1e30, -1e30].map(f32::to_le_bytes).concat());
        let halves = [0x7c00_u16, 0xfc00, 0x7bff, 0x7e00, 0x7c01, 0x3c00, 0x0000];
        let texels = ValueCodes::of_values(DType::F16).encode(halves.map(u16::to_le_bytes).concat());
        // What is no number stays what it is.
        let kept = [0x7bff_u16, 0xfbff, 0x7bff, 0x7e00, 0x7c01, 0x3c00, 0x0000];
        assert_eq!(texels, kept.map(u16::to_le_bytes).concat());
        let nan = ValueCodes::of_values(DType::F32).encode(f32::NAN.to_le_bytes().to_vec());
        assert!(f32::from_le_bytes(nan.try_into().unwrap()).is_nan());
    }

    #[test]
    fn labels_keep_every_bit() {
        for (dtype, value) in [
            (DType::Bool, &[1][..]),
            (DType::U8, &[200]),
            (DType::I8, &[0x80]),
            (DType::U16, &[1, 2]),
            (DType::I16, &[0xff, 0xff]),
            (DType::U32, &[1, 2, 3, 4]),
            (DType::I32, &[1, 2, 3, 0xff]),
            (DType::U64, &[1, 2, 3, 4, 5, 6, 7, 8]),
            (DType::I64, &[1, 2, 3, 4, 5, 6, 7, 0xff]),
        ] {
            let codes = ValueCodes::of_labels(dtype).unwrap();
            let texel = codes.encode(value.to_vec());
            let mut wide = [0; 8];
            wide[..texel.len()].copy_from_slice(&texel);
            let expected = match VoxelValue::of(dtype, value).unwrap() {
                VoxelValue::Signed(value) if dtype.bytes() < 8 => (value as u32).into(),
                VoxelValue::Signed(value) => value as u64,
                VoxelValue::Unsigned(value) => value,
                VoxelValue::Float(_) => unreachable!(),
            };
            assert_eq!(u64::from_le_bytes(wide), expected, "{dtype:?}");
            assert_eq!(texel.len(), codes.format.texel_bytes());
        }
        assert!(ValueCodes::of_labels(DType::F32).is_none());
    }

    #[test]
    fn halves_are_what_they_are() {
        assert_eq!([0x0000, 0x8000, 0x3555, 0x0001, 0x7bff, 0xfc00].map(half), {
            [0.0, -0.0, 0.333_251_953_125, 5.960_464_477_539_063e-8, 65_504.0, f64::NEG_INFINITY]
        });
        assert!(half(0x7e00).is_nan());
    }
}
