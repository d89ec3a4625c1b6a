//! Shapes over the picture of an image, as GeoJSON (RFC 7946) has them: points, lines and polygons, with names and colours.

use egui::{Align2, Color32, FontId, Painter, Pos2, Rect, Shape, Stroke, Vec2, pos2};
use glam::DVec2;
use serde_json::Value;

use super::guides::ImageView;
use crate::camera::ImagePlacement;

/// The colour of what names none.
const COLOR: Color32 = Color32::from_rgb(255, 210, 60);
/// Radius of a point, and the width that a shape has at least to be painted as more than a dot; in points.
const DOT: f32 = 3.5;
/// The width in points below which one shape is painted for all whose middles lie in the same cell of [`DOT`] points: of a million cells of a
/// tissue, seen from afar, a few are told apart.
const LEAST_OF_ALL: f64 = 12.0;
/// The width in points from which on a shape's name is beside it.
const LEAST_OF_NAME: f64 = 48.0;
/// Collections within one another, at most.
const DEPTH: usize = 16;

/// Shapes over an image, in texels of level 0.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Shapes {
    shapes: Vec<Outline>,
}

/// A text cannot be read as shapes.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{place}: {why}")]
pub struct ShapesError {
    /// Where in the text: a line and a column, or the number of a feature, counted from 1.
    pub place: String,
    /// What is wrong there, and what to do.
    pub why: String,
}

/// A line, a ring or a point of a shape.
#[derive(Clone, Debug, PartialEq)]
struct Outline {
    points: Vec<DVec2>,
    is_closed: bool,
    color: Color32,
    /// That of its shape, at the first outline of it.
    name: Option<String>,
    low: DVec2,
    high: DVec2,
}

impl Shapes {
    /// Reads GeoJSON: a feature, a collection of them, or a geometry alone. `texel_of` tells the place in the image, in texels from its top
    /// left corner, of a position in the text.
    ///
    /// Features are named by their properties `name` or `classification.name`, and coloured by `stroke` (`#rrggbb`), `color` or
    /// `classification.color` (`[r, g, b]`), as QuPath and others write them. What has no geometry is left out, and heights are. Fails where
    /// the text is no JSON, and where a geometry is not what the standard says.
    pub fn from_geojson(text: &str, texel_of: impl Fn(DVec2) -> DVec2) -> Result<Shapes, ShapesError> {
        let value: Value = serde_json::from_str(text).map_err(|error| ShapesError {
            place: format!("line {}, column {}", error.line(), error.column()),
            why: format!("is no JSON ({error}); write the file anew"),
        })?;
        let mut shapes = Shapes::default();
        let features: Vec<&Value> = match (&value["type"], &value["features"], &value) {
            (Value::String(kind), Value::Array(features), _) if kind == "FeatureCollection" => {
                features.iter().collect()
            }
            // QuPath writes a list of features alone, too.
            (_, _, Value::Array(features)) => features.iter().collect(),
            _ => vec![&value],
        };
        for (n, feature) in (1..).zip(features) {
            let at_feature = |why: String| ShapesError { place: format!("feature {n}"), why };
            shapes.add(feature, &texel_of).map_err(at_feature)?;
        }
        Ok(shapes)
    }

    /// How many points, lines and rings there are.
    pub fn count(&self) -> usize {
        self.shapes.len()
    }

    fn add(&mut self, feature: &Value, texel_of: &impl Fn(DVec2) -> DVec2) -> Result<(), String> {
        let (geometry, properties) = match &feature["type"] {
            Value::String(kind) if kind == "Feature" => (&feature["geometry"], &feature["properties"]),
            _ => (feature, &Value::Null),
        };
        if geometry.is_null() {
            return Ok(());
        }
        let mut outlines = Vec::new();
        read(geometry, 0, &mut outlines)?;
        let class = &properties["classification"];
        let mut name = [&properties["name"], &class["name"]].into_iter().find_map(Value::as_str);
        let colors = [&properties["stroke"], &properties["color"], &class["color"]];
        let color = colors.into_iter().find_map(color).unwrap_or(COLOR);
        for (points, is_closed) in outlines {
            let points: Vec<DVec2> = points.into_iter().map(texel_of).collect();
            if !points.iter().all(|point| point.is_finite()) {
                return Err("has a position that is too far away; mend it".to_owned());
            }
            let low = points.iter().copied().reduce(DVec2::min).unwrap_or_default();
            let high = points.iter().copied().reduce(DVec2::max).unwrap_or_default();
            let name = name.take().map(str::to_owned);
            self.shapes.push(Outline { points, is_closed, color, name, low, high });
        }
        Ok(())
    }

    /// Paints what is in view over the picture of its image, within `free`, the part of it that no panel covers. What is narrower than a
    /// few points is a dot, where there is none yet, and of lines as many points are painted as are told apart. Costs some nanoseconds for
    /// each shape that is not in view or not painted.
    pub fn paint(&self, painter: &Painter, free: Rect, view: &ImageView) {
        let Some(placed) = view.pose.placement(view.picture, view.image) else { return };
        let painter = painter.with_clip_rect(free);
        let pixels_per_point = f64::from(painter.pixels_per_point());
        let scale = placed.scale / pixels_per_point;
        let corner = |point: Pos2| DVec2::new(point.x.into(), point.y.into()) * pixels_per_point;
        let [low, high] = placed.bounds(corner(free.min), corner(free.max));
        let room = f64::from(DOT) / scale;
        let is_seen =
            |outline: &&Outline| outline.low.cmple(high + room).all() && outline.high.cmpge(low - room).all();
        let mut crowd = Crowd::new(free);
        for outline in self.shapes.iter().filter(is_seen) {
            let width = (outline.high - outline.low).max_element() * scale;
            let middle = placed.pixel((outline.low + outline.high) / 2.0) / pixels_per_point;
            if width >= LEAST_OF_ALL || crowd.has_room(middle) {
                outline.paint(&painter, &placed, pixels_per_point);
            }
        }
    }
}

/// Which cells of a part of the window have a shape already.
struct Crowd {
    corner: DVec2,
    columns: usize,
    rows: usize,
    is_taken: Vec<bool>,
}

impl Crowd {
    fn new(free: Rect) -> Crowd {
        let cells = |length: f32| (length / DOT).clamp(0.0, 4096.0) as usize + 1;
        let (columns, rows) = (cells(free.width()), cells(free.height()));
        let corner = DVec2::new(free.min.x.into(), free.min.y.into());
        Crowd { corner, columns, rows, is_taken: vec![false; columns * rows] }
    }

    /// Whether the cell of a place has no shape yet, which it then has. Beside the part there is room for everything.
    fn has_room(&mut self, place: DVec2) -> bool {
        let cell = ((place - self.corner) / f64::from(DOT)).floor();
        if !(0.0..self.columns as f64).contains(&cell.x) || !(0.0..self.rows as f64).contains(&cell.y) {
            return true;
        }
        !std::mem::replace(&mut self.is_taken[cell.y as usize * self.columns + cell.x as usize], true)
    }
}

impl Outline {
    fn paint(&self, painter: &Painter, placed: &ImagePlacement, pixels_per_point: f64) {
        let point = |texel: DVec2| {
            // No farther away than numbers of the painter reach.
            let DVec2 { x, y } =
                (placed.pixel(texel) / pixels_per_point).clamp(DVec2::splat(-1e6), DVec2::splat(1e6));
            pos2(x as f32, y as f32)
        };
        let width = (self.high - self.low).max_element() * placed.scale / pixels_per_point;
        if width < f64::from(DOT) {
            let middle = point((self.low + self.high) / 2.0);
            if self.points.len() > 1 {
                // About as much as there is of it, and the cheapest that there is to paint.
                painter.rect_filled(Rect::from_center_size(middle, Vec2::splat(2.0)), 0.0, self.color);
                return;
            }
            painter.circle_filled(middle, DOT + 1.0, Color32::from_black_alpha(140));
            painter.circle_filled(middle, DOT, self.color);
            return;
        }
        let mut points: Vec<Pos2> = Vec::new();
        for next in self.points.iter().map(|texel| point(*texel)) {
            if points.last().is_none_or(|last| last.distance(next) >= 1.0) {
                points.push(next);
            }
        }
        for (width, color) in [(4.0, Color32::from_black_alpha(110)), (2.0, self.color)] {
            let stroke = Stroke::new(width, color);
            painter.add(match self.is_closed {
                true => Shape::closed_line(points.clone(), stroke),
                false => Shape::line(points.clone(), stroke),
            });
        }
        let name = self.name.as_ref().filter(|_| width >= LEAST_OF_NAME);
        if let Some((name, first)) = name.zip(points.first()) {
            let galley = painter.layout_no_wrap(name.clone(), FontId::proportional(13.0), Color32::WHITE);
            let place = Align2::LEFT_BOTTOM.anchor_size(*first + Vec2::new(4.0, -4.0), galley.size());
            painter.rect_filled(place.expand(2.0), 2.0, Color32::from_black_alpha(170));
            painter.galley(place.min, galley, Color32::WHITE);
        }
    }
}

/// The lines, rings and points of a geometry; whether each is closed.
fn read(geometry: &Value, depth: usize, outlines: &mut Vec<(Vec<DVec2>, bool)>) -> Result<(), String> {
    let kind =
        geometry["type"].as_str().ok_or("has no geometry with a type; GeoJSON says which one it is")?;
    if kind == "GeometryCollection" && depth < DEPTH {
        let within = geometry["geometries"].as_array().ok_or("a collection has no list of geometries")?;
        return within.iter().try_for_each(|geometry| read(geometry, depth + 1, outlines));
    }
    // How many lists lie around those of positions, and whether a list of positions is a ring.
    let (lists, is_closed) = match kind {
        "Point" | "MultiPoint" | "LineString" => (0, false),
        "MultiLineString" => (1, false),
        "Polygon" => (1, true),
        "MultiPolygon" => (2, true),
        _ => return Err(format!("'{kind}' is no geometry that can be shown")),
    };
    let coordinates = &geometry["coordinates"];
    match kind {
        "Point" => outlines.push((vec![position(coordinates)?], false)),
        "MultiPoint" => {
            let points = positions(coordinates)?;
            outlines.extend(points.into_iter().map(|point| (vec![point], false)));
        }
        _ => read_lists(coordinates, lists, is_closed, outlines)?,
    }
    Ok(())
}

fn read_lists(
    value: &Value,
    lists: usize,
    is_closed: bool,
    outlines: &mut Vec<(Vec<DVec2>, bool)>,
) -> Result<(), String> {
    if lists > 0 {
        let within = value.as_array().ok_or("coordinates are no list of lists")?;
        return within.iter().try_for_each(|value| read_lists(value, lists - 1, is_closed, outlines));
    }
    let mut points = positions(value)?;
    if is_closed && points.len() > 1 && points.first() == points.last() {
        points.pop();
    }
    if !points.is_empty() {
        outlines.push((points, is_closed));
    }
    Ok(())
}

fn positions(value: &Value) -> Result<Vec<DVec2>, String> {
    value.as_array().ok_or("coordinates are no list of positions")?.iter().map(position).collect()
}

fn position(value: &Value) -> Result<DVec2, String> {
    let numbers = (value[0].as_f64(), value[1].as_f64());
    let (Some(x), Some(y)) = numbers else { return Err(format!("{value} is no position; write [x, y]")) };
    Ok(DVec2::new(x, y))
}

/// A colour as `#rrggbb` or as three numbers of 0 to 255.
fn color(value: &Value) -> Option<Color32> {
    if let Some(text) = value.as_str() {
        let digits = text.strip_prefix('#').filter(|digits| digits.len() == 6)?;
        let [_, r, g, b] = u32::from_str_radix(digits, 16).ok()?.to_be_bytes();
        return Some(Color32::from_rgb(r, g, b));
    }
    let byte = |n: usize| u8::try_from(value[n].as_u64()?).ok();
    Some(Color32::from_rgb(byte(0)?, byte(1)?, byte(2)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Shapes, ShapesError> {
        Shapes::from_geojson(text, |position| position * 2.0)
    }

    #[test]
    fn shapes_are_those_of_the_text() {
        let text = r##"{"type": "FeatureCollection", "features": [
            {"type": "Feature", "geometry": {"type": "Polygon", "coordinates":
                [[[0, 0], [4, 0], [4, 3], [0, 0]], [[1, 1, 9], [2, 1, 9], [2, 2, 9], [1, 1, 9]]]},
             "properties": {"name": "tumour", "classification": {"name": "a", "color": [200, 0, 10]}}},
            {"type": "Feature", "geometry": null, "properties": null},
            {"type": "Feature", "geometry": {"type": "GeometryCollection", "geometries": [
                {"type": "LineString", "coordinates": [[5, 5], [6, 7]]},
                {"type": "MultiPoint", "coordinates": [[1, 2], [3, 4]]}]},
             "properties": {"stroke": "#0102ff", "classification": {"name": "b"}}}]}"##;
        let shapes = read(text).unwrap();
        assert_eq!(shapes.count(), 5);
        let [ring, hole, line, point, _] = &shapes.shapes[..] else { panic!("{shapes:?}") };
        assert_eq!(ring.points, [DVec2::ZERO, DVec2::new(8.0, 0.0), DVec2::new(8.0, 6.0)]);
        assert_eq!((ring.low, ring.high), (DVec2::ZERO, DVec2::new(8.0, 6.0)));
        assert!(ring.is_closed && hole.is_closed && !line.is_closed);
        let name = |outline: &Outline| outline.name.clone();
        assert_eq!(
            (name(ring).as_deref(), name(hole), name(line).as_deref()),
            (Some("tumour"), None, Some("b"))
        );
        assert_eq!((hole.color, point.color), (Color32::from_rgb(200, 0, 10), Color32::from_rgb(1, 2, 255)));
        assert_eq!(point.points, [DVec2::new(2.0, 4.0)]);
        // A geometry alone, and a list of features, are shapes as well.
        assert_eq!(read(r#"{"type": "Point", "coordinates": [1, 2]}"#).unwrap().count(), 1);
        assert_eq!(read("[]").unwrap(), Shapes::default());
    }

    #[test]
    fn of_a_crowd_one_is_painted_in_each_cell() {
        let mut crowd = Crowd::new(Rect::from_min_size(pos2(100.0, 50.0), Vec2::new(35.0, 7.0)));
        let mut has_room = |x: f64, y: f64| crowd.has_room(DVec2::new(x, y));
        assert!(has_room(100.0, 50.0) && !has_room(103.0, 53.0) && has_room(104.0, 53.0));
        assert!(has_room(134.9, 56.9) && !has_room(134.9, 56.9));
        // Beside it, and where nothing is.
        assert!((0..2).all(|_| has_room(99.0, 50.0) && has_room(1e300, 0.0) && has_room(f64::NAN, 50.0)));
    }

    #[test]
    fn what_is_no_shape_is_told_by_its_place() {
        let feature = |geometry: &str| format!(r#"[{{"type": "Feature", "geometry": {geometry}}}]"#);
        let deep = |depth: usize| {
            let open = r#"{"type": "GeometryCollection", "geometries": ["#;
            feature(&format!("{}{}", open.repeat(depth), "]}".repeat(depth)))
        };
        for (text, place, why) in [
            ("{".to_owned(), "line 1, column 1", "no JSON"),
            ("{}".to_owned(), "feature 1", "has no geometry"),
            (feature(r#"{"type": "Circle"}"#), "feature 1", "'Circle'"),
            (feature(r#"{"type": "Point", "coordinates": [1]}"#), "feature 1", "[1] is no position"),
            (feature(r#"{"type": "Polygon", "coordinates": [[1, 2]]}"#), "feature 1", "no position"),
            (feature(r#"{"type": "Polygon", "coordinates": 3}"#), "feature 1", "no list"),
            (feature(r#"{"type": "Point", "coordinates": [1e308, 0]}"#), "feature 1", "too far away"),
            (deep(20), "feature 1", "GeometryCollection"),
        ] {
            let error = read(&text).unwrap_err();
            assert!(error.place == place && error.why.contains(why), "{text}: {error}");
        }
        assert!(read(&deep(10)).is_ok());
    }
}
