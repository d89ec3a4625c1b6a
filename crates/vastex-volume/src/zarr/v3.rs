//! Metadata of version 3: `zarr.json` of an array.

use serde_json::Value;

use super::keys_of::ChunkKeys;
use super::metadata::{ArrayMeta, ShardMeta, numbers, permutation, shortened};
use super::v2::{element_size, odd_fill};
use crate::codecs::{Chain, Codec};
use crate::fault::{VolumeFault, damaged, unsupported};
use crate::json::{list, text};
use crate::values::{DType, fill_of};

/// Reads `zarr.json` of an array.
pub(super) fn read(value: &Value) -> Result<ArrayMeta, VolumeFault> {
    let mut oddities = Vec::new();
    let dtype = text(value, "data_type").and_then(DType::named).ok_or_else(|| {
        let name = value.get("data_type").map_or("nothing".into(), Value::to_string);
        unsupported(format!(
            "values of the type {} are not read; whole numbers and floats are",
            shortened(&name)
        ))
    })?;
    let shape = numbers(value.get("shape"), "the shape")?;
    let axes = shape.len();
    let grid = value.get("chunk_grid").unwrap_or(&Value::Null);
    if let Some(name) = text(grid, "name").filter(|name| *name != "regular") {
        return Err(unsupported(format!(
            "chunks in a grid '{}' are not read; regular ones are",
            shortened(name)
        )));
    }
    let outer = numbers(grid.get("configuration").and_then(|c| c.get("chunk_shape")), "the shape of chunks")?;
    if outer.len() != axes {
        return Err(damaged(format!("chunks have {} axes, and the array {axes}", outer.len())));
    }
    let (fill, is_exact) = fill_of(value.get("fill_value").unwrap_or(&Value::Null), dtype);
    if !is_exact {
        oddities.push(odd_fill(value, dtype));
    }
    if !list(value, "storage_transformers").is_empty() {
        return Err(unsupported("storage transformers are not read; write the array without them"));
    }
    let encoded = read_codecs(list(value, "codecs"), axes, dtype)?;
    let (chunk, shard, encoded) = match encoded.inner {
        None => (outer, None, encoded),
        Some(sharded) => {
            if !encoded.chain.0.is_empty() {
                return Err(unsupported(
                    "shards that are compressed as a whole are not read; compress their chunks instead",
                ));
            }
            let (chunk, counts) = inner_chunks(&sharded.chunk, &encoded.order, &outer)?;
            let shard = ShardMeta { counts, order: encoded.order.clone(), ..sharded.shard };
            // The axes of a chunk within are those of the shard as it is encoded.
            let order = sharded.encoded.order.iter().map(|axis| encoded.order[*axis]).collect();
            (chunk, Some(shard), Encoded { order, ..*sharded.encoded })
        }
    };
    let names = list(value, "dimension_names").iter().map(|name| name.as_str().map(str::to_owned));
    let mut names: Vec<Option<String>> = names.collect();
    names.resize(axes, None);
    let meta = ArrayMeta {
        shape,
        chunk,
        dtype,
        is_big_endian: encoded.is_big_endian,
        fill,
        keys: chunk_keys(value.get("chunk_key_encoding"))?,
        order: encoded.order,
        chain: encoded.chain,
        shard,
        names,
        oddities,
    };
    meta.check().map(|()| meta)
}

/// Chunks within a shard, and how many there are along each axis of the array. `inner` has the axes as
/// `order` has them.
fn inner_chunks(inner: &[u64], order: &[usize], outer: &[u64]) -> Result<(Vec<u64>, Vec<u64>), VolumeFault> {
    let mut chunk = vec![0; outer.len()];
    if inner.len() != outer.len() {
        return Err(damaged(format!(
            "the chunks of shards have {} axes, and the array {}",
            inner.len(),
            outer.len()
        )));
    }
    for (side, axis) in inner.iter().zip(order) {
        chunk[*axis] = *side;
    }
    let fits = |(outer, inner): (&u64, &u64)| *inner > 0 && outer % inner == 0;
    if !outer.iter().zip(&chunk).all(fits) {
        return Err(damaged(format!("shards of {outer:?} values cannot be cut into chunks of {chunk:?}")));
    }
    let counts = outer.iter().zip(&chunk).map(|(outer, inner)| outer / inner).collect();
    Ok((chunk, counts))
}

fn chunk_keys(encoding: Option<&Value>) -> Result<ChunkKeys, VolumeFault> {
    let encoding = encoding.unwrap_or(&Value::Null);
    // A name alone stands for its defaults.
    let name = text(encoding, "name").or(encoding.as_str()).unwrap_or("default");
    let has_c = match name {
        "default" => true,
        "v2" => false,
        other => {
            return Err(unsupported(format!("keys of the encoding '{}' are not read", shortened(other))));
        }
    };
    let separator = encoding.get("configuration").and_then(|c| text(c, "separator"));
    let separator = match separator.unwrap_or(if has_c { "/" } else { "." }) {
        "/" => '/',
        "." => '.',
        other => {
            return Err(damaged(format!(
                "the separator of keys is '{}', where '.' and '/' are known",
                shortened(other)
            )));
        }
    };
    Ok(ChunkKeys { has_c, separator })
}

/// What a list of codecs comes to.
struct Encoded {
    order: Vec<usize>,
    is_big_endian: bool,
    chain: Chain,
    inner: Option<Sharded>,
}

/// The codec of shards; what is known of the array's axes is filled in later.
struct Sharded {
    chunk: Vec<u64>,
    shard: ShardMeta,
    encoded: Box<Encoded>,
}

fn read_codecs(codecs: &[Value], axes: usize, dtype: DType) -> Result<Encoded, VolumeFault> {
    let mut order: Vec<usize> = (0..axes).collect();
    let mut is_big_endian = None;
    let mut chain = Vec::new();
    let mut inner = None;
    for codec in codecs {
        let name = text(codec, "name").or(codec.as_str()).unwrap_or("without a name");
        let configuration = codec.get("configuration").unwrap_or(&Value::Null);
        let is_bytes = is_big_endian.is_some() || inner.is_some();
        match name.strip_prefix("numcodecs.").unwrap_or(name) {
            "transpose" if !is_bytes => {
                let moved = transposition(configuration.get("order"), axes)?;
                order = moved.into_iter().map(|axis| order[axis]).collect();
            }
            "bytes" | "endian" if !is_bytes => is_big_endian = Some(is_big(configuration)?),
            "sharding_indexed" if !is_bytes => inner = Some(read_sharding(configuration, axes, dtype)?),
            "blosc" if is_bytes => chain.push(Codec::Blosc),
            "zstd" if is_bytes => chain.push(Codec::Zstd),
            "gzip" if is_bytes => chain.push(Codec::Gzip),
            "zlib" if is_bytes => chain.push(Codec::Zlib),
            "lz4" if is_bytes => chain.push(Codec::Lz4),
            "crc32c" if is_bytes => chain.push(Codec::Crc32c),
            "shuffle" if is_bytes => chain.push(Codec::Shuffle(element_size(configuration, dtype))),
            _ if codec.get("must_understand") == Some(&Value::Bool(false)) => {}
            _ => {
                return Err(unsupported(format!(
                    "the codec '{}' is not read here; write the array without it (transpose, bytes, sharding_indexed, then blosc, \
                     zstd, gzip and crc32c are read)",
                    shortened(name)
                )));
            }
        }
    }
    if is_big_endian.is_none() && inner.is_none() {
        return Err(damaged(
            "no codec makes bytes of the array's values: 'bytes' or 'sharding_indexed' is missing",
        ));
    }
    Ok(Encoded { order, is_big_endian: is_big_endian.unwrap_or(false), chain: Chain(chain), inner })
}

fn transposition(order: Option<&Value>, axes: usize) -> Result<Vec<usize>, VolumeFault> {
    match order.and_then(Value::as_str) {
        Some("C") => Ok((0..axes).collect()),
        Some("F") => Ok((0..axes).rev().collect()),
        _ => permutation(&numbers(order, "the order of axes")?, axes),
    }
}

fn is_big(configuration: &Value) -> Result<bool, VolumeFault> {
    match text(configuration, "endian") {
        Some("little") | None => Ok(false),
        Some("big") => Ok(true),
        Some(other) => {
            Err(damaged(format!("the byte order is '{}', where little and big are known", shortened(other))))
        }
    }
}

fn read_sharding(configuration: &Value, axes: usize, dtype: DType) -> Result<Sharded, VolumeFault> {
    let chunk = numbers(configuration.get("chunk_shape"), "the shape of the chunks of shards")?;
    let encoded = read_codecs(list(configuration, "codecs"), axes, dtype)?;
    if encoded.inner.is_some() {
        return Err(unsupported("shards within shards are not read"));
    }
    let mut shard = ShardMeta {
        counts: Vec::new(),
        order: Vec::new(),
        is_big_endian: false,
        has_checksum: false,
        is_index_first: false,
    };
    for codec in list(configuration, "index_codecs") {
        match text(codec, "name").or(codec.as_str()).unwrap_or("without a name") {
            "bytes" | "endian" => {
                shard.is_big_endian = is_big(codec.get("configuration").unwrap_or(&Value::Null))?;
            }
            "crc32c" if !shard.has_checksum => shard.has_checksum = true,
            other => {
                return Err(unsupported(format!(
                    "the index of shards is encoded by '{}', where bytes and crc32c are read",
                    shortened(other)
                )));
            }
        }
    }
    shard.is_index_first = match text(configuration, "index_location") {
        Some("end") | None => false,
        Some("start") => true,
        Some(other) => {
            return Err(damaged(format!(
                "the index of shards lies at '{}', where start and end are known",
                shortened(other)
            )));
        }
    };
    Ok(Sharded { chunk, shard, encoded: Box::new(encoded) })
}
