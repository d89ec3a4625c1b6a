//! Shapes as GeoJSON has them (RFC 7946): read in one go into lists of points, with no more of the text kept
//! than is shown.

mod members;

use std::fmt;

use egui::Color32;
use glam::DVec2;
use serde::Deserialize;
use serde::de::{DeserializeSeed, Error, IgnoredAny, MapAccess, SeqAccess, Visitor};
use serde_json::error::Category;

use self::members::{Bare, Coordinates, Crs, Geometry, Properties};
use super::{Bounds, Outline, Shapes};

/// The colour of what names none.
const COLOR: Color32 = Color32::from_rgb(255, 210, 60);
/// Collections within one another, at most.
const DEPTH: usize = 16;
/// Points, and outlines, that are read at most: about a gigabyte, and half of one.
const MOST_POINTS: usize = 1 << 26;
const MOST_OUTLINES: usize = 1 << 23;

/// A text cannot be read as shapes.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{place}: {why}")]
pub struct ShapesError {
    /// Where in the text: a line and a column, or the number of a feature, counted from 1.
    pub place: String,
    /// What is wrong there, and what to do.
    pub why: String,
}

/// The shapes of a text, in the coordinates that it has.
#[derive(Debug, Default)]
pub struct GeoJson {
    shapes: Shapes,
    /// How many outlines there are at the end of each feature.
    features: Vec<u32>,
    system: Option<String>,
}

impl GeoJson {
    /// Reads a feature, a collection of them, or a geometry alone, as long as `goes_on`, which is asked
    /// before each feature, says so.
    ///
    /// Features are named by their properties `name` or `classification.name`, of which some sixty characters
    /// are kept, and coloured by `stroke` (`#rrggbb`), `color` or `classification.color` (`[r, g, b]`), as
    /// QuPath and others write them. What has no geometry is left out, and heights are. Fails where the text
    /// is no JSON, where a geometry is not what the standard says, where there is more than can be shown, and
    /// where it shall not go on. Takes up to some times the bytes of the text.
    pub fn read(text: &str, goes_on: impl Fn() -> bool) -> Result<GeoJson, ShapesError> {
        let mut reading = Reading { read: GeoJson::default(), failed: None, goes_on: &goes_on };
        let mut deserializer = serde_json::Deserializer::from_str(text);
        let done = Root(&mut reading).deserialize(&mut deserializer).and_then(|()| deserializer.end());
        match (done, reading.failed) {
            (_, Some(failed)) => Err(failed),
            (Ok(()), None) => Ok(reading.read),
            (Err(error), None) => {
                let place = format!("line {}, column {}", error.line(), error.column());
                // What it says of the place is said already.
                let said = error.to_string();
                let what = said.rsplit_once(" at line ").map_or(&*said, |(what, _)| what);
                let why = match error.classify() {
                    Category::Data => format!("is no GeoJSON ({what}); write the file anew"),
                    _ => format!("is no JSON ({what}); write the file anew"),
                };
                Err(ShapesError { place, why })
            }
        }
    }

    /// What the member `crs` calls the system of the coordinates, which files have that are older than the
    /// standard.
    pub fn system(&self) -> Option<&str> {
        self.system.as_deref()
    }

    /// The shapes in an image. `texel_of` tells the place there, in texels from its top left corner, of a
    /// position. Fails where that is too far away for a number.
    pub fn shapes(self, texel_of: impl Fn(DVec2) -> DVec2) -> Result<Shapes, ShapesError> {
        let GeoJson { mut shapes, features, .. } = self;
        shapes.points.iter_mut().for_each(|point| *point = texel_of(*point));
        if let Some(at) = shapes.points.iter().position(|point| !point.is_finite()) {
            let outline = shapes.outlines.partition_point(|outline| outline.first as usize <= at);
            let feature = features.partition_point(|end| (*end as usize) < outline);
            return Err(at_feature(feature + 1, "has a position that is too far away; mend it".to_owned()));
        }
        shapes.set_bounds();
        Ok(shapes)
    }

    /// Adds the geometry of the next feature.
    fn add(&mut self, geometry: Option<&Geometry>, properties: &Properties) -> Result<(), String> {
        let names = self.shapes.names.len() as u32;
        self.shapes.names += properties.name().unwrap_or_default();
        let mut named = names..self.shapes.names.len() as u32;
        let color = properties.color().unwrap_or(COLOR);
        let shapes = &mut self.shapes;
        let mut add = |points: &[DVec2], is_closed: bool| {
            let name = std::mem::take(&mut named);
            let (first, count) = (shapes.points.len() as u32, points.len() as u32);
            let bounds = Bounds::default();
            shapes.points.extend(points);
            shapes.outlines.push(Outline { first, count, first_box: 0, is_closed, color, name, bounds });
            let is_full = shapes.points.len() > MOST_POINTS || shapes.outlines.len() > MOST_OUTLINES;
            let most = format!("{MOST_OUTLINES} shapes of {MOST_POINTS} points can be shown; split the file");
            if is_full { Err(most) } else { Ok(()) }
        };
        geometry.map_or(Ok(()), |geometry| geometry.outlines(DEPTH, &mut add))?;
        self.features.push(self.shapes.outlines.len() as u32);
        Ok(())
    }
}

fn at_feature(number: usize, why: String) -> ShapesError {
    ShapesError { place: format!("feature {number}"), why }
}

/// What is read so far.
struct Reading<'a> {
    read: GeoJson,
    /// Why no more is read, where serde cannot say it.
    failed: Option<ShapesError>,
    goes_on: &'a dyn Fn() -> bool,
}

impl Reading<'_> {
    fn add<E: Error>(&mut self, feature: Feature) -> Result<(), E> {
        let Feature { kind, geometry, properties, coordinates, geometries } = feature;
        let is_feature = kind.as_deref() == Some("Feature");
        let added = match is_feature {
            _ if !(self.goes_on)() => Err("was not read: it shall not go on".to_owned()),
            true => self.read.add(geometry.as_ref(), &properties),
            false => Geometry::try_from(Bare { kind, coordinates, geometries })
                .and_then(|geometry| self.read.add(Some(&geometry), &Properties::default())),
        };
        added.map_err(|why| {
            self.failed = Some(at_feature(self.read.features.len() + 1, why));
            E::custom("see there")
        })
    }
}

/// A feature, or a geometry in its place.
#[derive(Default, Deserialize)]
struct Feature {
    #[serde(rename = "type", default)]
    kind: Option<String>,
    #[serde(default)]
    geometry: Option<Geometry>,
    #[serde(default)]
    properties: Properties,
    #[serde(default)]
    coordinates: Coordinates,
    #[serde(default)]
    geometries: Option<Vec<Geometry>>,
}

/// A whole text: an object, or a list of features, as QuPath writes it, too.
struct Root<'a, 'b>(&'a mut Reading<'b>);

impl<'de> DeserializeSeed<'de> for Root<'_, '_> {
    type Value = ();

    fn deserialize<D: serde::Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for Root<'_, '_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a feature, a collection of them, or a geometry")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, seq: A) -> Result<(), A::Error> {
        Features(self.0).visit_seq(seq)
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<(), A::Error> {
        let (mut alone, mut is_collection) = (Feature::default(), false);
        while let Some(key) = map.next_key::<String>()? {
            match &*key {
                "type" => alone.kind = map.next_value()?,
                "features" => {
                    is_collection = true;
                    map.next_value_seed(Features(self.0))?;
                }
                "geometry" => alone.geometry = map.next_value()?,
                "properties" => alone.properties = map.next_value()?,
                "coordinates" => alone.coordinates = map.next_value()?,
                "geometries" => alone.geometries = map.next_value()?,
                "crs" => self.0.read.system = map.next_value::<Crs>()?.name,
                _ => drop(map.next_value::<IgnoredAny>()?),
            }
        }
        if is_collection { Ok(()) } else { self.0.add(alone) }
    }
}

/// A list of features.
struct Features<'a, 'b>(&'a mut Reading<'b>);

impl<'de> DeserializeSeed<'de> for Features<'_, '_> {
    type Value = ();

    fn deserialize<D: serde::Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_seq(self)
    }
}

impl<'de> Visitor<'de> for Features<'_, '_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a list of features")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<(), A::Error> {
        while let Some(feature) = seq.next_element::<Feature>()? {
            self.0.add::<A::Error>(feature)?;
        }
        Ok(())
    }
}
