//! What a window shows that was opened without a file.

use egui::{Align2, Area, Button, Frame, Id, Margin, RichText, Ui};

use super::{WindowAsked, name_of};

/// Recent files that are offered.
const MOST_FILES: usize = 8;

/// Offers to open a file, in the middle of what no panel covers.
pub(super) fn welcome(ui: &Ui, recent: &[String], asked: &mut Vec<WindowAsked>) {
    let free = ui.available_rect_before_wrap();
    let area = Area::new(Id::unique("welcome")).pivot(Align2::CENTER_CENTER).fixed_pos(free.center());
    area.show(ui.ctx(), |ui| {
        Frame::window(ui.style()).inner_margin(Margin::same(24)).show(ui, |ui| {
            ui.set_width((free.width() - 80.0).clamp(160.0, 360.0));
            ui.vertical_centered(|ui| {
                ui.label(RichText::new("Vastex").size(26.0).strong());
                ui.label(RichText::new("Images, planets, slides and volumes of any size").weak());
                ui.add_space(14.0);
                let open =
                    Button::new(RichText::new("Open a file…").size(16.0)).min_size([180.0, 34.0].into());
                if ui.add(open).on_hover_text("Ctrl + O").clicked() {
                    asked.push(WindowAsked::Choose);
                }
                ui.add_space(4.0);
                ui.label(RichText::new("or drop files onto this window").weak());
                if !recent.is_empty() {
                    ui.add_space(10.0);
                    ui.separator();
                    ui.label("Opened before");
                }
                for file in recent.iter().take(MOST_FILES) {
                    let button = ui.add(Button::new(name_of(file)).frame(false).truncate());
                    if button.on_hover_text(file).clicked() {
                        asked.push(WindowAsked::Open(file.into()));
                    }
                }
                ui.add_space(10.0);
                ui.label(
                    RichText::new("M: the panel, with a field for a path    ?: all keys").weak().small(),
                );
            });
        });
    });
}

#[cfg(test)]
mod tests {
    use egui_kittest::Harness;
    use egui_kittest::kittest::Queryable;

    use super::*;

    #[test]
    fn files_are_offered_by_the_dialog_and_those_of_before_by_their_names() {
        let recent: Vec<String> = (0..12).map(|n| format!("/scans/scan{n}.tif")).collect();
        let show = |ui: &mut Ui, asked: &mut Vec<WindowAsked>| welcome(ui, &recent, asked);
        let mut harness = Harness::builder().with_size([600.0, 600.0]).build_ui_state(show, Vec::new());
        harness.run();
        harness.get_by_label("Open a file…").click();
        harness.run();
        harness.get_by_label("scan3.tif").click();
        harness.run();
        assert_eq!(*harness.state(), [WindowAsked::Choose, WindowAsked::Open("/scans/scan3.tif".into())]);
        assert!(harness.query_by_label("scan8.tif").is_none(), "as many as have room");
    }
}
