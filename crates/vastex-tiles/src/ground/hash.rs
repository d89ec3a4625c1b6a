//! The hashes of this crate: XXH3, whose values are part of the container format.

use std::hash::Hasher;

use twox_hash::XxHash3_64;

/// The checksum of stored bytes. Runs at the speed of memory where the processor has wide registers.
pub(crate) fn checksum(bytes: &[u8]) -> u64 {
    XxHash3_64::oneshot(bytes)
}

/// The checksum of bytes that come in pieces.
#[derive(Default)]
pub(crate) struct Checksum(XxHash3_64);

impl Checksum {
    pub(crate) fn update(&mut self, piece: &[u8]) {
        self.0.write(piece);
    }

    pub(crate) fn finish(&self) -> u64 {
        self.0.finish()
    }
}

/// What identical bytes have in common, and no others by chance.
pub(crate) fn content_hash(bytes: &[u8]) -> u128 {
    twox_hash::XxHash3_128::oneshot(bytes)
}

/// The [`checksum`] of bytes whose [`content_hash`] is known. Where there are more than 240 of them, XXH3 of
/// 64 bits is the lower half of that of 128 bits, so that nothing is read again.
#[cfg(any(test, feature = "write"))]
pub(crate) fn checksum_of_hashed(bytes: &[u8], content: u128) -> u64 {
    const SHORT_BYTES: usize = 240;
    if bytes.len() > SHORT_BYTES { content as u64 } else { checksum(bytes) }
}

/// A number that looks random but follows from seed and key.
pub(crate) fn seeded(seed: u64, key: &[u8]) -> u64 {
    XxHash3_64::oneshot_with_seed(seed, key)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn some_bytes() -> Vec<u8> {
        (0..5000u32).map(|n| ((n * n) >> 3) as u8).collect()
    }

    #[test]
    fn pieces_and_whole_have_one_checksum() {
        let bytes = some_bytes();
        let mut pieces = Checksum::default();
        bytes.chunks(777).for_each(|piece| pieces.update(piece));
        assert_eq!(pieces.finish(), checksum(&bytes));
    }

    #[test]
    fn the_checksum_of_hashed_bytes_is_their_checksum() {
        let bytes = some_bytes();
        for len in (0..1200).chain([4096, 5000]) {
            let bytes = &bytes[..len];
            assert_eq!(checksum_of_hashed(bytes, content_hash(bytes)), checksum(bytes), "{len} bytes");
        }
    }

    /// Values that other implementations give: files depend on them.
    #[test]
    fn the_algorithm_is_xxh3() {
        assert_eq!(checksum(b""), 0x2d06_8005_38d3_94c2);
        assert_eq!(checksum(&some_bytes()), 0xdd98_91de_816b_182f);
        assert_eq!(content_hash(&some_bytes()), 0xf056_19f4_b8cc_9b78_dd98_91de_816b_182f);
    }
}
