//! How chunks are compressed, and what metadata call it.

use std::cell::RefCell;
use std::io::Write;

use serde_json::{Value, json};

/// How chunks of an OME-Zarr are compressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ZarrCodec {
    /// Not at all.
    None,
    /// Zstandard at this level, 1 to 22.
    Zstd(i32),
    /// gzip at this level, 1 to 9.
    Gzip(u32),
}

thread_local! {
    /// Kept by each thread: making one takes a megabyte of memory each time.
    static COMPRESSOR: RefCell<Option<(i32, zstd::bulk::Compressor<'static>)>> = const { RefCell::new(None) };
}

impl ZarrCodec {
    /// The bytes of a chunk as they are stored; the error is what the compressor said.
    pub(super) fn encode(self, chunk: Vec<u8>) -> Result<Vec<u8>, String> {
        match self {
            ZarrCodec::None => Ok(chunk),
            ZarrCodec::Zstd(level) => COMPRESSOR.with_borrow_mut(|kept| {
                if kept.as_ref().is_none_or(|(of, _)| *of != level) {
                    let made = zstd::bulk::Compressor::new(level).map_err(|error| error.to_string())?;
                    *kept = Some((level, made));
                }
                let Some((_, compressor)) = kept else { return Err("there is no compressor".into()) };
                compressor.compress(&chunk).map_err(|error| error.to_string())
            }),
            ZarrCodec::Gzip(level) => {
                let compression = flate2::Compression::new(level);
                let mut encoder = flate2::write::GzEncoder::new(Vec::new(), compression);
                let written = encoder.write_all(&chunk).and_then(|()| encoder.finish());
                written.map_err(|error| error.to_string())
            }
        }
    }

    /// What arrays of Zarr v3 call it, if there is anything to call.
    pub(super) fn v3(self) -> Option<Value> {
        match self {
            ZarrCodec::None => None,
            ZarrCodec::Zstd(level) => {
                Some(json!({"name": "zstd", "configuration": {"level": level, "checksum": false}}))
            }
            ZarrCodec::Gzip(level) => Some(json!({"name": "gzip", "configuration": {"level": level}})),
        }
    }

    /// What arrays of Zarr v2 call it.
    pub(super) fn v2(self) -> Value {
        match self {
            ZarrCodec::None => Value::Null,
            ZarrCodec::Zstd(level) => json!({"id": "zstd", "level": level, "checksum": false}),
            ZarrCodec::Gzip(level) => json!({"id": "gzip", "level": level}),
        }
    }
}
