//! A source of plain texels as one of blocks: each tile is compressed when it is read.

use std::fmt;
use std::sync::Arc;

use vastex_core::{Description, Layer, LayerError, LayerFormat, PageContents, PagePos, PageSet, Region};
use vastex_tiles::{Compression, ReadFuture, ReadLimit, SourceKey, Tiers, Tile, TileSource};

use crate::texels::Quality;
use crate::texels::blocks;
use crate::tile::{Recoder, TileEncoder};

/// A source whose layers are compressed in blocks when they are read, so that an image that lies in memory as
/// plain texels takes a quarter of the GPU's memory, or an eighth.
///
/// Tiles are those that [`crate::build()`] makes of the same texels, byte for byte. A read takes the time
/// that the encoder needs for a tile besides the one behind it: of 136x136 texels of BC7 a third of a
/// millisecond at [`Quality::Normal`], three at [`Quality::Best`]. Nothing is kept; the library's cache of
/// tiles comes before it.
///
/// ```
/// use std::sync::Arc;
/// use vastex_build::{BlockSource, Quality};
/// use vastex_tiles::ImageSource;
/// use vastex_core::LayerFormat;
/// let plain = ImageSource::rgba8(300, 200, vec![200; 300 * 200 * 4])?;
/// let source = BlockSource::new(Arc::new(plain), &[LayerFormat::Bc7Srgb], Quality::Normal)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct BlockSource {
    source: Arc<dyn TileSource>,
    encoder: TileEncoder,
    quality: Quality,
}

/// Why a source cannot be one of blocks.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BlockSourceError {
    /// This program was built without encoders.
    #[error("{0} needs encoders, which this program was built without (feature `bc` of vastex-build)")]
    NoEncoders(&'static str),
    /// A format is named for each layer.
    #[error(
        "{formats} formats for {layers} layers; name one for each, that which it has for one that stays as it is"
    )]
    Count {
        /// Formats that were named.
        formats: usize,
        /// Layers of the source.
        layers: usize,
    },
    /// The blocks hold other texels.
    #[error("layer {layer:?} of {stored} cannot become {wanted}; it can become {}", possible.join(", "))]
    Format {
        /// Name of the layer.
        layer: String,
        /// Format of the source.
        stored: &'static str,
        /// Format that was asked for.
        wanted: &'static str,
        /// Formats that the layer can become.
        possible: Vec<&'static str>,
    },
    /// Blocks do not fit into the pages.
    #[error("{0}; give the source pages and borders of whole blocks")]
    Layer(#[from] LayerError),
}

impl BlockSource {
    /// The layers of `source` in these formats, one for each in their order: the format that it has, or one
    /// of blocks that stand for it ([`LayerFormat::decoded`]).
    pub fn new(
        source: Arc<dyn TileSource>,
        formats: &[LayerFormat],
        quality: Quality,
    ) -> Result<BlockSource, BlockSourceError> {
        let plain = source.description();
        if plain.layers.len() != formats.len() {
            let (formats, layers) = (formats.len(), plain.layers.len());
            return Err(BlockSourceError::Count { formats, layers });
        }
        let layer = |(layer, &format): (&Layer, &LayerFormat)| {
            let stands_for = |format: LayerFormat| format == layer.format || format.decoded() == layer.format;
            if !stands_for(format) {
                let possible = LayerFormat::ALL.into_iter().filter(|format| stands_for(*format));
                return Err(BlockSourceError::Format {
                    layer: layer.name.clone(),
                    stored: layer.format.name(),
                    wanted: format.name(),
                    possible: possible.map(LayerFormat::name).collect(),
                });
            }
            if format.is_compressed() && format != layer.format && !blocks::AVAILABLE {
                return Err(BlockSourceError::NoEncoders(format.name()));
            }
            Ok(Layer { format, ..layer.clone() })
        };
        let layers = plain.layers.iter().zip(formats).map(layer).collect::<Result<_, _>>()?;
        let description = Description { layers, ..(**plain).clone() };
        description.check()?;
        let encoder = TileEncoder::new(Arc::new(description), Compression::None, quality);
        Ok(BlockSource { source, encoder, quality })
    }
}

impl fmt::Debug for BlockSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let formats = self.encoder.description().layers.iter().map(|layer| layer.format);
        f.debug_struct("BlockSource").field("formats", &formats.collect::<Vec<_>>()).finish_non_exhaustive()
    }
}

#[deny(clippy::missing_trait_methods)]
impl TileSource for BlockSource {
    /// Nothing: its tiles are others, so it answers for itself throughout.
    fn behind(&self) -> Option<&dyn TileSource> {
        None
    }

    fn description(&self) -> &Arc<Description> {
        self.encoder.description()
    }

    fn present(&self) -> Option<&Arc<PageSet>> {
        self.source.present()
    }

    /// What is the same stays the same: blocks depend on the texels of their tile alone.
    fn contents(&self) -> Option<&Arc<PageContents>> {
        self.source.contents()
    }

    /// That of the source behind it, with the formats and the quality.
    fn identity(&self) -> Option<SourceKey> {
        let formats = self.encoder.description().layers.iter().map(|layer| layer.format.name());
        let formats = formats.collect::<Vec<_>>().join(",");
        let (key, quality) = (self.source.identity()?, self.quality);
        Some(SourceKey::of(format!("blocks 1 {key:?} {formats} {quality:?}")))
    }

    fn read_limit(&self) -> Option<&Arc<ReadLimit>> {
        self.source.read_limit()
    }

    fn blocks(&self) -> bool {
        self.source.blocks()
    }

    fn add_tiers(&self, tiers: &mut Tiers) {
        self.source.add_tiers(tiers);
    }

    fn read(&self, pos: PagePos) -> ReadFuture<'_> {
        Box::pin(async move {
            let tile = self.source.read(pos).await?;
            let recoder = Recoder::new(&self.encoder, self.source.description());
            Ok(recoder.recode(pos, &tile, "a source that is compressed as it is read")?.tile().clone())
        })
    }

    /// Nothing: even a tile that is at hand has to be compressed.
    fn at_hand(&self, _: PagePos) -> Option<Tile> {
        None
    }

    fn changed(&self, region: &Region) {
        self.source.changed(region);
    }
}
