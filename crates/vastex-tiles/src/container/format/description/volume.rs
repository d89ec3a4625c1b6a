//! Volumes: the section that says that a container has a texture for each channel and time of a volume, what
//! their values are, and what else is known of the volume.

use vastex_core::{Description, Dims};

use crate::container::format::layout::{Fields, MAX_PAGES};

/// Bytes of a value of each kind: truth values; whole numbers of 8, 16, 32 and 64 bits, of each without and
/// with a sign; floats of 16, 32 and 64 bits. Their numbers in a file count from 1.
const VALUE_BYTES: [usize; 12] = [1, 1, 1, 2, 2, 4, 4, 8, 8, 2, 4, 8];
/// Bytes that the text about a volume may have.
const MAX_ABOUT_BYTES: usize = 512 << 10;

/// That a container holds a volume: a texture of one geometry for each channel and time. The first has number
/// 0; that of channel `c` and time `t` has the number `t * channels + c`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ContainerVolume {
    /// How many channels there are, at least 1.
    pub channels: u32,
    /// How many times there are, at least 1.
    pub times: u32,
    /// What the values are, by the numbers of docs/format.md: 1 to 12. The layer's format tells only how many
    /// bytes they have.
    pub values: u8,
    /// The value of voxels that nothing is stored of, little-endian, in as many of the first bytes as a value
    /// has.
    pub fill: [u8; 8],
    /// Further metadata as JSON, which the container does not interpret.
    pub about: String,
}

impl ContainerVolume {
    /// How many textures there are.
    pub fn textures(&self) -> u64 {
        u64::from(self.channels) * u64::from(self.times)
    }

    /// Fails unless the volume suits the texture that each of its channels and times is.
    pub(crate) fn check(&self, description: &Description) -> Result<(), String> {
        let geometry = &description.geometry;
        let bytes = self.values.checked_sub(1).and_then(|kind| VALUE_BYTES.get(usize::from(kind)));
        let layers: Vec<usize> = description.layers.iter().map(|layer| layer.format.block_bytes()).collect();
        if geometry.dims() != Dims::D3 {
            return Err("a volume whose textures are images".into());
        }
        if bytes.is_none_or(|bytes| layers != [*bytes]) {
            return Err(format!(
                "values of kind {} in {} layers of {layers:?} bytes",
                self.values,
                layers.len()
            ));
        }
        let (channels, times) = (self.channels, self.times);
        let pages = self.textures().checked_mul(geometry.page_count());
        if self.textures() == 0 || pages.is_none_or(|pages| pages > MAX_PAGES) {
            return Err(format!(
                "{channels} channels and {times} times of {} pages: at most {MAX_PAGES} pages are allowed in all; use larger \
                 pages, or build fewer times",
                geometry.page_count()
            ));
        }
        match self.about.len() > MAX_ABOUT_BYTES {
            true => Err(format!(
                "{} bytes about the volume: at most {MAX_ABOUT_BYTES} are allowed",
                self.about.len()
            )),
            false => Ok(()),
        }
    }

    pub(super) fn encode(&self) -> Vec<u8> {
        let mut bytes = [self.channels, self.times].map(u32::to_le_bytes).concat();
        bytes.extend([self.values, 0, 0, 0]);
        bytes.extend(self.fill);
        bytes.extend(self.about.as_bytes());
        bytes
    }

    pub(super) fn decode(section: &[u8]) -> Result<ContainerVolume, String> {
        let mut fields = Fields::new(section);
        let (channels, times, values) = (fields.u32()?, fields.u32()?, fields.u8()?);
        if fields.bytes(3)? != [0; 3] {
            return Err("bytes that must be zero are not".into());
        }
        let mut fill = [0; 8];
        fill.copy_from_slice(fields.bytes(8)?);
        let about = section.get(20..).unwrap_or_default();
        let about =
            std::str::from_utf8(about).map_err(|error| format!("the text about the volume: {error}"))?;
        Ok(ContainerVolume { channels, times, values, fill, about: about.into() })
    }
}

#[cfg(test)]
mod tests {
    use vastex_core::{Geometry, GeometrySpec, LayerFormat};

    use super::*;

    #[test]
    fn a_volume_is_read_as_it_was_written_and_must_suit_its_texture() {
        let volume =
            ContainerVolume { channels: 3, times: 2, values: 5, fill: [1; 8], about: "{\"a\": 1}".into() };
        let bytes = volume.encode();
        assert_eq!(ContainerVolume::decode(&bytes), Ok(volume.clone()));
        for bad in
            [&bytes[..19], &[&bytes[..9], &[1], &bytes[10..]].concat(), &[&bytes[..], &[0xff]].concat()]
        {
            assert!(ContainerVolume::decode(bad).is_err());
        }
        let spec = GeometrySpec { page: 64, border: 1, ..GeometrySpec::volume([100; 3]) };
        let texture = Description::one_layer(Geometry::new(spec).unwrap(), LayerFormat::R16);
        assert_eq!(volume.check(&texture), Ok(()));
        let image =
            Description::one_layer(Geometry::new(GeometrySpec::image(9, 9)).unwrap(), LayerFormat::R16);
        assert!(volume.check(&image).is_err());
        for bad in [
            ContainerVolume { channels: 0, ..volume.clone() },
            ContainerVolume { times: u32::MAX, ..volume.clone() },
            ContainerVolume { values: 0, ..volume.clone() },
            ContainerVolume { values: 6, ..volume.clone() },
            ContainerVolume { values: 13, ..volume.clone() },
            ContainerVolume { about: " ".repeat(MAX_ABOUT_BYTES + 1), ..volume },
        ] {
            assert!(bad.check(&texture).is_err(), "{} {} {}", bad.channels, bad.times, bad.values);
        }
    }
}
