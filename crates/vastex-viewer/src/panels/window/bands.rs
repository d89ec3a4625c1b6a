//! Which bands of a file are shown that has more than a picture: a choice of three, or of one.

use egui::{ComboBox, Ui};

use super::super::FileBands;
use super::WindowAsked;

/// Lets a person choose others, which opens them in the place of those that are shown.
pub(super) fn bands_of_file(ui: &mut Ui, bands: &FileBands, asked: &mut Vec<WindowAsked>) {
    let FileBands { file, names, shown } = bands;
    let mut chosen = shown.clone();
    ui.horizontal_wrapped(|ui| {
        ui.label(format!("{} bands", names.len()));
        for (name, count) in [("three as a colour", 3), ("one", 1)] {
            if ui.selectable_label(chosen.len() == count, name).clicked() && chosen.len() != count {
                let first = chosen.first().copied().unwrap_or(1);
                chosen = if count == 1 {
                    vec![first]
                } else {
                    (0..3).map(|n| (first + n).min(names.len() as u16)).collect()
                };
            }
        }
    });
    let labels: &[&str] =
        if chosen.len() == 1 { &["Band"] } else { &["Red band", "Green band", "Blue band"] };
    for (label, band) in labels.iter().zip(&mut chosen) {
        let name = |band: u16| names.get(usize::from(band).saturating_sub(1)).map_or("?", |name| &**name);
        ComboBox::from_label(*label).selected_text(name(*band)).show_ui(ui, |ui| {
            for other in 1..=names.len() as u16 {
                ui.selectable_value(band, other, name(other));
            }
        });
    }
    if chosen != *shown {
        asked.push(WindowAsked::OpenBands(file.clone(), chosen));
    }
}
