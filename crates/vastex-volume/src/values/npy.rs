//! The header of an array of NumPy, version 1.0 of its format.

use super::DType;

/// What stands before the values of an array in C order: a multiple of 64 bytes.
pub fn npy_header(dtype: DType, shape: &[u64]) -> Vec<u8> {
    let order = if dtype.bytes() == 1 { '|' } else { '<' };
    let axes: Vec<String> = shape.iter().map(u64::to_string).collect();
    let comma = if axes.len() == 1 { "," } else { "" };
    let mut words = format!(
        "{{'descr': '{order}{}', 'fortran_order': False, 'shape': ({}{comma}), }}",
        dtype.short_name(),
        axes.join(", ")
    );
    const MAGIC: &[u8] = b"\x93NUMPY\x01\x00";
    let before = MAGIC.len() + 2;
    while !(before + words.len() + 1).is_multiple_of(64) {
        words.push(' ');
    }
    words.push('\n');
    [MAGIC, &(words.len() as u16).to_le_bytes(), words.as_bytes()].concat()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_header_is_numpys() {
        let header = npy_header(DType::U16, &[2, 3, 4]);
        let text = String::from_utf8_lossy(&header[10..]).into_owned();
        assert!(header.len().is_multiple_of(64) && text.ends_with('\n'));
        assert!(text.starts_with("{'descr': '<u2', 'fortran_order': False, 'shape': (2, 3, 4), }"), "{text}");
    }
}
