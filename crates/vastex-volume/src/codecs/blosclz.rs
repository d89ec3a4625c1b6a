//! BloscLZ, the compressor that Blosc brings: literals and matches up to 8191 bytes back, or 65535 beyond
//! those.

/// The distance at which two more bytes say the rest.
const FAR: usize = 8191;

/// Decodes into exactly the bytes of a buffer.
pub(super) fn decode_into(input: &[u8], output: &mut [u8]) -> Result<(), String> {
    let cut = || "ends too early".to_owned();
    let mut bytes = input.iter().copied();
    let mut next = || bytes.next();
    // The first is always a literal.
    let mut control = usize::from(next().ok_or_else(cut)? & 31);
    let mut at = 0;
    loop {
        if control < 32 {
            let run = output.get_mut(at..at + control + 1).ok_or("has more bytes than are expected")?;
            for byte in run {
                *byte = next().ok_or_else(cut)?;
            }
            at += control + 1;
        } else {
            let mut len = (control >> 5) - 1;
            let mut distance = (control & 31) << 8;
            if len == 6 {
                loop {
                    let more = next().ok_or_else(cut)?;
                    len += usize::from(more);
                    if more != 255 {
                        break;
                    }
                }
            }
            let low = usize::from(next().ok_or_else(cut)?);
            distance += low;
            if distance == FAR {
                let [high, low] = [next(), next()].map(|byte| byte.map(usize::from));
                distance += (high.ok_or_else(cut)? << 8) + low.ok_or_else(cut)?;
            }
            copy(output, at, distance + 1, len + 3)?;
            at += len + 3;
        }
        match next() {
            Some(byte) => control = byte.into(),
            None if at == output.len() => return Ok(()),
            None => return Err(format!("has {at} bytes, where {} are expected", output.len())),
        }
    }
}

/// Repeats `len` bytes from `distance` back; they may overlap those that they make.
fn copy(output: &mut [u8], at: usize, distance: usize, len: usize) -> Result<(), String> {
    let from = at.checked_sub(distance).ok_or("repeats bytes before its beginning")?;
    if at + len > output.len() {
        return Err("has more bytes than are expected".into());
    }
    if distance >= len {
        output.copy_within(from..from + len, at);
    } else {
        for n in 0..len {
            output[at + n] = output[from + n];
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn literals_and_matches_are_put_together() {
        let mut output = [0; 10];
        // Three literals, then seven bytes from three back.
        decode_into(&[2, b'a', b'b', b'c', 5 << 5, 2], &mut output).unwrap();
        assert_eq!(&output, b"abcabcabca");
    }

    #[test]
    fn what_is_wrong_is_an_error() {
        let mut output = [0; 10];
        for bad in
            [&[][..], &[2, b'a'], &[2, 1, 2, 3, 7 << 5, 3], &[0, 1, 0xff], &[0, 1, 2 << 5, 0], &[31; 40]]
        {
            assert!(decode_into(bad, &mut output).is_err(), "{bad:?}");
        }
    }
}
