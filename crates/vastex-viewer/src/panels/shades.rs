//! A picture of values and of the shades that they become: a histogram with handles at black and white, above
//! a strip of colours.

use egui::{Color32, CursorIcon, Id, Pos2, Rect, Response, Sense, Stroke, StrokeKind, Ui, Vec2, WidgetInfo};

use crate::inspect::Histogram;
use crate::layers::{ColorMap, StoredScale};

const HEIGHT: f32 = 90.0;
const STRIP: f32 = 12.0;
const COLUMNS: usize = 96;

/// Draws the histogram of stored values with the colours that they become, and lets a person drag black and
/// white. `range` is in stored values; returns true if it was changed.
pub(super) fn shades(
    ui: &mut Ui,
    histogram: Option<&Histogram>,
    scale: StoredScale,
    color_map: &ColorMap,
    range: &mut [f64; 2],
) -> bool {
    let size = Vec2::new(ui.available_width(), HEIGHT + STRIP);
    let (rect, response) = ui.allocate_exact_size(size, Sense::click_and_drag());
    let (graph, strip) = rect.split_top_bottom_at_y(rect.top() + HEIGHT);
    // While a handle is held, what it stands on stays.
    let axis = held_axis(&response, || axis(histogram, scale, *range));
    let is_changed = drag(&response, graph, axis, range);
    response.widget_info(|| WidgetInfo::labeled(egui::Role::Slider, true, "Range of values"));
    if response.hovered() {
        ui.ctx().set_cursor_icon(CursorIcon::ResizeHorizontal);
    }
    let painter = ui.painter_at(rect);
    painter.rect_filled(graph, 2.0, ui.visuals().extreme_bg_color);
    if let Some(histogram) = histogram {
        let edges: Vec<f32> = (0..=COLUMNS).map(|n| scale.sampled(value_at(axis, n, COLUMNS))).collect();
        let channels = histogram.channels();
        let counts: Vec<Vec<usize>> =
            (0..channels).map(|channel| histogram.counts(channel, &edges)).collect();
        let most = counts.iter().flatten().copied().max().unwrap_or(0).max(1) as f32;
        for (channel, counts) in counts.iter().enumerate() {
            let colour = match (channels, channel) {
                (1, _) => ui.visuals().text_color().gamma_multiply(0.7),
                (_, 0) => Color32::from_rgba_unmultiplied(230, 80, 70, 120),
                (_, 1) => Color32::from_rgba_unmultiplied(80, 200, 90, 120),
                _ => Color32::from_rgba_unmultiplied(90, 130, 250, 120),
            };
            for (n, &count) in counts.iter().enumerate().filter(|(_, count)| **count > 0) {
                // Few values are seen beside many.
                let height = (count as f32 / most).sqrt() * (HEIGHT - 4.0);
                let column = |n: usize| graph.left() + graph.width() * n as f32 / COLUMNS as f32;
                let top = graph.bottom() - height.max(1.0);
                let bar =
                    Rect::from_min_max(Pos2::new(column(n), top), Pos2::new(column(n + 1), graph.bottom()));
                painter.rect_filled(bar, 0.0, colour);
            }
        }
    }
    for n in 0..COLUMNS {
        let value = scale.sampled(value_at(axis, 2 * n + 1, 2 * COLUMNS));
        let [r, g, b, _] = color_map.pixel_from_value(color_map.opaque(value), 1.0);
        let column = |n: usize| strip.left() + strip.width() * n as f32 / COLUMNS as f32;
        let part = Rect::from_x_y_ranges(column(n)..=column(n + 1) + 0.5, strip.y_range());
        painter.rect_filled(part, 0.0, Color32::from_rgb(r, g, b));
    }
    for (value, colour) in range.iter().zip([Color32::BLACK, Color32::WHITE]) {
        let x = x_of(*value, graph, axis);
        painter.vline(x, graph.y_range(), Stroke::new(3.0, Color32::GRAY));
        painter.vline(x, graph.y_range(), Stroke::new(1.5, colour));
    }
    painter.rect_stroke(rect, 2.0, ui.visuals().widgets.noninteractive.bg_stroke, StrokeKind::Inside);
    is_changed
}

/// The axis that a drag began with; else, where none goes on, the one of this frame.
pub(super) fn held_axis(response: &Response, axis: impl FnOnce() -> [f64; 2]) -> [f64; 2] {
    let kept: Id = response.id.with("axis");
    let is_held = response.dragged() || response.is_pointer_button_down_on();
    let before = response.ctx.data(|data| data.get_temp::<[f64; 2]>(kept)).filter(|_| is_held);
    let axis = before.unwrap_or_else(axis);
    response.ctx.data_mut(|data| {
        if is_held {
            data.insert_temp(kept, axis);
        } else {
            data.remove::<[f64; 2]>(kept);
        }
    });
    axis
}

/// The stored values at the ends of the graph: all that is in view, black and white, and some room.
fn axis(histogram: Option<&Histogram>, scale: StoredScale, range: [f64; 2]) -> [f64; 2] {
    let extent = histogram.and_then(Histogram::extent).map(|extent| extent.map(|value| scale.stored(value)));
    let [low, high] = extent.unwrap_or(range);
    let low = low.min(range[0]).min(range[1]);
    let high = high.max(range[0]).max(range[1]);
    let room = ((high - low) * 0.04).max(f64::MIN_POSITIVE);
    match scale.most() {
        Some(most) => [(low - room).max(-0.02 * most), (high + room).min(1.02 * most.max(high))],
        None => [low - room, high + room],
    }
}

pub(super) fn value_at([low, high]: [f64; 2], n: usize, count: usize) -> f64 {
    low + (high - low) * n as f64 / count as f64
}

pub(super) fn x_of(value: f64, graph: Rect, [low, high]: [f64; 2]) -> f32 {
    graph.left() + graph.width() * ((value - low) / (high - low)) as f32
}

/// Moves the handle that a drag began at, or the nearest one where a click is.
pub(super) fn drag(response: &Response, graph: Rect, axis: [f64; 2], range: &mut [f64; 2]) -> bool {
    let held: Id = response.id.with("held");
    let Some(pointer) = response.interact_pointer_pos() else { return false };
    // By where it was pressed: a drag is known for one only some way from there.
    let pressed = response.ctx.input(|input| input.pointer.press_origin()).unwrap_or(pointer);
    let distance = |value: f64| (x_of(value, graph, axis) - pressed.x).abs();
    let nearest = usize::from(distance(range[1]) < distance(range[0]));
    if response.drag_started() || response.clicked() {
        // In the drag it stays the same one, wherever the other is.
        response.ctx.data_mut(|data| data.insert_temp(held, nearest));
    }
    if !response.dragged() && !response.clicked() {
        return false;
    }
    let moved = response.ctx.data(|data| data.get_temp(held)).unwrap_or(nearest);
    let share = f64::from(((pointer.x - graph.left()) / graph.width()).clamp(0.0, 1.0));
    let value = axis[0] + (axis[1] - axis[0]) * share;
    let is_changed = range[moved] != value && range[1 - moved] != value;
    if is_changed {
        range[moved] = value;
    }
    is_changed
}
