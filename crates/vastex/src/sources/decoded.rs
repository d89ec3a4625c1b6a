//! Layers that the device does not hold as they are stored: compressed ones that it cannot decompress, and 8
//! bits of volumes that it does not filter well. A decorator that makes tiles as they are held when they are
//! read.
//!
//! It works on the loader's threads, so a frame costs what it always does; the pool holds the decoded texels,
//! of which fewer tiles fit.

use std::sync::Arc;

use bytes::Bytes;
use vastex_core::{Description, Dims, LayerFormat, PageContents, PagePos, PageSet, Region};
use vastex_tiles::{
    Codec, ReadError, ReadFuture, ReadLimit, SourceKey, Tiers, Tile, TileSource, decode_layer,
};
use vastex_wgpu::{VolumeFilters, half_bits, held_format, held_volume_format};

/// The texture as a device with these features holds it: the same where it can hold every layer as it is.
/// `filters` is asked for volumes alone.
pub(crate) fn held_description(
    stored: &Arc<Description>,
    features: wgpu::Features,
    filters: impl FnOnce() -> VolumeFilters,
) -> Arc<Description> {
    let mut held = Description::clone(stored);
    held.layers.iter_mut().for_each(|layer| layer.format = held_format(layer.format, features));
    if stored.geometry.dims() == Dims::D3 {
        let filters = filters();
        held.layers.iter_mut().for_each(|layer| layer.format = held_volume_format(layer.format, filters));
    }
    if held == **stored { stored.clone() } else { Arc::new(held) }
}

/// A source whose tiles have the layers that `held` describes, decoded from those of `source`.
pub(crate) struct DecodedSource<S> {
    source: S,
    held: Arc<Description>,
    contents: Option<Arc<PageContents>>,
}

impl<S: TileSource> DecodedSource<S> {
    pub(crate) fn new(source: S, held: Arc<Description>) -> DecodedSource<S> {
        // Two colours may be the same as they are stored, and not as they are held; or the other way round.
        let contents = source.contents().map(|contents| Arc::new(contents.without_constants()));
        DecodedSource { source, held, contents }
    }
}

#[deny(clippy::missing_trait_methods)]
impl<S: TileSource> TileSource for DecodedSource<S> {
    /// Nothing: its tiles are others, so it answers for itself throughout.
    fn behind(&self) -> Option<&dyn TileSource> {
        None
    }

    fn description(&self) -> &Arc<Description> {
        &self.held
    }

    fn present(&self) -> Option<&Arc<PageSet>> {
        self.source.present()
    }

    /// As the source says, but that constants are this texture's alone.
    fn contents(&self) -> Option<&Arc<PageContents>> {
        self.contents.as_ref()
    }

    /// Nothing: its tiles are made anew in every run.
    fn identity(&self) -> Option<SourceKey> {
        None
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
            let (stored, tile) = (self.source.description(), self.source.read(pos).await?);
            let damaged = |error: vastex_tiles::DecodeError| ReadError::Damaged {
                pos,
                place: "compressed layers".into(),
                fault: error.to_string(),
            };
            let bytes = tile.decode(stored).map_err(damaged)?;
            Ok(Tile { codec: Codec::Raw, bytes: decoded(stored, &self.held, &bytes) })
        })
    }

    fn at_hand(&self, pos: PagePos) -> Option<Tile> {
        let stored = self.source.description();
        let bytes = self.source.at_hand(pos)?.decode(stored).ok()?;
        Some(Tile { codec: Codec::Raw, bytes: decoded(stored, &self.held, &bytes) })
    }

    fn changed(&self, region: &Region) {
        self.source.changed(region);
    }
}

/// A tile's layers, those decoded that are held so.
fn decoded(stored: &Description, held: &Description, tile: &Bytes) -> Bytes {
    let mut texels = Vec::with_capacity(held.tile_bytes());
    for (index, (from, to)) in stored.layers.iter().zip(&held.layers).enumerate() {
        match from.format == to.format {
            true => texels.extend_from_slice(&tile[stored.layer_range(index)]),
            false => match widened(from.format, to.format, &tile[stored.layer_range(index)]) {
                Some(wide) => texels.extend_from_slice(&wide),
                None => texels.extend_from_slice(&decode_layer(stored, index, tile)),
            },
        }
    }
    texels.into()
}

/// Values of 8 bits as the same values of more; `None` for other formats.
fn widened(from: LayerFormat, to: LayerFormat, values: &[u8]) -> Option<Vec<u8>> {
    match (from, to) {
        (LayerFormat::R8, LayerFormat::R16) => Some(values.iter().flat_map(|value| [*value; 2]).collect()),
        (LayerFormat::R8, LayerFormat::R16Float) => {
            let table: [[u8; 2]; 256] =
                std::array::from_fn(|value| half_bits(value as f32 / 255.0).to_le_bytes());
            Some(values.iter().flat_map(|value| table[usize::from(*value)]).collect())
        }
        _ => None,
    }
}
