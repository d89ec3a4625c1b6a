//! Which of an image's bands are shown, where it has more than a picture: all samples of a texel are bands,
//! counted from 1.

use super::image::{BLACK_IS_ZERO, Pick, TiffImage};
use crate::image::InputFault;

/// What stands before the bands in a path, after the file's own and a colon.
const IN_PATH: &str = "bands=";

/// What stands after a path's last colon as bands, if it names any: `5`, or `5,4,3`.
pub(super) fn in_name(name: &str) -> Option<&str> {
    name.strip_prefix(IN_PATH)
}

impl TiffImage {
    /// Of an image of more samples than a picture has, which it does not take for colours, the first three.
    pub(super) fn pick_first(mut self) -> TiffImage {
        if self.photometric == BLACK_IS_ZERO && self.samples > 2 {
            self.pick = Some(Pick { bands: vec![0, 1, 2], is_asked: false });
        }
        self
    }

    /// This image, showing the bands of a text.
    pub(super) fn pick(self, text: &str) -> Result<TiffImage, InputFault> {
        let number = |word: &str| {
            let number: u16 = word.parse().ok()?;
            (1..=self.samples).contains(&number).then(|| number - 1)
        };
        let bands: Option<Vec<u16>> = text.split(',').map(number).collect();
        match bands.filter(|bands| [1, 3].contains(&bands.len())) {
            Some(bands) => Ok(TiffImage { pick: Some(Pick { bands, is_asked: true }), ..self }),
            None => Err(InputFault::NoBands { bands: text.to_owned(), count: self.samples }),
        }
    }

    /// The bands that are shown where they are not simply the first ones, counted from 1.
    pub(crate) fn shown_bands(&self) -> Option<Vec<u16>> {
        Some(self.pick.as_ref()?.bands.iter().map(|band| band + 1).collect())
    }

    /// How many bands it has, where they are more than a picture shows.
    pub(crate) fn bands_to_choose(&self) -> Option<u16> {
        let channels = self.pixel_format().ok()?.channels();
        (self.has_pick() || self.samples > channels.into()).then_some(self.samples)
    }

    /// Returns true if some of its bands are shown, and not its colours.
    pub(in crate::image::tiff) fn has_pick(&self) -> bool {
        self.pick.is_some()
    }

    /// The bands that are shown, counted from 0, where they are not simply the colours.
    pub(in crate::image::tiff) fn picked_bands(&self) -> Option<&[u16]> {
        self.pick.as_ref().map(|pick| &*pick.bands)
    }

    /// This image as it is stored, whatever it says of turns.
    pub(in crate::image::tiff) fn upright(self) -> TiffImage {
        TiffImage { orientation: 1, ..self }
    }

    /// The bands that were asked for, counted from 0.
    pub(crate) fn asked_bands(&self) -> Option<&[u16]> {
        self.pick.as_ref().filter(|pick| pick.is_asked).map(|pick| &*pick.bands)
    }

    /// A strip or tile as it is stored but decoded, with these samples of each texel alone. Of planes only
    /// theirs are read.
    pub(crate) fn bands_of_chunk(&self, column: u32, row: u32, bands: &[u16]) -> Result<Vec<u8>, InputFault> {
        let sample = self.number.bytes();
        if !self.is_planar {
            return Ok(self.samples_of_bands(&self.stored_chunk(column, row)?, bands));
        }
        let texels = self.chunk[0] as usize * self.chunk_rows(row) as usize;
        let mut picked = vec![0; texels * bands.len() * sample];
        for (n, band) in bands.iter().enumerate() {
            let plane = self.plane_of_chunk(u32::from(*band), column, row)?;
            let targets = picked.chunks_exact_mut(bands.len() * sample);
            for (to, from) in targets.zip(plane.chunks_exact(sample)) {
                to[n * sample..][..sample].copy_from_slice(from);
            }
        }
        Ok(picked)
    }
    /// Of texels with all their samples these alone.
    pub(super) fn samples_of_bands(&self, stored: &[u8], bands: &[u16]) -> Vec<u8> {
        let sample = self.number.bytes();
        let texels = stored.chunks_exact(self.texel_bytes());
        let of_texel = |texel: &[u8]| -> Vec<u8> {
            bands.iter().flat_map(|band| &texel[usize::from(*band) * sample..][..sample]).copied().collect()
        };
        texels.flat_map(of_texel).collect()
    }
}
