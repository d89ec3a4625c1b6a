//! What keys and the pointer mean: moves of the camera and other actions.
//!
//! Neither a window nor a picture is known here: a host translates its own events into [`InputEvent`] and
//! carries the [`Action`]s out. Times are told as how long ago the host began.

mod actions;
mod controls;
mod held;

use std::time::Duration;

use glam::DVec2;

pub use controls::CONTROLS;

use crate::camera::Move;
use crate::scene::Scene;
use actions::{action_of, action_with_alt, action_with_control};
use held::{Motion, held_move, motion_of, orbit_of};

/// Two clicks within this time, and so many pixels, are a double click.
const DOUBLE_CLICK: (Duration, f64) = (Duration::from_millis(400), 6.0);
/// Radians that a drag over the height of the view turns and tilts.
const ORBIT_PER_HEIGHT: f64 = 2.0;
/// Factor of a notch of the wheel.
const WHEEL_FACTOR: f64 = 1.25;
/// Pixels of a touchpad that are a notch of the wheel.
const PIXELS_PER_NOTCH: f64 = 50.0;
/// A drag whose last part was at least so fast, in view heights a second, goes on by itself when the pointer
/// is let go, no faster than the second speed, and ends below the third. By friction the speed falls by so
/// much of itself in a second.
const FASTEST_STILL: f64 = 0.15;
const FASTEST_GLIDE: f64 = 6.0;
const SLOWEST_GLIDE: f64 = 0.01;
const FRICTION: f64 = 5.0;
/// The time over which that speed is measured, at most and at least: events that waited for a frame come all
/// at once.
const MEASURED: [Duration; 2] = [Duration::from_millis(100), Duration::from_millis(50)];
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
    /// Enter.
    Enter,
    /// Home.
    Home,
    /// The tabulator.
    Tab,
    /// Backspace.
    Backspace,
    /// A page down.
    PageDown,
    /// A page up.
    PageUp,
    /// A function key, by its number.
    F(u8),
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

/// Keys that change what others mean.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Modifiers {
    /// Control.
    pub control: bool,
    /// Shift.
    pub shift: bool,
    /// Alt.
    pub alt: bool,
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
    /// The pointer is over something else.
    PointerLeft,
    /// A button went down or up.
    Button {
        /// The button.
        button: Button,
        /// Whether it went down.
        is_pressed: bool,
    },
    /// Of the keys that change what others mean these are held from here on.
    Modifiers(Modifiers),
    /// A finger touched the view, moved on it or left it, there in pixels from the top left.
    Touch {
        /// Tells fingers from one another.
        finger: u64,
        /// Whether it touches the view from here on.
        is_down: bool,
        /// Where it is.
        place: DVec2,
    },
    /// The wheel was turned by so many notches, away from the person.
    Wheel(f64),
    /// Two fingers were moved on a touchpad, by which what lies below them moves by so many pixels.
    Scroll(DVec2),
    /// Two fingers were spread on a touchpad, to so many times their distance.
    Spread(f64),
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
    /// The pointer, or a finger, was pressed and let go in the same place: there, in pixels from the top left
    /// of the view. Comes before a [`Action::DoubleClick`], too.
    Click(DVec2),
    /// The second of two clicks on the same place; the first came as [`Action::Click`]. A host that has no
    /// other use for it does what [`Action::Reset`] says.
    DoubleClick,
    /// Measuring, or not any more.
    Measure,
    /// What was done last while measuring, undone.
    Undo,
    /// An image with so many pixels a texel, towards a point in view heights from the middle.
    Magnify(f64, DVec2),
    /// A file that a person chooses in a dialog.
    Open,
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
    /// Black and white by the values that are in view.
    AutoRange,
    /// The next way of comparing the uppermost layer with those beneath it, or none.
    Compare,
    /// Layers side by side, or over one another again.
    Beside,
    /// The panel beside the picture, or the picture alone.
    Panel,
    /// The panel, with the keys in its first control.
    EnterPanel,
    /// What the machine does, beside the picture, or the picture alone.
    Hud,
    /// The guides over an image, or the picture alone.
    Guides,
    /// The value below the pointer in the picture, or not.
    Values,
    /// The list of keys and gestures, or the picture alone.
    Keys,
    /// The picture, so many times as large as the view, into a file.
    Screenshot(u32),
    /// Where the camera goes from here on into a file, or the end of that.
    Record,
    /// The camera as it went when that was recorded last, or as a file says.
    Play,
    /// What is shown, as a text, into the clipboard.
    CopyView,
    /// What is shown and its files, as a link, into the clipboard.
    CopyLink,
    /// What a view or a link in the clipboard says is to be shown.
    PasteView,
    /// The picture again: it may be stale.
    Redraw,
    /// The end.
    Quit,
}

/// Keys and pointer as they are now.
#[derive(Debug, Default)]
pub struct Input {
    held: Vec<Motion>,
    /// Up to when the motions have been carried out.
    moved_at: Option<Duration>,
    pointer: DVec2,
    /// Whether the pointer is over the view.
    has_pointer: bool,
    is_dragging: bool,
    /// Whether that turns and tilts the camera, rather than to move it.
    is_orbiting: bool,
    /// When and where the pointer was lately, while it drags.
    trail: Vec<(Duration, DVec2)>,
    /// How fast the view goes on after a drag, in view heights a second.
    glide: DVec2,
    modifiers: Modifiers,
    /// Fingers on the view, and where they are.
    fingers: Vec<(u64, DVec2)>,
    /// When and where the last click was.
    clicked: Option<(Duration, DVec2)>,
}

impl Input {
    /// What an event means in a view of `size` pixels, if anything.
    pub fn on_event(&mut self, event: InputEvent, size: [u32; 2], now: Duration) -> Option<Action> {
        let [width, height] = size.map(|side| f64::from(side.max(1)));
        match event {
            InputEvent::Key { key, is_pressed, is_repeat } => {
                // Without a pointer towards the middle.
                let point =
                    if self.has_pointer { from_middle(self.pointer, [width, height]) } else { DVec2::ZERO };
                self.on_key((key, point), is_pressed, is_repeat, now)
            }
            InputEvent::PointerMoved(pointer) => {
                self.has_pointer = true;
                self.on_pointer(pointer, [width, height], now)
            }
            InputEvent::PointerLeft => {
                self.has_pointer = false;
                None
            }
            InputEvent::Button { button: Button::Primary, is_pressed } => {
                self.on_click(is_pressed, height, now)
            }
            InputEvent::Modifiers(held) => {
                self.modifiers = held;
                None
            }
            InputEvent::Touch { finger, is_down, place } => {
                self.on_touch(finger, is_down, place, [width, height], now)
            }
            InputEvent::Button { button: Button::Secondary, is_pressed } => is_pressed
                .then(|| Action::Explain(self.pointer.max(DVec2::ZERO).to_array().map(|place| place as u32))),
            InputEvent::Wheel(notches) => {
                let point = from_middle(self.pointer, [width, height]);
                Some(Action::Move(Move::ZoomTo(WHEEL_FACTOR.powf(notches), point)))
            }
            InputEvent::Scroll(pixels) if self.modifiers.control => {
                self.on_event(InputEvent::Wheel(pixels.y / PIXELS_PER_NOTCH), size, now)
            }
            InputEvent::Scroll(pixels) => {
                let point = from_middle(self.pointer, [width, height]);
                Some(Action::Move(Move::Pinch(pixels / height, 1.0, point)))
            }
            InputEvent::Spread(factor) => {
                let point = from_middle(self.pointer, [width, height]);
                let factor = if factor.is_finite() { factor.clamp(0.2, 5.0) } else { 1.0 };
                Some(Action::Move(Move::Pinch(DVec2::ZERO, factor, point)))
            }
            InputEvent::FocusLost => {
                self.held.clear();
                self.fingers.clear();
                (self.is_dragging, self.modifiers, self.glide) = (false, Modifiers::default(), DVec2::ZERO);
                self.is_orbiting = false;
                None
            }
            InputEvent::Shown => Some(Action::Redraw),
        }
    }

    /// Whether something goes on while nothing happens.
    pub fn is_moving(&self) -> bool {
        !self.held.is_empty() || self.glide != DVec2::ZERO
    }

    /// Ends what goes on by itself but for keys that are held: something else is seen.
    pub fn rest(&mut self) {
        self.glide = DVec2::ZERO;
    }

    /// What goes on by itself since that was asked last: what keys that are held are worth, or a drag that
    /// was let go.
    pub fn motion(&mut self, now: Duration) -> Option<Move> {
        if !self.is_moving() {
            return None;
        }
        let since = self.moved_at.replace(now).unwrap_or(now);
        let time = now.saturating_sub(since).min(LONGEST_FRAME);
        if !self.held.is_empty() {
            return Some(held_move(&self.held, time, self.modifiers.shift));
        }
        // The speed falls by friction; what it comes to meanwhile is its integral.
        let left = (-FRICTION * time.as_secs_f64()).exp();
        let delta = self.glide * (1.0 - left) / FRICTION;
        self.glide *= left;
        if self.glide.length() < SLOWEST_GLIDE {
            self.glide = DVec2::ZERO;
        }
        Some(Move::Drag(delta))
    }

    fn on_pointer(&mut self, pointer: DVec2, size: [f64; 2], now: Duration) -> Option<Action> {
        let before = std::mem::replace(&mut self.pointer, pointer);
        if !self.is_dragging {
            return None;
        }
        if self.is_orbiting {
            let delta = (pointer - before) / size[1] * ORBIT_PER_HEIGHT;
            return Some(Action::Move(Move::Orbit(DVec2::new(delta.x, -delta.y))));
        }
        self.trail.retain(|(then, _)| now.saturating_sub(*then) <= MEASURED[0]);
        self.trail.push((now, pointer));
        Some(Action::Move(Move::Grab(from_middle(before, size), from_middle(pointer, size))))
    }

    /// One finger drags as the pointer does, two zoom as well.
    fn on_touch(
        &mut self,
        finger: u64,
        is_down: bool,
        place: DVec2,
        [width, height]: [f64; 2],
        now: Duration,
    ) -> Option<Action> {
        let before = self.fingers.clone();
        self.fingers.retain(|(other, _)| *other != finger);
        if is_down {
            self.fingers.push((finger, place));
            self.fingers.sort_by_key(|(finger, _)| *finger);
        }
        match (&before[..], &self.fingers[..]) {
            ([], [(_, place)]) => {
                self.pointer = *place;
                self.on_click(true, height, now)
            }
            ([(a, _)], [(b, place)]) if a == b => self.on_pointer(*place, [width, height], now),
            ([_], []) => self.on_click(false, height, now),
            ([(a, first), (b, second)], [(c, third), (d, fourth)]) if [a, b] == [c, d] => {
                let middle = (third + fourth) / 2.0;
                let factor = third.distance(*fourth) / first.distance(*second).max(1.0);
                let delta = (middle - (first + second) / 2.0) / height;
                let point = from_middle(middle, [width, height]);
                Some(Action::Move(Move::Pinch(delta, factor.clamp(0.2, 5.0), point)))
            }
            // Another number of fingers: what they do begins anew, and nothing goes on by itself.
            (_, fingers) => {
                if let [(_, place)] = fingers {
                    self.pointer = *place;
                }
                (self.is_dragging, self.glide) = (fingers.len() == 1, DVec2::ZERO);
                self.trail.clear();
                // The one that is left when a pinch ends did not click.
                self.clicked = None;
                None
            }
        }
    }

    fn on_click(&mut self, is_pressed: bool, height: f64, now: Duration) -> Option<Action> {
        let was_dragging = std::mem::replace(&mut self.is_dragging, is_pressed);
        self.glide = DVec2::ZERO;
        let was_orbiting = std::mem::replace(&mut self.is_orbiting, is_pressed && self.modifiers.control);
        if !is_pressed {
            let speed = if was_dragging && !was_orbiting { self.speed(now) / height } else { DVec2::ZERO };
            if speed.length() >= FASTEST_STILL {
                self.glide = speed.clamp_length_max(FASTEST_GLIDE);
            }
            self.moved_at = Some(now);
            self.trail.clear();
            let stayed = |(_, place): &(Duration, DVec2)| place.distance(self.pointer) < DOUBLE_CLICK.1;
            return self
                .clicked
                .filter(|clicked| was_dragging && stayed(clicked))
                .map(|(_, place)| Action::Click(place));
        }
        self.trail.clear();
        let (time, distance) = DOUBLE_CLICK;
        let is_double = |&(then, place): &(Duration, DVec2)| {
            now.saturating_sub(then) < time && place.distance(self.pointer) < distance
        };
        if self.clicked.take_if(|clicked| is_double(clicked)).is_some() {
            return Some(Action::DoubleClick);
        }
        self.clicked = Some((now, self.pointer));
        None
    }

    /// How fast the pointer was lately, in pixels a second.
    fn speed(&self, now: Duration) -> DVec2 {
        let mut lately = self.trail.iter().filter(|(then, _)| now.saturating_sub(*then) <= MEASURED[0]);
        let (Some((then, from)), Some((_, to))) = (lately.next(), lately.next_back()) else {
            return DVec2::ZERO;
        };
        // A pointer that stood still before it was let go is slow.
        (to - from) / now.saturating_sub(*then).max(MEASURED[1]).as_secs_f64()
    }

    fn on_key(
        &mut self,
        (key, point): (Key, DVec2),
        is_pressed: bool,
        is_repeat: bool,
        now: Duration,
    ) -> Option<Action> {
        if is_pressed {
            self.glide = DVec2::ZERO;
        }
        let motion = match is_pressed {
            true if self.modifiers.alt => None,
            true if self.modifiers.control => orbit_of(key),
            true => motion_of(key),
            // Control or Alt may have been let go, or pressed, meanwhile.
            false => [motion_of(key), orbit_of(key)]
                .into_iter()
                .flatten()
                .find(|motion| self.held.contains(motion)),
        };
        let Some(motion) = motion else {
            let action = || {
                if let Some(scale) = self.magnification_of(key) {
                    return Some(Action::Magnify(scale, point));
                }
                match (key, self.modifiers) {
                    (key, Modifiers { alt: true, .. }) => action_with_alt(key),
                    (Key::Char(letter), Modifiers { control: true, .. }) => action_with_control(letter),
                    (key, _) => action_of(key),
                }
            };
            return (is_pressed && !is_repeat).then(action).flatten();
        };
        if !is_pressed {
            self.held.retain(|&held| held != motion);
        } else if !self.held.contains(&motion) {
            if self.held.is_empty() {
                self.moved_at = Some(now);
            }
            self.held.push(motion);
            return Some(Action::Move(held_move(&[motion], SHORT_PRESS, self.modifiers.shift)));
        }
        None
    }
}

impl Input {
    /// What digits are worth: so many pixels a texel, or with control so many texels a pixel.
    fn magnification_of(&self, key: Key) -> Option<f64> {
        let Key::Char(digit @ '1'..='9') = key else { return None };
        if self.modifiers.alt {
            return None;
        }
        let times = f64::from(digit.to_digit(10)?);
        Some(if self.modifiers.control { 1.0 / times } else { times })
    }
}

/// A place of a view in pixels, in view heights from the middle.
fn from_middle(place: DVec2, [width, height]: [f64; 2]) -> DVec2 {
    (place - DVec2::new(width, height) / 2.0) / height
}

#[cfg(test)]
mod tests;
