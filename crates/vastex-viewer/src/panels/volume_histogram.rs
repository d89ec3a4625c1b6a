//! Which values a channel of a volume has, beside the range that is shown of them.

use egui::{Color32, CursorIcon, Rect, Sense, Stroke, StrokeKind, Ui, Vec2, WidgetInfo};

use super::shades::{drag, held_axis, value_at, x_of};
use crate::volume_scene::ChannelLook;

const HEIGHT: f32 = 70.0;
const STRIP: f32 = 10.0;
const COLUMNS: usize = 96;

/// How the values of a channel are distributed, as they are stored: those below which equal shares of all
/// lie, from the least to the greatest.
#[derive(Clone, Debug, PartialEq)]
pub struct VolumeValues(Vec<f64>);

impl VolumeValues {
    /// Of the values below which 0, 1/n, 2/n and so on of all lie, n being at least 1. `None` where they do
    /// not rise, or are no numbers.
    pub fn new(quantiles: Vec<f64>) -> Option<VolumeValues> {
        let is_rising = quantiles.is_sorted() && quantiles.iter().all(|value| value.is_finite());
        (quantiles.len() > 1 && is_rising).then_some(VolumeValues(quantiles))
    }

    /// The shares at which quantiles are to be asked for, for [`VolumeValues::new`].
    pub fn shares() -> Vec<f64> {
        const PARTS: u32 = 256;
        (0..=PARTS).map(|part| f64::from(part) / f64::from(PARTS)).collect()
    }

    fn ends(&self) -> [f64; 2] {
        [self.0[0], self.0[self.0.len() - 1]]
    }

    /// The share of the values below one, 0 to 1.
    fn below(&self, value: f64) -> f64 {
        let after = self.0.partition_point(|quantile| *quantile < value);
        let share = match (after.checked_sub(1), self.0.get(after)) {
            (None, _) => 0.0,
            (Some(before), None) => before as f64,
            (Some(before), Some(next)) => {
                let low = self.0[before];
                before as f64 + (value - low) / (next - low).max(f64::MIN_POSITIVE)
            }
        };
        share / (self.0.len() - 1) as f64
    }

    /// The ends of the graph: all values, the range, and some room.
    fn axis(&self, range: [f64; 2]) -> [f64; 2] {
        let [least, most] = self.ends();
        let (low, high) = (least.min(range[0]).min(range[1]), most.max(range[0]).max(range[1]));
        let room = ((high - low) * 0.03).max(f64::MIN_POSITIVE);
        [low - room, high + room]
    }
}

/// Draws how values are distributed, in the colours that they are shown in, and lets a person drag the values
/// that are dark and bright. Returns true if they were changed.
pub(super) fn volume_histogram(
    ui: &mut Ui,
    values: &VolumeValues,
    channel: &ChannelLook,
    range: &mut [f64; 2],
) -> bool {
    let size = Vec2::new(ui.available_width().min(290.0), HEIGHT + STRIP);
    let (rect, response) = ui.allocate_exact_size(size, Sense::click_and_drag());
    let (graph, strip) = rect.split_top_bottom_at_y(rect.top() + HEIGHT);
    // While a handle is held, what it stands on stays.
    let axis = held_axis(&response, || values.axis(*range));
    let is_changed = drag(&response, graph, axis, range);
    response.widget_info(|| WidgetInfo::labeled(egui::Role::Slider, true, "Range of values"));
    if response.hovered() {
        ui.ctx().set_cursor_icon(CursorIcon::ResizeHorizontal);
    }
    let painter = ui.painter_at(rect);
    painter.rect_filled(rect, 2.0, ui.visuals().extreme_bg_color);
    let shares: Vec<f64> = (0..COLUMNS)
        .map(|n| {
            let [low, high] = [n, n + 1].map(|n| values.below(value_at(axis, n, COLUMNS)));
            (high - low).max(0.0)
        })
        .collect();
    // What stands out far, as the background does, is cut off at the top.
    let mut highest = shares.clone();
    highest.sort_unstable_by(|a, b| b.total_cmp(a));
    let most = highest.iter().copied().filter(|share| *share > 0.0).nth(2);
    let most = most.unwrap_or(highest[0]).max(f64::MIN_POSITIVE);
    let column = |n: usize| graph.left() + graph.width() * n as f32 / COLUMNS as f32;
    let plain = ui.visuals().text_color().gamma_multiply(0.55);
    for (n, share) in shares.iter().enumerate() {
        let value = value_at(axis, 2 * n + 1, 2 * COLUMNS);
        let place = (value - range[0]) / (range[1] - range[0]);
        let [r, g, b] = channel.color_at(if place.is_nan() { 0.0 } else { place as f32 });
        let part = Rect::from_x_y_ranges(column(n)..=column(n + 1) + 0.5, strip.y_range());
        painter.rect_filled(part, 0.0, Color32::from_rgb(r, g, b));
        if *share > 0.0 {
            // Few values are seen beside many.
            let height = (share / most).min(1.0).sqrt() as f32 * (HEIGHT - 4.0);
            let top = graph.bottom() - height.max(1.0);
            let bar = Rect::from_x_y_ranges(column(n)..=column(n + 1), top..=graph.bottom());
            painter.rect_filled(bar, 0.0, plain);
        }
    }
    for (value, color) in range.iter().zip([Color32::BLACK, Color32::WHITE]) {
        let x = x_of(*value, graph, axis);
        painter.vline(x, graph.y_range(), Stroke::new(3.0, Color32::GRAY));
        painter.vline(x, graph.y_range(), Stroke::new(1.5, color));
    }
    painter.rect_stroke(rect, 2.0, ui.visuals().widgets.noninteractive.bg_stroke, StrokeKind::Inside);
    is_changed
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_below_a_value_follow_from_quantiles() {
        let values = VolumeValues::new(vec![0.0, 10.0, 10.0, 20.0, 100.0]).unwrap();
        for (value, share) in
            [(-5.0, 0.0), (0.0, 0.0), (5.0, 0.125), (15.0, 0.625), (60.0, 0.875), (200.0, 1.0)]
        {
            assert!((values.below(value) - share).abs() < 1e-12, "{value}: {}", values.below(value));
        }
        assert_eq!(values.ends(), [0.0, 100.0]);
        let [low, high] = values.axis([-50.0, 20.0]);
        assert!(low < -50.0 && high > 100.0);
        for bad in [vec![], vec![1.0], vec![2.0, 1.0], vec![0.0, f64::NAN], vec![0.0, f64::INFINITY]] {
            assert_eq!(VolumeValues::new(bad), None);
        }
        // All values are one.
        let even = VolumeValues::new(vec![7.0; 257]).unwrap();
        assert_eq!((even.below(6.9), even.below(7.1)), (0.0, 1.0));
        assert_eq!(VolumeValues::shares().len(), 257);
    }
}
