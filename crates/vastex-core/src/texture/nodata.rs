//! The value of texels of which nothing is known, as files of measured numbers have one.

use std::fmt;
use std::str::FromStr;

/// The value that stands for "nothing is known here" in a layer, as texels store it: 0 to 255 or 65,535 of
/// whole numbers, else a number of a 32-bit float, infinite ones included. A texel is without data where all
/// of its colours have the value. In layers of floats what is no number (NaN) is without data, too, and the
/// value may be NaN itself.
///
/// As a text it is the number, or `nan`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct NodataValue {
    /// Of the float, one for each number: 0 has no sign, and there is one NaN.
    bits: u32,
}

impl NodataValue {
    /// A value; it may be no number.
    pub fn new(value: f32) -> NodataValue {
        let value = match value {
            _ if value.is_nan() => f32::NAN,
            _ if value == 0.0 => 0.0,
            _ => value,
        };
        NodataValue { bits: value.to_bits() }
    }

    /// The value; it may be no number.
    pub fn value(self) -> f32 {
        f32::from_bits(self.bits)
    }
}

impl fmt::Display for NodataValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.value() {
            value if value.is_nan() => f.write_str("nan"),
            // The shortest text that leads back to the value.
            value if value == 0.0 || (1e-5..1e16).contains(&value.abs()) => write!(f, "{value}"),
            value => write!(f, "{value:e}"),
        }
    }
}

/// A text is no number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the value that stands for no data is a number or nan, as in -9999")]
pub struct NodataValueError;

impl FromStr for NodataValue {
    type Err = NodataValueError;

    fn from_str(text: &str) -> Result<NodataValue, NodataValueError> {
        text.parse().map(NodataValue::new).map_err(|_| NodataValueError)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_what_their_text_says() {
        for text in ["-9999", "0", "65535", "nan", "-3.4028235e38", "0.1", "1e-40", "inf"] {
            assert_eq!(text.parse::<NodataValue>().unwrap().to_string(), text);
        }
        assert_eq!(NodataValue::new(-0.0), NodataValue::new(0.0));
        assert_eq!("NaN".parse::<NodataValue>().unwrap(), NodataValue::new(-f32::NAN));
        assert!("none".parse::<NodataValue>().is_err());
    }
}
