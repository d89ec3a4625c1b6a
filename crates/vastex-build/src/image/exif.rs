//! The one thing that is read from EXIF data: the orientation, which `oriented` follows.

/// The orientation in EXIF data that begins with its TIFF header; `None` if there is none or it makes no
/// sense.
pub(super) fn orientation(exif: &[u8]) -> Option<u16> {
    let big = match exif.get(..4)? {
        [b'I', b'I', 42, 0] => false,
        [b'M', b'M', 0, 42] => true,
        _ => return None,
    };
    let u16_at = |at: usize| {
        let bytes = exif.get(at..at.checked_add(2)?)?.try_into().ok()?;
        Some(if big { u16::from_be_bytes(bytes) } else { u16::from_le_bytes(bytes) })
    };
    let offset: [u8; 4] = exif.get(4..8)?.try_into().ok()?;
    let first = if big { u32::from_be_bytes(offset) } else { u32::from_le_bytes(offset) } as usize;
    let entries = usize::from(u16_at(first)?);
    let entry = |i: usize| first.checked_add(2 + 12 * i);
    (0..entries)
        .map_while(entry)
        .find(|&at| u16_at(at) == Some(0x0112))
        .and_then(|at| u16_at(at.checked_add(8)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// EXIF data with one entry: an orientation.
    pub(crate) fn exif_with_orientation(value: u8) -> Vec<u8> {
        let mut exif = b"MM\0\x2a\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0".to_vec();
        exif.extend([value, 0, 0, 0, 0, 0, 0]);
        exif
    }

    #[test]
    fn orientation_is_found_and_nonsense_is_not() {
        let exif = exif_with_orientation(6);
        assert_eq!(orientation(&exif), Some(6));
        for len in 0..18 {
            assert_eq!(orientation(&exif[..len]), None);
        }
        assert_eq!(orientation(b"II\x2a\0\xff\xff\xff\xff"), None);
    }
}
