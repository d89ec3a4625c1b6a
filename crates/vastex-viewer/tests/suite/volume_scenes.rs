//! A volume in a window, without the window: what is drawn of it, when, and what stays meanwhile.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use glam::DVec2;
use vastex::source::{Codec, ReadError, ReadFuture, Tile};
use vastex::{
    Description, Geometry, GeometrySpec, Layer, LayerFormat, Pace, PagePos, PoolSettings, PoolTuning,
    Settings, StoredLevel, TextureSettings, TileSource, VoxelLevels,
};
use vastex_viewer::Gpu;
use vastex_viewer::input::{InputEvent, Key};
use vastex_viewer::stage::{Clock, TextureRead};
use vastex_viewer::volume::{LabelColors, OtherLabels, VolumeBox};
use vastex_viewer::volume_scene::{
    ChannelFacts, LabelsPlace, PaneRect, PointAnswer, PointPlace, VolumeAsked, VolumeFacts, VolumeHeard,
    VolumeLayout, VolumeOrbit, VolumePane, VolumePictures, VolumeScene,
};

const SIZE: [u32; 3] = [40, 32, 24];
/// Frames after which everything must be there.
const PATIENCE: usize = 1500;

/// Voxels of one value, each level the same; counts what is read of it.
pub(crate) struct Even {
    description: Arc<Description>,
    /// Of a texel.
    bytes: Vec<u8>,
    reads: AtomicU64,
}

impl TileSource for Even {
    fn description(&self) -> &Arc<Description> {
        &self.description
    }

    fn read(&self, pos: PagePos) -> ReadFuture<'_> {
        self.reads.fetch_add(1, Ordering::Relaxed);
        let texels = self.description.tile_bytes() / self.bytes.len();
        let bytes = self.bytes.repeat(texels);
        let is_there = self.description.geometry.contains(pos);
        Box::pin(async move {
            match is_there {
                true => Ok(Tile { codec: Codec::Raw, bytes: bytes.into() }),
                false => Err(ReadError::NoSuchTile { pos }),
            }
        })
    }
}

/// What is known of an even volume.
pub(crate) fn facts(channels: usize, times: u64) -> VolumeFacts {
    let level = StoredLevel { size: SIZE.map(u64::from), scale: [1.0; 3], origin: [0.0; 3] };
    let (_, levels) = VoxelLevels::new(&[level], 16, 1).unwrap();
    VolumeFacts {
        name: "even".into(),
        of: VolumeBox::new(SIZE, [1.0; 3]),
        origin: [0.0; 3],
        unit_length: 1.0,
        unit: None,
        channels: vec![ChannelFacts { color: Some([255; 3]), ..ChannelFacts::default() }; channels],
        labels: vec!["things".into(), "parts".into()],
        label_bounds: vec![[0, i128::from(u32::MAX)]; 2],
        times,
        base: 0.0,
        gain: 255.0,
        bounds: Some([0.0, 255.0]),
        downsample: None,
        made_by: None,
        brick: 16,
        levels: Some(Arc::new(levels)),
    }
}

pub(crate) fn settings(pace: Pace) -> Settings {
    let default_pool = PoolTuning { bytes: Some(8 << 20), ..PoolTuning::default() };
    let pools = PoolSettings { default_pool, ..PoolSettings::default() };
    Settings { pools, pace, whole_bytes: 0, ..Settings::default() }
}

/// The voxels of a channel at a time: `40 * (channel + 1) + time`.
pub(crate) fn even(of: (usize, u64)) -> Arc<Even> {
    even_in_bricks_of(16, of)
}

/// The same in bricks of so many voxels along an axis.
pub(crate) fn even_in_bricks_of(page: u32, (channel, time): (usize, u64)) -> Arc<Even> {
    let spec = GeometrySpec { page, border: 1, ..GeometrySpec::volume(SIZE) };
    let description = Description::one_layer(Geometry::new(spec).unwrap(), LayerFormat::R8);
    let value = (40 * (channel as u64 + 1) + time) as u8;
    Arc::new(Even { description: Arc::new(description), bytes: vec![value], reads: AtomicU64::new(0) })
}

/// A scene, and who reads its channels: the value of one at a time is `40 * (channel + 1) + time`.
pub(crate) struct Host {
    pub(crate) gpu: Gpu,
    pub(crate) scene: VolumeScene,
    sources: Vec<((usize, u64), Arc<Even>)>,
    /// Channels that are not read, until they are.
    pub(crate) held: Vec<(usize, u64)>,
    pub(crate) holds: bool,
    /// Times that have no labels.
    pub(crate) bare: Vec<u64>,
}

impl Host {
    fn new(channels: usize, times: u64, pace: Pace) -> Host {
        let begun = std::time::Instant::now();
        Host::with_clock(channels, times, pace, Arc::new(move || begun.elapsed()))
    }

    pub(crate) fn with_clock(channels: usize, times: u64, pace: Pace, clock: Clock) -> Host {
        let gpu = pollster::block_on(Gpu::headless()).unwrap();
        let scene = VolumeScene::new(&gpu, facts(channels, times), settings(pace), clock).unwrap();
        Host { gpu, scene, sources: Vec::new(), held: Vec::new(), holds: false, bare: Vec::new() }
    }

    pub(crate) fn lockstep(channels: usize, times: u64) -> Host {
        Host::new(channels, times, Pace::LockStep { latency_frames: 1 })
    }

    pub(crate) fn read(&mut self, (channel, time): (usize, u64)) {
        let source = even((channel, time));
        let preparer = self.scene.preparer();
        let prepared = preparer.read_blocking(source.clone(), TextureSettings::default()).unwrap();
        self.scene.add((channel, time), prepared, [0.0, 255.0]).unwrap();
        self.sources.push(((channel, time), source));
    }

    /// Every voxel is of the label 5.
    fn read_labels(&mut self, (nth, time): (usize, u64)) {
        let spec = GeometrySpec { page: 16, border: 1, ..GeometrySpec::volume(SIZE) };
        let layer = Layer { is_mixable: false, ..Layer::new("labels", LayerFormat::R32Uint) };
        let description = Arc::new(Description::new(Geometry::new(spec).unwrap(), vec![layer]));
        let source = Arc::new(Even { description, bytes: vec![5, 0, 0, 0], reads: AtomicU64::new(0) });
        let prepared = self.scene.preparer().read_blocking(source, TextureSettings::default()).unwrap();
        let colors = Arc::new(LabelColors::new([(5, [250, 0, 0, 255])]));
        let place = LabelsPlace {
            of: self.scene.facts().of,
            begin: [0.0; 3],
            colors,
            bounds: [0, i128::from(u32::MAX)],
            levels: None,
        };
        self.scene.add_labels((nth, time), prepared, place).unwrap();
    }

    pub(crate) fn frame(&mut self, pictures: VolumePictures) {
        for asked in self.scene.take_asked() {
            match asked {
                VolumeAsked::Channel { channel, time } if self.holds => self.held.push((channel, time)),
                VolumeAsked::Channel { channel, time } => self.read((channel, time)),
                VolumeAsked::Labels { nth, time } if self.bare.contains(&time) => {
                    self.scene.refuse_labels(nth, time);
                }
                VolumeAsked::Labels { nth, time } => self.read_labels((nth, time)),
                VolumeAsked::Point(_) | VolumeAsked::Ranges(_) | VolumeAsked::Label { .. } => {}
            }
        }
        self.scene.frame([128, 96], pictures).unwrap();
        assert_eq!(self.scene.take_faults(), Vec::<String>::new());
    }

    /// Draws until nothing is due any more.
    pub(crate) fn settle(&mut self, pictures: VolumePictures) {
        for _ in 0..PATIENCE {
            self.frame(pictures);
            if self.scene.is_settled() {
                return;
            }
            if pictures == VolumePictures::Parts {
                let timeout = Some(Duration::from_secs(60));
                self.gpu.device.poll(wgpu::PollType::Wait { submission_index: None, timeout }).unwrap();
            }
        }
        panic!("not settled: {:?}", self.scene.share_at_wanted());
    }

    /// The picture of a pane.
    pub(crate) fn picture(&self, pane: VolumePane) -> (PaneRect, Vec<[u8; 4]>) {
        let pictures = self.scene.pictures();
        let (rect, view) = pictures.iter().find(|(rect, _)| rect.pane == pane).unwrap();
        let encoder = self.gpu.device.create_command_encoder(&Default::default());
        let read = TextureRead::submit(&self.gpu, encoder, view.texture(), 4);
        let timeout = Some(Duration::from_secs(60));
        self.gpu.device.poll(wgpu::PollType::Wait { submission_index: None, timeout }).unwrap();
        let bytes = read.take().unwrap().unwrap();
        (*rect, bytes.chunks_exact(4).map(|p| [p[0], p[1], p[2], p[3]]).collect())
    }

    /// What is seen at a pixel in the middle of a pane.
    pub(crate) fn middle(&self, pane: VolumePane) -> u8 {
        let (rect, pixels) = self.picture(pane);
        let [width, height] = rect.size.map(|side| side as usize);
        assert_eq!(pixels.len(), width * height, "the whole picture");
        pixels[height / 2 * width + width / 2][0]
    }
}

#[test]
fn four_pictures_show_the_volume_and_nothing_is_due_once_they_do() {
    let mut host = Host::lockstep(1, 1);
    host.settle(VolumePictures::Whole);
    for pane in VolumePane::ALL {
        assert_eq!(host.middle(pane), 40, "{pane:?}");
        let (_, pixels) = host.picture(pane);
        assert_eq!(pixels[0], [0, 0, 0, 255], "around {pane:?}");
    }
    let (painted, frames) = (host.scene.painted(), host.scene.textures().stats().frame);
    let read = host.sources[0].1.reads.load(Ordering::Relaxed);
    for _ in 0..5 {
        host.frame(VolumePictures::Whole);
        assert!(host.scene.is_settled() && host.scene.painted() == painted);
    }
    assert_eq!(host.sources[0].1.reads.load(Ordering::Relaxed), read, "nothing is read again");
    assert!(host.scene.textures().stats().frame > frames);
}

#[test]
fn pictures_in_parts_become_those_that_are_drawn_whole() {
    let mut whole = Host::lockstep(2, 1);
    whole.settle(VolumePictures::Whole);
    let mut parts = Host::new(2, 1, Pace::Realtime);
    parts.settle(VolumePictures::Parts);
    for pane in VolumePane::ALL {
        assert!(parts.picture(pane) == whole.picture(pane), "{pane:?}");
    }
    // Turned while it is drawn: another picture, and whole in the end.
    let turned = VolumeOrbit { yaw: 80.0, ..whole.scene.look.orbit };
    (whole.scene.look.orbit, parts.scene.look.orbit) = (turned, turned);
    parts.frame(VolumePictures::Parts);
    assert!(!parts.scene.is_settled());
    whole.settle(VolumePictures::Whole);
    parts.settle(VolumePictures::Parts);
    assert!(parts.picture(VolumePane::Space) == whole.picture(VolumePane::Space));
}

#[test]
fn what_is_cut_away_is_not_seen_in_3d_and_is_in_slices() {
    let mut host = Host::lockstep(1, 1);
    host.settle(VolumePictures::Whole);
    let seen = |host: &Host| host.picture(VolumePane::Space).1.iter().filter(|p| p[0] > 20).count();
    let all = seen(&host);
    host.scene.look.clip.shares[2] = [0.0, 0.25];
    host.settle(VolumePictures::Whole);
    let part = seen(&host);
    assert!(part > 50 && part * 10 < all * 9, "{part} of {all}");
    assert_eq!(host.middle(VolumePane::Z), 40);
    host.scene.look.clip.shares[2] = [0.0, 1.0];
    host.scene.look.clip.has_plane = true;
    host.scene.look.clip.plane_depth = 0.75;
    host.settle(VolumePictures::Whole);
    let part = seen(&host);
    assert!(part > 50 && part * 10 < all * 9, "{part} of {all}");
    host.scene.look.clip.plane_depth = 1.0;
    host.settle(VolumePictures::Whole);
    assert_eq!(seen(&host), 0);
    host.scene.look.clip.plane_depth = 0.0;
    host.settle(VolumePictures::Whole);
    assert_eq!(seen(&host), all);
}

#[test]
fn hidden_channels_are_not_read_and_shown_ones_add_up() {
    let mut host = Host::lockstep(6, 1);
    host.settle(VolumePictures::Whole);
    let mut read: Vec<usize> = host.sources.iter().map(|((channel, _), _)| *channel).collect();
    read.sort_unstable();
    assert_eq!(read, [0, 1, 2, 3], "four are shown at first");
    host.scene.look.channels.iter_mut().for_each(|channel| channel.is_shown = false);
    host.settle(VolumePictures::Whole);
    assert_eq!(host.middle(VolumePane::Z), 0, "none");
    host.scene.look.channels[4].is_shown = true;
    host.settle(VolumePictures::Whole);
    assert_eq!(host.middle(VolumePane::Z), 200, "the fifth alone");
    assert_eq!(host.sources.len(), 5);
}

#[test]
fn labels_lie_over_the_channels_while_they_are_shown() {
    let mut host = Host::lockstep(1, 2);
    host.settle(VolumePictures::Whole);
    let middle = |host: &Host| {
        let (rect, pixels) = host.picture(VolumePane::Z);
        pixels[(rect.size[1] / 2 * rect.size[0] + rect.size[0] / 2) as usize]
    };
    assert_eq!(middle(&host), [40, 40, 40, 255]);
    host.scene.on_event(InputEvent::Key { key: Key::Char('l'), is_pressed: true, is_repeat: false });
    host.scene.look.labels.opacity = 1.0;
    host.settle(VolumePictures::Whole);
    assert_eq!(middle(&host), [250, 0, 0, 255]);
    // At another time they are there, too, and a channel less is another text.
    host.scene.look.time = 1;
    host.settle(VolumePictures::Whole);
    assert_eq!((host.scene.seen_time(), middle(&host)), (1, [250, 0, 0, 255]));
    host.scene.look.channels[0].is_shown = false;
    host.settle(VolumePictures::Whole);
    assert_eq!(middle(&host), [250, 0, 0, 255]);
    host.scene.look.channels[0].is_shown = true;
    host.scene.look.labels.shown = None;
    host.settle(VolumePictures::Whole);
    assert_eq!(middle(&host), [41, 41, 41, 255]);
}

#[test]
fn a_click_selects_a_label_and_escape_or_a_click_on_nothing_clears_it() {
    let mut host = Host::lockstep(1, 1);
    host.scene.look.labels.shown = Some(0);
    host.scene.look.layout = VolumeLayout::One(VolumePane::Z);
    host.settle(VolumePictures::Whole);
    // Half of red over 40.
    let dimmed = host.middle(VolumePane::Z);
    assert!((150..220).contains(&dimmed), "{dimmed}");
    let press = |is_pressed| InputEvent::Button { button: vastex_viewer::input::Button::Primary, is_pressed };
    let answer = |host: &mut Host, label| {
        let asked = host.scene.take_asked();
        let [VolumeAsked::Point(asked)] = asked[..] else { panic!("{asked:?}") };
        let PointPlace::At(place) = asked.place else { panic!("{asked:?}") };
        let (place, values) = (Some(place), Vec::new());
        host.scene.report(PointAnswer { number: asked.number, place, voxel: [20, 16, 12], values, label });
    };
    let click = |host: &mut Host, label: Option<i128>| {
        host.scene.on_event(InputEvent::PointerMoved(DVec2::new(64.0, 48.0)));
        host.scene.on_event(press(true));
        host.scene.on_event(press(false));
        while host.scene.is_asking() {
            answer(host, label);
        }
    };
    click(&mut host, Some(5));
    assert_eq!(host.scene.look.labels.selected, Some(5));
    host.settle(VolumePictures::Whole);
    assert_eq!(host.middle(VolumePane::Z), 250, "in full");
    // Another one: what is there is dimmed to a quarter, or hidden.
    host.scene.look.labels.selected = Some(6);
    host.settle(VolumePictures::Whole);
    let others = host.middle(VolumePane::Z);
    assert!((41..dimmed).contains(&others), "{others}");
    host.scene.look.labels.others = OtherLabels::Hidden;
    host.settle(VolumePictures::Whole);
    assert_eq!(host.middle(VolumePane::Z), 40);
    let escape = InputEvent::Key { key: Key::Escape, is_pressed: true, is_repeat: false };
    assert_eq!(host.scene.on_event(escape), VolumeHeard::Taken);
    assert_eq!(host.scene.look.labels.selected, None);
    assert_eq!(host.scene.on_event(escape), VolumeHeard::Other, "it ends the program");
    click(&mut host, Some(5));
    click(&mut host, None);
    assert_eq!(host.scene.look.labels.selected, None);
}

#[test]
fn a_time_stays_until_the_next_one_is_there() {
    let mut host = Host::lockstep(1, 3);
    host.settle(VolumePictures::Whole);
    host.holds = true;
    host.scene.on_event(InputEvent::Key { key: Key::Char('.'), is_pressed: true, is_repeat: false });
    for _ in 0..30 {
        host.frame(VolumePictures::Whole);
        assert_eq!((host.scene.seen_time(), host.middle(VolumePane::Z)), (0, 40), "never black");
    }
    assert!(!host.scene.is_settled());
    assert_eq!(host.held, [(0, 1)], "asked for once");
    host.holds = false;
    host.read((0, 1));
    host.settle(VolumePictures::Whole);
    assert_eq!((host.scene.seen_time(), host.middle(VolumePane::Z)), (1, 41));
    // A time that nobody waits for any more is given up.
    host.holds = true;
    host.scene.look.time = 0;
    host.frame(VolumePictures::Whole);
    host.scene.look.time = 1;
    host.settle(VolumePictures::Whole);
    assert_eq!((host.scene.seen_time(), host.middle(VolumePane::Z)), (1, 41));
}

#[test]
fn a_time_whose_bricks_were_prefetched_is_drawn_without_a_wait() {
    let mut host = Host::lockstep(2, 6);
    host.settle(VolumePictures::Whole);
    assert!(host.sources.iter().all(|((_, time), _)| *time == 0), "nobody has gone on in time");
    let step = |host: &mut Host, key: char| {
        host.scene.on_event(InputEvent::Key { key: Key::Char(key), is_pressed: true, is_repeat: false });
    };
    step(&mut host, '.');
    host.settle(VolumePictures::Whole);
    let reads = |host: &Host, of: u64| -> u64 {
        let of_time = host.sources.iter().filter(|((_, time), _)| *time == of);
        of_time.map(|(_, source)| source.reads.load(Ordering::Relaxed)).sum()
    };
    // The same bricks as of the time that is seen, while nothing else is due and no picture is drawn anew.
    let painted = host.scene.painted();
    for _ in 0..PATIENCE {
        if host.scene.times_ready() == [2] {
            break;
        }
        host.frame(VolumePictures::Whole);
        assert!(host.scene.is_settled() && host.scene.painted() == painted);
    }
    assert_eq!((host.scene.times_ready(), host.scene.is_due()), (vec![2], false));
    let before = reads(&host, 2);
    assert_eq!(before, reads(&host, 1));
    step(&mut host, '.');
    host.frame(VolumePictures::Whole);
    // Two channels of white, whose light adds up.
    let seen = host.middle(VolumePane::Z);
    assert_eq!((host.scene.seen_time(), host.scene.times_kept().len()), (2, 3), "at once, and the next one");
    host.settle(VolumePictures::Whole);
    assert_eq!((host.middle(VolumePane::Z), reads(&host, 2)), (seen, before), "nothing was missing");
    // What is wanted of another view is prefetched anew; a time that is no more ahead goes.
    host.scene.look.orbit.yaw += 90.0;
    host.frame(VolumePictures::Whole);
    assert_eq!(host.scene.times_ready(), [0; 0]);
    step(&mut host, ',');
    host.settle(VolumePictures::Whole);
    for _ in 0..PATIENCE {
        if host.scene.times_ready() == [0] {
            break;
        }
        host.frame(VolumePictures::Whole);
    }
    assert_eq!((host.scene.seen_time(), host.scene.times_ready()), (1, vec![0]), "the way that time goes");
}

#[test]
fn played_times_that_are_ready_are_seen_at_once() {
    // A clock that goes with the frames, so that nothing depends on how fast the machine is.
    let asked = AtomicU64::new(0);
    let clock = Arc::new(move || Duration::from_millis(3 * asked.fetch_add(1, Ordering::Relaxed)));
    let mut host = Host::with_clock(1, 6, Pace::LockStep { latency_frames: 1 }, clock);
    host.settle(VolumePictures::Whole);
    host.scene.play(true);
    let (mut seen_at_once, mut most_ready) = (0, 0);
    for _ in 0..PATIENCE {
        let (before, ready) = (host.scene.look.time, host.scene.times_ready());
        most_ready = most_ready.max(ready.len());
        host.frame(VolumePictures::Whole);
        let wanted = host.scene.look.time;
        if wanted != before && ready.contains(&wanted) {
            assert_eq!(host.scene.seen_time(), wanted, "without a frame between");
            assert_eq!(u64::from(host.middle(VolumePane::Z)), 40 + wanted);
            seen_at_once += 1;
        }
        if seen_at_once == 5 {
            break;
        }
    }
    assert_eq!((seen_at_once, most_ready), (5, 2));
}

#[test]
fn times_are_played_one_after_the_other() {
    let mut host = Host::new(1, 3, Pace::Realtime);
    host.settle(VolumePictures::Whole);
    host.scene.play(true);
    let mut seen = vec![host.scene.seen_time()];
    for _ in 0..PATIENCE {
        host.frame(VolumePictures::Whole);
        if seen.last() != Some(&host.scene.seen_time()) {
            seen.push(host.scene.seen_time());
        }
        if seen.len() == 5 {
            break;
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    assert_eq!(seen, [0, 1, 2, 0, 1]);
}

#[test]
fn a_click_asks_for_a_place_and_a_layout_for_its_pictures_alone() {
    let mut host = Host::lockstep(1, 1);
    host.settle(VolumePictures::Whole);
    let rect = host.scene.panes()[0];
    let middle = DVec2::from_array([0, 1].map(|axis| f64::from(rect.at[axis] + rect.size[axis] / 2)));
    host.scene.on_event(InputEvent::PointerMoved(middle));
    let press = |is_pressed| InputEvent::Button { button: vastex_viewer::input::Button::Primary, is_pressed };
    host.scene.on_event(press(true));
    host.scene.on_event(press(false));
    let asked = host.scene.take_asked();
    assert!(matches!(asked[..], [VolumeAsked::Point(_)]), "{asked:?}");
    host.scene.look.layout = VolumeLayout::One(VolumePane::X);
    host.settle(VolumePictures::Whole);
    let pictures = host.scene.pictures();
    assert_eq!(pictures.iter().map(|(rect, _)| rect.pane).collect::<Vec<_>>(), [VolumePane::X]);
    assert_eq!(host.picture(VolumePane::X).0.size, [128, 96]);
}
