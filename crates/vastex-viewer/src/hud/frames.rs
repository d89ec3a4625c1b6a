//! How long frames take: from one to the next, and what the GPU says of their parts.

use egui::{Color32, Rect, RichText, Sense, Ui, pos2, vec2};

use super::HudData;
use super::frame_times::MOST;
use super::graph::{Series, Style, graph, round_top};

const FRAME: Color32 = Color32::from_rgb(150, 190, 255);

pub(super) fn show(ui: &mut Ui, data: &HudData) {
    let values: Vec<f32> = data.frames.ms.iter().copied().collect();
    let top = round_top(values.iter().copied(), 20.0);
    let told = |value: f32| format!("{value:.1} ms");
    let series = Series { name: "frame", color: FRAME, style: Style::Bars, values, top, told: &told };
    graph(ui, "Frame times", 46.0, MOST as u64, &[series]);
    if let (Some(half), Some(late), Some(worst)) =
        (data.frames.within(0.5), data.frames.within(0.95), data.frames.within(1.0))
    {
        let rate = 1000.0 / half.max(0.01);
        let text =
            format!("half within {half:.1} ms ({rate:.0} a second), 95 % within {late:.1}, worst {worst:.1}");
        ui.label(RichText::new(text).small().weak());
    }
    match &data.gpu_times {
        times if times.as_ref().is_none_or(Vec::is_empty) => {
            let why = match (data.is_of_volume, times) {
                (true, _) => "GPU times are not measured for volumes.",
                (false, None) => "This device tells no GPU times.",
                (false, Some(_)) => "No GPU time is measured yet.",
            };
            ui.label(RichText::new(why).small().weak());
        }
        None => {}
        Some(parts) => {
            let all: f32 = parts.iter().map(|part| part.ms).sum();
            ui.label(RichText::new(format!("GPU {all:.2} ms")).small().strong());
            for part in parts {
                ui.horizontal(|ui| {
                    let (rect, _) = ui.allocate_exact_size(vec2(120.0, 8.0), Sense::hover());
                    ui.painter().rect_filled(rect, 2.0, ui.visuals().extreme_bg_color);
                    let share = if all > 0.0 { part.ms / all } else { 0.0 };
                    let end = pos2(rect.left() + rect.width() * share.clamp(0.0, 1.0), rect.bottom());
                    ui.painter().rect_filled(Rect::from_min_max(rect.min, end), 2.0, FRAME);
                    ui.label(RichText::new(format!("{} {:.2} ms", part.part, part.ms)).small());
                });
            }
        }
    }
}
