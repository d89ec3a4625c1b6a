//! Where images of unlike size lie over one another.
//!
//! What becomes of it in a picture is in `surface::fixed` and in layered.wgsl.

use std::fmt;
use std::str::FromStr;

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
    fn placements_are_read_as_they_are_written() {
        for placement in Placement::ALL {
            assert_eq!(placement.to_string().parse(), Ok(placement));
        }
        assert_eq!("texel".parse::<Placement>(), Err(ParsePlacementError));
    }
}
