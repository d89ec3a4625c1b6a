//! The header of an array of NumPy by its kind of values.

use super::DType;

/// What stands before the values of an array in C order: a multiple of 64 bytes.
pub fn npy_header(dtype: DType, shape: &[u64]) -> Vec<u8> {
    vastex_tiles::npy_header(dtype.short_name(), shape)
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
