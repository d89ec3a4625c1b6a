//! What turns pages into tiles: the trait of all sources, pixels in memory, sources that generate their
//! tiles, and decorators that limit and stage the tiles of another source.
//!
//! Sources that read files are the business of `container`, decorators that keep tiles that of `caches`.

mod image;
mod limited;
mod planet;
mod property;
mod staged;
mod tiers;

use std::future::Future;
use std::pin::Pin;
use std::sync::Arc;

use vastex_core::{Description, PageContents, PagePos, PageSet, Region};

use crate::ground::hash::content_hash;
use crate::ground::sync::{MaybeSend, MaybeSync};
use crate::stores::ReadLimit;
use crate::tile::Tile;

pub use image::{ImageOptions, ImageSource, ImageSourceError, Reduction};
pub use limited::LimitedSource;
pub use planet::{PlanetError, PlanetImage, PlanetSource};
pub use property::PropertySource;
pub use staged::{Room, Staged, StagedSource, Staging};
pub use tiers::{ChunkStats, StoreCounter, StoreStats, TierStats, Tiers};

/// Why a tile could not be read. The error concerns this tile alone; another read of the same tile may
/// succeed.
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
        /// What is wrong with the bytes.
        fault: String,
    },
}

/// A read of a tile under way. Dropping the future cancels the read.
#[cfg(not(target_family = "wasm"))]
pub type ReadFuture<'a> = Pin<Box<dyn Future<Output = Result<Tile, ReadError>> + Send + 'a>>;
/// A read of a tile under way. Dropping the future cancels the read.
#[cfg(target_family = "wasm")]
pub type ReadFuture<'a> = Pin<Box<dyn Future<Output = Result<Tile, ReadError>> + 'a>>;

/// Names what a source holds: two sources have the same key only if they give the same tiles, byte for byte,
/// in this run and in any other.
///
/// Whatever outlives a run, such as a disk cache, is filed under the key. It guards against chance, not
/// against bytes made on purpose to be mistaken for others.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct SourceKey(u128);

impl SourceKey {
    /// The key that follows from these bytes: a name with a version, or whatever else changes when the tiles
    /// do.
    pub fn of(bytes: impl AsRef<[u8]>) -> SourceKey {
        SourceKey(content_hash(bytes.as_ref()))
    }

    /// The key as a number.
    #[cfg(not(target_family = "wasm"))]
    pub(crate) fn to_bits(self) -> u128 {
        self.0
    }
}

/// Turns pages into tiles.
///
/// A source is shared by threads. A read never blocks another read for longer than its own time, and never
/// panics on bad data: an error concerns one tile. `conformance`, in the crate `vastex-tiles`, checks an
/// implementation.
///
/// The bytes of a tile are its layers one after the other. Of each layer they are the texels of the boxes
/// that [`Geometry::tile_boxes`](vastex_core::Geometry::tile_boxes) names for the page, borders included, row
/// by row; of a layer of lower resolution, in its own texels.
pub trait TileSource: MaybeSend + MaybeSync {
    /// The texture that the source holds. The same at every call.
    fn description(&self) -> &Arc<Description>;

    /// The source behind this one, if this source is a decorator: whatever a decorator does not answer is
    /// answered by the source behind it. `None` for a source that has tiles of its own, or other tiles than
    /// the source from which it reads.
    fn behind(&self) -> Option<&dyn TileSource> {
        None
    }

    /// The pages that have tiles, the tail among them, or `None` if all pages have tiles, as in most sources.
    /// The same at every call.
    ///
    /// Reading a page of this set never fails with [`ReadError::NoSuchTile`]; reading any other page always
    /// does.
    fn present(&self) -> Option<&Arc<PageSet>> {
        self.behind()?.present()
    }

    /// Which pages have the same tile, byte for byte, as far as the source knows without reading a tile, or
    /// `None` if it knows of no such pages. Pages with the same content share one load and one slot of the
    /// pool. The same at every call; the first call may visit each page.
    ///
    /// The answer holds for a page until [`TileSource::changed`] names the page. From then on the page is
    /// taken to be like no other, whatever the answer says.
    fn contents(&self) -> Option<&Arc<PageContents>> {
        self.behind()?.contents()
    }

    /// The key under which these tiles can be found again in another run, or `None` if the source cannot know
    /// that its tiles are the same then. The same at every call, which may cost as much as opening the source
    /// did.
    fn identity(&self) -> Option<SourceKey> {
        self.behind()?.identity()
    }

    /// The limit of reads of this source under way at once, if the source or a
    /// [`LimitedSource`](crate::LimitedSource) has one. A loader has a limit of its own for sources without
    /// one. The same at every call.
    fn read_limit(&self) -> Option<&Arc<ReadLimit>> {
        self.behind()?.read_limit()
    }

    /// Returns true if reads of this source block their threads, as reads past the system's cache do: by its
    /// own limit ([`ReadLimit::blocking`]), or because the source behind it says so, however many limits
    /// stand in between. A loader then has additional threads for these reads. The same at every call.
    fn blocks(&self) -> bool {
        self.read_limit().is_some_and(|limit| limit.is_blocking())
            || self.behind().is_some_and(|behind| behind.blocks())
    }

    /// Adds to `tiers` what the source and the sources behind it have done so far and what they hold: caches
    /// add their own figures, the last source adds its reads of the store.
    ///
    /// Called each frame, so it should cost no more than a look at counters.
    fn add_tiers(&self, tiers: &mut Tiers) {
        self.behind().into_iter().for_each(|behind| behind.add_tiers(tiers));
    }

    /// Reads a tile, still encoded: that of a page finer than the tail, or the tail (at
    /// [`vastex_core::Geometry::tail_pos`]).
    ///
    /// A local read never suspends: it blocks the thread that polls it. A read over a network suspends and
    /// takes no thread while it waits. Dropping the future cancels the read.
    fn read(&self, pos: PagePos) -> ReadFuture<'_>;

    /// The tile of a page if it is in main memory, or `None` if it is not, or if the source keeps no tiles in
    /// memory. Never waits, reads nothing and does not count as a use.
    fn at_hand(&self, pos: PagePos) -> Option<Tile> {
        self.behind()?.at_hand(pos)
    }

    /// Says that the content of a region has changed where it comes from. Caches drop the tiles that hold a
    /// texel of the region, and do not keep what reads under way bring; reads that begin from now on give the
    /// new content. The default hands the call on to the source behind.
    fn changed(&self, region: &Region) {
        self.behind().into_iter().for_each(|behind| behind.changed(region));
    }
}

impl<S: TileSource + ?Sized> TileSource for Arc<S> {
    fn description(&self) -> &Arc<Description> {
        (**self).description()
    }

    fn behind(&self) -> Option<&dyn TileSource> {
        (**self).behind()
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

    fn blocks(&self) -> bool {
        (**self).blocks()
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

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use vastex_core::{Dims, Geometry, GeometrySpec};

    use super::*;

    /// Answers everything otherwise than a source that knows nothing.
    struct Knowing {
        pages: PropertySource,
        present: Arc<PageSet>,
        contents: Arc<PageContents>,
        limit: Arc<ReadLimit>,
        changed: Mutex<Vec<Region>>,
    }

    #[deny(clippy::missing_trait_methods)]
    impl TileSource for Knowing {
        fn description(&self) -> &Arc<Description> {
            self.pages.description()
        }

        fn behind(&self) -> Option<&dyn TileSource> {
            None
        }

        fn present(&self) -> Option<&Arc<PageSet>> {
            Some(&self.present)
        }

        fn contents(&self) -> Option<&Arc<PageContents>> {
            Some(&self.contents)
        }

        fn identity(&self) -> Option<SourceKey> {
            Some(SourceKey::of("knowing"))
        }

        fn read_limit(&self) -> Option<&Arc<ReadLimit>> {
            Some(&self.limit)
        }

        fn blocks(&self) -> bool {
            true
        }

        fn add_tiers(&self, tiers: &mut Tiers) {
            tiers.ram += TierStats { hits: 3, ..TierStats::default() };
        }

        fn read(&self, pos: PagePos) -> ReadFuture<'_> {
            self.pages.read(pos)
        }

        fn at_hand(&self, pos: PagePos) -> Option<Tile> {
            pollster::block_on(self.pages.read(pos)).ok()
        }

        fn changed(&self, region: &Region) {
            self.changed.lock().unwrap().push(region.clone());
        }
    }

    /// A decorator that says nothing by itself.
    struct Before<S>(S);

    impl<S: TileSource> TileSource for Before<S> {
        fn behind(&self) -> Option<&dyn TileSource> {
            Some(&self.0)
        }

        fn description(&self) -> &Arc<Description> {
            self.0.description()
        }

        fn read(&self, pos: PagePos) -> ReadFuture<'_> {
            self.0.read(pos)
        }
    }

    #[test]
    fn what_a_decorator_does_not_answer_the_source_behind_it_does() {
        let spec = GeometrySpec { page: 8, border: 1, ..GeometrySpec::image(100, 100) };
        let geometry = Geometry::new(spec).unwrap();
        assert_eq!(geometry.dims(), Dims::D2);
        let source = Arc::new(Knowing {
            present: Arc::new(PageSet::from_pages(&geometry, |_| true)),
            contents: Arc::new(PageContents::new(&geometry, Vec::new(), 1, |_| Some(0))),
            limit: ReadLimit::new(7),
            changed: Mutex::default(),
            pages: PropertySource::new(geometry.clone()),
        });
        let before = Before(Before(source.clone()));
        assert!(Arc::ptr_eq(before.present().unwrap(), &source.present));
        assert!(Arc::ptr_eq(before.contents().unwrap(), &source.contents));
        assert!(Arc::ptr_eq(before.read_limit().unwrap(), &source.limit));
        assert!(before.blocks() && !source.pages.blocks());
        assert_eq!(before.identity(), source.identity());
        let mut tiers = Tiers::default();
        before.add_tiers(&mut tiers);
        assert_eq!(tiers.ram.hits, 3);
        assert_eq!(
            before.at_hand(geometry.tail_pos()).unwrap().bytes,
            source.at_hand(geometry.tail_pos()).unwrap().bytes
        );
        before.changed(&Region::whole());
        assert_eq!(*source.changed.lock().unwrap(), [Region::whole()]);
        // One without any before it knows nothing.
        assert!(source.pages.at_hand(geometry.tail_pos()).is_none() && source.pages.read_limit().is_none());
    }
}
