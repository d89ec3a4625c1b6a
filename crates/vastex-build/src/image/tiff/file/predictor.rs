//! What undoes the predictors of TIFF: rows of samples, in the file's byte order before, little-endian after.

/// Samples of one row that are stored as they are: puts their bytes in order.
pub(super) fn in_order(row: &mut [u8], bytes: usize, is_big_endian: bool) {
    if is_big_endian && bytes > 1 {
        row.chunks_exact_mut(bytes).for_each(<[u8]>::reverse);
    }
}

/// Samples that are differences from those `channels` before, little-endian already.
pub(super) fn horizontal(row: &mut [u8], channels: usize, bytes: usize) {
    match bytes {
        1 => {
            for n in channels..row.len() {
                row[n] = row[n].wrapping_add(row[n - channels]);
            }
        }
        2 => sum(row.as_chunks_mut().0, channels, |a, b| {
            u16::from_le_bytes(a).wrapping_add(u16::from_le_bytes(b)).to_le_bytes()
        }),
        4 => sum(row.as_chunks_mut().0, channels, |a, b| {
            u32::from_le_bytes(a).wrapping_add(u32::from_le_bytes(b)).to_le_bytes()
        }),
        _ => sum(row.as_chunks_mut().0, channels, |a, b| {
            u64::from_le_bytes(a).wrapping_add(u64::from_le_bytes(b)).to_le_bytes()
        }),
    }
}

fn sum<const N: usize>(row: &mut [[u8; N]], channels: usize, add: impl Fn([u8; N], [u8; N]) -> [u8; N]) {
    for n in channels..row.len() {
        row[n] = add(row[n], row[n - channels]);
    }
}

/// Floats whose bytes were put apart, the highest of all first, and then stored as differences.
pub(super) fn floating(row: &mut [u8], channels: usize, bytes: usize) {
    horizontal(row, channels, 1);
    let count = row.len() / bytes;
    let apart = row.to_vec();
    for (n, to) in row.chunks_exact_mut(bytes).enumerate() {
        for (byte, to) in to.iter_mut().rev().enumerate() {
            *to = apart[byte * count + n];
        }
    }
}
