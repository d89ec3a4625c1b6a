//! Blocks of LZ4: literals, and matches up to 65,535 bytes back.
//!
//! Most sequences are a few bytes, so what decides is how few are copied: of lengths that are known here,
//! more than are wanted, as long as there is room. What was too much is written over by what follows.

/// Bytes that a match has at least.
const LEAST_MATCH: usize = 4;
/// What stands for a length that goes on in the bytes that follow.
const GOES_ON: usize = 15;
/// Bytes that a sequence has at most whose lengths do not go on: of literals, and of the match.
const MOST_SHORT: usize = GOES_ON - 1 + LEAST_MATCH;
/// Room in the output from where on such a sequence need not be measured, with what is too much.
const ROOM: usize = 64;

fn cut() -> String {
    "ends too early".into()
}

fn long() -> String {
    "has more bytes than are expected".into()
}

fn far() -> String {
    "repeats bytes before its beginning".into()
}

/// Decodes into exactly the bytes of a buffer.
pub(super) fn decode_into(input: &[u8], output: &mut [u8]) -> Result<(), String> {
    let (mut at, mut to) = (0, 0);
    loop {
        // Most sequences: what they are follows from the first byte, and nothing is near its end.
        while let Some(next) = input.get(at..).and_then(|rest| rest.first_chunk::<19>())
            && let Some(into) = output.get_mut(to..).and_then(|rest| rest.first_chunk_mut::<ROOM>())
            && let (literals, len) = (usize::from(next[0] >> 4), usize::from(next[0] & 15) + LEAST_MATCH)
            && literals < GOES_ON
            && len <= MOST_SHORT
        {
            into[..16].copy_from_slice(&next[1..17]);
            at += literals + 3;
            to += literals;
            let offset = usize::from(u16::from_le_bytes([next[literals + 1], next[literals + 2]]));
            let (before, into) = output.split_at_mut(to);
            let before = before.get(before.len().wrapping_sub(offset)..).ok_or_else(far)?;
            match (before.first_chunk::<MOST_SHORT>(), into.first_chunk_mut::<32>()) {
                (Some(from), Some(into)) => into[..MOST_SHORT].copy_from_slice(from),
                _ => repeat_near(output, to, offset, MOST_SHORT)?,
            }
            to += len;
        }
        let token = usize::from(*input.get(at).ok_or_else(cut)?);
        at += 1;
        let mut literals = token >> 4;
        if literals == GOES_ON {
            literals += more(input, &mut at)?;
        }
        let from = input.get(at..).and_then(|rest| rest.get(..literals)).ok_or_else(cut)?;
        let into = output.get_mut(to..).and_then(|rest| rest.get_mut(..literals)).ok_or_else(long)?;
        into.copy_from_slice(from);
        at += literals;
        to += literals;
        if at == input.len() {
            return match to == output.len() {
                true => Ok(()),
                false => Err(format!("has {to} bytes, where {} are expected", output.len())),
            };
        }
        let bytes = input.get(at..).and_then(|rest| rest.first_chunk()).ok_or_else(cut)?;
        let offset = usize::from(u16::from_le_bytes(*bytes));
        at += 2;
        let mut len = (token & 15) + LEAST_MATCH;
        if token & 15 == GOES_ON {
            len += more(input, &mut at)?;
        }
        if output.len() - to < len {
            return Err(long());
        }
        repeat(output, to, offset, len)?;
        to += len;
    }
}

/// The rest of a length: bytes up to the first that is not 255.
fn more(input: &[u8], at: &mut usize) -> Result<usize, String> {
    let mut sum = 0;
    loop {
        let byte = *input.get(*at).ok_or_else(cut)?;
        *at += 1;
        sum += usize::from(byte);
        if byte != u8::MAX {
            return Ok(sum);
        }
    }
}

/// Repeats `len` bytes from `offset` back; they may overlap those that they make.
fn repeat(output: &mut [u8], to: usize, offset: usize, len: usize) -> Result<(), String> {
    if offset < 16 || output.len() - to < len + 16 {
        return repeat_near(output, to, offset, len);
    }
    let from = to.checked_sub(offset).ok_or_else(far)?;
    let mut done = 0;
    while done < len {
        output.copy_within(from + done..from + done + 16, to + done);
        done += 16;
    }
    Ok(())
}

/// The same from anywhere.
#[inline(always)]
fn repeat_near(output: &mut [u8], to: usize, offset: usize, len: usize) -> Result<(), String> {
    let (before, into) = output.split_at_mut(to);
    if (1..8).contains(&offset)
        && let Some(last) = before.last_chunk::<8>()
        && into.len() >= len + 8
    {
        let word = (u64::from_le_bytes(*last) >> (64 - 8 * offset as u32)).wrapping_mul(REPEATED[offset]);
        let mut done = 0;
        while done < len {
            into[done..][..8].copy_from_slice(&word.to_le_bytes());
            done += WHOLE[offset];
        }
        return Ok(());
    }
    let from = to.checked_sub(offset).filter(|from| *from < to).ok_or_else(far)?;
    if offset >= 8 && into.len() >= len + 8 {
        let mut done = 0;
        while done < len {
            output.copy_within(from + done..from + done + 8, to + done);
            done += 8;
        }
        return Ok(());
    }
    for n in 0..len {
        output[to + n] = output[from + n];
    }
    Ok(())
}

/// What makes as many as fit of a few bytes, by multiplication, and how many bytes are whole ones of it.
const REPEATED: [u64; 8] = [
    0,
    0x0101_0101_0101_0101,
    0x0001_0001_0001_0001,
    0x0001_0000_0100_0001,
    0x0000_0001_0000_0001,
    0x0000_0100_0000_0001,
    0x0001_0000_0000_0001,
    0x0100_0000_0000_0001,
];
const WHOLE: [usize; 8] = [8, 8, 8, 6, 8, 5, 6, 7];

#[cfg(test)]
mod tests {
    use super::*;

    fn random(state: &mut u64) -> usize {
        *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*state >> 33) as usize
    }

    /// Bytes that repeat what lies from 1 to 40 back, in between others.
    fn values(state: &mut u64, len: usize) -> Vec<u8> {
        let mut values = Vec::new();
        while values.len() < len {
            (0..random(state) % 40).for_each(|_| values.push(random(state) as u8));
            let (offset, run) = (1 + random(state) % 40, random(state) % 90);
            for _ in 0..run {
                let byte = values.len().checked_sub(offset).map_or(7, |from| values[from]);
                values.push(byte);
            }
        }
        values.truncate(len);
        values
    }

    #[test]
    fn what_another_encodes_comes_back() {
        let mut state = 4;
        for len in (0..70).chain([100, 255, 270, 1000, 5000, 100_000]) {
            for _ in 0..20 {
                let values = values(&mut state, len);
                let stored = lz4_flex::block::compress(&values);
                let mut output = vec![0xcc; len];
                assert_eq!(decode_into(&stored, &mut output), Ok(()));
                assert!(output == values, "{len}");
                assert!(decode_into(&stored, &mut vec![0; len + 1]).is_err());
                if len > 0 {
                    assert!(decode_into(&stored, &mut vec![0; len - 1]).is_err());
                    assert!(decode_into(&stored[..stored.len() - 1], &mut output).is_err());
                }
            }
        }
    }

    #[test]
    fn whatever_is_repeated_is_repeated() {
        // Some literals, a match from any distance and of any length, and literals behind it.
        for offset in 1..40_usize {
            for len in LEAST_MATCH..60 {
                for behind in [5, 12, 100] {
                    let literals: Vec<u8> = (0..40).collect();
                    let mut stored = vec![0xf0 | (len - LEAST_MATCH).min(15) as u8, 25];
                    stored.extend(&literals);
                    stored.extend([offset as u8, 0]);
                    if len >= 15 + LEAST_MATCH {
                        stored.push((len - 15 - LEAST_MATCH) as u8);
                    }
                    stored.extend([0xf0, behind - 15_u8.min(behind)]);
                    if behind < 15 {
                        let end = stored.len();
                        stored.truncate(end - 2);
                        stored.push(behind << 4);
                    }
                    stored.extend((0..behind).map(|n| 200 + n % 50));
                    let mut expected = literals;
                    (0..len).for_each(|_| expected.push(expected[expected.len() - offset]));
                    expected.extend((0..behind).map(|n| 200 + n % 50));
                    let mut output = vec![0xcc; expected.len()];
                    assert_eq!(decode_into(&stored, &mut output), Ok(()), "{offset} {len} {behind}");
                    assert_eq!(output, expected, "{offset} {len} {behind}");
                }
            }
        }
    }

    #[test]
    fn what_is_wrong_is_an_error_and_the_same_as_for_another() {
        let mut output = [0; 20];
        for bad in [&[][..], &[0x10], &[0x10, 1, 0, 0], &[0x10, 1, 2, 0], &[0xf0, 255], &[0x1f, 1, 1, 0, 255]]
        {
            assert!(decode_into(bad, &mut output).is_err(), "{bad:?}");
        }
        let mut state = 9;
        for _ in 0..3000 {
            let len = 1 + random(&mut state) % 400;
            let mut stored = lz4_flex::block::compress(&values(&mut state, len));
            for _ in 0..1 + random(&mut state) % 3 {
                let at = random(&mut state) % stored.len();
                stored[at] = random(&mut state) as u8;
            }
            let (mut ours, mut other) = (vec![0; len], vec![0; len]);
            let found = decode_into(&stored, &mut ours);
            let expected = lz4_flex::block::decompress_into(&stored, &mut other);
            assert_eq!(found.is_ok(), expected.is_ok_and(|bytes| bytes == len), "{found:?} {stored:?}");
            assert!(found.is_err() || ours == other);
        }
    }
}
