//! Samples that are no colours yet: numbers of colours in a palette, amounts of inks, and samples of fewer
//! bits than a byte, several of which are packed into one.

use super::image::{BLACK_IS_ZERO, INKS, MASK, PALETTE, TiffImage, WHITE_IS_ZERO};
use crate::image::inks::{rgb_from_inks, rgb_from_inks_16};
use crate::image::stored_as::{self, Palette, StoredAs};
use crate::image::{Converted, Number, PixelFormat};

impl TiffImage {
    /// Returns true if what is shown is something else than what is stored, as [`TiffImage::texels_of`] makes
    /// it.
    pub(in crate::image::tiff) fn is_converted(&self) -> bool {
        self.has_few_bits() || self.is_of_palette() || self.is_of_inks()
    }

    /// What its samples are of which something else is shown.
    pub(super) fn converted(&self) -> Vec<Converted> {
        let number = match () {
            () if self.is_of_palette() => Some(Converted::Palette),
            () if self.is_of_inks() => Some(Converted::Inks),
            () if self.of_few_bits() > 1 => Some(Converted::FewBits(self.bits as u8)),
            () => self.stored().converted(),
        };
        Converted::all(number, self.photometric == WHITE_IS_ZERO, self.is_premultiplied())
    }

    /// What its samples stand for as they are stored.
    pub(crate) fn stored_as(&self) -> StoredAs {
        match self.photometric {
            WHITE_IS_ZERO | BLACK_IS_ZERO | MASK if self.samples == 1 => {
                StoredAs::Grey { bits: self.bits as u8, is_white_zero: self.photometric == WHITE_IS_ZERO }
            }
            PALETTE if self.samples == 1 && self.is_whole() => {
                StoredAs::Palette(Palette { colors: self.palette.clone(), ..Palette::default() })
            }
            INKS if self.samples > 3 => StoredAs::Inks { extra: self.extra.as_slice().into() },
            _ => StoredAs::ByCount,
        }
    }

    /// Returns true if samples choose from a palette. Where bands are chosen the numbers themselves are
    /// shown.
    pub(super) fn is_of_palette(&self) -> bool {
        self.photometric == PALETTE && self.pick.is_none()
    }

    /// Returns true if samples are inks.
    pub(super) fn is_of_inks(&self) -> bool {
        self.photometric == INKS && self.pick.is_none()
    }

    /// Returns true if samples are whole numbers of up to 16 bits without a sign.
    pub(super) fn is_whole(&self) -> bool {
        matches!(self.number, Number::U8 | Number::U16)
    }

    /// By how much a sample of few bits is multiplied so that the most of it is the most of a byte; 1 of
    /// numbers of a palette and of other samples.
    pub(super) fn of_few_bits(&self) -> u8 {
        match self.bits {
            1 | 2 | 4 if self.photometric != PALETTE => 255 / ((1 << self.bits) - 1),
            _ => 1,
        }
    }

    /// Rows of a strip or tile whose samples are packed, each sample as a byte. Rows begin at a byte.
    pub(super) fn unpacked(&self, packed: &[u8]) -> Vec<u8> {
        let samples = self.chunk[0] as usize * self.samples_of_chunk();
        let rows = packed.chunks_exact(self.packed_row() as usize);
        let mut all = vec![0; rows.len() * samples];
        for (to, row) in all.chunks_exact_mut(samples).zip(rows) {
            stored_as::unpacked(row, self.bits as u8, to);
        }
        all
    }

    /// The colours that samples choose, each of three bytes. Beyond the end of the palette all is black.
    pub(super) fn colors(&self, stored: &[u8]) -> Vec<u8> {
        let color = |number: usize| self.palette.get(number).copied().unwrap_or_default();
        match self.number {
            Number::U16 => {
                let numbers = stored.as_chunks().0.iter();
                numbers.flat_map(|number| color(u16::from_le_bytes(*number).into())).collect()
            }
            _ => stored.iter().flat_map(|number| color((*number).into())).collect(),
        }
    }

    /// Red, green, blue, and alpha where `format` has it, of texels of four inks and perhaps more samples.
    pub(super) fn without_inks(&self, stored: &[u8], format: PixelFormat) -> Vec<u8> {
        let (from, to) = (self.texel_bytes(), format.texel_bytes());
        let sample = self.number.bytes();
        let mut texels = vec![0; stored.len() / from * to];
        for (to, from) in texels.chunks_exact_mut(to).zip(stored.chunks_exact(from)) {
            let (colors, alpha) = to.split_at_mut(3 * sample);
            match self.number {
                Number::U16 => {
                    let inks = [0, 2, 4, 6].map(|at| u16::from_le_bytes([from[at], from[at + 1]]));
                    let rgb = rgb_from_inks_16(inks).map(u16::to_le_bytes);
                    colors.copy_from_slice(rgb.as_flattened());
                }
                _ => colors.copy_from_slice(&rgb_from_inks([from[0], from[1], from[2], from[3]])),
            }
            alpha.copy_from_slice(&from[4 * sample..][..alpha.len()]);
        }
        texels
    }
}
