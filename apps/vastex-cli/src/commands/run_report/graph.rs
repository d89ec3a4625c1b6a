//! Graphs of figures by frame, as SVG that stands in a page: lines over a grid, a scale with round numbers,
//! and a legend.

use vastex_viewer::figures::{bytes, round_up};

use super::page::escaped;

/// Width and height of a graph in its own units, and the room that scales take.
const SIZE: [f64; 2] = [560.0, 200.0];
const LEFT: f64 = 58.0;
const RIGHT: f64 = 12.0;
const TOP: f64 = 10.0;
const BOTTOM: f64 = 26.0;
/// Places along a graph that are told apart; of more frames than that some share one.
const PLACES: usize = 480;
/// Lines across a graph at least.
const STEPS: f64 = 4.0;

/// What the numbers of a graph count.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Unit {
    Count,
    Bytes,
    Levels,
    /// Of 1.
    Share,
}

/// A line of a graph: a number for each frame, where there is one.
#[derive(Clone, Debug)]
pub(super) struct Line {
    pub(super) name: String,
    pub(super) values: Vec<Option<f64>>,
}

/// A graph, with what it tells.
#[derive(Clone, Debug)]
pub(super) struct Graph {
    pub(super) title: String,
    pub(super) about: &'static str,
    pub(super) unit: Unit,
    pub(super) lines: Vec<Line>,
}

impl Graph {
    /// The graph as a figure of a page.
    pub(super) fn html(&self) -> String {
        let frames = self.lines.iter().map(|line| line.values.len()).max().unwrap_or(0);
        let most = self.lines.iter().flat_map(|line| &line.values).flatten().fold(0.0, |a: f64, b| a.max(*b));
        let step = step(self.unit, most);
        let top = match self.unit {
            Unit::Share => 1.0,
            _ => (most / step).ceil().max(1.0) * step,
        };
        let [width, height] = SIZE;
        let x = |place: f64| LEFT + (width - LEFT - RIGHT) * place;
        let y = |value: f64| TOP + (height - TOP - BOTTOM) * (1.0 - value / top);
        let mut svg = format!(
            "<svg viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"{}\">",
            escaped(&self.title)
        );
        for n in 0..=(top / step).round() as usize {
            let value = n as f64 * step;
            let at = y(value);
            svg += &format!(
                "<line class=\"grid\" x1=\"{LEFT}\" x2=\"{:.1}\" y1=\"{at:.1}\" y2=\"{at:.1}\"/><text class=\"scale\" x=\"{:.1}\" y=\"{:.1}\">{}</text>",
                width - RIGHT,
                LEFT - 6.0,
                at + 3.5,
                number(self.unit, value)
            );
        }
        let last = frames.max(1);
        for (place, frame, anchor) in
            [(0.0, 1, "start"), (0.5, last.div_ceil(2), "middle"), (1.0, last, "end")]
        {
            if place == 0.0 || last > 2 || place == 1.0 && last > 1 {
                let (at, below) = (x(place), height - 8.0);
                svg += &format!(
                    "<text class=\"frames\" text-anchor=\"{anchor}\" x=\"{at:.1}\" y=\"{below}\">frame {frame}</text>"
                );
            }
        }
        for (n, line) in self.lines.iter().enumerate() {
            let mut path = String::new();
            let mut is_down = false;
            for (place, value) in places(&line.values) {
                match value {
                    Some(value) => {
                        let letter = if is_down { 'L' } else { 'M' };
                        path += &format!("{letter}{:.1} {:.1}", x(place), y(value));
                        is_down = true;
                    }
                    None => is_down = false,
                }
            }
            svg += &format!(
                "<path class=\"line c{}\" d=\"{path}\"><title>{}</title></path>",
                n % 6,
                escaped(&line.name)
            );
        }
        svg += "</svg>";
        let legend: String = self
            .lines
            .iter()
            .enumerate()
            .map(|(n, line)| {
                let known = line.values.iter().flatten();
                let most = known.clone().fold(0.0, |a: f64, b| a.max(*b));
                let end = known.last().map_or_else(|| "none".to_owned(), |value| number(self.unit, *value));
                format!(
                    "<span class=\"c{}\"><i></i>{}<small> most {}, at the end {end}</small></span>",
                    n % 6,
                    escaped(&line.name),
                    number(self.unit, most)
                )
            })
            .collect();
        format!(
            "<figure class=\"graph\"><figcaption><b>{}</b> {}</figcaption>{svg}<div class=\"legend\">{legend}</div></figure>\n",
            escaped(&self.title),
            escaped(self.about)
        )
    }
}

/// The values of a line at its places, 0 to 1 from the left: of frames that share one the largest.
fn places(values: &[Option<f64>]) -> Vec<(f64, Option<f64>)> {
    let (count, last) = (values.len(), values.len().saturating_sub(1).max(1));
    let places = count.min(PLACES);
    (0..places)
        .map(|n| {
            let (begin, end) = (n * count / places, (n + 1) * count / places);
            let largest = values[begin..end].iter().flatten().copied().reduce(f64::max);
            let at =
                if count <= PLACES { begin as f64 / last as f64 } else { n as f64 / (places - 1) as f64 };
            (at, largest)
        })
        .collect()
}

/// A round number that fits a few times into the largest.
fn step(unit: Unit, most: f64) -> f64 {
    if unit == Unit::Share {
        return 0.25;
    }
    let least = match unit {
        Unit::Levels => 0.25,
        _ => 1.0,
    };
    let wanted = (most / STEPS).max(least);
    match unit {
        Unit::Bytes => (wanted * 0.999).log2().ceil().exp2(),
        Unit::Levels if wanted <= 0.5 => (wanted / 0.25).ceil() * 0.25,
        _ => round_up(wanted),
    }
}

/// A number for people.
pub(super) fn number(unit: Unit, value: f64) -> String {
    match unit {
        Unit::Bytes => bytes(value),
        Unit::Share => format!("{} %", trimmed(100.0 * value)),
        // Eighths.
        Unit::Levels => with_digits(value, 3),
        Unit::Count => match value {
            value if value >= 1e6 => format!("{}M", trimmed(value / 1e6)),
            value if value >= 1e4 => format!("{}k", trimmed(value / 1e3)),
            value => trimmed(value),
        },
    }
}

fn trimmed(value: f64) -> String {
    with_digits(value, if value >= 100.0 { 0 } else { 2 })
}

fn with_digits(value: f64, digits: usize) -> String {
    let text = format!("{value:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_have_round_numbers_and_hold_every_value() {
        for (unit, most, expected) in [
            (Unit::Count, 0.0, 1.0),
            (Unit::Count, 7.0, 2.0),
            (Unit::Count, 1234.0, 500.0),
            (Unit::Bytes, 9_000_000.0, 4.0 * 1048576.0),
            (Unit::Levels, 0.4, 0.25),
            (Unit::Levels, 3.0, 1.0),
            (Unit::Share, 0.3, 0.25),
        ] {
            assert_eq!(step(unit, most), expected, "{unit:?} {most}");
        }
        let numbers =
            [(Unit::Bytes, 1536.0), (Unit::Share, 0.875), (Unit::Count, 12_500.0), (Unit::Levels, 1.125)];
        let said = numbers.map(|(unit, value)| number(unit, value));
        assert_eq!(said, ["1.5 KiB", "87.5 %", "12.5k", "1.125"]);
    }

    #[test]
    fn of_many_frames_no_peak_is_lost() {
        let mut values = vec![Some(1.0); 10_000];
        values[7777] = Some(50.0);
        values[0] = None;
        let drawn = places(&values);
        assert_eq!(drawn.len(), PLACES);
        assert_eq!((drawn[0].0, drawn[PLACES - 1].0), (0.0, 1.0));
        assert!(drawn.iter().any(|(_, value)| *value == Some(50.0)));
        assert_eq!(places(&[Some(3.0)]), [(0.0, Some(3.0))]);
        assert!(places(&[]).is_empty());
    }

    #[test]
    fn a_graph_breaks_where_nothing_is_known_and_says_its_names_as_they_are() {
        let line = Line { name: "a<b>".into(), values: vec![Some(1.0), None, Some(2.0), Some(4.0)] };
        let graph = Graph { title: "x & y".into(), about: "about it", unit: Unit::Count, lines: vec![line] };
        let html = graph.html();
        assert_eq!(html.matches('M').count(), 2, "{html}");
        assert!(html.contains("a&lt;b&gt;") && html.contains("x &amp; y") && html.contains("most 4"));
    }
}
