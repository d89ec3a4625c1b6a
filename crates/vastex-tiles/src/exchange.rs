//! What the readers of images and those of volumes both know of the formats of others: NumPy's header, and
//! where the description of a raw file lies.

use std::path::{Path, PathBuf};

/// What stands before the values of an array of NumPy in C order, by version 1.0 of its format: a multiple of
/// 64 bytes. `kind` is NumPy's name of little-endian values, such as `u1` or `f4`, and `shape` has the length
/// of each axis, the slowest first.
///
/// ```
/// let header = vastex_tiles::npy_header("u2", &[2, 3, 4]);
/// assert!(header.len() % 64 == 0 && header.starts_with(b"\x93NUMPY\x01\x00"));
/// ```
pub fn npy_header(kind: &str, shape: &[u64]) -> Vec<u8> {
    const MAGIC: &[u8] = b"\x93NUMPY\x01\x00";
    let order = if kind.ends_with('1') { '|' } else { '<' };
    let axes: Vec<String> = shape.iter().map(u64::to_string).collect();
    let comma = if axes.len() == 1 { "," } else { "" };
    let axes = axes.join(", ");
    let mut words =
        format!("{{'descr': '{order}{kind}', 'fortran_order': False, 'shape': ({axes}{comma}), }}");
    let before = MAGIC.len() + 2;
    while !(before + words.len() + 1).is_multiple_of(64) {
        words.push(' ');
    }
    words.push('\n');
    [MAGIC, &(words.len() as u16).to_le_bytes(), words.as_bytes()].concat()
}

/// The raw file that a path names: itself, as `NAME.raw`, or by its description, as `NAME.raw.toml`; `None`
/// if it names none. Nothing is looked up.
pub fn raw_file(path: &Path) -> Option<PathBuf> {
    let ends_with =
        |path: &Path, ending| path.extension().is_some_and(|own| own.eq_ignore_ascii_case(ending));
    let raw = if ends_with(path, "toml") { path.with_extension("") } else { path.to_owned() };
    ends_with(&raw, "raw").then_some(raw)
}

/// Where the description of a raw file is: `NAME.raw.toml` of `NAME.raw`.
pub fn raw_description(raw: &Path) -> PathBuf {
    let mut path = raw.as_os_str().to_owned();
    path.push(".toml");
    path.into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_header_is_numpys() {
        for (kind, shape, words) in [
            ("u2", &[2, 3, 4][..], "{'descr': '<u2', 'fortran_order': False, 'shape': (2, 3, 4), }"),
            ("u1", &[7], "{'descr': '|u1', 'fortran_order': False, 'shape': (7,), }"),
            ("f8", &[1 << 40, 2], "{'descr': '<f8', 'fortran_order': False, 'shape': (1099511627776, 2), }"),
        ] {
            let header = npy_header(kind, shape);
            let text = String::from_utf8_lossy(&header[10..]).into_owned();
            assert!(header.len().is_multiple_of(64) && text.ends_with('\n'), "{text}");
            assert_eq!(text.trim_end(), words);
            assert_eq!(u16::from_le_bytes([header[8], header[9]]) as usize, header.len() - 10);
        }
    }

    #[test]
    fn a_raw_file_and_its_description_name_each_other() {
        let raw = |path: &str| raw_file(Path::new(path));
        assert_eq!(raw("a/b.raw"), Some("a/b.raw".into()));
        assert_eq!(raw("a/b.RAW.toml"), Some("a/b.RAW".into()));
        assert_eq!((raw("b.toml"), raw("b.tif"), raw("raw")), (None, None, None));
        assert_eq!(raw_description(Path::new("a/b.raw")), Path::new("a/b.raw.toml"));
    }
}
