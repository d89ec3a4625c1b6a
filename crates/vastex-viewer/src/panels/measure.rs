//! Lengths and areas in an image, along a line of points that a person sets.

use egui::{Align2, Color32, FontId, Painter, Pos2, Rect, Vec2};
use glam::DVec2;

use super::ImageView;
use super::lengths::{TexelSize, plane_area};
use super::runs::{Runs, point};

/// What was measured is in this colour, on a dark rim.
const COLOR: Color32 = Color32::from_rgb(255, 210, 60);
const POINT: f32 = 3.0;

/// A line of points in an image, and what it measures. The points are places of level 0 in texels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Measure {
    points: Vec<DVec2>,
    is_closed: bool,
}

/// How long a line is, and what it surrounds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// In texels, or in metres or another unit where a texel's size is known; of degrees on a globe in
    /// metres.
    pub length: f64,
    /// In the same squared; `None` if the line is open.
    pub area: Option<f64>,
}

impl Measure {
    /// Sets the next point. After a closed line another one begins.
    pub fn add(&mut self, texel: DVec2) {
        if std::mem::take(&mut self.is_closed) {
            self.points.clear();
        }
        self.points.push(texel);
    }

    /// Closes the line, from its last point to its first, if it has at least three points.
    pub fn close(&mut self) {
        self.is_closed = self.points.len() > 2;
    }

    /// Opens a closed line again, or takes its last point away. Returns true if there was any.
    pub fn undo(&mut self) -> bool {
        std::mem::take(&mut self.is_closed) || self.points.pop().is_some()
    }

    /// What the line measures; `None` for fewer than two points. Where a closed line crosses itself, parts
    /// gone round the other way are subtracted.
    pub fn measured(&self, texel_size: Option<&TexelSize>) -> Option<Measured> {
        let (first, last) = (self.points.first()?, self.points.last()?);
        if self.points.len() < 2 {
            return None;
        }
        let length = |from: DVec2, to: DVec2| match texel_size {
            Some(size) => size.between(from, to),
            None => from.distance(to),
        };
        let open: f64 = self.points.windows(2).map(|ends| length(ends[0], ends[1])).sum();
        if !self.is_closed {
            return Some(Measured { length: open, area: None });
        }
        let area = texel_size.map_or_else(|| plane_area(&self.points), |size| size.within(&self.points));
        Some(Measured { length: open + length(*last, *first), area: Some(area) })
    }

    /// What the line measures, in words.
    pub fn text(&self, texel_size: Option<&TexelSize>) -> Option<String> {
        let Measured { length, area } = self.measured(texel_size)?;
        let told = match texel_size {
            Some(size) => (size.told(length), area.and_then(|area| size.told_area(area))),
            None => (format!("{length:.1} texels"), area.map(|area| format!("{area:.1} texels²"))),
        };
        Some(match told {
            (length, Some(area)) => format!("{length} around {area}"),
            (length, None) => length,
        })
    }

    /// The lines along which is measured, each through places of level 0 of an image of so many columns: on a
    /// globe the edges are great circles, and may leave the image at one side and come back at the other.
    fn lines(&self, texel_size: Option<&TexelSize>, columns: f64) -> Vec<Vec<DVec2>> {
        let Some(size) = texel_size.filter(|size| size.is_on_globe()) else {
            return vec![self.points.clone()];
        };
        let back = self.points.first().filter(|_| self.is_closed);
        let ends: Vec<DVec2> = self.points.iter().chain(back).copied().collect();
        let mut lines: Vec<Vec<DVec2>> = Vec::new();
        let ways = ends.windows(2).flat_map(|ends| size.way(ends[0], ends[1], columns));
        // Of a way beside the image nothing is left.
        for way in ways.filter(|way| !way.is_empty()) {
            match lines.last_mut().filter(|line| line.last() == way.first()) {
                Some(line) => line.extend(&way[1..]),
                None => lines.push(way),
            }
        }
        lines
    }

    /// Paints the line over the picture of its image as it is measured, within `free`, the part of it that no
    /// panel covers.
    pub fn paint(&self, painter: &Painter, free: Rect, view: &ImageView, texel_size: Option<&TexelSize>) {
        let Some(placed) = view.placement() else { return };
        let painter = painter.with_clip_rect(free);
        let pixels_per_point = f64::from(painter.pixels_per_point());
        let place = |texel: &DVec2| placed.pixel(*texel) / pixels_per_point;
        let is_ring = self.is_closed && texel_size.is_none_or(|size| !size.is_on_globe());
        for places in self.lines(texel_size, view.image[0].into()) {
            let mut line = Runs::new(free, usize::MAX);
            places.iter().for_each(|texel| line.line_to(place(texel)));
            if is_ring {
                line.close();
            }
            line.paint(&painter, Color32::from_black_alpha(160), COLOR);
        }
        // Of points far beside the view nothing is seen, and numbers of the painter do not reach there.
        let points: Vec<Pos2> = self
            .points
            .iter()
            .map(|texel| point(place(texel).clamp(DVec2::splat(-1e6), DVec2::splat(1e6))))
            .collect();
        let seen = free.expand(2.0 * POINT);
        for (width, color) in [(4.0, Color32::from_black_alpha(160)), (2.0, COLOR)] {
            for point in points.iter().filter(|point| seen.contains(**point)) {
                painter.circle_filled(*point, POINT + width / 2.0 - 1.0, color);
            }
        }
        if let Some((place, text)) = points.last().copied().zip(self.text(texel_size)) {
            // Read on whatever the image shows there.
            let galley = painter.layout_no_wrap(text, FontId::proportional(14.0), COLOR);
            let place = Align2::LEFT_BOTTOM.anchor_size(place + Vec2::new(8.0, -8.0), galley.size());
            painter.rect_filled(place.expand(3.0), 3.0, Color32::from_black_alpha(170));
            painter.galley(place.min, galley, COLOR);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::MapPlace;
    use super::*;

    fn line(points: &[[f64; 2]]) -> Measure {
        let mut measure = Measure::default();
        points.iter().for_each(|point| measure.add(DVec2::from(*point)));
        measure
    }

    #[test]
    fn lengths_and_areas_are_those_of_the_points() {
        let mut measure = line(&[[1e9, 1e9]]);
        assert_eq!(measure.text(None), None);
        measure.add(DVec2::new(1e9 + 3.0, 1e9));
        measure.add(DVec2::new(1e9 + 3.0, 1e9 + 4.0));
        assert_eq!(measure.text(None).unwrap(), "7.0 texels");
        measure.close();
        assert_eq!(measure.measured(None), Some(Measured { length: 12.0, area: Some(6.0) }));
        assert_eq!(measure.text(None).unwrap(), "12.0 texels around 6.0 texels²");
        // Texels of half a micrometre by a whole one.
        let size = TexelSize::new([0.5, 1.0], "µm").unwrap();
        let mut measure = line(&[[0.0, 0.0], [300.0, 0.0], [300.0, 200.0], [0.0, 200.0]]);
        assert_eq!(measure.text(Some(&size)).unwrap(), "500 µm");
        measure.close();
        assert_eq!(measure.text(Some(&size)).unwrap(), "700 µm around 0.03 mm²");
        // A surface of degrees that lie nowhere has no size.
        let degrees = TexelSize::new([0.1, 0.1], "degree").unwrap();
        assert_eq!(measure.text(Some(&degrees)).unwrap(), "100°");
    }

    /// A square of degrees, from the equator to 10 degrees of latitude.
    #[test]
    fn degrees_on_a_globe_are_measured_in_metres() {
        let place = MapPlace::new([0.1, 0.0, 0.0, 0.0, -0.1, 10.0], "EPSG:4326", true).unwrap();
        let size = TexelSize::new([0.1; 2], "degree").unwrap().on_globe(&place);
        let mut measure = line(&[[0.0, 0.0], [100.0, 0.0], [100.0, 100.0], [0.0, 100.0]]);
        // Along great circles 10 degrees are 1095 km at 10 degrees of latitude, 1112 km on the equator.
        assert_eq!(measure.text(Some(&size)).unwrap(), "3319 km");
        measure.close();
        let Measured { length, area } = measure.measured(Some(&size)).unwrap();
        assert!((length / 4.431e6 - 1.0).abs() < 1e-3, "{length}");
        // R^2 x 10 degrees x sin(10 degrees), and what the great circle bulges over the parallel.
        assert!((area.unwrap() / 1.2310e12 - 1.0).abs() < 4e-3, "{area:?}");
    }

    /// What is painted is what is measured: great circles, which leave a map at one side and come back at the
    /// other.
    #[test]
    fn lines_on_a_globe_are_painted_as_they_are_measured() {
        let place = MapPlace::new([0.5, 0.0, -180.0, 0.0, -0.5, 90.0], "EPSG:4326", true).unwrap();
        let size = TexelSize::new([0.5; 2], "degree").unwrap().on_globe(&place);
        let texel = |north: f64, east: f64| [2.0 * (east + 180.0), 2.0 * (90.0 - north)];
        // Within the map one line through all points, bent towards the pole.
        let mut measure = line(&[texel(50.0, 0.0), texel(50.0, 90.0), texel(0.0, 90.0)]);
        measure.close();
        let lines = measure.lines(Some(&size), 720.0);
        let [ring] = &lines[..] else { panic!("{} lines", lines.len()) };
        assert!(ring[0].distance(ring[ring.len() - 1]) < 1e-9);
        let highest = ring.iter().map(|texel| texel.y).fold(f64::MAX, f64::min);
        // 59.32 degrees north.
        assert!((highest - 2.0 * (90.0 - 59.32)).abs() < 0.1, "{highest}");
        // From 150 degrees east to 150 west over the date line, which is at both sides of the map.
        let measure = line(&[texel(10.0, 150.0), texel(10.0, -150.0)]);
        let lines = measure.lines(Some(&size), 720.0);
        let [there, here] = &lines[..] else { panic!("{} lines", lines.len()) };
        let ends = [there[0].x, there[there.len() - 1].x, here[0].x, here[here.len() - 1].x];
        for (found, expected) in ends.into_iter().zip([660.0, 720.0, 0.0, 60.0]) {
            assert!((found - expected).abs() < 1e-6, "{ends:?}");
        }
        assert!((there[there.len() - 1].y - here[0].y).abs() < 1e-6);
        // Elsewhere lines are straight.
        assert_eq!(measure.lines(None, 720.0), std::slice::from_ref(&measure.points));
    }

    #[test]
    fn points_are_taken_back_and_another_line_begins_after_a_closed_one() {
        let mut measure = line(&[[0.0, 0.0], [1.0, 0.0]]);
        measure.close();
        assert_eq!(measure.measured(None).unwrap().area, None, "two points surround nothing");
        measure.add(DVec2::ONE);
        measure.close();
        assert!(measure.undo() && measure.measured(None).unwrap().area.is_none(), "it is open again");
        assert!(measure.undo() && measure.undo() && measure.undo() && !measure.undo());
        let mut measure = line(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]);
        measure.close();
        measure.add(DVec2::ZERO);
        assert_eq!(measure, line(&[[0.0, 0.0]]));
    }
}
