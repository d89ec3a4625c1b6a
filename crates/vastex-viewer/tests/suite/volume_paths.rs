//! A volume in a window, without the window, that a path leads: recorded from what a person does, played,
//! and ended by a person.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use vastex::{Pace, Settings};
use vastex_viewer::camera::{Recorded, WhyLeftOut};
use vastex_viewer::input::{InputEvent, Key};
use vastex_viewer::volume::VolumeBox;
use vastex_viewer::volume_scene::{VolumeFacts, VolumePane, VolumePictures, VolumeScene};
use vastex_viewer::{CameraPath, VolumeFlight, VolumePlace, VolumeViewText};

use super::volume_scenes::Host;

/// A host by a clock that goes on when it is told to, and what leads its volume.
struct Led {
    host: Host,
    flight: VolumeFlight,
    millis: Arc<AtomicU64>,
}

impl Led {
    fn new(times: u64) -> Led {
        let millis = Arc::new(AtomicU64::new(1000));
        let told = millis.clone();
        let clock = Arc::new(move || Duration::from_millis(told.load(Ordering::Relaxed)));
        let mut host = Host::with_clock(1, times, Pace::LockStep { latency_frames: 1 }, clock);
        host.settle(VolumePictures::Whole);
        Led { host, flight: VolumeFlight::default(), millis }
    }

    fn now(&self) -> Duration {
        Duration::from_millis(self.millis.load(Ordering::Relaxed))
    }

    /// A frame after so many milliseconds.
    fn frame_after(&mut self, millis: u64, pictures: VolumePictures) {
        self.millis.fetch_add(millis, Ordering::Relaxed);
        self.flight.lead(self.now(), &mut self.host.scene);
        self.host.frame(pictures);
        let timeout = Some(Duration::from_secs(60));
        self.host.gpu.device.poll(wgpu::PollType::Wait { submission_index: None, timeout }).unwrap();
    }

    fn seen(&self) -> VolumePlace {
        VolumePlace::seen(&self.host.scene.look, self.host.scene.facts())
    }
}

#[test]
fn what_a_person_does_is_recorded_and_played_without_a_black_picture() {
    let mut led = Led::new(3);
    led.flight.begin_recording(led.now(), &led.host.scene);
    for n in 0..30 {
        let of = led.host.scene.facts().of;
        led.host.scene.look.orbit.yaw += 3.0;
        led.host.scene.look.step_slice(&of, 2, if n % 4 == 0 { 1 } else { 0 });
        led.host.scene.look.time = u64::from(n >= 15);
        led.frame_after(40, VolumePictures::Whole);
    }
    let end = led.seen();
    let Recorded { path, left_out } = led.flight.end_recording(led.now(), Some(&led.host.scene)).unwrap();
    assert_eq!(left_out, None);
    let (seconds, text) = (path.seconds(), path.volume_text());
    assert!((seconds - 1.2).abs() < 1e-9 && path.keys().len() < 20, "{text}");
    assert_eq!(
        path.keys().last().unwrap().1.of(&VolumeViewText::default()),
        end.of(&VolumeViewText::default())
    );
    assert_eq!(CameraPath::of_volume(&text), Ok(path.clone()), "{text}");

    // From elsewhere it is played from its beginning to its end.
    led.host.scene.look.fit(&led.host.scene.facts().clone());
    led.host.scene.look.time = 2;
    led.host.settle(VolumePictures::Whole);
    assert_eq!(led.flight.play(led.now(), &mut led.host.scene), Ok(true));
    let (mut yaws, mut frames) = (Vec::new(), 0);
    while led.flight.is_playing() {
        led.frame_after(25, VolumePictures::Parts);
        for pane in VolumePane::ALL {
            assert!(led.host.middle(pane) >= 40, "{pane:?} is black in frame {frames}");
        }
        yaws.push(led.host.scene.look.orbit.yaw);
        frames += 1;
        assert!(frames < 100, "it has no end");
    }
    assert!(frames >= 48 && yaws.is_sorted() && yaws.windows(2).filter(|y| y[0] < y[1]).count() > 40);
    assert_eq!(led.seen(), end);
    led.host.settle(VolumePictures::Whole);
    assert_eq!(led.host.scene.seen_time(), 1);

    // Its last picture is that of the view whose text it is.
    let mut other = Led::new(3);
    let view: VolumeViewText = end.to_string().parse().unwrap();
    let facts = other.host.scene.facts().clone();
    view.change(&mut other.host.scene.look, &facts).unwrap();
    other.host.settle(VolumePictures::Whole);
    for pane in VolumePane::ALL {
        assert!(other.host.picture(pane) == led.host.picture(pane), "{pane:?}");
    }
}

/// What was recorded of a volume is no less when another one is shown, or none.
#[test]
fn a_recording_ends_with_its_volume_and_is_kept() {
    let mut led = Led::new(1);
    for is_shown in [true, false] {
        led.flight.begin_recording(led.now(), &led.host.scene);
        for _ in 0..5 {
            led.host.scene.look.orbit.yaw += 3.0;
            led.frame_after(40, VolumePictures::Parts);
        }
        let end = led.seen();
        let of = VolumeBox::new([9, 8, 7], [1.0; 3]);
        let facts = VolumeFacts { of, ..led.host.scene.facts().clone() };
        let clock = Arc::new(|| Duration::ZERO);
        let mut other = VolumeScene::new(&led.host.gpu, facts, Settings::default(), clock).unwrap();
        if is_shown {
            led.flight.lead(led.now() + Duration::from_secs(1), &mut other);
        }
        let now = led.now() + Duration::from_secs(2);
        let recorded = led.flight.end_recording(now, is_shown.then_some(&other)).unwrap();
        let (time, last) = recorded.path.keys().last().unwrap();
        assert!((time - 0.2).abs() < 1e-9 && (last.yaw - end.yaw).abs() < 1e-9, "{time} {last:?} {end:?}");
        assert_eq!(recorded.left_out.map(|left_out| left_out.why), Some(WhyLeftOut::Another));
        assert!(led.flight.end_recording(led.now(), None).is_none(), "it has ended");
    }
}

#[test]
fn a_person_who_moves_the_volume_ends_the_path_and_stays_there() {
    let path = "vastex path 1\n0 volume:x=20,y=16,z=12,zoom=1,yaw=0,pitch=0\n\
        10 volume:x=20,y=16,z=12,zoom=1,yaw=100,pitch=0\n";
    let mut led = Led::new(1);
    assert_eq!(led.flight.play(led.now(), &mut led.host.scene), Ok(false), "there is none");
    led.flight.set_path(CameraPath::of_volume(path).unwrap());
    let key = |key| InputEvent::Key { key, is_pressed: true, is_repeat: false };
    // What is shown and how may change meanwhile, and slices are not led.
    led.flight.play(led.now(), &mut led.host.scene).unwrap();
    led.frame_after(3000, VolumePictures::Whole);
    led.host.scene.on_event(key(Key::Char('e')));
    let of = led.host.scene.facts().of;
    led.host.scene.look.step_slice(&of, 2, 3);
    led.frame_after(2000, VolumePictures::Whole);
    let yaw = led.host.scene.look.orbit.yaw;
    assert!(led.flight.is_playing() && (yaw - 50.0).abs() < 1e-6, "{yaw}");
    led.host.scene.look.orbit.pitch = 11.0;
    led.frame_after(1000, VolumePictures::Whole);
    assert!(!led.flight.is_playing());
    let orbit = led.host.scene.look.orbit;
    assert_eq!((orbit.yaw, orbit.pitch), (yaw, 11.0));
    led.frame_after(1000, VolumePictures::Whole);
    assert_eq!(led.host.scene.look.orbit, orbit);
    // It can be played again, from its beginning.
    assert_eq!(led.flight.play(led.now(), &mut led.host.scene), Ok(true));
    led.frame_after(0, VolumePictures::Whole);
    assert_eq!(led.host.scene.look.orbit.yaw, 0.0);
}

#[test]
fn a_time_that_is_not_read_yet_is_waited_for_while_the_camera_goes_on() {
    let camera = |yaw: u32| format!("volume:x=20,y=16,z=12,zoom=1,yaw={yaw},pitch=0");
    let path = format!("vastex path 1\n0 {};time=0\n3 {};time=2\n", camera(0), camera(90));
    let mut led = Led::new(3);
    led.host.holds = true;
    led.flight.set_path(CameraPath::of_volume(&path).unwrap());
    led.flight.play(led.now(), &mut led.host.scene).unwrap();
    let mut before = -1.0;
    for _ in 0..29 {
        led.frame_after(100, VolumePictures::Parts);
        let look = &led.host.scene.look;
        assert!(look.orbit.yaw > before && look.time <= 1, "{before}: {} {}", look.orbit.yaw, look.time);
        before = look.orbit.yaw;
        assert_eq!((led.host.scene.seen_time(), led.host.middle(VolumePane::Z)), (0, 40));
    }
    led.frame_after(200, VolumePictures::Parts);
    assert_eq!((led.flight.is_playing(), led.host.scene.look.time), (false, 2));
    led.frame_after(100, VolumePictures::Parts);
    led.host.holds = false;
    for held in std::mem::take(&mut led.host.held) {
        led.host.read(held);
    }
    led.host.settle(VolumePictures::Whole);
    assert_eq!((led.host.scene.seen_time(), led.host.middle(VolumePane::Z)), (2, 42));

    // A path of times that there are not is refused, and nothing changes.
    let look = led.host.scene.look.clone();
    led.flight.set_path(CameraPath::of_volume(&path.replace("time=2", "time=7")).unwrap());
    let error = led.flight.play(led.now(), &mut led.host.scene).unwrap_err();
    assert!(error.to_string().contains("even has the times 0 to 2"), "{error}");
    assert!(!led.flight.is_playing() && led.host.scene.look == look);
}
