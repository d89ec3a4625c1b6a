//! egui in the window: it hears events first, runs once in each frame, and is drawn over the picture.
//!
//! What is in the panels is `vastex-viewer`'s, and so is what draws them.

mod pasting;

use std::sync::Arc;
use std::time::{Duration, Instant};

use egui::{Context, Order, Pos2, Rect, Ui, ViewportId};
use vastex_viewer::Theme;
use vastex_viewer::panels::PanelPainter;
use winit::dpi::PhysicalPosition;
use winit::event::{TouchPhase, WindowEvent};
use winit::keyboard::ModifiersState;
use winit::window::Window;

use super::screen_reader::{self, Reader};
use pasting::{Pasting, is_paste};

/// What egui makes of an event.
#[derive(Clone, Copy, Default)]
pub(super) struct Heard {
    /// True if it is of a panel, and of nothing else.
    pub(super) is_taken: bool,
    /// True if a frame is due for it.
    pub(super) is_stale: bool,
}

/// egui in one window.
pub(super) struct Shell {
    window: Arc<Window>,
    state: egui_winit::State,
    /// Draws what the last run put into the window.
    pub(super) painter: PanelPainter,
    /// What its fields copy and paste.
    pasting: Pasting,
    /// Keys that change what others mean, as far as they are held.
    held: ModifiersState,
    /// When it wants to run again.
    due: Option<Instant>,
    /// What the panels leave of the window to the picture, in points.
    free: Rect,
    /// Where the pointer is, and whether it was over a panel at its last move.
    pointer: Option<PhysicalPosition<f64>>,
    is_over: bool,
    /// Buttons and fingers that are down, and whether the first of them went down over a panel.
    pressed: u32,
    is_held: bool,
}

impl Shell {
    pub(super) fn new(window: Arc<Window>, reader: Reader) -> Shell {
        let context = Context::default();
        // Each blink would be a frame of the whole picture.
        context.all_styles_mut(|style| style.visuals.text_cursor.blink = false);
        let mut state =
            egui_winit::State::new(context, ViewportId::ROOT, &window, None, window.theme(), None);
        reader.join(&mut state);
        Shell {
            window,
            state,
            painter: PanelPainter::default(),
            pasting: Pasting::default(),
            held: ModifiersState::empty(),
            due: None,
            free: Rect::EVERYTHING,
            pointer: None,
            is_over: false,
            pressed: 0,
            is_held: false,
        }
    }

    /// Light, dark, or as the system is.
    pub(super) fn set_theme(&mut self, theme: Theme) {
        self.state.egui_ctx().set_theme(theme);
    }

    pub(super) fn theme(&self) -> Theme {
        self.state.egui_ctx().options(|options| options.theme_preference).into()
    }

    /// Returns true if what is shown now is dark.
    pub(super) fn is_dark(&self) -> bool {
        self.state.egui_ctx().theme() == egui::Theme::Dark
    }

    /// Returns true if keys are for a field, or for something that is open over the picture.
    fn takes_keys(&self) -> bool {
        let context = self.state.egui_ctx();
        context.egui_wants_keyboard_input() || egui::Popup::is_any_open(context)
    }

    /// Returns true if a place of the window is a panel's, as the last run left it.
    fn is_over(&self, pixels: PhysicalPosition<f64>) -> bool {
        let context = self.state.egui_ctx();
        let pixels_per_point = f64::from(context.pixels_per_point());
        let [x, y] = [pixels.x, pixels.y].map(|side| (side / pixels_per_point) as f32);
        let place = Pos2::new(x, y);
        match context.layer_id_at(place) {
            Some(layer) if layer.order == Order::Background => !self.free.contains(place),
            layer => layer.is_some(),
        }
    }

    /// Hears an event before anything else does.
    ///
    /// egui knows of an event when it runs next, in the next frame. So whose the pointer is follows from the
    /// place of the event itself; of what is pressed, from where it was pressed.
    pub(super) fn hear(&mut self, event: &WindowEvent) -> Heard {
        let takes_keys = self.takes_keys();
        match event {
            WindowEvent::RedrawRequested => return Heard::default(),
            WindowEvent::KeyboardInput { .. } if !takes_keys => return Heard::default(),
            WindowEvent::KeyboardInput { event, .. }
                if event.state.is_pressed() && is_paste(event, self.held) =>
            {
                // egui would wait for the text. It hears of it when it has come.
                if !event.repeat {
                    let window = self.window.clone();
                    self.pasting.ask(self.state.egui_ctx(), move || window.request_redraw());
                }
                return Heard { is_taken: true, is_stale: false };
            }
            WindowEvent::ModifiersChanged(held) => self.held = held.state(),
            WindowEvent::CursorMoved { .. } => {
                // Of many moves between two frames the last one will do.
                let events = &mut self.state.egui_input_mut().events;
                drop(events.pop_if(|event| matches!(event, egui::Event::PointerMoved(_))));
            }
            _ => {}
        }
        let response = self.state.on_window_event(&self.window, event);
        match event {
            WindowEvent::KeyboardInput { event, .. } => {
                Heard { is_taken: event.state.is_pressed(), is_stale: true }
            }
            WindowEvent::CursorMoved { position, .. } => {
                self.pointer = Some(*position);
                let (over, is_held) = (self.is_over(*position), self.pressed > 0);
                let was_over = std::mem::replace(&mut self.is_over, over);
                let is_taken = if is_held { self.is_held } else { over };
                Heard { is_taken: is_held && is_taken, is_stale: is_taken || was_over && !is_held }
            }
            WindowEvent::MouseInput { state, .. } => {
                // What lies below it may have come since its last move.
                self.is_over = self.pointer.is_some_and(|position| self.is_over(position));
                self.press(state.is_pressed(), self.is_over, takes_keys)
            }
            WindowEvent::MouseWheel { .. } | WindowEvent::PinchGesture { .. } => {
                // As below a button.
                self.is_over = self.pointer.is_some_and(|position| self.is_over(position));
                Heard { is_taken: self.is_over, is_stale: self.is_over }
            }
            WindowEvent::Touch(touch) => match touch.phase {
                TouchPhase::Started => self.press(true, self.is_over(touch.location), takes_keys),
                TouchPhase::Moved => Heard { is_taken: self.is_held, is_stale: self.is_held },
                TouchPhase::Ended | TouchPhase::Cancelled => self.press(false, false, takes_keys),
            },
            WindowEvent::CursorLeft { .. } => {
                self.pointer = None;
                let was_over = std::mem::replace(&mut self.is_over, false);
                Heard { is_taken: false, is_stale: was_over }
            }
            WindowEvent::ModifiersChanged(_) => Heard { is_taken: false, is_stale: takes_keys },
            WindowEvent::Focused(is_focused) => {
                if !is_focused {
                    self.pressed = 0;
                }
                Heard { is_taken: false, is_stale: response.repaint }
            }
            _ => Heard { is_taken: false, is_stale: response.repaint },
        }
    }

    /// A button or a finger went down, over a panel or beside it, or up. What goes up is heard by all, so
    /// that nothing stays pressed.
    fn press(&mut self, is_down: bool, over: bool, takes_keys: bool) -> Heard {
        if is_down && self.pressed == 0 {
            self.is_held = over;
        }
        let is_held = self.is_held;
        self.pressed = if is_down { self.pressed + 1 } else { self.pressed.saturating_sub(1) };
        if self.pressed == 0 {
            self.is_held = false;
        }
        // What is open over the picture closes when the picture is pressed.
        Heard { is_taken: is_held && is_down, is_stale: is_held || takes_keys }
    }

    /// A screen reader asks for something: the next run does it.
    pub(super) fn hear_reader(&mut self, asked: screen_reader::Asked) {
        screen_reader::hear(&mut self.state, asked);
    }

    /// Runs once: what `show` puts into the window is what is drawn next. Screen readers are told of that, in
    /// a window by the name of what it shows.
    pub(super) fn run(&mut self, name: &str, mut show: impl FnMut(&mut Ui)) {
        let context = self.state.egui_ctx().clone();
        let pasted = self.pasting.arrived(&context);
        self.state.egui_input_mut().events.extend(pasted);
        let input = self.state.take_egui_input(&self.window);
        let mut free = Rect::NOTHING;
        let mut output = context.run_ui(input, |ui| {
            show(ui);
            free = ui.available_rect_before_wrap();
        });
        self.free = free;
        for command in &output.platform_output.commands {
            if let egui::OutputCommand::CopyText(text) = command {
                self.pasting.copy(text);
            }
        }
        let told = &mut output.platform_output.accesskit_update;
        told.iter_mut().for_each(|told| screen_reader::name_window(told, name));
        self.state.handle_platform_output(&self.window, std::mem::take(&mut output.platform_output));
        let delay = output.viewport_output.get(&ViewportId::ROOT).map(|viewport| viewport.repaint_delay);
        self.due = delay.and_then(|delay| Instant::now().checked_add(delay));
        self.painter.take(&context, &mut output);
    }

    /// Returns true if the pointer is over a panel.
    pub(super) fn is_over_panel(&self) -> bool {
        self.is_over
    }

    /// The next control takes the keys, the first one where none had them.
    pub(super) fn focus_next(&mut self) {
        let key = |pressed| egui::Event::Key {
            key: egui::Key::Tab,
            physical_key: None,
            pressed,
            repeat: false,
            modifiers: egui::Modifiers::NONE,
        };
        self.state.egui_input_mut().events.extend([key(true), key(false)]);
    }

    /// In how long it wants to run again without an event; `None` if it does not.
    pub(super) fn due_in(&self, now: Instant) -> Option<Duration> {
        self.due.map(|due| due.saturating_duration_since(now))
    }
}
