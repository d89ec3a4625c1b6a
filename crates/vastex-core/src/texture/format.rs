//! What the texels of a texture are: its layers and their formats, and the bytes of a tile.
//!
//! A tile's bytes are its layers one after the other, each row by row without padding: rows of texels, or of
//! blocks of 4x4 texels where the format is compressed. A layer may have half or a quarter of the texture's
//! resolution. Reading, compressing and checking tiles is `vastex-tiles`' business.

use std::ops::Range;

use crate::texture::geometry::{Geometry, TexelPositions};
use crate::texture::nodata::NodataValue;
use crate::texture::page::Dims;

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
    /// Four channels, 16 bits little-endian each, 0 to 1.
    Rgba16,
    /// One channel, a 16-bit float.
    R16Float,
    /// Four channels, a 16-bit float each.
    Rgba16Float,
    /// One channel, a 32-bit float.
    R32Float,
    /// Colour and one bit of alpha in blocks of 8 bytes.
    Bc1,
    /// As [`LayerFormat::Bc1`], the colours sRGB-encoded.
    Bc1Srgb,
    /// Colour and alpha in blocks of 16 bytes.
    Bc3,
    /// As [`LayerFormat::Bc3`], the colours sRGB-encoded.
    Bc3Srgb,
    /// One channel in blocks of 8 bytes, 0 to 1.
    Bc4,
    /// Two channels in blocks of 16 bytes, 0 to 1.
    Bc5,
    /// Three channels in blocks of 16 bytes, floats that are not negative.
    Bc6h,
    /// Colour and alpha in blocks of 16 bytes, better than [`LayerFormat::Bc3`].
    Bc7,
    /// As [`LayerFormat::Bc7`], the colours sRGB-encoded.
    Bc7Srgb,
    /// One whole number of 32 bits, little-endian: a label. Of volumes alone, and never mixed.
    R32Uint,
    /// One whole number of 64 bits, little-endian, as two of 32, the lower half first: a label. Of volumes
    /// alone, and never mixed.
    Rg32Uint,
}

impl LayerFormat {
    /// Every format that a layer of an image may have.
    pub const ALL: [LayerFormat; 18] = {
        use LayerFormat::*;
        [
            R8,
            Rg8,
            Rgba8,
            Rgba8Srgb,
            R16,
            Rgba16,
            R16Float,
            Rgba16Float,
            R32Float,
            Bc1,
            Bc1Srgb,
            Bc3,
            Bc3Srgb,
            Bc4,
            Bc5,
            Bc6h,
            Bc7,
            Bc7Srgb,
        ]
    };

    /// The formats of whole numbers, which only volumes may have and which are read as they are.
    pub const WHOLE_NUMBERS: [LayerFormat; 2] = [LayerFormat::R32Uint, LayerFormat::Rg32Uint];

    /// Returns true if texels are whole numbers and stand for no share of 0 to 1: read by `textureLoad`,
    /// never filtered.
    pub const fn is_whole_number(self) -> bool {
        matches!(self, LayerFormat::R32Uint | LayerFormat::Rg32Uint)
    }

    /// Texels per side of the blocks that are encoded together: 4, or 1 where the format is not compressed.
    pub const fn block_side(self) -> u32 {
        if self.is_compressed() { 4 } else { 1 }
    }

    /// Bytes of one block, or of one texel if the format is not compressed.
    pub const fn block_bytes(self) -> usize {
        use LayerFormat::*;
        match self {
            R8 => 1,
            Rg8 | R16 | R16Float => 2,
            Rgba8 | Rgba8Srgb | R32Float | R32Uint => 4,
            Rgba16 | Rgba16Float | Rg32Uint | Bc1 | Bc1Srgb | Bc4 => 8,
            Bc3 | Bc3Srgb | Bc5 | Bc6h | Bc7 | Bc7Srgb => 16,
        }
    }

    /// Returns true if texels are encoded in blocks.
    pub const fn is_compressed(self) -> bool {
        use LayerFormat::*;
        matches!(self, Bc1 | Bc1Srgb | Bc3 | Bc3Srgb | Bc4 | Bc5 | Bc6h | Bc7 | Bc7Srgb)
    }

    /// Returns true if the first three channels are sRGB-encoded.
    pub const fn is_srgb(self) -> bool {
        use LayerFormat::*;
        matches!(self, Rgba8Srgb | Bc1Srgb | Bc3Srgb | Bc7Srgb)
    }

    /// The format of the texels that blocks are made from and decoded to; the format itself where it is not
    /// compressed.
    pub const fn decoded(self) -> LayerFormat {
        use LayerFormat::*;
        match self {
            Bc1 | Bc3 | Bc7 => Rgba8,
            Bc1Srgb | Bc3Srgb | Bc7Srgb => Rgba8Srgb,
            Bc4 => R8,
            Bc5 => Rg8,
            Bc6h => Rgba16Float,
            _ => self,
        }
    }

    /// Bytes of one texel as it is [decoded](LayerFormat::decoded): what readers and filters hold.
    pub const fn texel_bytes(self) -> usize {
        self.decoded().block_bytes()
    }

    /// Channels that the format holds.
    pub const fn channels(self) -> usize {
        use LayerFormat::*;
        match self {
            R8 | R16 | R16Float | R32Float | R32Uint | Bc4 => 1,
            Rg8 | Rg32Uint | Bc5 => 2,
            Bc6h => 3,
            Rgba8 | Rgba8Srgb | Rgba16 | Rgba16Float | Bc1 | Bc1Srgb | Bc3 | Bc3Srgb | Bc7 | Bc7Srgb => 4,
        }
    }

    /// The name in help texts, reports and settings.
    pub const fn name(self) -> &'static str {
        use LayerFormat::*;
        match self {
            R8 => "r8",
            Rg8 => "rg8",
            Rgba8 => "rgba8",
            Rgba8Srgb => "rgba8-srgb",
            R16 => "r16",
            Rgba16 => "rgba16",
            R16Float => "r16f",
            Rgba16Float => "rgba16f",
            R32Float => "r32f",
            Bc1 => "bc1",
            Bc1Srgb => "bc1-srgb",
            Bc3 => "bc3",
            Bc3Srgb => "bc3-srgb",
            Bc4 => "bc4",
            Bc5 => "bc5",
            Bc6h => "bc6h",
            Bc7 => "bc7",
            Bc7Srgb => "bc7-srgb",
            R32Uint => "r32uint",
            Rg32Uint => "rg32uint",
        }
    }

    /// The format of a [name](LayerFormat::name), of those that images may have.
    pub fn named(name: &str) -> Option<LayerFormat> {
        LayerFormat::ALL.into_iter().find(|format| format.name() == name)
    }
}

/// One attribute stored at the same page positions as the others of its texture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Layer {
    /// What the layer is called: `color`, `height`, a channel's name.
    pub name: String,
    /// The format of its texels.
    pub format: LayerFormat,
    /// Texels of the texture along one texel of the layer: 1, 2 or 4.
    pub scale: u32,
    /// True if a value between those of two texels means something, as with colours and heights. Where it
    /// does not, as with labels and numbers of objects, each pixel shows one texel as it is stored, whatever
    /// the filter, and tiles do not fade in.
    pub is_mixable: bool,
    /// The value that marks texels without data, if there is one. Coarser levels leave such texels out;
    /// whoever draws the layer should neither draw them nor blend them with others.
    pub nodata: Option<NodataValue>,
}

impl Layer {
    /// A layer at the texture's resolution, of values that may be mixed and are all known.
    pub fn new(name: impl Into<String>, format: LayerFormat) -> Layer {
        Layer { name: name.into(), format, scale: 1, is_mixable: true, nodata: None }
    }
}

/// Why layers do not suit a geometry.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LayerError {
    /// There is none.
    #[error("a texture needs a layer")]
    None,
    /// Two have the same name.
    #[error("two layers are called {0:?}; names tell layers apart")]
    Name(String),
    /// The layer's share of the resolution is none that is known.
    #[error("layer {name:?} has 1/{scale} of the resolution; 1, 1/2 and 1/4 are possible")]
    Scale {
        /// Of the layer.
        name: String,
        /// The layer's scale.
        scale: u32,
    },
    /// Pages or borders do not hold whole texels, or whole blocks, of the layer.
    #[error(
        "pages of {page} texels with borders of {border} do not suit layer {name:?} ({format} at 1/{scale}); both, and the \
         alignment of {align} in the tail, must be multiples of {unit}"
    )]
    Blocks {
        /// Of the layer.
        name: String,
        /// Name of the layer's format.
        format: &'static str,
        /// The layer's scale.
        scale: u32,
        /// Texels of payload per side.
        page: u32,
        /// Texels of border.
        border: u32,
        /// Texels that offsets in the tail are multiples of.
        align: u32,
        /// The unit that sides must be multiples of, in texels of the texture.
        unit: u32,
    },
    /// A volume cannot have compressed layers.
    #[error("layer {0:?} is compressed in blocks, which volumes cannot be")]
    Volume(String),
    /// An image cannot have a layer of whole numbers, nor can such a layer be mixed.
    #[error("layer {0:?} holds whole numbers, which only volumes can have, and which are never mixed")]
    WholeNumbers(String),
    /// Texels that keep their positions need layers of the full resolution.
    #[error("layer {0:?} has a fraction of the resolution, which goes only with filters of even size")]
    Positions(String),
}

/// All that is known of a virtual texture without reading a tile.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Description {
    /// Levels, pages, borders.
    pub geometry: Geometry,
    /// At least one layer.
    pub layers: Vec<Layer>,
    /// What lies beyond an edge whose address mode is [`AddressMode::Border`](crate::AddressMode::Border):
    /// red, green, blue (sRGB-encoded where a layer is) and alpha, of which a layer takes as many channels as
    /// it has.
    pub border_color: [u8; 4],
}

impl Description {
    /// A texture of these layers, with a transparent black border colour. [`Description::check`] says whether
    /// they suit.
    pub fn new(geometry: Geometry, layers: Vec<Layer>) -> Description {
        Description { geometry, layers, border_color: [0; 4] }
    }

    /// A texture of one layer, called `color`.
    pub fn one_layer(geometry: Geometry, format: LayerFormat) -> Description {
        Description::new(geometry, vec![Layer::new("color", format)])
    }

    /// Texels that offsets in a tail must be multiples of for these layers.
    pub fn tail_align(layers: &[Layer]) -> u32 {
        layers.iter().map(|layer| layer.scale * 4).max().unwrap_or(4)
    }

    /// Checks that the layers suit the geometry: whole texels and blocks in every page, border and level of
    /// the tail.
    pub fn check(&self) -> Result<(), LayerError> {
        let spec = self.geometry.spec();
        if self.layers.is_empty() {
            return Err(LayerError::None);
        }
        for (i, layer) in self.layers.iter().enumerate() {
            let (name, scale) = (layer.name.clone(), layer.scale);
            if self.layers[..i].iter().any(|other| other.name == name) {
                return Err(LayerError::Name(name));
            }
            if ![1, 2, 4].contains(&scale) {
                return Err(LayerError::Scale { name, scale });
            }
            if layer.format.is_compressed() && spec.dims == Dims::D3 {
                return Err(LayerError::Volume(name));
            }
            if layer.format.is_whole_number() && (spec.dims == Dims::D2 || layer.is_mixable) {
                return Err(LayerError::WholeNumbers(name));
            }
            if scale > 1 && spec.positions == TexelPositions::Kept {
                return Err(LayerError::Positions(name));
            }
            let unit = scale * layer.format.block_side();
            let (page, border, align) = (spec.page, spec.border, spec.tail_align);
            if [page, border, align].iter().any(|n| !n.is_multiple_of(unit)) {
                let format = layer.format.name();
                return Err(LayerError::Blocks { name, format, scale, page, border, align, unit });
            }
        }
        Ok(())
    }

    /// Bytes of one block of every layer, one after the other: a tile of one colour repeats these.
    pub fn block_bytes(&self) -> usize {
        self.layers.iter().map(|layer| layer.format.block_bytes()).sum()
    }

    /// Size of a layer's part of a tile, in texels of the layer.
    pub fn layer_tile(&self, layer: &Layer) -> [u32; 3] {
        self.geometry.tile().map(|n| if n == 1 { 1 } else { n / layer.scale })
    }

    /// Blocks of a layer in a tile: texels where the format is not compressed.
    pub fn layer_blocks(&self, layer: &Layer) -> u64 {
        let side = layer.format.block_side();
        self.layer_tile(layer).iter().map(|&n| if n == 1 { 1 } else { u64::from(n / side) }).product()
    }

    /// Bytes of a layer in a tile.
    pub fn layer_bytes(&self, layer: &Layer) -> usize {
        self.layer_blocks(layer) as usize * layer.format.block_bytes()
    }

    /// Which of a tile's bytes are those of layer number `index`, which exists.
    pub fn layer_range(&self, index: usize) -> Range<usize> {
        let start = self.layers[..index].iter().map(|layer| self.layer_bytes(layer)).sum();
        start..start + self.layer_bytes(&self.layers[index])
    }

    /// Bytes of a tile: payload and border, all layers.
    pub fn tile_bytes(&self) -> usize {
        self.layers.iter().map(|layer| self.layer_bytes(layer)).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::texture::geometry::GeometrySpec;

    fn described(page: u32, border: u32, layers: Vec<Layer>) -> Description {
        let tail_align = Description::tail_align(&layers).next_power_of_two();
        let spec = GeometrySpec { page, border, tail_align, ..GeometrySpec::image(1000, 700) };
        Description::new(Geometry::new(spec).unwrap(), layers)
    }

    #[test]
    fn names_find_formats_again() {
        for format in LayerFormat::ALL {
            assert_eq!(LayerFormat::named(format.name()), Some(format));
        }
    }

    #[test]
    fn whole_numbers_are_of_volumes_and_never_mixed() {
        let labels = |is_mixable| Layer { is_mixable, ..Layer::new("labels", LayerFormat::Rg32Uint) };
        let refused = Err(LayerError::WholeNumbers("labels".into()));
        assert_eq!(described(64, 4, vec![labels(false)]).check(), refused);
        let spec = GeometrySpec { page: 64, border: 1, ..GeometrySpec::volume([100, 80, 60]) };
        let volume = |is_mixable| Description::new(Geometry::new(spec).unwrap(), vec![labels(is_mixable)]);
        assert_eq!((volume(false).check(), volume(true).check()), (Ok(()), refused));
        assert_eq!(volume(false).tile_bytes(), 66 * 66 * 66 * 8);
        assert!(LayerFormat::WHOLE_NUMBERS.iter().all(|format| !LayerFormat::ALL.contains(format)));
    }

    #[test]
    fn layers_share_a_tile() {
        let height = Layer { scale: 2, ..Layer::new("height", LayerFormat::R16) };
        let color = Layer::new("color", LayerFormat::Bc1Srgb);
        let description = described(128, 4, vec![color, height]);
        assert_eq!(description.check(), Ok(()));
        assert_eq!(description.layer_range(0), 0..34 * 34 * 8);
        assert_eq!(description.layer_range(1), 34 * 34 * 8..34 * 34 * 8 + 68 * 68 * 2);
        assert_eq!(description.tile_bytes(), description.layer_range(1).end);
    }

    #[test]
    fn blocks_must_be_whole_in_pages_and_borders() {
        let half_bc = || Layer { scale: 2, ..Layer::new("normal", LayerFormat::Bc5) };
        assert!(matches!(
            described(128, 4, vec![half_bc()]).check(),
            Err(LayerError::Blocks { unit: 8, .. })
        ));
        assert_eq!(described(128, 8, vec![half_bc()]).check(), Ok(()));
        assert!(matches!(
            described(126, 4, vec![Layer::new("a", LayerFormat::Bc7)]).check(),
            Err(LayerError::Blocks { .. })
        ));
        let twice = vec![Layer::new("a", LayerFormat::R8), Layer::new("a", LayerFormat::R8)];
        assert_eq!(described(128, 4, twice).check(), Err(LayerError::Name("a".into())));
        let third = Layer { scale: 3, ..Layer::new("a", LayerFormat::R8) };
        assert!(matches!(described(128, 4, vec![third]).check(), Err(LayerError::Scale { scale: 3, .. })));
    }
}
