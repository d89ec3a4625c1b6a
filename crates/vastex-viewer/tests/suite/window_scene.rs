//! Surfaces and a volume in their place, by the same calls: frames, titles, what is said, and what is changed
//! of textures.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use vastex::{Pace, PoolId, TextureSettings};
use vastex_viewer::beside::{VOLUME, Wake, WindowState};
use vastex_viewer::hud::HudChange;
use vastex_viewer::input::{Action, InputEvent, Key};
use vastex_viewer::volume::RayCut;
use vastex_viewer::volume_scene::{PointAnswer, VolumeAsked, VolumeLayout, VolumeLook, VolumePane};
use vastex_viewer::window_scene::{ShownVolume, VolumeToShow};
use vastex_viewer::{CameraPath, Pose, Remembered, Scene, VolumeFlight, VolumeViewText};

use super::surface_scene::{SIZE, Window};
use super::volume_scenes::{even, even_in_bricks_of, facts, settings};

/// When a frame is due after one that was left out.
const SOON: Wake = Wake::After(Duration::from_millis(2));
/// What is said of rays that are cut, as a topic.
const CUT: &str = "rays that are cut";
/// A pixel of the picture beside the crosshair.
const MIDDLE: [u32; 2] = [SIZE[0] / 2 + 3, SIZE[1] / 2 + 3];

impl Window {
    /// Shows a volume of so many channels, in one picture, in the place of surfaces.
    fn show_volume(&mut self, channels: usize) {
        let facts = facts(channels, 2);
        let mut look = VolumeLook::first(&facts);
        look.layout = VolumeLayout::One(VolumePane::Z);
        let (name, rows) = ("head.zarr".to_owned(), Arc::from([]));
        let settings = settings(Pace::LockStep { latency_frames: 1 });
        let shown = VolumeToShow { name, facts, look, settings, rows, images: Vec::new() };
        let on = (&self.gpu, &self.scene.beside);
        self.volume = Some(ShownVolume::new(on, shown, (&self.formats, SIZE)).unwrap());
        self.scene.give_way(2, "head.zarr");
    }

    /// Reads what the volume asks for. Gives back what is asked for beside channels.
    fn read(&mut self) -> Vec<VolumeAsked> {
        let scene = &mut self.volume.as_mut().unwrap().scene;
        let mut others = Vec::new();
        for asked in scene.take_asked() {
            let VolumeAsked::Channel { channel, time } = asked else {
                others.push(asked);
                continue;
            };
            let source = even((channel, time));
            let prepared = scene.preparer().read_blocking(source, TextureSettings::default()).unwrap();
            scene.add((channel, time), prepared, [0.0, 255.0]).unwrap();
        }
        others
    }

    /// Frames of the volume until none is due by itself. Gives back the last pixel that was drawn, and how
    /// many frames were drawn and left out.
    fn settle_volume(&mut self) -> ([u8; 4], [usize; 2]) {
        let (mut seen, mut frames) = ([0; 4], [0; 2]);
        for _ in 0..2000 {
            let pixel = self.pixel_of_frame(MIDDLE);
            assert_eq!(self.read(), []);
            seen = pixel.unwrap_or(seen);
            frames[usize::from(pixel.is_none())] += 1;
            match self.next_frame(false) {
                Wake::Now => {}
                // What need not be drawn is looked at again soon.
                wake if pixel.is_none() => assert_eq!(wake, SOON),
                _ => return (seen, frames),
            }
        }
        panic!("the volume does not settle");
    }

    /// Returns true if a pixel shows the volume whose values are all 40. A GPU may round it down, since
    /// something without weight is painted over it.
    fn is_even(&self, pixel: [u8; 4]) -> bool {
        let shows = |value: u8| pixel == [value, value, value, 255];
        shows(40) || shows(39) && !self.gpu.is_processor()
    }

    fn title(&mut self) -> Option<String> {
        let stats = self.shown().textures().stats();
        self.shown().title(&stats, Pose::first(Scene::Image)).map(str::to_owned)
    }

    fn pool(&mut self) -> PoolId {
        self.shown().textures().stats().pools[0].pool
    }
}

#[test]
fn a_volume_is_shown_by_the_calls_that_show_surfaces_and_rests_as_they_do() {
    let mut window = Window::new();
    window.show_volume(1);
    assert_eq!(window.next_frame(false), Wake::Now);
    let (seen, [drawn, left_out]) = window.settle_volume();
    assert!(window.is_even(seen), "{seen:?}");
    assert!(drawn > 1 && window.shown().is_source());
    assert!(left_out > 0, "{drawn} frames are drawn, and none is left out");
    assert_eq!(window.next_frame(false), Wake::OnEvent);
    assert_eq!(window.title(), Some("head.zarr".into()));
    // What is said is seen in the next frame, which is drawn for it, and gone some seconds later.
    window.scene.announce("it is so");
    assert_eq!(window.scene.beside.take_log(), ["head.zarr: it is so"]);
    assert_eq!(window.next_frame(false), Wake::Now);
    assert!(window.pixel_of_frame(MIDDLE).is_some());
    assert_eq!(window.title(), Some("head.zarr – it is so".into()));
    let Wake::After(left) = window.next_frame(false) else { panic!("it stays for good") };
    assert!(left > Duration::from_secs(5));
    window.time.fetch_add(left.as_millis() as u64 + 1, Ordering::Relaxed);
    window.settle_volume();
    assert_eq!(window.next_frame(false), Wake::OnEvent);
    // An error is seen at once, and levels that the host makes are looked after.
    window.scene.beside.show_error(VOLUME, "a channel cannot be read");
    assert_eq!(window.next_frame(false), Wake::Now);
    window.settle_volume();
    window.volume.as_mut().unwrap().set_being_made(true);
    assert_eq!(window.next_frame(false), Wake::SLOWLY);
    window.volume.as_mut().unwrap().set_being_made(false);
    window.scene.beside.set_hidden(true);
    assert_eq!(window.next_frame(true), Wake::SLOWLY);
    window.scene.beside.set_hidden(false);
    // Surfaces come back, and say what lies below the pointer, which has moved meanwhile.
    let middle = glam::DVec2::new(f64::from(SIZE[0]) / 2.0, f64::from(SIZE[1]) / 2.0);
    assert_eq!(window.shown().set_pointer(Some(middle), Pose::first(Scene::Image)), None);
    window.volume = None;
    let source = window.source([1, 2, 3], None);
    window.scene.show_source(3, "c.png", source).unwrap();
    assert_eq!(window.settle(), [1, 2, 3, 255]);
    assert!(window.scene.pointed().is_some_and(|pointed| pointed.length() < 1e-6));
    let title = window.title().unwrap();
    assert!(title.starts_with("c.png – ") && title.contains(": 1"), "{title}");
}

#[test]
fn rays_that_are_cut_are_told_as_long_as_they_are() {
    let mut window = Window::new();
    window.show_volume(1);
    window.volume.as_mut().unwrap().scene.look.layout = VolumeLayout::One(VolumePane::Space);
    let mut with_step = |step| {
        window.volume.as_mut().unwrap().scene.look.step = step;
        window.settle_volume();
        window.volume.as_ref().unwrap().scene.ray_cut()
    };
    assert_eq!(with_step(1.0), None);
    assert!(matches!(with_step(1e-4), Some(RayCut::Samples(_, Some(_)))));
    assert_eq!(with_step(1.0), None);
    assert!(!window.scene.beside.forget(CUT), "that holds no more");
    window.volume.as_mut().unwrap().scene.look.step = 1e-4;
    window.settle_volume();
    assert!(window.scene.beside.forget(CUT));
    // A slice has one sample.
    window.volume.as_mut().unwrap().scene.look.layout = VolumeLayout::One(VolumePane::Z);
    window.settle_volume();
    assert!(!window.scene.beside.forget(CUT));
    // Another file is opened, in vain: what holds of the volume that stays is said again.
    window.volume.as_mut().unwrap().scene.look.layout = VolumeLayout::One(VolumePane::Space);
    window.settle_volume();
    window.scene.beside.forget_notes();
    window.volume.as_mut().unwrap().refresh();
    window.settle_volume();
    assert!(window.scene.beside.forget(CUT));
    // Another file is displayed in the place of a volume whose rays are cut.
    window.scene.beside.show_note(CUT, "rays are cut");
    window.volume = None;
    let source = window.source([1, 2, 3], None);
    window.scene.show_source(3, "c.png", source).unwrap();
    assert!(!window.scene.beside.forget(CUT), "what is displayed has no rays");
}

#[test]
fn what_is_heard_over_a_volume_is_shown_and_asked_of_the_host() {
    let mut window = Window::new();
    window.show_volume(1);
    window.settle_volume();
    let hear = |window: &mut Window, event| {
        let volume = window.volume.as_mut().unwrap();
        let is_taken = volume.on_event(&window.scene.beside, event);
        (is_taken, volume.is_stale())
    };
    let key = |key| InputEvent::Key { key, is_pressed: true, is_repeat: false };
    // Another time, whose channel is read then.
    assert_eq!(hear(&mut window, key(Key::Char('.'))), (true, true));
    assert_eq!(window.settle_volume().0, [41, 41, 41, 255]);
    // Of the pointer over a panel the pictures hear nothing.
    let at = InputEvent::PointerMoved(glam::DVec2::new(64.0, 48.0));
    assert!(hear(&mut window, at).1);
    let [VolumeAsked::Point(asked)] = window.read()[..] else { panic!("a place is asked for") };
    window.volume.as_mut().unwrap().scene.report_nothing(asked.number);
    window.scene.beside.set_window(WindowState { is_over_panel: true, ..WindowState::default() });
    hear(&mut window, at);
    assert_eq!(window.read(), []);
    // What the panel asks for is the host's to find.
    let scene = &mut window.volume.as_mut().unwrap().scene;
    scene.ask_ranges(vec![0]);
    scene.ask_label(7);
    assert_eq!(window.read(), [VolumeAsked::Ranges(vec![0])], "no labels are shown");
    let scene = &mut window.volume.as_mut().unwrap().scene;
    let (before, place) = (scene.look.cross, glam::DVec3::new(3.5, 4.5, 5.5));
    assert!(scene.show_label(0, Some(place)) && scene.show_label(0, None), "nobody asks any more");
    assert_eq!(scene.look.cross, before);
    scene.look.labels.shown = Some(0);
    scene.ask_label(7);
    let label = VolumeAsked::Label { label: 7, nth: 0, time: 1 };
    assert_eq!(window.read(), [VolumeAsked::Labels { nth: 0, time: 1 }, label]);
    let scene = &mut window.volume.as_mut().unwrap().scene;
    assert!(!scene.show_label(0, None) && scene.show_label(0, Some(place)));
    assert_eq!((scene.look.cross, scene.look.centre), (place, place));
    // Actions of surfaces alone are left out, and those of what stands beside are carried out.
    assert!(window.shown().ignores(&Action::Overlay) && !window.shown().ignores(&Action::Hud));
    assert!(window.shown().perform(&Action::Hud) && window.scene.beside.hud_is_shown());
    assert!(!window.shown().perform(&Action::Reset));
    assert_eq!(window.next_frame(false), Wake::Now);
}

/// Whatever a host brings is seen in the next frame, and frames in which nothing is to be seen are left out.
#[test]
fn a_frame_is_due_for_what_a_host_brings_and_for_panels() {
    let mut window = Window::new();
    window.show_volume(1);
    window.settle_volume();
    let settle = |window: &mut Window| {
        assert_eq!(window.next_frame(false), Wake::Now);
        window.settle_volume();
        assert_eq!(window.next_frame(false), Wake::OnEvent);
    };
    let shown = |window: &mut Window, change: &dyn Fn(&mut ShownVolume)| {
        change(window.volume.as_mut().unwrap());
    };
    shown(&mut window, &|volume| volume.set_values(0, None));
    settle(&mut window);
    shown(&mut window, &|volume| volume.resize(SIZE));
    assert_eq!(window.next_frame(false), Wake::OnEvent, "the size is the same");
    shown(&mut window, &|volume| volume.resize([64, 48]));
    settle(&mut window);
    let volume = window.volume.as_mut().unwrap();
    volume.on_event(&window.scene.beside, InputEvent::PointerMoved(glam::DVec2::new(64.0, 48.0)));
    let [VolumeAsked::Point(asked)] = window.read()[..] else { panic!("a place is asked for") };
    window.settle_volume();
    assert_eq!(window.next_frame(false), Wake::OnEvent);
    let place = Some(glam::DVec3::new(3.5, 4.5, 5.5));
    let told = PointAnswer { number: asked.number, place, voxel: [3, 4, 5], values: Vec::new(), label: None };
    shown(&mut window, &|volume| volume.report(told.clone()));
    settle(&mut window);
    assert_eq!(window.volume.as_ref().unwrap().scene.points().below(), Some(&told));
    // At rest a frame that egui wants is drawn, and while bricks come, of which nothing is seen, only such
    // a one is.
    window.panels_are_due = true;
    assert!(window.pixel_of_frame(MIDDLE).is_some());
    for panels_are_due in [false, true, false] {
        shown(&mut window, &|volume| volume.scene.expect_changes(true));
        window.panels_are_due = panels_are_due;
        assert_eq!(window.pixel_of_frame(MIDDLE).is_some(), panels_are_due);
        assert_eq!(window.next_frame(false), if panels_are_due { Wake::Now } else { SOON });
    }
}

#[test]
fn a_volume_goes_on_with_another_device_and_goes_where_a_view_or_a_path_says() {
    let mut window = Window::new();
    window.show_volume(1);
    // What is being read when the device is lost is asked for again.
    assert!(window.pixel_of_frame(MIDDLE).is_some());
    let asked = window.volume.as_mut().unwrap().scene.take_asked();
    assert_eq!(asked, [VolumeAsked::Channel { channel: 0, time: 0 }]);
    window.lose_device();
    window.volume.as_mut().unwrap().scene.refuse(0, 0);
    window.volume.as_mut().unwrap().scene.ask_again(&asked[0]);
    let mut window = window.on_another_device();
    assert_eq!(window.next_frame(false), Wake::Now);
    let seen = window.settle_volume().0;
    assert!(window.is_even(seen), "{seen:?}");
    window.lose_device();
    let mut window = window.on_another_device();
    assert_eq!(window.next_frame(false), Wake::Now);
    let seen = window.settle_volume().0;
    assert!(window.is_even(seen), "{seen:?}");
    // A view, and one that the volume does not have.
    let volume = window.volume.as_mut().unwrap();
    let before = volume.view_text();
    let later = VolumeViewText { time: Some(1), ..before.clone() };
    volume.show_view(&later).unwrap();
    assert_eq!(window.next_frame(false), Wake::Now);
    assert_eq!(window.settle_volume().0, [41, 41, 41, 255]);
    let volume = window.volume.as_mut().unwrap();
    assert!(volume.show_view(&VolumeViewText { time: Some(9), ..before }).is_err());
    assert_eq!(volume.view_text(), later);
    assert_eq!(window.next_frame(false), Wake::OnEvent);
    // A path: frames are due while it is played, also where it stays.
    let text = "vastex path 1\n0 volume:x=8,y=8,z=8,zoom=1,yaw=30,pitch=20;time=1\n\
                1 volume:x=8,y=8,z=8,zoom=1,yaw=30,pitch=20;time=0\n";
    let (begin, mut flight) = (Duration::from_secs(5), VolumeFlight::default());
    flight.set_path(CameraPath::of_volume(text).unwrap());
    assert!(flight.play(begin, &mut window.volume.as_mut().unwrap().scene).unwrap());
    let is_settled = (0..2000).any(|_| {
        window.volume.as_mut().unwrap().lead(begin, &mut flight);
        window.pixel_of_frame(MIDDLE);
        window.read();
        window.volume.as_ref().unwrap().scene.is_settled()
    });
    assert!(is_settled && flight.is_playing());
    assert!([Wake::Now, SOON].contains(&window.next_frame(false)));
    window.volume.as_mut().unwrap().lead(begin + Duration::from_secs(2), &mut flight);
    let seen = window.settle_volume().0;
    assert!(window.is_even(seen), "{seen:?}");
    assert_eq!(window.next_frame(false), Wake::OnEvent);
}

/// Each frame fails as the one before, until something else is shown.
#[test]
fn why_nothing_can_be_drawn_of_a_volume_is_said_once_in_the_window_and_outside() {
    let mut window = Window::new();
    window.show_volume(2);
    let scene = &mut window.volume.as_mut().unwrap().scene;
    assert_eq!(scene.take_asked().len(), 2);
    for (channel, brick) in [(0, 16), (1, 8)] {
        let source = even_in_bricks_of(brick, (channel, 0));
        let prepared = scene.preparer().read_blocking(source, TextureSettings::default()).unwrap();
        scene.add((channel, 0), prepared, [0.0, 255.0]).unwrap();
    }
    for _ in 0..2 {
        for _ in 0..20 {
            window.pixel_of_frame(MIDDLE);
        }
        let said = window.scene.beside.take_log();
        assert!(said.len() == 1 && said[0].starts_with("head.zarr: the channels do not lie"), "{said:?}");
        assert!(window.scene.beside.forget(VOLUME));
        let show = |window: &mut Window, is_shown| {
            window.volume.as_mut().unwrap().scene.look.channels[1].is_shown = is_shown;
        };
        show(&mut window, false);
        let seen = window.settle_volume().0;
        assert!(window.is_even(seen), "{seen:?}");
        assert_eq!(window.scene.beside.take_log(), [""; 0]);
        show(&mut window, true);
    }
}

/// One answer for both: what is changed, what is remembered, and what is said of what cannot be.
#[test]
fn what_is_changed_of_textures_is_changed_alike_for_surfaces_and_a_volume() {
    let mut window = Window::new();
    let source = window.source([1, 2, 3], None);
    window.scene.show_source(1, "a.png", source).unwrap();
    window.settle();
    let mut bytes = Vec::new();
    for name in ["a.png", "head.zarr"] {
        let is_volume = name == "head.zarr";
        if is_volume {
            window.show_volume(1);
            window.settle_volume();
        }
        let pool = window.pool();
        let (uploads, in_flight) = if is_volume { (3 << 20, 5 << 20) } else { (1 << 20, 7 << 20) };
        for change in [
            HudChange::Budgets { uploads, in_flight },
            HudChange::Rule(pool, None),
            HudChange::PoolBytes(pool, Some(2 << 20)),
        ] {
            window.shown().change(&change);
        }
        let shown = window.shown();
        let inspect = shown.textures().inspect();
        let settings = inspect.settings();
        assert_eq!(
            (settings.upload_bytes_per_frame, settings.in_flight_bytes),
            (uploads, in_flight),
            "{name}"
        );
        assert!(inspect.bias_rule(pool).is_none(), "{name}");
        bytes.push(shown.textures().stats().pools[0].bytes);
        assert_eq!(window.scene.beside.take_log(), [""; 0]);
        // A pool that is not there.
        let before = window.scene.beside.remembered(&Remembered::default());
        assert_eq!(before.upload_bytes_per_frame, Some(uploads), "{name}");
        assert_eq!(before.pools.len(), 1, "a volume's pools go with it");
        window.shown().change(&HudChange::PoolBytes(PoolId::new(9), None));
        let said = window.scene.beside.take_log();
        assert!(said.len() == 1 && said[0].starts_with(&format!("{name}: ")), "{said:?}");
        assert!(window.scene.beside.forget("change"), "it is said in the window, too");
        assert_eq!(window.scene.beside.remembered(&Remembered::default()), before);
        // How it is sampled.
        window.shown().change(&HudChange::Filter(Some(vastex::Filter::Nearest)));
        let title = window.title().unwrap_or_default();
        assert_eq!(title.contains("volumes are sampled and asked in one way"), is_volume, "{title}");
    }
    assert!(bytes.iter().all(|bytes| *bytes <= 2 << 20), "{bytes:?}");
    assert_eq!(window.scene.beside.remembered(&Remembered::default()).filter, Some(vastex::Filter::Nearest));
}
