//! Where images of unlike size lie over one another.
//!
//! What becomes of it in a picture is in `surface::fixed` and in layered.wgsl.

use std::fmt;
use std::str::FromStr;

use glam::DVec2;
use vastex::{LayerId, TextureId, Textures};

/// Where an image lies that is laid over one of another size. Images of one size lie the same in either way.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Placement {
    /// Stretched over all of the lowest image's place.
    #[default]
    Stretched,
    /// Texel upon texel from the upper left corner, on an image that is seen flat; elsewhere images are
    /// stretched. Nothing is shown of an image where it has no texel, nor beyond the lowest one's place.
    ByTexel,
}

impl Placement {
    /// Both.
    pub const ALL: [Placement; 2] = [Placement::Stretched, Placement::ByTexel];

    /// Name of the placement.
    pub fn name(self) -> &'static str {
        match self {
            Placement::Stretched => "stretched",
            Placement::ByTexel => "by-texel",
        }
    }
}

impl fmt::Display for Placement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Columns and rows of the images that textures are of: a texture has fewer where its image is held at a
/// share of its size. One of which nothing is said has all texels of its image.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ImageSizes(Vec<(TextureId, [u32; 2])>);

impl FromIterator<(TextureId, [u32; 2])> for ImageSizes {
    fn from_iter<I: IntoIterator<Item = (TextureId, [u32; 2])>>(sizes: I) -> ImageSizes {
        ImageSizes(sizes.into_iter().collect())
    }
}

impl ImageSizes {
    /// Columns and rows of the image that a layer is of.
    pub(super) fn of(&self, textures: &Textures, layer: LayerId) -> [u32; 2] {
        let told = self.0.iter().find(|(texture, _)| *texture == layer.texture());
        told.map_or_else(|| size_of(textures, layer), |(_, size)| *size)
    }

    /// Over how many of its own texels each of some layers lies on all of the first one's texture, where each
    /// texel of their images lies on the same texel of the first one's.
    pub(super) fn spread(&self, textures: &Textures, layers: impl Iterator<Item = LayerId>) -> Vec<DVec2> {
        let mut lowest = None;
        let spread = layers.map(|layer| {
            let texels = size_of(textures, layer);
            let side = side_of_texel(self.of(textures, layer), texels);
            let (texels, lowest_side) = *lowest.get_or_insert((texels, side));
            DVec2::from(texels.map(f64::from)) * (lowest_side / side)
        });
        spread.collect()
    }
}

/// Columns and rows of a layer's texture; 1 where it was removed.
pub(super) fn size_of(textures: &Textures, layer: LayerId) -> [u32; 2] {
    let Ok(texture) = textures.texture(layer.texture()) else { return [1; 2] };
    let [width, height, _] = texture.description().geometry.size();
    [width, height]
}

/// How many texels of an image lie along a texel of a texture that holds it: of one that was halved, whose
/// last texels may stand for less than the others, a power of two.
fn side_of_texel(image: [u32; 2], texels: [u32; 2]) -> DVec2 {
    let halved = (0..u32::BITS).find(|n| image.map(|side| side.div_ceil(1 << n)) == texels);
    match halved {
        Some(n) => DVec2::splat(f64::from(1u32 << n)),
        None => DVec2::from(image.map(f64::from)) / DVec2::from(texels.map(f64::from)),
    }
}

/// A text does not say where images of unlike size lie.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("write stretched or by-texel")]
pub struct ParsePlacementError;

impl FromStr for Placement {
    type Err = ParsePlacementError;

    fn from_str(text: &str) -> Result<Placement, ParsePlacementError> {
        Placement::ALL.into_iter().find(|placement| placement.name() == text).ok_or(ParsePlacementError)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_texel_of_what_is_halved_is_a_power_of_two_wide() {
        for (image, texels, side) in [
            ([700, 500], [700, 500], [1.0, 1.0]),
            ([701, 333], [351, 167], [2.0, 2.0]),
            ([701, 333], [88, 42], [8.0, 8.0]),
            ([u32::MAX, 3], [2, 1], [f64::from(1u32 << 31); 2]),
            ([600, 333], [200, 111], [3.0, 3.0]),
            ([600, 400], [400, 100], [1.5, 4.0]),
        ] {
            assert_eq!(side_of_texel(image, texels), DVec2::from(side), "{image:?} in {texels:?}");
        }
    }

    #[test]
    fn placements_are_read_as_they_are_written() {
        for placement in Placement::ALL {
            assert_eq!(placement.to_string().parse(), Ok(placement));
        }
        assert_eq!("texel".parse::<Placement>(), Err(ParsePlacementError));
    }
}
