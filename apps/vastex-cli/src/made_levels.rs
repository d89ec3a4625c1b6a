//! Levels that the file of a volume lacks, made on a thread beside whatever is read and drawn meanwhile.
//!
//! ```text
//! let mut maker = LevelMaker::start(sources);        // once, with the textures that show them
//! maker.take_changes(&mut textures)?;                // in every frame
//! ```
//!
//! Until a brick is made a preview stands for it ([`VolumeSource::make_levels`]); what changed is read again.
//! Where nothing is to be made there is no thread. Who drops it stops the thread within a brick. Sources may
//! be added and forgotten at any time, as a window does.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use anyhow::Result;
use vastex::{Region, TextureId, Textures};
use vastex_volume::{MadeProgress, VolumeError, VolumeSource};

/// How long the thread rests where nothing is asked for: bricks that were forgotten may be asked for again.
const REST: Duration = Duration::from_millis(50);

/// How long is waited before it is looked what has changed.
const LOOK_EVERY: Duration = Duration::from_millis(20);

/// Sources that lack levels, each with what stops the making of them.
type Lacking = Arc<Mutex<Vec<(Arc<VolumeSource>, Arc<AtomicBool>)>>>;

/// Makes levels of volumes that are shown, on a thread of its own.
#[derive(Default)]
pub(crate) struct LevelMaker {
    shown: Vec<(TextureId, Arc<VolumeSource>)>,
    lacking: Lacking,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
    /// Faults of sources that are not shown any more.
    faults: Vec<VolumeError>,
}

impl LevelMaker {
    /// Begins to make the levels that these sources lack, each shown by a texture.
    pub(crate) fn start(shown: Vec<(TextureId, Arc<VolumeSource>)>) -> Result<LevelMaker> {
        let mut maker = LevelMaker::default();
        shown.into_iter().try_for_each(|(texture, source)| maker.add(texture, source))?;
        Ok(maker)
    }

    /// Makes those of another source, too, after the others.
    pub(crate) fn add(&mut self, texture: TextureId, source: Arc<VolumeSource>) -> Result<()> {
        if source.has_levels_to_make() {
            lock(&self.lacking).push((source.clone(), Arc::default()));
            if self.thread.is_none() {
                let (lacking, stop) = (self.lacking.clone(), self.stop.clone());
                let work = move || make(&lacking, &stop);
                self.thread = Some(std::thread::Builder::new().name("levels of volumes".into()).spawn(work)?);
            }
        }
        self.shown.push((texture, source));
        Ok(())
    }

    /// Goes on with these textures alone: the levels of others are not made any more.
    #[cfg_attr(not(feature = "view"), allow(dead_code, reason = "a window alone shows others in time"))]
    pub(crate) fn retain(&mut self, is_shown: impl Fn(TextureId) -> bool) {
        let mut gone = Vec::new();
        self.shown.retain(|(texture, source)| {
            let stays = is_shown(*texture);
            gone.extend((!stays).then(|| source.clone()));
            stays
        });
        for source in gone {
            self.faults.extend(source.faults());
            lock(&self.lacking).retain(|(other, stop)| {
                let stays = !Arc::ptr_eq(other, &source);
                stop.store(!stays, Ordering::Relaxed);
                stays
            });
        }
    }

    /// Whether nothing is left to be made. What changed last may not have been taken yet.
    pub(crate) fn is_done(&self) -> bool {
        // A thread that has ended, ended by a fault: nothing more comes of it.
        let is_working = self.thread.as_ref().is_some_and(|thread| !thread.is_finished());
        !is_working || !self.shown.iter().any(|(_, source)| source.has_levels_to_make())
    }

    /// Gives it some time, for who has nothing to draw meanwhile.
    pub(crate) fn wait() {
        std::thread::sleep(LOOK_EVERY);
    }

    /// How far it is: bricks of the finest levels that are made, of all sources together.
    pub(crate) fn progress(&self) -> MadeProgress {
        let mut sum = MadeProgress::default();
        for (_, source) in self.shown.iter().filter(|_| self.thread.is_some()) {
            // All made levels of a source have one state.
            let state = source.level_states().iter().find_map(|level| level.made).unwrap_or_default();
            (sum.done, sum.total) = (sum.done + state.done, sum.total + state.total);
        }
        sum
    }

    /// The parts of which the bricks were a preview and are made by now, since this was asked last.
    pub(crate) fn changes(&mut self) -> Vec<(TextureId, Region)> {
        let of = |(texture, source): &(TextureId, Arc<VolumeSource>)| {
            let texture = *texture;
            source.take_changes().into_iter().map(move |region| (texture, region))
        };
        self.shown.iter().flat_map(of).collect()
    }

    /// Has those bricks read again. Says how many parts have changed.
    pub(crate) fn take_changes(&mut self, textures: &mut Textures) -> Result<usize> {
        let changes = self.changes();
        for (texture, region) in &changes {
            textures.texture_mut(*texture)?.invalidate(region);
        }
        Ok(changes.len())
    }

    /// What went wrong so far: stored chunks that could not be read, of which the made levels have nothing,
    /// and a directory for made levels that cannot be used.
    pub(crate) fn faults(&self) -> Vec<VolumeError> {
        let shown = self.shown.iter().flat_map(|(_, source)| source.faults());
        let mut faults: Vec<VolumeError> = self.faults.iter().cloned().chain(shown).collect();
        faults.dedup();
        faults
    }
}

impl Drop for LevelMaker {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        lock(&self.lacking).iter().for_each(|(_, stop)| stop.store(true, Ordering::Relaxed));
        if let Some(thread) = self.thread.take() {
            thread.thread().unpark();
            // A panic was told where it was.
            drop(thread.join());
        }
    }
}

/// What is locked is whole at any moment.
fn lock(lacking: &Lacking) -> std::sync::MutexGuard<'_, Vec<(Arc<VolumeSource>, Arc<AtomicBool>)>> {
    lacking.lock().unwrap_or_else(PoisonError::into_inner)
}

fn make(lacking: &Lacking, stop: &AtomicBool) {
    while !stop.load(Ordering::Relaxed) {
        // Those that are added meanwhile come in the next round.
        let round = lock(lacking).clone();
        round.iter().for_each(|(source, is_gone)| source.make_levels(is_gone));
        let is_left = || lock(lacking).iter().any(|(source, _)| source.has_levels_to_make());
        if !stop.load(Ordering::Relaxed) && !is_left() {
            std::thread::park_timeout(REST);
        }
    }
}
