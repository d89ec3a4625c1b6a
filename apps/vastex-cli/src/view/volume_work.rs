//! What a volume in the window needs read: channels at times, levels that are made, and values at places. All
//! of it on threads, so that the window never waits.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;

use anyhow::{Context, Error, Result};
use vastex::{Preparer, Region};
use vastex_viewer::volume_scene::{PointAsked, PointTold, VolumeLook};
use vastex_volume::VolumeSource;
use winit::window::Window;

use crate::volumes::{
    LabelsBelow, OpenedVolume, ReadChannel, ReadLabels, point, read_channel, read_labels, usual_range,
};

/// Channels that are read at once.
const AT_ONCE: usize = 2;

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
    Point(Result<PointTold>, u64),
    Range {
        channel: usize,
        range: Result<[f64; 2]>,
    },
    /// Tiles of levels that are made were a preview, and are not any more.
    Changed {
        channel: usize,
        time: u64,
        regions: Vec<Region>,
    },
    /// A part of what levels are made of cannot be read.
    Fault(Error),
}

/// Threads that read a volume, and what they have read.
pub(super) struct VolumeWork {
    opened: Arc<OpenedVolume>,
    window: Arc<Window>,
    sender: Sender<Done>,
    receiver: Receiver<Done>,
    /// What waits to be read, the last first, and how many threads read.
    queue: Arc<Mutex<Queue>>,
    stop: Arc<AtomicBool>,
    /// The channels that were read, with their times.
    sources: Vec<((usize, u64), Arc<VolumeSource>)>,
    /// And the labels.
    labels: Vec<((usize, u64), LabelsBelow)>,
}

#[derive(Default)]
struct Queue {
    waiting: Vec<(usize, u64)>,
    reading: usize,
}

impl VolumeWork {
    pub(super) fn new(opened: OpenedVolume, window: Arc<Window>) -> VolumeWork {
        let (sender, receiver) = channel();
        VolumeWork {
            opened: Arc::new(opened),
            window,
            sender,
            receiver,
            queue: Arc::default(),
            stop: Arc::default(),
            sources: Vec::new(),
            labels: Vec::new(),
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
        let (opened, sender, window, stop) =
            (self.opened.clone(), self.sender.clone(), self.window.clone(), self.stop.clone());
        let read = move || {
            loop {
                let next = {
                    let mut queue = queue.lock().unwrap_or_else(PoisonError::into_inner);
                    let next = queue.waiting.pop().filter(|_| !stop.load(Ordering::Relaxed));
                    queue.reading -= usize::from(next.is_none());
                    next
                };
                let Some((channel, time)) = next else { return };
                let read = read_channel(&opened.volume, (channel, time), &preparer);
                let made = read.as_ref().ok().map(|read| read.source.clone());
                drop(sender.send(Done::Channel { channel, time, read: read.map(Box::new) }));
                window.request_redraw();
                if let Some(source) = made.filter(|source| source.has_levels_to_make()) {
                    make_levels(&source, (channel, time), &sender, (&window, &stop));
                }
            }
        };
        spawn("vastex-channel", read)
    }

    /// Begins to read labels at a time.
    pub(super) fn read_labels(&self, (nth, time): (usize, u64), preparer: Preparer) -> Result<()> {
        let name = self.opened.facts.labels.get(nth).cloned().unwrap_or_default();
        let (opened, sender, window) = (self.opened.clone(), self.sender.clone(), self.window.clone());
        spawn("vastex-labels", move || {
            let read = read_labels(&opened, (&name, time), &preparer);
            drop(sender.send(Done::Labels { nth, time, read: read.map(Box::new) }));
            window.request_redraw();
        })
    }

    /// Begins to find out what lies at a place.
    pub(super) fn ask(&self, asked: PointAsked, look: &VolumeLook) -> Result<()> {
        let of_time = self.sources.iter().filter(|((_, time), _)| *time == asked.time);
        let shown: Vec<usize> = look.shown().collect();
        let mut sources: Vec<_> = of_time.map(|((channel, _), source)| (*channel, source.clone())).collect();
        sources.retain(|(channel, _)| shown.contains(channel));
        sources.sort_by_key(|(channel, _)| *channel);
        let (opened, look, sender, window) =
            (self.opened.clone(), look.clone(), self.sender.clone(), self.window.clone());
        let is_shown = |(of, _): &&((usize, u64), LabelsBelow)| Some(of.0) == look.labels.shown;
        let labels = self.labels.iter().filter(is_shown).find(|((_, time), _)| *time == asked.time);
        let labels = labels.map(|(_, labels)| labels.clone());
        spawn("vastex-value", move || {
            let told = point(&opened.facts, &look, (&sources, labels.as_ref()), &asked);
            drop(sender.send(Done::Point(told, asked.number)));
            window.request_redraw();
        })
    }

    /// Begins to find the usual ranges of channels.
    pub(super) fn find_ranges(&self, channels: &[usize]) -> Result<()> {
        let is_asked = |channel: &usize| channels.contains(channel);
        let mut sources: Vec<_> =
            self.sources.iter().map(|((channel, _), source)| (*channel, source.clone())).collect();
        sources.retain(|(channel, _)| is_asked(channel));
        sources.dedup_by_key(|(channel, _)| *channel);
        let (sender, window) = (self.sender.clone(), self.window.clone());
        spawn("vastex-range", move || {
            for (channel, source) in sources {
                drop(sender.send(Done::Range { channel, range: usual_range(&source, channel) }));
            }
            window.request_redraw();
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

    /// Only these times are seen any more.
    pub(super) fn keep_times(&mut self, times: [u64; 2]) {
        self.sources.retain(|((_, time), _)| times.contains(time));
        self.labels.retain(|((_, time), _)| times.contains(time));
    }
}

impl Drop for VolumeWork {
    /// What is being read is broken off where that is possible. Nobody waits for it.
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
    }
}

/// Makes the levels that are not stored, and tells of what is no preview any more.
fn make_levels(
    source: &Arc<VolumeSource>,
    (channel, time): (usize, u64),
    sender: &Sender<Done>,
    (window, stop): (&Arc<Window>, &Arc<AtomicBool>),
) {
    let told = |regions: Vec<Region>| {
        if !regions.is_empty() {
            drop(sender.send(Done::Changed { channel, time, regions }));
            window.request_redraw();
        }
    };
    thread::scope(|scope| {
        let made = scope.spawn(|| source.make_levels(stop));
        while !made.is_finished() {
            thread::sleep(std::time::Duration::from_millis(200));
            told(source.take_changes());
        }
    });
    told(source.take_changes());
    for fault in source.faults().into_iter().take(4) {
        drop(sender.send(Done::Fault(fault.into())));
    }
}

fn spawn(name: &str, work: impl FnOnce() + Send + 'static) -> Result<()> {
    let thread = thread::Builder::new().name(name.into()).spawn(work);
    thread.map(drop).context("no thread can be started to read the volume")
}
