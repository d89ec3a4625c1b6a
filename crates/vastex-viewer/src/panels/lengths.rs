//! How long a texel is in the world, and lengths in words.

use glam::DVec2;

use super::MapPlace;
use crate::figures::round_down;

/// Metres in a unit, by the names that files have for it.
const METRES: [(&str, f64); 15] = [
    ("pm", 1e-12),
    ("Å", 1e-10),
    ("nm", 1e-9),
    ("µm", 1e-6),
    ("um", 1e-6),
    ("mm", 1e-3),
    ("cm", 1e-2),
    ("dm", 1e-1),
    ("m", 1.0),
    ("metre", 1.0),
    ("meter", 1.0),
    ("km", 1e3),
    ("inch", 0.0254),
    ("in", 0.0254),
    ("ft", 0.3048),
];
/// Characters that the name of a unit has at most.
const MOST_OF_UNIT: usize = 16;
/// Units that lengths are told in, the longest first.
const TOLD: [(&str, f64); 5] = [("km", 1e3), ("m", 1.0), ("mm", 1e-3), ("µm", 1e-6), ("nm", 1e-9)];

/// Width and height of a texel of level 0 in the world.
#[derive(Clone, Debug, PartialEq)]
pub struct TexelSize {
    /// In metres, or in the unit.
    size: DVec2,
    /// Where that is no unit of length: degrees, or something else.
    unit: Option<String>,
    /// Of an objective through which the image was taken.
    magnification: Option<f64>,
    /// Where texels are of degrees on a globe, which degrees.
    globe: Option<MapPlace>,
}

impl TexelSize {
    /// Of a size in a unit as files name it: one of length (`µm`, `metre`, ...), `degree`, or any other that
    /// has a name. `None` if the size is not positive, or the name longer than names of units are.
    pub fn new(size: [f64; 2], unit: &str) -> Option<TexelSize> {
        let is_size = |side: f64| side.is_finite() && side > 0.0;
        if !size.into_iter().all(is_size) || unit.chars().nth(MOST_OF_UNIT).is_some() {
            return None;
        }
        let metres = METRES.iter().find(|(name, _)| *name == unit).map(|(_, metres)| *metres);
        let unit =
            metres.is_none().then(|| if unit == "degree" { "°".to_owned() } else { format!(" {unit}") });
        let size = DVec2::from(size) * metres.unwrap_or(1.0);
        Some(TexelSize { size, unit, magnification: None, globe: None })
    }

    /// This size for an image that was taken through an objective that magnifies so many times: what is seen
    /// of it is told beside the scale bar, as slide viewers tell it, where a pixel of the screen counts as
    /// one of the camera.
    #[must_use]
    pub fn with_magnification(self, magnification: Option<f64>) -> TexelSize {
        TexelSize { magnification, ..self }
    }

    /// Texels that are degrees of latitude and longitude on a globe, if `place` has such coordinates:
    /// lengths are told in metres along great circles, and areas are those of a sphere.
    #[must_use]
    pub fn on_globe(self, place: &MapPlace) -> TexelSize {
        let globe = place.is_geographic().then(|| place.clone());
        // In metres from here on.
        let unit = self.unit.filter(|_| globe.is_none());
        TexelSize { unit, globe, ..self }
    }

    /// How many times an image is magnified whose texels are so many pixels wide, to three digits.
    pub(super) fn magnified(&self, scale: f64) -> Option<String> {
        let times = self.magnification? * scale;
        let decimals = (2 - times.abs().max(1e-3).log10().floor() as i32).clamp(0, 6) as usize;
        let text = format!("{times:.decimals$}");
        let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
        Some(format!("{text}×"))
    }

    /// How long a step of so many texels is, in [`TexelSize::round`]'s numbers, wherever it is taken. Not
    /// on a globe.
    pub(super) fn length(&self, texels: DVec2) -> f64 {
        (texels * self.size).length()
    }

    /// How far it is from one place to another, in the same numbers.
    pub(super) fn between(&self, from: DVec2, to: DVec2) -> f64 {
        match &self.globe {
            Some(place) => place.distance(from, to),
            None => self.length(to - from),
        }
    }

    /// The way from one place to another that is measured, as lines in an image of so many columns.
    pub(super) fn way(&self, from: DVec2, to: DVec2, columns: f64) -> Vec<Vec<DVec2>> {
        match &self.globe {
            Some(place) => place.way(from, to, columns),
            None => vec![vec![from, to]],
        }
    }

    /// Returns true if texels are of degrees on a globe, where a straight line of the image is no shortest
    /// way.
    pub(super) fn is_on_globe(&self) -> bool {
        self.globe.is_some()
    }

    /// What a closed line of places surrounds, in the same numbers squared.
    pub(super) fn within(&self, places: &[DVec2]) -> f64 {
        match &self.globe {
            Some(place) => place.area(places),
            None => plane_area(places) * self.size.x * self.size.y,
        }
    }

    /// A length in words, to four digits.
    pub(super) fn told(&self, length: f64) -> String {
        match &self.unit {
            Some(unit) => format!("{}{unit}", four_digits(length)),
            None => {
                let (name, metres) = fitting(length, 1);
                format!("{} {name}", four_digits(length / metres))
            }
        }
    }

    /// A surface in words, to four digits; `None` if texels are not measured by lengths.
    pub(super) fn told_area(&self, area: f64) -> Option<String> {
        if self.unit.is_some() {
            return None;
        }
        let (name, metres) = fitting(area, 2);
        Some(format!("{} {name}²", four_digits(area / (metres * metres))))
    }

    /// The longest of 1, 2 and 5 times a power of ten that is no longer than so much, and how it is told;
    /// nothing of what is no length.
    pub(super) fn round(&self, most: f64) -> Option<(f64, String)> {
        let unit = match &self.unit {
            Some(unit) => (unit.clone(), 1.0),
            None => {
                let (name, metres) = fitting(most, 1);
                (format!(" {name}"), metres)
            }
        };
        let (length, decimals) = round_down(most / unit.1)?;
        Some((length * unit.1, format!("{length:.decimals$}{}", unit.0)))
    }
}

/// What a closed line surrounds in a plane. Where it crosses itself, parts gone round the other way are
/// subtracted.
pub(super) fn plane_area(places: &[DVec2]) -> f64 {
    let Some(&first) = places.first() else { return 0.0 };
    // From the first place, so that nothing is lost of small surfaces far from the corner.
    let twice: f64 = places.windows(2).map(|ends| (ends[0] - first).perp_dot(ends[1] - first)).sum();
    twice.abs() / 2.0
}

/// The longest unit, to a power, that tells an amount well.
fn fitting(amount: f64, power: i32) -> (&'static str, f64) {
    // Of surfaces a hundredth: from one unit to the next there are a million.
    let share = if power == 1 { 1.0 - 1e-12 } else { 0.01 };
    let is_filled = |(_, metres): &&(&str, f64)| amount >= metres.powi(power) * share;
    *TOLD.iter().find(is_filled).unwrap_or(&TOLD[TOLD.len() - 1])
}

/// A number in four digits, without zeros at its end.
fn four_digits(number: f64) -> String {
    // What is longer than it can be read is told by its power of ten.
    if number.abs() >= 1e15 {
        return format!("{number:.3e}");
    }
    let before_point = number.abs().max(1e-300).log10().floor() as i32 + 1;
    let text = format!("{number:.*}", (4 - before_point).clamp(0, 12) as usize);
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_are_round_and_told_in_a_fitting_unit() {
        let slide = TexelSize::new([0.499; 2], "µm").unwrap();
        let told = |size: &TexelSize, texels: f64| {
            let (length, text) = size.round(size.length(DVec2::new(texels, 0.0))).unwrap();
            (length, text)
        };
        let (length, text) = told(&slide, 100.0);
        assert!((length / 2e-5 - 1.0).abs() < 1e-12 && text == "20 µm", "{length} {text}");
        assert_eq!(told(&slide, 1.0).1, "200 nm");
        assert_eq!(told(&slide, 1e5).1, "20 mm");
        let map = TexelSize::new([10.0, 20.0], "metre").unwrap();
        assert_eq!(told(&map, 160.0).1, "1 km");
        assert_eq!(map.length(DVec2::new(0.0, 3.0)), 60.0);
        // As OME-XML spells an inch.
        let inch = TexelSize::new([1.0; 2], "in").unwrap();
        assert_eq!(told(&inch, 100.0).1, "2 m");
        let globe = TexelSize::new([1.0 / 30.0; 2], "degree").unwrap();
        assert_eq!(told(&globe, 160.0).1, "5°");
        assert_eq!(told(&globe, 2.0).1, "0.05°");
        assert_eq!(told(&TexelSize::new([2.0; 2], "furlong").unwrap(), 100.0).1, "200 furlong");
        let long = "µ".repeat(17);
        for (size, unit) in
            [([0.0, 1.0], "µm"), ([1.0, f64::NAN], "metre"), ([-1.0; 2], "degree"), ([1.0; 2], &*long)]
        {
            assert_eq!(TexelSize::new(size, unit), None);
        }
    }

    /// A sixtieth of a degree, which is about a nautical mile on the equator.
    #[test]
    fn degrees_on_a_globe_are_told_in_metres() {
        let step = 1.0 / 60.0;
        let place = MapPlace::new([step, 0.0, -180.0, 0.0, -step, 90.0], "EPSG:4326", true).unwrap();
        let size = TexelSize::new([step; 2], "degree").unwrap().on_globe(&place);
        let equator = DVec2::new(9000.0, 5400.0);
        let told = |from: DVec2, to: DVec2| size.told(size.between(from, to));
        assert_eq!(told(equator, equator + DVec2::X), "1.853 km");
        assert_eq!(told(equator, equator - DVec2::Y), "1.853 km");
        // At 60 degrees a degree of longitude is half as long.
        let north = DVec2::new(9000.0, 1800.0);
        assert_eq!(told(north, north + DVec2::X), "926.6 m");
        let cell = [equator, equator + DVec2::X, equator + DVec2::ONE, equator + DVec2::Y];
        assert_eq!(size.told_area(size.within(&cell)).unwrap(), "3.435 km²");
        assert_eq!(size.round(size.between(equator, equator + DVec2::X)).unwrap().1, "1 km");
        // On Mars, and on a map that is not of degrees.
        let mars =
            TexelSize::new([step; 2], "degree").unwrap().on_globe(&place.with_radius(Some(3_389_500.0)));
        assert_eq!(mars.told(mars.between(equator, equator + DVec2::X)), "986 m");
        let utm = MapPlace::new([10.0, 0.0, 0.0, 0.0, -10.0, 0.0], "EPSG:32633", false).unwrap();
        let metres = TexelSize::new([10.0; 2], "metre").unwrap();
        assert_eq!(metres.clone().on_globe(&utm), metres);
    }

    #[test]
    fn lengths_beyond_all_measure_are_told_shortly() {
        let huge = TexelSize::new([1e308, 1.0], "metre").unwrap();
        assert_eq!(huge.told(1e308), "1.000e305 km");
        assert_eq!(huge.told(f64::INFINITY), "inf km");
        assert_eq!(four_digits(123_456.0), "123456");
        assert_eq!(huge.told_area(1e300).unwrap(), "1.000e294 km²");
    }

    #[test]
    fn magnifications_are_told() {
        let slide = TexelSize::new([0.499; 2], "µm").unwrap();
        assert_eq!(slide.magnified(1.0), None);
        let slide = slide.with_magnification(Some(20.0));
        for (scale, text) in
            [(1.0, "20×"), (0.03125, "0.625×"), (0.4567, "9.13×"), (10.0, "200×"), (64.0, "1280×")]
        {
            assert_eq!(slide.magnified(scale).as_deref(), Some(text), "{scale}");
        }
    }
}
