//! What keys and the pointer mean: moves of the camera and other actions.
//!
//! Neither a window nor a picture is known here: a host translates its own events into [`InputEvent`] and
//! carries the [`Action`]s out. Times are told as how long ago the host began.

mod actions;
mod controls;
mod glide;
mod held;

use std::time::Duration;

use glam::DVec2;

pub use actions::Action;
pub use controls::CONTROLS;
#[cfg(test)]
pub(crate) use controls::named;
#[cfg(any(test, feature = "egui"))]
pub(crate) use controls::{DROPS, FILES, WINDOW, WITHOUT_DROPS};

use crate::camera::Move;
use crate::picture::PicturePart;
use actions::{action_of, action_with_alt, action_with_control};
use glide::{Glide, Trail};
use held::{Motion, arrow_of, held_move, motion_of, orbit_of};

/// Two clicks within this time, and so many pixels, are a double click.
const DOUBLE_CLICK: (Duration, f64) = (Duration::from_millis(400), 6.0);
/// Radians that a drag over the height of the view turns and tilts.
const ORBIT_PER_HEIGHT: f64 = 2.0;
/// Factor of a notch of the wheel.
const WHEEL_FACTOR: f64 = 1.25;
/// Pixels of a touchpad that are a notch of the wheel.
const PIXELS_PER_NOTCH: f64 = 50.0;
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
    /// A key that writes this character. Of letters [`Modifiers::shift`] says whether they are in upper case,
    /// and Caps Lock changes nothing.
    Char(char),
}

/// A button of the pointer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Button {
    /// The main one, or a touch.
    Primary,
    /// The secondary button, on most mice the right one.
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
        /// True if the key went down.
        is_pressed: bool,
        /// True if the key was down before and only says so again. Only what moves the camera is done again
        /// then.
        is_repeat: bool,
    },
    /// The pointer is there, in pixels from the top left of the picture.
    PointerMoved(DVec2),
    /// The pointer is over something else.
    PointerLeft,
    /// A button went down or up.
    Button {
        /// The button.
        button: Button,
        /// True if the button went down.
        is_pressed: bool,
    },
    /// Of the keys that change what others mean these are held from here on.
    Modifiers(Modifiers),
    /// A finger touched the view, moved on it or left it, there in pixels from the top left.
    Touch {
        /// Tells fingers from one another.
        finger: u64,
        /// True if the finger touches the view from here on.
        is_down: bool,
        /// Where the finger is.
        place: DVec2,
    },
    /// The wheel was turned by so many notches, away from the person.
    Wheel(f64),
    /// Two fingers were moved on a touchpad, by which what lies below them moves by so many pixels.
    Scroll(DVec2),
    /// As [`InputEvent::Scroll`], after which the fingers left the touchpad and the system sends nothing more
    /// of it: what they moved goes on as what a pointer lets go does. Of a system that has it go on by
    /// itself, each step is a [`InputEvent::Scroll`], and there is no such event.
    ScrollEnd(DVec2),
    /// Two fingers were spread on a touchpad, to so many times their distance.
    Spread(f64),
    /// Keys and pointer belong to something else from here on.
    FocusLost,
    /// The view can be seen again.
    Shown,
}

/// Keys and pointer as they are now.
#[derive(Debug, Default)]
pub struct Input {
    held: Vec<Motion>,
    /// Up to when the motions have been carried out.
    moved_at: Option<Duration>,
    pointer: DVec2,
    /// True if the pointer is over the view.
    has_pointer: bool,
    is_dragging: bool,
    /// True if that turns and tilts the camera, rather than to move it.
    is_orbiting: bool,
    /// When and where the pointer was lately, while it drags.
    trail: Trail,
    /// How far fingers on a touchpad have moved what is below them.
    scrolled: Trail,
    /// What goes on after that.
    glide: Glide,
    /// True if an image is looked at, flat.
    is_flat: bool,
    modifiers: Modifiers,
    /// Fingers on the view, and where they are.
    fingers: Vec<(u64, DVec2)>,
    /// When and where the last click was.
    clicked: Option<(Duration, DVec2)>,
}

impl Input {
    /// What an event means, if anything, in a picture that is such a part of what the camera sees: all of it,
    /// where that is width and height in pixels alone. Places are in pixels of the picture.
    pub fn on_event(
        &mut self,
        event: InputEvent,
        view: impl Into<PicturePart>,
        now: Duration,
    ) -> Option<Action> {
        self.hear(event, &view.into(), now)
    }

    fn hear(&mut self, event: InputEvent, view: &PicturePart, now: Duration) -> Option<Action> {
        let height = height_of(view);
        match event {
            InputEvent::Key { key, is_pressed, is_repeat } => {
                // Without a pointer towards the middle.
                let point = if self.has_pointer { view.point(self.pointer) } else { DVec2::ZERO };
                self.on_key((key, point), is_pressed, is_repeat, now)
            }
            InputEvent::PointerMoved(pointer) => {
                self.has_pointer = true;
                self.on_pointer(pointer, view, now)
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
            InputEvent::Touch { finger, is_down, place } => self.on_touch(finger, is_down, place, view, now),
            InputEvent::Button { button: Button::Secondary, is_pressed } => is_pressed
                .then(|| Action::Explain(self.pointer.max(DVec2::ZERO).to_array().map(|place| place as u32))),
            InputEvent::Wheel(notches) => {
                let point = view.point(self.pointer);
                Some(Action::Move(Move::ZoomTo(WHEEL_FACTOR.powf(notches), point)))
            }
            InputEvent::Scroll(pixels) if self.modifiers.control => {
                self.hear(InputEvent::Wheel(pixels.y / PIXELS_PER_NOTCH), view, now)
            }
            InputEvent::Scroll(pixels) => {
                self.glide.stop();
                self.scrolled.push_by(now, pixels);
                let point = view.point(self.pointer);
                Some(Action::Move(Move::Pinch(pixels / height, 1.0, point)))
            }
            InputEvent::ScrollEnd(pixels) if pixels != DVec2::ZERO => {
                let moved = self.hear(InputEvent::Scroll(pixels), view, now);
                self.let_scrolled_go(height, now);
                moved
            }
            InputEvent::ScrollEnd(_) => {
                self.let_scrolled_go(height, now);
                None
            }
            InputEvent::Spread(factor) => {
                self.glide.stop();
                self.scrolled.clear();
                let point = view.point(self.pointer);
                let factor = if factor.is_finite() { factor.clamp(0.2, 5.0) } else { 1.0 };
                Some(Action::Move(Move::Pinch(DVec2::ZERO, factor, point)))
            }
            InputEvent::FocusLost => {
                self.held.clear();
                self.fingers.clear();
                self.rest();
                (self.is_dragging, self.is_orbiting) = (false, false);
                self.modifiers = Modifiers::default();
                None
            }
            InputEvent::Shown => Some(Action::Redraw),
        }
    }

    /// Returns true if the camera moves without further events: a key is held, or it glides on.
    pub fn is_moving(&self) -> bool {
        !self.held.is_empty() || self.glide.is_going()
    }

    /// Ends what goes on by itself but for keys that are held: something else is seen.
    pub fn rest(&mut self) {
        self.glide.stop();
        self.scrolled.clear();
    }

    /// Tells that an image is looked at flat, or that it is not: there arrows go to its edges with control
    /// and on by a view with Shift. Elsewhere they turn and tilt the camera, and walk faster. At first
    /// nothing is flat.
    pub fn look_flat(&mut self, is_flat: bool) {
        self.is_flat = is_flat;
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
        Some(Move::Drag(self.glide.step(time)))
    }

    fn on_pointer(&mut self, pointer: DVec2, view: &PicturePart, now: Duration) -> Option<Action> {
        let before = std::mem::replace(&mut self.pointer, pointer);
        if !self.is_dragging {
            return None;
        }
        if self.is_orbiting {
            let delta = (pointer - before) / height_of(view) * ORBIT_PER_HEIGHT;
            return Some(Action::Move(Move::Orbit(DVec2::new(delta.x, -delta.y))));
        }
        self.trail.push(now, pointer);
        Some(Action::Move(Move::Grab(view.point(before), view.point(pointer))))
    }

    /// One finger drags as the pointer does, two zoom as well.
    fn on_touch(
        &mut self,
        finger: u64,
        is_down: bool,
        place: DVec2,
        view: &PicturePart,
        now: Duration,
    ) -> Option<Action> {
        let height = height_of(view);
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
            ([(a, _)], [(b, place)]) if a == b => self.on_pointer(*place, view, now),
            ([_], []) => self.on_click(false, height, now),
            ([(a, first), (b, second)], [(c, third), (d, fourth)]) if [a, b] == [c, d] => {
                let middle = (third + fourth) / 2.0;
                let factor = third.distance(*fourth) / first.distance(*second).max(1.0);
                let delta = (middle - (first + second) / 2.0) / height;
                let point = view.point(middle);
                Some(Action::Move(Move::Pinch(delta, factor.clamp(0.2, 5.0), point)))
            }
            // Another number of fingers: what they do begins anew, and nothing goes on by itself.
            (_, fingers) => {
                if let [(_, place)] = fingers {
                    self.pointer = *place;
                }
                self.is_dragging = fingers.len() == 1;
                self.glide.stop();
                self.trail.clear();
                // The one that is left when a pinch ends did not click.
                self.clicked = None;
                None
            }
        }
    }

    fn on_click(&mut self, is_pressed: bool, height: f64, now: Duration) -> Option<Action> {
        let was_dragging = std::mem::replace(&mut self.is_dragging, is_pressed);
        self.rest();
        let was_orbiting = std::mem::replace(&mut self.is_orbiting, is_pressed && self.modifiers.control);
        if !is_pressed {
            if was_dragging && !was_orbiting {
                self.glide.begin(self.trail.speed(now) / height);
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

    fn on_key(
        &mut self,
        (key, point): (Key, DVec2),
        is_pressed: bool,
        is_repeat: bool,
        now: Duration,
    ) -> Option<Action> {
        let key = self.by_shift(key);
        if is_pressed {
            self.rest();
        }
        if let Some(moved) = self.far_move(key).filter(|_| is_pressed) {
            return Some(Action::Move(moved));
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
    /// What fingers on a touchpad moved until now goes on as fast as it was.
    fn let_scrolled_go(&mut self, height: f64, now: Duration) {
        let speed = self.scrolled.speed(now) / height;
        self.scrolled.clear();
        // Of an axis that ends after the other nothing is new.
        if speed != DVec2::ZERO {
            self.glide.begin(speed);
            self.moved_at = Some(now);
        }
    }

    /// The key that a letter is, in upper case with Shift and in lower case without it, whatever Caps Lock
    /// says.
    fn by_shift(&self, key: Key) -> Key {
        match key {
            Key::Char(letter) if self.modifiers.shift => Key::Char(letter.to_ascii_uppercase()),
            Key::Char(letter) => Key::Char(letter.to_ascii_lowercase()),
            key => key,
        }
    }

    /// What arrows do over a flat image with control and with Shift, but for those that walk already.
    fn far_move(&self, key: Key) -> Option<Move> {
        let (direction, motion) = arrow_of(key)?;
        let Modifiers { control, shift, alt } = self.modifiers;
        match () {
            () if !self.is_flat || alt || self.held.contains(&motion) => None,
            () if control => Some(Move::ToEdge(direction)),
            () if shift => Some(Move::Screens(direction)),
            () => None,
        }
    }

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

/// Pixels from the upper edge of what the camera sees to the lower one.
fn height_of(view: &PicturePart) -> f64 {
    f64::from(view.whole[1].max(1))
}

#[cfg(test)]
mod tests;
