//! The arrays of an OME-Zarr: shapes, chunks, shards, keys and metadata.

use serde_json::{Value, json};
use vastex_volume::DType;

use super::codec::ZarrCodec;
use crate::volume::levels::Level;

/// A version of OME-Zarr.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ZarrVersion {
    /// 0.4, in Zarr v2.
    V04,
    /// 0.5, in Zarr v3.
    V05,
}

impl ZarrVersion {
    /// As metadata have it.
    pub const fn name(self) -> &'static str {
        match self {
            ZarrVersion::V04 => "0.4",
            ZarrVersion::V05 => "0.5",
        }
    }
}

/// The axes that arrays have, in their order; those of space are always there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Axes {
    pub(super) has_time: bool,
    pub(super) has_channel: bool,
}

impl Axes {
    /// Names of the axes.
    pub(super) fn names(self) -> Vec<&'static str> {
        self.along("t", "c", ["x", "y", "z"])
    }

    /// Something for each of them, where that for axes of space comes along x, y and z.
    pub(super) fn along<T>(self, time: T, channel: T, [x, y, z]: [T; 3]) -> Vec<T> {
        let mut all = Vec::new();
        all.extend(self.has_time.then_some(time));
        all.extend(self.has_channel.then_some(channel));
        all.extend([z, y, x]);
        all
    }
}

/// One level.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Array {
    pub(super) size: [u64; 3],
    /// Voxels of a chunk.
    pub(super) chunk: [u64; 3],
    /// Chunks of a shard along each axis; `None` where each chunk has a file.
    pub(super) shard: Option<[u64; 3]>,
}

impl Array {
    /// Of a level with chunks of so many voxels, or as many as there are, and `shards` of them along each
    /// axis in a file, or as many as there are.
    pub(super) fn new(level: &Level, chunk: [u64; 3], shards: u64) -> Array {
        let chunk: [u64; 3] = std::array::from_fn(|axis| chunk[axis].min(level.size[axis]));
        let counts: [u64; 3] = std::array::from_fn(|axis| level.size[axis].div_ceil(chunk[axis]).min(shards));
        Array { size: level.size, chunk, shard: (shards > 1).then_some(counts) }
    }

    /// Chunks in a file, along each axis.
    pub(super) fn chunks_of_file(&self) -> [u64; 3] {
        self.shard.unwrap_or([1; 3])
    }

    /// Voxels in a file.
    pub(super) fn file(&self) -> [u64; 3] {
        let counts = self.chunks_of_file();
        std::array::from_fn(|axis| self.chunk[axis] * counts[axis])
    }
}

/// What all arrays of an image have in common.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Arrays {
    pub(super) version: ZarrVersion,
    pub(super) axes: Axes,
    pub(super) channels: u64,
    pub(super) times: u64,
    pub(super) dtype: DType,
    pub(super) fill: Vec<u8>,
    pub(super) codec: ZarrCodec,
}

impl Arrays {
    /// Where a chunk or a shard lies below its array.
    pub(super) fn key(&self, channel: u64, time: u64, at: [u64; 3]) -> String {
        let parts: Vec<String> = self.axes.along(time, channel, at).iter().map(u64::to_string).collect();
        match self.version {
            ZarrVersion::V04 => parts.join("/"),
            ZarrVersion::V05 => format!("c/{}", parts.join("/")),
        }
    }

    /// The name of the file with an array's metadata, and what is in it.
    pub(super) fn metadata(&self, array: &Array) -> (&'static str, Value) {
        let along = |sides: [u64; 3]| self.axes.along(1, 1, sides);
        let shape = self.axes.along(self.times, self.channels, array.size);
        match self.version {
            ZarrVersion::V04 => {
                let order = if self.dtype.bytes() == 1 { '|' } else { '<' };
                let said = json!({
                    "zarr_format": 2,
                    "shape": shape,
                    "chunks": along(array.chunk),
                    "dtype": format!("{order}{}", self.dtype.short_name()),
                    "compressor": self.codec.v2(),
                    "fill_value": self.fill_value(),
                    "order": "C",
                    "filters": null,
                    "dimension_separator": "/",
                });
                (".zarray", said)
            }
            ZarrVersion::V05 => {
                let mut codecs = vec![match self.dtype.bytes() {
                    1 => json!({"name": "bytes"}),
                    _ => json!({"name": "bytes", "configuration": {"endian": "little"}}),
                }];
                codecs.extend(self.codec.v3());
                if array.shard.is_some() {
                    codecs = vec![json!({"name": "sharding_indexed", "configuration": {
                        "chunk_shape": along(array.chunk),
                        "codecs": codecs,
                        "index_codecs": [
                            {"name": "bytes", "configuration": {"endian": "little"}},
                            {"name": "crc32c"},
                        ],
                        "index_location": "end",
                    }})];
                }
                let said = json!({
                    "zarr_format": 3,
                    "node_type": "array",
                    "shape": shape,
                    "data_type": self.dtype.name(),
                    "chunk_grid": {"name": "regular", "configuration": {"chunk_shape": along(array.file())}},
                    "chunk_key_encoding": {"name": "default", "configuration": {"separator": "/"}},
                    "fill_value": self.fill_value(),
                    "codecs": codecs,
                    "attributes": {},
                    "dimension_names": self.axes.names(),
                });
                ("zarr.json", said)
            }
        }
    }

    /// The fill value as JSON. Floats that are no numbers have one name, and one value.
    fn fill_value(&self) -> Value {
        let mut wide = [0; 8];
        wide[..self.fill.len()].copy_from_slice(&self.fill);
        let bits = u64::from_le_bytes(wide);
        // Whole numbers with a sign are made as wide as they can be.
        let unused = 64 - 8 * self.fill.len() as u32;
        let signed = (bits << unused) as i64 >> unused;
        match self.dtype {
            DType::Bool => json!(bits != 0),
            DType::U8 | DType::U16 | DType::U32 | DType::U64 => json!(bits),
            DType::I8 | DType::I16 | DType::I32 | DType::I64 => json!(signed),
            DType::F16 => float(half::f16::from_bits(bits as u16).to_f64()),
            DType::F32 => float(f64::from(f32::from_bits(bits as u32))),
            DType::F64 => float(f64::from_bits(bits)),
        }
    }
}

fn float(number: f64) -> Value {
    match number {
        number if number.is_nan() => json!("NaN"),
        f64::INFINITY => json!("Infinity"),
        f64::NEG_INFINITY => json!("-Infinity"),
        number => json!(number),
    }
}

/// The bytes of a fill value that metadata can say: of floats that are no numbers, the one that all programs
/// mean.
pub(super) fn sayable(dtype: DType, mut fill: Vec<u8>) -> Vec<u8> {
    let is_nan = match (dtype, &fill[..]) {
        (DType::F16, [a, b]) => half::f16::from_le_bytes([*a, *b]).is_nan(),
        (DType::F32, [a, b, c, d]) => f32::from_le_bytes([*a, *b, *c, *d]).is_nan(),
        (DType::F64, bytes) => bytes.first_chunk().is_some_and(|bytes| f64::from_le_bytes(*bytes).is_nan()),
        _ => false,
    };
    if is_nan {
        fill = match dtype {
            DType::F16 => 0x7e00_u16.to_le_bytes().into(),
            DType::F32 => 0x7fc0_0000_u32.to_le_bytes().into(),
            _ => 0x7ff8_0000_0000_0000_u64.to_le_bytes().into(),
        };
    }
    fill
}

#[cfg(test)]
mod tests {
    use super::*;

    fn arrays(dtype: DType, fill: Vec<u8>) -> Arrays {
        let axes = Axes { has_time: false, has_channel: true };
        let codec = ZarrCodec::Zstd(3);
        Arrays { version: ZarrVersion::V05, axes, channels: 2, times: 1, dtype, fill, codec }
    }

    #[test]
    fn fill_values_are_what_metadata_call_them() {
        for (dtype, fill, said) in [
            (DType::Bool, vec![1], json!(true)),
            (DType::I16, vec![0xfe, 0xff], json!(-2)),
            (DType::U64, vec![0xff; 8], json!(u64::MAX)),
            (DType::F16, vec![0, 0x3c], json!(1.0)),
            (DType::F32, f32::NEG_INFINITY.to_le_bytes().into(), json!("-Infinity")),
            (DType::F64, 1.5_f64.to_le_bytes().into(), json!(1.5)),
        ] {
            assert_eq!(arrays(dtype, fill).fill_value(), said);
        }
        let odd_nan = vec![1, 0, 0xc0, 0xff];
        let fill = sayable(DType::F32, odd_nan);
        assert_eq!(
            (fill.clone(), arrays(DType::F32, fill).fill_value()),
            (vec![0, 0, 0xc0, 0x7f], json!("NaN"))
        );
        assert_eq!(sayable(DType::U32, vec![1, 0, 0xc0, 0xff]), [1, 0, 0xc0, 0xff]);
    }

    #[test]
    fn keys_and_pieces_follow_the_axes() {
        let arrays = arrays(DType::U8, vec![0]);
        assert_eq!(arrays.key(1, 0, [4, 3, 2]), "c/1/2/3/4");
        assert_eq!(Arrays { version: ZarrVersion::V04, ..arrays.clone() }.key(1, 0, [4, 3, 2]), "1/2/3/4");
        let level = Level { size: [100, 70, 5], factor: [1; 3], scale: [1; 3] };
        let array = Array::new(&level, [32; 3], 3);
        assert_eq!((array.chunk, array.shard, array.file()), ([32, 32, 5], Some([3, 3, 1]), [96, 96, 5]));
        let (name, said) = arrays.metadata(&array);
        assert_eq!(
            (name, &said["chunk_grid"]["configuration"]["chunk_shape"]),
            ("zarr.json", &json!([1, 5, 96, 96]))
        );
        assert_eq!(said["codecs"][0]["configuration"]["chunk_shape"], json!([1, 5, 32, 32]));
        assert_eq!(said["shape"], json!([2, 5, 70, 100]));
    }
}
