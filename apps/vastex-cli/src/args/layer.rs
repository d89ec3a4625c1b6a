//! `--layer NAME=FILE[:FORMAT[:FILTER]]`: one layer of a texture on the command line.

use std::path::Path;

use vastex_build::{LayerFilter, LayerInput};
use vastex_core::LayerFormat;

/// Reads the argument from the right, since a file's name may hold colons: only what names a format, and a
/// filter after it, is taken off. An empty format stands for the one that suits the image.
pub(super) fn parse_layer(text: &str) -> Result<LayerInput, String> {
    let shape =
        "write NAME=FILE, and after FILE if you like :FORMAT or :FORMAT:FILTER, as in height=h.png:r16:max";
    let (name, rest) = text.split_once('=').ok_or(shape)?;
    if name.is_empty() || rest.is_empty() {
        return Err(shape.into());
    }
    let (file, format, filter) = split(rest);
    if let (None, Some((before, last))) = (format, file.rsplit_once(':'))
        && !Path::new(file).exists()
        && Path::new(before).exists()
    {
        let formats = LayerFormat::ALL.map(LayerFormat::name).join(", ");
        return Err(format!("there is no file '{file}', and '{last}' is none of the formats {formats}"));
    }
    Ok(LayerInput { name: name.into(), path: file.into(), format: format.flatten(), filter })
}

/// The file, the format where one is given (nothing in it where it is empty), and the filter.
fn split(text: &str) -> (&str, Option<Option<LayerFormat>>, Option<LayerFilter>) {
    let Some((before, last)) = text.rsplit_once(':') else { return (text, None, None) };
    if let (Ok(filter), Some((file, format))) = (last.parse(), before.rsplit_once(':'))
        && !file.is_empty()
    {
        if format.is_empty() {
            return (file, Some(None), Some(filter));
        }
        if let Some(format) = LayerFormat::named(format) {
            return (file, Some(Some(format)), Some(filter));
        }
    }
    match LayerFormat::named(last) {
        Some(format) if !before.is_empty() => (before, Some(Some(format)), None),
        _ => (text, None, None),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_names_a_format_is_taken_off_the_file() {
        use LayerFormat::{Bc5, R16};
        let max = "max".parse().ok();
        for (text, file, format, filter) in [
            ("a.tif", "a.tif", None, None),
            ("n.png:bc5", "n.png", Some(Bc5), None),
            ("h.png:r16:max", "h.png", Some(R16), max),
            ("h.png::max", "h.png", None, max),
            ("C:\\maps\\h.png", "C:\\maps\\h.png", None, None),
            ("C:\\maps\\h.png:r16", "C:\\maps\\h.png", Some(R16), None),
            ("a:b:c", "a:b:c", None, None),
            ("a:b:r16", "a:b", Some(R16), None),
            ("r16", "r16", None, None),
            (":r16", ":r16", None, None),
            ("r16:max", "r16:max", None, None),
            ("h.png:max", "h.png:max", None, None),
        ] {
            let layer = parse_layer(&format!("height={text}")).unwrap();
            assert_eq!((layer.path.as_path(), layer.format, layer.filter), (Path::new(file), format, filter));
            assert_eq!(layer.name, "height");
        }
    }

    #[test]
    fn a_name_and_a_file_are_needed() {
        for bad in ["", "a.png", "=a.png", "height="] {
            assert!(parse_layer(bad).unwrap_err().contains("NAME=FILE"), "{bad}");
        }
    }

    #[test]
    fn a_format_that_is_none_is_said() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("h.png");
        std::fs::write(&file, "x").unwrap();
        let error = parse_layer(&format!("height={}:r17", file.display())).unwrap_err();
        assert!(error.contains("'r17'") && error.contains("r16, rgba16"), "{error}");
        let colon = dir.path().join("h.png:r17");
        std::fs::write(&colon, "x").unwrap();
        assert!(parse_layer(&format!("height={}", colon.display())).is_ok());
    }
}
