//! The list of keys and gestures.

use egui::{
    Align2, Color32, Context, Frame, Grid, Label, Margin, RichText, ScrollArea, TextStyle, Ui, Window,
};

use crate::input::CONTROLS;

/// Parts of a list of keys, each with its keys or gestures and what they do.
type Controls<'a> = [(&'a str, &'a [(&'a str, &'a str)])];

/// A window with every key and gesture and what it does, while `is_open`; it closes itself.
pub fn keys_window(context: &Context, is_open: &mut bool) {
    keys_window_of(context, is_open, CONTROLS);
}

/// Points between keys and what they do, what is left to the edges beside both, and the narrowest column of
/// what they do: with less it stands below the keys.
const GAP: f32 = 24.0;
const BESIDE: f32 = 56.0;
const LEAST: f32 = 260.0;

/// A window as [`keys_window`] with other keys and gestures: parts of a list, each with its keys and what
/// they do. It is no wider than the window that it is in.
pub fn keys_window_of(context: &Context, is_open: &mut bool, controls: &Controls<'_>) {
    let content = context.content_rect();
    let window = Window::new("Keys and gestures").open(is_open).collapsible(false).resizable(false);
    window.pivot(Align2::CENTER_CENTER).default_pos(content.center()).show(context, |ui| {
        let height = (content.height() - 80.0).max(100.0);
        let width = (content.width() - BESIDE).max(100.0);
        ScrollArea::vertical().max_height(height).min_scrolled_height(height).show(ui, |ui| {
            // The bar lies over what is scrolled.
            let bar = bar_width(ui);
            let left = width - widest_keys(ui, controls) - GAP - bar;
            Frame::new().inner_margin(Margin { right: bar.ceil() as i8, ..Margin::ZERO }).show(ui, |ui| {
                match left >= LEAST {
                    true => beside(ui, controls, left),
                    false => below(ui, controls, width - bar),
                }
            });
        });
    });
}

/// How wide the scroll bar is at most, with what is left beside it.
fn bar_width(ui: &Ui) -> f32 {
    let scroll = ui.spacing().scroll;
    scroll.bar_width + scroll.bar_inner_margin + scroll.bar_outer_margin
}

/// How wide the widest keys are.
fn widest_keys(ui: &Ui, controls: &Controls<'_>) -> f32 {
    let font = TextStyle::Monospace.resolve(ui.style());
    let width = |keys: &str| {
        ui.painter().layout_no_wrap(keys.to_owned(), font.clone(), Color32::PLACEHOLDER).size().x
    };
    controls.iter().flat_map(|(_, controls)| *controls).map(|(keys, _)| width(keys)).fold(0.0, f32::max)
}

/// What keys do stands beside them, at most so wide.
fn beside(ui: &mut Ui, controls: &Controls<'_>, width: f32) {
    Grid::new("keys").num_columns(2).spacing([GAP, 4.0]).show(ui, |ui| {
        for (part, controls) in controls {
            ui.label(RichText::new(*part).strong());
            ui.end_row();
            for (keys, meaning) in *controls {
                ui.label(RichText::new(*keys).monospace());
                ui.vertical(|ui| {
                    ui.set_max_width(width);
                    ui.label(*meaning);
                });
                ui.end_row();
            }
        }
    });
}

/// What keys do stands below them.
fn below(ui: &mut Ui, controls: &Controls<'_>, width: f32) {
    ui.set_max_width(width);
    for (part, controls) in controls {
        ui.label(RichText::new(*part).strong());
        for (keys, meaning) in *controls {
            ui.add(Label::new(RichText::new(*keys).monospace()).wrap());
            ui.indent(keys, |ui| ui.add(Label::new(*meaning).wrap()));
        }
    }
}

#[cfg(test)]
mod tests {
    use egui_kittest::Harness;
    use egui_kittest::kittest::Queryable;

    use super::*;

    #[test]
    fn the_list_fits_into_its_window() {
        for size in [[360.0, 300.0], [500.0, 400.0], [760.0, 500.0], [1280.0, 720.0], [3000.0, 900.0]] {
            let mut harness = Harness::builder()
                .with_size(size)
                .build_ui_state(|ui, is_open| keys_window(ui.ctx(), is_open), true);
            harness.run();
            // The bar lies at the right of what is widest, which nothing may reach into.
            let bar = harness.ctx.global_style().spacing.scroll.bar_width;
            let edge = harness.ctx.memory(|memory| memory.area_rect(egui::Id::unique("Keys and gestures")));
            let edge = edge.map_or(f32::NAN, |rect| rect.right()) - bar;
            let mut seen = 0;
            for (_, controls) in CONTROLS {
                for words in controls.iter().flat_map(|(keys, meaning)| [keys, meaning]) {
                    for found in harness.query_all_by_label(words) {
                        let rect = found.rect();
                        seen += 1;
                        assert!(
                            rect.left() >= 0.0 && rect.right() <= edge.min(size[0]),
                            "{words}: {rect:?} {size:?}"
                        );
                    }
                }
            }
            assert!(seen > 0, "{size:?}");
        }
    }
}
