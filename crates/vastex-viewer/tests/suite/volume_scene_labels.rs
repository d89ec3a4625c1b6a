//! Labels of a volume in a window: at times that have other labels than those before, and the one of them
//! that is selected.

use glam::DVec2;
use vastex_viewer::input::{Button, InputEvent, Key};
use vastex_viewer::volume_scene::{
    PointAnswer, PointPlace, VolumeAsked, VolumeHeard, VolumeLayout, VolumePane, VolumePictures,
};

use super::volume_scenes::Host;

/// Each time is drawn by shaders of its own then, with bindings of their own, and seen through its own
/// cameras.
#[test]
fn times_with_and_without_labels_come_after_each_other() {
    let mut host = Host::lockstep(1, 3);
    host.bare = vec![2];
    host.scene.look.layout = VolumeLayout::One(VolumePane::Z);
    let pictures = VolumePictures::Whole;
    host.settle(pictures);
    assert_eq!(host.middle(VolumePane::Z), 40);
    // Another time, and labels with it: from without to with them.
    host.scene.look.time = 1;
    (host.scene.look.labels.shown, host.scene.look.labels.opacity) = (Some(0), 1.0);
    host.settle(pictures);
    assert_eq!((host.scene.seen_time(), host.middle(VolumePane::Z)), (1, 250));
    // To a time that has none, and from that to one that has.
    for (time, seen) in [(2, 42), (0, 250)] {
        host.scene.look.time = time;
        host.settle(pictures);
        assert_eq!((host.scene.seen_time(), host.middle(VolumePane::Z)), (time, seen));
    }
    // Labels are chosen while the next time comes.
    host.scene.look.labels.shown = None;
    host.settle(pictures);
    host.scene.look.time = 1;
    host.frame(pictures);
    host.scene.look.labels.shown = Some(0);
    host.settle(pictures);
    assert_eq!((host.scene.seen_time(), host.middle(VolumePane::Z)), (1, 250));
}

#[test]
fn a_selected_label_is_of_the_labels_that_are_shown() {
    let mut host = Host::lockstep(1, 1);
    let press = |host: &mut Host, key| {
        host.scene.on_event(InputEvent::Key { key, is_pressed: true, is_repeat: false })
    };
    let labels = |host: &Host| (host.scene.look.labels.shown, host.scene.look.labels.selected);
    // What is chosen together stays.
    (host.scene.look.labels.shown, host.scene.look.labels.selected) = (Some(1), Some(5));
    host.settle(VolumePictures::Whole);
    assert_eq!(labels(&host), (Some(1), Some(5)));
    // L hides them, and shows the same ones again; Escape is another's meanwhile.
    press(&mut host, Key::Char('l'));
    host.settle(VolumePictures::Whole);
    assert_eq!(press(&mut host, Key::Escape), VolumeHeard::Other);
    press(&mut host, Key::Char('l'));
    host.settle(VolumePictures::Whole);
    assert_eq!(labels(&host), (Some(1), Some(5)));
    // Others have nothing of that number.
    host.scene.look.labels.shown = Some(0);
    host.settle(VolumePictures::Whole);
    assert_eq!(labels(&host), (Some(0), None));
    // Nor has the answer of a click on those before.
    host.scene.look.layout = VolumeLayout::One(VolumePane::Z);
    host.scene.on_event(InputEvent::PointerMoved(DVec2::new(64.0, 48.0)));
    for is_pressed in [true, false] {
        let button = Button::Primary;
        host.scene.on_event(InputEvent::Button { button, is_pressed });
    }
    let asked = host.scene.take_asked();
    let [VolumeAsked::Point(asked)] = asked[..] else { panic!("{asked:?}") };
    assert_eq!(asked.labels, Some(0));
    host.scene.look.labels.shown = Some(1);
    let PointPlace::At(place) = asked.place else { panic!("{asked:?}") };
    let (number, place, values) = (asked.number, Some(place), Vec::new());
    host.scene.report(PointAnswer { number, place, voxel: [20, 16, 12], values, label: Some(7) });
    assert_eq!(labels(&host), (Some(1), None));
}
