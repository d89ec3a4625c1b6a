//! How the uppermost layer is compared with those beneath it, for a person to change: in a panel, and by a
//! line in the picture.

use egui::{Area, Color32, Context, CursorIcon, Id, Rect, Sense, Slider, Stroke, Ui, WidgetInfo, pos2, vec2};

use crate::layers::{CompareMode, Placement};

/// Width in points of what can be taken hold of.
const GRIP: f32 = 14.0;

/// The kinds, and the number that goes with the chosen one.
pub(super) fn compare_controls(ui: &mut Ui, mode: &mut CompareMode) {
    ui.horizontal_wrapped(|ui| {
        ui.label("Compare").on_hover_text("the uppermost layer with those beneath it: V");
        for kind in CompareMode::ALL {
            let is_this = kind.name() == mode.name();
            if ui.selectable_label(is_this, kind.name()).clicked() && !is_this {
                *mode = kind;
            }
        }
    });
    // A slider brings a number into its range, so its range has every number that the mode may have.
    let slider = match mode {
        CompareMode::Off | CompareMode::Beside => return,
        CompareMode::Swipe(at) => Slider::new(at, 0.0..=1.0).text("Line"),
        CompareMode::Flicker(seconds) => {
            Slider::new(seconds, 0.05..=60.0).logarithmic(true).suffix(" s").text("Each")
        }
        CompareMode::Difference(times) => {
            Slider::new(times, 0.01..=1000.0).logarithmic(true).prefix("×").text("Magnified")
        }
    };
    ui.add(slider);
}

/// Where images of unlike size lie.
pub(super) fn placement_controls(ui: &mut Ui, placement: &mut Placement) {
    ui.horizontal_wrapped(|ui| {
        ui.label("Sizes differ").on_hover_text("images of other sizes lie over the lowest one");
        for one in Placement::ALL {
            let told = match one {
                Placement::Stretched => "each over all of the lowest one's place: for copies at another scale",
                Placement::ByTexel => {
                    "texel upon texel, from the upper left corner: for crops and other scans; nothing is shown of \
                     an image beyond its edges"
                }
            };
            ui.selectable_value(placement, one, one.name()).on_hover_text(told);
        }
    });
}

/// Paints the line of [`CompareMode::Swipe`] over a picture that is so many physical pixels wide, within
/// `free`, the part of it that no panel covers, and lets a person drag it. Returns true if it was moved.
/// Nothing is painted in other modes.
pub fn swipe_line(context: &Context, free: Rect, width: u32, mode: &mut CompareMode) -> bool {
    let CompareMode::Swipe(at) = mode else { return false };
    let points = width.max(1) as f32 / context.pixels_per_point();
    let x = (*at * points).clamp(free.min.x, free.max.x);
    let grip = Rect::from_min_max(pos2(x - GRIP / 2.0, free.min.y), pos2(x + GRIP / 2.0, free.max.y));
    let area = Area::new(Id::unique("swipe")).fixed_pos(grip.min);
    let moved = area.constrain(false).show(context, |ui| {
        let (rect, response) = ui.allocate_exact_size(grip.size(), Sense::drag());
        response.widget_info(|| {
            WidgetInfo::labeled(egui::Role::Slider, true, "Line between the compared layers")
        });
        let painter = ui.painter();
        let line = [pos2(x, rect.min.y), pos2(x, rect.max.y)];
        painter.line_segment(line, Stroke::new(3.0, Color32::from_black_alpha(160)));
        painter.line_segment(line, Stroke::new(1.0, Color32::WHITE));
        let handle = Rect::from_center_size(pos2(x, rect.center().y), vec2(8.0, 34.0));
        painter.rect(
            handle,
            4.0,
            Color32::WHITE,
            Stroke::new(1.0, Color32::BLACK),
            egui::StrokeKind::Outside,
        );
        let pointer =
            response.on_hover_and_drag_cursor(CursorIcon::ResizeHorizontal).interact_pointer_pos()?;
        Some(((pointer.x.clamp(free.min.x, free.max.x)) / points).clamp(0.0, 1.0))
    });
    match moved.inner {
        Some(to) if to != *at => {
            *at = to;
            true
        }
        _ => false,
    }
}
