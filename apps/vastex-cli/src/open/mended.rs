//! An image's container in the cache whose tiles may turn out to be damaged: it is then removed, and built
//! anew, once.

use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError, RwLock};

use vastex::TileSource;
use vastex_build::{BuildCache, BuildOptions, Progress};
use vastex_core::{Description, PageContents, PagePos, PageSet, Region};
use vastex_tiles::{Container, ReadError, ReadFuture, ReadLimit, SourceKey, Tiers, Tile};

use crate::report;

/// How an image is built anew.
pub(super) struct Anew {
    pub(super) cache: BuildCache,
    pub(super) image: PathBuf,
    pub(super) options: BuildOptions,
}

/// The tiles of a container that lies in the cache. A read that finds one damaged waits until the image is
/// built anew; other reads go on.
pub(super) struct Mended {
    /// What stays the same when it is built anew.
    first: Arc<Container>,
    current: RwLock<Arc<Container>>,
    /// Nothing once that was tried.
    anew: Mutex<Option<Anew>>,
}

impl Mended {
    pub(super) fn new(container: Container, anew: Anew) -> Mended {
        let first = Arc::new(container);
        Mended { current: RwLock::new(first.clone()), first, anew: Mutex::new(Some(anew)) }
    }

    fn current(&self) -> Arc<Container> {
        self.current.read().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// The container in the place of one of which a tile is damaged; `None` if there is none.
    fn in_place_of(&self, damaged: &Arc<Container>) -> Option<Arc<Container>> {
        let mut anew = self.anew.lock().unwrap_or_else(PoisonError::into_inner);
        let current = self.current();
        if !Arc::ptr_eq(&current, damaged) {
            return Some(current);
        }
        let Anew { cache, image, options } = anew.take()?;
        let name = image.display();
        report::say(&format!(
            "note: {name}: what was built of it into the cache is damaged; it is built anew"
        ));
        let built = cache.forget(&image, &options).and_then(|()| cache.open(&image, &options, &Quietly));
        let built = match built {
            Ok(built) => Arc::new(built.container),
            Err(error) => {
                report::say(&format!("{name}: cannot be built anew: {error}"));
                return None;
            }
        };
        // A file that was changed meanwhile is another image.
        if built.description() != self.first.description() {
            return None;
        }
        *self.current.write().unwrap_or_else(PoisonError::into_inner) = built.clone();
        Some(built)
    }
}

/// Nobody watches.
struct Quietly;

impl Progress for Quietly {
    fn advance(&self, _: u64, _: u64, _: u64) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}

#[deny(clippy::missing_trait_methods)]
impl TileSource for Mended {
    fn behind(&self) -> Option<&dyn TileSource> {
        None
    }

    fn description(&self) -> &Arc<Description> {
        self.first.description()
    }

    fn present(&self) -> Option<&Arc<PageSet>> {
        self.first.present()
    }

    fn contents(&self) -> Option<&Arc<PageContents>> {
        self.first.contents()
    }

    /// That of the image as it was built: built anew it has the same bytes.
    fn identity(&self) -> Option<SourceKey> {
        self.first.identity()
    }

    fn read_limit(&self) -> Option<&Arc<ReadLimit>> {
        self.first.read_limit()
    }

    fn blocks(&self) -> bool {
        self.first.blocks()
    }

    fn add_tiers(&self, tiers: &mut Tiers) {
        self.first.add_tiers(tiers);
        let current = self.current();
        if !Arc::ptr_eq(&current, &self.first) {
            current.add_tiers(tiers);
        }
    }

    fn read(&self, pos: PagePos) -> ReadFuture<'_> {
        Box::pin(async move {
            let container = self.current();
            match container.read(pos).await {
                Err(error @ ReadError::Damaged { .. }) => match self.in_place_of(&container) {
                    Some(mended) => mended.read(pos).await,
                    None => Err(error),
                },
                read => read,
            }
        })
    }

    fn at_hand(&self, pos: PagePos) -> Option<Tile> {
        self.current().at_hand(pos)
    }

    fn changed(&self, region: &Region) {
        self.current().changed(region);
    }
}
