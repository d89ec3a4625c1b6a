//! A person's hands on a volume, without a window.

use std::time::Duration;

use super::*;
use crate::input::named::{HELD, keys, listed};
use crate::input::{FILES, Input, WINDOW};
use crate::volume_scene::SliceTilt;
use crate::volume_scene::look::tests::facts;
use crate::volume_scene::sight::pane_rects;

struct Person {
    facts: VolumeFacts,
    look: VolumeLook,
    hands: VolumeHands,
}

impl Person {
    fn new() -> Person {
        let facts = facts();
        Person { look: VolumeLook::first(&facts), facts, hands: VolumeHands::default() }
    }

    fn panes(&self) -> Vec<PaneRect> {
        pane_rects(self.look.layout, [642, 482])
    }

    fn does(&mut self, event: InputEvent) -> VolumeHeard {
        let panes = self.panes();
        self.hands.on_event(event, &mut self.look, &VolumeRoom { facts: &self.facts, panes: &panes })
    }

    fn key(&mut self, key: Key) -> VolumeHeard {
        self.does(InputEvent::Key { key, is_pressed: true, is_repeat: false })
    }

    fn button(&mut self, button: Button, is_pressed: bool) -> VolumeHeard {
        self.does(InputEvent::Button { button, is_pressed })
    }

    /// Points at the middle of a picture.
    fn point(&mut self, pane: VolumePane) -> DVec2 {
        let rect = *self.panes().iter().find(|rect| rect.pane == pane).unwrap();
        let middle = DVec2::from_array([0, 1].map(|axis| f64::from(rect.at[axis] + rect.size[axis] / 2)));
        self.does(InputEvent::PointerMoved(middle));
        middle
    }
}

#[test]
fn a_wheel_goes_through_slices_and_zooms_in_3d() {
    let mut person = Person::new();
    person.point(VolumePane::Z);
    person.does(InputEvent::Wheel(2.0));
    assert_eq!(person.look.voxel(&person.facts.of), [20, 15, 12]);
    person.point(VolumePane::X);
    person.does(InputEvent::Wheel(-1.0));
    assert_eq!(person.look.voxel(&person.facts.of), [19, 15, 12]);
    assert_eq!(person.look.zoom, 1.0);
    person.point(VolumePane::Space);
    person.does(InputEvent::Wheel(1.0));
    assert_eq!((person.look.orbit.zoom, person.look.voxel(&person.facts.of)), (WHEEL_FACTOR, [19, 15, 12]));
    // A touchpad's small steps add up to slices.
    person.point(VolumePane::Y);
    for _ in 0..4 {
        person.does(InputEvent::Scroll(DVec2::new(0.0, PIXELS_PER_SLICE / 2.0)));
    }
    assert_eq!(person.look.voxel(&person.facts.of)[1], 17);
}

#[test]
fn what_is_below_the_pointer_stays_there_when_a_slice_is_zoomed() {
    let mut person = Person::new();
    let at = person.point(VolumePane::Z) + DVec2::new(60.0, -30.0);
    person.does(InputEvent::PointerMoved(at));
    let place = |person: &Person| {
        let panes = person.panes();
        PaneSight::of(&person.look, &person.facts.of, &panes, &panes[0]).ray(panes[0].within(at))[0]
    };
    let before = place(&person);
    let held = Modifiers { control: true, ..Modifiers::default() };
    person.does(InputEvent::Modifiers(held));
    person.does(InputEvent::Wheel(5.0));
    assert!(person.look.zoom > 1.9 && (place(&person) - before).length() < 1e-9);
}

#[test]
fn a_press_in_a_slice_puts_the_crosshair_and_a_drag_takes_it_along() {
    let mut person = Person::new();
    let middle = person.point(VolumePane::Z);
    assert!(matches!(person.button(Button::Primary, true), VolumeHeard::Click(VolumePane::Z, _)));
    let before = person.look.cross;
    person.does(InputEvent::PointerMoved(middle + DVec2::new(60.0, 0.0)));
    assert!(person.look.cross.x > before.x && person.look.cross.z == before.z);
    person.button(Button::Primary, false);
    let (cross, centre) = (person.look.cross, person.look.centre);
    person.does(InputEvent::PointerMoved(middle));
    assert_eq!(person.look.cross, cross, "nothing is held");
    person.button(Button::Secondary, true);
    person.does(InputEvent::PointerMoved(middle + DVec2::new(0.0, 40.0)));
    assert!(person.look.cross == cross && person.look.centre.y < centre.y, "the picture is moved");
}

#[test]
fn a_drag_in_3d_turns_and_a_click_asks() {
    let mut person = Person::new();
    let middle = person.point(VolumePane::Space);
    person.button(Button::Primary, true);
    person.does(InputEvent::PointerMoved(middle + DVec2::new(1.0, 1.0)));
    assert_eq!(person.look.orbit.yaw, 30.0, "a hand is never quite still");
    assert!(matches!(person.button(Button::Primary, false), VolumeHeard::Click(VolumePane::Space, _)));
    person.button(Button::Primary, true);
    person.does(InputEvent::PointerMoved(middle + DVec2::new(40.0, 1.0)));
    assert!(person.look.orbit.yaw > 50.0 && person.look.orbit.pitch == 20.0);
    assert_eq!(person.button(Button::Primary, false), VolumeHeard::Taken, "that was no click");
}

#[test]
fn what_is_dragged_in_3d_goes_with_the_pointer() {
    let mut person = Person::new();
    person.look.layout = VolumeLayout::One(VolumePane::Space);
    // A place before the middle goes the way of the pointer.
    let before = {
        let panes = person.panes();
        let sight = PaneSight::of(&person.look, &person.facts.of, &panes, &panes[0]);
        let [eye, ahead] = sight.ray(DVec2::new(321.0, 241.0));
        let middle = person.facts.of.extent() / 2.0;
        eye + ahead * ((middle - eye).length() - 4.0)
    };
    let seen = |person: &Person| {
        let panes = person.panes();
        PaneSight::of(&person.look, &person.facts.of, &panes, &panes[0]).pixel_of(before).unwrap()
    };
    let from = seen(&person);
    turn(&mut person.look, DVec2::new(3.0, 0.0));
    assert!(seen(&person).x > from.x + 1.0);
    let from = seen(&person);
    turn(&mut person.look, DVec2::new(0.0, 3.0));
    assert!(seen(&person).y > from.y + 1.0);
}

#[test]
fn keys_choose_pictures_modes_and_times() {
    let mut person = Person::new();
    person.key(Key::Char('y'));
    assert_eq!(person.look.layout, VolumeLayout::One(VolumePane::Y));
    person.key(Key::Char(' '));
    assert_eq!(person.look.layout, VolumeLayout::One(VolumePane::Space));
    person.key(Key::Char(' '));
    assert_eq!(person.look.layout, VolumeLayout::One(VolumePane::Y), "the slice that was seen before");
    person.key(Key::Up);
    assert_eq!(person.look.voxel(&person.facts.of), [20, 16, 10]);
    person.key(Key::Char('e'));
    assert_eq!(person.look.mode, VolumeMode::Minip);
    for _ in 0..9 {
        person.key(Key::Char('.'));
    }
    assert_eq!(person.look.time, 4);
    person.key(Key::Char(','));
    assert_eq!(person.look.time, 3);
    // Held, keys go on to move and do nothing else again.
    let again = |key| InputEvent::Key { key, is_pressed: true, is_repeat: true };
    for key in [Key::Char(' '), Key::Char('e'), Key::Char('k'), Key::Char('c'), Key::Char('x'), Key::Home] {
        let before = person.look.clone();
        assert_eq!((person.does(again(key)), &person.look), (VolumeHeard::Taken, &before), "{key:?}");
    }
    person.does(again(Key::Char(',')));
    assert_eq!(person.look.time, 2);
    assert_eq!(person.key(Key::Char('k')), VolumeHeard::Play);
    assert_eq!(person.key(Key::Char('m')), VolumeHeard::Other);
    let held = Modifiers { control: true, ..Modifiers::default() };
    person.does(InputEvent::Modifiers(held));
    assert_eq!(person.key(Key::Char('c')), VolumeHeard::Other, "what copies is the host's");
}

#[test]
fn a_slice_is_tilted_by_a_drag_and_gone_through_along_its_own_way() {
    let mut person = Person::new();
    let middle = person.point(VolumePane::Z);
    let cross = person.look.cross;
    person.does(InputEvent::Modifiers(Modifiers { control: true, ..Modifiers::default() }));
    assert_eq!(person.button(Button::Primary, true), VolumeHeard::Taken, "no values are asked for");
    // A picture is 240 pixels high, and over that it turns by 180 degrees.
    person.does(InputEvent::PointerMoved(middle + DVec2::new(40.0, -24.0)));
    assert_eq!(person.button(Button::Primary, false), VolumeHeard::Taken);
    let SliceTilt { yaw, pitch } = person.look.tilt(VolumePane::Z);
    assert!((yaw - 30.0).abs() < 1e-9 && (pitch + 18.0).abs() < 1e-9, "{yaw}, {pitch}");
    assert_eq!((person.look.cross, person.look.tilt(VolumePane::X)), (cross, SliceTilt::default()));
    person.does(InputEvent::Modifiers(Modifiers::default()));
    // Slices meet on the plane, wherever a press puts that.
    let sight = |person: &Person| {
        let panes = person.panes();
        PaneSight::of(&person.look, &person.facts.of, &panes, &panes[0])
    };
    let before = sight(&person);
    person.does(InputEvent::PointerMoved(middle + DVec2::new(30.0, 17.0)));
    person.button(Button::Primary, true);
    person.button(Button::Primary, false);
    assert!(person.look.cross != cross);
    let place = person.look.cross;
    assert!((before.pixel_of(place).unwrap() - sight(&person).pixel_of(place).unwrap()).length() < 1e-6);
    let [ahead, ..] = person.look.slice_axes(VolumePane::Z);
    assert!((place - cross).dot(ahead).abs() < 1e-9, "the plane stays where it is");
    person.does(InputEvent::Wheel(1.0));
    let by = person.look.cross - place;
    assert!(by.cross(ahead).length() < 1e-9 && by.z > 0.1, "along its own way: {by}");
    // The picture is moved as the pointer is.
    let from = sight(&person).pixel_of(cross).unwrap();
    person.button(Button::Secondary, true);
    person.does(InputEvent::PointerMoved(middle + DVec2::new(50.0, 47.0)));
    person.button(Button::Secondary, false);
    let moved = sight(&person).pixel_of(cross).unwrap() - from;
    assert!((moved - DVec2::new(20.0, 30.0)).length() < 1e-6, "{moved}");
    person.key(Key::Char('t'));
    assert!(person.look.is_upright());
    let voxel = person.look.cross / person.facts.of.voxel;
    assert!((voxel - voxel.floor() - 0.5).length() < 1e-9, "slices go through voxels again");
}

/// What a volume does not hear is heard by the window that it is in.
#[test]
fn every_key_that_does_something_while_a_volume_is_shown_is_listed_and_no_other() {
    let listed = listed(&[VOLUME_CONTROLS[0], FILES, WINDOW]);
    for (modifiers, held) in HELD {
        for (key, name) in keys() {
            let (name, press) =
                (format!("{held}{name}"), InputEvent::Key { key, is_pressed: true, is_repeat: false });
            let mut person = Person::new();
            person.facts.labels = vec!["nuclei".to_owned()];
            person.does(InputEvent::Modifiers(modifiers));
            let mut input = Input::default();
            input.on_event(InputEvent::Modifiers(modifiers), [640, 480], Duration::ZERO);
            let action = input.on_event(press, [640, 480], Duration::ZERO);
            let acts = person.does(press) != VolumeHeard::Other
                || action.is_some_and(|action| action.is_of_window());
            // Keys that do with others what they do alone.
            let is_alike = match held {
                "Shift + " => true,
                "Alt + " => matches!(key, Key::F(_)),
                "Ctrl + " => !matches!(key, Key::Char(_)),
                _ => false,
            };
            let is_listed = listed.contains(&name);
            assert!(acts || !is_listed, "{name} is listed and does nothing");
            assert!(is_listed || !acts || is_alike, "{name} is not listed");
        }
    }
}
