//! How long frames take: from one to the next, and what the GPU says of their parts.

use std::collections::VecDeque;
use std::time::Duration;

use egui::{Color32, Rect, RichText, Sense, Ui, pos2, vec2};

use super::HudData;
use super::graph::{Series, Style, graph, round_top};

const FRAME: Color32 = Color32::from_rgb(150, 190, 255);
/// Frames that are kept.
const MOST: usize = 256;

/// The times between the last frames that followed one another without a pause.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FrameTimes {
    ms: VecDeque<f32>,
}

impl FrameTimes {
    /// A frame came so long after the one before.
    pub fn push(&mut self, time: Duration) {
        if self.ms.len() == MOST {
            self.ms.pop_front();
        }
        self.ms.push_back(1000.0 * time.as_secs_f32());
    }

    /// Milliseconds that a share of the frames did not take longer than, 0 to 1; nothing before the second frame.
    fn within(&self, share: f32) -> Option<f32> {
        let mut sorted: Vec<f32> = self.ms.iter().copied().collect();
        sorted.sort_by(f32::total_cmp);
        let last = sorted.len().checked_sub(1)?;
        sorted.get((last as f32 * share).round() as usize).copied()
    }
}

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
        None => {
            ui.label(RichText::new("This device tells no GPU times.").small().weak());
        }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_frames_are_kept() {
        let mut frames = FrameTimes::default();
        assert_eq!(frames.within(0.5), None);
        (0..MOST as u64 + 10).for_each(|n| frames.push(Duration::from_millis(n)));
        assert_eq!(
            (frames.ms.len(), frames.within(0.0), frames.within(1.0)),
            (MOST, Some(10.0), Some(265.0))
        );
    }
}
