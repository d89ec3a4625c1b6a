//! Makes the checksums of damaged bytes right again, so that the damage gets past them.
//!
//! Written from docs/format.md alone. Whatever is not found where it should be is left as it is.

use twox_hash::XxHash3_64;

/// Sets the checksums of a container, of a part, or of a PNG image.
pub(crate) fn reseal(bytes: &mut [u8]) {
    match bytes {
        [0x89, b'V', b'T', b'X', b'P', ..] => reseal_part(bytes),
        [0x89, b'V', b'T', b'X', ..] => reseal_container(bytes),
        [0x89, b'P', b'N', b'G', ..] => reseal_png(bytes),
        _ => {}
    }
}

fn reseal_container(bytes: &mut [u8]) {
    const CHECKED: usize = 88;
    for copy in [0, 512] {
        let [Some(description), Some(index)] = [32, 56].map(|at| range(bytes, copy + at)) else { continue };
        reseal_records(bytes, index.clone());
        put(bytes, copy + 48, checksum(&bytes[description]));
        put(bytes, copy + 72, checksum(&bytes[index]));
        if let Some(head) = bytes.get(copy..copy + CHECKED) {
            put(bytes, copy + CHECKED, checksum(head));
        }
    }
}

/// The checksums of records and superseded ranges in the index.
fn reseal_records(bytes: &mut [u8], index: std::ops::Range<usize>) {
    const HEAD: usize = 32;
    const ENTRY: usize = 24;
    const CONSTANT: u8 = 1;
    let [Some(records), Some(superseded)] = [0, 8].map(|at| number(bytes, index.start + at)) else { return };
    // Constants lie at the end of the index, not where the offset alone would say.
    let constants = number(bytes, index.start + 24).map_or(index.end, |len| index.end.saturating_sub(len));
    let entries = (index.len().saturating_sub(HEAD) / ENTRY).min(records.saturating_add(superseded));
    for n in 0..entries {
        let at = index.start + HEAD + n * ENTRY;
        let (len_at, checksum_at) = if n < records { (at + 16, at + 8) } else { (at + 8, at + 16) };
        let len = match n < records {
            true => bytes.get(len_at..len_at + 4).map(|len| u32_of(len) as usize),
            false => number(bytes, len_at),
        };
        let base = if n < records && bytes.get(at + 20) == Some(&CONSTANT) { constants } else { 0 };
        if let (Some(first), Some(len)) = (number(bytes, at).and_then(|first| first.checked_add(base)), len)
            && let Some(content) = first.checked_add(len).and_then(|end| bytes.get(first..end))
        {
            put(bytes, checksum_at, checksum(content));
        }
    }
}

fn reseal_part(bytes: &mut [u8]) {
    const HEAD: usize = 64;
    const TILE_HEAD: usize = 56;
    let Some(len) = number(bytes, 40) else { return };
    let Some(mut at) = HEAD.checked_add(len).filter(|&end| end <= bytes.len()) else { return };
    put(bytes, 48, checksum(&bytes[HEAD..at]));
    put(bytes, 56, checksum(&bytes[..56]));
    while let Some(len) = number(bytes, at + 32)
        && at + TILE_HEAD <= bytes.len()
    {
        let first = at + TILE_HEAD;
        let Some(end) = first.checked_add(len).filter(|&end| end <= bytes.len()) else { return };
        put(bytes, at + 24, checksum(&bytes[first..end]));
        put(bytes, at + 48, checksum(&bytes[at..at + 48]));
        at = end;
    }
}

fn reseal_png(bytes: &mut [u8]) {
    let mut at = 8;
    while let Some(len) =
        bytes.get(at..at + 4).map(|len| u32::from_be_bytes([len[0], len[1], len[2], len[3]]))
    {
        let Some(end) = (at + 8).checked_add(len as usize).filter(|end| end + 4 <= bytes.len()) else {
            return;
        };
        let crc = crc32fast::hash(&bytes[at + 4..end]);
        bytes[end..end + 4].copy_from_slice(&crc.to_be_bytes());
        at = end + 4;
    }
}

fn checksum(bytes: &[u8]) -> u64 {
    XxHash3_64::oneshot(bytes)
}

/// Offset and length at `at`, where they lie in the bytes.
fn range(bytes: &[u8], at: usize) -> Option<std::ops::Range<usize>> {
    let (first, len) = (number(bytes, at)?, number(bytes, at + 8)?);
    let end = first.checked_add(len).filter(|&end| end <= bytes.len())?;
    Some(first..end)
}

fn number(bytes: &[u8], at: usize) -> Option<usize> {
    let number = u64::from_le_bytes(*bytes.get(at..)?.first_chunk()?);
    usize::try_from(number).ok()
}

fn u32_of(bytes: &[u8]) -> u32 {
    bytes.iter().rev().fold(0, |sum, &byte| sum << 8 | u32::from(byte))
}

fn put(bytes: &mut [u8], at: usize, checksum: u64) {
    if let Some(place) = bytes.get_mut(at..at + 8) {
        place.copy_from_slice(&checksum.to_le_bytes());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::TARGETS;

    /// What is sound has its checksums already: resealing changes nothing, so they are found where they are.
    #[test]
    fn sound_files_stay_as_they_are() {
        for target in TARGETS {
            for seed in target.seeds().unwrap() {
                for (name, content) in target.files(&seed) {
                    let mut resealed = content.clone();
                    reseal(&mut resealed);
                    assert!(resealed == content, "{}: {name}", target.name);
                }
            }
        }
    }

    #[test]
    fn a_wrong_checksum_is_made_right() {
        let target = TARGETS.iter().find(|target| target.name == "container").unwrap();
        let sound = target.seeds().unwrap().remove(0);
        let mut bytes = sound.clone();
        for at in [50, 74, 90, 512 + 90] {
            bytes[at] ^= 0xff;
        }
        reseal(&mut bytes);
        assert!(bytes == sound);
    }
}
