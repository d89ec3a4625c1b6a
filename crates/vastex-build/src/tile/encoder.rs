//! What makes the bytes of tiles, whether a texture is built, gets its insets or has a region replaced.

use std::sync::{Arc, Mutex, PoisonError};

use bytes::Bytes;
use vastex_core::{Description, LayerFormat};
use vastex_tiles::{Compression, EncodedTile};

use super::findings::Findings;
use crate::texels::blocks::{self, Lost, Quality, Strip, StripEncoder};

/// Makes tiles of one texture: a layer's share from the layer's texels, the tile from the shares of all
/// layers.
pub(crate) struct TileEncoder {
    /// Says in which format each layer is stored.
    description: Arc<Description>,
    compression: Compression,
    quality: Quality,
    /// What makes blocks.
    encode_strip: StripEncoder,
    findings: Findings,
    /// Memory of tiles that were encoded, to be used again: as many as were made at once at most.
    spare: Mutex<Vec<Vec<u8>>>,
}

impl TileEncoder {
    pub(crate) fn new(
        description: Arc<Description>,
        compression: Compression,
        quality: Quality,
    ) -> TileEncoder {
        let findings = Findings::new(description.layers.len());
        TileEncoder {
            description,
            compression,
            quality,
            encode_strip: blocks::encoder(),
            findings,
            spare: Mutex::default(),
        }
    }

    /// The texture of which the tiles are.
    pub(crate) fn description(&self) -> &Arc<Description> {
        &self.description
    }

    /// The format in which a layer is stored.
    pub(crate) fn format(&self, layer: usize) -> LayerFormat {
        self.description.layers[layer].format
    }

    /// Appends texels of a layer to `bytes`, as tiles store them: rows that are equally long, and of a
    /// compressed layer whole blocks.
    pub(crate) fn append(&self, layer: usize, rows: &[&[u8]], bytes: &mut Vec<u8>) {
        let format = self.format(layer);
        if !format.is_compressed() {
            return rows.iter().for_each(|row| bytes.extend_from_slice(row));
        }
        self.note(layer, blocks::encode(self.encode_strip, format, self.quality, rows, bytes));
    }

    /// Appends a row of blocks of a compressed layer to `blocks`.
    pub(crate) fn append_strip(&self, layer: usize, strip: &Strip<'_>, blocks: &mut Vec<u8>) {
        self.note(layer, (self.encode_strip)(self.format(layer), self.quality, strip, blocks));
    }

    fn note(&self, layer: usize, lost: Lost) {
        if lost.negatives {
            self.findings.note_negatives(layer);
        }
    }

    /// The tile of these bytes, which are the shares of all layers in their order.
    pub(crate) fn tile(&self, bytes: impl Into<Bytes>) -> EncodedTile {
        EncodedTile::new(bytes.into(), &self.description, self.compression)
    }

    /// An empty buffer with room for the bytes of a tile.
    pub(crate) fn buffer(&self) -> Vec<u8> {
        let spare = self.spare.lock().unwrap_or_else(PoisonError::into_inner).pop();
        spare.unwrap_or_else(|| Vec::with_capacity(self.description.tile_bytes()))
    }

    /// As [`TileEncoder::tile`], of bytes in a [`buffer`](TileEncoder::buffer), which is used again.
    pub(crate) fn tile_of_buffer(&self, mut bytes: Vec<u8>) -> EncodedTile {
        let tile = EncodedTile::of_buffer(&mut bytes, &self.description, self.compression);
        // Empty where the tile keeps the memory.
        if bytes.capacity() > 0 {
            bytes.clear();
            self.spare.lock().unwrap_or_else(PoisonError::into_inner).push(bytes);
        }
        tile
    }

    /// What was found so far.
    pub(crate) fn findings(&self) -> &Findings {
        &self.findings
    }

    /// What was found while all tiles were made.
    pub(crate) fn into_findings(self) -> Findings {
        self.findings
    }
}
