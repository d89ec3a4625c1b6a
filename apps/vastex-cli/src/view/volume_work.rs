//! What a volume in the window needs read: channels and labels at times, levels that are made, and values at
//! places. All of it on threads, so that the window never waits; levels on one of their own, so that nothing
//! that is read waits for them. Of no kind of work there are more than a few threads, however much is asked.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;

use anyhow::{Context, Result};
use glam::DVec3;
use vastex::{Preparer, Region, TextureId, Textures};
use vastex_viewer::panels::VolumeValues;
use vastex_viewer::volume_scene::{PointAnswer, PointAsked, VolumeLook};
use vastex_volume::{SourceFault, VolumeSource};

use super::one_search::{OneSearch, guarded};
use crate::made_levels::LevelMaker;
use crate::volumes::{
    LabelsBelow, OpenedVolume, ReadChannel, ReadLabels, find_label, point, read_channel, read_labels,
    usual_range, values_of,
};

/// Channels and labels that are read at once.
const AT_ONCE: usize = 2;
/// Faults of levels that are told, at most.
const MOST_FAULTS: usize = 4;

/// What a thread has read.
pub(super) enum Done {
    Channel {
        channel: usize,
        time: u64,
        read: Result<Box<ReadChannel>>,
    },
    Labels {
        nth: usize,
        time: u64,
        read: Result<Box<ReadLabels>>,
    },
    Point(Result<PointAnswer>, u64),
    /// Which values a channel has.
    Values {
        channel: usize,
        values: Result<Option<VolumeValues>>,
    },
    /// A place that a label of a number lies at, if there is any, of the labels that were asked.
    Label {
        label: i128,
        nth: usize,
        found: Result<Option<DVec3>>,
    },
    Range {
        channel: usize,
        range: Result<[f64; 2]>,
    },
}

/// Has the window look at what was read.
pub(super) type WakeWindow = Arc<dyn Fn() + Send + Sync>;

/// Threads that read a volume, and what they have read.
pub(super) struct VolumeWork {
    opened: Arc<OpenedVolume>,
    wake: WakeWindow,
    sender: Sender<Done>,
    receiver: Receiver<Done>,
    /// What waits to be read, the last first, and how many threads read.
    queue: Arc<Mutex<Queue>>,
    stop: Arc<AtomicBool>,
    /// Looks for labels.
    search: OneSearch<Option<DVec3>>,
    /// The channels that were read, with their times.
    sources: Vec<((usize, u64), Arc<VolumeSource>)>,
    /// And the labels.
    labels: Vec<((usize, u64), LabelsBelow)>,
    /// Makes the levels that they lack.
    levels: LevelMaker,
    /// Whether all that is seen was there when it was looked last what of them is wanted.
    had_all: bool,
    /// What went wrong with these that was told.
    told: Vec<SourceFault>,
}

/// What is to be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Wanted {
    Channel(usize, u64),
    Labels(usize, u64),
}

impl Wanted {
    fn time(self) -> u64 {
        let (Wanted::Channel(_, time) | Wanted::Labels(_, time)) = self;
        time
    }
}

#[derive(Default)]
struct Queue {
    waiting: Vec<Wanted>,
    reading: usize,
    /// Channels whose values are looked at once nothing waits to be read, and all of which that was asked.
    to_value: Vec<(usize, Arc<VolumeSource>)>,
    valued: Vec<usize>,
}

/// What a thread does next.
enum Next {
    Read(Wanted),
    Values(usize, Arc<VolumeSource>),
}

/// A thread that reads, or is about to: it counts as one until it is dropped, also by a panic, and where no
/// thread could be started.
struct Reader {
    queue: Arc<Mutex<Queue>>,
    /// True if it is counted.
    counts: bool,
}

impl Reader {
    /// What is next; once there is nothing, or all of it is to stop, it counts no more.
    fn next(&mut self, stop: &AtomicBool) -> Option<Next> {
        let mut queue = lock(&self.queue);
        let next = queue.next().filter(|_| !stop.load(Ordering::Relaxed));
        if next.is_none() {
            queue.reading -= usize::from(std::mem::replace(&mut self.counts, false));
        }
        next
    }
}

impl Drop for Reader {
    fn drop(&mut self) {
        lock(&self.queue).reading -= usize::from(self.counts);
    }
}

/// What is locked is whole at any moment.
fn lock(queue: &Mutex<Queue>) -> MutexGuard<'_, Queue> {
    queue.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Queue {
    fn next(&mut self) -> Option<Next> {
        let wanted = self.waiting.pop().map(Next::Read);
        wanted.or_else(|| self.to_value.pop().map(|(channel, source)| Next::Values(channel, source)))
    }

    /// The values of a channel are to be looked at, of the time that is read first: what is seen beside the
    /// range changes with none.
    fn value(&mut self, channel: usize, source: &Arc<VolumeSource>) {
        if !self.valued.contains(&channel) {
            self.valued.push(channel);
            self.to_value.insert(0, (channel, source.clone()));
        }
    }
}

impl VolumeWork {
    pub(super) fn new(opened: OpenedVolume, wake: WakeWindow) -> VolumeWork {
        let (sender, receiver) = channel();
        let stop: Arc<AtomicBool> = Arc::default();
        VolumeWork {
            opened: Arc::new(opened),
            wake,
            sender,
            receiver,
            queue: Arc::default(),
            search: OneSearch::new(stop.clone()),
            stop,
            sources: Vec::new(),
            labels: Vec::new(),
            levels: LevelMaker::default(),
            had_all: false,
            told: Vec::new(),
        }
    }

    /// Where the volume lies.
    pub(super) fn path(&self) -> &Path {
        &self.opened.volume.about().root
    }

    fn told_path(&self) -> &str {
        &self.opened.volume.about().path
    }

    /// Begins to read a channel at a time. Where that fails nobody reads it.
    pub(super) fn read(&self, (channel, time): (usize, u64), preparer: Preparer) -> Result<()> {
        self.want(Wanted::Channel(channel, time), preparer)
    }

    /// Begins to read labels at a time. Where that fails nobody reads them.
    pub(super) fn read_labels(&self, (nth, time): (usize, u64), preparer: Preparer) -> Result<()> {
        self.want(Wanted::Labels(nth, time), preparer)
    }

    fn want(&self, wanted: Wanted, preparer: Preparer) -> Result<()> {
        let mut reader = {
            let mut queue = lock(&self.queue);
            queue.waiting.insert(0, wanted);
            if queue.reading >= AT_ONCE {
                return Ok(());
            }
            queue.reading += 1;
            Reader { queue: self.queue.clone(), counts: true }
        };
        let (opened, sender, wake, stop) =
            (self.opened.clone(), self.sender.clone(), self.wake.clone(), self.stop.clone());
        let begun = spawn("vastex-reader", move || {
            while let Some(next) = reader.next(&stop) {
                let done = match next {
                    Next::Read(wanted) => read_now(&opened, wanted, &preparer),
                    Next::Values(channel, source) => {
                        let path = &opened.volume.about().path;
                        Done::Values { channel, values: guarded(path, || values_of(&source)) }
                    }
                };
                if let Done::Channel { channel, read: Ok(read), .. } = &done {
                    lock(&reader.queue).value(*channel, &read.source);
                }
                drop(sender.send(done));
                wake();
            }
        });
        if begun.is_err() {
            let mut queue = lock(&self.queue);
            // Others that read come to it.
            if queue.reading == 0
                && let Some(at) = queue.waiting.iter().position(|other| *other == wanted)
            {
                queue.waiting.remove(at);
                return begun;
            }
        }
        Ok(())
    }

    /// Begins to find out what lies at a place.
    pub(super) fn ask(&self, asked: PointAsked, look: &VolumeLook) -> Result<()> {
        let of_time = self.sources.iter().filter(|((_, time), _)| *time == asked.time);
        let shown: Vec<usize> = look.shown().collect();
        let mut sources: Vec<_> = of_time.map(|((channel, _), source)| (*channel, source.clone())).collect();
        sources.retain(|(channel, _)| shown.contains(channel));
        sources.sort_by_key(|(channel, _)| *channel);
        let (opened, look, sender, wake) =
            (self.opened.clone(), look.clone(), self.sender.clone(), self.wake.clone());
        let is_shown = |(of, _): &&((usize, u64), LabelsBelow)| Some(of.0) == asked.labels;
        let labels = self.labels.iter().filter(is_shown).find(|((_, time), _)| *time == asked.time);
        let labels = labels.map(|(_, labels)| labels.clone());
        spawn("vastex-value", move || {
            let told = guarded(&opened.volume.about().path, || {
                point(&opened.facts, &look, (&sources, labels.as_ref()), &asked)
            });
            drop(sender.send(Done::Point(told, asked.number)));
            wake();
        })
    }

    /// Begins to find out where a label of a number is, at a time. What is looked for already is not any
    /// more. Fails where such labels are not there.
    pub(super) fn find_label(&self, label: i128, (nth, time): (usize, u64)) -> Result<()> {
        let Some((_, below)) = self.labels.iter().find(|(of, _)| *of == (nth, time)) else {
            anyhow::bail!("label {label}: the labels are being read; ask again when they are shown");
        };
        let (below, sender, wake) = (below.clone(), self.sender.clone(), self.wake.clone());
        let look = move |is_over: &dyn Fn() -> bool| find_label(&below, label, is_over);
        self.search.begin(self.told_path(), look, move |found| {
            drop(sender.send(Done::Label { label, nth, found }));
            wake();
        })
    }

    /// Begins to find the usual ranges of channels, of the time that is seen.
    pub(super) fn find_ranges(&self, channels: &[usize], seen: u64) -> Result<()> {
        let sources = self.sources_at(channels, seen);
        let (opened, sender, wake) = (self.opened.clone(), self.sender.clone(), self.wake.clone());
        spawn("vastex-range", move || {
            for (channel, source) in sources {
                let range = guarded(&opened.volume.about().path, || usual_range(&source, channel));
                drop(sender.send(Done::Range { channel, range }));
            }
            wake();
        })
    }

    /// What channels are read from at a time, as far as they are.
    fn sources_at(&self, channels: &[usize], seen: u64) -> Vec<(usize, Arc<VolumeSource>)> {
        let is_asked = |(channel, time): &(usize, u64)| *time == seen && channels.contains(channel);
        let sources = self.sources.iter().filter(|(of, _)| is_asked(of));
        sources.map(|((channel, _), source)| (*channel, source.clone())).collect()
    }

    /// What has been read since that was asked last.
    pub(super) fn take_done(&mut self) -> Vec<Done> {
        let done: Vec<Done> = self.receiver.try_iter().collect();
        for done in &done {
            if let Done::Labels { nth, time, read: Ok(read) } = done {
                self.labels.retain(|(of, _)| *of != (*nth, *time));
                self.labels.push(((*nth, *time), (read.source.clone(), read.place.clone())));
            }
            if let Done::Channel { channel, time, read: Ok(read) } = done {
                self.sources.retain(|(of, _)| *of != (*channel, *time));
                self.sources.push(((*channel, *time), read.source.clone()));
            }
        }
        done
    }

    /// The levels that a channel or labels lack are made from here on, for the texture that shows it.
    pub(super) fn make_levels(&mut self, texture: TextureId, source: Arc<VolumeSource>) -> Result<()> {
        self.levels.add(texture, source).context("no thread can be started to make levels of the volume")
    }

    /// Has those bricks of levels made that the pictures of these textures want, where no others are made;
    /// `has_all` where all that is seen is there.
    pub(super) fn want_levels(&mut self, textures: &Textures, has_all: bool) {
        // What rests wants nothing else.
        if std::mem::replace(&mut self.had_all, has_all) && has_all {
            return;
        }
        self.levels.want(textures);
        if has_all {
            self.levels.want_tails(textures, 0);
        }
    }

    /// Returns true if bricks are there that will be read again, since those beside them had not come.
    pub(super) fn has_early_bricks(&self) -> bool {
        let labels = self.labels.iter().map(|(_, (source, _))| source);
        self.sources.iter().map(|(_, source)| source).chain(labels).any(|source| source.has_early_bricks())
    }

    /// Parts of which bricks were a preview, or came before those beside them, and are to be read again.
    pub(super) fn changes(&mut self) -> Vec<(TextureId, Region)> {
        self.levels.changes()
    }

    /// Returns true if levels are being made: the window is to look now and then what has changed.
    pub(super) fn is_making(&self) -> bool {
        !self.levels.is_done()
    }

    /// What went wrong with levels since that was asked last, at most a few.
    pub(super) fn take_faults(&mut self) -> Vec<SourceFault> {
        let mut new = self.levels.faults();
        new.retain(|fault| !self.told.contains(fault));
        new.truncate(MOST_FAULTS.saturating_sub(self.told.len()));
        self.told.extend(new.iter().cloned());
        new
    }

    /// Only these times, and these textures, are wanted any more, and one of the times is seen.
    pub(super) fn keep(&mut self, times: &[u64], seen: u64, is_shown: impl Fn(TextureId) -> bool) {
        self.sources.retain(|((_, time), _)| times.contains(time));
        self.labels.retain(|((_, time), _)| times.contains(time));
        lock(&self.queue).waiting.retain(|wanted| times.contains(&wanted.time()));
        self.levels.retain(is_shown);
        let labels = self.labels.iter().map(|(of, (source, _))| (of, source));
        let all = self.sources.iter().map(|(of, source)| (of, source)).chain(labels);
        let seen: Vec<_> = all.filter(|(of, _)| of.1 == seen).map(|(_, source)| source).collect();
        self.levels.prefer(|source| seen.iter().any(|other| Arc::ptr_eq(other, source)));
    }
}

/// Reads channels or labels at a time.
fn read_now(opened: &OpenedVolume, wanted: Wanted, preparer: &Preparer) -> Done {
    let path = &opened.volume.about().path;
    match wanted {
        Wanted::Channel(channel, time) => {
            let read = guarded(path, || read_channel(opened, (channel, time), preparer));
            Done::Channel { channel, time, read: read.map(Box::new) }
        }
        Wanted::Labels(nth, time) => {
            let name = opened.facts.labels.get(nth).cloned().unwrap_or_default();
            let read = guarded(path, || read_labels(opened, (&name, time), preparer));
            Done::Labels { nth, time, read: read.map(Box::new) }
        }
    }
}

impl Drop for VolumeWork {
    /// What is being read is broken off where that is possible. Nobody waits for it.
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        let levels = std::mem::take(&mut self.levels);
        // Where no thread can be started, that brick is waited for after all.
        drop(spawn("vastex-levels-end", move || drop(levels)));
    }
}

fn spawn(name: &str, work: impl FnOnce() + Send + 'static) -> Result<()> {
    let thread = thread::Builder::new().name(name.into()).spawn(work);
    thread.map(drop).context("no thread can be started to read the volume")
}

#[cfg(test)]
mod tests;
