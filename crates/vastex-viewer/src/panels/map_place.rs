//! Where an image lies in the coordinate system of its file, in words and back.

use glam::{DMat2, DVec2};

use super::sphere;

/// Characters that the name of a coordinate system is shown with at most.
const MOST_OF_NAME: usize = 40;
/// Digits after the point, at most.
const MOST_DIGITS: f64 = 9.0;

/// An affine map from the texels of an image to the coordinates of its file: a GeoTIFF's own system,
/// projected or geographic. Nothing is reprojected.
///
/// Texels are counted from the upper left corner of level 0, so that the middle of the first one is at 0.5.
/// Coordinates are x and y as the file has them: of degrees longitude and latitude, which are told and read
/// the other way round, as people write them.
#[derive(Clone, Debug, PartialEq)]
pub struct MapPlace {
    matrix: DMat2,
    offset: DVec2,
    inverse: DMat2,
    system: String,
    is_geographic: bool,
    /// Metres of the sphere that degrees are of.
    radius: f64,
    /// Digits after the point that tell texels apart.
    digits: usize,
}

impl MapPlace {
    /// The place of an image whose texels lie at `[m0 * column + m1 * row + m2, m3 * column + m4 * row + m5]`
    /// in a system of that name, whose coordinates are degrees if `is_geographic`. `None` if texels cannot be
    /// told apart by them.
    pub fn new(from_texels: [f64; 6], system: &str, is_geographic: bool) -> Option<MapPlace> {
        let [a, b, x, c, d, y] = from_texels;
        let (matrix, offset) = (DMat2::from_cols_array(&[a, c, b, d]), DVec2::new(x, y));
        let inverse = matrix.inverse();
        let is_finite = matrix.is_finite() && offset.is_finite() && inverse.is_finite();
        let step = a.hypot(c).min(b.hypot(d));
        if !is_finite || matrix.determinant() == 0.0 || step <= 0.0 {
            return None;
        }
        let digits = (1.0 - step.log10()).ceil().clamp(0.0, MOST_DIGITS) as usize;
        let system = system.chars().filter(|c| !c.is_control()).take(MOST_OF_NAME).collect();
        let radius = sphere::EARTH;
        Some(MapPlace { matrix, offset, inverse, system, is_geographic, radius, digits })
    }

    /// A place on another body than the Earth, one whose mean radius is so many metres; on the Earth without
    /// a number, and where that is no radius.
    #[must_use]
    pub fn with_radius(self, radius: Option<f64>) -> MapPlace {
        let is_radius = |radius: &f64| radius.is_finite() && *radius > 0.0;
        MapPlace { radius: radius.filter(is_radius).unwrap_or(self.radius), ..self }
    }

    /// Returns true if its coordinates are degrees.
    pub(super) fn is_geographic(&self) -> bool {
        self.is_geographic
    }

    /// Metres between two places of an image in degrees, on a sphere.
    pub(super) fn distance(&self, from: DVec2, to: DVec2) -> f64 {
        sphere::distance(self.radius, self.coordinates(from), self.coordinates(to))
    }

    /// The shortest way on a sphere between two places of an image in degrees, as lines through places of the
    /// image of so many columns, and beside it above and below: two of them where it leaves the image at one
    /// side and comes back at the other.
    pub(super) fn way(&self, from: DVec2, to: DVec2, columns: f64) -> Vec<Vec<DVec2>> {
        let way = sphere::way(self.coordinates(from), self.coordinates(to));
        let end = way.last().map_or(0.0, |place| place[1]);
        let turns = end - self.coordinates(to)[1];
        let on_image = |turns: f64| way.iter().map(move |[north, east]| self.texel([*north, east - turns]));
        if turns.abs() < 180.0 {
            return vec![on_image(0.0).collect()];
        }
        [0.0, turns].map(|turns| within_columns(on_image(turns), columns)).into()
    }

    /// Square metres within a closed line of places of an image in degrees, on a sphere.
    pub(super) fn area(&self, places: &[DVec2]) -> f64 {
        let places: Vec<[f64; 2]> = places.iter().map(|texel| self.coordinates(*texel)).collect();
        sphere::area(self.radius, &places)
    }

    /// What the system is called.
    pub fn system(&self) -> &str {
        &self.system
    }

    /// What the place's two coordinates are called, in the order in which they are written.
    pub fn axes(&self) -> &'static str {
        if self.is_geographic { "latitude, longitude" } else { "x, y" }
    }

    /// The two coordinates of a place of the image, in the order in which they are written.
    pub fn coordinates(&self, texel: DVec2) -> [f64; 2] {
        self.ordered(self.matrix * texel + self.offset)
    }

    /// The place of the image with these coordinates, which may lie beside it.
    pub fn texel(&self, coordinates: [f64; 2]) -> DVec2 {
        let at = self.ordered(coordinates.into());
        self.inverse * (DVec2::from(at) - self.offset)
    }

    /// The coordinates of a place of the image in words, with as many digits as tell texels apart.
    pub fn text(&self, texel: DVec2) -> String {
        let ([first, second], digits) = (self.coordinates(texel), self.digits);
        match self.is_geographic {
            true => format!("{} {}", degrees(first, ["N", "S"], digits), degrees(second, ["E", "W"], digits)),
            false => format!("x {first:.digits$} y {second:.digits$} ({})", self.system),
        }
    }

    /// The lowest and the highest coordinates of an image of so many texels, in words.
    pub(super) fn extent(&self, size: [u32; 2]) -> String {
        let [width, height] = size.map(f64::from);
        let corners = [[0.0, 0.0], [width, 0.0], [0.0, height], [width, height]]
            .map(|corner| DVec2::from(self.coordinates(corner.into())));
        let low = corners.into_iter().fold(corners[0], DVec2::min);
        let high = corners.into_iter().fold(corners[0], DVec2::max);
        let digits = self.digits;
        format!("{:.digits$},{:.digits$} to {:.digits$},{:.digits$}", low.x, low.y, high.x, high.y)
    }

    /// Coordinates as they are written from those of the file, and back.
    fn ordered(&self, at: DVec2) -> [f64; 2] {
        if self.is_geographic { [at.y, at.x] } else { [at.x, at.y] }
    }
}

/// Degrees in words, on one side of 0 or on the other.
pub(super) fn degrees(degrees: f64, [above, below]: [&str; 2], digits: usize) -> String {
    format!("{:.digits$}° {}", degrees.abs(), if degrees < 0.0 { below } else { above })
}

/// The part of a line that lies within the columns of an image; it leaves them once.
fn within_columns(places: impl Iterator<Item = DVec2>, columns: f64) -> Vec<DVec2> {
    let is_within = |place: DVec2| (0.0..=columns).contains(&place.x);
    let mut line = Vec::new();
    let mut last: Option<DVec2> = None;
    for place in places {
        if let Some(before) = last.filter(|before| is_within(*before) != is_within(place)) {
            // Where it crosses the edge.
            let edge = if before.x.min(place.x) < 0.0 { 0.0 } else { columns };
            line.push(before.lerp(place, (edge - before.x) / (place.x - before.x)));
        }
        line.extend(Some(place).filter(|place| is_within(*place)));
        last = Some(place);
    }
    line
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coordinates_are_those_of_the_file_and_lead_back() {
        let utm =
            MapPlace::new([10.0, 0.0, 500_000.0, 0.0, -10.0, 4_600_000.0], "EPSG:32633", false).unwrap();
        assert_eq!(utm.coordinates(DVec2::ZERO), [500_000.0, 4_600_000.0]);
        assert_eq!(utm.text(DVec2::new(20.5, 3.5)), "x 500205 y 4599965 (EPSG:32633)");
        assert_eq!(utm.extent([203, 141]), "500000,4598590 to 502030,4600000");
        // Turned, and sheared.
        let turned = MapPlace::new([0.3, -0.4, 7.5e6, -0.4, -0.35, -3.25e6], "a", false).unwrap();
        for texel in [[0.0, 0.0], [1.5, 2.5], [40_000.25, 9.0]].map(DVec2::from) {
            assert!(turned.texel(turned.coordinates(texel)).distance(texel) < 1e-6, "{texel}");
        }
        assert_eq!(turned.text(DVec2::ZERO), "x 7500000.00 y -3250000.00 (a)");
    }

    #[test]
    fn degrees_are_written_as_people_write_them() {
        let step = 1.0 / 120.0;
        let map = MapPlace::new([step, 0.0, -20.0, 0.0, -step, 40.0], "EPSG:4326", true).unwrap();
        assert_eq!(map.coordinates(DVec2::new(0.0, 120.0)), [39.0, -20.0]);
        assert!(map.texel([39.0, -20.0]).distance(DVec2::new(0.0, 120.0)) < 1e-9);
        assert_eq!(map.text(DVec2::new(0.5, 4800.5)), "0.0042° S 19.9958° W");
        assert_eq!(map.axes(), "latitude, longitude");
    }

    #[test]
    fn what_tells_no_texels_apart_is_no_place() {
        for m in [
            [0.0; 6],
            [1.0, 2.0, 0.0, 2.0, 4.0, 0.0],
            [f64::NAN, 0.0, 0.0, 0.0, 1.0, 0.0],
            [1.0, 0.0, f64::INFINITY, 0.0, 1.0, 0.0],
            [1e-320, 0.0, 0.0, 0.0, 1e-320, 0.0],
        ] {
            assert_eq!(MapPlace::new(m, "a", false), None, "{m:?}");
        }
        let long = MapPlace::new([1.0, 0.0, 0.0, 0.0, 1.0, 0.0], &"name\n".repeat(20), false).unwrap();
        assert_eq!(long.system().len(), 40);
    }
}
