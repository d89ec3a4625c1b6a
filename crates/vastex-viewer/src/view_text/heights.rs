//! The heights of a scene as a text: `[NAME][:file=N][:scale=N][:zero=N]`.

use crate::surface::{Heights, LayerOptions, file_of_text};

/// What a text may say of heights, as errors have it.
const SHAPE: &str = "[NAME][:file=N][:scale=N][:zero=N]";
/// No scale and no value is farther from 0.
const MOST: f32 = 1e9;

/// The text of heights.
pub(super) fn text_of(heights: &Heights) -> String {
    let named = LayerOptions { name: heights.layer.clone(), ..LayerOptions::default() };
    let mut text = named.to_string();
    if let Some(texture) = heights.texture {
        text += &format!(":file={}", texture + 1);
    }
    for (key, number) in [("scale", heights.scale), ("zero", heights.zero)] {
        if let Some(number) = number {
            text += &format!(":{key}={number}");
        }
    }
    text
}

/// The heights of a text.
pub(super) fn of_text(text: &str) -> Result<Heights, String> {
    let mut words = text.split(':');
    let name = words.next().unwrap_or_default();
    let named: LayerOptions =
        name.parse().map_err(|_| format!("'{name}' stands where the layer's name does; write {SHAPE}"))?;
    let mut heights = Heights { layer: named.name, ..Heights::default() };
    let mut told: Vec<&str> = Vec::new();
    for word in words {
        let (key, value) = word.split_once('=').unwrap_or((word, ""));
        if told.contains(&key) {
            return Err(format!("{key} is told twice"));
        }
        told.push(key);
        let number = || match value.parse() {
            Ok(number) if f32::abs(number) <= MOST => Ok(Some(number)),
            _ => Err(format!("'{word}': write a number between -1e9 and 1e9")),
        };
        match key {
            "file" => heights.texture = Some(file_of_text(value).map_err(|why| format!("'{word}': {why}"))?),
            "scale" => heights.scale = number()?,
            "zero" => heights.zero = number()?,
            _ => return Err(format!("'{word}': no such setting of heights; write {SHAPE}")),
        }
    }
    Ok(heights)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heights_are_read_as_they_are_written() {
        let all = Heights {
            texture: Some(1),
            layer: Some("a:b; c".into()),
            scale: Some(0.010_286),
            zero: Some(-11_000.5),
            is_torn: false,
        };
        assert_eq!(of_text(&text_of(&all)), Ok(all));
        assert_eq!(text_of(&Heights { texture: Some(0), ..Heights::default() }), ":file=1");
        for (text, why) in [
            ("scale=2", "stands where"),
            (":scale=nan", "between -1e9"),
            (":scale=1:scale=2", "told twice"),
            (":file=0", "1 to 9"),
            (":high", "no such setting"),
        ] {
            let error = of_text(text).unwrap_err();
            assert!(error.contains(why), "{text}: {error}");
        }
    }
}
