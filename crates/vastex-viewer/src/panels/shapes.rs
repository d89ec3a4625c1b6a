//! Shapes over the picture of an image: points, lines and polygons, with names and colours, as GeoJSON has
//! them (see `geojson`).

mod geojson;

use std::ops::Range;

use egui::{Align2, Color32, FontId, Painter, Pos2, Rect, Vec2};
use glam::DVec2;

use super::guides::ImageView;
use super::runs::{Runs, point};
use crate::camera::ImagePlacement;

pub use geojson::{GeoJson, ShapesError};

/// Radius of a point, and the width that a shape has at least to be painted as more than a dot; in points.
const DOT: f32 = 3.5;
/// The width in points below which one shape is painted for all whose middles lie in the same cell of [`DOT`]
/// points: of a million cells of a tissue, seen from afar, a few are told apart.
const LEAST_OF_ALL: f64 = 12.0;
/// The width in points from which on a shape's name is beside it, and how long names are at most, about.
const LEAST_OF_NAME: f64 = 48.0;
const LONGEST_NAME: f32 = 700.0;
/// Points of outlines that are looked at together, by the box around them.
const TOGETHER: usize = 256;
/// Points of outlines that are painted at once, at most: what is painted has to fit into a buffer of a
/// device.
const MOST_PAINTED: usize = 1 << 18;

/// Shapes over an image, in texels of level 0.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Shapes {
    outlines: Vec<Outline>,
    /// The points of all outlines, one after another; their names; and boxes around each [`TOGETHER`] points
    /// of one. So many shapes are gone as fast as few are.
    points: Vec<DVec2>,
    names: String,
    boxes: Vec<Bounds>,
}

/// A line, a ring or a point of a shape.
#[derive(Clone, Debug, PartialEq)]
struct Outline {
    /// Where its points begin, and how many there are.
    first: u32,
    count: u32,
    /// Where its boxes begin.
    first_box: u32,
    is_closed: bool,
    color: Color32,
    /// That of its shape, at the first outline of it; empty for none.
    name: Range<u32>,
    bounds: Bounds,
}

/// The least and the largest column and row of some places, in texels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Bounds {
    low: DVec2,
    high: DVec2,
}

impl Bounds {
    fn around(places: impl IntoIterator<Item = DVec2>) -> Bounds {
        let mut places = places.into_iter();
        let first = places.next().unwrap_or_default();
        places.fold(Bounds { low: first, high: first }, |Bounds { low, high }, place| Bounds {
            low: low.min(place),
            high: high.max(place),
        })
    }

    fn meets(&self, low: DVec2, high: DVec2) -> bool {
        self.low.cmple(high).all() && self.high.cmpge(low).all()
    }

    fn middle(&self) -> DVec2 {
        (self.low + self.high) / 2.0
    }

    /// The longer side.
    fn side(&self) -> f64 {
        (self.high - self.low).max_element()
    }
}

impl Shapes {
    /// Reads GeoJSON. `texel_of` tells the place in the image, in texels from its top left corner, of a
    /// position in the text.
    ///
    /// Fails as [`GeoJson::read`] and [`GeoJson::shapes`] do.
    pub fn from_geojson(text: &str, texel_of: impl Fn(DVec2) -> DVec2) -> Result<Shapes, ShapesError> {
        GeoJson::read(text, || true)?.shapes(texel_of)
    }

    /// How many points, lines and rings there are.
    pub fn count(&self) -> usize {
        self.outlines.len()
    }

    fn points_of(&self, outline: &Outline) -> &[DVec2] {
        &self.points[outline.first as usize..][..outline.count as usize]
    }

    /// Works out the boxes around outlines, whose points are where they will stay.
    fn set_bounds(&mut self) {
        for outline in &mut self.outlines {
            let points = &self.points[outline.first as usize..][..outline.count as usize];
            outline.first_box = self.boxes.len() as u32;
            if points.len() <= TOGETHER {
                outline.bounds = Bounds::around(points.iter().copied());
                continue;
            }
            // Each with the point at which the next one begins: with all of its segments.
            let boxes = (0..points.len())
                .step_by(TOGETHER)
                .map(|first| Bounds::around(points[first..].iter().take(TOGETHER + 1).copied()));
            self.boxes.extend(boxes);
            let boxes = &self.boxes[outline.first_box as usize..];
            outline.bounds = Bounds::around(boxes.iter().flat_map(|of| [of.low, of.high]));
        }
    }

    /// Paints what is in view over the picture of its image, within `free`, the part of it that no panel
    /// covers. What is narrower than a few points is a dot, where there is none yet, and of lines as many
    /// points are painted as are in view and told apart, and of all about a quarter of a million at most.
    /// Costs some nanoseconds for each shape, and each 256 points of one, that is not in view.
    pub fn paint(&self, painter: &Painter, free: Rect, view: &ImageView) {
        let Some(placed) = view.placement() else { return };
        let sight = Sight::new(painter, free, &placed);
        let mut crowd = Crowd::new(free);
        let mut room = MOST_PAINTED;
        for outline in self.outlines.iter().filter(|outline| sight.sees(&outline.bounds)) {
            let width = outline.bounds.side() * sight.scale;
            if width < LEAST_OF_ALL && !crowd.has_room(sight.place(outline.bounds.middle())) {
                continue;
            }
            if width < f64::from(DOT) {
                outline.paint_dot(&sight);
            } else if room > 0 {
                room = self.paint_line(outline, &sight, room);
                self.paint_name(outline, &sight, width);
            }
        }
    }

    /// Paints the line through the points of an outline, `room` of them at most, and says how many more there
    /// may be.
    fn paint_line(&self, outline: &Outline, sight: &Sight<'_>, room: usize) -> usize {
        let mut runs = Runs::new(sight.free, room);
        let points = self.points_of(outline);
        if points.len() <= TOGETHER {
            points.iter().for_each(|texel| runs.line_to(sight.place(*texel)));
        } else {
            let boxes = &self.boxes[outline.first_box as usize..];
            runs.line_to(sight.place(points[0]));
            for (some, bounds) in points[1..].chunks(TOGETHER).zip(boxes) {
                let last = some[some.len() - 1];
                if !sight.sees(bounds) {
                    runs.skip_to(sight.place(last));
                } else if bounds.side() * sight.scale < 1.0 {
                    runs.line_to(sight.place(last));
                } else {
                    some.iter().for_each(|texel| runs.line_to(sight.place(*texel)));
                }
            }
        }
        if outline.is_closed {
            runs.close();
        }
        let room = runs.room();
        runs.paint(&sight.painter, Color32::from_black_alpha(110), outline.color);
        room
    }

    /// Paints the name of a shape beside its first point, where it is wide enough and the name in view.
    fn paint_name(&self, outline: &Outline, sight: &Sight<'_>, width: f64) {
        let name = &self.names[outline.name.start as usize..outline.name.end as usize];
        let first = sight.place(self.points[outline.first as usize]);
        let room = sight.free.expand2(Vec2::new(LONGEST_NAME, 3.0 * DOT + 20.0));
        if name.is_empty() || width < LEAST_OF_NAME || !is_within(room, first) {
            return;
        }
        let galley =
            sight.painter.layout_no_wrap(name.to_owned(), FontId::proportional(13.0), Color32::WHITE);
        let place = Align2::LEFT_BOTTOM.anchor_size(point(first) + Vec2::new(4.0, -4.0), galley.size());
        sight.painter.rect_filled(place.expand(2.0), 2.0, Color32::from_black_alpha(170));
        sight.painter.galley(place.min, galley, Color32::WHITE);
    }
}

/// What is seen of an image, and where.
struct Sight<'a> {
    painter: Painter,
    free: Rect,
    placed: &'a ImagePlacement,
    pixels_per_point: f64,
    /// Points along a texel.
    scale: f64,
    /// The part of the image that is in view with some room around it, in texels; of one that is turned, the
    /// part around that.
    seen: Bounds,
}

impl<'a> Sight<'a> {
    fn new(painter: &Painter, free: Rect, placed: &'a ImagePlacement) -> Sight<'a> {
        let painter = painter.with_clip_rect(free);
        let pixels_per_point = f64::from(painter.pixels_per_point());
        let corner = |point: Pos2| DVec2::new(point.x.into(), point.y.into()) * pixels_per_point;
        let [low, high] = placed.bounds(corner(free.min), corner(free.max));
        let scale = placed.scale / pixels_per_point;
        let room = 2.0 * f64::from(DOT) / scale;
        let seen = Bounds { low: low - room, high: high + room };
        Sight { painter, free, placed, pixels_per_point, scale, seen }
    }

    fn sees(&self, bounds: &Bounds) -> bool {
        bounds.meets(self.seen.low, self.seen.high)
    }

    /// The place of the window at which a place of the image is seen, in points.
    fn place(&self, texel: DVec2) -> DVec2 {
        self.placed.pixel(texel) / self.pixels_per_point
    }
}

fn is_within(rect: Rect, place: DVec2) -> bool {
    let (low, high) = (rect.min, rect.max);
    place.x >= low.x.into() && place.y >= low.y.into() && place.x <= high.x.into() && place.y <= high.y.into()
}

/// Which cells of a part of the window, and of as much around it as a narrow shape reaches into it, have a
/// shape already.
struct Crowd {
    corner: DVec2,
    columns: usize,
    rows: usize,
    is_taken: Vec<bool>,
}

impl Crowd {
    fn new(free: Rect) -> Crowd {
        let free = free.expand(LEAST_OF_ALL as f32);
        let cells = |length: f32| (length / DOT).clamp(0.0, 4096.0) as usize + 1;
        let (columns, rows) = (cells(free.width()), cells(free.height()));
        let corner = DVec2::new(free.min.x.into(), free.min.y.into());
        Crowd { corner, columns, rows, is_taken: vec![false; columns * rows] }
    }

    /// Returns true if the cell of a place has no shape yet, which it then has. Nothing is seen of what lies
    /// beside all cells.
    fn has_room(&mut self, place: DVec2) -> bool {
        let cell = ((place - self.corner) / f64::from(DOT)).floor();
        if !(0.0..self.columns as f64).contains(&cell.x) || !(0.0..self.rows as f64).contains(&cell.y) {
            return false;
        }
        !std::mem::replace(&mut self.is_taken[cell.y as usize * self.columns + cell.x as usize], true)
    }
}

impl Outline {
    fn paint_dot(&self, sight: &Sight<'_>) {
        let middle = point(sight.place(self.bounds.middle()));
        if self.count > 1 {
            // About as much as there is of it, and the cheapest that there is to paint.
            sight.painter.rect_filled(Rect::from_center_size(middle, Vec2::splat(2.0)), 0.0, self.color);
            return;
        }
        sight.painter.circle_filled(middle, DOT + 1.0, Color32::from_black_alpha(140));
        sight.painter.circle_filled(middle, DOT, self.color);
    }
}

#[cfg(test)]
mod tests;
