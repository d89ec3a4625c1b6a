//! Which values of a layer are shown: which of its channels, and which value stands for none.

use std::fmt;
use std::str::FromStr;

use vastex::{Layer, NodataValue};

/// The largest number of a channel in a text: a layer has at most four, but a file from which a host takes
/// some may have more.
const MOST_CHANNELS: u8 = 255;

/// Which channels of a layer are shown, counted from 0. As a text they are counted from 1: `2`, or `3,2,1`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Bands {
    /// As the layer's format has them.
    #[default]
    AsStored,
    /// One channel, as grey or in a colour map. Nothing is seen through it.
    One(u8),
    /// The channels that are red, green and blue. The fourth channel of a layer stays its alpha.
    Color([u8; 3]),
}

impl Bands {
    /// Returns true if a layer of so many channels has these bands.
    pub fn are_within(self, channels: usize) -> bool {
        let is_there = |band: u8| usize::from(band) < channels;
        match self {
            Bands::AsStored => true,
            Bands::One(band) => is_there(band),
            Bands::Color(bands) => bands.into_iter().all(is_there),
        }
    }
}

impl fmt::Display for Bands {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Bands::AsStored => f.write_str("as stored"),
            Bands::One(band) => write!(f, "{}", band + 1),
            Bands::Color([red, green, blue]) => write!(f, "{},{},{}", red + 1, green + 1, blue + 1),
        }
    }
}

/// A text names no channels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "write one channel, as in bands=2, or those that are red, green and blue, as in bands=3,2,1, counted from 1"
)]
pub struct ParseBandsError;

impl FromStr for Bands {
    type Err = ParseBandsError;

    fn from_str(text: &str) -> Result<Bands, ParseBandsError> {
        let band = |word: &str| {
            let number = word.parse().ok().filter(|number| (1..=MOST_CHANNELS).contains(number));
            number.map(|number: u8| number - 1).ok_or(ParseBandsError)
        };
        match text.split(',').collect::<Vec<_>>()[..] {
            [one] => Ok(Bands::One(band(one)?)),
            [red, green, blue] => Ok(Bands::Color([band(red)?, band(green)?, band(blue)?])),
            _ => Err(ParseBandsError),
        }
    }
}

/// The value that stands for "nothing is known here", where a layer has one. What has it is not drawn, and
/// counts in no histogram.
///
/// A texel is without data where all channels that are shown have the value (of floats within a millionth of
/// it, of whole numbers within half a step), or are no numbers or infinite.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Nodata {
    /// That of the layer ([`Layer::nodata`]), as files say it.
    #[default]
    OfLayer,
    /// None: every value is one.
    None,
    /// What is not a number, and what is infinite.
    NotANumber,
    /// This value, and what is not a number or infinite.
    Value(f64),
}

impl Nodata {
    /// The value, or none, that is meant for a layer. Blocks hold values roughly, so in a layer that is
    /// compressed in blocks none stands for no data unless it is said.
    #[must_use]
    pub fn of(self, layer: &Layer) -> Nodata {
        let of_layer = layer.nodata.filter(|_| !layer.format.is_compressed()).map(NodataValue::value);
        match (self, of_layer) {
            (Nodata::OfLayer, None) => Nodata::None,
            (Nodata::OfLayer, Some(value)) if !value.is_finite() => Nodata::NotANumber,
            (Nodata::OfLayer, Some(value)) => Nodata::Value(value.into()),
            (said, _) => said,
        }
    }

    /// This rule with its value, if it has one, by another scale.
    #[must_use]
    pub fn map(self, scale: impl FnOnce(f64) -> f64) -> Nodata {
        match self {
            Nodata::Value(value) => Nodata::Value(scale(value)),
            other => other,
        }
    }

    /// Returns true if a value stands for none, or one that is so near to it. Twin of `scene_is_nodata` in
    /// surface.wgsl.
    pub(super) fn is(self, value: f32, within: f32) -> bool {
        match self {
            Nodata::OfLayer | Nodata::None => false,
            Nodata::NotANumber => !value.is_finite(),
            Nodata::Value(_) => !value.is_finite() || (value - self.number()).abs() <= within,
        }
    }

    /// The value, for shaders; 0 where there is none.
    pub(super) fn number(self) -> f32 {
        match self {
            Nodata::Value(value) => value as f32,
            _ => 0.0,
        }
    }
}

/// A text is no value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "write the value as it is stored, as in nodata=-9999, or nodata=nan, or nodata=off where all values are data"
)]
pub struct ParseNodataError;

impl FromStr for Nodata {
    type Err = ParseNodataError;

    fn from_str(text: &str) -> Result<Nodata, ParseNodataError> {
        if text == "off" {
            return Ok(Nodata::None);
        }
        let value: f64 = text.parse().map_err(|_| ParseNodataError)?;
        if value.is_nan() {
            return Ok(Nodata::NotANumber);
        }
        // Of a float that is stored, so that shaders can be told.
        Some(value).filter(|value| (*value as f32).is_finite()).map(Nodata::Value).ok_or(ParseNodataError)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vastex::LayerFormat;

    #[test]
    fn bands_are_what_their_text_says() {
        assert_eq!("2".parse(), Ok(Bands::One(1)));
        assert_eq!("3,2,1".parse(), Ok(Bands::Color([2, 1, 0])));
        for bad in ["", "0", "256", "1,2", "1,2,3,4", "a", "1, 2,3", "-1"] {
            assert_eq!(bad.parse::<Bands>(), Err(ParseBandsError), "{bad}");
        }
        for text in ["4", "1,1,2"] {
            assert_eq!(text.parse::<Bands>().unwrap().to_string(), text);
        }
        assert!(Bands::Color([2, 1, 0]).are_within(3) && !Bands::Color([2, 1, 3]).are_within(3));
    }

    #[test]
    fn a_value_stands_for_none() {
        assert_eq!("nan".parse(), Ok(Nodata::NotANumber));
        assert_eq!("off".parse(), Ok(Nodata::None));
        let least = "-3.4028234663852886e38".parse::<Nodata>().unwrap();
        let is = |value| least.is(value, 1e32);
        assert!(is(f32::MIN) && is(f32::NAN) && !is(0.0));
        for bad in ["", "inf", "1e40", "none"] {
            assert_eq!(bad.parse::<Nodata>(), Err(ParseNodataError), "{bad}");
        }
        assert!(!Nodata::None.is(f32::NAN, 1.0) && Nodata::NotANumber.is(f32::NEG_INFINITY, 0.0));
    }

    #[test]
    fn a_layer_says_which_value_stands_for_none_unless_it_is_said_otherwise() {
        let layer =
            |format, value: f32| Layer { nodata: Some(NodataValue::new(value)), ..Layer::new("a", format) };
        let heights = layer(LayerFormat::R32Float, -9999.0);
        assert_eq!(Nodata::OfLayer.of(&heights), Nodata::Value(-9999.0));
        assert_eq!(Nodata::None.of(&heights), Nodata::None);
        assert_eq!(Nodata::Value(0.0).of(&heights), Nodata::Value(0.0));
        assert_eq!(Nodata::OfLayer.of(&layer(LayerFormat::R32Float, f32::NAN)), Nodata::NotANumber);
        assert_eq!(
            Nodata::OfLayer.of(&layer(LayerFormat::Rgba16Float, f32::NEG_INFINITY)),
            Nodata::NotANumber
        );
        assert_eq!(Nodata::OfLayer.of(&layer(LayerFormat::Bc4, 0.0)), Nodata::None);
        assert_eq!(Nodata::OfLayer.of(&Layer::new("a", LayerFormat::R8)), Nodata::None);
    }
}
