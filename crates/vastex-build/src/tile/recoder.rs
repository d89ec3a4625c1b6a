//! From the tiles of a texture without blocks to those of the same texture as it is stored.

use std::borrow::Cow;

use bytes::Bytes;
use vastex_core::{Description, Geometry, PagePos};
use vastex_tiles::{DecodeError, EncodedTile, ReadError, Tile};

use super::TileEncoder;
use super::tail::extend_levels;

/// Makes tiles of those of a texture without blocks.
pub(crate) struct Recoder<'a> {
    encoder: &'a TileEncoder,
    /// The texture's, as each layer sees it.
    geometries: Vec<Geometry>,
    /// The texture without blocks.
    source: &'a Description,
}

impl<'a> Recoder<'a> {
    /// From tiles of `source` to those of the encoder's texture, which differs in the blocks of its layers at
    /// most.
    pub(crate) fn new(encoder: &'a TileEncoder, source: &'a Description) -> Recoder<'a> {
        let texture = encoder.description();
        let geometries = texture.layers.iter().map(|layer| texture.geometry.of_layer(layer.scale)).collect();
        Recoder { encoder, geometries, source }
    }

    /// The tile of a page, from that of the texture without blocks, which was read from `place`.
    pub(crate) fn recode(&self, pos: PagePos, tile: &Tile, place: &str) -> Result<EncodedTile, ReadError> {
        let damaged = |error: DecodeError| ReadError::Damaged {
            pos,
            place: place.to_owned(),
            fault: error.to_string(),
        };
        Ok(self.tile(pos, &tile.clone().decode(self.source).map_err(damaged)?))
    }

    fn tile(&self, pos: PagePos, texels: &Bytes) -> EncodedTile {
        let layers = 0..self.geometries.len();
        if layers.clone().all(|number| !self.encoder.format(number).is_compressed()) {
            return self.encoder.tile(texels.clone());
        }
        let mut bytes = Vec::with_capacity(self.encoder.description().tile_bytes());
        layers.for_each(|number| {
            self.append(number, pos, &texels[self.source.layer_range(number)], &mut bytes);
        });
        self.encoder.tile(bytes)
    }

    fn append(&self, number: usize, pos: PagePos, texels: &[u8], bytes: &mut Vec<u8>) {
        let (format, geometry) = (self.encoder.format(number), &self.geometries[number]);
        let mut texels = Cow::Borrowed(texels);
        if geometry.is_tail(pos) && format.is_compressed() {
            extend_levels(geometry, format, texels.to_mut());
        }
        let row_bytes = geometry.tile()[0] as usize * format.texel_bytes();
        let rows: Vec<&[u8]> = texels.chunks_exact(row_bytes).collect();
        self.encoder.append(number, &rows, bytes);
    }
}
