//! How single numbers are stored, in files of any kind.

use super::pixel::Sample;

/// How a number is stored, the byte of the lowest bits first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Number {
    /// A whole number of 8 bits without a sign.
    U8,
    /// A whole number of 16 bits without a sign.
    U16,
    /// A whole number of 32 bits without a sign.
    U32,
    /// A whole number of 8 bits with a sign.
    I8,
    /// A whole number of 16 bits with a sign.
    I16,
    /// A whole number of 32 bits with a sign.
    I32,
    /// A float of 16 bits.
    F16,
    /// A float of 32 bits.
    F32,
    /// A float of 64 bits.
    F64,
}

impl Number {
    /// Of a value of TIFF's SampleFormat and so many bits; `None` if that is not known.
    pub(crate) fn new(sample_format: u64, bits: u64) -> Option<Number> {
        const UNSIGNED: u64 = 1;
        /// Data of no stated kind, which libtiff takes for whole numbers.
        const VOID: u64 = 4;
        const SIGNED: u64 = 2;
        const FLOAT: u64 = 3;
        match (sample_format, bits) {
            (UNSIGNED | VOID, 8) => Some(Number::U8),
            (UNSIGNED | VOID, 16) => Some(Number::U16),
            (UNSIGNED | VOID, 32) => Some(Number::U32),
            (SIGNED, 8) => Some(Number::I8),
            (SIGNED, 16) => Some(Number::I16),
            (SIGNED, 32) => Some(Number::I32),
            (FLOAT, 16) => Some(Number::F16),
            (FLOAT, 32) => Some(Number::F32),
            (FLOAT, 64) => Some(Number::F64),
            _ => None,
        }
    }

    /// Bytes of one.
    pub const fn bytes(self) -> usize {
        match self {
            Number::U8 | Number::I8 => 1,
            Number::U16 | Number::I16 | Number::F16 => 2,
            Number::U32 | Number::I32 | Number::F32 => 4,
            Number::F64 => 8,
        }
    }

    /// The number's name in NumPy: `u1`, `i2`, `f4`.
    pub const fn name(self) -> &'static str {
        match self {
            Number::U8 => "u1",
            Number::U16 => "u2",
            Number::U32 => "u4",
            Number::I8 => "i1",
            Number::I16 => "i2",
            Number::I32 => "i4",
            Number::F16 => "f2",
            Number::F32 => "f4",
            Number::F64 => "f8",
        }
    }

    /// The value of TIFF's SampleFormat.
    pub(crate) const fn sample_format(self) -> u16 {
        match self {
            Number::U8 | Number::U16 | Number::U32 => 1,
            Number::I8 | Number::I16 | Number::I32 => 2,
            Number::F16 | Number::F32 | Number::F64 => 3,
        }
    }

    /// The bytes of a number, rounded to the nearest that there is.
    pub(crate) fn of(self, value: f64) -> Vec<u8> {
        match self {
            Number::U8 => vec![value as u8],
            Number::U16 => (value as u16).to_le_bytes().to_vec(),
            Number::U32 => (value as u32).to_le_bytes().to_vec(),
            Number::I8 => (value as i8).to_le_bytes().to_vec(),
            Number::I16 => (value as i16).to_le_bytes().to_vec(),
            Number::I32 => (value as i32).to_le_bytes().to_vec(),
            Number::F16 => half::f16::from_f64(value).to_le_bytes().to_vec(),
            Number::F32 => (value as f32).to_le_bytes().to_vec(),
            Number::F64 => value.to_le_bytes().to_vec(),
        }
    }
}

impl From<Sample> for Number {
    fn from(sample: Sample) -> Number {
        match sample {
            Sample::U8 => Number::U8,
            Sample::U16 => Number::U16,
            Sample::F16 => Number::F16,
            Sample::F32 => Number::F32,
        }
    }
}
