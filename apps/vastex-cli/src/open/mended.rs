//! An image's container in the cache whose tiles may turn out to be damaged: it is then removed, and built
//! anew, once, on a thread of its own, while other tiles are read.

use std::future::poll_fn;
use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, RwLock};
use std::task::{Poll, Waker};
use std::thread;

use anyhow::anyhow;
use vastex::TileSource;
use vastex_build::{BuildCache, BuildOptions, Progress};
use vastex_core::{Description, PageContents, PagePos, PageSet, Region};
use vastex_tiles::{Container, ReadError, ReadFuture, ReadLimit, SourceKey, Tiers, Tile};

use super::observer::{MendObserver, Mending};
use crate::report;

/// How an image is built anew.
pub(super) struct Anew {
    pub(super) cache: BuildCache,
    pub(super) image: PathBuf,
    pub(super) options: BuildOptions,
}

/// The tiles of a container that lies in the cache. A read that finds one damaged has the image built anew.
/// With an observer it fails, to be tried again when that is told of; without one it waits, and holds up no
/// thread.
pub(super) struct Mended {
    /// What stays the same when it is built anew.
    first: Arc<Container>,
    image: PathBuf,
    shared: Arc<Shared>,
}

/// What the reads share with the thread that builds.
struct Shared {
    current: RwLock<Arc<Container>>,
    step: Mutex<Step>,
    observer: Option<MendObserver>,
    /// Nobody reads any more.
    is_left: AtomicBool,
}

enum Step {
    /// No tile was found damaged.
    Sound(Anew),
    /// A thread builds; those are woken at its end.
    Building(Vec<Waker>),
    /// It was built anew, or cannot be.
    Over,
}

impl Mended {
    pub(super) fn new(container: Container, anew: Anew, observer: Option<MendObserver>) -> Mended {
        let (first, image) = (Arc::new(container), anew.image.clone());
        let (current, step) = (RwLock::new(first.clone()), Mutex::new(Step::Sound(anew)));
        let is_left = AtomicBool::new(false);
        Mended { first, image, shared: Arc::new(Shared { current, step, observer, is_left }) }
    }

    /// What stands in the place of a container that has a damaged tile, if anything does or will.
    async fn in_place_of(&self, damaged: &Arc<Container>, pos: PagePos) -> Instead {
        let shared = &self.shared;
        let current = shared.current();
        if !Arc::ptr_eq(&current, damaged) {
            return Instead::Built(current);
        }
        if !shared.begin(pos) {
            return Instead::Nothing;
        }
        // Without its tail there is no texture to be shown meanwhile.
        if shared.observer.is_some() && pos != self.first.description().geometry.tail_pos() {
            return Instead::Later;
        }
        poll_fn(|context| match &mut *shared.step() {
            Step::Building(waiting) => {
                waiting.push(context.waker().clone());
                Poll::Pending
            }
            Step::Sound(_) | Step::Over => Poll::Ready(()),
        })
        .await;
        let current = shared.current();
        if Arc::ptr_eq(&current, damaged) { Instead::Nothing } else { Instead::Built(current) }
    }
}

enum Instead {
    Built(Arc<Container>),
    /// It is being built.
    Later,
    Nothing,
}

impl Shared {
    fn current(&self) -> Arc<Container> {
        self.current.read().unwrap_or_else(PoisonError::into_inner).clone()
    }

    fn step(&self) -> MutexGuard<'_, Step> {
        self.step.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Begins to build, since this page is damaged, unless that was done. Returns true while it is being
    /// built.
    fn begin(self: &Arc<Shared>, damaged: PagePos) -> bool {
        let mut step = self.step();
        if !matches!(*step, Step::Sound(_)) {
            return matches!(*step, Step::Building(_));
        }
        let before = std::mem::replace(&mut *step, Step::Building(Vec::new()));
        let Step::Sound(anew) = before else { return false };
        let text = format!(
            "{}: what was built of it into the cache is damaged; it is built anew",
            anew.image.display()
        );
        report::say(&format!("note: {text}"));
        self.tell(Mending::Begun(text));
        let shared = self.clone();
        let begun =
            thread::Builder::new().name("vastex-mend".into()).spawn(move || shared.build(&anew, damaged));
        if let Err(error) = begun {
            report::say(&format!("no thread can be started to build it: {error}"));
            *step = Step::Over;
        }
        matches!(*step, Step::Building(_))
    }

    fn build(&self, anew: &Anew, damaged: PagePos) {
        let built = catch_unwind(AssertUnwindSafe(|| self.built(anew, damaged)));
        let built = built.unwrap_or_else(|_| Err(anyhow!("a fault of this program")));
        let mending = match built {
            Ok(container) => {
                *self.current.write().unwrap_or_else(PoisonError::into_inner) = Arc::new(container);
                Mending::Done
            }
            Err(error) => {
                let text =
                    format!("{}: cannot be built anew: {}", anew.image.display(), report::message(&error));
                if !self.is_left() {
                    report::say(&text);
                }
                Mending::Failed(text)
            }
        };
        let before = std::mem::replace(&mut *self.step(), Step::Over);
        if let Step::Building(waiting) = before {
            waiting.into_iter().for_each(Waker::wake);
        }
        self.tell(mending);
    }

    fn built(&self, Anew { cache, image, options }: &Anew, damaged: PagePos) -> anyhow::Result<Container> {
        if options.gives_way {
            vastex_build::give_way();
        }
        // Another program that shows it may have found the same, and have built it by now.
        let is_sound = |container: &Container| pollster::block_on(container.read(damaged)).is_ok();
        let built = cache.open_sound(image, options, &is_sound, &WhileRead(self))?.container;
        // A file that was changed meanwhile is another image.
        if built.description() != self.current().description() {
            return Err(anyhow!("it is another image by now; open it again"));
        }
        Ok(built)
    }

    fn is_left(&self) -> bool {
        self.is_left.load(Ordering::Relaxed)
    }

    fn tell(&self, mending: Mending) {
        if let Some(observer) = self.observer.as_ref().filter(|_| !self.is_left()) {
            observer(mending);
        }
    }
}

impl Drop for Mended {
    /// What is built by then stays, and the next opening goes on with it.
    fn drop(&mut self) {
        self.shared.is_left.store(true, Ordering::Relaxed);
    }
}

/// Builds for as long as anybody may read it.
struct WhileRead<'a>(&'a Shared);

impl Progress for WhileRead<'_> {
    fn advance(&self, _: u64, _: u64, _: u64) -> ControlFlow<()> {
        if self.0.is_left() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    fn wait(&self) -> ControlFlow<()> {
        self.advance(0, 0, 0)
    }

    fn opening(&self) -> ControlFlow<()> {
        self.advance(0, 0, 0)
    }

    fn beginning(&self, _: f64) -> ControlFlow<()> {
        self.advance(0, 0, 0)
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
        let current = self.shared.current();
        if !Arc::ptr_eq(&current, &self.first) {
            current.add_tiers(tiers);
        }
    }

    fn read(&self, pos: PagePos) -> ReadFuture<'_> {
        Box::pin(async move {
            let container = self.shared.current();
            let damaged = match container.read(pos).await {
                Err(error @ ReadError::Damaged { .. }) => error,
                read => return read,
            };
            match self.in_place_of(&container, pos).await {
                Instead::Built(built) => built.read(pos).await,
                Instead::Later => Err(ReadError::Store {
                    pos,
                    place: self.image.display().to_string(),
                    error: "what was built of it is damaged and is being built anew".to_owned(),
                }),
                Instead::Nothing => Err(damaged),
            }
        })
    }

    fn at_hand(&self, pos: PagePos) -> Option<Tile> {
        self.shared.current().at_hand(pos)
    }

    fn changed(&self, region: &Region) {
        self.shared.current().changed(region);
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;
    use std::fs::{self, File};
    use std::sync::mpsc::{Receiver, channel};
    use std::time::{Duration, Instant};

    use vastex_core::{Dims, PageId, TextureNumber};
    use vastex_tiles::{Loader, LoaderSettings, SystemClock};

    use super::*;

    const PATIENCE: Duration = Duration::from_secs(60);

    /// An image in a cache, some of whose tiles are damaged.
    struct Damaged {
        directory: tempfile::TempDir,
        container: Container,
        /// Pages whose tiles are, and whose tiles are not.
        bad: Vec<PagePos>,
        good: Vec<PagePos>,
    }

    fn anew(directory: &tempfile::TempDir) -> Anew {
        let image = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/earth-elevation-1080x540-u16.png");
        Anew {
            cache: BuildCache::new(directory.path(), BuildCache::DEFAULT_BUDGET),
            image: image.into(),
            options: BuildOptions::default(),
        }
    }

    fn damaged() -> Damaged {
        let directory = tempfile::tempdir().unwrap();
        let Anew { cache, image, options } = anew(&directory);
        drop(cache.open(&image, &options, &()).unwrap());
        let place = file_ending_with(&directory, "vastex");
        let mut bytes = fs::read(&place).unwrap();
        // Between the description and the index lie the tiles.
        let (begin, end) = (bytes.len() / 2, bytes.len() * 3 / 4);
        (begin..end).step_by(997).for_each(|at| bytes[at] ^= 0x55);
        fs::write(&place, bytes).unwrap();
        let container = Container::open_file(&place).unwrap();
        // The tail is read before a texture is shown, and waited for.
        let geometry = &container.description().geometry;
        let pages = geometry.pages().filter(|pos| *pos != geometry.tail_pos());
        let is_bad = |pos: &PagePos| pollster::block_on(container.read(*pos)).is_err();
        let (bad, good): (Vec<_>, Vec<_>) = pages.partition(is_bad);
        assert!(bad.len() >= 3 && good.len() >= 3, "{} are damaged, {} are not", bad.len(), good.len());
        Damaged { directory, container, bad, good }
    }

    fn file_ending_with(directory: &tempfile::TempDir, ending: &str) -> PathBuf {
        let entries = fs::read_dir(directory.path()).unwrap().map(|entry| entry.unwrap().path());
        let mut found = entries.filter(|path| path.extension().is_some_and(|there| there == ending));
        found.next().unwrap()
    }

    /// As another program does that builds the same: nothing is built until it is dropped.
    fn hold_up(directory: &tempfile::TempDir) -> File {
        let container = file_ending_with(directory, "vastex");
        let name = format!(".{}.lock", container.file_name().unwrap().to_str().unwrap());
        let file = File::options().create(true).append(true).open(directory.path().join(name)).unwrap();
        file.lock().unwrap();
        file
    }

    fn page(pos: PagePos) -> PageId {
        PageId::new(TextureNumber::new(0).unwrap(), Dims::D2, pos).unwrap()
    }

    /// One thread, and no more reads at once of the source than there are damaged tiles that are asked for.
    fn loader(source: Mended) -> Loader {
        let settings = LoaderSettings { threads: 1, reads_at_once: 2, ..LoaderSettings::default() };
        let mut loader = Loader::with(settings, Arc::new(SystemClock::new())).unwrap();
        loader.add_source(TextureNumber::new(0).unwrap(), Arc::new(source));
        loader
    }

    /// What comes of pages until there is something of so many.
    fn results(loader: &mut Loader, count: usize) -> BTreeMap<PageId, Result<(), String>> {
        let (mut results, begun) = (BTreeMap::new(), Instant::now());
        while results.len() < count {
            assert!(begun.elapsed() < PATIENCE, "nothing comes after {results:?}");
            match loader.poll() {
                Some(loaded) => {
                    let result = loaded.result.map(drop).map_err(|error| error.to_string());
                    results.insert(loaded.page, result);
                }
                None => thread::sleep(Duration::from_millis(1)),
            }
        }
        results
    }

    fn told(heard: &Receiver<Mending>) -> Mending {
        heard.recv_timeout(PATIENCE).unwrap()
    }

    #[test]
    fn while_an_image_is_built_anew_other_tiles_come_and_damaged_ones_are_tried_again() {
        let Damaged { directory, container, bad, good } = damaged();
        let held_up = hold_up(&directory);
        let (tell, heard) = channel();
        let tell = Mutex::new(tell);
        let observer: MendObserver = Arc::new(move |mending| tell.lock().unwrap().send(mending).unwrap());
        let mut loader = loader(Mended::new(container, anew(&directory), Some(observer)));
        // More damaged ones first than may be read at once.
        bad[..3].iter().for_each(|pos| loader.request(page(*pos), 0));
        good[..3].iter().for_each(|pos| loader.request(page(*pos), 1));
        let came = results(&mut loader, 6);
        for pos in &good[..3] {
            assert_eq!(came[&page(*pos)], Ok(()), "{pos}");
        }
        for pos in &bad[..3] {
            let error = came[&page(*pos)].clone().unwrap_err();
            assert!(error.contains("u16.png: what was built of it is damaged and is being built"), "{error}");
        }
        let Mending::Begun(text) = told(&heard) else { panic!("nothing was begun") };
        assert!(text.contains("is damaged; it is built anew"), "{text}");
        drop(held_up);
        assert!(matches!(told(&heard), Mending::Done));
        bad.iter().for_each(|pos| loader.request(page(*pos), 0));
        assert!(results(&mut loader, bad.len()).values().all(Result::is_ok));
    }

    /// Commands that end with what they show have nobody to try again.
    #[test]
    fn without_an_observer_damaged_tiles_come_once_they_are_built_anew() {
        let Damaged { directory, container, bad, good } = damaged();
        let held_up = hold_up(&directory);
        let mut loader = loader(Mended::new(container, anew(&directory), None));
        // One more may be read at once than are damaged.
        loader.request(page(bad[0]), 0);
        good[..3].iter().for_each(|pos| loader.request(page(*pos), 1));
        let came = results(&mut loader, 3);
        assert!(came.values().all(Result::is_ok) && !came.contains_key(&page(bad[0])), "{came:?}");
        drop(held_up);
        assert_eq!(results(&mut loader, 1)[&page(bad[0])], Ok(()));
    }

    /// Two programs show one damaged image: the second one to build it finds that the first one has.
    #[test]
    fn what_another_program_has_built_meanwhile_is_not_built_again() {
        let Damaged { directory, container, bad, .. } = damaged();
        let place = file_ending_with(&directory, "vastex");
        let held_up = hold_up(&directory);
        let (tell, heard) = channel();
        let tell = Mutex::new(tell);
        let observer: MendObserver = Arc::new(move |mending| tell.lock().unwrap().send(mending).unwrap());
        let mut loader = loader(Mended::new(container, anew(&directory), Some(observer)));
        loader.request(page(bad[0]), 0);
        assert!(results(&mut loader, 1)[&page(bad[0])].is_err());
        assert!(matches!(told(&heard), Mending::Begun(_)));
        // While the other has the right to build it, nothing of it is removed.
        thread::sleep(Duration::from_millis(300));
        assert!(place.exists(), "it is removed while another program builds it");
        let other = tempfile::tempdir().unwrap();
        let Anew { cache, image, options } = anew(&other);
        drop(cache.open(&image, &options, &()).unwrap());
        let sound = directory.path().join("sound");
        fs::copy(file_ending_with(&other, "vastex"), &sound).unwrap();
        let modified = fs::metadata(&sound).unwrap().modified().unwrap();
        fs::rename(&sound, &place).unwrap();
        drop(held_up);
        assert!(matches!(told(&heard), Mending::Done));
        assert_eq!(fs::metadata(&place).unwrap().modified().unwrap(), modified, "it is built once more");
        bad.iter().for_each(|pos| loader.request(page(*pos), 0));
        assert!(results(&mut loader, bad.len()).values().all(Result::is_ok));
    }

    /// An image that is no longer there cannot be built: the damage is told of, and nobody waits for ever.
    #[test]
    fn what_cannot_be_built_anew_is_damaged() {
        let Damaged { directory, container, bad, .. } = damaged();
        let anew = Anew { image: directory.path().join("gone.png"), ..anew(&directory) };
        let mut loader = loader(Mended::new(container, anew, None));
        for _ in 0..2 {
            loader.request(page(bad[0]), 0);
            let error = results(&mut loader, 1)[&page(bad[0])].clone().unwrap_err();
            assert!(error.contains("copy it anew"), "{error}");
        }
    }
}
