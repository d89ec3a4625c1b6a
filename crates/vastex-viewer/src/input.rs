//! What keys and the pointer mean: moves of the camera and other actions.
//!
//! Neither a window nor a picture is known here: a host translates its own events into [`InputEvent`] and carries the [`Action`]s
//! out. Times are told as how long ago the host began.

use std::time::Duration;

use glam::DVec2;

use crate::camera::Move;
use crate::scene::Scene;

/// Two clicks within this time, and so many pixels, are a double click.
const DOUBLE_CLICK: (Duration, f64) = (Duration::from_millis(400), 6.0);
/// Factor of a notch of the wheel.
const WHEEL_FACTOR: f64 = 1.25;
/// Steps per second of a key that is held; see [`crate::Pose::walked`].
const WALK_PER_SECOND: f64 = 0.8;
/// Factor per second of a zoom key that is held.
const ZOOM_PER_SECOND: f64 = 3.0;
/// What a short press is worth, and the longest that one frame is worth.
const SHORT_PRESS: Duration = Duration::from_millis(80);
const LONGEST_FRAME: Duration = Duration::from_millis(250);

/// A key, by what it writes or is called.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Key {
    /// The arrow to the left.
    Left,
    /// The arrow to the right.
    Right,
    /// The arrow upwards.
    Up,
    /// The arrow downwards.
    Down,
    /// Escape.
    Escape,
    /// Home.
    Home,
    /// The tabulator.
    Tab,
    /// A page down.
    PageDown,
    /// A page up.
    PageUp,
    /// The eleventh function key.
    F11,
    /// A key that writes this character, in lower or upper case.
    Char(char),
}

/// A button of the pointer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Button {
    /// The main one, or a touch.
    Primary,
    /// The other one.
    Secondary,
}

/// What a host says happened.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum InputEvent {
    /// A key went down or up.
    Key {
        /// The key.
        key: Key,
        /// Whether it went down.
        is_pressed: bool,
        /// Whether it was down before, and only says so again.
        is_repeat: bool,
    },
    /// The pointer is there, in pixels from the top left of the view.
    PointerMoved(DVec2),
    /// A button went down or up.
    Button {
        /// The button.
        button: Button,
        /// Whether it went down.
        is_pressed: bool,
    },
    /// The wheel was turned by so many notches, away from the person.
    Wheel(f64),
    /// Keys and pointer belong to something else from here on.
    FocusLost,
    /// The view can be seen again.
    Shown,
}

/// Something that a person wants.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Action {
    /// The camera elsewhere.
    Move(Move),
    /// The first pose again.
    Reset,
    /// The file so many after the one that is shown, or before it.
    File(i32),
    /// Another scene, or the next.
    Scene(Option<Scene>),
    /// The next overlay in the place of the picture, or the picture again.
    Overlay,
    /// Why the pixel below the pointer shows what it shows, in pixels of the view.
    Explain([u32; 2]),
    /// The whole screen, or the window again.
    FillScreen,
    /// The picture again: it may be stale.
    Redraw,
    /// The end.
    Quit,
}

/// A motion that goes on while its key is held.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Motion {
    Left,
    Right,
    Forward,
    Back,
    In,
    Out,
}

/// Keys and pointer as they are now.
#[derive(Debug, Default)]
pub struct Input {
    held: Vec<Motion>,
    /// Up to when the motions have been carried out.
    moved_at: Option<Duration>,
    pointer: DVec2,
    is_dragging: bool,
    /// When and where the last click was.
    clicked: Option<(Duration, DVec2)>,
}

impl Input {
    /// What an event means in a view of `size` pixels, if anything.
    pub fn on_event(&mut self, event: InputEvent, size: [u32; 2], now: Duration) -> Option<Action> {
        let [width, height] = size.map(|side| f64::from(side.max(1)));
        match event {
            InputEvent::Key { key, is_pressed, is_repeat } => self.on_key(key, is_pressed, is_repeat, now),
            InputEvent::PointerMoved(pointer) => {
                let delta = pointer - std::mem::replace(&mut self.pointer, pointer);
                self.is_dragging.then_some(Action::Move(Move::Drag(delta / height)))
            }
            InputEvent::Button { button: Button::Primary, is_pressed } => self.on_click(is_pressed, now),
            InputEvent::Button { button: Button::Secondary, is_pressed } => is_pressed
                .then(|| Action::Explain(self.pointer.max(DVec2::ZERO).to_array().map(|place| place as u32))),
            InputEvent::Wheel(notches) => {
                let point = (self.pointer - DVec2::new(width, height) / 2.0) / height;
                Some(Action::Move(Move::ZoomTo(WHEEL_FACTOR.powf(notches), point)))
            }
            InputEvent::FocusLost => {
                self.held.clear();
                self.is_dragging = false;
                None
            }
            InputEvent::Shown => Some(Action::Redraw),
        }
    }

    /// Whether something goes on while nothing happens.
    pub fn is_moving(&self) -> bool {
        !self.held.is_empty()
    }

    /// What the keys that are held are worth since they were asked last.
    pub fn motion(&mut self, now: Duration) -> Option<Move> {
        if self.held.is_empty() {
            return None;
        }
        let since = self.moved_at.replace(now).unwrap_or(now);
        Some(walk(&self.held, now.saturating_sub(since).min(LONGEST_FRAME)))
    }

    fn on_click(&mut self, is_pressed: bool, now: Duration) -> Option<Action> {
        self.is_dragging = is_pressed;
        if !is_pressed {
            return None;
        }
        let (time, distance) = DOUBLE_CLICK;
        let is_double = |&(then, place): &(Duration, DVec2)| {
            now.saturating_sub(then) < time && place.distance(self.pointer) < distance
        };
        if self.clicked.take_if(|clicked| is_double(clicked)).is_some() {
            return Some(Action::Reset);
        }
        self.clicked = Some((now, self.pointer));
        None
    }

    fn on_key(&mut self, key: Key, is_pressed: bool, is_repeat: bool, now: Duration) -> Option<Action> {
        let Some(motion) = motion_of(key) else {
            return (is_pressed && !is_repeat).then(|| action_of(key)).flatten();
        };
        if !is_pressed {
            self.held.retain(|&held| held != motion);
        } else if !self.held.contains(&motion) {
            if self.held.is_empty() {
                self.moved_at = Some(now);
            }
            self.held.push(motion);
            return Some(Action::Move(walk(&[motion], SHORT_PRESS)));
        }
        None
    }
}

fn walk(motions: &[Motion], time: Duration) -> Move {
    let (mut step, mut zoom) = (DVec2::ZERO, 0.0);
    for motion in motions {
        match motion {
            Motion::Left => step.x -= 1.0,
            Motion::Right => step.x += 1.0,
            Motion::Forward => step.y += 1.0,
            Motion::Back => step.y -= 1.0,
            Motion::In => zoom += 1.0,
            Motion::Out => zoom -= 1.0,
        }
    }
    let seconds = time.as_secs_f64();
    Move::Walk(step * WALK_PER_SECOND * seconds, ZOOM_PER_SECOND.powf(zoom * seconds))
}

fn motion_of(key: Key) -> Option<Motion> {
    Some(match key {
        Key::Left | Key::Char('a' | 'A') => Motion::Left,
        Key::Right | Key::Char('d' | 'D') => Motion::Right,
        Key::Up | Key::Char('w' | 'W') => Motion::Forward,
        Key::Down | Key::Char('s' | 'S') => Motion::Back,
        // The same key, with Shift let go before it.
        Key::Char('+' | '=') => Motion::In,
        Key::Char('-' | '_') => Motion::Out,
        _ => return None,
    })
}

fn action_of(key: Key) -> Option<Action> {
    Some(match key {
        Key::Escape | Key::Char('q' | 'Q') => Action::Quit,
        Key::Home | Key::Char('r' | 'R') => Action::Reset,
        Key::PageDown | Key::Char('n' | 'N') => Action::File(1),
        Key::PageUp | Key::Char('p' | 'P') => Action::File(-1),
        Key::Tab => Action::Scene(None),
        Key::F11 | Key::Char('f' | 'F') => Action::FillScreen,
        Key::Char('o' | 'O') => Action::Overlay,
        Key::Char('1') => Action::Scene(Some(Scene::Image)),
        Key::Char('2') => Action::Scene(Some(Scene::Plane)),
        Key::Char('3') => Action::Scene(Some(Scene::Globe)),
        Key::Char('4') => Action::Scene(Some(Scene::Terrain)),
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [u32; 2] = [200, 100];

    fn click(input: &mut Input, ms: u64) -> Option<Action> {
        let event = InputEvent::Button { button: Button::Primary, is_pressed: true };
        input.on_event(event, SIZE, Duration::from_millis(ms))
    }

    #[test]
    fn two_quick_clicks_reset_and_slow_ones_do_not() {
        let mut input = Input::default();
        assert_eq!(click(&mut input, 0), None);
        assert_eq!(click(&mut input, 200), Some(Action::Reset));
        assert_eq!(click(&mut input, 300), None, "the third click begins anew");
        assert_eq!(click(&mut input, 2000), None);
    }

    #[test]
    fn held_keys_move_by_the_time_and_opposite_ones_cancel() {
        let Move::Walk(step, zoom) = walk(&[Motion::Right, Motion::In], Duration::from_millis(500)) else {
            unreachable!()
        };
        assert_eq!(step, DVec2::new(WALK_PER_SECOND / 2.0, 0.0));
        assert!((zoom - ZOOM_PER_SECOND.sqrt()).abs() < 1e-6);
        let still = walk(&[Motion::Left, Motion::Right], Duration::from_secs(1));
        assert_eq!(still, Move::Walk(DVec2::ZERO, 1.0));
    }

    #[test]
    fn keys_act_once_and_the_pointer_drags_while_it_is_down() {
        let (mut input, now) = (Input::default(), Duration::ZERO);
        let key = |key, is_pressed, is_repeat| InputEvent::Key { key, is_pressed, is_repeat };
        assert_eq!(input.on_event(key(Key::Char('O'), true, false), SIZE, now), Some(Action::Overlay));
        assert_eq!(input.on_event(key(Key::Char('o'), true, true), SIZE, now), None);
        assert!(matches!(input.on_event(key(Key::Left, true, false), SIZE, now), Some(Action::Move(_))));
        assert!(input.is_moving() && input.motion(Duration::from_millis(100)).is_some());
        input.on_event(key(Key::Left, false, false), SIZE, now);
        assert!(!input.is_moving());
        let moved = |x| InputEvent::PointerMoved(DVec2::new(x, 50.0));
        assert_eq!(input.on_event(moved(10.0), SIZE, now), None);
        click(&mut input, 0);
        let drag = Action::Move(Move::Drag(DVec2::new(0.5, 0.0)));
        assert_eq!(input.on_event(moved(60.0), SIZE, now), Some(drag));
        input.on_event(InputEvent::FocusLost, SIZE, now);
        assert_eq!(input.on_event(moved(70.0), SIZE, now), None);
    }
}
