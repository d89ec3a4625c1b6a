//! The tail of a texture that comes, without which there is nothing to show. Where it is waited for, that is
//! no longer than reads may take; of a texture that is held whole, whose tail is many reads, no longer than
//! each of them may take.

use std::sync::Arc;
use std::time::Duration;

use bytes::Bytes;
use vastex_tiles::{Clock, TileSource};

use crate::error::Error;

/// The texels of the tail, read and decoded where the future is polled.
pub(crate) async fn read(source: &Arc<dyn TileSource>) -> Result<Bytes, Error> {
    let (size, tail) = (size(source), source.description().geometry.tail_pos());
    let tile = source.read(tail).await.map_err(|error| Error::TailUnreadable { size, error })?;
    tile.decode(source.description()).map_err(|error| Error::TailDamaged { size, error })
}

/// The texels of the tail, by a loader of its own, whose thread is left to itself where the source does not
/// answer in time, as `clock` tells it.
#[cfg(not(target_family = "wasm"))]
pub(crate) fn read_blocking(
    source: &Arc<dyn TileSource>,
    time_out: Duration,
    clock: &Arc<dyn Clock>,
) -> Result<Bytes, Error> {
    use vastex_core::{PageId, TextureNumber};
    use vastex_tiles::{LoadError, Loader, LoaderSettings, ReadError};

    let geometry = &source.description().geometry;
    let settings = LoaderSettings { threads: 1, time_out, ..LoaderSettings::default() };
    let mut loader = Loader::with(settings, clock.clone())?;
    let tail = TextureNumber::new(0).and_then(|texture| {
        Some((texture, PageId::new(texture, geometry.dims(), geometry.tail_pos()).ok()?))
    });
    if let Some((texture, page)) = tail {
        loader.add_source(texture, source.clone());
        loader.request(page, 0);
    }
    let size = size(source);
    let Some(ended) = loader.wait() else {
        // Nothing ends where nothing could be asked for.
        let error = ReadError::NoSuchTile { pos: geometry.tail_pos() };
        return Err(Error::TailUnreadable { size, error });
    };
    ended.result.map_err(|error| match error {
        LoadError::Read(error) => Error::TailUnreadable { size, error },
        LoadError::Decode { error, .. } => Error::TailDamaged { size, error },
        LoadError::Overdue { time_out, .. } => Error::TailOverdue { size, time_out },
        error => Error::TailFailed { size, error },
    })
}

/// A browser cannot wait, so the tail must be at hand, as it is for a container once that is open.
#[cfg(target_family = "wasm")]
pub(crate) fn read_blocking(
    source: &Arc<dyn TileSource>,
    _: Duration,
    _: &Arc<dyn Clock>,
) -> Result<Bytes, Error> {
    let mut read = std::pin::pin!(read(source));
    match read.as_mut().poll(&mut std::task::Context::from_waker(std::task::Waker::noop())) {
        std::task::Poll::Ready(tail) => tail,
        std::task::Poll::Pending => Err(Error::TailPending),
    }
}

/// Width and height of the texture, for errors.
fn size(source: &Arc<dyn TileSource>) -> [u32; 2] {
    let [width, height, _] = source.description().geometry.size();
    [width, height]
}
