//! The loader: reads and decodes the tiles that the pager asks for, in the pager's order.
//!
//! Natively a bounded number of threads drives the sources; in a browser the same interface polls them on the
//! event loop. Which tiles are worth loading, and how many bytes may be under way, is the business of the
//! pager: the loader holds what was requested and nothing else. `queue` keeps the order and sees to it that
//! every request ends exactly once; `lanes` keeps sources apart, so that a source that is slow or does not
//! answer delays only itself.

mod clock;
mod event_loop;
mod lanes;
#[cfg(not(target_family = "wasm"))]
mod native;
mod queue;

#[cfg(test)]
mod tests;

use std::sync::Arc;
use std::time::Duration;

use bytes::Bytes;
use vastex_core::{PageId, PagePos};

use crate::sources::{ReadError, TileSource};
use crate::tile::DecodeError;

pub use clock::{Clock, SystemClock};
pub use event_loop::LocalLoader;
#[cfg(target_family = "wasm")]
pub use event_loop::LocalLoader as Loader;
#[cfg(not(target_family = "wasm"))]
pub use native::Loader;

/// The settings of a loader.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LoaderSettings {
    /// Reads that may be at work at once, at least 1, each on a thread. A read that suspends, or takes more
    /// than a quarter of a second, gives its place to another read, up to `reads_at_once` of its source; a
    /// read of a source whose reads block ([`TileSource::blocks`]) takes no place. While 256 reads are
    /// without a place, each source has its part of 256 reads under way, one at least, or more where it
    /// answers before its reads give their places. Has no effect where there are no threads.
    pub threads: usize,
    /// Reads of one source that may be under way at once, at least 1 and at least as many as there are
    /// threads. The limit of a source that has one ([`TileSource::read_limit`]) takes precedence.
    pub reads_at_once: usize,
    /// How long a read may take. After that its request fails with [`LoadError::Overdue`], and the result of
    /// the read is dropped.
    pub time_out: Duration,
    /// How long a [`LocalLoader`] may decode in a frame, in which it is polled until it has nothing to give.
    /// It decodes at least one tile, so a frame may take a tile longer. Has no effect where there are
    /// threads.
    pub decode_time: Duration,
}

impl Default for LoaderSettings {
    /// 2 threads, 8 reads at once of each source, a time-out of 30 seconds, and 4 milliseconds of a browser's
    /// frame.
    ///
    /// A disk that must spin up first answers within 10 seconds; a network that has not answered within 30
    /// seldom will.
    fn default() -> LoaderSettings {
        LoaderSettings {
            threads: 2,
            reads_at_once: 8,
            time_out: Duration::from_secs(30),
            decode_time: Duration::from_millis(4),
        }
    }
}

/// How a request ended.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// The page that was requested.
    pub page: PageId,
    /// The texels of all layers, `tile_bytes` bytes of them, or the reason why there are none.
    pub result: Result<Bytes, LoadError>,
}

/// Why a request ended without a tile.
#[derive(Clone, Debug, thiserror::Error)]
pub enum LoadError {
    /// The request was cancelled. No failure: nobody wants the tile.
    #[error("cancelled")]
    Cancelled,
    /// The source has no tile to give.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The tile came but does not decode.
    #[error("{pos}: {error}; rebuild the file, or copy it anew")]
    Decode {
        /// The page that was requested.
        pos: PagePos,
        /// What the decoder said.
        error: DecodeError,
    },
    /// The source panicked, which is a bug in it. The loader goes on.
    #[error("{pos}: its source panicked: {message}")]
    Panicked {
        /// The page that was requested.
        pos: PagePos,
        /// The message of the panic.
        message: String,
    },
    /// The page's texture never had a source, or its source was removed.
    #[error("texture {texture} has no source")]
    NoSource {
        /// The number of the texture.
        texture: u16,
    },
    /// The read has taken longer than reads may. Another read of the page may be in time.
    #[error(
        "{pos}: no answer within {time_out:?}; check the disk or the network that the tiles come from, or let reads take longer"
    )]
    Overdue {
        /// The page that was requested.
        pos: PagePos,
        /// How long reads may take.
        time_out: Duration,
    },
    /// The page was not read, since its source, or another source with the same limit, does not answer. From
    /// time to time the source is asked again, after 1, 2, 4 and up to 64 seconds; also that of a texture
    /// which was given one source after the other, while twice as many of their reads as a source may have
    /// have not come back.
    #[error(
        "{pos}: not read, since {reads} reads of its source have had no answer within {time_out:?}; check the disk or the \
         network that the tiles come from"
    )]
    SourceSilent {
        /// The page that was requested.
        pos: PagePos,
        /// Reads of the source that have had no answer.
        reads: usize,
        /// How long reads may take.
        time_out: Duration,
    },
}

/// Reads and decodes one tile.
async fn load(source: Arc<dyn TileSource>, pos: PagePos) -> Result<Bytes, LoadError> {
    let tile = source.read(pos).await?;
    tile.decode(source.description()).map_err(|error| LoadError::Decode { pos, error })
}
