//! Members of GeoJSON's features: geometries, and what is used of properties, whatever else files have there.

use std::fmt;

use egui::Color32;
use glam::DVec2;
use serde::de::{DeserializeSeed, Error, IgnoredAny, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};

/// Characters of a name that are kept.
const MOST_OF_NAME: usize = 60;

/// A geometry.
#[derive(Deserialize)]
#[serde(try_from = "Bare")]
pub(super) struct Geometry {
    kind: Kind,
    coordinates: Coordinates,
    geometries: Option<Vec<Geometry>>,
}

/// A geometry as a text has it.
#[derive(Deserialize)]
pub(super) struct Bare {
    #[serde(rename = "type", default)]
    pub(super) kind: Option<String>,
    #[serde(default)]
    pub(super) coordinates: Coordinates,
    #[serde(default)]
    pub(super) geometries: Option<Vec<Geometry>>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Point,
    MultiPoint,
    LineString,
    MultiLineString,
    Polygon,
    MultiPolygon,
    Collection,
}

impl TryFrom<Bare> for Geometry {
    type Error = String;

    fn try_from(bare: Bare) -> Result<Geometry, String> {
        let Bare { kind, coordinates, geometries } = bare;
        let kind = match kind.as_deref() {
            Some("Point") => Kind::Point,
            Some("MultiPoint") => Kind::MultiPoint,
            Some("LineString") => Kind::LineString,
            Some("MultiLineString") => Kind::MultiLineString,
            Some("Polygon") => Kind::Polygon,
            Some("MultiPolygon") => Kind::MultiPolygon,
            Some("GeometryCollection") => Kind::Collection,
            Some(kind) => {
                let kind: String = kind.chars().take(MOST_OF_NAME).collect();
                return Err(format!("'{kind}' is no geometry that can be shown"));
            }
            None => return Err("has no geometry with a type; GeoJSON says which one it is".to_owned()),
        };
        if kind == Kind::Collection && geometries.is_none() {
            return Err("a collection has no list of geometries".to_owned());
        }
        Ok(Geometry { kind, coordinates, geometries })
    }
}

impl Geometry {
    /// Hands out its lines, rings and points, and says of each whether it is closed; of collections as many
    /// within one another as `depth` says.
    pub(super) fn outlines(
        &self,
        depth: usize,
        add: &mut impl FnMut(&[DVec2], bool) -> Result<(), String>,
    ) -> Result<(), String> {
        // How many lists lie around a position, and whether one of positions is a ring.
        let (lists, is_closed) = match self.kind {
            Kind::Point => (0, false),
            Kind::MultiPoint | Kind::LineString => (1, false),
            Kind::MultiLineString => (2, false),
            Kind::Polygon => (2, true),
            Kind::MultiPolygon => (3, true),
            Kind::Collection if depth == 0 => {
                return Err("too many a GeometryCollection lies in others".to_owned());
            }
            Kind::Collection => {
                let mut within = self.geometries.iter().flatten();
                return within.try_for_each(|geometry| geometry.outlines(depth - 1, add));
            }
        };
        let Coordinates { points, ends, lists: found } = &self.coordinates;
        match *found {
            None if self.kind == Kind::Point => {
                return Err("a point has no position; write [x, y]".to_owned());
            }
            None => return Ok(()),
            Some(found) if found == lists => {}
            Some(found) => {
                let kind = self.kind;
                return Err(format!("positions of a {kind:?} lie in {lists} lists, and these in {found}"));
            }
        }
        if self.kind == Kind::MultiPoint {
            return points.iter().try_for_each(|point| add(std::slice::from_ref(point), false));
        }
        let mut first = 0;
        for end in ends {
            let list = &points[std::mem::replace(&mut first, *end)..*end];
            // The last position of a ring is its first.
            let is_repeated = is_closed && list.len() > 1 && list.first() == list.last();
            let list = if is_repeated { &list[..list.len() - 1] } else { list };
            if !list.is_empty() {
                add(list, is_closed)?;
            }
        }
        Ok(())
    }
}

/// Positions in lists of lists.
#[derive(Default)]
pub(super) struct Coordinates {
    /// Points of all lists, one after another.
    points: Vec<DVec2>,
    /// Where each of the innermost lists ends.
    ends: Vec<usize>,
    /// How many lists lie around each position; `None` if there is none.
    lists: Option<usize>,
}

impl<'de> Deserialize<'de> for Coordinates {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Coordinates, D::Error> {
        let mut found = Coordinates::default();
        deserializer.deserialize_seq(Lists { found: &mut found, depth: 0 })?;
        if found.lists == Some(0) {
            found.ends.push(found.points.len());
        }
        Ok(found)
    }
}

/// Reads a number, a position or a list.
struct Lists<'a> {
    found: &'a mut Coordinates,
    /// How many lists it is in.
    depth: usize,
}

/// What an element of a list was.
enum Element {
    Number(f64),
    Position,
    List,
}

impl<'de> DeserializeSeed<'de> for Lists<'_> {
    type Value = Element;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Element, D::Error> {
        deserializer.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for Lists<'_> {
    type Value = Element;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a list of positions, or [x, y]")
    }

    fn visit_f64<E: Error>(self, number: f64) -> Result<Element, E> {
        Ok(Element::Number(number))
    }

    fn visit_i64<E: Error>(self, number: i64) -> Result<Element, E> {
        Ok(Element::Number(number as f64))
    }

    fn visit_u64<E: Error>(self, number: u64) -> Result<Element, E> {
        Ok(Element::Number(number as f64))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Element, A::Error> {
        let Lists { found, depth } = self;
        let (mut is_first, mut has_positions) = (true, false);
        while let Some(element) = seq.next_element_seed(Lists { found: &mut *found, depth: depth + 1 })? {
            match element {
                Element::Number(x) if is_first => {
                    let next = seq.next_element_seed(Lists { found: &mut *found, depth: depth + 1 })?;
                    let Some(Element::Number(y)) = next else {
                        return Err(A::Error::custom("a position has no second number; write [x, y]"));
                    };
                    // Heights are left out.
                    while seq.next_element::<IgnoredAny>()?.is_some() {}
                    if found.lists.replace(depth).is_some_and(|lists| lists != depth) {
                        return Err(A::Error::custom("positions lie in more lists than others do"));
                    }
                    found.points.push(DVec2::new(x, y));
                    return Ok(Element::Position);
                }
                Element::Number(_) => return Err(A::Error::custom("a number is no position; write [x, y]")),
                Element::Position => has_positions = true,
                Element::List => {}
            }
            is_first = false;
        }
        if has_positions {
            found.ends.push(found.points.len());
        }
        Ok(Element::List)
    }
}

/// Passes over whatever is no value of the kind that is looked for.
macro_rules! others_are {
    ($default:expr; $($kind:ident),*) => {
        $(others_are!(@ $kind, $default);)*
    };
    (@ scalars, $default:expr) => {
        others_are!(@ numbers, $default);

        fn visit_i64<E: Error>(self, _: i64) -> Result<Self::Value, E> {
            Ok($default)
        }

        fn visit_u64<E: Error>(self, _: u64) -> Result<Self::Value, E> {
            Ok($default)
        }
    };
    (@ numbers, $default:expr) => {
        fn visit_bool<E: Error>(self, _: bool) -> Result<Self::Value, E> {
            Ok($default)
        }

        fn visit_f64<E: Error>(self, _: f64) -> Result<Self::Value, E> {
            Ok($default)
        }

        fn visit_unit<E: Error>(self) -> Result<Self::Value, E> {
            Ok($default)
        }
    };
    (@ text, $default:expr) => {
        fn visit_str<E: Error>(self, _: &str) -> Result<Self::Value, E> {
            Ok($default)
        }
    };
    (@ list, $default:expr) => {
        fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Self::Value, A::Error> {
            while seq.next_element::<IgnoredAny>()?.is_some() {}
            Ok($default)
        }
    };
    (@ map, $default:expr) => {
        fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
            while map.next_entry::<IgnoredAny, IgnoredAny>()?.is_some() {}
            Ok($default)
        }
    };
}

/// What is used of a feature's properties, of its classification, or of a coordinate system.
#[derive(Default)]
pub(super) struct Properties {
    name: Option<String>,
    stroke: Option<Color32>,
    color: Option<Color32>,
    class: Option<Box<Properties>>,
}

impl Properties {
    pub(super) fn name(&self) -> Option<&str> {
        self.name.as_deref().or_else(|| self.class.as_ref()?.name.as_deref())
    }

    pub(super) fn color(&self) -> Option<Color32> {
        self.stroke.or(self.color).or_else(|| self.class.as_ref()?.color)
    }
}

impl<'de> Deserialize<'de> for Properties {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Properties, D::Error> {
        struct OfMap;
        impl<'de> Visitor<'de> for OfMap {
            type Value = Properties;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("properties")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Properties, A::Error> {
                let mut properties = Properties::default();
                while let Some(key) = map.next_key::<String>()? {
                    match &*key {
                        "name" => properties.name = map.next_value::<Name>()?.0,
                        "stroke" => properties.stroke = map.next_value::<Color>()?.0,
                        "color" => properties.color = map.next_value::<Color>()?.0,
                        "classification" => properties.class = Some(Box::new(map.next_value()?)),
                        _ => drop(map.next_value::<IgnoredAny>()?),
                    }
                }
                Ok(properties)
            }

            others_are!(Properties::default(); scalars, text, list);
        }
        deserializer.deserialize_any(OfMap)
    }
}

/// A text, of which as much is kept as fits beside a shape.
struct Name(Option<String>);

impl<'de> Deserialize<'de> for Name {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Name, D::Error> {
        struct OfText;
        impl<'de> Visitor<'de> for OfText {
            type Value = Name;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a name")
            }

            fn visit_str<E: Error>(self, text: &str) -> Result<Name, E> {
                let on_a_line = |letter: char| if letter.is_control() { ' ' } else { letter };
                let mut name: String = text.chars().take(MOST_OF_NAME).map(on_a_line).collect();
                if text.chars().nth(MOST_OF_NAME).is_some() {
                    name.push('…');
                }
                Ok(Name(Some(name)))
            }

            others_are!(Name(None); scalars, list, map);
        }
        deserializer.deserialize_any(OfText)
    }
}

/// A colour as `#rrggbb` or as three numbers of 0 to 255; `None` if it is something else.
struct Color(Option<Color32>);

impl<'de> Deserialize<'de> for Color {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Color, D::Error> {
        struct OfColor;
        impl<'de> Visitor<'de> for OfColor {
            type Value = Color;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a colour")
            }

            fn visit_str<E: Error>(self, text: &str) -> Result<Color, E> {
                let digits = text.strip_prefix('#').filter(|digits| digits.len() == 6);
                let number = digits.and_then(|digits| u32::from_str_radix(digits, 16).ok());
                Ok(Color(number.map(|number| {
                    let [_, r, g, b] = number.to_be_bytes();
                    Color32::from_rgb(r, g, b)
                })))
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Color, A::Error> {
                let mut bytes = [None; 3];
                for place in &mut bytes {
                    *place = seq.next_element::<Byte>()?.and_then(|byte| byte.0);
                }
                while seq.next_element::<IgnoredAny>()?.is_some() {}
                let [Some(r), Some(g), Some(b)] = bytes else { return Ok(Color(None)) };
                Ok(Color(Some(Color32::from_rgb(r, g, b))))
            }

            others_are!(Color(None); scalars, map);
        }
        deserializer.deserialize_any(OfColor)
    }
}

/// A whole number of 0 to 255; `None` if it is something else.
struct Byte(Option<u8>);

impl<'de> Deserialize<'de> for Byte {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Byte, D::Error> {
        struct OfNumber;
        impl<'de> Visitor<'de> for OfNumber {
            type Value = Byte;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a number")
            }

            fn visit_i64<E: Error>(self, number: i64) -> Result<Byte, E> {
                Ok(Byte(u8::try_from(number).ok()))
            }

            fn visit_u64<E: Error>(self, number: u64) -> Result<Byte, E> {
                Ok(Byte(u8::try_from(number).ok()))
            }

            others_are!(Byte(None); numbers, text, list, map);
        }
        deserializer.deserialize_any(OfNumber)
    }
}

/// The member of a coordinate system: its name.
#[derive(Default)]
pub(super) struct Crs {
    pub(super) name: Option<String>,
}

impl<'de> Deserialize<'de> for Crs {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Crs, D::Error> {
        struct OfMap;
        impl<'de> Visitor<'de> for OfMap {
            type Value = Crs;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a coordinate system")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Crs, A::Error> {
                let mut crs = Crs::default();
                while let Some(key) = map.next_key::<String>()? {
                    match &*key {
                        "properties" => crs.name = map.next_value::<Properties>()?.name,
                        _ => drop(map.next_value::<IgnoredAny>()?),
                    }
                }
                Ok(crs)
            }

            others_are!(Crs::default(); scalars, text, list);
        }
        deserializer.deserialize_any(OfMap)
    }
}
