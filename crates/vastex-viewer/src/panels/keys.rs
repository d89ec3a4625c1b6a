//! The list of keys and gestures.

use egui::{Align2, Context, Grid, RichText, ScrollArea, Window};

use crate::input::CONTROLS;

/// Parts of a list of keys, each with its keys or gestures and what they do.
type Controls = [(&'static str, &'static [(&'static str, &'static str)])];

/// A window with every key and gesture and what it does, while `is_open`; it closes itself.
pub fn keys_window(context: &Context, is_open: &mut bool) {
    keys_window_of(context, is_open, CONTROLS);
}

/// The same of other keys and gestures: parts of a list, each with its keys and what they do.
pub fn keys_window_of(context: &Context, is_open: &mut bool, controls: &Controls) {
    let content = context.content_rect();
    let window = Window::new("Keys and gestures").open(is_open).collapsible(false).resizable(false);
    window.pivot(Align2::CENTER_CENTER).default_pos(content.center()).show(context, |ui| {
        let height = (content.height() - 80.0).max(100.0);
        ScrollArea::vertical().max_height(height).min_scrolled_height(height).show(ui, |ui| {
            Grid::new("keys").num_columns(2).spacing([24.0, 4.0]).show(ui, |ui| {
                for (part, controls) in controls {
                    ui.label(RichText::new(*part).strong());
                    ui.end_row();
                    for (keys, meaning) in *controls {
                        ui.label(RichText::new(*keys).monospace());
                        ui.label(*meaning);
                        ui.end_row();
                    }
                }
            });
        });
    });
}
