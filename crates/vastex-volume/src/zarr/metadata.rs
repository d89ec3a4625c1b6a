//! What the metadata of an array say, whatever the version: shape, chunks, values and how they are encoded.

use serde_json::Value;

use super::keys_of::ChunkKeys;
use crate::codecs::{Chain, MOST_CODECS};
use crate::fault::{VolumeFault, damaged, printable, unsupported};
use crate::values::DType;

/// Axes that an array may have.
pub(crate) const MOST_AXES: usize = 8;
/// Bytes that a chunk may have, decoded.
pub(crate) const MOST_CHUNK_BYTES: u64 = 1 << 30;
/// Values along an axis: as many as a texture may have.
const MOST_SIDE: u64 = 1 << 31;
/// Bytes that the index of a shard may have.
const MOST_INDEX_BYTES: u64 = 64 << 20;
/// Bytes of an entry of the index of a shard.
pub(crate) const INDEX_ENTRY: u64 = 16;

/// An array.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ArrayMeta {
    /// Values along each axis, at least 1.
    pub(crate) shape: Vec<u64>,
    /// Values along each axis of what is decoded at once: of an inner chunk where there are shards.
    pub(crate) chunk: Vec<u64>,
    pub(crate) dtype: DType,
    pub(crate) is_big_endian: bool,
    /// Of absent chunks, little-endian.
    pub(crate) fill: [u8; 8],
    pub(crate) keys: ChunkKeys,
    /// Which axis of the array lies at each place in an encoded chunk, the slowest first.
    pub(crate) order: Vec<usize>,
    pub(crate) chain: Chain,
    pub(crate) shard: Option<ShardMeta>,
    /// Names of the axes, where the array has them.
    pub(crate) names: Vec<Option<String>>,
    pub(crate) oddities: Vec<String>,
}

/// How chunks lie together in shards.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct ShardMeta {
    /// Chunks along each axis of the array.
    pub(crate) counts: Vec<u64>,
    /// Which axis of the array lies at each place in the index, the slowest first.
    pub(crate) order: Vec<usize>,
    pub(crate) is_big_endian: bool,
    pub(crate) has_checksum: bool,
    pub(crate) is_index_first: bool,
}

impl ShardMeta {
    /// Chunks of a shard.
    pub(crate) fn chunks(&self) -> u64 {
        self.counts.iter().product()
    }

    /// Bytes of its index as it is stored.
    pub(crate) fn index_bytes(&self) -> u64 {
        self.chunks() * INDEX_ENTRY + if self.has_checksum { 4 } else { 0 }
    }

    /// The place of a chunk's entry in the index, by its coordinates within the shard.
    pub(crate) fn entry(&self, within: &[u64]) -> usize {
        let place = |at: u64, axis: &usize| at * self.counts[*axis] + within[*axis];
        self.order.iter().fold(0, place) as usize
    }
}

impl ArrayMeta {
    /// Bytes of a chunk's values.
    pub(crate) fn chunk_bytes(&self) -> usize {
        self.chunk.iter().product::<u64>() as usize * self.dtype.bytes()
    }

    /// Bytes from a value of a decoded chunk to the next one along each axis of the array.
    pub(crate) fn strides(&self) -> Vec<usize> {
        let mut strides = vec![0; self.chunk.len()];
        let mut stride = self.dtype.bytes();
        for axis in self.order.iter().rev() {
            strides[*axis] = stride;
            stride *= self.chunk[*axis] as usize;
        }
        strides
    }

    /// Refuses what cannot be read, so that no later product overflows.
    pub(crate) fn check(&self) -> Result<(), VolumeFault> {
        let axes = self.shape.len();
        if axes == 0 || axes > MOST_AXES {
            return Err(damaged(format!("the array has {axes} axes, where 1 to {MOST_AXES} are read")));
        }
        if self.chunk.len() != axes {
            return Err(damaged(format!("chunks have {} axes, and the array {axes}", self.chunk.len())));
        }
        if let Some(side) = self.shape.iter().find(|side| **side == 0 || **side > MOST_SIDE) {
            return Err(damaged(format!(
                "the shape {:?} has a side of {side}; 1 to {MOST_SIDE} are read",
                self.shape
            )));
        }
        if self.chunk.contains(&0) {
            return Err(damaged(format!("chunks of the shape {:?} hold nothing", self.chunk)));
        }
        let bytes = product(&self.chunk).and_then(|values| values.checked_mul(self.dtype.bytes() as u64));
        if bytes.is_none_or(|bytes| bytes > MOST_CHUNK_BYTES) {
            return Err(VolumeFault::TooLarge(format!(
                "chunks of the shape {:?} are larger than {MOST_CHUNK_BYTES} bytes, which is the most that is decoded at once",
                self.chunk
            )));
        }
        if self.chain.0.len() > MOST_CODECS {
            return Err(unsupported(format!(
                "chunks are encoded by {} codecs one after the other, where up to {MOST_CODECS} are read; write the array with \
                 fewer",
                self.chain.0.len()
            )));
        }
        let Some(shard) = &self.shard else { return Ok(()) };
        let entries = product(&shard.counts).and_then(|entries| entries.checked_mul(INDEX_ENTRY));
        if entries.is_none_or(|bytes| bytes == 0 || bytes > MOST_INDEX_BYTES) {
            return Err(VolumeFault::TooLarge(format!(
                "a shard has {:?} chunks along its axes, and its index is empty or larger than {MOST_INDEX_BYTES} bytes",
                shard.counts
            )));
        }
        Ok(())
    }
}

fn product(sides: &[u64]) -> Option<u64> {
    sides.iter().try_fold(1_u64, |product, side| product.checked_mul(*side))
}

/// The whole numbers of a list, such as a shape.
pub(super) fn numbers(value: Option<&Value>, what: &str) -> Result<Vec<u64>, VolumeFault> {
    let wrong = || {
        let found = value.map_or("nothing".into(), |value| shortened(&value.to_string()));
        damaged(format!("{what} is a list of whole numbers, and here it is {found}"))
    };
    let list = value.and_then(Value::as_array).ok_or_else(wrong)?;
    // Whole numbers are also written as floats.
    let number = |value: &Value| {
        let float =
            || value.as_f64().filter(|n| n.fract() == 0.0 && (0.0..9e15).contains(n)).map(|n| n as u64);
        value.as_u64().or_else(float).ok_or_else(wrong)
    };
    list.iter().map(number).collect()
}

/// A permutation of so many axes.
pub(super) fn permutation(order: &[u64], axes: usize) -> Result<Vec<usize>, VolumeFault> {
    let order: Vec<usize> = order.iter().map(|axis| usize::try_from(*axis).unwrap_or(usize::MAX)).collect();
    let mut sorted = order.clone();
    sorted.sort_unstable();
    match sorted.iter().copied().eq(0..axes) {
        true => Ok(order),
        false => Err(damaged(format!("the order {order:?} names not each of {axes} axes once"))),
    }
}

/// The beginning of what somebody wrote, for a message, without control characters.
pub(crate) fn shortened(text: &str) -> String {
    const MOST: usize = 60;
    match text.char_indices().nth(MOST) {
        Some((at, _)) => printable(&text[..at]) + "...",
        None => printable(text),
    }
}
