//! Views of the machine: which is drawn in the place of the picture, small ones to click on, and why a pixel
//! shows what it shows.

use egui::{
    Color32, CursorIcon, Pos2, Rect, RichText, Role, Sense, Stroke, StrokeKind, Ui, WidgetInfo, pos2, vec2,
};

use super::{HudChange, HudData};
use crate::overlay::Overlay;

pub(super) fn show(ui: &mut Ui, data: &HudData, changes: &mut Vec<HudChange>) {
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 2.0;
        let choices = std::iter::once(None).chain(Overlay::ALL.map(Some));
        for overlay in choices {
            let name = overlay.map_or("picture", Overlay::name);
            let label = ui.selectable_label(data.overlay == overlay, name);
            if label.on_hover_text(meaning(overlay)).clicked() && data.overlay != overlay {
                changes.push(HudChange::Overlay(overlay));
            }
        }
    });
    if data.thumbnails.is_empty() {
        return;
    }
    let count = data.thumbnails.len() as f32;
    let gap = ui.spacing().item_spacing.x;
    let width = (ui.available_width() - gap * (count - 1.0)) / count;
    ui.horizontal_top(|ui| {
        for thumbnail in &data.thumbnails {
            let height = width * thumbnail.size[1] as f32 / thumbnail.size[0].max(1) as f32;
            let (rect, response) = ui.allocate_exact_size(vec2(width, height), Sense::click());
            let is_shown = data.overlay == Some(thumbnail.overlay);
            let name = format!("Small picture: {}", thumbnail.overlay.name());
            response.widget_info(|| WidgetInfo::selected(Role::Button, true, is_shown, &name));
            let whole = Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0));
            ui.painter().image(thumbnail.picture, rect, whole, Color32::WHITE);
            let stroke = match (is_shown, response.has_focus() || response.hovered()) {
                (true, _) => Stroke::new(2.0, ui.visuals().selection.bg_fill),
                (_, true) => ui.visuals().widgets.hovered.bg_stroke,
                _ => Stroke::new(1.0, Color32::from_gray(90)),
            };
            ui.painter().rect_stroke(rect, 2.0, stroke, StrokeKind::Inside);
            let response = response.on_hover_cursor(CursorIcon::PointingHand);
            if response.on_hover_text(meaning(Some(thumbnail.overlay))).clicked() {
                changes.push(HudChange::Overlay((!is_shown).then_some(thumbnail.overlay)));
            }
        }
    });
}

fn meaning(overlay: Option<Overlay>) -> &'static str {
    match overlay {
        None => "what is sampled",
        Some(Overlay::Levels) => "a colour for each level that is shown",
        Some(Overlay::Wanted) => "a colour for each level that is wanted",
        Some(Overlay::Deficit) => "how many levels coarser than wanted it is",
        Some(Overlay::Pages) => "the borders of the pages that are shown",
        Some(Overlay::Feedback) => "what the feedback pass sees, a colour for each page",
        Some(Overlay::Table) => "the page table: every page, in the colour of the level that it leads to",
        Some(Overlay::Atlas) => "the slots of the pool and the tiles in them",
    }
}

/// Why the pixel that was asked about shows what it shows.
pub(super) fn explain(ui: &mut Ui, data: &HudData) {
    let Some(explained) = &data.explained else {
        ui.label(RichText::new("Point at the picture to see why it shows what it shows.").small().weak());
        return;
    };
    let [x, y] = explained.pixel;
    if explained.explanations.is_empty() {
        ui.label(RichText::new(format!("Pixel {x},{y}: no texture is seen there.")).small());
    }
    for explanation in &explained.explanations {
        ui.label(RichText::new(explanation.to_string()).small());
    }
}
