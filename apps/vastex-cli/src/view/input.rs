//! What keys and pointer mean: moves of the camera and other wishes.
//!
//! It knows neither the window nor the picture; time and the size of the view are given to it.

use std::time::{Duration, Instant};

use glam::Vec2;
use vastex_scenes::{Pose, Scene};
use winit::event::{ElementState, KeyEvent, MouseButton, MouseScrollDelta, WindowEvent};
use winit::keyboard::{Key, NamedKey};

/// Two clicks within this time, and so many pixels, are a double click.
const DOUBLE_CLICK: (Duration, f32) = (Duration::from_millis(400), 6.0);
/// Factor of a notch of the wheel.
const WHEEL_FACTOR: f32 = 1.25;
/// Pixels of a touch pad that are a notch of the wheel.
const PIXELS_PER_NOTCH: f32 = 50.0;
/// Steps per second of a key that is held; see [`Pose::walked`].
const WALK_PER_SECOND: f32 = 0.8;
/// Factor per second of a zoom key that is held.
const ZOOM_PER_SECOND: f32 = 3.0;
/// What a short press is worth, and the longest that one frame is worth.
const SHORT_PRESS: Duration = Duration::from_millis(80);
const LONGEST_FRAME: Duration = Duration::from_millis(250);

/// Something that a person wants.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Wish {
    /// The camera elsewhere.
    Move(Move),
    /// The first pose again.
    Reset,
    /// Another scene, or the next.
    Scene(Option<Scene>),
    /// The next overlay in the place of the picture, or the picture again.
    Overlay,
    /// Why the pixel below the pointer shows what it shows, in pixels of the view.
    Explain([u32; 2]),
    FillScreen,
    /// The picture again: it may be stale.
    Redraw,
    Quit,
}

/// A change of the pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Move {
    /// The pointer was dragged, in view heights.
    Drag(Vec2),
    /// Zoomed in by a factor towards a point, in view heights from the middle.
    ZoomTo(f32, Vec2),
    /// Walked by a step and zoomed by a factor.
    Walk(Vec2, f32),
}

/// Width over height of the view and of the image.
pub(super) type Aspects = [f32; 2];

impl Move {
    pub(super) fn apply(self, pose: Pose, [view, image]: Aspects) -> Pose {
        match (self, pose) {
            (Move::Drag(delta), _) => pose.dragged(delta, view, image),
            // Turning about on the plane would not keep the point below the pointer.
            (Move::ZoomTo(factor, _), Pose::Plane { .. }) => pose.zoomed(factor),
            (Move::ZoomTo(factor, point), _) => {
                pose.dragged(-point, view, image).zoomed(factor).dragged(point, view, image)
            }
            (Move::Walk(step, factor), _) => pose.walked(step).zoomed(factor),
        }
    }
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
pub(super) struct Input {
    held: Vec<Motion>,
    /// Up to when the motions have been carried out.
    moved_at: Option<Instant>,
    pointer: Vec2,
    dragging: bool,
    /// When and where the last click was.
    clicked: Option<(Instant, Vec2)>,
}

impl Input {
    /// Takes in an event, in a view of `size` pixels.
    pub(super) fn heed(&mut self, event: &WindowEvent, size: [u32; 2], now: Instant) -> Option<Wish> {
        let [width, height] = size.map(|side| side.max(1) as f32);
        match event {
            WindowEvent::KeyboardInput { event, is_synthetic: false, .. } => self.key(event, now),
            WindowEvent::CursorMoved { position, .. } => {
                let pointer = Vec2::new(position.x as f32, position.y as f32);
                let delta = pointer - std::mem::replace(&mut self.pointer, pointer);
                self.dragging.then_some(Wish::Move(Move::Drag(delta / height)))
            }
            WindowEvent::MouseInput { state, button: MouseButton::Left, .. } => {
                self.button(*state == ElementState::Pressed, now)
            }
            WindowEvent::MouseInput { state: ElementState::Pressed, button: MouseButton::Right, .. } => {
                Some(Wish::Explain(self.pointer.max(Vec2::ZERO).to_array().map(|place| place as u32)))
            }
            WindowEvent::MouseWheel { delta, .. } => {
                let notches = match delta {
                    MouseScrollDelta::LineDelta(_, y) => *y,
                    MouseScrollDelta::PixelDelta(pixels) => pixels.y as f32 / PIXELS_PER_NOTCH,
                };
                let point = (self.pointer - Vec2::new(width, height) / 2.0) / height;
                Some(Wish::Move(Move::ZoomTo(WHEEL_FACTOR.powf(notches), point)))
            }
            WindowEvent::Focused(false) => {
                self.held.clear();
                self.dragging = false;
                None
            }
            WindowEvent::Focused(true) | WindowEvent::Occluded(false) => Some(Wish::Redraw),
            _ => None,
        }
    }

    /// Whether something goes on while nothing happens.
    pub(super) fn is_moving(&self) -> bool {
        !self.held.is_empty()
    }

    /// What the keys that are held are worth since they were asked last.
    pub(super) fn motion(&mut self, now: Instant) -> Option<Move> {
        if self.held.is_empty() {
            return None;
        }
        let since = self.moved_at.replace(now).unwrap_or(now);
        Some(walk(&self.held, now.duration_since(since).min(LONGEST_FRAME)))
    }

    fn button(&mut self, pressed: bool, now: Instant) -> Option<Wish> {
        self.dragging = pressed;
        if !pressed {
            return None;
        }
        let (time, distance) = DOUBLE_CLICK;
        let is_double = |&(then, place): &(Instant, Vec2)| {
            now.duration_since(then) < time && place.distance(self.pointer) < distance
        };
        if self.clicked.take_if(|clicked| is_double(clicked)).is_some() {
            return Some(Wish::Reset);
        }
        self.clicked = Some((now, self.pointer));
        None
    }

    fn key(&mut self, event: &KeyEvent, now: Instant) -> Option<Wish> {
        if let Some(motion) = motion_of(&event.logical_key) {
            if event.state == ElementState::Released {
                self.held.retain(|&held| held != motion);
            } else if !self.held.contains(&motion) {
                if self.held.is_empty() {
                    self.moved_at = Some(now);
                }
                self.held.push(motion);
                return Some(Wish::Move(walk(&[motion], SHORT_PRESS)));
            }
            return None;
        }
        (event.state == ElementState::Pressed && !event.repeat).then(|| wish_of(&event.logical_key)).flatten()
    }
}

fn walk(motions: &[Motion], time: Duration) -> Move {
    let (mut step, mut zoom) = (Vec2::ZERO, 0.0);
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
    let seconds = time.as_secs_f32();
    Move::Walk(step * WALK_PER_SECOND * seconds, ZOOM_PER_SECOND.powf(zoom * seconds))
}

fn motion_of(key: &Key) -> Option<Motion> {
    Some(match key {
        Key::Named(NamedKey::ArrowLeft) => Motion::Left,
        Key::Named(NamedKey::ArrowRight) => Motion::Right,
        Key::Named(NamedKey::ArrowUp) => Motion::Forward,
        Key::Named(NamedKey::ArrowDown) => Motion::Back,
        Key::Character(text) => match text.to_lowercase().as_str() {
            "a" => Motion::Left,
            "d" => Motion::Right,
            "w" => Motion::Forward,
            "s" => Motion::Back,
            // The same key, with Shift let go before it.
            "+" | "=" => Motion::In,
            "-" | "_" => Motion::Out,
            _ => return None,
        },
        _ => return None,
    })
}

fn wish_of(key: &Key) -> Option<Wish> {
    Some(match key {
        Key::Named(NamedKey::Escape) => Wish::Quit,
        Key::Named(NamedKey::Home) => Wish::Reset,
        Key::Named(NamedKey::Tab) => Wish::Scene(None),
        Key::Named(NamedKey::F11) => Wish::FillScreen,
        Key::Character(text) => match text.to_lowercase().as_str() {
            "q" => Wish::Quit,
            "r" => Wish::Reset,
            "f" => Wish::FillScreen,
            "o" => Wish::Overlay,
            "1" => Wish::Scene(Some(Scene::Image)),
            "2" => Wish::Scene(Some(Scene::Plane)),
            "3" => Wish::Scene(Some(Scene::Globe)),
            "4" => Wish::Scene(Some(Scene::Terrain)),
            _ => return None,
        },
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_wheel_keeps_what_lies_below_the_pointer() {
        let (aspects, point) = ([1.6, 2.0], Vec2::new(0.3, -0.2));
        let pose = Pose::Image { centre: Vec2::splat(0.5), zoom: 2.0 };
        let below = |pose: Pose| {
            // A drag by -point brings what lies below the pointer to the middle.
            let Pose::Image { centre, .. } = pose.dragged(-point, aspects[0], aspects[1]) else {
                unreachable!()
            };
            centre
        };
        let zoomed = Move::ZoomTo(1.25, point).apply(pose, aspects);
        assert!(below(pose).distance(below(zoomed)) < 1e-5);
        assert_ne!(pose, zoomed);
    }

    #[test]
    fn two_quick_clicks_reset_and_slow_ones_do_not() {
        let (mut input, now) = (Input::default(), Instant::now());
        assert_eq!(input.button(true, now), None);
        assert_eq!(input.button(true, now + Duration::from_millis(200)), Some(Wish::Reset));
        assert_eq!(input.button(true, now + Duration::from_millis(300)), None, "the third click begins anew");
        assert_eq!(input.button(true, now + Duration::from_secs(2)), None);
    }

    #[test]
    fn held_keys_move_by_the_time_and_opposite_ones_cancel() {
        let Move::Walk(step, zoom) = walk(&[Motion::Right, Motion::In], Duration::from_millis(500)) else {
            unreachable!()
        };
        assert_eq!(step, Vec2::new(WALK_PER_SECOND / 2.0, 0.0));
        assert!((zoom - ZOOM_PER_SECOND.sqrt()).abs() < 1e-6);
        let still = walk(&[Motion::Left, Motion::Right], Duration::from_secs(1));
        assert_eq!(still, Move::Walk(Vec2::ZERO, 1.0));
    }
}
