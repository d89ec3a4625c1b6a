//! What a file says of itself, as a table that can be searched and copied.

use egui::{Align, CollapsingHeader, Grid, Label, RichText, TextEdit, Ui};

/// The table, as a person left it. The same panel goes on from frame to frame.
#[derive(Clone, Debug, Default)]
pub struct InfoPanel {
    search: String,
    /// True if the table is to be unfolded, and seen.
    opens: bool,
}

impl InfoPanel {
    /// The table is unfolded when it is shown next.
    pub fn open(&mut self) {
        self.opens = true;
    }

    /// Shows rows of a name and a value: those in which what is written in the field stands, whether in large
    /// letters or small ones; a row without a name goes on with the one before it. Without rows it shows
    /// nothing.
    pub fn show(&mut self, ui: &mut Ui, rows: &[(String, String)]) {
        if rows.is_empty() {
            return;
        }
        let opens = std::mem::take(&mut self.opens);
        let header = CollapsingHeader::new("About this file").open(opens.then_some(true)).show(ui, |ui| {
            let found = found(rows, &self.search);
            ui.horizontal(|ui| {
                let label = ui.label("Search");
                let field = TextEdit::singleline(&mut self.search).desired_width(ui.available_width() - 56.0);
                ui.add(field).labelled_by(label.id).on_hover_text("rows in which this stands");
                if ui.button("Copy").on_hover_text("the rows that are shown, as text").clicked() {
                    ui.ctx().copy_text(text_of(&found));
                }
            });
            if found.is_empty() {
                ui.label(RichText::new("no row has that").weak());
            }
            Grid::new("about this file").num_columns(2).striped(true).show(ui, |ui| {
                for (name, value) in &found {
                    ui.label(RichText::new(*name).weak());
                    ui.add(Label::new(*value).wrap().selectable(true));
                    ui.end_row();
                }
            });
        });
        if opens {
            header.header_response.scroll_to_me(Some(Align::TOP));
        }
    }
}

/// The rows in which a text stands, in the name that they go by or in the value.
fn found<'a>(rows: &'a [(String, String)], search: &str) -> Vec<(&'a str, &'a str)> {
    let wanted = search.trim().to_lowercase();
    let mut named = "";
    let mut found: Vec<(&str, &str)> = Vec::new();
    for (name, value) in rows {
        let name = name.trim();
        if !name.is_empty() {
            named = name;
        }
        let has = |text: &str| text.to_lowercase().contains(&wanted);
        if has(named) || has(value) {
            // Alone, it has the name of the row that it goes on with.
            let is_alone =
                name.is_empty() && found.last().is_none_or(|(last, _)| *last != named && !last.is_empty());
            found.push((if is_alone { named } else { name }, &**value));
        }
    }
    found
}

fn text_of(rows: &[(&str, &str)]) -> String {
    rows.iter().map(|(name, value)| format!("{name}\t{value}\n")).collect()
}

#[cfg(test)]
mod tests {
    use egui_kittest::Harness;
    use egui_kittest::kittest::Queryable;

    use super::*;

    fn rows() -> Vec<(String, String)> {
        let row = |name: &str, value: &str| (name.to_owned(), value.to_owned());
        vec![
            row("size", "203 x 141 texels"),
            row("levels", "2, of which the file stores 2"),
            row("", "level 0: 203 x 141 texels"),
            row("", "level 1: 101 x 70 texels"),
            row("system", "EPSG:32633"),
        ]
    }

    #[test]
    fn rows_are_found_by_their_name_or_their_value() {
        let rows = rows();
        assert_eq!(found(&rows, "").len(), 5);
        assert_eq!(found(&rows, " epsg"), [("system", "EPSG:32633")]);
        assert_eq!(found(&rows, "LEVELS").len(), 3);
        assert_eq!(found(&rows, "101"), [("levels", "level 1: 101 x 70 texels")]);
        assert!(found(&rows, "nowhere").is_empty());
        assert_eq!(text_of(&found(&rows, "epsg")), "system\tEPSG:32633\n");
    }

    #[test]
    fn it_is_unfolded_where_it_is_asked_for() {
        let show = |ui: &mut Ui, panel: &mut InfoPanel| panel.show(ui, &rows());
        let mut harness =
            Harness::builder().with_size([320.0, 300.0]).build_ui_state(show, InfoPanel::default());
        assert!(harness.query_by_label("EPSG:32633").is_none());
        harness.state_mut().open();
        harness.run();
        assert!(harness.query_by_label("EPSG:32633").is_some());
        harness.get_by_label("About this file").click();
        harness.run();
        assert!(harness.query_by_label("EPSG:32633").is_none(), "a person closes it");
    }

    #[test]
    fn what_is_searched_for_is_shown_and_copied() {
        let show = |ui: &mut Ui, panel: &mut InfoPanel| panel.show(ui, &rows());
        let mut harness =
            Harness::builder().with_size([320.0, 300.0]).build_ui_state(show, InfoPanel::default());
        assert!(harness.query_by_label("EPSG:32633").is_none(), "closed at first");
        harness.get_by_label("About this file").click();
        harness.run();
        assert!(harness.query_by_label("EPSG:32633").is_some());
        harness.get_by_label("Search").focus();
        harness.run();
        harness.get_by_label("Search").type_text("epsg");
        harness.run();
        assert!(harness.query_by_label("EPSG:32633").is_some());
        assert!(harness.query_by_label("203 x 141 texels").is_none());
        harness.get_by_label("Copy").click();
        harness.step();
        let commands = &harness.output().platform_output.commands;
        let is_copied = |command: &egui::OutputCommand| matches!(command, egui::OutputCommand::CopyText(text) if text == "system\tEPSG:32633\n");
        assert!(commands.iter().any(is_copied), "{commands:?}");
    }
}
