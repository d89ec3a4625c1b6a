//! Work on a volume: who is read and made when, by how many threads.

use std::time::{Duration, Instant};

use vastex::{Pace, Settings, Textures};
use vastex_scenes::headless_gpu;
use vastex_viewer::volume_scene::{VolumeAsked, VolumeLayout, VolumePane, VolumePictures, VolumeScene};

use super::*;
use crate::volumes::{OpenHow, open_volume};

/// Four channels, each of one level that is larger than what is made at opening; levels are kept in `cache`.
fn large(directory: &Path, cache: Option<&str>) -> OpenedVolume {
    let path = directory.join("large.raw");
    let file = std::fs::File::create(&path).unwrap();
    // Nothing is written of it: the file has holes.
    file.set_len(4 * 420 * 410 * 400).unwrap();
    let about = "width = 420\nheight = 410\ndepth = 400\nsample = \"u8\"\nchannels = 4\norder = \"planar\"\n";
    std::fs::write(directory.join("large.raw.toml"), about).unwrap();
    let mut how = OpenHow::default();
    how.cache = cache.map(|cache| directory.join(cache));
    open_volume(&path, how).unwrap()
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
        let work = VolumeWork::new(large(directory.path(), Some("kept")), Arc::new(|| {}));
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
    loop {
        for (_, read) in host.read() {
            // Whoever reads makes none.
            assert!(read.source.has_levels_to_make());
            shown.push(host.show(read));
        }
        if shown.len() == 4 {
            break;
        }
        host.rest("channels are not read");
    }
    let [(first, made), .., (_, gone)] = &shown[..] else { panic!("four") };
    let first = *first;
    host.work.keep(&[0], 0, |texture| texture == first);
    let done = |source: &VolumeSource| source.level_states().iter().find_map(|of| of.made).unwrap().done;
    // The last one has just come: hardly anything of it is made.
    let before = done(gone);
    while host.work.is_making() {
        host.work.changes();
        host.rest("levels of one channel are not made");
    }
    assert!(!made.has_levels_to_make());
    // A brick that was begun may be made to its end.
    assert!(done(gone) <= before + 1, "{} after {before}", done(gone));
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

/// Where levels are not kept, only those bricks of them are made that are seen: a few for a part of a slice.
#[test]
fn of_levels_that_are_not_kept_what_is_seen_is_made() {
    let directory = tempfile::tempdir().unwrap();
    let gpu = headless_gpu().unwrap();
    let path = directory.path().join("huge.raw");
    std::fs::File::create(&path).unwrap().set_len(1300 * 1300 * 1300).unwrap();
    let about = "width = 1300\nheight = 1300\ndepth = 1300\nsample = \"u8\"\n";
    std::fs::write(directory.path().join("huge.raw.toml"), about).unwrap();
    let opened = open_volume(&path, OpenHow::default().live()).unwrap();
    let settings = Settings {
        pace: Pace::LockStep { latency_frames: 1 },
        upload_bytes_per_frame: 64 << 20,
        picture: [60, 60],
        ..Settings::default()
    };
    let clock = Arc::new(|| Duration::ZERO);
    let mut scene = VolumeScene::new(&gpu, opened.facts.clone(), settings, clock).unwrap();
    let mut work = VolumeWork::new(opened, Arc::new(|| {}));
    // A pixel is two to three voxels.
    (scene.look.layout, scene.look.zoom) = (VolumeLayout::One(VolumePane::Z), 9.0);
    let begun = Instant::now();
    let mut play = |scene: &mut VolumeScene| {
        let mut quiet = 0;
        while quiet < 3 {
            assert!(begun.elapsed() < Duration::from_secs(240), "{:?}", scene.textures().stats());
            for asked in scene.take_asked() {
                if let VolumeAsked::Channel { channel, time } = asked {
                    work.read((channel, time), scene.preparer()).unwrap();
                }
            }
            for done in work.take_done() {
                if let Done::Channel { channel, time, read: Ok(read) } = done {
                    let texture = scene.add((channel, time), read.prepared, read.usual).unwrap().unwrap();
                    work.make_levels(texture, read.source).unwrap();
                }
            }
            work.want_levels(scene.textures(), scene.has_all());
            let changes = work.changes();
            scene.changed(&changes);
            scene.frame([60, 60], VolumePictures::None).unwrap();
            let is_quiet = scene.has_all() && changes.is_empty() && !work.is_making();
            quiet = if is_quiet { quiet + 1 } else { 0 };
        }
        work.levels.progress()
    };
    let part = play(&mut scene);
    assert!(part.total == 1331 && (1..=100).contains(&part.done), "{part:?}");
    // What is seen beside that is made when it is.
    scene.look.centre.x += 400.0;
    let more = play(&mut scene);
    assert!(more.done > part.done && more.done <= 200, "{more:?} after {part:?}");
}
