//! Work on a volume: who is read and made when, by how many threads.

use std::time::{Duration, Instant};

use vastex::{Settings, Textures};
use vastex_scenes::headless_gpu;

use super::*;
use crate::volumes::{OpenHow, open_volume};

/// Four channels, each of one level that is larger than what is made at opening.
fn large(directory: &Path) -> OpenedVolume {
    let path = directory.join("large.raw");
    let file = std::fs::File::create(&path).unwrap();
    // Nothing is written of it: the file has holes.
    file.set_len(4 * 420 * 410 * 400).unwrap();
    let about = "width = 420\nheight = 410\ndepth = 400\nsample = \"u8\"\nchannels = 4\norder = \"planar\"\n";
    std::fs::write(directory.join("large.raw.toml"), about).unwrap();
    open_volume(&path, OpenHow::default()).unwrap()
}

/// Work of a volume whose levels are to be made, with textures that show it.
struct Host {
    work: VolumeWork,
    textures: Textures,
    begun: Instant,
    _directory: tempfile::TempDir,
}

impl Host {
    fn new() -> Host {
        let directory = tempfile::tempdir().unwrap();
        let gpu = headless_gpu().unwrap();
        let textures = Textures::new(&gpu.device, &gpu.queue, Settings::default()).unwrap();
        let work = VolumeWork::new(large(directory.path()), Arc::new(|| {}));
        Host { work, textures, begun: Instant::now(), _directory: directory }
    }

    fn rest(&self, what: &str) {
        assert!(self.begun.elapsed() < Duration::from_secs(240), "{what}");
        thread::sleep(Duration::from_millis(2));
    }

    /// The channels that were read since this was asked last.
    fn read(&mut self) -> Vec<(usize, ReadChannel)> {
        let mut read = Vec::new();
        for done in self.work.take_done() {
            match done {
                Done::Channel { channel, read: Ok(one), .. } => read.push((channel, *one)),
                Done::Values { values: Ok(Some(_)), .. } => {}
                _ => panic!("a channel cannot be read"),
            }
        }
        read
    }

    fn show(&mut self, read: ReadChannel) -> (TextureId, Arc<VolumeSource>) {
        let texture = self.textures.add(read.prepared).unwrap_or_else(|refused| panic!("{}", refused.error));
        self.work.make_levels(texture, read.source.clone()).unwrap();
        (texture, read.source)
    }
}

#[test]
fn channels_are_read_while_levels_are_made_and_those_that_are_gone_are_made_no_more() {
    let mut host = Host::new();
    for channel in 0..4 {
        host.work.read((channel, 0), host.textures.preparer()).unwrap();
    }
    let mut shown = Vec::new();
    while shown.len() < 4 {
        for (_, read) in host.read() {
            // Whoever reads makes none, and waits for none that are made for those before.
            assert!(read.source.has_levels_to_make());
            shown.push(host.show(read));
            assert!(shown.iter().any(|(_, source)| source.has_levels_to_make()) && host.work.is_making());
        }
        host.rest("channels are not read");
    }
    let [(first, made), .., (_, gone)] = &shown[..] else { panic!("four") };
    let first = *first;
    host.work.keep(&[0], 0, |texture| texture == first);
    // The last one has just come: on a very busy machine alone all of its levels are made by now.
    let lacks = gone.has_levels_to_make();
    while host.work.is_making() {
        host.work.changes();
        host.rest("levels of one channel are not made");
    }
    assert!(!made.has_levels_to_make());
    assert_eq!(gone.has_levels_to_make(), lacks, "nothing more is made of what is gone");
    host.work.keep(&[], 0, |_| false);
    assert!(host.work.sources.is_empty() && host.work.take_faults().is_empty());
}

#[test]
fn ranges_are_those_of_the_time_that_is_seen() {
    let mut host = Host::new();
    for channel in [1, 0] {
        host.work.read((channel, 0), host.textures.preparer()).unwrap();
    }
    while host.work.sources.len() < 2 {
        host.read();
        host.rest("channels are not read");
    }
    let source = |host: &Host, of| host.work.sources.iter().find(|(is, _)| *is == of).unwrap().1.clone();
    let (zero, one) = (source(&host, (0, 0)), source(&host, (1, 0)));
    // Times ahead between those that are seen, in any order.
    host.work.sources = vec![
        ((0, 1), one.clone()),
        ((1, 0), one.clone()),
        ((0, 0), zero.clone()),
        ((0, 2), one.clone()),
        ((2, 0), one.clone()),
    ];
    let found = host.work.sources_at(&[0, 1], 0);
    assert_eq!(found.iter().map(|(channel, _)| *channel).collect::<Vec<_>>(), [1, 0]);
    assert!(Arc::ptr_eq(&found[0].1, &one) && Arc::ptr_eq(&found[1].1, &zero));
}

#[test]
fn a_reader_that_fails_is_counted_no_more() {
    let queue: Arc<Mutex<Queue>> = Arc::default();
    lock(&queue).reading = 1;
    let mut reader = Reader { queue: queue.clone(), counts: true };
    let failed = thread::spawn(move || {
        drop(reader.next(&AtomicBool::new(true)));
        reader.counts = true;
        lock(&reader.queue).reading += 1;
        panic!("a codec")
    });
    assert!(failed.join().is_err());
    assert_eq!(lock(&queue).reading, 0);
}

#[test]
fn many_times_are_read_by_few_threads_and_those_that_are_passed_are_not() {
    let host = Host::new();
    for time in 1..60 {
        host.work.read_labels((0, time), host.textures.preparer()).unwrap();
        host.work.read((0, time), host.textures.preparer()).unwrap();
    }
    let mut work = host.work;
    assert!(lock(&work.queue).reading <= AT_ONCE);
    work.keep(&[], 0, |_| false);
    assert!(lock(&work.queue).waiting.is_empty());
}
