//! What a person does to the widget, in the words of the viewer's input: egui's events become moves of the
//! camera.

use std::time::Duration;

use egui::{EventFilter, Key, PointerButton, Response, Ui, Vec2};
use glam::DVec2;

use crate::camera::{Controller, Move, Pose};
use crate::input::{Action, Button, Input, InputEvent, Key as InputKey, Modifiers};
use crate::scene::Scene;

/// Points of scrolling that are worth a notch of the wheel.
const NOTCH: f32 = 40.0;

/// The keys that move, in egui's words and in ours.
const KEYS: [(Key, InputKey); 19] = [
    (Key::ArrowLeft, InputKey::Left),
    (Key::ArrowRight, InputKey::Right),
    (Key::ArrowUp, InputKey::Up),
    (Key::ArrowDown, InputKey::Down),
    (Key::Plus, InputKey::Char('+')),
    (Key::Equals, InputKey::Char('=')),
    (Key::Minus, InputKey::Char('-')),
    (Key::Home, InputKey::Home),
    (Key::Num0, InputKey::Char('0')),
    (Key::Num1, InputKey::Char('1')),
    (Key::Num2, InputKey::Char('2')),
    (Key::Num3, InputKey::Char('3')),
    (Key::Num4, InputKey::Char('4')),
    (Key::Num5, InputKey::Char('5')),
    (Key::Num6, InputKey::Char('6')),
    (Key::Num7, InputKey::Char('7')),
    (Key::Num8, InputKey::Char('8')),
    (Key::Num9, InputKey::Char('9')),
    (Key::T, InputKey::Char('t')),
];

/// Keys and pointer as they are now.
#[derive(Debug, Default)]
pub(super) struct Hands {
    input: Input,
    is_pressed: bool,
}

impl Hands {
    /// Moves the camera by what was done since the last frame, over a picture and an image of so many pixels
    /// and texels. Returns true if it goes on by itself.
    pub(super) fn move_camera(
        &mut self,
        ui: &Ui,
        response: &Response,
        camera: &mut Controller,
        (picture, image): ([u32; 2], [u32; 2]),
    ) -> bool {
        self.input.look_flat(true);
        let now = Duration::try_from_secs_f64(ui.input(|input| input.time)).unwrap_or_default();
        let mut events = Vec::new();
        let is_down = response.is_pointer_button_down_on()
            && ui.input(|input| input.pointer.button_down(PointerButton::Primary));
        let pointer = if is_down || self.is_pressed { response.interact_pointer_pos() } else { None };
        let place = response.rect;
        let at = |pos: egui::Pos2| {
            let share = (pos - place.min) / place.size();
            let [width, height] = picture.map(f64::from);
            DVec2::new(f64::from(share.x) * width, f64::from(share.y) * height)
        };
        match pointer.or(response.hover_pos()) {
            Some(pos) => events.push(InputEvent::PointerMoved(at(pos))),
            None => events.push(InputEvent::PointerLeft),
        }
        if is_down != std::mem::replace(&mut self.is_pressed, is_down) {
            let press = InputEvent::Button { button: Button::Primary, is_pressed: is_down };
            // What is pressed is pressed where it is, and what is let go was dragged there before.
            events.push(press);
            if is_down {
                response.request_focus();
            }
        }
        let mut pinch = 1.0;
        if response.contains_pointer() {
            pinch = f64::from(ui.input(egui::InputState::zoom_delta));
            // What scrolls it scrolls nothing around it.
            let scrolled =
                ui.input_mut(|input| std::mem::replace(&mut input.smooth_scroll_delta, Vec2::ZERO));
            if scrolled.y != 0.0 {
                events.push(InputEvent::Wheel(f64::from(scrolled.y / NOTCH)));
            }
        }
        self.hear_keys(ui, response, &mut events);
        let aspect = |[width, height]: [u32; 2]| f64::from(width) / f64::from(height.max(1));
        let aspects = [aspect(picture), aspect(image)];
        for event in events {
            match self.input.on_event(event, picture, now) {
                Some(Action::Move(moved)) => camera.apply(moved, aspects),
                Some(Action::Magnify(scale, point)) => camera.magnify(scale, point, picture, image),
                Some(Action::Reset) => *camera = Controller::new(Pose::first(Scene::Image)),
                _ => {}
            }
        }
        if pinch != 1.0
            && let Some(pos) = response.hover_pos()
        {
            let [width, height] = picture.map(f64::from);
            let point = (at(pos) - DVec2::new(width, height) / 2.0) / height;
            camera.apply(Move::ZoomTo(pinch.clamp(0.2, 5.0), point), aspects);
        }
        if response.double_clicked() {
            self.input.rest();
            *camera = Controller::new(Pose::first(Scene::Image));
        }
        if let Some(moved) = self.input.motion(now) {
            camera.apply(moved, aspects);
        }
        self.input.is_moving()
    }

    /// Keys are the widget's while it has the focus.
    fn hear_keys(&mut self, ui: &Ui, response: &Response, events: &mut Vec<InputEvent>) {
        if !response.has_focus() {
            if response.lost_focus() {
                events.push(InputEvent::FocusLost);
            }
            return;
        }
        let filter = EventFilter { horizontal_arrows: true, vertical_arrows: true, ..EventFilter::default() };
        ui.memory_mut(|memory| memory.set_focus_lock_filter(response.id, filter));
        ui.input(|input| {
            let egui::Modifiers { command, shift, alt, .. } = input.modifiers;
            events.push(InputEvent::Modifiers(Modifiers { control: command, shift, alt }));
            for event in &input.events {
                let egui::Event::Key { key, pressed, repeat, .. } = event else { continue };
                let known = KEYS.iter().find(|(known, _)| known == key);
                events.extend(known.map(|(_, key)| InputEvent::Key {
                    key: *key,
                    is_pressed: *pressed,
                    is_repeat: *repeat,
                }));
            }
        });
    }
}
