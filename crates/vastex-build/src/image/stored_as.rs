//! What the samples of an image stand for as they are stored, before anything is made of them: what whoever
//! writes them elsewhere must say with them.

use std::fmt;
use std::sync::Arc;

/// What the samples of a file are of which its rows hold something else, so that no value is the one that the
/// file stores.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Converted {
    /// Numbers of a palette, of which rows hold the colours.
    Palette,
    /// Grey of so many bits, 1, 2 or 4, of which rows hold 8.
    FewBits(u8),
    /// Inks, of which rows hold red, green and blue.
    Inks,
    /// Whole numbers of 32 bits, which rows hold as floats: exactly up to 2^24.
    Integers,
    /// Floats of 64 bits, of which rows hold 32.
    Doubles,
    /// Grey of which the least is white, of which rows hold it the other way round.
    WhiteIsZero,
    /// Colours that are multiplied by alpha, of which rows hold them divided by it.
    Premultiplied,
}

impl Converted {
    /// All that samples are converted from: what their numbers are, grey of which 0 is white, colours
    /// multiplied by alpha.
    pub(super) fn all(
        number: Option<Converted>,
        is_white_zero: bool,
        is_premultiplied: bool,
    ) -> Vec<Converted> {
        let inverted = is_white_zero.then_some(Converted::WhiteIsZero);
        let multiplied = is_premultiplied.then_some(Converted::Premultiplied);
        [number, inverted, multiplied].into_iter().flatten().collect()
    }
}

/// What the samples of some pieces of a mosaic are of which its rows hold something else.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ConvertedPieces {
    /// What the files of these pieces hold.
    pub from: Converted,
    /// How many they are.
    pub pieces: usize,
    /// How many pieces the mosaic has.
    pub of: usize,
}

impl ConvertedPieces {
    /// What the pieces of a mosaic are converted from, each kind once, in the order in which they come: what
    /// all of them are, and what some are. Of each piece its own conversions are given.
    pub(super) fn of<'a>(
        pieces: impl ExactSizeIterator<Item = &'a [Converted]>,
    ) -> (Vec<Converted>, Vec<ConvertedPieces>) {
        let of = pieces.len();
        let mut counted: Vec<ConvertedPieces> = Vec::new();
        for &from in pieces.flatten() {
            match counted.iter_mut().find(|known| known.from == from) {
                Some(known) => known.pieces += 1,
                None => counted.push(ConvertedPieces { from, pieces: 1, of }),
            }
        }
        let (all, some): (Vec<_>, Vec<_>) = counted.into_iter().partition(|known| known.pieces == of);
        (all.into_iter().map(|known| known.from).collect(), some)
    }
}

impl fmt::Display for ConvertedPieces {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} in {} of {} pieces", self.from, self.pieces, self.of)
    }
}

impl fmt::Display for Converted {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Converted::Palette => f.write_str("numbers of a palette"),
            Converted::FewBits(1) => f.write_str("grey of 1 bit"),
            Converted::FewBits(bits) => write!(f, "grey of {bits} bits"),
            Converted::Inks => f.write_str("inks (CMYK)"),
            Converted::Integers => f.write_str("whole numbers of 32 bits"),
            Converted::Doubles => f.write_str("floats of 64 bits"),
            Converted::WhiteIsZero => f.write_str("grey of which 0 is white"),
            Converted::Premultiplied => f.write_str("colours multiplied by alpha"),
        }
    }
}

/// What the samples of a texel stand for.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) enum StoredAs {
    /// What their number says: grey, grey and alpha, colours, colours and alpha, or anything.
    #[default]
    ByCount,
    /// Grey, one sample of so many bits each, which have a byte at least wherever they are handed out.
    Grey {
        bits: u8,
        /// True if 0 is white.
        is_white_zero: bool,
    },
    /// Numbers of colours.
    Palette(Palette),
    /// Cyan, magenta, yellow and black, of each of which the most is all of it.
    Inks {
        /// What TIFF says of the samples beyond them.
        extra: Arc<[u64]>,
    },
    /// Inks of each of which 0 is all of it, as Adobe's programs store them in JPEG.
    InvertedInks,
}

/// The colours that numbers choose.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Palette {
    pub(crate) colors: Arc<[[u8; 3]]>,
    /// The alpha of each of the first colours; that of the others is the most there is.
    pub(crate) alphas: Arc<[u8]>,
}

impl StoredAs {
    /// Bits of a sample, which has so many bytes where it is handed out.
    pub(crate) fn bits(&self, bytes: usize) -> u8 {
        match self {
            StoredAs::Grey { bits, .. } if *bits < 8 => *bits,
            _ => 8 * bytes as u8,
        }
    }
}

/// A row of samples of so few bits, 1, 2 or 4, one behind the other in each byte, the first in the highest
/// bits, as bytes.
pub(crate) fn unpacked(packed: &[u8], bits: u8, samples: &mut [u8]) {
    let (bits, mask) = (usize::from(bits), (1u8 << bits) - 1);
    let in_byte = 8 / bits;
    for (n, sample) in samples.iter_mut().enumerate() {
        *sample = packed[n / in_byte] >> (8 - bits - n % in_byte * bits) & mask;
    }
}

/// Rows of so many samples, a byte each, packed as [`unpacked`] has them; each row begins at a byte.
pub(crate) fn packed(samples: &[u8], bits: u8, width: usize) -> Vec<u8> {
    let bits = usize::from(bits);
    let byte = |some: &[u8]| {
        some.iter().enumerate().fold(0, |byte, (n, sample)| byte | sample << (8 - bits - n * bits))
    };
    samples.chunks(width).flat_map(|row| row.chunks(8 / bits).map(byte)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_packed_is_unpacked() {
        for (bits, first) in [(1, 0b1010_1010), (2, 0b0110_1100), (4, 0x12)] {
            let samples: Vec<u8> = [1, 2, 3, 0, 3, 2, 1].map(|n: u8| n & ((1 << bits) - 1)).into();
            let rows = packed(&samples.repeat(2), bits, 7);
            assert_eq!((rows[0], rows.len()), (first, 2 * (7 * usize::from(bits)).div_ceil(8)));
            let mut again = vec![9; 7];
            unpacked(&rows[rows.len() / 2..], bits, &mut again);
            assert_eq!(again, samples);
        }
    }
}
