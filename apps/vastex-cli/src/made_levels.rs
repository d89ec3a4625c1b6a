//! Levels that the file of a volume lacks, made on a thread beside whatever is read and drawn meanwhile.
//!
//! ```text
//! let mut maker = LevelMaker::start(sources);        // once, with the textures that show them
//! maker.take_changes(&mut textures)?;                // in every frame
//! ```
//!
//! Until a brick is made a preview stands for it ([`VolumeSource::make_levels`]); what changed is read again.
//! Where nothing is to be made there is no thread. Who drops it stops the thread within a brick. Sources may
//! be added and forgotten at any time, as a window does. They take turns, each for a slice of time in which
//! it makes what was asked for before all else, so that none waits for the whole levels of another; those
//! that nobody sees yet wait for all others. Where a source makes only what is wanted, who draws says what
//! that is ([`LevelMaker::want`]).

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use anyhow::Result;
use vastex::{Region, TextureId, Textures, TileSource};
use vastex_volume::{MadeProgress, SourceFault, Volume, VolumeSource};

use crate::report;

/// How long the thread rests where nothing is asked for: bricks that were forgotten may be asked for again.
const REST: Duration = Duration::from_millis(50);

/// And where another thread is making what is asked for.
const PAUSE: Duration = Duration::from_millis(1);

/// How long is waited before it is looked what has changed.
const LOOK_EVERY: Duration = Duration::from_millis(20);

/// How long a source has the thread to itself, at least, where others lack levels, too.
const TURN: Duration = Duration::from_millis(150);
/// How long who waits is told nothing, and how often then.
const TELL_AFTER: Duration = Duration::from_secs(1);
const TELL_EVERY: Duration = Duration::from_secs(2);
/// Faults that are kept.
const MOST_FAULTS: usize = 16;

/// Sources that lack levels.
type Lacking = Arc<Mutex<Turns>>;

/// Whose turn it is.
#[derive(Default)]
struct Turns {
    sources: Vec<LackingSource>,
    /// Counts turns.
    turn: u64,
    /// When the last one began.
    begun: Option<Instant>,
}

/// A source that lacks levels.
struct LackingSource {
    source: Arc<VolumeSource>,
    /// Ends its turn, or the making of its levels once it is not among the others any more.
    stop: Arc<AtomicBool>,
    /// True if it is seen now.
    is_seen: bool,
    /// Its last turn.
    turn: u64,
}

impl Turns {
    /// The next source that has anything to make: one that is seen, and of these the one that waits longest.
    fn next(&mut self) -> Option<(Arc<VolumeSource>, Arc<AtomicBool>)> {
        let lacking = self.sources.iter_mut().filter(|of| of.source.has_levels_to_make());
        let next = lacking.min_by_key(|of| (!of.is_seen, of.turn))?;
        self.turn += 1;
        (next.turn, self.begun) = (self.turn, Some(Instant::now()));
        next.stop.store(false, Ordering::Relaxed);
        Some((next.source.clone(), next.stop.clone()))
    }

    /// Ends the turn that is being taken: what waits is looked through anew.
    fn end(&self) {
        self.sources.iter().for_each(|of| of.stop.store(true, Ordering::Relaxed));
    }

    /// Ends a turn that has taken so long that it is another one's.
    fn end_if_long(&self) {
        if self.begun.is_none_or(|begun| begun.elapsed() < TURN) {
            return;
        }
        let lacking = self.sources.iter().filter(|of| of.source.has_levels_to_make());
        let (seen, others): (Vec<_>, Vec<_>) = lacking.partition(|of| of.is_seen);
        if seen.len() > 1 || (seen.is_empty() && others.len() > 1) {
            self.end();
        }
    }
}

/// Makes levels of volumes that are shown, on a thread of its own.
#[derive(Default)]
pub(crate) struct LevelMaker {
    shown: Vec<(TextureId, Arc<VolumeSource>)>,
    lacking: Lacking,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
    /// When who waits is told next how far it is.
    next_told: Option<Instant>,
    /// Faults of sources that are not shown any more.
    faults: Vec<SourceFault>,
}

impl LevelMaker {
    /// Begins to make the levels that these sources lack, each shown by a texture.
    pub(crate) fn start(shown: Vec<(TextureId, Arc<VolumeSource>)>) -> Result<LevelMaker> {
        let mut maker = LevelMaker::default();
        shown.into_iter().try_for_each(|(texture, source)| maker.add(texture, source))?;
        Ok(maker)
    }

    /// Makes those of another source, too, which is seen. It has the next turn.
    pub(crate) fn add(&mut self, texture: TextureId, source: Arc<VolumeSource>) -> Result<()> {
        if source.may_lack_levels() {
            let mut lacking = lock(&self.lacking);
            lacking.end();
            let source = source.clone();
            lacking.sources.push(LackingSource { source, stop: Arc::default(), is_seen: true, turn: 0 });
            drop(lacking);
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
            source.faults().into_iter().for_each(|fault| keep_fault(&mut self.faults, fault));
            lock(&self.lacking).sources.retain(|of| {
                let stays = !Arc::ptr_eq(&of.source, &source);
                if !stays {
                    of.stop.store(true, Ordering::Relaxed);
                }
                stays
            });
        }
    }

    /// These sources are seen now: others have a turn where these lack nothing.
    #[cfg_attr(not(feature = "view"), allow(dead_code, reason = "a window alone shows others in time"))]
    pub(crate) fn prefer(&mut self, is_seen: impl Fn(&Arc<VolumeSource>) -> bool) {
        let mut lacking = lock(&self.lacking);
        let mut is_other = false;
        for of in &mut lacking.sources {
            let is_seen = is_seen(&of.source);
            is_other |= std::mem::replace(&mut of.is_seen, is_seen) != is_seen;
        }
        if is_other {
            lacking.end();
        }
    }

    /// Returns true if any of the sources lacks levels that were not made when it was opened, whether they
    /// are made by now or not.
    pub(crate) fn may_lack_levels(&self) -> bool {
        self.shown.iter().any(|(_, source)| source.may_lack_levels())
    }

    /// The volumes that are shown, each once.
    pub(crate) fn volumes(&self) -> Vec<&Arc<Volume>> {
        let mut volumes: Vec<&Arc<Volume>> = Vec::new();
        for (_, source) in &self.shown {
            if !volumes.iter().any(|volume| Arc::ptr_eq(volume, source.volume())) {
                volumes.push(source.volume());
            }
        }
        volumes
    }

    /// Returns true if nothing is left to be made. What changed last may not have been taken yet.
    pub(crate) fn is_done(&self) -> bool {
        // A thread that has ended, ended by a fault: nothing more comes of it.
        let is_working = self.thread.as_ref().is_some_and(|thread| !thread.is_finished());
        !is_working || !self.shown.iter().any(|(_, source)| source.has_levels_to_make())
    }

    /// Gives it some time, for who has nothing to draw meanwhile.
    pub(crate) fn wait() {
        std::thread::sleep(LOOK_EVERY);
    }

    /// The same, and says how far it is now and then.
    pub(crate) fn wait_and_tell(&mut self) {
        LevelMaker::wait();
        let now = Instant::now();
        if now >= *self.next_told.get_or_insert(now + TELL_AFTER) {
            self.next_told = Some(now + TELL_EVERY);
            let MadeProgress { done, total } = self.progress();
            report::say(&format!(
                "note: levels that the file lacks are made: {done} of at most {total} bricks so far"
            ));
        }
    }

    /// Has those bricks made that feedback wants, of sources that make no others ([`VolumeSource::want`]),
    /// and the coarser ones that stand for them: all where a pool is too small, and for each brick that
    /// cannot be read the first that is made. Returns true if any are to be made, or to be read again, for
    /// it.
    pub(crate) fn want(&self, textures: &Textures) -> bool {
        let waiting: Vec<_> = self.shown.iter().filter(|(_, source)| source.waits_for_want()).collect();
        if waiting.is_empty() {
            return false;
        }
        let (inspect, pager) = (textures.inspect(), textures.stats().pager);
        let is_coarser = pager.bias_eighths > 0;
        let mut is_new = false;
        let failed = if pager.failed > 0 { inspect.failed_pages() } else { Vec::new() };
        for page in failed {
            let id = inspect.id_of(page.texture());
            for (_, source) in waiting.iter().filter(|(texture, _)| Some(*texture) == id) {
                let geometry = &source.description().geometry;
                let (pos, stored) = (page.pos(geometry.dims()), source.levels().stored());
                let mut coarser = std::iter::successors(Some(pos), |pos| geometry.parent(*pos));
                if let Some(made) = coarser.find(|pos| usize::from(pos.level) >= stored) {
                    is_new |= source.want(made);
                }
            }
        }
        for wanted in inspect.wanted().pages {
            let id = inspect.id_of(wanted.page.texture());
            for (_, source) in waiting.iter().filter(|(texture, _)| Some(*texture) == id) {
                let geometry = &source.description().geometry;
                let pos = wanted.page.pos(geometry.dims());
                let coarser = std::iter::successors(Some(pos), |pos| geometry.parent(*pos));
                for pos in coarser.take(if is_coarser { usize::MAX } else { 1 }) {
                    is_new |= source.want(pos);
                }
            }
        }
        is_new
    }

    /// The same of the coarsest bricks, which are always there: where a pixel wants them, since `frame` or
    /// later. To be asked once feedback has named what there is.
    pub(crate) fn want_tails(&self, textures: &Textures, frame: u64) -> bool {
        let waiting: Vec<_> = self.shown.iter().filter(|(_, source)| source.waits_for_want()).collect();
        let inspect = textures.inspect();
        let is_seen = |texture| inspect.tail_wanted(texture).is_some_and(|wanted| wanted >= frame);
        let seen = waiting.into_iter().filter(|(texture, _)| is_seen(*texture));
        // Each of them: the first that is new ends nothing.
        seen.fold(false, |is_new, (_, source)| source.want(source.description().geometry.tail_pos()) | is_new)
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
        lock(&self.lacking).end_if_long();
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

    /// What went wrong so far: the first few of it, each once.
    pub(crate) fn faults(&self) -> Vec<SourceFault> {
        let mut faults = self.faults.clone();
        let shown = self.shown.iter().flat_map(|(_, source)| source.faults());
        shown.for_each(|fault| keep_fault(&mut faults, fault));
        faults
    }
}

impl Drop for LevelMaker {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        lock(&self.lacking).end();
        if let Some(thread) = self.thread.take() {
            thread.thread().unpark();
            // A panic was told where it was.
            drop(thread.join());
        }
    }
}

/// Keeps a fault, if it is another than those before and they are few.
fn keep_fault(faults: &mut Vec<SourceFault>, fault: SourceFault) {
    if faults.len() < MOST_FAULTS && !faults.contains(&fault) {
        faults.push(fault);
    }
}

/// What is locked is whole at any moment.
fn lock(lacking: &Lacking) -> std::sync::MutexGuard<'_, Turns> {
    lacking.lock().unwrap_or_else(PoisonError::into_inner)
}

fn make(lacking: &Lacking, stop: &AtomicBool) {
    loop {
        let next = {
            let mut lacking = lock(lacking);
            // Looked at while nobody ends turns: what is told to stop after this ends the turn.
            if stop.load(Ordering::Relaxed) {
                return;
            }
            lacking.next()
        };
        match next {
            Some((source, is_over)) => {
                source.make_levels(&is_over);
                // Who reads a brick that is asked for has it in hand.
                if source.has_levels_to_make() && !is_over.load(Ordering::Relaxed) {
                    std::thread::sleep(PAUSE);
                }
            }
            None => std::thread::park_timeout(REST),
        }
    }
}

#[cfg(test)]
mod tests {
    use vastex_volume::VolumeOptions;

    use super::*;

    #[test]
    fn sources_take_turns_and_what_is_not_seen_waits() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("large.raw");
        // Larger than what is made at opening. Nothing is written of it: the file has holes.
        std::fs::File::create(&path).unwrap().set_len(3 * 420 * 410 * 400).unwrap();
        let about =
            "width = 420\nheight = 410\ndepth = 400\nsample = \"u8\"\nchannels = 3\norder = \"planar\"\n";
        std::fs::write(directory.path().join("large.raw.toml"), about).unwrap();
        let volume = match vastex_volume::open(&path).unwrap() {
            vastex_volume::Opened::Volume(volume) => Arc::new(*volume),
            other => panic!("{other:?}"),
        };
        let open =
            |channel| VolumeSource::open(volume.clone(), &VolumeOptions { channel, ..Default::default() });
        let all: Vec<_> = (0..3).map(|channel| Arc::new(open(channel).unwrap())).collect();
        let of = |(nth, source): (usize, &Arc<VolumeSource>)| LackingSource {
            source: source.clone(),
            stop: Arc::default(),
            is_seen: nth < 2,
            turn: 0,
        };
        let mut turns = Turns { sources: all.iter().enumerate().map(of).collect(), ..Turns::default() };
        let next = |turns: &mut Turns| {
            let (source, is_over) = turns.next()?;
            assert!(!is_over.load(Ordering::Relaxed));
            turns.end();
            assert!(is_over.load(Ordering::Relaxed));
            all.iter().position(|one| Arc::ptr_eq(one, &source))
        };
        assert_eq!((0..4).map(|_| next(&mut turns)).collect::<Vec<_>>(), [0, 1, 0, 1].map(Some));
        all[0].make_levels(&AtomicBool::new(false));
        assert_eq!((0..2).map(|_| next(&mut turns)).collect::<Vec<_>>(), [1, 1].map(Some));
        all[1].make_levels(&AtomicBool::new(false));
        assert_eq!(next(&mut turns), Some(2));
        all[2].make_levels(&AtomicBool::new(false));
        assert_eq!(next(&mut turns), None);
    }

    #[test]
    fn faults_are_few_and_each_is_kept_once() {
        let fault = |nth: usize| {
            let fault = vastex_volume::VolumeFault::Read(format!("chunk {nth}"));
            SourceFault::Voxels(vastex_volume::VolumeError { path: "a.zarr".into(), fault })
        };
        let mut faults = Vec::new();
        for _ in 0..3 {
            (0..40).for_each(|nth| keep_fault(&mut faults, fault(nth)));
        }
        assert_eq!(faults, (0..MOST_FAULTS).map(fault).collect::<Vec<_>>());
    }
}
