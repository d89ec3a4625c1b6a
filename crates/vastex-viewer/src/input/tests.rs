//! What keys, the pointer and fingers come to.

use super::glide::{FASTEST_GLIDE, FRICTION};
use super::held::{FASTER, WALK_PER_SECOND, ZOOM_PER_SECOND, walk};
use super::*;

const SIZE: [u32; 2] = [200, 100];

fn control(control: bool) -> InputEvent {
    InputEvent::Modifiers(Modifiers { control, ..Modifiers::default() })
}

fn click(input: &mut Input, ms: u64) -> Option<Action> {
    let event = InputEvent::Button { button: Button::Primary, is_pressed: true };
    input.on_event(event, SIZE, Duration::from_millis(ms))
}

#[test]
fn two_quick_clicks_reset_and_slow_ones_do_not() {
    let mut input = Input::default();
    assert_eq!(click(&mut input, 0), None);
    assert_eq!(click(&mut input, 200), Some(Action::DoubleClick));
    assert_eq!(click(&mut input, 300), None, "the third click begins anew");
    assert_eq!(click(&mut input, 2000), None);
}

#[test]
fn a_click_is_a_press_that_is_let_go_where_it_was() {
    let mut input = Input::default();
    let mut at = |event, ms: u64| input.on_event(event, SIZE, Duration::from_millis(ms));
    let button = |is_pressed| InputEvent::Button { button: Button::Primary, is_pressed };
    let place = DVec2::new(50.0, 40.0);
    at(InputEvent::PointerMoved(place), 0);
    at(button(true), 0);
    assert_eq!(at(button(false), 900), Some(Action::Click(place)), "however long it was held");
    at(button(true), 2000);
    at(InputEvent::PointerMoved(place + 20.0), 2050);
    assert_eq!(at(button(false), 2100), None, "a drag");
    // Of two on the same place the first is a click as well.
    at(button(true), 4000);
    assert_eq!(at(button(false), 4050), Some(Action::Click(place + 20.0)));
    assert_eq!(at(button(true), 4100), Some(Action::DoubleClick));
    assert_eq!(at(button(false), 4150), None);
}

#[test]
fn held_keys_move_by_the_time_and_opposite_ones_cancel() {
    let Move::Walk(step, zoom) = walk(&[Motion::Right, Motion::In], Duration::from_millis(500), 1.0) else {
        unreachable!()
    };
    assert_eq!(step, DVec2::new(WALK_PER_SECOND / 2.0, 0.0));
    assert!((zoom - ZOOM_PER_SECOND.sqrt()).abs() < 1e-6);
    let still = walk(&[Motion::Left, Motion::Right], Duration::from_secs(1), 1.0);
    assert_eq!(still, Move::Walk(DVec2::ZERO, 1.0));
}

#[test]
fn keys_act_once_and_the_pointer_drags_while_it_is_down() {
    let (mut input, now) = (Input::default(), Duration::ZERO);
    let key = |key, is_pressed, is_repeat| InputEvent::Key { key, is_pressed, is_repeat };
    assert_eq!(input.on_event(key(Key::Char('L'), true, false), SIZE, now), Some(Action::Overlay));
    assert_eq!(input.on_event(key(Key::Char('l'), true, true), SIZE, now), None);
    assert!(matches!(input.on_event(key(Key::Left, true, false), SIZE, now), Some(Action::Move(_))));
    assert!(input.is_moving() && input.motion(Duration::from_millis(100)).is_some());
    input.on_event(key(Key::Left, false, false), SIZE, now);
    assert!(!input.is_moving());
    let moved = |x| InputEvent::PointerMoved(DVec2::new(x, 50.0));
    assert_eq!(input.on_event(moved(10.0), SIZE, now), None);
    click(&mut input, 0);
    let drag = Action::Move(Move::Grab(DVec2::new(-0.9, 0.0), DVec2::new(-0.4, 0.0)));
    assert_eq!(input.on_event(moved(60.0), SIZE, now), Some(drag));
    input.on_event(InputEvent::FocusLost, SIZE, now);
    assert_eq!(input.on_event(moved(70.0), SIZE, now), None);
}

fn at(input: &mut Input, event: InputEvent, ms: u64) -> Option<Action> {
    input.on_event(event, SIZE, Duration::from_millis(ms))
}

/// A pixel to the right in each millisecond, for 60 of them.
fn drag(input: &mut Input, since: u64) {
    for ms in 0..=60 {
        at(input, InputEvent::PointerMoved(DVec2::new(ms as f64, 50.0)), since + ms);
    }
}

#[test]
fn a_drag_that_is_let_go_in_motion_goes_on_and_comes_to_rest() {
    let mut input = Input::default();
    let release = InputEvent::Button { button: Button::Primary, is_pressed: false };
    click(&mut input, 1000);
    // Ten heights a second, which is more than it goes on with.
    drag(&mut input, 1000);
    assert!(at(&mut input, release, 1060).is_none() && input.is_moving());
    let (mut way, mut frames) = (DVec2::ZERO, 0);
    while input.is_moving() {
        frames += 1;
        match input.motion(Duration::from_millis(1060 + 16 * frames)) {
            Some(Move::Drag(delta)) => way += delta,
            other => panic!("{other:?}"),
        }
    }
    // All of it is the speed by the friction.
    assert!((way.x - FASTEST_GLIDE / FRICTION).abs() < 0.01 && way.y == 0.0, "{way}");
    assert!((60..120).contains(&frames), "{frames} frames");
    // Events that come all at once are those of some time.
    let mut burst = Input::default();
    click(&mut burst, 1000);
    for x in 0..=10 {
        at(&mut burst, InputEvent::PointerMoved(DVec2::new(f64::from(x), 50.0)), 1000);
    }
    at(&mut burst, release, 1000);
    let Some(Move::Drag(delta)) = burst.motion(Duration::from_millis(1010)) else { panic!("it is at rest") };
    assert!((0.015..0.02).contains(&delta.x), "10 pixels in 50 ms, for 10 ms: {delta}");
    // A pointer that stands still before it is let go leaves everything where it is.
    click(&mut input, 9000);
    drag(&mut input, 9000);
    at(&mut input, release, 9200);
    assert!(!input.is_moving());
    // A key that means something else stops what goes on.
    click(&mut input, 20_000);
    drag(&mut input, 20_000);
    at(&mut input, release, 20_060);
    assert!(input.is_moving());
    at(&mut input, InputEvent::Key { key: Key::Home, is_pressed: true, is_repeat: false }, 20_070);
    assert!(!input.is_moving());
    // So does a click.
    click(&mut input, 12_000);
    drag(&mut input, 12_000);
    at(&mut input, release, 12_060);
    assert!(input.is_moving());
    click(&mut input, 13_000);
    assert!(!input.is_moving());
}

#[test]
fn digits_magnify_and_with_control_they_reduce() {
    let mut input = Input::default();
    let key = |key, is_pressed| InputEvent::Key { key, is_pressed, is_repeat: false };
    at(&mut input, InputEvent::PointerMoved(DVec2::new(150.0, 50.0)), 0);
    let point = DVec2::new(0.5, 0.0);
    assert_eq!(at(&mut input, key(Key::Char('1'), true), 0), Some(Action::Magnify(1.0, point)));
    assert_eq!(at(&mut input, key(Key::Char('1'), false), 0), None);
    at(&mut input, control(true), 0);
    assert_eq!(at(&mut input, key(Key::Char('4'), true), 0), Some(Action::Magnify(0.25, point)));
    // With control, letters do only what they are known for.
    assert_eq!(at(&mut input, key(Key::Char('c'), true), 0), Some(Action::CopyView));
    assert_eq!(at(&mut input, key(Key::Char('q'), true), 0), Some(Action::Quit));
    for letter in ['t', 'l', 'p', 'r', 'b', 'm'] {
        assert_eq!(at(&mut input, key(Key::Char(letter), true), 0), None, "control and {letter}");
    }
    at(&mut input, InputEvent::FocusLost, 0);
    assert_eq!(at(&mut input, key(Key::Char('9'), true), 0), Some(Action::Magnify(9.0, point)));
    assert_eq!(at(&mut input, key(Key::Char('0'), true), 0), Some(Action::Reset));
    // Without a pointer over the view they go towards its middle.
    at(&mut input, InputEvent::PointerLeft, 0);
    assert_eq!(at(&mut input, key(Key::Char('2'), true), 0), Some(Action::Magnify(2.0, DVec2::ZERO)));
    assert_eq!(
        at(&mut Input::default(), key(Key::Char('2'), true), 0),
        Some(Action::Magnify(2.0, DVec2::ZERO))
    );
}

#[test]
fn a_pinch_is_no_click() {
    let mut input = Input::default();
    let mut touch = |finger, is_down, ms: u64| {
        let event = InputEvent::Touch { finger, is_down, place: DVec2::new(50.0, 40.0) };
        input.on_event(event, SIZE, Duration::from_millis(ms))
    };
    assert_eq!(touch(7, true, 0), None);
    assert_eq!(touch(7, false, 50), Some(Action::Click(DVec2::new(50.0, 40.0))));
    for (finger, is_down, ms) in [(7, true, 2000), (3, true, 2010), (3, false, 2100), (7, false, 2110)] {
        assert_eq!(touch(finger, is_down, ms), None, "finger {finger} at {ms}");
    }
    // Nor is it the first half of a double click.
    assert_eq!(touch(7, true, 2200), None);
}

#[test]
fn one_finger_drags_and_two_pinch() {
    let mut input = Input::default();
    let touch =
        |finger, is_down, x: f64, y: f64| InputEvent::Touch { finger, is_down, place: DVec2::new(x, y) };
    assert_eq!(at(&mut input, touch(7, true, 100.0, 50.0), 0), None);
    let drag = Action::Move(Move::Grab(DVec2::ZERO, DVec2::new(0.1, 0.0)));
    assert_eq!(at(&mut input, touch(7, true, 110.0, 50.0), 10), Some(drag));
    assert_eq!(at(&mut input, touch(3, true, 90.0, 50.0), 20), None, "the second one changes nothing yet");
    let pinch = Action::Move(Move::Pinch(DVec2::new(0.1, 0.0), 2.0, DVec2::new(0.1, 0.0)));
    assert_eq!(at(&mut input, touch(7, true, 130.0, 50.0), 30), Some(pinch));
    assert_eq!(at(&mut input, touch(3, false, 90.0, 50.0), 40), None);
    let drag = Action::Move(Move::Grab(DVec2::new(0.3, 0.0), DVec2::new(0.3, 0.1)));
    assert_eq!(at(&mut input, touch(7, true, 130.0, 60.0), 50), Some(drag), "the one that is left drags");
    assert_eq!(at(&mut input, touch(7, false, 130.0, 60.0), 500), None);
    assert!(!input.is_moving());
}

#[test]
fn control_turns_and_tilts_instead_of_moving() {
    let mut input = Input::default();
    let key = |key, is_pressed| InputEvent::Key { key, is_pressed, is_repeat: false };
    let button = |is_pressed| InputEvent::Button { button: Button::Primary, is_pressed };
    at(&mut input, InputEvent::PointerMoved(DVec2::new(50.0, 50.0)), 0);
    at(&mut input, control(true), 0);
    at(&mut input, button(true), 0);
    let turned = at(&mut input, InputEvent::PointerMoved(DVec2::new(60.0, 40.0)), 10);
    let angles = DVec2::new(0.1, 0.1) * ORBIT_PER_HEIGHT;
    assert_eq!(turned, Some(Action::Move(Move::Orbit(angles))), "upwards is towards the horizon");
    at(&mut input, button(false), 11);
    assert!(!input.is_moving(), "what is turned does not go on");
    assert!(
        matches!(at(&mut input, key(Key::Up, true), 20), Some(Action::Move(Move::Orbit(angles))) if angles.y > 0.0)
    );
    assert!(matches!(input.motion(Duration::from_millis(120)), Some(Move::Orbit(_))));
    // The key is let go after control.
    at(&mut input, control(false), 130);
    at(&mut input, key(Key::Up, false), 140);
    assert!(!input.is_moving());
    assert!(matches!(at(&mut input, key(Key::Up, true), 200), Some(Action::Move(Move::Walk(..)))));
    assert_eq!(at(&mut input, key(Key::Char('z'), true), 210), Some(Action::Move(Move::Upright)));
}

#[test]
fn two_fingers_on_a_touchpad_move_and_zoom() {
    let mut input = Input::default();
    at(&mut input, InputEvent::PointerMoved(DVec2::new(150.0, 50.0)), 0);
    let point = DVec2::new(0.5, 0.0);
    let moved = at(&mut input, InputEvent::Scroll(DVec2::new(10.0, -20.0)), 10);
    assert_eq!(moved, Some(Action::Move(Move::Pinch(DVec2::new(0.1, -0.2), 1.0, point))));
    let spread = at(&mut input, InputEvent::Spread(1.5), 20);
    assert_eq!(spread, Some(Action::Move(Move::Pinch(DVec2::ZERO, 1.5, point))));
    for (told, taken) in [(1e9, 5.0), (-3.0, 0.2), (f64::NAN, 1.0)] {
        let spread = at(&mut input, InputEvent::Spread(told), 30);
        assert_eq!(spread, Some(Action::Move(Move::Pinch(DVec2::ZERO, taken, point))), "{told}");
    }
    at(&mut input, control(true), 40);
    let zoomed = at(&mut input, InputEvent::Scroll(DVec2::new(10.0, 50.0)), 50);
    assert_eq!(zoomed, Some(Action::Move(Move::ZoomTo(WHEEL_FACTOR, point))));
}

/// What keys do that are known from other viewers, and that they do not do it alone.
#[test]
fn keys_with_control_alt_and_shift_are_those_of_other_programs() {
    let mut input = Input::default();
    let key = |key, is_pressed| InputEvent::Key { key, is_pressed, is_repeat: false };
    let held = |control, shift, alt| InputEvent::Modifiers(Modifiers { control, shift, alt });
    let mut once = |modifiers: InputEvent, pressed: Key| {
        at(&mut input, modifiers, 0);
        let action = at(&mut input, key(pressed, true), 0);
        at(&mut input, key(pressed, false), 0);
        at(&mut input, held(false, false, false), 0);
        action
    };
    let (control, alt) = (held(true, false, false), held(false, false, true));
    for (letter, action) in [
        ('o', Action::Open),
        ('s', Action::Screenshot(1)),
        ('S', Action::Screenshot(1)),
        ('c', Action::CopyView),
        ('C', Action::CopyView),
        ('v', Action::PasteView),
        ('q', Action::Quit),
    ] {
        assert_eq!(once(control, Key::Char(letter)), Some(action), "Ctrl + {letter}");
        assert_eq!(once(alt, Key::Char(letter)), None, "Alt + {letter}");
    }
    // Shift decides, whatever Caps Lock makes of the letter.
    for letter in ['c', 'C'] {
        let with_shift = once(held(true, true, false), Key::Char(letter));
        assert_eq!(with_shift, Some(Action::CopyLink), "Ctrl + Shift + {letter}");
    }
    for (pressed, action) in [
        (Key::Left, Some(Action::File(-1))),
        (Key::Right, Some(Action::File(1))),
        (Key::Enter, Some(Action::About)),
        (Key::F(11), Some(Action::FillScreen)),
        (Key::F(4), None),
        (Key::Up, None),
        (Key::Char('3'), None),
    ] {
        assert_eq!(once(alt, pressed), action, "Alt + {pressed:?}");
    }
    let none = held(false, false, false);
    assert_eq!(once(none, Key::Enter), None);
    assert_eq!(once(none, Key::Char('j')), Some(Action::Values));
    // Shift goes faster, and changes nothing else of it.
    let walked = |action: Option<Action>| match action {
        Some(Action::Move(Move::Walk(step, zoom))) => (step, zoom),
        other => panic!("{other:?}"),
    };
    let (slow, fast) = (walked(once(none, Key::Right)), walked(once(held(false, true, false), Key::Right)));
    assert_eq!((slow.0 * FASTER, slow.1), fast);
    assert!(!input.is_moving());
    // Shift that is pressed while an arrow is held counts from then on.
    at(&mut input, key(Key::Right, true), 1000);
    at(&mut input, held(false, true, false), 1000);
    let Some(Move::Walk(step, _)) = input.motion(Duration::from_millis(1100)) else { panic!("at rest") };
    assert!((step.x - 0.1 * WALK_PER_SECOND * FASTER).abs() < 1e-12, "{step}");
    // Alt that comes while it is held does not hold it for good.
    at(&mut input, alt, 1100);
    at(&mut input, key(Key::Right, false), 1100);
    assert!(!input.is_moving());
}

#[test]
fn caps_lock_changes_no_key() {
    let key = |letter| InputEvent::Key { key: Key::Char(letter), is_pressed: true, is_repeat: false };
    for letter in 'a'..='z' {
        for shift in [false, true] {
            let press = |letter| {
                let mut input = Input::default();
                at(&mut input, InputEvent::Modifiers(Modifiers { shift, ..Modifiers::default() }), 0);
                at(&mut input, key(letter), 0)
            };
            assert_eq!(press(letter), press(letter.to_ascii_uppercase()), "{letter}, Shift: {shift}");
        }
    }
    // What Shift changes it changes all the same.
    let mut input = Input::default();
    assert_eq!(at(&mut input, key('T'), 0), Some(Action::Move(Move::Turn(90.0))));
    at(&mut input, InputEvent::Modifiers(Modifiers { shift: true, ..Modifiers::default() }), 0);
    assert_eq!(at(&mut input, key('t'), 0), Some(Action::Move(Move::Turn(-90.0))));
}

/// A key that is held goes through no files, switches nothing on and off and takes no pictures.
#[test]
fn a_key_that_repeats_does_nothing_but_move() {
    let letters = ('!'..='~').map(Key::Char);
    let named = [
        Key::Left,
        Key::Right,
        Key::Up,
        Key::Down,
        Key::Escape,
        Key::Enter,
        Key::Home,
        Key::Tab,
        Key::Backspace,
        Key::PageDown,
        Key::PageUp,
    ];
    for key in letters.chain(named).chain((1..=12).map(Key::F)) {
        for held in 0..16 {
            let [control, shift, alt, is_flat] = [1, 2, 4, 8].map(|bit| held & bit > 0);
            let mut input = Input::default();
            input.look_flat(is_flat);
            at(&mut input, InputEvent::Modifiers(Modifiers { control, shift, alt }), 0);
            at(&mut input, InputEvent::Key { key, is_pressed: true, is_repeat: false }, 0);
            for ms in [500, 530] {
                let again = at(&mut input, InputEvent::Key { key, is_pressed: true, is_repeat: true }, ms);
                let is_motion = |moved| matches!(moved, Move::ToEdge(_) | Move::Screens(_));
                let is_allowed = match again {
                    None => true,
                    Some(Action::Move(moved)) => is_motion(moved),
                    Some(_) => false,
                };
                assert!(is_allowed, "{key:?} with {control}, {shift}, {alt} repeats {again:?}");
            }
        }
    }
}

#[test]
fn over_a_flat_image_arrows_reach_its_edges_and_go_on_by_views() {
    let key = |key, is_pressed, is_repeat| InputEvent::Key { key, is_pressed, is_repeat };
    let held = |control, shift| InputEvent::Modifiers(Modifiers { control, shift, alt: false });
    let mut input = Input::default();
    input.look_flat(true);
    for (pressed, side) in
        [(Key::Left, DVec2::NEG_X), (Key::Right, DVec2::X), (Key::Up, DVec2::NEG_Y), (Key::Down, DVec2::Y)]
    {
        at(&mut input, held(true, false), 0);
        assert_eq!(at(&mut input, key(pressed, true, false), 0), Some(Action::Move(Move::ToEdge(side))));
        at(&mut input, key(pressed, false, false), 0);
        at(&mut input, held(false, true), 0);
        for is_repeat in [false, true] {
            let moved = at(&mut input, key(pressed, true, is_repeat), 0);
            assert_eq!(moved, Some(Action::Move(Move::Screens(side))));
        }
        at(&mut input, key(pressed, false, false), 0);
        assert!(!input.is_moving(), "{pressed:?} is held for good");
    }
    // An arrow that walks already goes on to walk, faster.
    at(&mut input, held(false, false), 1000);
    at(&mut input, key(Key::Right, true, false), 1000);
    at(&mut input, held(false, true), 1000);
    assert_eq!(at(&mut input, key(Key::Right, true, true), 1000), None);
    let Some(Move::Walk(step, _)) = input.motion(Duration::from_millis(1100)) else { panic!("at rest") };
    assert!((step.x - 0.1 * WALK_PER_SECOND * FASTER).abs() < 1e-12, "{step}");
    at(&mut input, key(Key::Right, false, false), 1100);
    // On a globe they turn and tilt, and walk.
    input.look_flat(false);
    at(&mut input, held(true, false), 1200);
    assert!(matches!(at(&mut input, key(Key::Left, true, false), 1200), Some(Action::Move(Move::Orbit(_)))));
}

#[test]
fn fingers_that_leave_a_touchpad_in_motion_let_go_of_what_they_moved() {
    let mut input = Input::default();
    at(&mut input, InputEvent::PointerMoved(DVec2::new(150.0, 50.0)), 0);
    let scroll = |input: &mut Input, since: u64| {
        for step in 1..=10 {
            at(input, InputEvent::Scroll(DVec2::new(4.0, 0.0)), since + 8 * step);
            assert!(!input.is_moving(), "it goes on while the fingers are there");
        }
    };
    scroll(&mut input, 1000);
    assert_eq!(at(&mut input, InputEvent::ScrollEnd(DVec2::ZERO), 1090), None);
    let (mut way, mut frames) = (DVec2::ZERO, 0);
    while input.is_moving() {
        frames += 1;
        match input.motion(Duration::from_millis(1090 + 16 * frames)) {
            Some(Move::Drag(delta)) => way += delta,
            other => panic!("{other:?}"),
        }
    }
    // Half a pixel a millisecond in a view of 100 pixels is 5 heights a second, which friction ends.
    let expected = (0.36 / 0.082f64).min(FASTEST_GLIDE) / FRICTION;
    assert!((way.x - expected).abs() < 0.12 && way.y == 0.0, "{way}, beside {expected}");
    // Its last step may come with the end, and the end of one axis after that of the other.
    scroll(&mut input, 5000);
    let last = at(&mut input, InputEvent::ScrollEnd(DVec2::new(4.0, 0.0)), 5088);
    assert!(matches!(last, Some(Action::Move(Move::Pinch(delta, ..))) if delta.x == 0.04), "{last:?}");
    assert!(input.is_moving());
    at(&mut input, InputEvent::ScrollEnd(DVec2::ZERO), 5089);
    assert!(input.is_moving(), "the second axis stops what the first one left");
    // Fingers that come back stop it, and so does the next step of them.
    at(&mut input, InputEvent::Scroll(DVec2::ZERO), 5100);
    assert!(!input.is_moving());
    // Fingers that rest before they leave, and zooms, leave everything where it is.
    scroll(&mut input, 9000);
    at(&mut input, InputEvent::ScrollEnd(DVec2::ZERO), 9400);
    assert!(!input.is_moving());
    at(&mut input, control(true), 12_000);
    at(&mut input, InputEvent::Scroll(DVec2::new(0.0, 50.0)), 12_010);
    at(&mut input, InputEvent::ScrollEnd(DVec2::ZERO), 12_020);
    assert!(!input.is_moving());
}

/// Beside a panel the camera looks at the middle of what is free; pixels are those of the picture.
#[test]
fn beside_a_panel_places_are_told_from_the_middle_of_what_is_free() {
    let view = PicturePart::around(SIZE, [DVec2::ZERO, DVec2::new(80.0, 100.0)]);
    let (mut input, now) = (Input::default(), Duration::ZERO);
    let mut at = |event| input.on_event(event, view, now);
    let to = |pixel: [f64; 2]| InputEvent::PointerMoved(pixel.into());
    let press = |button, is_pressed| InputEvent::Button { button, is_pressed };
    at(to([40.0, 50.0]));
    let nearer = |point| Some(Action::Move(Move::ZoomTo(WHEEL_FACTOR, point)));
    assert_eq!(at(InputEvent::Wheel(1.0)), nearer(DVec2::ZERO));
    at(to([120.0, 30.0]));
    assert_eq!(at(InputEvent::Wheel(1.0)), nearer(DVec2::new(1.0, -0.25)));
    assert_eq!(at(press(Button::Secondary, true)), Some(Action::Explain([120, 30])));
    at(press(Button::Primary, true));
    let grab = Move::Grab(DVec2::new(1.0, -0.25), DVec2::new(0.5, 0.0));
    assert_eq!(at(to([80.0, 50.0])), Some(Action::Move(grab)));
}

/// Every key that does something stands in the list of keys.
#[test]
fn the_list_of_keys_has_all_of_them() {
    let listed: String =
        CONTROLS.iter().flat_map(|(_, part)| part.iter()).map(|(keys, _)| format!(" {keys},")).collect();
    let has = |name: &str| listed.contains(&format!(" {name},")) || listed.contains(&format!(" {name} "));
    let named = |key: Key| match key {
        Key::Char(letter) => letter.to_uppercase().to_string(),
        Key::F(number) => format!("F{number}"),
        Key::PageDown => "Page Down".into(),
        Key::PageUp => "Page Up".into(),
        key => format!("{key:?}"),
    };
    let letters = ('!'..='~').filter(|letter| !letter.is_ascii_digit()).map(Key::Char);
    let others = [Key::Escape, Key::Home, Key::Tab, Key::PageDown, Key::PageUp];
    let functions = (1..=12).map(Key::F);
    for key in letters.chain(others).chain(functions) {
        // F1 to F4 stand there as what they are from and to; the same keys without Shift write others.
        let is_within = matches!(key, Key::F(2..=3) | Key::Char('=' | '_' | '+' | '-'));
        let is_used = action_of(key).is_some() || motion_of(key).is_some();
        assert!(!is_used || is_within || has(&named(key)), "{key:?} is not in: {listed}");
    }
    for letter in ('a'..='z').filter(|letter| action_with_control(*letter).is_some()) {
        assert!(has(&format!("Ctrl + {}", letter.to_uppercase())), "control and {letter}: {listed}");
    }
    for (key, name) in [(Key::Left, "left"), (Key::Right, "right"), (Key::Enter, "Enter")] {
        assert!(action_with_alt(key).is_some() && has(&format!("Alt + {name}")), "{listed}");
    }
}
