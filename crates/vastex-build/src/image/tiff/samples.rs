//! What the samples of a TIFF file are before they are handed out, and how much of them a byte of the file
//! can hold.

use crate::image::{Converted, Sample};

pub(super) const COMPRESSION_NONE: u16 = 1;
pub(super) const COMPRESSION_JPEG: u16 = 7;
/// Values of SampleFormat.
pub(super) const UNSIGNED: u16 = 1;
pub(super) const SIGNED: u16 = 2;
pub(super) const FLOAT: u16 = 3;
/// Whole numbers up to this one, of either sign, are exact in a 32-bit float.
const MAX_EXACT: u32 = 1 << 24;

/// How samples of a SampleFormat and so many bits are handed out; else what they are, for a message.
pub(super) fn sample_of(sample_format: u16, bits: u64) -> Result<Sample, String> {
    match (sample_format, bits) {
        (UNSIGNED, 8) => Ok(Sample::U8),
        (UNSIGNED, 16) => Ok(Sample::U16),
        (SIGNED, 8) => Ok(Sample::F16),
        (SIGNED, 16 | 32) => Ok(Sample::F32),
        (FLOAT, 16) => Ok(Sample::F16),
        (FLOAT, 32 | 64) => Ok(Sample::F32),
        (UNSIGNED | SIGNED, _) => Err(format!("samples of {bits} bits")),
        (FLOAT, _) => Err(format!("floats of {bits} bits")),
        _ => Err("samples that are complex or of no known kind".into()),
    }
}

/// What a decoded sample is, where it is not handed out as it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stored {
    AsItIs,
    /// Becomes a 32-bit float.
    Double,
    /// Signed numbers of so many bytes become floats: of 16 bits that of one byte, else of 32.
    Signed(usize),
}

impl Stored {
    /// Of a SampleFormat and so many bits.
    pub(super) fn new(sample_format: u16, bits: u8) -> Stored {
        match (sample_format, bits) {
            (SIGNED, bits) => Stored::Signed(usize::from(bits) / 8),
            (FLOAT, 64) => Stored::Double,
            _ => Stored::AsItIs,
        }
    }

    /// What that is of which something else is handed out, unless every number is exact.
    pub(super) fn converted(self) -> Option<Converted> {
        match self {
            Stored::Double => Some(Converted::Doubles),
            Stored::Signed(4) => Some(Converted::Integers),
            Stored::AsItIs | Stored::Signed(_) => None,
        }
    }

    /// Returns true if nothing is done to it.
    pub(super) fn is_as_it_is(self) -> bool {
        self == Stored::AsItIs
    }

    /// Bytes of a decoded sample that is handed out as `sample`.
    pub(super) fn bytes(self, sample: Sample) -> usize {
        match self {
            Stored::AsItIs => sample.bytes(),
            Stored::Double => 8,
            Stored::Signed(bytes) => bytes,
        }
    }
}

/// Bytes that one of a compressed strip or tile can at most stand for.
pub(super) fn most_from_a_byte(compression: u16) -> u64 {
    match compression {
        COMPRESSION_NONE => 1,
        // PackBits: 128 from two.
        32773 => 64,
        // Deflate: 258 from two bits.
        8 | 32946 => 1032,
        // LZW: a code of 9 bits or more stands for 4,096 bytes at most.
        5 => 4096,
        // Of JPEG a block of 64 samples takes two bits at least, with colours at a quarter of the resolution
        // or less.
        COMPRESSION_JPEG | 6 => 2048,
        // Zstandard and others: a block of 128 KiB of one byte takes four.
        _ => 1 << 16,
    }
}

/// Puts a decoded row where it belongs, both as the machine has them, `to` in pieces; returns true if a
/// number was rounded.
pub(super) fn place_row<'a>(
    to: impl Iterator<Item = &'a mut [u8]>,
    stored: &[u8],
    kind: Stored,
    sample: Sample,
) -> bool {
    let mut rounded = false;
    let mut rest = stored;
    for to in to {
        let count = to.len() / sample.bytes();
        let (from, later) = rest.split_at(count * kind.bytes(sample));
        rest = later;
        match kind {
            Stored::AsItIs => to.copy_from_slice(from),
            Stored::Double => {
                for (to, from) in to.as_chunks_mut::<4>().0.iter_mut().zip(from.as_chunks::<8>().0) {
                    *to = (f64::from_ne_bytes(*from) as f32).to_ne_bytes();
                }
            }
            Stored::Signed(1) => {
                for (to, from) in to.as_chunks_mut::<2>().0.iter_mut().zip(from) {
                    *to = half::f16::from_f32((*from as i8).into()).to_ne_bytes();
                }
            }
            Stored::Signed(2) => {
                for (to, from) in to.as_chunks_mut::<4>().0.iter_mut().zip(from.as_chunks::<2>().0) {
                    *to = f32::from(i16::from_ne_bytes(*from)).to_ne_bytes();
                }
            }
            Stored::Signed(_) => {
                for (to, from) in to.as_chunks_mut::<4>().0.iter_mut().zip(from.as_chunks::<4>().0) {
                    let whole = i32::from_ne_bytes(*from);
                    rounded |= whole.unsigned_abs() > MAX_EXACT;
                    *to = (whole as f32).to_ne_bytes();
                }
            }
        }
    }
    rounded
}
