//! What the texels of a texture are: its layers and their formats, and the bytes of a tile.
//!
//! A tile's bytes are its layers one after the other, each row by row without padding. Reading, compressing and
//! checking them is `vastex-tiles`' business.

use crate::geometry::Geometry;

/// The format of one layer's texels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum LayerFormat {
    /// One channel, 8 bits, 0 to 1.
    R8,
    /// Two channels, 8 bits each, 0 to 1.
    Rg8,
    /// Four channels, 8 bits each, 0 to 1.
    Rgba8,
    /// Four channels, 8 bits each, the first three sRGB-encoded.
    Rgba8Srgb,
    /// One channel, 16 bits little-endian, 0 to 1.
    R16,
}

impl LayerFormat {
    /// Every format.
    pub const ALL: [LayerFormat; 5] =
        [LayerFormat::R8, LayerFormat::Rg8, LayerFormat::Rgba8, LayerFormat::Rgba8Srgb, LayerFormat::R16];

    /// Bytes of one texel.
    pub const fn texel_bytes(self) -> usize {
        match self {
            LayerFormat::R8 => 1,
            LayerFormat::Rg8 | LayerFormat::R16 => 2,
            LayerFormat::Rgba8 | LayerFormat::Rgba8Srgb => 4,
        }
    }

    /// The name in help texts, reports and settings.
    pub const fn name(self) -> &'static str {
        match self {
            LayerFormat::R8 => "r8",
            LayerFormat::Rg8 => "rg8",
            LayerFormat::Rgba8 => "rgba8",
            LayerFormat::Rgba8Srgb => "rgba8-srgb",
            LayerFormat::R16 => "r16",
        }
    }
}

/// One attribute stored at the same page positions as the others of its texture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Layer {
    /// What the layer is called: `color`, `height`, a channel's name.
    pub name: String,
    /// The format of its texels.
    pub format: LayerFormat,
}

/// All that is known of a virtual texture without reading a tile.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Description {
    /// Levels, pages, borders.
    pub geometry: Geometry,
    /// At least one layer.
    pub layers: Vec<Layer>,
}

impl Description {
    /// A texture of one layer, called `color`.
    pub fn one_layer(geometry: Geometry, format: LayerFormat) -> Description {
        Description { geometry, layers: vec![Layer { name: "color".into(), format }] }
    }

    /// Bytes of one texel of every layer.
    pub fn texel_bytes(&self) -> usize {
        self.layers.iter().map(|layer| layer.format.texel_bytes()).sum()
    }

    /// Bytes of a tile: payload and border, all layers.
    pub fn tile_bytes(&self) -> usize {
        self.geometry.tile_texels() as usize * self.texel_bytes()
    }
}
