//! Black and white of a layer that is seen for the first time and that nobody has said anything of, in the
//! window and in pictures of it.

use vastex::{LayerId, Textures};

use super::Histogram;
use crate::layers::{ColorMap, StoredScale};

/// Black and white of a layer that nobody has said anything of: the range by values of all of it, or of the
/// first `rows` of its rows, 0 to 1, and what there is to say of that to a person. `None` where 0 and 1 are
/// black and white ([`Histogram::first_range`]). Takes some milliseconds.
pub fn first_range(
    textures: &Textures,
    (layer, color_map): (LayerId, &ColorMap),
    rows: f64,
) -> Option<([f32; 2], String)> {
    let values = Histogram::of_image(textures, (layer, color_map), rows)?;
    let described = textures.texture(layer.texture()).ok()?.description();
    let format = described.layers.get(layer.index())?.format;
    let range = values.first_range(format)?;
    Some((range, text(StoredScale::new(format), range)))
}

/// Says what black and white are, as values are stored.
fn text(scale: StoredScale, range: [f32; 2]) -> String {
    let span = f64::from(range[1]) - f64::from(range[0]);
    let [black, white] = range.map(|value| match scale.most() {
        Some(_) => scale.stored(value).to_string(),
        None => short(value, span),
    });
    format!("black is {black} and white {white}, by the values of the image; C takes those in view")
}

/// Digits of a float of 32 bits that tell it from any other.
const MOST_DIGITS: i32 = 9;

/// A float in four digits, or in as many more as it takes to see a hundredth of the span that it ends.
fn short(value: f32, span: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    // Places of the first digit before the point.
    let place = |value: f64| value.log10().floor() as i32;
    let first = place(f64::from(value).abs());
    let last = if span.is_normal() { place(span.abs()) - 1 } else { first };
    let behind_first = (first - last).min(MOST_DIGITS - 1);
    match value.abs() {
        0.001..1e6 => {
            let decimals = (3 - first.max(0)).max(behind_first - first).max(0);
            format!("{value:.*}", decimals as usize)
        }
        _ => format!("{value:.*e}", behind_first.max(2) as usize),
    }
}

#[cfg(test)]
mod tests {
    use vastex::LayerFormat;

    use super::*;

    #[test]
    fn black_and_white_are_told_as_they_are_stored() {
        let of = |format, range| text(StoredScale::new(format), range);
        let said = of(LayerFormat::R16, [0.5, 1.0]);
        assert!(said.starts_with("black is 32768 and white 65535,"), "{said}");
        let said = of(LayerFormat::R32Float, [-412.25, 0.0625]);
        assert!(said.starts_with("black is -412.2 and white 0.062,"), "{said}");
        // They are never the same number.
        for (range, expected) in [
            ([300.01, 300.04], "black is 300.010 and white 300.040,"),
            ([0.4321, 0.4325], "black is 0.43210 and white 0.43250,"),
            ([1_234_560.0, 1_234_580.0], "black is 1.234560e6 and white 1.234580e6,"),
            ([1.0e-7, 2.0e-5], "black is 1.00e-7 and white 2.00e-5,"),
            ([16_777_214.0, 16_777_215.0], "black is 1.67772140e7 and white 1.67772150e7,"),
            ([0.0, 1.0e20], "black is 0 and white 1.00e20,"),
        ] {
            let said = of(LayerFormat::R32Float, range);
            assert!(said.starts_with(expected), "{said}");
        }
    }
}
