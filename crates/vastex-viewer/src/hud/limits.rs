//! What all pools share, to be changed: budgets, how texels are blended, how views say what they want.

use egui::{ComboBox, DragValue, RichText, Ui};
use vastex::{FeedbackMode, Filter, MaxTaps};

use super::{HudChange, HudData, bytes};

const KIB: f64 = 1024.0;
/// Kibibytes that a person may write.
const UPLOADS: std::ops::RangeInclusive<f64> = 1.0..=1_048_576.0;
const FILTERS: [Option<Filter>; 7] = [
    None,
    Some(Filter::Nearest),
    Some(Filter::Bilinear),
    Some(Filter::Trilinear),
    Some(Filter::Anisotropic(MaxTaps::ALL[2])),
    Some(Filter::Anisotropic(MaxTaps::ALL[3])),
    Some(Filter::Bicubic),
];

pub(super) fn show(ui: &mut Ui, data: &HudData, changes: &mut Vec<HudChange>) {
    let (mut uploads, mut in_flight) =
        (data.upload_bytes_per_frame as f64 / KIB, data.in_flight_bytes as f64 / KIB);
    let is_changed = [
        budget(ui, "Uploads a frame", &mut uploads, "bytes copied to the GPU in each frame"),
        budget(
            ui,
            "Loads in flight",
            &mut in_flight,
            "bytes of tiles that are loaded or wait for their upload",
        ),
    ];
    if is_changed.contains(&true) {
        let [uploads, in_flight] = [uploads, in_flight].map(|kib| (kib * KIB) as u64);
        changes.push(HudChange::Budgets { uploads, in_flight });
    }
    if !data.is_of_volume {
        sampling(ui, data, changes);
    }
    let tiers = data.pools.iter().filter_map(|pool| pool.records.last()).map(|record| record.tiers.ram.bytes);
    let text = format!(
        "page tables {}, tiles kept in main memory {}",
        bytes(data.stats.table_bytes),
        bytes(tiers.sum())
    );
    ui.label(RichText::new(text).small().weak());
}

/// How texels are blended, and how views say what they want.
fn sampling(ui: &mut Ui, data: &HudData, changes: &mut Vec<HudChange>) {
    let mut filter = data.filter;
    ComboBox::from_label("Filter").selected_text(filter_name(filter)).show_ui(ui, |ui| {
        for choice in FILTERS {
            ui.selectable_value(&mut filter, choice, filter_name(choice));
        }
    });
    if filter != data.filter {
        changes.push(HudChange::Filter(filter));
    }
    let mut feedback = data.feedback;
    ComboBox::from_label("Feedback").selected_text(feedback.name()).show_ui(ui, |ui| {
        for mode in FeedbackMode::ALL {
            ui.selectable_value(&mut feedback, mode, mode.name()).on_hover_text(meaning(mode));
        }
    });
    if feedback != data.feedback {
        changes.push(HudChange::Feedback(feedback));
    }
}

/// A number of kibibytes. Returns true if it was changed.
fn budget(ui: &mut Ui, name: &str, kib: &mut f64, what: &str) -> bool {
    let before = *kib;
    ui.horizontal(|ui| {
        let value = DragValue::new(kib)
            .range(UPLOADS)
            .clamp_existing_to_range(false)
            .speed(0.0)
            .suffix(" KiB")
            .max_decimals(0);
        let value = ui.add(value.update_while_editing(false));
        let label = ui.label(name);
        value.labelled_by(label.id).on_hover_text(format!("{what}; click to write another number"));
    });
    (*kib - before).abs() >= 1.0
}

fn filter_name(filter: Option<Filter>) -> String {
    filter.map_or_else(|| "by magnification".to_owned(), |filter| filter.to_string())
}

fn meaning(mode: FeedbackMode) -> &'static str {
    match mode {
        FeedbackMode::Separate => "the scene is drawn once more, small, and compacted on the GPU",
        FeedbackMode::Inline => "pixels of the picture say what they want",
        FeedbackMode::Raw => "the scene is drawn once more, small, and compacted on the CPU",
    }
}
