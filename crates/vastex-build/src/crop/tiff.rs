//! The header of a TIFF file of uncompressed strips; rows follow it as they are.

use super::shape::Shape;
use crate::image::stored_as::StoredAs;

/// Bytes of a strip, where that is at least one row.
const STRIP_BYTES: u64 = 256 << 10;
/// Kinds of values.
const SHORT: u16 = 3;
const LONG: u16 = 4;
const LONG8: u16 = 16;
/// Bytes that a classic file may have.
const MOST_CLASSIC: u64 = u32::MAX as u64;

/// What stands before the rows: BigTIFF where a classic file could not hold them.
pub(super) fn header(shape: &Shape) -> Vec<u8> {
    let bytes = shape.row_bytes() * u64::from(shape.size[1]);
    let header = of_kind(shape, false);
    if header.len() as u64 + bytes <= MOST_CLASSIC { header } else { of_kind(shape, true) }
}

fn of_kind(shape: &Shape, is_big: bool) -> Vec<u8> {
    let [width, height] = shape.size;
    let rows = ((STRIP_BYTES / shape.row_bytes().max(1)) as u32).clamp(1, height);
    let strips = height.div_ceil(rows);
    let (word, entry_bytes, first, long) = if is_big { (8, 20, 16, LONG8) } else { (4, 12, 8, LONG) };
    let beyond = |colors: u16| usize::from(shape.channels - colors);
    let (photometric, extra) = match (&shape.of, shape.channels) {
        (StoredAs::Grey { is_white_zero: true, .. }, 1) => (0, Vec::new()),
        (StoredAs::Palette(_), 1) => (3, Vec::new()),
        (StoredAs::Inks { extra }, 4..) => {
            (5, extra.iter().copied().chain(std::iter::repeat(0)).take(beyond(4)).collect())
        }
        (StoredAs::InvertedInks, _) => (1, vec![0; beyond(1)]),
        (_, 1) => (1, Vec::new()),
        (_, 3) => (2, Vec::new()),
        // Unassociated alpha.
        (_, 4) => (2, vec![2]),
        _ => (1, vec![0; beyond(1)]),
    };
    let channels = usize::from(shape.channels);
    let bits = u64::from(shape.bits());
    let lengths = (0..strips).map(|n| u64::from(rows.min(height - n * rows)) * shape.row_bytes());
    let mut entries: Vec<(u16, u16, Vec<u64>)> = vec![
        (256, LONG, vec![width.into()]),
        (257, LONG, vec![height.into()]),
        (258, SHORT, vec![bits; channels]),
        (259, SHORT, vec![1]),
        (262, SHORT, vec![photometric]),
        (273, long, vec![0; strips as usize]),
        (277, SHORT, vec![channels as u64]),
        (278, LONG, vec![rows.into()]),
        (279, long, lengths.collect()),
        (284, SHORT, vec![1]),
    ];
    if let StoredAs::Palette(palette) = &shape.of {
        entries.push((320, SHORT, color_map(&palette.colors, 1 << bits)));
    }
    if !extra.is_empty() {
        entries.push((338, SHORT, extra));
    }
    entries.push((339, SHORT, vec![u64::from(shape.number.sample_format()); channels]));
    let value_bytes = |kind| match kind {
        SHORT => 2,
        LONG => 4,
        _ => 8,
    };
    let count_bytes = if is_big { 8 } else { 2 };
    let directory = count_bytes + entries.len() * entry_bytes + word;
    let lists: usize = entries
        .iter()
        .map(|(_, kind, values)| values.len() * value_bytes(*kind))
        .filter(|bytes| *bytes > word)
        .map(|bytes| bytes.next_multiple_of(8))
        .sum();
    let data = (first + directory + lists).next_multiple_of(16);
    for (tag, _, values) in &mut entries {
        if *tag == 273 {
            let strip = u64::from(rows) * shape.row_bytes();
            values.iter_mut().zip(0..).for_each(|(offset, n)| *offset = data as u64 + n * strip);
        }
    }
    let mut out = match is_big {
        true => [&b"II\x2b\0\x08\0\0\0"[..], &(first as u64).to_le_bytes()].concat(),
        false => [&b"II\x2a\0"[..], &(first as u32).to_le_bytes()].concat(),
    };
    let put = |out: &mut Vec<u8>, value: u64, bytes: usize| out.extend(&value.to_le_bytes()[..bytes]);
    put(&mut out, entries.len() as u64, count_bytes);
    let mut behind = Vec::new();
    for (tag, kind, values) in &entries {
        put(&mut out, (*tag).into(), 2);
        put(&mut out, (*kind).into(), 2);
        put(&mut out, values.len() as u64, word);
        let mut bytes = Vec::new();
        values.iter().for_each(|value| put(&mut bytes, *value, value_bytes(*kind)));
        if bytes.len() <= word {
            bytes.resize(word, 0);
            out.extend(bytes);
        } else {
            put(&mut out, (first + directory + behind.len()) as u64, word);
            bytes.resize(bytes.len().next_multiple_of(8), 0);
            behind.extend(bytes);
        }
    }
    put(&mut out, 0, word);
    out.extend(behind);
    out.resize(data, 0);
    out
}

/// All of red, then of green, then of blue, in 16 bits.
fn color_map(colors: &[[u8; 3]], count: usize) -> Vec<u64> {
    let of = |channel: usize| {
        let values = colors.iter().map(move |color| 257 * u64::from(color[channel]));
        values.chain(std::iter::repeat(0)).take(count)
    };
    (0..3).flat_map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Number;

    #[test]
    fn a_file_that_is_too_large_for_a_classic_one_is_big() {
        let of = StoredAs::default;
        let shape = |side| Shape { size: [side; 2], channels: 4, number: Number::F64, of: of() };
        assert!(header(&shape(11_500)).starts_with(b"II\x2a\0"));
        let big = header(&shape(11_600));
        assert!(big.starts_with(b"II\x2b\0\x08\0\0\0\x10"));
        assert_eq!(big.len() % 16, 0);
    }
}
