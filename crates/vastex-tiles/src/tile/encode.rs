//! Encoding tiles, which threads do side by side before the container's writer appends the tiles in order.
//!
//! The content hash by which identical tiles are found is taken here; which tiles are stored once is the
//! writer's business.

use std::cell::RefCell;

use bytes::Bytes;
use lz4_flex::block::{CompressTable, compress_into_with_table, get_maximum_output_size};
use vastex_core::{Description, Layer, LayerFormat};

use super::lz4::{TEXEL, TexelEncoder};
use super::{Codec, Compression, Tile};
use crate::ground::hash::{checksum, checksum_of_hashed, content_hash};

/// A tile encoded for a container, with the hash by which identical tiles are found and the checksum of its
/// bytes.
#[derive(Clone, Debug)]
pub struct EncodedTile {
    tile: Tile,
    content: u128,
    checksum: u64,
    raw_len: usize,
}

impl EncodedTile {
    /// Encodes the texels of one tile: all layers, `description.tile_bytes()` bytes.
    ///
    /// A constant tile becomes one block of each layer (one texel if the layer is not compressed). If
    /// compression does not help, the texels are kept as they are, without a copy. Pure and free of locks:
    /// call it from as many threads as there are.
    pub fn new(texels: Bytes, description: &Description, compression: Compression) -> EncodedTile {
        let (content, raw_len) = (content_hash(&texels), texels.len());
        let tile = encoded(&texels, description, compression);
        EncodedTile::hashed(tile.unwrap_or(Tile { codec: Codec::Raw, bytes: texels }), content, raw_len)
    }

    /// As [`EncodedTile::new`], of texels in a buffer that can be used again: it is left as it is, but
    /// becomes empty where the texels are kept as they are, which then are its bytes.
    pub fn of_buffer(
        texels: &mut Vec<u8>,
        description: &Description,
        compression: Compression,
    ) -> EncodedTile {
        let (content, raw_len) = (content_hash(texels), texels.len());
        let tile = encoded(texels, description, compression);
        let kept = || Tile { codec: Codec::Raw, bytes: std::mem::take(texels).into() };
        EncodedTile::hashed(tile.unwrap_or_else(kept), content, raw_len)
    }

    /// `content` and `raw_len` are the hash and the length of the texels.
    fn hashed(tile: Tile, content: u128, raw_len: usize) -> EncodedTile {
        let checksum = match tile.codec {
            Codec::Raw => checksum_of_hashed(&tile.bytes, content),
            _ => checksum(&tile.bytes),
        };
        EncodedTile { checksum, tile, content, raw_len }
    }

    /// A tile that was encoded before: `content` is equal for identical tiles alone, `checksum` that of the
    /// encoded bytes, `raw_len` the length of the decoded ones.
    pub(crate) fn encoded_before(tile: Tile, content: u128, checksum: u64, raw_len: usize) -> EncodedTile {
        EncodedTile { tile, content, checksum, raw_len }
    }

    /// The encoded tile.
    pub fn tile(&self) -> &Tile {
        &self.tile
    }

    /// The encoded tile, without its hash and checksum.
    pub(crate) fn into_tile(self) -> Tile {
        self.tile
    }

    /// The hash by which identical tiles are found.
    pub(crate) fn content(&self) -> u128 {
        self.content
    }

    /// The checksum of the encoded bytes.
    pub(crate) fn checksum(&self) -> u64 {
        self.checksum
    }

    /// Bytes of the decoded tile.
    pub(crate) fn raw_len(&self) -> usize {
        self.raw_len
    }
}

/// The texels of one tile as a constant, or compressed; `None` if they are best kept as they are.
fn encoded(texels: &[u8], description: &Description, compression: Compression) -> Option<Tile> {
    if let Some(blocks) = constant_blocks(texels, description) {
        return Some(Tile { codec: Codec::Constant, bytes: blocks.into() });
    }
    let (codec, bytes) = match compression {
        Compression::None => None,
        Compression::Lz4 => lz4_compress(texels, description).map(|bytes| (Codec::Lz4, bytes)),
        Compression::Zstd(level) => zstd_compress(texels, level).map(|bytes| (Codec::Zstd, bytes.into())),
    }?;
    (bytes.len() < texels.len()).then_some(Tile { codec, bytes })
}

/// One block of each layer (a texel if the layer is not compressed), or `None` unless all blocks of each
/// layer are the same.
fn constant_blocks(texels: &[u8], description: &Description) -> Option<Vec<u8>> {
    if texels.is_empty() || texels.len() != description.tile_bytes() {
        return None;
    }
    let (mut constant, mut rest) = (Vec::with_capacity(description.block_bytes()), texels);
    for layer in &description.layers {
        let size = layer.format.block_bytes();
        let (of_layer, others) = rest.split_at(description.layer_bytes(layer));
        // Each block equals the next exactly if the layer equals itself shifted by one block.
        if of_layer[size..] != of_layer[..of_layer.len() - size] {
            return None;
        }
        constant.extend_from_slice(&of_layer[..size]);
        rest = others;
    }
    Some(constant)
}

/// What compressing with LZ4 takes: memory that would else be asked for and given back with every tile.
struct Lz4 {
    /// For colours with alpha.
    colors: TexelEncoder,
    /// For other tiles of less than 64 KiB, and for larger ones: the bytes depend on which it is.
    tables: [CompressTable; 2],
    out: Vec<u8>,
}

/// Bytes of tiles for which each thread keeps memory at most.
const KEPT_BYTES: usize = 4 << 20;

thread_local! {
    static LZ4: RefCell<Lz4> = RefCell::new(Lz4 {
        colors: TexelEncoder::new(),
        tables: [CompressTable::small(), CompressTable::large()],
        out: Vec::new(),
    });
}

/// One LZ4 block; `None` if the encoder refuses.
fn lz4_compress(texels: &[u8], description: &Description) -> Option<Bytes> {
    LZ4.with_borrow_mut(|Lz4 { colors, tables: [small, large], out }| {
        if let Some(row_bytes) = color_row_bytes(description) {
            let bytes = Bytes::copy_from_slice(colors.encode(texels, row_bytes));
            colors.keep_at_most(KEPT_BYTES);
            return Some(bytes);
        }
        let table = if texels.len() < usize::from(u16::MAX) { small } else { large };
        let most = get_maximum_output_size(texels.len());
        if out.len() < most {
            out.resize(most, 0);
        }
        let len = compress_into_with_table(texels, out, table).ok()?;
        let bytes = Bytes::copy_from_slice(&out[..len]);
        if out.len() > KEPT_BYTES {
            *out = Vec::new();
        }
        Some(bytes)
    })
}

/// Bytes of a row of the first layer's texels, where all layers are colours with alpha of 8 bits.
fn color_row_bytes(description: &Description) -> Option<usize> {
    let is_color = |layer: &Layer| matches!(layer.format, LayerFormat::Rgba8 | LayerFormat::Rgba8Srgb);
    let first = description.layers.first().filter(|_| description.layers.iter().all(is_color))?;
    Some(description.layer_tile(first)[0] as usize * TEXEL)
}

/// `None` if the encoder refuses; the tile is then stored as it is.
#[cfg(not(target_family = "wasm"))]
fn zstd_compress(texels: &[u8], level: i32) -> Option<Vec<u8>> {
    zstd::bulk::compress(texels, level).ok()
}

#[cfg(target_family = "wasm")]
fn zstd_compress(texels: &[u8], _level: i32) -> Option<Vec<u8>> {
    Some(ruzstd::encoding::compress_to_vec(texels, ruzstd::encoding::CompressionLevel::Fastest))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use vastex_core::{Geometry, GeometrySpec};

    fn description(formats: &[LayerFormat]) -> Description {
        let geometry =
            Geometry::new(GeometrySpec { page: 8, border: 1, ..GeometrySpec::image(20, 20) }).unwrap();
        let layers = formats
            .iter()
            .enumerate()
            .map(|(n, &format)| Layer::new(format!("{n} {}", format.name()), format));
        Description::new(geometry, layers.collect())
    }

    proptest! {
        #[test]
        fn what_is_encoded_decodes_to_itself(
            formats in prop::collection::vec(prop::sample::select(&LayerFormat::ALL[..]), 1..4),
            run in 1usize..400,
            seed: u64,
            compression in prop::sample::select(vec![Compression::None, Compression::Lz4, Compression::Zstd(1)]),
        ) {
            let description = description(&formats);
            let texels: Vec<u8> =
                (0..description.tile_bytes()).map(|i| crate::ground::hash::seeded(seed, &(i / run).to_le_bytes()) as u8).collect();
            let tile = EncodedTile::new(texels.clone().into(), &description, compression).into_tile();
            prop_assert!(tile.bytes.len() <= texels.len());
            prop_assert_eq!(tile.decode(&description).unwrap(), texels);
        }
    }

    #[test]
    fn a_constant_tile_is_one_texel_of_each_layer() {
        let description = description(&[LayerFormat::R16, LayerFormat::R8]);
        let mut texels = [[9, 8].repeat(100), vec![3; 100]].concat();
        let tile = EncodedTile::new(texels.clone().into(), &description, Compression::Lz4).into_tile();
        assert_eq!(tile, Tile { codec: Codec::Constant, bytes: vec![9, 8, 3].into() });
        texels[299] = 4;
        assert_eq!(EncodedTile::new(texels.into(), &description, Compression::Lz4).tile().codec, Codec::Lz4);
    }
}
