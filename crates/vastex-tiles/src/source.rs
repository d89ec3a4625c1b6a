//! What every source of tiles can do.

use std::future::Future;
use std::pin::Pin;
use std::sync::Arc;

use vastex_core::{Description, PageContents, PagePos, PageSet, Region};

use crate::hash::content_hash;
use crate::limit::ReadLimit;
use crate::tier::Tiers;
use crate::tile::Tile;

/// `Send`, except in a browser, where nothing is.
#[cfg(not(target_family = "wasm"))]
pub trait MaybeSend: Send {}
#[cfg(not(target_family = "wasm"))]
impl<T: Send + ?Sized> MaybeSend for T {}
/// `Send`, except in a browser, where nothing is.
#[cfg(target_family = "wasm")]
pub trait MaybeSend {}
#[cfg(target_family = "wasm")]
impl<T: ?Sized> MaybeSend for T {}

/// `Sync`, except in a browser, where nothing is.
#[cfg(not(target_family = "wasm"))]
pub trait MaybeSync: Sync {}
#[cfg(not(target_family = "wasm"))]
impl<T: Sync + ?Sized> MaybeSync for T {}
/// `Sync`, except in a browser, where nothing is.
#[cfg(target_family = "wasm")]
pub trait MaybeSync {}
#[cfg(target_family = "wasm")]
impl<T: ?Sized> MaybeSync for T {}

/// Why a tile could not be read. It concerns this tile alone; another read of it may succeed.
#[derive(Clone, Debug, thiserror::Error)]
pub enum ReadError {
    /// The page does not exist in this texture, or the source holds no tile for it.
    #[error("{pos}: no such tile")]
    NoSuchTile {
        /// The page asked for.
        pos: PagePos,
    },
    /// The store could not give the bytes.
    #[error("{pos}: {place}: {error}")]
    Store {
        /// The page asked for.
        pos: PagePos,
        /// Where the bytes were to come from: a file or URL, and the range in it.
        place: String,
        /// What the store said.
        error: String,
    },
    /// The bytes came but are not the tile's.
    #[error("{pos}: {place}: {fault}; rebuild the file, or copy it anew")]
    Damaged {
        /// The page asked for.
        pos: PagePos,
        /// Where the bytes came from: a file or URL, and the range in it.
        place: String,
        /// What is wrong with them.
        fault: String,
    },
}

/// A read under way. Dropping it cancels the read.
#[cfg(not(target_family = "wasm"))]
pub type ReadFuture<'a> = Pin<Box<dyn Future<Output = Result<Tile, ReadError>> + Send + 'a>>;
/// A read under way. Dropping it cancels the read.
#[cfg(target_family = "wasm")]
pub type ReadFuture<'a> = Pin<Box<dyn Future<Output = Result<Tile, ReadError>> + 'a>>;

/// What two sources have in common only if they give the same tiles, byte for byte, in this run and in any other.
///
/// What is kept longer than a run goes by it. It guards against chance, not against bytes made on purpose to be mistaken
/// for others.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct SourceKey(pub(crate) u128);

impl SourceKey {
    /// The key that goes with these bytes: a name with a version, or whatever changes when the tiles do.
    pub fn of(bytes: impl AsRef<[u8]>) -> SourceKey {
        SourceKey(content_hash(bytes.as_ref()))
    }
}

/// Turns pages into tiles.
///
/// A source is shared by threads. It never blocks another read for longer than its own takes, and never panics on bad
/// data: an error concerns one tile. `conformance` checks an implementation.
pub trait TileSource: MaybeSend + MaybeSync {
    /// The texture that the source holds. The same at every call.
    fn description(&self) -> &Arc<Description>;

    /// The pages that have tiles, the tail among them; nothing where all have, as in most sources. The same at every call.
    ///
    /// A page of this set is never [`ReadError::NoSuchTile`], any other always is.
    fn present(&self) -> Option<&Arc<PageSet>> {
        None
    }

    /// Which pages have the same tile, byte for byte, as far as the source knows without reading any: those share a load and a
    /// slot of the pool. Nothing where it knows of none. The same at every call; the first may cost a visit of each page.
    ///
    /// What it says holds until [`TileSource::changed`] names a page: no read before that gives anything else. A page named there
    /// is taken for one like no other from then on, whatever is said here.
    fn contents(&self) -> Option<&Arc<PageContents>> {
        None
    }

    /// What says that these are the tiles which another run read, too; nothing where the source cannot know. The same at
    /// every call, which may cost as much as opening the source did.
    fn identity(&self) -> Option<SourceKey> {
        None
    }

    /// How many reads of it may be under way at once, where a [`LimitedSource`](crate::LimitedSource) says so; a loader has a
    /// limit of its own for sources without one. The same at every call.
    fn read_limit(&self) -> Option<&Arc<ReadLimit>> {
        None
    }

    /// Adds what the source and those behind it have done so far and hold: a cache its own figures, the last one what it read.
    ///
    /// Called each frame, so it should cost no more than a look at counters.
    fn add_tiers(&self, _tiers: &mut Tiers) {}

    /// The tile of a page finer than the tail, or the tail's (at [`vastex_core::Geometry::tail_pos`]), still encoded.
    ///
    /// A local read never suspends: it blocks the thread that polls it. One over a network suspends, and takes no thread while
    /// it waits. Dropping the future cancels the read.
    fn read(&self, pos: PagePos) -> ReadFuture<'_>;

    /// The same tile where it is in main memory: never waits, reads nothing and counts as no use. Nothing from sources that keep
    /// none.
    fn at_hand(&self, _pos: PagePos) -> Option<Tile> {
        None
    }

    /// The content of a region has changed where it comes from. Whoever keeps tiles lets go of those that hold a texel of it,
    /// and of reads under way; reads that begin from now on give the new content. Sources that keep nothing do nothing.
    fn changed(&self, region: &Region) {
        let _ = region;
    }
}

impl<S: TileSource + ?Sized> TileSource for Arc<S> {
    fn description(&self) -> &Arc<Description> {
        (**self).description()
    }

    fn present(&self) -> Option<&Arc<PageSet>> {
        (**self).present()
    }

    fn contents(&self) -> Option<&Arc<PageContents>> {
        (**self).contents()
    }

    fn identity(&self) -> Option<SourceKey> {
        (**self).identity()
    }

    fn read_limit(&self) -> Option<&Arc<ReadLimit>> {
        (**self).read_limit()
    }

    fn add_tiers(&self, tiers: &mut Tiers) {
        (**self).add_tiers(tiers);
    }

    fn read(&self, pos: PagePos) -> ReadFuture<'_> {
        (**self).read(pos)
    }

    fn at_hand(&self, pos: PagePos) -> Option<Tile> {
        (**self).at_hand(pos)
    }

    fn changed(&self, region: &Region) {
        (**self).changed(region);
    }
}
