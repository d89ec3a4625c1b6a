//! What of an image is shown: the same channels and samples that rows of the file have.

use vastex_core::NodataValue;

use super::image::{BLACK_IS_ZERO, INKS, MASK, PALETTE, RGB, TiffImage, WHITE_IS_ZERO, YCBCR, unsupported};
use crate::image::alpha::unpremultiply;
use crate::image::tiff::samples::{self, SIGNED, Stored, place_row};
use crate::image::{ImageHeader, InputFault, Notice, Number, PixelFormat, Profile, Sample};

/// A value of ExtraSamples.
const ASSOCIATED_ALPHA: u64 = 1;

impl TiffImage {
    /// What there is to know of it before its texels are read. An image that is stored turned or mirrored is
    /// refused.
    pub(crate) fn header(&self) -> Result<ImageHeader, InputFault> {
        let [width, height] = self.size.map(u64::from);
        let format = self.pixel_format()?;
        let mut header = ImageHeader::new(width, height, format)?;
        if (2..=8).contains(&self.orientation) {
            return Err(InputFault::Unsupported {
                what: format!(
                    "a picture that is stored turned or mirrored (orientation {})",
                    self.orientation
                ),
                remedy: "make a container of it with `vastex build FILE -o FILE.vastex`",
            });
        }
        header.nodata = self.shown_nodata();
        // One of inks says nothing of what a plain formula makes of them.
        let has_colors = self.pick.is_none() && !self.is_of_inks();
        header.profile = self.profile.clone().filter(|_| has_colors).map(Profile::icc);
        header.notices.extend(self.is_of_inks().then_some(Notice::InksConverted));
        // Measured numbers of 16 bits stay as they are: what was measured is light, if it is any picture.
        header.linear = self.pick.is_some() && format.sample() != Sample::U8;
        let is_first = self.pick.as_ref().is_some_and(|pick| !pick.is_asked);
        header.notices.extend(is_first.then_some(Notice::FirstBands { of: self.samples }));
        header.notices.extend(self.is_premultiplied().then_some(Notice::PremultipliedAlpha));
        header.notices.extend((self.stored() == Stored::Double).then_some(Notice::DoublesNarrowed));
        header.converted = self.converted();
        if self.sample_format == u64::from(SIGNED) {
            let most = (1i64 << (self.bits.clamp(1, 64) - 1)) - 1;
            header.range = Some([-most - 1, most]);
        }
        Ok(header)
    }

    /// The number that stands for no data among the samples that are shown.
    pub(in crate::image::tiff) fn shown_nodata(&self) -> Option<NodataValue> {
        if self.is_of_inks() || self.is_of_palette() {
            return None;
        }
        let nodata = self.nodata? * f64::from(self.of_few_bits());
        let shown = match (self.photometric, self.number) {
            (WHITE_IS_ZERO, Number::U8) => 255.0 - nodata,
            (WHITE_IS_ZERO, Number::U16) => 65535.0 - nodata,
            (WHITE_IS_ZERO, _) => 1.0 - nodata,
            _ => nodata,
        };
        Some(NodataValue::new(shown as f32))
    }

    /// The format of the texels that are shown.
    pub(crate) fn pixel_format(&self) -> Result<PixelFormat, InputFault> {
        let extras = self.extra.len().min(self.samples.into()) as u16;
        let colors = self.samples - extras;
        let has_alpha = matches!(self.extra.first(), Some(1 | 2));
        let channels = match (self.photometric, colors) {
            _ if let Some(pick) = &self.pick => pick.bands.len() as u8,
            (RGB, 3) if has_alpha => 4,
            (RGB | YCBCR, 3) => 3,
            (RGB, 4) => 4,
            (BLACK_IS_ZERO | WHITE_IS_ZERO | MASK, _) if self.samples == 1 => 1,
            (BLACK_IS_ZERO, _) if self.samples == 2 => 2,
            (PALETTE, _) if self.samples == 1 && self.is_whole() => 3,
            (INKS, 4) if self.is_whole() => 3 + u8::from(has_alpha),
            (photometric, _) => {
                let samples = self.samples;
                return Err(unsupported(format!(
                    "{samples} samples a texel of photometric interpretation {photometric}"
                )));
            }
        };
        if self.has_few_bits() || self.is_of_palette() {
            return PixelFormat::new(channels, Sample::U8)
                .ok_or_else(|| unsupported(format!("{channels} channels")));
        }
        let sample = samples::sample_of(self.sample_format as u16, self.bits).map_err(unsupported)?;
        let inverts = [Number::U8, Number::U16, Number::F32, Number::F64].contains(&self.number);
        if self.photometric == WHITE_IS_ZERO && !inverts {
            return Err(unsupported("numbers of this kind where white is 0".into()));
        }
        PixelFormat::new(channels, sample).ok_or_else(|| unsupported(format!("{channels} channels")))
    }

    /// A strip or tile as texels of `format`, which is that of [`TiffImage::pixel_format`].
    pub(crate) fn chunk_texels(
        &self,
        column: u32,
        row: u32,
        format: PixelFormat,
    ) -> Result<Vec<u8>, InputFault> {
        let stored = match &self.pick {
            Some(pick) => self.bands_of_chunk(column, row, &pick.bands)?,
            None => self.stored_chunk(column, row)?,
        };
        Ok(self.texels_of(stored, format))
    }

    /// Texels of `format` of what is stored, of the bands that are shown alone where there are such.
    pub(in crate::image::tiff) fn texels_of(&self, mut stored: Vec<u8>, format: PixelFormat) -> Vec<u8> {
        let stored_texel = self.picked_texel();
        if self.is_of_palette() {
            return self.colors(&stored);
        }
        if self.is_of_inks() {
            return self.without_inks(&stored, format);
        }
        if self.has_few_bits() {
            let times = self.of_few_bits();
            stored.iter_mut().for_each(|sample| *sample = sample.saturating_mul(times));
        }
        if self.photometric == WHITE_IS_ZERO {
            invert(&mut stored, self.number);
        }
        let (sample, kind) = (format.sample(), self.stored());
        let used = usize::from(format.channels()) * self.number.bytes();
        let mut texels = if self.is_shown_as_stored(format) {
            stored
        } else {
            if cfg!(target_endian = "big") {
                stored.chunks_exact_mut(self.number.bytes()).for_each(<[u8]>::reverse);
            }
            let count = stored.len() / stored_texel;
            let mut texels = vec![0; count * format.texel_bytes()];
            let pairs = texels.chunks_exact_mut(format.texel_bytes()).zip(stored.chunks_exact(stored_texel));
            for (to, from) in pairs {
                place_row([to].into_iter(), &from[..used], kind, sample);
            }
            if cfg!(target_endian = "big") {
                texels.chunks_exact_mut(sample.bytes()).for_each(<[u8]>::reverse);
            }
            texels
        };
        if self.is_premultiplied() {
            unpremultiply(format, &mut texels);
        }
        texels
    }

    /// Bytes of a texel as it is stored, of the bands that are shown.
    pub(in crate::image::tiff) fn picked_texel(&self) -> usize {
        let all = usize::from(self.samples);
        self.pick.as_ref().map_or(all, |pick| pick.bands.len()) * self.number.bytes()
    }

    /// Returns true if what is stored becomes texels of a format where it lies.
    pub(super) fn is_shown_as_stored(&self, format: PixelFormat) -> bool {
        let (sample, kind) = (format.sample(), self.stored());
        let used = usize::from(format.channels()) * self.number.bytes();
        !self.is_of_palette()
            && !self.is_of_inks()
            && used == self.picked_texel()
            && kind.bytes(sample) == sample.bytes()
            && kind.is_as_it_is()
    }

    /// One plane of a strip or tile for whoever puts rows together: as far as it lies within the image, the
    /// samples that are shown, as they are stored but in the machine's order.
    pub(in crate::image::tiff) fn shown_part(
        &self,
        plane: u32,
        column: u32,
        row: u32,
        format: PixelFormat,
    ) -> Result<Vec<u8>, InputFault> {
        let mut part = self.plane_of_chunk(plane, column, row)?;
        if self.photometric == WHITE_IS_ZERO {
            invert(&mut part, self.number);
        }
        if cfg!(target_endian = "big") {
            part.chunks_exact_mut(self.number.bytes()).for_each(<[u8]>::reverse);
        }
        let samples = self.samples_of_chunk();
        let shown = if samples == 1 { 1 } else { usize::from(format.channels()) };
        let rows = self.chunk_rows(row).min(self.size[1] - row * self.chunk[1]);
        let width = self.chunk[0].min(self.size[0] - column * self.chunk[0]) as usize;
        let [texel, used] = [samples, shown].map(|count| count * self.number.bytes());
        let row_bytes = self.chunk[0] as usize * texel;
        if (width * used) == row_bytes {
            part.truncate(rows as usize * row_bytes);
            return Ok(part);
        }
        let rows = part.chunks_exact(row_bytes).take(rows as usize);
        let texels = rows.flat_map(|row| row.chunks_exact(texel).take(width));
        Ok(texels.flat_map(|texel| &texel[..used]).copied().collect())
    }

    /// A row of a strip, decompressed but as it was before that, becomes the samples that are shown, of all
    /// its channels or of one, little-endian.
    pub(in crate::image::tiff) fn shown_row(&self, row: &mut [u8]) {
        self.put_in_order(row);
        if self.photometric == WHITE_IS_ZERO {
            invert(row, self.number);
        }
    }

    /// Returns true if colours are multiplied by alpha.
    pub(super) fn is_premultiplied(&self) -> bool {
        self.pick.is_none() && matches!(self.samples, 2 | 4) && self.extra.first() == Some(&ASSOCIATED_ALPHA)
    }

    /// How its samples become those that are shown.
    pub(super) fn stored(&self) -> Stored {
        Stored::new(self.sample_format as u16, self.bits as u8)
    }
}

/// Samples of which white is 0 and black the most, so that black is 0.
fn invert(stored: &mut [u8], number: Number) {
    match number {
        Number::F32 => stored.as_chunks_mut().0.iter_mut().for_each(|sample| {
            *sample = (1.0 - f32::from_le_bytes(*sample)).to_le_bytes();
        }),
        Number::F64 => stored.as_chunks_mut().0.iter_mut().for_each(|sample| {
            *sample = (1.0 - f64::from_le_bytes(*sample)).to_le_bytes();
        }),
        _ => stored.iter_mut().for_each(|byte| *byte = !*byte),
    }
}
