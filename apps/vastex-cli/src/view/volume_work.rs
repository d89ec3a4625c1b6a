//! What a volume in the window needs read: channels at times, levels that are made, and values at places. All
//! of it on threads, so that the window never waits; levels on one of their own, so that nothing that is read
//! waits for them.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;

use anyhow::{Context, Result};
use glam::DVec3;
use vastex::{Preparer, Region, TextureId};
use vastex_viewer::panels::VolumeValues;
use vastex_viewer::volume_scene::{PointAnswer, PointAsked, VolumeLook};
use vastex_volume::{VolumeError, VolumeSource};

use crate::made_levels::LevelMaker;
use crate::volumes::{
    LabelsBelow, OpenedVolume, ReadChannel, ReadLabels, labels, point, read_channel, read_labels,
    usual_range, values_of,
};

/// Channels that are read at once.
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
    /// A place that a label of a number lies at, if there is any.
    Label(i128, Result<Option<DVec3>>),
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
    /// The channels that were read, with their times.
    sources: Vec<((usize, u64), Arc<VolumeSource>)>,
    /// And the labels.
    labels: Vec<((usize, u64), LabelsBelow)>,
    /// Makes the levels that they lack.
    levels: LevelMaker,
    /// What went wrong with these that was told.
    told: Vec<VolumeError>,
}

#[derive(Default)]
struct Queue {
    waiting: Vec<(usize, u64)>,
    reading: usize,
    /// Channels whose values are looked at once nothing waits to be read, and all of which that was asked.
    to_value: Vec<(usize, Arc<VolumeSource>)>,
    valued: Vec<usize>,
}

/// What a thread does next.
enum Next {
    Channel(usize, u64),
    Values(usize, Arc<VolumeSource>),
}

impl Queue {
    fn next(&mut self) -> Option<Next> {
        let channel = self.waiting.pop().map(|(channel, time)| Next::Channel(channel, time));
        channel.or_else(|| self.to_value.pop().map(|(channel, source)| Next::Values(channel, source)))
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
        VolumeWork {
            opened: Arc::new(opened),
            wake,
            sender,
            receiver,
            queue: Arc::default(),
            stop: Arc::default(),
            sources: Vec::new(),
            labels: Vec::new(),
            levels: LevelMaker::default(),
            told: Vec::new(),
        }
    }

    /// Where the volume lies.
    pub(super) fn path(&self) -> &Path {
        Path::new(&self.opened.volume.about().path)
    }

    /// Begins to read a channel at a time.
    pub(super) fn read(&self, of: (usize, u64), preparer: Preparer) -> Result<()> {
        let queue = self.queue.clone();
        let is_new = {
            let mut queue = queue.lock().unwrap_or_else(PoisonError::into_inner);
            queue.waiting.insert(0, of);
            let is_new = queue.reading < AT_ONCE;
            queue.reading += usize::from(is_new);
            is_new
        };
        if !is_new {
            return Ok(());
        }
        let (opened, sender, wake, stop) =
            (self.opened.clone(), self.sender.clone(), self.wake.clone(), self.stop.clone());
        let read = move || {
            loop {
                let next = {
                    let mut queue = queue.lock().unwrap_or_else(PoisonError::into_inner);
                    let next = queue.next().filter(|_| !stop.load(Ordering::Relaxed));
                    queue.reading -= usize::from(next.is_none());
                    next
                };
                let done = match next {
                    None => return,
                    Some(Next::Channel(channel, time)) => {
                        let read = read_channel(&opened.volume, (channel, time), &preparer);
                        if let Ok(read) = &read {
                            let mut queue = queue.lock().unwrap_or_else(PoisonError::into_inner);
                            queue.value(channel, &read.source);
                        }
                        Done::Channel { channel, time, read: read.map(Box::new) }
                    }
                    Some(Next::Values(channel, source)) => {
                        Done::Values { channel, values: values_of(&source) }
                    }
                };
                drop(sender.send(done));
                wake();
            }
        };
        spawn("vastex-channel", read)
    }

    /// Begins to read labels at a time.
    pub(super) fn read_labels(&self, (nth, time): (usize, u64), preparer: Preparer) -> Result<()> {
        let name = self.opened.facts.labels.get(nth).cloned().unwrap_or_default();
        let (opened, sender, wake) = (self.opened.clone(), self.sender.clone(), self.wake.clone());
        spawn("vastex-labels", move || {
            let read = read_labels(&opened, (&name, time), &preparer);
            drop(sender.send(Done::Labels { nth, time, read: read.map(Box::new) }));
            wake();
        })
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
        let is_shown = |(of, _): &&((usize, u64), LabelsBelow)| Some(of.0) == look.labels.shown;
        let labels = self.labels.iter().filter(is_shown).find(|((_, time), _)| *time == asked.time);
        let labels = labels.map(|(_, labels)| labels.clone());
        spawn("vastex-value", move || {
            let told = point(&opened.facts, &look, (&sources, labels.as_ref()), &asked);
            drop(sender.send(Done::Point(told, asked.number)));
            wake();
        })
    }

    /// Begins to find out where a label of a number is, at a time. Says whether such labels are there.
    pub(super) fn find_label(&self, label: i128, (nth, time): (usize, u64)) -> Result<()> {
        let Some((_, below)) = self.labels.iter().find(|(of, _)| *of == (nth, time)) else {
            anyhow::bail!("label {label}: the labels are being read; ask again when they are shown");
        };
        let (below, sender, wake) = (below.clone(), self.sender.clone(), self.wake.clone());
        spawn("vastex-label", move || {
            drop(sender.send(Done::Label(label, labels::find(&below, label))));
            wake();
        })
    }

    /// Begins to find the usual ranges of channels.
    pub(super) fn find_ranges(&self, channels: &[usize]) -> Result<()> {
        let is_asked = |channel: &usize| channels.contains(channel);
        let mut sources: Vec<_> =
            self.sources.iter().map(|((channel, _), source)| (*channel, source.clone())).collect();
        sources.retain(|(channel, _)| is_asked(channel));
        sources.dedup_by_key(|(channel, _)| *channel);
        let (sender, wake) = (self.sender.clone(), self.wake.clone());
        spawn("vastex-range", move || {
            for (channel, source) in sources {
                drop(sender.send(Done::Range { channel, range: usual_range(&source, channel) }));
            }
            wake();
        })
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

    /// The levels that a channel lacks are made from here on, for the texture that shows it.
    pub(super) fn make_levels(&mut self, texture: TextureId, source: Arc<VolumeSource>) -> Result<()> {
        self.levels.add(texture, source).context("no thread can be started to make levels of the volume")
    }

    /// Parts of levels that were a preview and are made by now.
    pub(super) fn changes(&mut self) -> Vec<(TextureId, Region)> {
        self.levels.changes()
    }

    /// Whether levels are being made: the window is to look now and then what has changed.
    pub(super) fn is_making(&self) -> bool {
        !self.levels.is_done()
    }

    /// What went wrong with levels since that was asked last, at most a few.
    pub(super) fn take_faults(&mut self) -> Vec<VolumeError> {
        let mut new = self.levels.faults();
        new.retain(|fault| !self.told.contains(fault));
        new.truncate(MOST_FAULTS.saturating_sub(self.told.len()));
        self.told.extend(new.iter().cloned());
        new
    }

    /// Only these times, and these textures, are wanted any more.
    pub(super) fn keep(&mut self, times: &[u64], is_shown: impl Fn(TextureId) -> bool) {
        self.sources.retain(|((_, time), _)| times.contains(time));
        self.labels.retain(|((_, time), _)| times.contains(time));
        let mut queue = self.queue.lock().unwrap_or_else(PoisonError::into_inner);
        queue.waiting.retain(|(_, time)| times.contains(time));
        drop(queue);
        self.levels.retain(is_shown);
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
mod tests {
    use std::time::{Duration, Instant};

    use vastex::{Settings, Textures};
    use vastex_scenes::headless_gpu;

    use super::*;
    use crate::volumes::open_volume;

    /// Four channels, each of one level that is larger than what is made at opening.
    fn large(directory: &Path) -> OpenedVolume {
        let path = directory.join("large.raw");
        let file = std::fs::File::create(&path).unwrap();
        // Nothing is written of it: the file has holes.
        file.set_len(4 * 420 * 410 * 400).unwrap();
        let about =
            "width = 420\nheight = 410\ndepth = 400\nsample = \"u8\"\nchannels = 4\norder = \"planar\"\n";
        std::fs::write(directory.join("large.raw.toml"), about).unwrap();
        open_volume(&path).unwrap()
    }

    #[test]
    fn every_channel_is_read_before_any_level_is_made() {
        let directory = tempfile::tempdir().unwrap();
        let gpu = headless_gpu().unwrap();
        let mut textures = Textures::new(&gpu.device, &gpu.queue, Settings::default()).unwrap();
        let mut work = VolumeWork::new(large(directory.path()), Arc::new(|| {}));
        for channel in 0..4 {
            work.read((channel, 0), textures.preparer()).unwrap();
        }
        let (mut read, begun) = (Vec::new(), Instant::now());
        while read.len() < 4 {
            assert!(begun.elapsed() < Duration::from_secs(120), "{} of 4 channels were read", read.len());
            for done in work.take_done() {
                match done {
                    Done::Channel { read: Ok(one), .. } => read.push(*one),
                    Done::Values { values: Ok(Some(_)), .. } => {}
                    _ => panic!("a channel cannot be read"),
                }
            }
            thread::sleep(Duration::from_millis(5));
        }
        assert!(read.iter().all(|read| read.source.has_levels_to_make()) && !work.is_making());
        // They are made beside that, of those that are shown.
        let mut sources = Vec::new();
        for ReadChannel { source, prepared, .. } in read {
            let texture = textures.add(prepared).unwrap_or_else(|refused| panic!("{}", refused.error));
            work.make_levels(texture, source.clone()).unwrap();
            sources.push((texture, source));
        }
        assert!(work.is_making());
        let [(first, made), (_, gone), ..] = &sources[..] else { panic!("four") };
        work.keep(&[0], |texture| texture == *first);
        while work.is_making() {
            assert!(begun.elapsed() < Duration::from_secs(240), "levels of one channel are not made");
            thread::sleep(Duration::from_millis(5));
        }
        assert!(!made.has_levels_to_make() && gone.has_levels_to_make());
        work.keep(&[], |_| false);
        assert!(work.sources.is_empty() && work.take_faults().is_empty());
    }
}
