//! The choice of a colour map, with a strip of the colours of each.

use egui::{Color32, ComboBox, Pos2, Rect, Sense, Ui, Vec2};

use crate::layers::Palette;

/// Points of a strip.
const STRIP: Vec2 = Vec2::new(72.0, 12.0);
const COLUMNS: usize = 36;

/// A colour map, and whether it is reversed, for a person to change.
pub(super) fn palette_controls(ui: &mut Ui, palette: &mut Palette) {
    ui.horizontal(|ui| {
        let choice = ComboBox::from_label("Colour map").width(96.0).selected_text(palette.name());
        choice.show_ui(ui, |ui| {
            for map in Palette::ALL {
                let map = if palette.is_reversed() { map.reversed() } else { map };
                ui.horizontal(|ui| {
                    strip(ui, map);
                    ui.selectable_value(palette, map, map.name());
                });
            }
        });
        let mut is_reversed = palette.is_reversed();
        if ui.checkbox(&mut is_reversed, "Reversed").changed() {
            *palette = palette.reversed();
        }
    });
}

fn strip(ui: &mut Ui, palette: Palette) {
    let (rect, _) = ui.allocate_exact_size(STRIP, Sense::hover());
    let painter = ui.painter_at(rect);
    for n in 0..COLUMNS {
        let [red, green, blue] =
            palette.color(n as f32 / (COLUMNS - 1) as f32).map(|value| (value * 255.0).round() as u8);
        let column = |n: usize| rect.left() + rect.width() * n as f32 / COLUMNS as f32;
        let part = Rect::from_min_max(
            Pos2::new(column(n), rect.top()),
            Pos2::new(column(n + 1) + 0.5, rect.bottom()),
        );
        painter.rect_filled(part, 0.0, Color32::from_rgb(red, green, blue));
    }
}
