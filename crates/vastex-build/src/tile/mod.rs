//! Tiles: the one way from the texels of a page to the bytes that a container stores, and the one way back.

mod encoder;
mod findings;
mod layer_of;
mod recoder;
pub(crate) mod tail;

pub(crate) use encoder::TileEncoder;
pub(crate) use findings::Findings;
pub use layer_of::LayerFault;
pub(crate) use layer_of::LayerOf;
pub(crate) use recoder::Recoder;

/// Bytes of memory that the index of a container takes for each page, while it is written and while it is
/// read.
pub(crate) const INDEX_BYTES: u64 = 64;
