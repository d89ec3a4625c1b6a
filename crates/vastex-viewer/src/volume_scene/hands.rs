//! What keys and the pointer do to a volume in a window.

use glam::DVec2;

use super::look::{VolumeFacts, VolumeLayout, VolumeLook, VolumePane};
use super::sight::{PaneRect, PaneSight};
use crate::input::{Button, InputEvent, Key, Modifiers};
use crate::volume::VolumeMode;

/// Degrees that a drag over the height of a picture turns.
const DEGREES_PER_HEIGHT: f64 = 180.0;
/// Degrees that a press of an arrow turns.
const DEGREES_PER_PRESS: f64 = 5.0;
/// Factor of a notch of the wheel, and pixels of a touchpad that are a notch.
const WHEEL_FACTOR: f64 = 1.15;
const PIXELS_PER_NOTCH: f64 = 50.0;
/// Pixels of a touchpad that are a slice.
const PIXELS_PER_SLICE: f64 = 16.0;
/// Pixels that the pointer may move in a click.
const STILL: f64 = 4.0;
/// Slices that one goes on by with Shift.
const MANY: i64 = 10;

/// What keys and gestures do to volumes, in words for a person.
pub const VOLUME_CONTROLS: &[(&str, &[(&str, &str)])] = &[(
    "Volumes",
    &[
        ("click or drag in a slice", "put the crosshair there, where all slices meet, and tell the values"),
        ("drag in 3-D", "turn the volume; a click puts the crosshair on what is seen there"),
        ("Shift + drag, right drag", "move the picture"),
        ("wheel in a slice, Page Up, Page Down, arrows up and down", "slice by slice; with Shift by tens"),
        ("Ctrl + drag in a slice", "tilt it, about where slices meet"),
        ("T", "all slices upright on their axes again"),
        ("wheel in 3-D, Ctrl + wheel in a slice, + and -, I and O", "zoom"),
        ("arrows", "turn the volume, where it is seen in 3-D"),
        ("Space", "a slice or 3-D, alone"),
        ("X, Y, Z, V", "the slice across that axis alone; 3-D alone"),
        ("4", "three slices and 3-D"),
        ("E", "next mode: mip, minip, average, emission, iso"),
        (
            "L",
            "the labels beside the volume over it, or not; a click selects one, Escape or one beside it none",
        ),
        ("comma, full stop", "the time before, the next time"),
        ("K", "play the times, or stop"),
        ("C", "black and white of each channel by its values"),
        ("0, R, Home, double click", "all of it, as at first"),
        ("two fingers", "move and zoom; on a touchpad slice by slice, with Ctrl and in 3-D they zoom"),
    ],
)];

/// What comes of an event.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum VolumeHeard {
    /// The event is none of a volume's: a host may know what to do with it.
    Other,
    /// What is shown is perhaps another now.
    Taken,
    /// A click: as [`VolumeHeard::Taken`], and what is seen at this pixel of a picture is asked for; the
    /// crosshair goes there in 3-D.
    Click(VolumePane, DVec2),
    /// A click as [`VolumeHeard::Click`] that also selects the label there, or none where there is none.
    Select(VolumePane, DVec2),
    /// Times are to be played, or not any more.
    Play,
    /// Ranges are to be the usual ones again.
    UsualRanges,
}

/// Keys and pointer as they are now.
#[derive(Clone, Debug, Default)]
pub struct VolumeHands {
    /// In pixels of the area, while it is over it.
    pointer: Option<DVec2>,
    held: Option<Held>,
    modifiers: Modifiers,
    /// What a touchpad has scrolled beyond whole slices.
    scrolled: f64,
    /// Fingers, and where they are.
    fingers: Vec<(u64, DVec2)>,
    /// The slice that was seen alone last.
    slice: Option<VolumePane>,
    /// The labels that were shown last.
    labels: usize,
}

/// What becomes of a drag.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Drag {
    /// The crosshair follows, or the volume turns.
    Points,
    /// The picture is moved.
    Moves,
    /// The slice is tilted.
    Tilts,
}

/// A button that is down.
#[derive(Clone, Copy, Debug)]
struct Held {
    pane: PaneRect,
    does: Drag,
    begun: DVec2,
    is_still: bool,
}

/// What an event is heard in.
#[derive(Clone, Copy, Debug)]
pub struct VolumeRoom<'a> {
    /// What is known of the volume.
    pub facts: &'a VolumeFacts,
    /// Where the pictures lie.
    pub panes: &'a [PaneRect],
}

impl VolumeHands {
    /// Where the pointer is in the area, if it is over it.
    pub fn pointer(&self) -> Option<DVec2> {
        self.pointer
    }

    /// The picture that the pointer is over, and where in it.
    pub fn pointed(&self, panes: &[PaneRect]) -> Option<(PaneRect, DVec2)> {
        let pointer = self.pointer?;
        let pane = panes.iter().find(|pane| pane.contains(pointer))?;
        Some((*pane, pane.within(pointer)))
    }

    /// Returns true if a button is down.
    pub fn is_held(&self) -> bool {
        self.held.is_some() || !self.fingers.is_empty()
    }

    /// These labels are shown. Gives back those that were shown last.
    pub(super) fn note_labels(&mut self, nth: usize) -> usize {
        std::mem::replace(&mut self.labels, nth)
    }

    /// Changes what is shown as an event says.
    pub fn on_event(
        &mut self,
        event: InputEvent,
        look: &mut VolumeLook,
        room: &VolumeRoom<'_>,
    ) -> VolumeHeard {
        let heard = self.hear(event, look, room);
        look.tidy();
        heard
    }

    fn hear(&mut self, event: InputEvent, look: &mut VolumeLook, room: &VolumeRoom<'_>) -> VolumeHeard {
        match event {
            InputEvent::Modifiers(modifiers) => {
                self.modifiers = modifiers;
                VolumeHeard::Other
            }
            InputEvent::PointerMoved(to) => self.on_pointer(to, look, room),
            InputEvent::PointerLeft => {
                self.pointer = None;
                VolumeHeard::Taken
            }
            InputEvent::Button { button, is_pressed: true } => self.press(button, look, room),
            InputEvent::Button { is_pressed: false, .. } => self.release(look),
            InputEvent::Touch { finger, is_down, place } => {
                self.on_touch((finger, place), is_down, look, room)
            }
            InputEvent::Wheel(notches) => self.on_wheel(notches, look, room),
            InputEvent::ScrollEnd(pixels) if pixels == DVec2::ZERO => VolumeHeard::Taken,
            InputEvent::Scroll(pixels) | InputEvent::ScrollEnd(pixels) => {
                let in_slice = self.pointed(room.panes).is_some_and(|(pane, _)| pane.pane.axis().is_some());
                if !in_slice || self.modifiers.control {
                    return self.on_wheel(pixels.y / PIXELS_PER_NOTCH, look, room);
                }
                self.scrolled += pixels.y / PIXELS_PER_SLICE;
                let whole = self.scrolled.trunc();
                self.scrolled -= whole;
                if whole == 0.0 { VolumeHeard::Taken } else { self.on_wheel(whole, look, room) }
            }
            InputEvent::Spread(factor) => {
                let factor = if factor.is_finite() { factor.clamp(0.2, 5.0) } else { 1.0 };
                self.zoom(factor, look, room);
                VolumeHeard::Taken
            }
            InputEvent::FocusLost => {
                (self.held, self.modifiers) = (None, Modifiers::default());
                self.fingers.clear();
                VolumeHeard::Other
            }
            // A key that is held moves, and does nothing else again.
            InputEvent::Key { key, is_pressed: true, is_repeat: true } if !is_motion(key) => {
                VolumeHeard::Taken
            }
            InputEvent::Key { key, is_pressed: true, .. }
                if !self.modifiers.control && !self.modifiers.alt =>
            {
                self.on_key(key, look, room)
            }
            InputEvent::Key { .. } | InputEvent::Shown => VolumeHeard::Other,
        }
    }

    fn press(&mut self, button: Button, look: &mut VolumeLook, room: &VolumeRoom<'_>) -> VolumeHeard {
        let Some((pane, pixel)) = self.pointed(room.panes) else { return VolumeHeard::Taken };
        let does = match () {
            () if button == Button::Secondary || self.modifiers.shift => Drag::Moves,
            () if self.modifiers.control && pane.pane.axis().is_some() => Drag::Tilts,
            () => Drag::Points,
        };
        let begun = pixel + DVec2::from_array(pane.at.map(f64::from));
        self.held = Some(Held { pane, does, begun, is_still: true });
        match pane.pane.axis() {
            Some(_) if does == Drag::Points => self.point_in_slice(&pane, pixel, look, room),
            _ => VolumeHeard::Taken,
        }
    }

    fn release(&mut self, look: &VolumeLook) -> VolumeHeard {
        match self.held.take() {
            Some(Held { pane, does: Drag::Points, is_still: true, begun }) => {
                let (pane, pixel) = (pane.pane, pane.within(begun));
                match (look.labels.shown, pane.axis()) {
                    (Some(_), _) => VolumeHeard::Select(pane, pixel),
                    (None, None) => VolumeHeard::Click(pane, pixel),
                    (None, Some(_)) => VolumeHeard::Taken,
                }
            }
            _ => VolumeHeard::Taken,
        }
    }

    /// Slices meet where the pointer is.
    fn point_in_slice(
        &self,
        pane: &PaneRect,
        pixel: DVec2,
        look: &mut VolumeLook,
        room: &VolumeRoom<'_>,
    ) -> VolumeHeard {
        let sight = PaneSight::of(look, &room.facts.of, room.panes, pane);
        let [place, _] = sight.ray(pixel);
        look.put_cross(&room.facts.of, place);
        VolumeHeard::Click(pane.pane, pixel)
    }

    fn on_pointer(&mut self, to: DVec2, look: &mut VolumeLook, room: &VolumeRoom<'_>) -> VolumeHeard {
        let from = self.pointer.replace(to).unwrap_or(to);
        let Some(held) = &mut self.held else { return VolumeHeard::Taken };
        if held.is_still && to.distance(held.begun) < STILL {
            return VolumeHeard::Taken;
        }
        // What a click may move is made up for.
        let from = if std::mem::take(&mut held.is_still) { held.begun } else { from };
        let (pane, does) = (held.pane, held.does);
        let degrees = (to - from) / f64::from(pane.size[1].max(1)) * DEGREES_PER_HEIGHT;
        match (pane.pane.axis(), does) {
            (Some(_), Drag::Points) => return self.point_in_slice(&pane, pane.within(to), look, room),
            (_, Drag::Moves) => shift(&pane, to - from, look, room),
            (_, Drag::Tilts) => look.tilt_by(pane.pane, degrees.x, degrees.y),
            (None, Drag::Points) => turn(look, degrees),
        }
        VolumeHeard::Taken
    }

    fn on_touch(
        &mut self,
        (finger, place): (u64, DVec2),
        is_down: bool,
        look: &mut VolumeLook,
        room: &VolumeRoom<'_>,
    ) -> VolumeHeard {
        let before = self.fingers.clone();
        self.fingers.retain(|(other, _)| *other != finger);
        if is_down {
            self.fingers.push((finger, place));
            self.fingers.sort_by_key(|(finger, _)| *finger);
        }
        match (&before[..], &self.fingers[..]) {
            ([], [_]) => {
                self.pointer = Some(place);
                self.press(Button::Primary, look, room)
            }
            ([(a, _)], [(b, _)]) if a == b => self.on_pointer(place, look, room),
            ([_], []) => self.release(look),
            ([(a, first), (b, second)], [(c, third), (d, fourth)]) if [a, b] == [c, d] => {
                let (third, fourth) = (*third, *fourth);
                let middle = (third + fourth) / 2.0;
                self.pointer = Some(middle);
                if let Some((pane, _)) = self.pointed(room.panes) {
                    shift(&pane, middle - (*first + *second) / 2.0, look, room);
                }
                let factor = third.distance(fourth) / first.distance(*second).max(1.0);
                self.zoom(factor.clamp(0.2, 5.0), look, room);
                VolumeHeard::Taken
            }
            // Another number of fingers: what they do begins anew.
            _ => {
                self.held = None;
                VolumeHeard::Taken
            }
        }
    }

    fn on_wheel(&self, notches: f64, look: &mut VolumeLook, room: &VolumeRoom<'_>) -> VolumeHeard {
        if !notches.is_finite() {
            return VolumeHeard::Taken;
        }
        let slice = self.pointed(room.panes).map(|(pane, _)| pane.pane).filter(|pane| pane.axis().is_some());
        match slice.filter(|_| !self.modifiers.control) {
            Some(slice) => {
                let steps = (notches.abs().ceil().clamp(1.0, 100.0) * notches.signum()) as i64;
                let steps = if self.modifiers.shift { steps * MANY } else { steps };
                look.step_pane(&room.facts.of, slice, steps);
            }
            None => self.zoom(WHEEL_FACTOR.powf(notches.clamp(-50.0, 50.0)), look, room),
        }
        VolumeHeard::Taken
    }

    /// Zooms in the picture that the pointer is over; in a slice what is below the pointer stays there.
    fn zoom(&self, factor: f64, look: &mut VolumeLook, room: &VolumeRoom<'_>) {
        let pointed = self.pointed(room.panes);
        let pane = pointed.map(|(pane, _)| pane).or(room.panes.last().copied());
        match pane {
            Some(pane) if pane.pane.axis().is_some() => {
                let middle = DVec2::from_array(pane.size.map(f64::from)) / 2.0;
                let pixel = pointed.map_or(middle, |(_, pixel)| pixel);
                let place =
                    |look: &VolumeLook| PaneSight::of(look, &room.facts.of, room.panes, &pane).ray(pixel)[0];
                let before = place(look);
                look.zoom *= factor;
                look.tidy();
                look.centre += before - place(look);
            }
            _ => look.orbit.zoom *= factor,
        }
    }

    fn on_key(&mut self, key: Key, look: &mut VolumeLook, room: &VolumeRoom<'_>) -> VolumeHeard {
        let alone = |pane| VolumeLayout::One(pane);
        match key {
            Key::Char(' ') => {
                let is_space = look.layout == alone(VolumePane::Space);
                if let VolumeLayout::One(pane) = look.layout
                    && pane != VolumePane::Space
                {
                    self.slice = Some(pane);
                }
                let slice = self.slice.unwrap_or(VolumePane::Z);
                look.layout = alone(if is_space { slice } else { VolumePane::Space });
            }
            Key::Char('x' | 'X') => look.layout = alone(VolumePane::X),
            Key::Char('y' | 'Y') => look.layout = alone(VolumePane::Y),
            Key::Char('z' | 'Z') => look.layout = alone(VolumePane::Z),
            Key::Char('v' | 'V') => look.layout = alone(VolumePane::Space),
            Key::Char('t' | 'T') => look.put_upright(&room.facts.of),
            Key::Char('4') => look.layout = VolumeLayout::Four,
            Key::Char('e' | 'E') => {
                let nth = VolumeMode::ALL.iter().position(|mode| *mode == look.mode).unwrap_or(0);
                look.mode = VolumeMode::ALL[(nth + 1) % VolumeMode::ALL.len()];
            }
            Key::Char(',') => look.time = look.time.saturating_sub(1),
            Key::Char('.') => look.time = (look.time + 1).min(room.facts.times.saturating_sub(1)),
            Key::Char('l' | 'L') if !room.facts.labels.is_empty() => {
                // The same ones again, so that the one that is selected is one of them.
                look.labels.shown = match look.labels.shown {
                    Some(nth) => {
                        self.labels = nth;
                        None
                    }
                    None => Some(self.labels.min(room.facts.labels.len() - 1)),
                };
            }
            Key::Escape if look.labels.shown.is_some() && look.labels.selected.is_some() => {
                look.labels.selected = None;
            }
            Key::Char('k' | 'K') => return VolumeHeard::Play,
            Key::Char('c' | 'C') => return VolumeHeard::UsualRanges,
            Key::Char('+' | '=' | 'i' | 'I') => self.zoom(WHEEL_FACTOR, look, room),
            Key::Char('-' | '_' | 'o' | 'O') => self.zoom(1.0 / WHEEL_FACTOR, look, room),
            Key::Home | Key::Char('r' | 'R' | '0') => look.fit(room.facts),
            Key::Left | Key::Right | Key::Up | Key::Down | Key::PageUp | Key::PageDown => {
                return self.on_arrow(key, look, room);
            }
            _ => return VolumeHeard::Other,
        }
        VolumeHeard::Taken
    }

    fn on_arrow(&self, key: Key, look: &mut VolumeLook, room: &VolumeRoom<'_>) -> VolumeHeard {
        // In the picture below the pointer, else in the one that is alone, else across z.
        let pane = self.pointed(room.panes).map(|(pane, _)| pane.pane);
        let pane = pane.unwrap_or(match look.layout {
            VolumeLayout::One(pane) => pane,
            VolumeLayout::Four => VolumePane::Z,
        });
        let is_page = matches!(key, Key::PageUp | Key::PageDown);
        let slice = Some(pane).filter(|pane| pane.axis().is_some()).or(is_page.then_some(VolumePane::Z));
        let Some(slice) = slice else {
            let by = match key {
                Key::Left => DVec2::NEG_X,
                Key::Right => DVec2::X,
                Key::Up => DVec2::NEG_Y,
                _ => DVec2::Y,
            };
            turn(look, by * DEGREES_PER_PRESS);
            return VolumeHeard::Taken;
        };
        let steps = if self.modifiers.shift { MANY } else { 1 };
        match key {
            Key::Up | Key::PageUp => look.step_pane(&room.facts.of, slice, steps),
            Key::Down | Key::PageDown => look.step_pane(&room.facts.of, slice, -steps),
            _ => {}
        }
        VolumeHeard::Taken
    }
}

/// Turns what is seen in 3-D as if it were held at the pointer, which moved by so many degrees.
fn turn(look: &mut VolumeLook, degrees: DVec2) {
    look.orbit.yaw += degrees.x;
    look.orbit.pitch += degrees.y;
}

/// Moves a picture by so many pixels.
fn shift(pane: &PaneRect, pixels: DVec2, look: &mut VolumeLook, room: &VolumeRoom<'_>) {
    let sight = PaneSight::of(look, &room.facts.of, room.panes, pane);
    let (by, [right, down]) = (sight.pixel() * pixels, sight.across());
    let by = right * by.x + down * by.y;
    match pane.pane.axis() {
        Some(_) => look.centre -= by,
        None => look.orbit.target -= by,
    }
}

/// Returns true if a key moves the crosshair or the camera, or goes on in time.
fn is_motion(key: Key) -> bool {
    let is_zoom = matches!(key, Key::Char('+' | '=' | 'i' | 'I' | '-' | '_' | 'o' | 'O'));
    let is_arrow = matches!(key, Key::Left | Key::Right | Key::Up | Key::Down | Key::PageUp | Key::PageDown);
    is_zoom || is_arrow || matches!(key, Key::Char(',' | '.'))
}

#[cfg(test)]
mod tests;
