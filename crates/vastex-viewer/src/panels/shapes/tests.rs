//! Which shapes a text has, and what of them is painted.

use egui::{Context, LayerId, RawInput, Shape, pos2};

use super::*;
use crate::camera::{Orientation, Pose};

fn read(text: &str) -> Result<Shapes, ShapesError> {
    Shapes::from_geojson(text, |position| position * 2.0)
}

#[test]
fn shapes_are_those_of_the_text() {
    let text = r##"{"type": "FeatureCollection", "other": [{"a": 1}], "features": [
        {"type": "Feature", "geometry": {"coordinates":
            [[[0, 0], [4, 0], [4, 3], [0, 0]], [[1, 1, 9], [2, 1, 9], [2, 2, 9], [1, 1, 9]]], "type": "Polygon"},
         "properties": {"name": "tumour", "n": [7], "classification": {"name": "a", "color": [200, 0, 10]}}},
        {"type": "Feature", "geometry": null, "properties": null},
        {"type": "Feature", "geometry": {"type": "GeometryCollection", "geometries": [
            {"type": "LineString", "coordinates": [[5, 5], [6, 7]]},
            {"type": "MultiPoint", "coordinates": [[1, 2], [3, 4]]}]},
         "properties": {"name": 9, "color": [1, 2], "stroke": "#0102ff", "classification": {"name": "b"}}}]}"##;
    let shapes = read(text).unwrap();
    assert_eq!(shapes.count(), 5);
    let [ring, hole, line, point, _] = &shapes.outlines[..] else { panic!("{shapes:?}") };
    assert_eq!(shapes.points_of(ring), [DVec2::ZERO, DVec2::new(8.0, 0.0), DVec2::new(8.0, 6.0)]);
    assert_eq!(ring.bounds, Bounds { low: DVec2::ZERO, high: DVec2::new(8.0, 6.0) });
    assert!(ring.is_closed && hole.is_closed && !line.is_closed);
    let name = |outline: &Outline| &shapes.names[outline.name.start as usize..outline.name.end as usize];
    assert_eq!((name(ring), name(hole), name(line)), ("tumour", "", "b"));
    assert_eq!((hole.color, point.color), (Color32::from_rgb(200, 0, 10), Color32::from_rgb(1, 2, 255)));
    assert_eq!(shapes.points_of(point), [DVec2::new(2.0, 4.0)]);
    // A geometry alone, and a list of features, are shapes as well.
    assert_eq!(read(r#"{"type": "Point", "coordinates": [1, 2]}"#).unwrap().count(), 1);
    assert_eq!(read("[]").unwrap(), Shapes::default());
    let old = r#"{"features": [], "crs": {"type": "name", "properties": {"name": "EPSG:3857"}}}"#;
    assert_eq!(GeoJson::read(old, || true).unwrap().system(), Some("EPSG:3857"));
    assert_eq!(GeoJson::read(r#"{"features": [], "crs": null}"#, || true).unwrap().system(), None);
}

#[test]
fn what_is_no_shape_is_told_by_its_place() {
    let feature = |geometry: &str| format!(r#"[{{"type": "Feature", "geometry": {geometry}}}]"#);
    let deep = |depth: usize| {
        let open = r#"{"type": "GeometryCollection", "geometries": ["#;
        feature(&format!("{}{}", open.repeat(depth), "]}".repeat(depth)))
    };
    let point = r#"{"type": "Feature", "geometry": {"type": "Point", "coordinates": [1, 2]}}"#;
    let far = r#"{"type": "Point", "coordinates": [1e308, 0]}"#;
    for (text, place, why) in [
        ("{".to_owned(), "line 1, column 1", "no JSON"),
        ("[] 1".to_owned(), "line 1, column 4", "no JSON"),
        ("{}".to_owned(), "feature 1", "has no geometry"),
        (r#"{"type": "Circle"}"#.to_owned(), "feature 1", "'Circle'"),
        (feature(r#"{"type": "Circle"}"#), "line 1", "'Circle'"),
        (feature(r#"{"type": "Point", "coordinates": [1]}"#), "line 1", "no second number"),
        (feature(r#"{"type": "Point"}"#), "feature 1", "no position"),
        (feature(r#"{"type": "LineString", "coordinates": [[1, 2], 3]}"#), "line 1", "no position"),
        (
            feature(r#"{"type": "Polygon", "coordinates": [[1, 2]]}"#),
            "feature 1",
            "in 2 lists, and these in 1",
        ),
        (feature(r#"{"type": "Polygon", "coordinates": [[[1, 2]], [3, 4]]}"#), "line 1", "more lists"),
        (feature(r#"{"type": "Polygon", "coordinates": 3}"#), "line 1", "a list of positions"),
        (format!("[{point}, {point}, {far}, {point}]"), "feature 3", "too far away"),
        (deep(20), "feature 1", "GeometryCollection"),
        ("3".to_owned(), "line 1", "no GeoJSON"),
    ] {
        let error = read(&text).unwrap_err();
        assert!(error.place.starts_with(place) && error.why.contains(why), "{text}: {error}");
    }
    assert!(read(&deep(10)).is_ok());
    let asked = std::cell::Cell::new(0);
    let goes_on = || asked.replace(asked.get() + 1) < 2;
    let error = GeoJson::read(&format!("[{point}, {point}, {point}, {point}]"), goes_on).unwrap_err();
    assert!(error.place == "feature 3" && asked.get() == 3, "{error}");
}

#[test]
fn names_are_as_long_as_fits_beside_a_shape() {
    let long = "ß".repeat(100_000);
    let text = format!(
        r#"{{"type": "Feature", "geometry": {{"type": "Point", "coordinates": [1, 2]}}, "properties": {{"name": "a\n{long}"}}}}"#
    );
    let names = read(&text).unwrap().names;
    assert!(names.starts_with("a ßß") && names.ends_with("ß…") && names.chars().count() == 61, "{names}");
}

#[test]
fn of_a_crowd_one_is_painted_in_each_cell() {
    let mut crowd = Crowd::new(Rect::from_min_size(pos2(112.0, 62.0), Vec2::new(35.0, 7.0)));
    let mut has_room = |x: f64, y: f64| crowd.has_room(DVec2::new(x, y));
    assert!(has_room(100.0, 50.0) && !has_room(103.0, 53.0) && has_room(104.0, 53.0));
    assert!(has_room(158.9, 80.9) && !has_room(158.9, 80.9));
    // Nothing is seen beside it.
    assert!(!has_room(99.0, 50.0) && !has_room(1e300, 0.0) && !has_room(f64::NAN, 50.0));
}

/// What is painted of shapes in a window of 200x100 points over an image of 2000x1000 texels.
fn painted(shapes: &Shapes, pose: Pose) -> Vec<Shape> {
    let context = Context::default();
    let view = ImageView { pose, picture: [200, 100], image: [2000, 1000], left: 0 };
    let window = Rect::from_min_size(Pos2::ZERO, Vec2::new(200.0, 100.0));
    let input = RawInput { screen_rect: Some(window), ..RawInput::default() };
    let mut output = context.run_ui(input, |ui| {
        shapes.paint(&ui.ctx().layer_painter(LayerId::background()), window, &view);
    });
    output.textures_delta.clear();
    std::mem::take(&mut output.shapes)
        .into_iter()
        .map(|clipped| clipped.shape)
        .filter(|shape| *shape != Shape::Noop)
        .collect()
}

/// How many points the lines have, and how far from the middle of the window they reach.
fn points_and_reach(painted: &[Shape]) -> (usize, f32) {
    let points = painted.iter().flat_map(|shape| match shape {
        Shape::Path(path) => path.points.clone(),
        Shape::LineSegment { points, .. } => points.to_vec(),
        _ => Vec::new(),
    });
    points.fold((0, 0.0), |(count, reach), point| {
        (count + 1, f32::max(reach, (point - pos2(100.0, 50.0)).abs().max_elem()))
    })
}

#[test]
fn of_a_long_outline_as_much_is_painted_as_is_in_view() {
    // A comb of a million points over all of the image.
    let comb = |n: u32| [f64::from(n) * 1e-3, if n % 4 < 2 { 0.0 } else { 500.0 }];
    let positions: Vec<[f64; 2]> = (0..1_000_000).map(comb).collect();
    let text = format!(r#"{{"type": "LineString", "coordinates": {positions:?}}}"#);
    let shapes = read(&text).unwrap();
    // 20 points of the window along a texel: ten columns are seen, between the teeth.
    let near = painted(&shapes, Pose::image(DVec2::new(0.25, 0.25), 200.0));
    let (count, reach) = points_and_reach(&near);
    assert!(count > 0 && count < 40_000 && reach <= 108.5, "{count} points, up to {reach} away");
    // Seen as a whole, as many as are told apart.
    let (count, reach) = points_and_reach(&painted(&shapes, Pose::image(DVec2::splat(0.5), 1.0)));
    assert!(count > 0 && count <= 2 * MOST_PAINTED && reach <= 108.5, "{count} points, up to {reach} away");
}

#[test]
fn lines_lie_where_they_are_however_near_the_view_is() {
    // From one corner of the image to a place beside the other one, through its middle.
    let shapes = read(r#"{"type": "LineString", "coordinates": [[0, 0.1], [1000, 499.9]]}"#).unwrap();
    for zoom in [1.0, 1e3, 1e6, 1e9] {
        let painted = painted(&shapes, Pose::image(DVec2::splat(0.5), zoom));
        let lines = painted.iter().map(|shape| match shape {
            Shape::LineSegment { points, .. } => *points,
            Shape::Path(path) => [path.points[0], path.points[path.points.len() - 1]],
            other => panic!("{other:?}"),
        });
        for [from, to] in lines {
            let step = to - from;
            let slope = f64::from(step.y / step.x);
            let beside = (pos2(100.0, 50.0) - from).dot(step.normalized().rot90()).abs();
            assert!((slope - 0.4998).abs() < 1e-3 && beside < 0.5, "{zoom}: {slope}, {beside} points beside");
        }
    }
}

#[test]
fn a_view_that_is_turned_paints_no_more_small_shapes_than_it_shows() {
    let positions: Vec<[f64; 2]> = (0..40_000).map(|n| [f64::from(n % 200), f64::from(n / 200)]).collect();
    let shapes = read(&format!(r#"{{"type": "MultiPoint", "coordinates": {positions:?}}}"#)).unwrap();
    let centre = DVec2::new(0.1, 0.2);
    let of = |degrees: f64| {
        let pose = Pose::image(centre, 10.0).with_orientation(Orientation::new(degrees, false), 2.0, 2.0);
        painted(&shapes, pose).len()
    };
    let (upright, turned) = (of(0.0), of(45.0));
    assert!(upright > 0 && turned < upright * 3 / 2, "{upright} and {turned}");
}
