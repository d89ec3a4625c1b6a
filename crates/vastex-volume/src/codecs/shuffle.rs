//! The filters of Blosc: bytes, or bits, of the same weight side by side.

/// Puts the bytes of values of `width` bytes together again. Bytes that make no whole value are as they were.
pub(super) fn unshuffle(width: usize, input: &[u8], output: &mut [u8]) {
    let count = input.len() / width.max(1);
    if width < 2 || count == 0 {
        return output.copy_from_slice(input);
    }
    match width {
        2 => join_planes::<2>(planes(count, input), output),
        4 => join_planes::<4>(planes(count, input), output),
        8 => join_planes::<8>(planes(count, input), output),
        _ => {
            for (plane, bytes) in input[..width * count].chunks_exact(count).enumerate() {
                for (value, byte) in output.chunks_exact_mut(width).zip(bytes) {
                    value[plane] = *byte;
                }
            }
        }
    }
    let whole = width * count;
    output[whole..].copy_from_slice(&input[whole..]);
}

fn planes<const WIDTH: usize>(count: usize, input: &[u8]) -> [&[u8]; WIDTH] {
    std::array::from_fn(|n| &input[n * count..][..count])
}

/// Puts values together of which each plane has a byte of every one.
pub(super) fn join_planes<const WIDTH: usize>(planes: [&[u8]; WIDTH], output: &mut [u8]) {
    let values = output.as_chunks_mut::<WIDTH>().0;
    let count = planes.iter().fold(values.len(), |count, plane| count.min(plane.len()));
    let planes = planes.map(|plane| &plane[..count]);
    for (n, value) in values[..count].iter_mut().enumerate() {
        *value = std::array::from_fn(|plane| planes[plane][n]);
    }
}

/// Puts the bits of values of `width` bytes together again. Values are taken eight at a time; where their
/// number is no multiple of eight, nothing was moved.
pub(super) fn unshuffle_bits(width: usize, input: &[u8], output: &mut [u8]) {
    let count = input.len() / width.max(1);
    if width == 0 || count == 0 || !count.is_multiple_of(8) {
        return output.copy_from_slice(input);
    }
    let row = count / 8;
    for byte in 0..width {
        let rows = &input[byte * 8 * row..][..8 * row];
        for group in 0..row {
            let square = u64::from_le_bytes(std::array::from_fn(|bit| rows[bit * row + group]));
            let turned = transpose(square).to_le_bytes();
            for (n, value) in turned.into_iter().enumerate() {
                output[(8 * group + n) * width + byte] = value;
            }
        }
    }
    let whole = width * count;
    output[whole..].copy_from_slice(&input[whole..]);
}

/// Turns a square of 8x8 bits, a row a byte, about its diagonal.
fn transpose(mut square: u64) -> u64 {
    for (shift, mask) in
        [(7, 0x00aa_00aa_00aa_00aa), (14, 0x0000_cccc_0000_cccc), (28, 0x0000_0000_f0f0_f0f0)]
    {
        let moved = (square ^ (square >> shift)) & mask;
        square ^= moved ^ (moved << shift);
    }
    square
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_and_bits_come_back() {
        for width in [1, 2, 3, 4, 5, 8] {
            for count in [1, 7, 8, 24, 40] {
                for odd in 0..width {
                    let values: Vec<u8> = (0..width * count + odd).map(|n| (n * 37 + n / 5) as u8).collect();
                    let mut bytes = values.clone();
                    let mut bits = values.clone();
                    bits[..width * count].fill(0);
                    for (n, own) in values[..width * count].iter().enumerate() {
                        let (value, byte) = (n / width, n % width);
                        bytes[byte * count + value] = *own;
                        for bit in 0..8 {
                            let at = (byte * 8 + bit) * count + value;
                            bits[at / 8] |= ((own >> bit) & 1) << (at % 8);
                        }
                    }
                    let mut output = vec![0; values.len()];
                    unshuffle(width, &bytes, &mut output);
                    assert_eq!(output, values, "{width} {count} {odd}");
                    let stored = if count % 8 == 0 { &bits } else { &values };
                    unshuffle_bits(width, stored, &mut output);
                    assert_eq!(output, values, "bits {width} {count} {odd}");
                }
            }
        }
    }
}
