//! Metadata of version 2: `.zarray`.

use serde_json::Value;

use super::keys_of::ChunkKeys;
use super::metadata::{ArrayMeta, numbers, shortened};
use crate::codecs::{Chain, Codec};
use crate::fault::{VolumeFault, damaged, unsupported};
use crate::json::{list, text};
use crate::values::{DType, fill_of};

/// Reads `.zarray`. `probed` is the separator of keys that were found, for metadata that do not name one.
pub(super) fn read(value: &Value, probed: Option<char>) -> Result<ArrayMeta, VolumeFault> {
    let mut oddities = Vec::new();
    let name = value.get("dtype").map_or("nothing".into(), Value::to_string);
    let (dtype, is_big_endian) = text(value, "dtype").and_then(DType::of_v2).ok_or_else(|| {
        unsupported(format!(
            "values of the type {} are not read; whole numbers and floats are",
            shortened(&name)
        ))
    })?;
    let shape = numbers(value.get("shape"), "the shape")?;
    let chunk = match value.get("chunks") {
        Some(Value::Null | Value::Bool(_)) | None => {
            oddities.push("no shape of chunks is given; the array is taken as one chunk".into());
            shape.clone()
        }
        chunks => numbers(chunks, "the shape of chunks")?,
    };
    let separator = match text(value, "dimension_separator") {
        Some(".") => '.',
        Some("/") => '/',
        Some(other) => {
            return Err(damaged(format!(
                "the separator of keys is '{}', where '.' and '/' are known",
                shortened(other)
            )));
        }
        None => match probed {
            Some('/') => {
                oddities.push(
                    "no dimension_separator is given, and its chunks lie in directories: '/' is taken".into(),
                );
                '/'
            }
            _ => '.',
        },
    };
    let axes = shape.len();
    let order = match text(value, "order").unwrap_or("C") {
        "F" | "f" => (0..axes).rev().collect(),
        _ => (0..axes).collect(),
    };
    let (fill, is_exact) = fill_of(value.get("fill_value").unwrap_or(&Value::Null), dtype);
    if !is_exact {
        oddities.push(odd_fill(value, dtype));
    }
    let mut codecs = Vec::new();
    for filter in list(value, "filters") {
        codecs.push(codec_of(filter, dtype, "filter")?);
    }
    match value.get("compressor") {
        None | Some(Value::Null) => {}
        Some(compressor) => codecs.push(codec_of(compressor, dtype, "compressor")?),
    }
    let meta = ArrayMeta {
        names: vec![None; axes],
        shape,
        chunk,
        dtype,
        is_big_endian,
        fill,
        keys: ChunkKeys { has_c: false, separator },
        order,
        chain: Chain(codecs),
        shard: None,
        oddities,
    };
    meta.check().map(|()| meta)
}

/// What is said of a fill value that is no value of the array.
pub(super) fn odd_fill(value: &Value, dtype: DType) -> String {
    let found = value.get("fill_value").map_or("nothing".into(), Value::to_string);
    format!("the fill value {} is no {}; the nearest one, or 0, is taken", shortened(&found), dtype.name())
}

fn codec_of(codec: &Value, dtype: DType, role: &str) -> Result<Codec, VolumeFault> {
    let id = text(codec, "id").unwrap_or("without an id");
    Ok(match id {
        "blosc" => Codec::Blosc,
        "zstd" => Codec::Zstd,
        "gzip" => Codec::Gzip,
        "zlib" => Codec::Zlib,
        "lz4" => Codec::Lz4,
        "crc32c" if role == "filter" || role == "compressor" => Codec::Crc32c,
        "shuffle" => Codec::Shuffle(element_size(codec, dtype)),
        _ => {
            return Err(unsupported(format!(
                "the {role} '{}' is not read; write the array without it (blosc, zstd, gzip, zlib, lz4 and shuffle are read)",
                shortened(id)
            )));
        }
    })
}

/// Bytes of the values that a shuffle moves.
pub(super) fn element_size(configuration: &Value, dtype: DType) -> usize {
    let size = configuration.get("elementsize").and_then(Value::as_u64);
    size.and_then(|size| usize::try_from(size).ok())
        .filter(|size| (1..=64).contains(size))
        .unwrap_or(dtype.bytes())
}
