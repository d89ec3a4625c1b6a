//! The bits of a scan: bytes of the file without what is stuffed among them, up to a marker.

use std::io::{self, BufRead};

use super::huffman::Codes;
use super::stop::Stop;

/// Bits that are there, if the data has them, before a difference is decoded: the longest code and the bits
/// that follow it.
const MOST_BITS: u32 = 32;

/// What the data of a scan runs into.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Bound {
    Marker(u8),
    EndOfFile,
}

/// A file, read by bits where there is coded data, and by bytes elsewhere.
pub(super) struct Bits<R> {
    file: R,
    /// The next bits, the first one highest, and how many there are; all others are 0.
    held: u64,
    count: u32,
    bound: Option<Bound>,
}

impl<R: BufRead> Bits<R> {
    pub(super) fn new(file: R) -> Bits<R> {
        Bits { file, held: 0, count: 0, bound: None }
    }

    /// The file, behind what was taken of it: for segments.
    pub(super) fn file(&mut self) -> &mut R {
        &mut self.file
    }

    /// Coded data begins here.
    pub(super) fn begin(&mut self) {
        (self.held, self.count, self.bound) = (0, 0, None);
    }

    /// The marker that the data ran into, if it did so already.
    pub(super) fn take_marker(&mut self) -> Option<u8> {
        match self.bound.take() {
            Some(Bound::Marker(marker)) => Some(marker),
            _ => None,
        }
    }

    /// Decodes the next difference between two coefficients: a code of `table`, which says how many bits
    /// follow, and those.
    #[inline]
    pub(super) fn difference(&mut self, table: &Codes) -> Result<i32, Stop> {
        if self.count < MOST_BITS {
            self.fill()?;
        }
        let Some((code, bits)) = table.find((self.held >> 48) as u16) else {
            return Err(self.missing("a code of its first scan means nothing"));
        };
        if code + bits > self.count {
            return Err(self.missing("its first scan is too short"));
        }
        self.count -= code + bits;
        self.held <<= code;
        if bits == 0 {
            return Ok(0);
        }
        let value = (self.held >> (64 - bits)) as i32;
        self.held <<= bits;
        // Half of the numbers of so many bits are negative: those whose first bit is 0.
        Ok(if value < 1 << (bits - 1) { value - (1 << bits) + 1 } else { value })
    }

    /// Passes over the AC coefficients of a block.
    #[inline]
    pub(super) fn pass_over_ac(&mut self, codes: &Codes) -> Result<(), Stop> {
        const COEFFICIENTS: u32 = 64;
        const SIXTEEN_ZEROS: u32 = 0xf0;
        let mut next = 1;
        while next < COEFFICIENTS {
            if self.count < MOST_BITS {
                self.fill()?;
            }
            let Some((code, symbol)) = codes.find((self.held >> 48) as u16) else {
                return Err(self.missing("a code of its first scan means nothing"));
            };
            let (zeros, bits) = (symbol >> 4, symbol & 15);
            if code + bits > self.count {
                return Err(self.missing("its first scan is too short"));
            }
            self.count -= code + bits;
            self.held <<= code + bits;
            if bits == 0 && symbol != SIXTEEN_ZEROS {
                break;
            }
            next += zeros + 1;
        }
        Ok(())
    }

    /// Passes over what fills the last byte up, and the marker after which decoding begins anew.
    pub(super) fn restart(&mut self, number: u8) -> Result<(), Stop> {
        const FIRST_RESTART: u8 = 0xd0;
        if self.count < 8 && self.bound.is_none() {
            self.fill()?;
        }
        match self.bound {
            Some(Bound::Marker(marker)) if self.count < 8 && marker == FIRST_RESTART + number => {
                self.begin();
                Ok(())
            }
            _ => Err(self.missing("a restart marker of its first scan is missing")),
        }
    }

    /// Passes over coded data that is of no use, `left` bytes of it at most, up to the marker behind it.
    pub(super) fn pass_over(&mut self, left: &mut u64) -> Result<(), Stop> {
        self.begin();
        loop {
            let bytes = self.file.fill_buf()?;
            let plain = bytes.iter().position(|&byte| byte == 0xff).unwrap_or(bytes.len());
            self.file.consume(plain);
            // What may be a marker counts like a byte.
            *left = left
                .checked_sub(plain as u64 + 1)
                .ok_or(Stop::Damaged("the first scans of its components are too far apart"))?;
            if self.byte()?.is_none() {
                match self.bound {
                    // Data follows after a restart.
                    Some(Bound::Marker(0xd0..=0xd7)) => self.bound = None,
                    Some(Bound::Marker(_)) => return Ok(()),
                    _ => return Err(Stop::Ended),
                }
            }
        }
    }

    /// What is wrong where more is expected: the file ends, or else `why`.
    fn missing(&self, why: &'static str) -> Stop {
        if self.bound == Some(Bound::EndOfFile) { Stop::Ended } else { Stop::Damaged(why) }
    }

    /// Takes bytes as long as there is room for one, and none beyond the data.
    fn fill(&mut self) -> io::Result<()> {
        while self.count <= 56 && self.bound.is_none() {
            let Some(byte) = self.byte()? else { break };
            self.held |= u64::from(byte) << (56 - self.count);
            self.count += 8;
        }
        Ok(())
    }

    /// The next byte of the data. `None` at its end, of which a note is taken.
    fn byte(&mut self) -> io::Result<Option<u8>> {
        let byte = next_byte(&mut self.file)?;
        let bound = match byte {
            None => Bound::EndOfFile,
            Some(0xff) => loop {
                match next_byte(&mut self.file)? {
                    // Stuffed, so that the byte before is no marker.
                    Some(0) => return Ok(Some(0xff)),
                    Some(0xff) => {}
                    Some(marker) => break Bound::Marker(marker),
                    None => break Bound::EndOfFile,
                }
            },
            byte => return Ok(byte),
        };
        self.bound = Some(bound);
        Ok(None)
    }
}

#[inline]
fn next_byte(file: &mut impl BufRead) -> io::Result<Option<u8>> {
    let byte = file.fill_buf()?.first().copied();
    file.consume(usize::from(byte.is_some()));
    Ok(byte)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Codes 0 to 10 of four bits each, which are as many bits as follow.
    fn table() -> Codes {
        let mut counts = [0; 16];
        counts[3] = 11;
        Codes::of_dc(&counts, &(0..11).collect::<Vec<u8>>()).unwrap()
    }

    #[test]
    fn differences_are_read_up_to_a_marker() {
        // Of 3 bits 101 is 5, and 010 is -5.
        let data = [0b0011_1010, 0b0110_1011, 0b1100_0000, 0xff, 0xd9];
        let mut bits = Bits::new(&data[..]);
        bits.begin();
        assert_eq!(bits.difference(&table()).unwrap(), 5);
        assert_eq!(bits.difference(&table()).unwrap(), -5);
        assert!(matches!(bits.difference(&table()), Err(Stop::Damaged(_))), "a code that there is not");
        // Of 8 bits a byte that has another one behind it, so that it is no marker; then two before one.
        let data = [0b0000_1000, 0xff, 0x00, 0xff, 0xff, 0xd3, 0b0000_1111];
        let mut bits = Bits::new(&data[..]);
        bits.begin();
        assert_eq!(bits.difference(&table()).unwrap(), 0);
        assert_eq!(bits.difference(&table()).unwrap(), 255);
        assert!(matches!(bits.difference(&table()), Err(Stop::Damaged(_))), "no restart was asked for");
        let mut bits = Bits::new(&[0b0000_1111, 0xff, 0xd3, 0b0000_1111][..]);
        bits.begin();
        assert_eq!(bits.difference(&table()).unwrap(), 0);
        assert!(matches!(bits.restart(2), Err(Stop::Damaged(_))), "another one is there");
        bits.restart(3).unwrap();
        assert_eq!(bits.difference(&table()).unwrap(), 0);
        assert!(matches!(bits.difference(&table()), Err(Stop::Ended)));
        assert!(matches!(bits.restart(4), Err(Stop::Ended)));
        assert_eq!(bits.take_marker(), None);
        let mut bits = Bits::new(&[0x00, 0x00, 0xff, 0xd0][..]);
        bits.begin();
        assert_eq!(bits.difference(&table()).unwrap(), 0);
        assert!(matches!(bits.restart(0), Err(Stop::Damaged(_))), "more than a byte is left");
        assert_eq!(bits.take_marker(), Some(0xd0));
    }
}
