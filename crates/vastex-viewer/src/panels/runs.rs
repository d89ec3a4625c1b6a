//! Lines of points as far as they are in view: cut at its edges in doubles, so that what is left lies where
//! it belongs however far away the ends are, and a painter gets no more than what is seen.

use egui::{Color32, Painter, Pos2, Rect, Shape, Stroke, pos2};
use glam::DVec2;

/// How far beyond the edges of the view lines are cut, in points: farther than they are wide.
const BEYOND: f32 = 8.0;
/// Points nearer to the last one than so many points of the window are left out: they are not told apart.
const LEAST_STEP: f64 = 1.0;

/// A line through places of a window, in points, of which the runs in view are kept.
pub(super) struct Runs {
    low: DVec2,
    high: DVec2,
    first: Option<DVec2>,
    last: Option<DVec2>,
    /// True if the last run reaches to the last place.
    is_at_last: bool,
    runs: Vec<Vec<Pos2>>,
    /// How many points the runs may have yet.
    room: usize,
}

impl Runs {
    /// Of a line that has no place yet, in a part of the window. What is in view beyond `most` points is left
    /// out.
    pub(super) fn new(view: Rect, most: usize) -> Runs {
        let view = view.expand(BEYOND);
        let place = |point: Pos2| DVec2::new(point.x.into(), point.y.into());
        let (low, high) = (place(view.min), place(view.max));
        Runs { low, high, first: None, last: None, is_at_last: false, runs: Vec::new(), room: most }
    }

    /// Goes on to a place along a segment of which nothing is in view.
    pub(super) fn skip_to(&mut self, place: DVec2) {
        self.first = self.first.or(Some(place));
        (self.last, self.is_at_last) = (Some(place), false);
    }

    /// Goes on to a place.
    pub(super) fn line_to(&mut self, place: DVec2) {
        match self.last {
            Some(last) if last.distance_squared(place) < LEAST_STEP * LEAST_STEP => {}
            Some(last) => self.segment(last, place),
            None => self.skip_to(place),
        }
    }

    /// Goes back to the first place.
    pub(super) fn close(&mut self) {
        let (Some(first), Some(last)) = (self.first, self.last) else { return };
        if first == last {
            return;
        }
        self.segment(last, first);
        // A corner at the first place is one, too, where the line was cut elsewhere.
        let begins = self.runs.first().is_some_and(|run| run[0] == point(first));
        if self.is_at_last && begins && self.runs.len() > 1 {
            let begin = self.runs.swap_remove(0);
            if let Some(end) = self.runs.first_mut() {
                end.extend(&begin[1..]);
            }
        }
    }

    fn segment(&mut self, from: DVec2, to: DVec2) {
        let goes_on = std::mem::take(&mut self.is_at_last);
        self.last = Some(to);
        let Some([start, end]) = self.within(from, to).filter(|_| self.room > 0) else { return };
        self.room = self.room.saturating_sub(if goes_on { 1 } else { 2 });
        match self.runs.last_mut().filter(|_| goes_on) {
            Some(run) => run.push(point(end)),
            None => self.runs.push(vec![point(start), point(end)]),
        }
        self.is_at_last = end == to;
    }

    /// The part of a segment that is in view, as Liang and Barsky cut it; `None` if none is, or where a place
    /// is no number.
    fn within(&self, from: DVec2, to: DVec2) -> Option<[DVec2; 2]> {
        let step = to - from;
        let (mut enters, mut leaves) = (0.0f64, 1.0f64);
        for axis in 0..2 {
            for (step, room) in
                [(-step[axis], from[axis] - self.low[axis]), (step[axis], self.high[axis] - from[axis])]
            {
                if step < 0.0 {
                    enters = enters.max(room / step);
                } else if step > 0.0 {
                    leaves = leaves.min(room / step);
                } else if room.is_nan() || room < 0.0 {
                    return None;
                }
            }
        }
        if enters > leaves || !step.is_finite() {
            return None;
        }
        let at = |share: f64| (from + share * step).clamp(self.low, self.high);
        let start = if enters > 0.0 { at(enters) } else { from };
        let end = if leaves < 1.0 { at(leaves) } else { to };
        Some([start, end])
    }

    /// How many points the runs may have yet.
    pub(super) fn room(&self) -> usize {
        self.room
    }

    /// Paints what is in view, in a colour on a darker rim.
    pub(super) fn paint(self, painter: &Painter, rim: Color32, color: Color32) {
        for (width, color) in [(4.0, rim), (2.0, color)] {
            for run in &self.runs {
                let stroke = Stroke::new(width, color);
                let is_ring = run.len() > 3 && run.first() == run.last();
                painter.add(match is_ring {
                    true => Shape::closed_line(run[1..].to_vec(), stroke),
                    false => Shape::line(run.clone(), stroke),
                });
            }
        }
    }
}

/// A place in view, as painters have it.
pub(super) fn point(place: DVec2) -> Pos2 {
    pos2(place.x as f32, place.y as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The runs of a line in a view from -8 to 108 and -8 to 58.
    fn runs(places: &[[f64; 2]], is_closed: bool) -> Vec<Vec<[f32; 2]>> {
        let mut runs = Runs::new(Rect::from_min_max(pos2(0.0, 0.0), pos2(100.0, 50.0)), 1 << 20);
        places.iter().for_each(|place| runs.line_to(DVec2::from(*place)));
        if is_closed {
            runs.close();
        }
        runs.runs.iter().map(|run| run.iter().map(|point| [point.x, point.y]).collect()).collect()
    }

    #[test]
    fn what_is_left_of_a_line_lies_where_it_lay() {
        assert_eq!(runs(&[[10.0, 10.0], [20.0, 30.0]], false), [[[10.0, 10.0], [20.0, 30.0]]]);
        // Its ends are as far as numbers go, and its middle is in view.
        let far = 1e15;
        let [start, end] =
            runs(&[[50.0 - far, 25.0 - 0.1 * far], [50.0 + far, 25.0 + 0.1 * far]], false)[0][..]
        else {
            panic!("it has two ends")
        };
        assert!(
            (start[0], end[0]) == (-8.0, 108.0) && (end[1] - start[1] - 11.6).abs() < 0.5,
            "{start:?} {end:?}"
        );
        // It leaves the view, and comes again.
        let bent = [[10.0, 10.0], [300.0, 10.0], [300.0, 20.0], [10.0, 20.0]];
        assert_eq!(runs(&bent, false), [[[10.0, 10.0], [108.0, 10.0]], [[108.0, 20.0], [10.0, 20.0]]]);
        for beside in
            [[[-20.0, 0.0], [20.0, -60.0]], [[500.0, 1.0], [400.0, 40.0]], [[f64::NAN, 0.0], [1.0, 9.0]]]
        {
            assert!(runs(&beside, false).is_empty(), "{beside:?}");
        }
    }

    #[test]
    fn a_ring_is_closed_where_all_of_it_is_in_view_and_its_first_corner_stays_one() {
        let ring = runs(&[[10.0, 10.0], [20.0, 10.0], [20.0, 30.0]], true);
        assert_eq!(ring, [[[10.0, 10.0], [20.0, 10.0], [20.0, 30.0], [10.0, 10.0]]]);
        let cut = runs(&[[10.0, 10.0], [300.0, 10.0], [300.0, 20.0], [10.0, 20.0]], true);
        assert_eq!(cut, [[[108.0, 20.0], [10.0, 20.0], [10.0, 10.0], [108.0, 10.0]]]);
    }

    #[test]
    fn places_that_are_not_told_apart_are_one() {
        let many: Vec<[f64; 2]> = (0..10_000).map(|n| [f64::from(n) * 1e-3, 5.0]).collect();
        assert_eq!(runs(&many, false)[0].len(), 10);
    }
}
