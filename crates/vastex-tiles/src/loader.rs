//! The loader: reads and decodes the tiles that the pager asks for, in the pager's order.
//!
//! Natively a bounded number of threads drives the sources; in a browser the same interface polls them on the event
//! loop. Which tiles are worth loading, and how many bytes may be under way, is the pager's business: the loader holds
//! what was requested and nothing else. `queue` keeps the order and the promise that every request ends exactly once.

mod event_loop;
#[cfg(not(target_family = "wasm"))]
mod native;
mod queue;

#[cfg(test)]
mod rank_tests;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use bytes::Bytes;
use vastex_core::{PageId, PagePos};

use crate::source::{ReadError, TileSource};
use crate::tile::DecodeError;

pub use event_loop::LocalLoader;
#[cfg(target_family = "wasm")]
pub use event_loop::LocalLoader as Loader;
#[cfg(not(target_family = "wasm"))]
pub use native::Loader;

/// How a request ended.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// The page requested.
    pub page: PageId,
    /// The texels, all layers, `tile_bytes` bytes of them; or why there are none.
    pub result: Result<Bytes, LoadError>,
}

/// Why a request ended without a tile.
#[derive(Clone, Debug, thiserror::Error)]
pub enum LoadError {
    /// It was cancelled. Not a failure: nobody wants the tile.
    #[error("cancelled")]
    Cancelled,
    /// The source has no tile to give.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The tile came but does not decode.
    #[error("{pos}: {error}; rebuild the file, or copy it anew")]
    Decode {
        /// The page.
        pos: PagePos,
        /// What the decoder said.
        error: DecodeError,
    },
    /// The source panicked, which is a bug in it. The loader goes on.
    #[error("{pos}: its source panicked: {message}")]
    Panicked {
        /// The page.
        pos: PagePos,
        /// What it said.
        message: String,
    },
    /// The page's texture has no source, or lost it.
    #[error("texture {texture} has no source")]
    NoSource {
        /// The texture's number.
        texture: u16,
    },
}

/// Reads and decodes one tile.
async fn load(source: Arc<dyn TileSource>, pos: PagePos) -> Result<Bytes, LoadError> {
    let tile = source.read(pos).await?;
    tile.decode(source.description()).map_err(|error| LoadError::Decode { pos, error })
}
