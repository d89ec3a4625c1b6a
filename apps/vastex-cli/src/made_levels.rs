//! Levels that the file of a volume lacks, made on a thread beside whatever is drawn meanwhile.
//!
//! ```text
//! let mut maker = LevelMaker::start(sources);        // once, with the textures that show them
//! maker.take_changes(&mut textures)?;                // in every frame
//! ```
//!
//! Until a brick is made a preview stands for it ([`VolumeSource::make_levels`]); what changed is read again.
//! Where nothing is to be made there is no thread. Who drops it stops the thread within a brick.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use anyhow::Result;
use vastex::{TextureId, Textures};
use vastex_volume::{MadeProgress, VolumeError, VolumeSource};

/// How long the thread rests where nothing is asked for: bricks that were forgotten may be asked for again.
const REST: Duration = Duration::from_millis(50);

/// How long is waited before it is looked what has changed.
const LOOK_EVERY: Duration = Duration::from_millis(20);

/// Makes levels of volumes that are shown, on a thread of its own.
pub(crate) struct LevelMaker {
    shown: Vec<(TextureId, Arc<VolumeSource>)>,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl LevelMaker {
    /// Begins to make the levels that these sources lack, each shown by a texture.
    pub(crate) fn start(shown: Vec<(TextureId, Arc<VolumeSource>)>) -> Result<LevelMaker> {
        let lacking: Vec<Arc<VolumeSource>> = shown
            .iter()
            .map(|(_, source)| source.clone())
            .filter(|source| source.has_levels_to_make())
            .collect();
        let stop = Arc::new(AtomicBool::new(false));
        let thread = match lacking.is_empty() {
            true => None,
            false => {
                let stop = stop.clone();
                let work = move || make(&lacking, &stop);
                Some(std::thread::Builder::new().name("levels of volumes".into()).spawn(work)?)
            }
        };
        Ok(LevelMaker { shown, stop, thread })
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

    /// Has the bricks read again that were a preview and are made by now. Says how many parts have changed.
    pub(crate) fn take_changes(&mut self, textures: &mut Textures) -> Result<usize> {
        let mut changes = 0;
        for (texture, source) in &self.shown {
            for region in source.take_changes() {
                textures.texture_mut(*texture)?.invalidate(&region);
                changes += 1;
            }
        }
        Ok(changes)
    }

    /// What went wrong so far: stored chunks that could not be read, of which the made levels have nothing,
    /// and a directory for made levels that cannot be used.
    pub(crate) fn faults(&self) -> Vec<VolumeError> {
        let mut faults: Vec<VolumeError> =
            self.shown.iter().flat_map(|(_, source)| source.faults()).collect();
        faults.dedup();
        faults
    }
}

impl Drop for LevelMaker {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            thread.thread().unpark();
            // A panic was told where it was.
            drop(thread.join());
        }
    }
}

fn make(sources: &[Arc<VolumeSource>], stop: &AtomicBool) {
    while !stop.load(Ordering::Relaxed) {
        sources.iter().for_each(|source| source.make_levels(stop));
        if !stop.load(Ordering::Relaxed) && !sources.iter().any(|source| source.has_levels_to_make()) {
            std::thread::park_timeout(REST);
        }
    }
}
