//! Encodes texels of four bytes, colours with alpha, as an LZ4 block; the decoder is `lz4_flex`.
//!
//! An encoder of bytes looks for a match at every byte. Here matches begin at texels, are at least two texels
//! long, and lie right above in the tile, which costs no look-up, or where texels of the same hash were last.
//! So a tile takes a quarter less time, and a block is larger by about a hundredth. Other layers are left to
//! `lz4_flex`, by [`encode`](super::encode).
//!
//! A block is a row of sequences: how many literals there are, these, how far back a match lies and how long
//! it is. The format asks that the last 5 bytes be literals, and no match begin in the last 12.

/// Bytes of a texel.
pub(super) const TEXEL: usize = 4;
/// Bytes that are compared before something counts as a match: those of two texels.
const LEAST_MATCH: usize = 2 * TEXEL;
/// Bytes at the end in which no match begins: so many that [`WIDE`] bytes can be read wherever one does.
const MATCHLESS_END: usize = 20;
/// Bytes that are compared at a time where a match goes on.
const WIDE: usize = 16;
/// Bytes at the end that are literals.
const LITERAL_END: usize = 5;
/// How far back a match lies at most.
const MOST_DISTANCE: usize = 65_535;
/// Bits of a hash.
const HASH_BITS: u32 = 13;
/// The more texels in a row have no match, the more are left out before the next one is looked at: one after
/// so many, as a power of two.
const PATIENCE_BITS: u32 = 5;
/// A length from which on it has further bytes, and what each of those but the last adds to it.
const LONG: usize = 15;
const FURTHER: usize = 255;
/// Literals that are copied in one piece of that length, whatever their number is.
const COPIED: usize = 32;

/// The last 16 bits of the number of the texel at which a hash was last met.
type Positions = [u16; 1 << HASH_BITS];

/// Encodes one block after the other in memory that is used again.
pub(super) struct TexelEncoder {
    positions: Box<Positions>,
    block: Vec<u8>,
}

impl TexelEncoder {
    pub(super) fn new() -> TexelEncoder {
        TexelEncoder { positions: Box::new([0; 1 << HASH_BITS]), block: Vec::new() }
    }

    /// The block of these texels, which depends on nothing else than them and on `row_bytes`, the bytes of a
    /// row of the tile that they are of. If the bytes are no whole texels, or rows no whole texels long, the
    /// block is right, but larger. Costs about 0.6 ns a byte, and at most 1.004 times the bytes of memory.
    pub(super) fn encode(&mut self, texels: &[u8], row_bytes: usize) -> &[u8] {
        let most = texels.len() + texels.len() / FURTHER + WIDE;
        if self.block.len() < most {
            self.block.resize(most, 0);
        }
        self.positions.fill(0);
        let is_near = (TEXEL..=MOST_DISTANCE).contains(&row_bytes) && row_bytes.is_multiple_of(TEXEL);
        let above = if is_near { row_bytes } else { TEXEL };
        let mut search = Search { texels, above, positions: &mut self.positions };
        let mut block = Block { bytes: &mut self.block, len: 0, token: 0 };
        let literals = sequences(&mut search, &mut block);
        block.end(texels, literals);
        let len = block.len;
        &self.block[..len]
    }

    /// Gives up memory for more than `bytes` of texels.
    pub(super) fn keep_at_most(&mut self, bytes: usize) {
        if self.block.len() > bytes {
            self.block = Vec::new();
        }
    }
}

/// Writes all sequences with matches. Returns where the literals after the last of them begin.
fn sequences(search: &mut Search<'_>, block: &mut Block<'_>) -> usize {
    let Some(last) = search.texels.len().checked_sub(MATCHLESS_END) else { return 0 };
    // The first texel has nothing before it.
    let (mut literals, mut at, mut misses) = (0, TEXEL, 0);
    while at <= last {
        let mut distance = search.distance(at);
        if distance == 0 {
            misses += 1;
            at += TEXEL + TEXEL * (misses >> PATIENCE_BITS);
            continue;
        }
        misses = 0;
        let mut start = at - search.same_before(at, distance, at - literals);
        block.begin(search.texels, literals..start);
        // Matches that follow one another without literals in between.
        loop {
            let end = search.end_of_match(at, distance, last);
            let next = end / TEXEL * TEXEL;
            search.note(next - TEXEL);
            let next_distance = if next <= last { search.distance(next) } else { 0 };
            // A match that ends within a texel leaves that to the next one where there is one.
            let end = if next_distance == 0 { end } else { next };
            block.matched(distance, end - start);
            literals = end;
            if next_distance == 0 {
                at = next + TEXEL;
                break;
            }
            (at, start, distance) = (next, next, next_distance);
            block.begin_matched();
        }
    }
    literals
}

/// Looks for matches.
struct Search<'a> {
    texels: &'a [u8],
    /// How far back the texel above lies.
    above: usize,
    positions: &'a mut Positions,
}

impl Search<'_> {
    /// How far back the same two texels lie as at `at`, or 0.
    #[inline(always)]
    fn distance(&mut self, at: usize) -> usize {
        let pair = self.pair(at);
        let above = if at >= self.above { self.above } else { TEXEL };
        let number = (at / TEXEL) as u16;
        let met = std::mem::replace(&mut self.positions[hash(pair)], number);
        let distance = TEXEL * usize::from(number.wrapping_sub(met));
        if self.pair(at - above) == pair {
            return above;
        }
        // What is further back was overwritten, or is met by chance.
        let is_there = distance.wrapping_sub(1) < MOST_DISTANCE.min(at);
        if is_there && self.pair(at - distance) == pair { distance } else { 0 }
    }

    /// Notes where a pair of texels lies.
    #[inline(always)]
    fn note(&mut self, at: usize) {
        self.positions[hash(self.pair(at))] = (at / TEXEL) as u16;
    }

    /// Two texels.
    #[inline(always)]
    fn pair(&self, at: usize) -> u64 {
        eight(self.texels, at)
    }

    /// Where a match ends that begins at `at`; `last` is the last byte at which one may.
    #[inline(always)]
    fn end_of_match(&self, at: usize, distance: usize, last: usize) -> usize {
        let mut end = at + LEAST_MATCH;
        while end <= last {
            let half = |n: usize| eight(self.texels, end + n) ^ eight(self.texels, end + n - distance);
            let differs = [half(0), half(WIDE / 2)];
            if differs != [0; 2] {
                let (of, same) = if differs[0] == 0 { (differs[1], WIDE / 2) } else { (differs[0], 0) };
                return end + same + (of.trailing_zeros() / 8) as usize;
            }
            end += WIDE;
        }
        let least = self.texels.len() - LITERAL_END;
        while end < least && self.texels[end] == self.texels[end - distance] {
            end += 1;
        }
        end.min(least)
    }

    /// How many bytes before `at`, `most` at most, are the same as those so far back.
    #[inline(always)]
    fn same_before(&self, at: usize, distance: usize, most: usize) -> usize {
        let most = most.min(at - distance);
        let mut same = 0;
        while same < most && self.texels[at - same - 1] == self.texels[at - distance - same - 1] {
            same += 1;
        }
        same
    }
}

/// A block in the making.
struct Block<'a> {
    /// As many as any block of the texels has.
    bytes: &'a mut [u8],
    len: usize,
    /// Where the sequence begins that is being written.
    token: usize,
}

impl Block<'_> {
    /// Begins a sequence with literals.
    #[inline(always)]
    fn begin(&mut self, texels: &[u8], literals: std::ops::Range<usize>) {
        let count = literals.len();
        self.begin_matched();
        self.bytes[self.token] = (count.min(LONG) << 4) as u8;
        self.further(count);
        let room = self.bytes.get_mut(self.len..).and_then(|room| room.first_chunk_mut::<COPIED>());
        let from = texels.get(literals.start..).and_then(|from| from.first_chunk::<COPIED>());
        match (room, from) {
            (Some(room), Some(from)) if count <= COPIED => *room = *from,
            _ => self.bytes[self.len..self.len + count].copy_from_slice(&texels[literals]),
        }
        self.len += count;
    }

    /// Begins a sequence without literals.
    #[inline(always)]
    fn begin_matched(&mut self) {
        self.token = self.len;
        self.bytes[self.token] = 0;
        self.len += 1;
    }

    /// Ends a sequence with a match.
    #[inline(always)]
    fn matched(&mut self, distance: usize, len: usize) {
        const SHORTEST: usize = 4;
        let len = len - SHORTEST;
        self.bytes[self.token] |= len.min(LONG) as u8;
        self.bytes[self.len..self.len + 2].copy_from_slice(&(distance as u16).to_le_bytes());
        self.len += 2;
        self.further(len);
    }

    /// Ends the block with the literals from `from` on.
    fn end(&mut self, texels: &[u8], from: usize) {
        self.begin(texels, from..texels.len());
    }

    /// Writes what a token does not say of a length.
    #[inline(always)]
    fn further(&mut self, len: usize) {
        let Some(mut rest) = len.checked_sub(LONG) else { return };
        while rest >= FURTHER {
            self.bytes[self.len] = FURTHER as u8;
            self.len += 1;
            rest -= FURTHER;
        }
        self.bytes[self.len] = rest as u8;
        self.len += 1;
    }
}

/// The hash of two texels.
#[inline(always)]
fn hash(pair: u64) -> usize {
    // The golden ratio, of 64 bits.
    (pair.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> (u64::BITS - HASH_BITS)) as usize
}

/// Eight bytes as a number; 0 where there are fewer.
#[inline(always)]
fn eight(bytes: &[u8], at: usize) -> u64 {
    bytes.get(at..).and_then(|bytes| bytes.first_chunk()).map_or(0, |eight| u64::from_le_bytes(*eight))
}

#[cfg(test)]
mod tests {
    use lz4_flex::block::{compress, decompress};
    use proptest::prelude::*;

    use super::*;

    /// Sequences as they stand in a block: literals, how far back the match lies, and its length; 0 and 0
    /// for the last one.
    fn sequences_of(block: &[u8]) -> Vec<[usize; 3]> {
        let (mut rest, mut found) = (block.iter().map(|&byte| usize::from(byte)), Vec::new());
        let further = |rest: &mut dyn Iterator<Item = usize>, short: usize| {
            let mut len = short;
            let mut goes_on = short == LONG;
            while goes_on {
                let byte = rest.next().unwrap();
                len += byte;
                goes_on = byte == FURTHER;
            }
            len
        };
        while let Some(token) = rest.next() {
            let literals = further(&mut rest, token >> 4);
            rest.by_ref().take(literals).for_each(drop);
            let Some(low) = rest.next() else {
                assert_eq!(token & 15, 0);
                found.push([literals, 0, 0]);
                break;
            };
            let distance = low + 256 * rest.next().unwrap();
            found.push([literals, distance, further(&mut rest, token & 15) + 4]);
        }
        found
    }

    /// What decoders may rely on: the last 5 bytes are literals, no match begins in the last 12, and what it
    /// repeats is there.
    fn keeps_the_rules(block: &[u8], len: usize) {
        let mut at = 0;
        let sequences = sequences_of(block);
        let (last, matched) = sequences.split_last().unwrap();
        for [literals, distance, matched] in matched {
            at += literals;
            assert!((1..=at).contains(distance) && at + 12 <= len, "{distance} back at {at} of {len}");
            at += matched;
        }
        assert_eq!(at + last[0], len);
        assert!(last[0] >= LITERAL_END.min(len), "{last:?}");
    }

    /// Texels that look like an image: each is as one near it, or a neighbour of that in a palette.
    fn image(seed: u64, len: usize, row: usize, colors: u64, noise: u64) -> Vec<u8> {
        let random = |i: usize| crate::ground::hash::seeded(seed, &i.to_le_bytes());
        let mut texels: Vec<u64> = Vec::new();
        for i in 0..len.div_ceil(TEXEL) {
            let above = i.checked_sub(row.max(1)).map_or(0, |above| texels[above]);
            let left = texels.last().copied().unwrap_or(0);
            let near = if random(i) % 2 == 0 { left } else { above };
            texels.push(if random(i + len) % 100 < noise { random(i + 2 * len) % colors } else { near });
        }
        let bytes = texels.iter().flat_map(|&n| {
            let [r, g, b, ..] = crate::ground::hash::seeded(n, b"color").to_le_bytes();
            [r, g, b, 255]
        });
        bytes.take(len).collect()
    }

    proptest! {
        #[test]
        fn what_is_encoded_decodes_to_itself_and_keeps_the_rules(
            seed: u64,
            len in prop_oneof![0usize..90, 90usize..9000, 60_000usize..140_000],
            row in 0usize..300,
            colors in prop_oneof![1u64..4, 4u64..60, 60u64..100_000],
            noise in 0u64..101,
            row_bytes in prop_oneof![Just(None), (0usize..70_000).prop_map(Some)],
        ) {
            let texels = image(seed, len, row, colors, noise);
            let mut encoder = TexelEncoder::new();
            let block = encoder.encode(&texels, row_bytes.unwrap_or(row * TEXEL)).to_vec();
            prop_assert!(block.len() <= len + len / FURTHER + WIDE);
            prop_assert_eq!(decompress(&block, len).unwrap(), texels);
            keeps_the_rules(&block, len);
        }

        #[test]
        fn any_bytes_decode_to_themselves(bytes in prop::collection::vec(0u8..3, 0..400), row_bytes in 0usize..90) {
            let mut encoder = TexelEncoder::new();
            let block = encoder.encode(&bytes, row_bytes).to_vec();
            prop_assert_eq!(decompress(&block, bytes.len()).unwrap(), &bytes[..]);
            keeps_the_rules(&block, bytes.len());
        }
    }

    #[test]
    fn a_block_depends_on_its_own_texels_alone() {
        let mut used = TexelEncoder::new();
        for (seed, len) in [(1, 20_000), (2, 80_000), (3, 20_000), (4, 64)] {
            let texels = image(seed, len, 50, 30, 40);
            let fresh = TexelEncoder::new().encode(&texels, 200).to_vec();
            assert_eq!(used.encode(&texels, 200), fresh);
            used.keep_at_most(30_000);
        }
    }

    #[test]
    fn what_repeats_further_back_than_a_match_may_lie_is_encoded_anew() {
        let noise = image(5, 100_000, 0, u64::MAX, 100);
        // Numbers of texels that differ by 65,536 are noted as the same.
        for far in [65_532, 65_536, 262_144] {
            let mut texels = image(6, far, 0, u64::MAX, 100);
            texels[..1000].copy_from_slice(&noise[..1000]);
            texels.extend_from_slice(&noise);
            let mut encoder = TexelEncoder::new();
            let block = encoder.encode(&texels, 400).to_vec();
            assert_eq!(decompress(&block, texels.len()).unwrap(), texels);
            assert_eq!(block.len() < texels.len(), far <= MOST_DISTANCE, "{far}");
        }
    }

    #[test]
    fn images_become_about_as_small_as_byte_by_byte() {
        let mut encoder = TexelEncoder::new();
        for (colors, noise) in [(4, 100), (16, 60), (200, 20), (100_000, 30), (1, 100)] {
            let texels = image(7, 136 * 136 * TEXEL, 136, colors, noise);
            let (ours, theirs) = (encoder.encode(&texels, 136 * TEXEL).len(), compress(&texels).len());
            assert!(ours as f64 <= 1.05 * theirs as f64, "{ours} and {theirs} of {colors} colours, {noise}");
        }
    }
}
