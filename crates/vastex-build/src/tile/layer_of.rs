//! The way back from the tiles of a texture to the texels of one of its layers.

use bytes::Bytes;
use vastex_core::{Description, Geometry, LayerFormat, PagePos};
use vastex_tiles::{DecodeError, ReadError, TileSource, decode_layer};

use crate::texels::magnify::magnified;

/// A layer of a texture, as a texture of its own.
#[derive(Clone, Debug)]
pub(crate) struct LayerOf {
    index: usize,
    /// As the texture stores it.
    stored: LayerFormat,
    geometry: Geometry,
}

impl LayerOf {
    /// The layer of that name, or the first; else says which there are.
    pub(crate) fn new(description: &Description, name: Option<&str>) -> Result<LayerOf, String> {
        let layers = &description.layers;
        let found = layers.iter().position(|layer| name.is_none_or(|name| name == layer.name));
        let Some((index, layer)) = found.and_then(|index| Some((index, layers.get(index)?))) else {
            let names: Vec<_> = layers.iter().map(|layer| layer.name.as_str()).collect();
            let name = name.unwrap_or_default();
            return Err(format!("there is no layer '{name}'; there is {}", names.join(", ")));
        };
        let geometry = description.geometry.of_layer(layer.scale);
        Ok(LayerOf { index, stored: layer.format, geometry })
    }

    /// Of its texels, decoded.
    pub(crate) fn format(&self) -> LayerFormat {
        self.stored.decoded()
    }

    /// Of the tiles in the texture.
    pub(crate) fn stored_format(&self) -> LayerFormat {
        self.stored
    }

    /// The levels, pages and borders that the layer sees.
    pub(crate) fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    /// The texels of the layer in a tile; of one that is missing, those of its nearest ancestor, magnified.
    pub(crate) fn texels(&self, source: &dyn TileSource, pos: PagePos) -> Result<Bytes, LayerFault> {
        let has_tile = |pos| source.present().is_none_or(|present| present.contains(pos));
        let mut shown = pos;
        while let Some(parent) = self.geometry.parent(shown).filter(|_| !has_tile(shown)) {
            shown = parent;
        }
        let description = source.description();
        let tile = pollster::block_on(source.read(shown))?;
        let tile = tile.decode(description).map_err(|error| LayerFault::Decode { pos: shown, error })?;
        let texels = decode_layer(description, self.index, &tile);
        match shown == pos {
            true => Ok(texels),
            false => Ok(magnified(&self.geometry, pos, shown, &texels, self.format().texel_bytes()).into()),
        }
    }
}

/// Why the texels of a tile cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum LayerFault {
    /// A tile of the texture cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// A tile of the texture cannot be decoded.
    #[error("{pos}: {error}; rebuild the file, or copy it anew")]
    Decode {
        /// The page.
        pos: PagePos,
        /// What is wrong.
        #[source]
        error: DecodeError,
    },
}
