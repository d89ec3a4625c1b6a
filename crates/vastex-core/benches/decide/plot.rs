//! Plots as SVG: small panels side by side, one for each thing that was measured, over the same steps.
//!
//! Where they are written is said by the variable `VASTEX_PLOTS`; without it nothing is.

use std::fmt::Write as _;
use std::path::PathBuf;

/// Told apart by colour-blind readers, too.
const COLORS: [&str; 5] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#b08a00"];
/// Panels in a row; the place after the last panel is the legend's.
const COLUMNS: usize = 3;
/// Of a panel, in pixels: all of it, and what surrounds the plot itself (left, top, right, bottom).
const SIZE: [f64; 2] = [320.0, 230.0];
const MARGINS: [f64; 4] = [52.0, 34.0, 14.0, 42.0];

/// One thing that was measured: a line for each name, a number for each step.
pub(crate) struct Panel {
    pub(crate) title: &'static str,
    pub(crate) lines: Vec<Vec<f64>>,
}

/// What all panels share.
pub(crate) struct Plot {
    /// What the steps are, and what each is called.
    pub(crate) x_title: &'static str,
    pub(crate) steps: Vec<String>,
    /// What the lines are called.
    pub(crate) names: Vec<String>,
    pub(crate) panels: Vec<Panel>,
}

impl Plot {
    /// Writes the plot to `name` in the directory for plots, if there is one.
    pub(crate) fn write(&self, name: &str) {
        if let Some(directory) = std::env::var_os("VASTEX_PLOTS") {
            std::fs::write(PathBuf::from(directory).join(name), self.to_svg()).unwrap();
        }
    }

    fn to_svg(&self) -> String {
        let rows = (self.panels.len() + 1).div_ceil(COLUMNS);
        let [width, height] = [SIZE[0] * COLUMNS as f64, SIZE[1] * rows as f64];
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" height=\"{height}\" \
             font-family=\"sans-serif\" font-size=\"11\" fill=\"#222\">\n\
             <rect width=\"{width}\" height=\"{height}\" fill=\"#fff\"/>\n"
        );
        for (place, panel) in self.panels.iter().enumerate() {
            svg.push_str(&at_place(place, &self.panel(panel)));
        }
        svg.push_str(&at_place(self.panels.len(), &self.legend()));
        svg.push_str("</svg>\n");
        svg
    }

    fn panel(&self, panel: &Panel) -> String {
        let [left, top, right, bottom] = MARGINS;
        let (width, height) = (SIZE[0] - left - right, SIZE[1] - top - bottom);
        let most = panel.lines.iter().flatten().fold(0.0, |most: f64, &value| most.max(value));
        let (tick, ticks) = ticks_to(most);
        let x_of = |step: usize| left + width * (step as f64 + 0.5) / self.steps.len() as f64;
        let y_of = |value: f64| top + height * (1.0 - value / (tick * f64::from(ticks)));
        let mut svg = text(
            SIZE[0] / 2.0,
            20.0,
            "middle",
            &format!("<tspan font-weight=\"bold\">{}</tspan>", panel.title),
        );
        for n in 0..=ticks {
            let (value, y) = (tick * f64::from(n), y_of(tick * f64::from(n)));
            let x_end = left + width;
            writeln!(svg, "<path d=\"M{left} {y:.1}H{x_end}\" stroke=\"#ddd\"/>").unwrap();
            svg.push_str(&text(left - 6.0, y + 4.0, "end", &number(value, tick)));
        }
        for (step, label) in self.steps.iter().enumerate() {
            svg.push_str(&text(x_of(step), top + height + 15.0, "middle", label));
        }
        svg.push_str(&text(left + width / 2.0, SIZE[1] - 8.0, "middle", self.x_title));
        for (line, color) in panel.lines.iter().zip(COLORS) {
            let points: Vec<String> = line
                .iter()
                .enumerate()
                .map(|(step, &v)| format!("{:.1},{:.1}", x_of(step), y_of(v)))
                .collect();
            writeln!(
                svg,
                "<polyline points=\"{}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"1.6\"/>",
                points.join(" ")
            )
            .unwrap();
            for (step, &value) in line.iter().enumerate() {
                writeln!(
                    svg,
                    "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"2.2\" fill=\"{color}\"/>",
                    x_of(step),
                    y_of(value)
                )
                .unwrap();
            }
        }
        svg
    }

    fn legend(&self) -> String {
        let mut svg = String::new();
        for (n, (name, color)) in self.names.iter().zip(COLORS).enumerate() {
            let y = MARGINS[1] + 22.0 * n as f64;
            writeln!(svg, "<path d=\"M{0} {y}h26\" stroke=\"{color}\" stroke-width=\"2.4\"/>", MARGINS[0])
                .unwrap();
            svg.push_str(&text(MARGINS[0] + 34.0, y + 4.0, "start", name));
        }
        svg
    }
}

fn at_place(place: usize, svg: &str) -> String {
    let [x, y] = [SIZE[0] * (place % COLUMNS) as f64, SIZE[1] * (place / COLUMNS) as f64];
    format!("<g transform=\"translate({x} {y})\">\n{svg}</g>\n")
}

fn text(x: f64, y: f64, anchor: &str, text: &str) -> String {
    format!("<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{text}</text>\n")
}

/// The distance between ticks from 0 on, 1, 2 or 5 times a power of ten, and how many there are up to `most`:
/// at most 5.
fn ticks_to(most: f64) -> (f64, u32) {
    let power = 10f64.powf((most.max(1e-9) / 5.0).log10().floor());
    let tick = [1.0, 2.0, 5.0, 10.0].map(|n| n * power).into_iter().find(|tick| most / tick <= 5.0);
    let tick = tick.unwrap_or(10.0 * power);
    (tick, ((most / tick).ceil() as u32).max(1))
}

fn number(value: f64, tick: f64) -> String {
    let digits = (-tick.log10().floor()).max(0.0) as usize;
    format!("{value:.digits$}")
}
