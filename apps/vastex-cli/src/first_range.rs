//! Black and white of a layer that is seen for the first time and that nobody has said anything of, in the
//! window and in pictures of it.

use vastex::{LayerId, Textures};
use vastex_viewer::inspect::Histogram;
use vastex_viewer::layers::{ColorMap, StoredScale};

/// The range of a layer by values of all of it, or of a share of its rows, and what there is to say of it;
/// `None` where 0 and 1 are black and white ([`Histogram::first_range`]).
pub(crate) fn first_range(
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
    let [black, white] = range.map(|value| match scale.most() {
        Some(_) => scale.stored(value).to_string(),
        None => short(value),
    });
    format!("black is {black} and white {white}, by the values of the image; C takes those in view")
}

/// A float in four digits.
fn short(value: f32) -> String {
    match value.abs() {
        0.0 => "0".to_owned(),
        0.001..1e6 => {
            let before_point = value.abs().log10().floor().max(0.0) as usize + 1;
            format!("{value:.*}", 4usize.saturating_sub(before_point))
        }
        _ => format!("{value:.2e}"),
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
    }
}
