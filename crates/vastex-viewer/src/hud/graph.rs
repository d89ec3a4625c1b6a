//! A strip chart of the last frames: a few lines or bars over one another, the newest at the right, with what
//! they are at the pointer.

use egui::{
    Color32, Mesh, Pos2, Rect, Role, Sense, Shape, Stroke, StrokeKind, Ui, Vec2, WidgetInfo, pos2, vec2,
};

use crate::figures::round_up;

/// What a graph is drawn on, in light and in dark.
const GROUND: Color32 = Color32::from_rgb(22, 24, 29);
const GRID: Color32 = Color32::from_rgb(48, 52, 60);

/// How the values of a graph are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Style {
    Line,
    /// A line with what lies below it.
    Area,
    /// A bar for each frame, of what is counted in it.
    Bars,
    /// Bars that hang from the top.
    Hanging,
}

/// The values of one thing.
pub(super) struct Series<'a> {
    pub(super) name: &'a str,
    pub(super) color: Color32,
    pub(super) style: Style,
    /// The newest last; no number where there is nothing to say.
    pub(super) values: Vec<f32>,
    /// What the top of the graph stands for.
    pub(super) top: f32,
    /// A value in words.
    pub(super) told: &'a dyn Fn(f32) -> String,
}

impl Series<'_> {
    fn newest(&self) -> String {
        let newest = self.values.iter().rev().find(|value| value.is_finite());
        newest.map_or_else(|| "–".to_owned(), |value| (self.told)(*value))
    }
}

/// What the top of a graph stands for, so that all values are in it: the least of 1, 2 and 5 times a power of
/// ten.
pub(super) fn round_top(values: impl IntoIterator<Item = f32>, least: f32) -> f32 {
    let most = values.into_iter().filter(|value| value.is_finite()).fold(least, f32::max);
    round_up(most.into()) as f32
}

/// Draws a graph that is `frames` wide and so high, with what each line is now above it. `name` is for those
/// who hear it.
pub(super) fn graph(ui: &mut Ui, name: &str, height: f32, frames: u64, series: &[Series<'_>]) {
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        for series in series {
            let (swatch, _) = ui.allocate_exact_size(vec2(9.0, 9.0), Sense::hover());
            ui.painter().rect_filled(swatch, 2.0, series.color);
            ui.label(egui::RichText::new(series.name).small());
            ui.label(egui::RichText::new(series.newest()).small().strong());
            ui.add_space(4.0);
        }
    });
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), height), Sense::hover());
    let told = || {
        let all: Vec<String> =
            series.iter().map(|series| format!("{} {}", series.name, series.newest())).collect();
        format!("{name}: {}", all.join(", "))
    };
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, told()));
    let painter = ui.painter_at(rect);
    painter.rect_filled(rect, 3.0, GROUND);
    for quarter in 1..4 {
        let y = rect.top() + rect.height() * quarter as f32 / 4.0;
        painter.hline(rect.x_range(), y, Stroke::new(1.0, GRID));
    }
    let axis = Axis { rect: rect.shrink2(vec2(0.0, 2.0)), frames: frames.max(2) as usize };
    for series in series {
        painter.extend(axis.draw(series));
    }
    painter.rect_stroke(rect, 3.0, Stroke::new(1.0, GRID), StrokeKind::Inside);
    let Some(pointer) = response.hover_pos() else { return };
    let ago = axis.ago(pointer.x);
    let x = axis.x(ago);
    painter.vline(x, rect.y_range(), Stroke::new(1.0, Color32::from_gray(190)));
    response.on_hover_ui_at_pointer(|ui| {
        ui.label(match ago {
            0 => "newest frame".to_owned(),
            1 => "one frame ago".to_owned(),
            ago => format!("{ago} frames ago"),
        });
        for series in series {
            let value = series.values.iter().rev().nth(ago).filter(|value| value.is_finite());
            let told = value.map_or_else(|| "–".to_owned(), |value| (series.told)(*value));
            ui.colored_label(series.color, format!("{} {told}", series.name));
        }
    });
}

/// Where frames and values lie.
struct Axis {
    rect: Rect,
    /// From the left to the right.
    frames: usize,
}

impl Axis {
    fn step(&self) -> f32 {
        self.rect.width() / (self.frames - 1) as f32
    }

    fn x(&self, ago: usize) -> f32 {
        self.rect.right() - ago as f32 * self.step()
    }

    fn ago(&self, x: f32) -> usize {
        ((self.rect.right() - x) / self.step()).round().clamp(0.0, (self.frames - 1) as f32) as usize
    }

    fn draw(&self, series: &Series<'_>) -> Vec<Shape> {
        let share = |value: f32| (value / series.top.max(f32::MIN_POSITIVE)).clamp(0.0, 1.0);
        let points = series.values.iter().rev().take(self.frames).enumerate();
        let points = points.map(|(ago, value)| {
            let y = self.rect.bottom() - share(*value) * self.rect.height();
            value.is_finite().then(|| pos2(self.x(ago), y))
        });
        let points: Vec<Option<Pos2>> = points.collect();
        match series.style {
            Style::Bars | Style::Hanging => vec![Shape::mesh(self.bars(series, &points))],
            Style::Line | Style::Area => {
                let mut shapes = Vec::new();
                for run in points.split(Option::is_none) {
                    let run: Vec<Pos2> = run.iter().copied().flatten().collect();
                    if series.style == Style::Area {
                        shapes.push(Shape::mesh(self.below(&run, series.color.gamma_multiply(0.22))));
                    }
                    match run[..] {
                        [] => {}
                        [only] => shapes.push(Shape::circle_filled(only, 1.5, series.color)),
                        _ => shapes.push(Shape::line(run, Stroke::new(1.6, series.color))),
                    }
                }
                shapes
            }
        }
    }

    /// What lies below a line.
    fn below(&self, line: &[Pos2], color: Color32) -> Mesh {
        let mut mesh = Mesh::default();
        for (n, point) in line.iter().enumerate() {
            mesh.colored_vertex(*point, color);
            mesh.colored_vertex(pos2(point.x, self.rect.bottom()), color);
            if n > 0 {
                let at = 2 * n as u32;
                mesh.add_triangle(at - 2, at - 1, at);
                mesh.add_triangle(at - 1, at, at + 1);
            }
        }
        mesh
    }

    fn bars(&self, series: &Series<'_>, points: &[Option<Pos2>]) -> Mesh {
        let mut mesh = Mesh::default();
        let wide = Vec2::splat(self.step().max(1.0));
        for point in points.iter().flatten().filter(|point| point.y < self.rect.bottom() - 0.1) {
            // However few there are, they are seen.
            let height = (self.rect.bottom() - point.y).max(1.5);
            let top = match series.style {
                Style::Hanging => self.rect.top(),
                _ => self.rect.bottom() - height,
            };
            mesh.add_colored_rect(
                Rect::from_min_size(pos2(point.x - wide.x / 2.0, top), vec2(wide.x, height)),
                series.color,
            );
        }
        mesh
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tops_are_round_and_above_all_values() {
        for (values, top) in
            [(&[0.0, 3.0][..], 5.0), (&[17.0], 20.0), (&[f32::NAN, 100.0], 100.0), (&[], 4.0), (&[0.21], 4.0)]
        {
            let found = round_top(values.iter().copied(), 4.0);
            assert!((found - if top == 4.0 { 5.0 } else { top }).abs() < 1e-3, "{values:?}: {found}");
        }
    }

    #[test]
    fn the_newest_value_is_at_the_right_and_gaps_stay_gaps() {
        let rect = Rect::from_min_size(pos2(10.0, 0.0), vec2(100.0, 50.0));
        let axis = Axis { rect, frames: 11 };
        assert_eq!((axis.x(0), axis.x(10), axis.ago(60.0), axis.ago(-500.0)), (110.0, 10.0, 5, 10));
        let told = |value: f32| value.to_string();
        let series = |style, values: &[f32]| Series {
            name: "a",
            color: Color32::RED,
            style,
            values: values.to_vec(),
            top: 10.0,
            told: &told,
        };
        let shapes = axis.draw(&series(Style::Line, &[5.0, 10.0, f32::NAN, 20.0, 0.0]));
        let [Shape::Path(newest), Shape::Path(before)] = &shapes[..] else { panic!("{shapes:?}") };
        assert_eq!(newest.points, [pos2(110.0, 50.0), pos2(100.0, 0.0)], "what is too large is at the top");
        assert_eq!(before.points, [pos2(80.0, 0.0), pos2(70.0, 25.0)]);
        let Shape::Mesh(bars) = &axis.draw(&series(Style::Bars, &[0.0, 1.0, 10.0]))[0] else { panic!() };
        assert_eq!(bars.vertices.len(), 8, "nothing is drawn of a frame in which nothing was counted");
    }
}
