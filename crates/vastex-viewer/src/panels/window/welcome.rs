//! What a window shows that was opened without a file.

use egui::{Align2, Area, Button, Frame, Id, Key, Margin, RichText, TextEdit, Ui};

use super::{WindowAsked, name_of};

/// Recent files that are offered.
const MOST_FILES: usize = 8;

/// Offers to open a file, in the middle of what no panel covers: by a dialog, by its path, which a person
/// writes, or one of before.
pub(super) fn welcome(
    ui: &Ui,
    (path, recent): (&mut String, &[String]),
    lacks_drops: bool,
    asked: &mut Vec<WindowAsked>,
) {
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
                let folder = ui.button("Open a folder…");
                if folder.on_hover_text("tiles or a volume that lie in a folder").clicked() {
                    asked.push(WindowAsked::ChooseFolder);
                }
                ui.add_space(4.0);
                let label = ui.label(RichText::new("or write a path, and press Enter").weak());
                let field = ui.add(TextEdit::singleline(path)).labelled_by(label.id);
                let is_entered = field.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter));
                let written = path.trim();
                if is_entered && !written.is_empty() {
                    asked.push(WindowAsked::Open(written.into()));
                }
                ui.add_space(4.0);
                let other = match lacks_drops {
                    true => "or copy a file elsewhere, and press Ctrl + V here",
                    false => "or drop files onto this window",
                };
                ui.label(RichText::new(other).weak());
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
                ui.label(RichText::new("M: the panel    ?: all keys").weak().small());
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
        let show = |ui: &mut Ui, (path, asked): &mut (String, Vec<WindowAsked>)| {
            welcome(ui, (path, &recent), false, asked);
        };
        let nothing = (String::new(), Vec::new());
        let mut harness = Harness::builder().with_size([600.0, 600.0]).build_ui_state(show, nothing);
        harness.run();
        harness.get_by_label("Open a file…").click();
        harness.run();
        harness.get_by_label("scan3.tif").click();
        harness.run();
        harness.get_by_label("Open a folder…").click();
        harness.run();
        harness.get_by_label("or write a path, and press Enter").focus();
        harness.run();
        harness.get_by_label("or write a path, and press Enter").type_text("/of/moon.tif ");
        harness.run();
        harness.key_press(Key::Enter);
        harness.run();
        let asked = [
            WindowAsked::Choose,
            WindowAsked::Open("/scans/scan3.tif".into()),
            WindowAsked::ChooseFolder,
            WindowAsked::Open("/of/moon.tif".into()),
        ];
        assert_eq!(harness.state().1, asked);
        assert!(harness.query_by_label("scan8.tif").is_none(), "as many as have room");
    }
}
