//! The codes of coefficients: each says how many bits of a DC difference follow it, or how many AC
//! coefficients are 0 and how many bits of the next one follow.

use super::stop::Stop;

/// Codes of so many bits and fewer are found at once.
const QUICK_BITS: usize = 9;
/// The most bits that a difference has.
const MOST_CATEGORY: u8 = 15;

const NONSENSE: Stop = Stop::Damaged("a table of codes makes no sense");

/// A table of codes.
pub(super) struct Codes {
    /// For each beginning of a code its length, and what it stands for below that; 0 where it is longer.
    quick: [u16; 1 << QUICK_BITS],
    /// For each length, 1 to 16, the first code that is longer, as the highest of 16 bits.
    limits: [u32; 17],
    /// What is added to a code of each length for its place among the symbols.
    offsets: [i32; 17],
    symbols: Vec<u8>,
}

impl Codes {
    /// A table of DC differences with so many codes of each length from 1 bit to 16, which stand for
    /// `symbols` one after the other.
    pub(super) fn of_dc(counts: &[u8; 16], symbols: &[u8]) -> Result<Codes, Stop> {
        match symbols.iter().all(|&symbol| symbol <= MOST_CATEGORY) {
            true => Codes::new(counts, symbols),
            false => Err(NONSENSE),
        }
    }

    /// Codes of AC coefficients.
    pub(super) fn of_ac(counts: &[u8; 16], symbols: &[u8]) -> Result<Codes, Stop> {
        Codes::new(counts, symbols)
    }

    fn new(counts: &[u8; 16], symbols: &[u8]) -> Result<Codes, Stop> {
        let symbols = symbols.to_vec();
        let mut table = Codes { quick: [0; 1 << QUICK_BITS], limits: [0; 17], offsets: [0; 17], symbols };
        let (mut code, mut first) = (0u32, 0usize);
        for (len, &count) in (1usize..).zip(counts) {
            table.offsets[len] = first as i32 - code as i32;
            for place in first..first + usize::from(count) {
                let &symbol = table.symbols.get(place).ok_or(NONSENSE)?;
                if len <= QUICK_BITS {
                    let (start, places) = (code << (QUICK_BITS - len), 1 << (QUICK_BITS - len));
                    let quick = table.quick.get_mut(start as usize..start as usize + places);
                    quick.ok_or(NONSENSE)?.fill((len as u16) << 8 | u16::from(symbol));
                }
                code += 1;
            }
            first += usize::from(count);
            // No code is all ones.
            if count > 0 && code >= 1 << len {
                return Err(NONSENSE);
            }
            table.limits[len] = code << (16 - len);
            code <<= 1;
        }
        Ok(table)
    }

    /// The length of the code with which 16 bits begin, and what it stands for; `None` where they begin
    /// with none.
    #[inline]
    pub(super) fn find(&self, bits: u16) -> Option<(u32, u32)> {
        let quick = self.quick[usize::from(bits) >> (16 - QUICK_BITS)];
        if quick != 0 {
            return Some((u32::from(quick >> 8), u32::from(quick & 0xff)));
        }
        let len = (QUICK_BITS + 1..=16).find(|&len| u32::from(bits) < self.limits[len])?;
        let place = i32::from(bits >> (16 - len)) + self.offsets[len];
        let symbol = self.symbols.get(usize::try_from(place).ok()?)?;
        Some((len as u32, u32::from(*symbol)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_of_every_length_are_found() {
        // One code of each length: 0, 10, 110 and so on.
        let symbols: Vec<u8> = (0..16).collect();
        let table = Codes::of_dc(&[1; 16], &symbols).unwrap();
        for len in 1..=16u32 {
            // Ones, a zero, and anything.
            let code = (!0u16).checked_shl(17 - len).unwrap_or(0);
            let rest = (1u32 << (16 - len)) as u16 - 1;
            for bits in [code, code | rest] {
                assert_eq!(table.find(bits), Some((len, len - 1)), "{bits:016b}");
            }
        }
        assert_eq!(table.find(!0), None);
    }

    #[test]
    fn tables_that_make_no_sense_are_refused() {
        let with = |counts: &[(usize, u8)], symbols: &[u8]| {
            let mut all = [0; 16];
            counts.iter().for_each(|&(len, count)| all[len - 1] = count);
            Codes::of_dc(&all, symbols).is_ok()
        };
        assert!(with(&[(2, 3)], &[0, 1, 2]) && with(&[(9, 255)], &[1; 255]) && with(&[], &[]));
        assert!(!with(&[(2, 4)], &[0, 1, 2, 3]), "a code of ones");
        assert!(!with(&[(1, 200)], &[0; 200]) && !with(&[(1, 1), (2, 3)], &[0; 4]), "more than there are");
        assert!(!with(&[(2, 3)], &[0, 1]), "too few symbols");
        assert!(!with(&[(2, 1)], &[16]), "more bits than a difference has");
    }
}
