//! Strips and tiles of one bit that are compressed as fax machines of Group 4 send pages (ITU-T T.6), as
//! scans of documents mostly are.

use std::io::{self, BufRead, Read};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use fax::decoder::{DecodeStatus, Group4Decoder};

use crate::image::quiet;

/// Bytes that a row may have beside those of its texels. The decoder keeps all changes of a row, of which a
/// code of some bits is one, so that a row without an end would take as much memory as the file is long.
const SPARE_BYTES: usize = 64 << 10;
/// Bytes of the longest codes of a texel, and more.
const TEXEL_BYTES: usize = 8;

/// Decodes a strip or tile of so many columns and rows, as [`FaxRows`] does.
pub(super) fn decode(stored: &[u8], size: [u32; 2], is_reversed: bool) -> Result<Vec<u8>, String> {
    let mut rows = FaxRows::new(stored, size, is_reversed)?;
    let mut page = vec![0; rows.row.len() * size[1] as usize];
    rows.read_exact(&mut page).map_err(|error| error.to_string())?;
    Ok(page)
}

/// The rows of a strip or tile while it is decoded: a bit for a texel, 0 where the page is white, rows from a
/// byte on. Rows that end the page may be missing, and are white.
pub(super) struct FaxRows<'a> {
    decoder: Group4Decoder<Stored<'a>>,
    /// Bytes that may be read for the row that is being decoded.
    left: Arc<AtomicUsize>,
    width: u16,
    rows: u32,
    /// Rows that were decoded.
    done: u32,
    /// True if the page says that it has no more rows.
    is_ended: bool,
    /// The row that is given out, and how many of its bytes were.
    row: Vec<u8>,
    given: usize,
}

/// What is stored, byte by byte.
type Stored<'a> = Box<dyn Iterator<Item = io::Result<u8>> + Send + 'a>;

impl<'a> FaxRows<'a> {
    /// Begins to decode a page of so many columns and rows; else says what is wrong with it. `is_reversed`
    /// says that the lowest bit of each stored byte comes first.
    pub(super) fn new(
        stored: impl BufRead + Send + 'a,
        [columns, rows]: [u32; 2],
        is_reversed: bool,
    ) -> Result<FaxRows<'a>, String> {
        let width =
            u16::try_from(columns).map_err(|_| format!("it has {columns} columns; fax has 65535 at most"))?;
        let row = vec![0; usize::from(width).div_ceil(8)];
        let left = Arc::new(AtomicUsize::new(most_of_row(width)));
        let counted = left.clone();
        let bytes: Stored<'a> = Box::new(stored.bytes().map(move |byte| {
            let left = counted.load(Ordering::Relaxed);
            let left = left.checked_sub(1).ok_or_else(|| io::Error::other("a row does not end"))?;
            counted.store(left, Ordering::Relaxed);
            byte.map(|byte| if is_reversed { byte.reverse_bits() } else { byte })
        }));
        let decoder = Group4Decoder::new(bytes, width).map_err(|error| error.to_string())?;
        let given = row.len();
        Ok(FaxRows { decoder, left, width, rows, done: 0, is_ended: false, row, given })
    }

    fn next_row(&mut self) -> Result<(), String> {
        let FaxRows { decoder, left, width, rows, done, is_ended, row, given } = self;
        row.fill(0);
        left.store(most_of_row(*width), Ordering::Relaxed);
        if !*is_ended {
            let ended = quiet::catch(|| match decoder.advance() {
                Ok(DecodeStatus::Incomplete) if !is_row(decoder.transition(), *width) => {
                    Err(format!("row {done} of {rows} goes back and forth"))
                }
                Ok(DecodeStatus::Incomplete) => {
                    blacken(row, decoder.transition(), *width);
                    Ok(false)
                }
                Ok(DecodeStatus::End) => Ok(true),
                Err(_) => Err(format!("after {done} rows of {rows} it ends or makes no sense")),
            });
            *is_ended = ended.map_err(|_| "it cannot be decoded".to_owned())??;
        }
        (*done, *given) = (*done + 1, 0);
        Ok(())
    }
}

impl Read for FaxRows<'_> {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        if self.given == self.row.len() {
            if self.done == self.rows || bytes.is_empty() {
                return Ok(0);
            }
            self.next_row().map_err(|why| io::Error::new(io::ErrorKind::InvalidData, why))?;
        }
        let count = bytes.len().min(self.row.len() - self.given);
        bytes[..count].copy_from_slice(&self.row[self.given..][..count]);
        self.given += count;
        Ok(count)
    }
}

/// Bytes that a row of so many columns may have.
fn most_of_row(width: u16) -> usize {
    usize::from(width) * TEXEL_BYTES + SPARE_BYTES
}

/// Returns true for changes that a row can have. The decoder takes others, which may be as many as there are
/// bits, and searches all of them for each code of the next row.
fn is_row(changes: &[u16], width: u16) -> bool {
    changes.len() <= usize::from(width) + 2 && changes.is_sorted()
}

/// Sets the bits of a row's black runs: from the first, third, ... of its changes up to the next one.
fn blacken(row: &mut [u8], changes: &[u16], width: u16) {
    for run in changes.chunks(2) {
        let end = run.get(1).copied().unwrap_or(width).min(width);
        for column in run[0]..end {
            row[usize::from(column / 8)] |= 0x80 >> (column % 8);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fax::encoder::Encoder;
    use fax::{Color, VecWriter};

    /// Runs of all lengths up to one that is wider than a code, which cross bytes and rows.
    fn page(columns: u16, rows: u16) -> Vec<Vec<Color>> {
        let is_black = |x: u16, y: u16| (u32::from(x) * (u32::from(y) + 3) / 70).is_multiple_of(3);
        let texel = |x: u16, y: u16| if is_black(x, y) { Color::Black } else { Color::White };
        (0..rows).map(|y| (0..columns).map(|x| texel(x, y)).collect()).collect()
    }

    /// Each row's changes are looked through for each code of the next row, so that a row of as many changes
    /// as there are bits would take days.
    #[test]
    fn a_row_that_goes_back_and_forth_is_refused() {
        assert!(is_row(&[], 1) && is_row(&[0, 1], 1) && is_row(&[3, 3, 9], 10));
        assert!(!is_row(&[17, 18, 17, 18], 64) && !is_row(&[5; 13], 10));
        let refused = |times: usize| {
            // A row of 20 white texels and a black one.
            let mut bits = ["001", "0001000", "010", "1"].concat();
            // Three to the left of its changes, 17 and 18 by turns, and then to the end.
            bits += &"0000010".repeat(times);
            bits += "1111";
            let bytes: Vec<u8> = bits
                .as_bytes()
                .chunks(8)
                .map(|eight| eight.iter().enumerate().map(|(n, bit)| (bit & 1) << (7 - n)).sum())
                .collect();
            decode(&bytes, [64, 3], false).unwrap_err()
        };
        assert!(refused(8000).contains("row 1 of 3 goes back"), "{}", refused(8000));
        // So many changes are not even kept.
        assert!(refused(100_000).contains("after 1 rows of 3"), "{}", refused(100_000));
    }

    #[test]
    fn a_page_is_what_was_sent() {
        for (columns, rows) in [(1, 1), (8, 3), (75, 40), (3000, 9)] {
            let page = page(columns, rows);
            let mut encoder = Encoder::new(VecWriter::new());
            for row in &page {
                encoder.encode_line(row.iter().copied(), columns).unwrap();
            }
            let stored = encoder.finish().unwrap().finish();
            let reversed: Vec<u8> = stored.iter().map(|byte| byte.reverse_bits()).collect();
            let size = [columns.into(), rows.into()];
            let decoded = decode(&stored, size, false).unwrap();
            assert_eq!(decode(&reversed, size, true).unwrap(), decoded);
            let rows = decoded.chunks(usize::from(columns).div_ceil(8));
            for (row, found) in page.iter().zip(rows) {
                let bit = |n: usize| found[n / 8] & (0x80 >> (n % 8)) != 0;
                assert!((0..row.len()).all(|n| bit(n) == (row[n] == Color::Black)), "{columns} columns");
            }
        }
    }

    #[test]
    fn nonsense_is_told_and_missing_rows_are_white() {
        // An extension of T.6, which nobody writes.
        assert!(decode(&[0x02; 8], [100, 10], false).unwrap_err().contains("after 0 rows of 10"));
        assert!(decode(&[0xff; 8], [70_000, 1], false).unwrap_err().contains("70000 columns"));
        // The end of the page alone.
        assert_eq!(decode(&[0x00, 0x10, 0x01, 0], [9, 2], false).unwrap(), [0; 4]);
    }
}
