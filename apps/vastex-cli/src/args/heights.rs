//! What `render` and `view` are told of the heights that displace a terrain or the globe.

use clap::Args;
use vastex_scenes::Heights;

/// The options for heights that displace a terrain or the globe.
#[derive(Clone, Debug, Default, Args)]
pub(crate) struct HeightArgs {
    /// The layer of heights, by its name; on a terrain by default the one called height, or the one shown if
    /// it has one channel. With any of these options the globe is displaced as well
    #[arg(long, value_name = "NAME")]
    pub(crate) height_layer: Option<String>,
    /// How high a value of 1 rises, in widths of the terrain or radii of the globe; by default so that the
    /// heights of the whole texture rise by a twentieth
    #[arg(long, value_name = "N", value_parser = parse_finite, allow_hyphen_values = true)]
    pub(crate) height_scale: Option<f32>,
    /// The value that lies where a surface without heights would; by default the lowest, as the coarse levels
    /// have it
    #[arg(long, value_name = "N", value_parser = parse_finite, allow_hyphen_values = true)]
    pub(crate) height_zero: Option<f32>,
}

impl HeightArgs {
    /// In the words of the scenes.
    pub(crate) fn heights(&self) -> Heights {
        Heights {
            layer: self.height_layer.clone(),
            scale: self.height_scale,
            zero: self.height_zero,
            ..Heights::default()
        }
    }
}

/// A number that heights of any format can be multiplied with.
fn parse_finite(text: &str) -> Result<f32, String> {
    match text.parse() {
        Ok(number) if f32::abs(number) <= 1e9 => Ok(number),
        _ => Err("write a number between -1e9 and 1e9".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heights_are_numbers() {
        assert_eq!(parse_finite("-0.25"), Ok(-0.25));
        for bad in ["", "nan", "inf", "1e10", "high"] {
            assert!(parse_finite(bad).is_err(), "{bad}");
        }
    }
}
