//! How a layer is shown, as a text: `NAME` and its settings, each after a colon, as `--layer` of the program
//! takes them.
//!
//! `height:range=0..0.2:map=viridis:opacity=0.5`. What is as it is by default is left out, the name of a
//! texture's first layer too. A colon, a semicolon, a percent sign or a space in a name is written by its
//! code, as in web addresses: `%3A`.

use std::fmt;
use std::str::FromStr;

use vastex::Filter;

use super::display_options::LayerOptions;
use crate::layers::{Bands, Curve, MOST_LAYERS, Nodata, ParsePaletteError};
use crate::words::{color_of, escaped, unescaped};

/// What a text may say of a layer, as errors have it.
const SHAPE: &str = "NAME[:file=N][:bands=B][:nodata=V][:nodata-color=RRGGBB][:range=LO..HI][:map=MAP][:exposure=E][:curve=CURVE][:log][:gamma=G][:opacity=O][:filter=FILTER][:hidden]";

/// Stops of exposure at most, in either direction: a factor of a thousand million.
pub const MOST_STOPS: f32 = 30.0;

/// A text does not say how a layer is shown.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct ParseLayerError(String);

impl fmt::Display for LayerOptions {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let usual = LayerOptions::default();
        f.write_str(&escaped(self.name.as_deref().unwrap_or_default()))?;
        if self.texture != usual.texture {
            write!(f, ":file={}", self.texture + 1)?;
        }
        if self.bands != usual.bands {
            write!(f, ":bands={}", self.bands)?;
        }
        match self.nodata {
            Nodata::OfLayer => {}
            Nodata::None => f.write_str(":nodata=off")?,
            Nodata::Value(value) => write!(f, ":nodata={value}")?,
            Nodata::NotANumber => f.write_str(":nodata=nan")?,
        }
        if let Some([red, green, blue]) = self.nodata_color {
            write!(f, ":nodata-color={red:02x}{green:02x}{blue:02x}")?;
        }
        if let Some([low, high]) = self.range {
            write!(f, ":range={low}..{high}")?;
        }
        if self.palette != usual.palette {
            write!(f, ":map={}", self.palette)?;
        }
        if self.exposure != usual.exposure {
            write!(f, ":exposure={}", self.exposure)?;
        }
        match self.curve {
            Curve::Linear => {}
            Curve::Log => f.write_str(":log")?,
            curve => write!(f, ":curve={}", curve.name())?,
        }
        if self.gamma != usual.gamma {
            write!(f, ":gamma={}", self.gamma)?;
        }
        if self.opacity != usual.opacity {
            write!(f, ":opacity={}", self.opacity)?;
        }
        if let Some(filter) = self.filter {
            write!(f, ":filter={filter}")?;
        }
        if !self.is_visible {
            f.write_str(":hidden")?;
        }
        Ok(())
    }
}

impl FromStr for LayerOptions {
    type Err = ParseLayerError;

    fn from_str(text: &str) -> Result<LayerOptions, ParseLayerError> {
        let mut words = text.split(':');
        let name = words.next().filter(|name| !name.is_empty());
        if let Some(setting) = name.filter(|name| name.contains('=')) {
            let why = format!("'{setting}' stands where the layer's name does; write {SHAPE}");
            return Err(ParseLayerError(why));
        }
        let mut layer = LayerOptions { name: name.map(unescaped), ..LayerOptions::default() };
        let mut told: Vec<&str> = Vec::new();
        for word in words {
            let (key, value) = word.split_once('=').unwrap_or((word, ""));
            // That is a curve, too.
            let topic = if key == "log" { "curve" } else { key };
            if told.contains(&topic) {
                return Err(ParseLayerError(format!("{topic} is told twice")));
            }
            told.push(topic);
            set(&mut layer, key, value).map_err(|why| ParseLayerError(format!("'{word}': {why}")))?;
        }
        Ok(layer)
    }
}

fn set(layer: &mut LayerOptions, key: &str, value: &str) -> Result<(), String> {
    let number = |least: f32, most: f32, example: &str| match value.parse() {
        Ok(number) if (least..=most).contains(&number) => Ok(number),
        _ => Err(format!("write a number from {least} to {most}, as in {example}")),
    };
    match key {
        "file" => layer.texture = file_of_text(value)?,
        "bands" => layer.bands = value.parse::<Bands>().map_err(|error| error.to_string())?,
        "nodata" => layer.nodata = value.parse::<Nodata>().map_err(|error| error.to_string())?,
        "nodata-color" => {
            let why = "write red, green and blue by two hexadecimal digits each, as in nodata-color=ff0080";
            layer.nodata_color = Some(color_of(value).ok_or(why)?);
        }
        "range" => layer.range = Some(range_of(value, "..")?),
        "map" => {
            layer.palette = value.parse().map_err(|error: ParsePaletteError| error.to_string())?;
        }
        "exposure" => layer.exposure = number(-MOST_STOPS, MOST_STOPS, "exposure=1.5")?,
        "curve" => {
            let curves = || Curve::ALL.map(Curve::name).join(", ");
            layer.curve =
                Curve::named(value).ok_or_else(|| format!("no such curve; there are {}", curves()))?;
        }
        "gamma" => layer.gamma = number(0.01, 100.0, "gamma=0.5")?,
        "opacity" => layer.opacity = number(0.0, 1.0, "opacity=0.5")?,
        "filter" => layer.filter = Some(value.parse::<Filter>().map_err(|error| error.to_string())?),
        "log" if value.is_empty() => layer.curve = Curve::Log,
        "hidden" if value.is_empty() => layer.is_visible = false,
        _ => return Err(format!("no such setting of a layer; write {SHAPE}")),
    }
    Ok(())
}

/// Which of the textures a text names, counted from 1 there and from 0 here.
pub(crate) fn file_of_text(text: &str) -> Result<usize, String> {
    // The first file, and beside it as many as a list has layers.
    const MOST: usize = MOST_LAYERS + 1;
    match text.parse() {
        Ok(file @ 1..=MOST) => Ok(file - 1),
        _ => Err(format!("write the number of a file, 1 to {MOST}, as in file=2")),
    }
}

/// The values for black and white, with a word between them: two different numbers. The first may be the
/// larger one, which turns black and white round.
pub fn range_of(text: &str, between: &str) -> Result<[f32; 2], String> {
    let ends = text
        .split_once(between)
        .and_then(|(low, high)| Some([low.trim().parse().ok()?, high.trim().parse().ok()?]));
    match ends {
        Some([low, high])
            if f32::is_finite(low) && f32::is_finite(high) && (1.0 / (high - low)).is_finite() =>
        {
            Ok([low, high])
        }
        Some(_) => Err("both must be numbers, and not the same".into()),
        None => Err(format!("write the values for black and white, as in 0{between}0.5")),
    }
}
