//! What the first directory of a TIFF file says in words, for people: what its samples are, who made it and
//! by what, its description, the metadata of GDAL and the keys of GeoTIFF, by the names that their standards
//! give them.
//!
//! Nothing here decides how a file is read. What lies beyond the end of the file or makes no sense is left
//! out, and what is long is cut off, with a word that says so.

use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

use super::super::TiffFile;
use super::super::entry::Directory;
use super::{GEO_DOUBLES, GEO_KEYS, GEO_TEXTS, METADATA, MOST_GEO_KEYS, MOST_GEO_TEXT, MOST_TEXT, attribute};

/// Bytes of a text that are shown.
const MOST_SHOWN: usize = 4096;
/// Rows of a description, and of metadata.
const MOST_ROWS: usize = 256;
/// Tags of numbers.
const BITS: u16 = 258;
const PHOTOMETRIC: u16 = 262;
const SAMPLES: u16 = 277;
const X_RESOLUTION: u16 = 282;
const Y_RESOLUTION: u16 = 283;
const PLANAR: u16 = 284;
const RESOLUTION_UNIT: u16 = 296;
const SAMPLE_FORMAT: u16 = 339;
/// A value of ResolutionUnit.
const CENTIMETRE: u64 = 3;
/// Tags of one text each.
const TEXTS: [(u16, &str); 10] = [
    (269, "document"),
    (285, "page name"),
    (271, "made by"),
    (272, "model"),
    (305, "software"),
    (306, "date"),
    (315, "artist"),
    (316, "computer"),
    (33432, "copyright"),
    (50838, "ImageJ"),
];
/// Elements of OME-XML of which there is one for every plane.
const OF_PLANES: [&[u8]; 3] = [b"TiffData", b"Plane", b"UUID"];

/// Rows of a name and a value; a row without a name goes on with the one before it.
type Rows = Vec<(String, String)>;

/// Reads what a directory says in words; `description` is its tag of that name.
pub(super) fn read(file: &TiffFile, first: &Directory, description: &str) -> Rows {
    let mut rows = Rows::new();
    let mut add = |name: &str, value: String| rows.push((name.to_owned(), value));
    add("samples", samples(file, first));
    if let Some(resolution) = resolution(file, first) {
        add("resolution", resolution);
    }
    for (tag, name) in TEXTS {
        let text = first.text(file, tag, MOST_SHOWN as u64 + 1).ok().flatten().unwrap_or_default();
        if !text.trim().is_empty() {
            add(name, shown(&text));
        }
    }
    match description.trim() {
        "" => {}
        text if text.starts_with("Aperio") => words_of_aperio(text, &mut rows),
        text if text.contains("<OME") => words_of_ome(text, &mut rows),
        text => rows.push(("description".to_owned(), shown(text))),
    }
    let metadata = first.text(file, METADATA, MOST_TEXT).ok().flatten().unwrap_or_default();
    words_of_gdal(&metadata, &mut rows);
    words_of_geo(file, first, &mut rows);
    rows
}

/// How many samples a texel has, what they are, and what they mean.
fn samples(file: &TiffFile, first: &Directory) -> String {
    let number = |tag, missing| first.number(file, tag).ok().flatten().unwrap_or(missing);
    let (count, bits) = (number(SAMPLES, 1), number(BITS, 1));
    let kind = match number(SAMPLE_FORMAT, 1) {
        1 => "whole numbers",
        2 => "signed whole numbers",
        3 => "floats",
        5 | 6 => "complex numbers",
        _ => "of no stated kind",
    };
    let meaning = match first.number(file, PHOTOMETRIC).ok().flatten() {
        Some(0) => "grey, white is 0",
        Some(1) => "grey, black is 0",
        Some(2) => "RGB",
        Some(3) => "a palette",
        Some(4) => "a mask",
        Some(5) => "CMYK",
        Some(6) => "YCbCr",
        Some(8) => "CIE L*a*b*",
        Some(other) => return format!("{count} of {bits} bits, {kind}, photometric interpretation {other}"),
        None => "of no stated meaning",
    };
    let planes = if count > 1 && number(PLANAR, 1) == 2 { ", in planes" } else { "" };
    format!("{count} of {bits} bits, {kind}, {meaning}{planes}")
}

/// Texels along a unit of length, across and down, and the number of the unit.
fn resolution_of(file: &TiffFile, first: &Directory) -> Option<([f64; 2], u64)> {
    const INCH: u64 = 2;
    let ratio = |tag| {
        let bytes = first.raw(file, tag, 8).ok()??;
        let [over, under] = [bytes.get(..4)?, bytes.get(4..8)?].map(|part| file.whole(part) as f64);
        let ratio = over / under;
        (ratio.is_finite() && ratio > 0.0).then_some(ratio)
    };
    let unit = first.number(file, RESOLUTION_UNIT).ok().flatten().unwrap_or(INCH);
    Some(([ratio(X_RESOLUTION)?, ratio(Y_RESOLUTION)?], unit))
}

/// Width and height of a texel in micrometres, if a file says how many make a centimetre, as microscopes and
/// slide scanners write it. Inches are those of a page that was scanned or shall be printed, and so are
/// centimetres that have few texels: libvips writes the resolution of photographs by the centimetre.
pub(super) fn micrometres(file: &TiffFile, first: &Directory) -> Option<[f64; 2]> {
    /// Some 2400 to an inch: the most that pages are printed with.
    const OF_PAGES: f64 = 945.0;
    let (per_centimetre, unit) = resolution_of(file, first)?;
    let is_finer = per_centimetre.iter().all(|count| *count > OF_PAGES);
    (unit == CENTIMETRE && is_finer).then(|| per_centimetre.map(|count| 10_000.0 / count))
}

/// Texels in an inch or a centimetre.
fn resolution(file: &TiffFile, first: &Directory) -> Option<String> {
    let (per_unit, unit) = resolution_of(file, first)?;
    let unit = match unit {
        1 => "of no unit",
        CENTIMETRE => "texels a centimetre",
        _ => "texels an inch",
    };
    let [x, y] = per_unit.map(|count| (count * 1e4).round() / 1e4);
    // Without a unit all that is said is how wide texels are by their height.
    if x == y && unit == "of no unit" {
        return None;
    }
    Some(if x == y { format!("{x} {unit}") } else { format!("{x} x {y} {unit}") })
}

/// A text as it is shown: without what controls a terminal, and no longer than [`MOST_SHOWN`].
fn shown(text: &str) -> String {
    let text = text.trim();
    let end = (0..=MOST_SHOWN.min(text.len())).rev().find(|end| text.is_char_boundary(*end)).unwrap_or(0);
    let plain = |c: char| if c == '\n' || !c.is_control() { Some(c) } else { (c == '\t').then_some(' ') };
    let mut shown: String = text[..end].chars().filter_map(plain).collect();
    if end < text.len() {
        shown.push_str(" … and more");
    }
    shown
}

/// Rows under names of their own, as many as are shown.
fn add_all(rows: &mut Rows, found: Rows) {
    let left = found.len().saturating_sub(MOST_ROWS);
    rows.extend(found.into_iter().take(MOST_ROWS));
    if left > 0 {
        rows.push((String::new(), format!("… and {left} more")));
    }
}

/// Lines of words, then names and values between bars.
fn words_of_aperio(text: &str, rows: &mut Rows) {
    let mut parts = text.split('|');
    rows.push(("description".to_owned(), shown(parts.next().unwrap_or_default())));
    let named = parts.filter_map(|part| part.split_once('='));
    add_all(rows, named.map(|(name, value)| (shown(name), shown(value))).collect());
}

/// The attributes and texts of elements, by the name of the element and of the attribute.
fn words_of_ome(text: &str, rows: &mut Rows) {
    let mut reader = Reader::from_str(text);
    let (mut found, mut open) = (Rows::new(), Vec::<String>::new());
    let is_of_planes = |name: &str| OF_PLANES.contains(&name.as_bytes());
    loop {
        match reader.read_event() {
            Ok(Event::Start(element)) => {
                let name = local(&element);
                if !is_of_planes(&name) {
                    attributes_of(&element, &name, &mut found);
                }
                open.push(name);
            }
            Ok(Event::Empty(element)) => {
                let name = local(&element);
                if !is_of_planes(&name) {
                    attributes_of(&element, &name, &mut found);
                }
            }
            Ok(Event::Text(words)) => {
                let words = shown(&String::from_utf8_lossy(&words));
                if let Some(name) = open.last().filter(|name| !words.is_empty() && !is_of_planes(name)) {
                    found.push((name.clone(), words));
                }
            }
            Ok(Event::End(_)) => drop(open.pop()),
            Ok(Event::Eof) | Err(_) => break,
            Ok(_) => {}
        }
    }
    add_all(rows, found);
}

fn local(element: &BytesStart<'_>) -> String {
    shown(&String::from_utf8_lossy(element.local_name().as_ref()))
}

fn attributes_of(element: &BytesStart<'_>, name: &str, found: &mut Rows) {
    for attribute in element.attributes().flatten() {
        let key = String::from_utf8_lossy(attribute.key.as_ref()).into_owned();
        // Which schema it is says nothing of the image.
        if key.starts_with("xmlns") || key.starts_with("xsi:") {
            continue;
        }
        let raw = String::from_utf8_lossy(&attribute.value);
        let value =
            quick_xml::escape::unescape(&raw).map_or_else(|_| raw.to_string(), |text| text.into_owned());
        found.push((format!("{name} {}", shown(&key)), shown(&value)));
    }
}

/// GDAL's items: `<Item name="AREA_OR_POINT" sample="0">Area</Item>`.
fn words_of_gdal(text: &str, rows: &mut Rows) {
    let mut reader = Reader::from_str(text);
    let (mut found, mut named) = (Rows::new(), None);
    loop {
        match reader.read_event() {
            Ok(Event::Start(item)) if item.local_name().as_ref() == b"Item" => {
                let band = attribute(&item, "sample").and_then(|n| n.parse::<u64>().ok());
                let band = band.map_or_else(String::new, |n| format!(" of band {}", n.saturating_add(1)));
                named = attribute(&item, "name").map(|name| shown(&name) + &band);
            }
            Ok(Event::Text(value)) => {
                let value = shown(&String::from_utf8_lossy(&value));
                found.extend(named.take().filter(|_| !value.is_empty()).map(|name| (name, value)));
            }
            Ok(Event::Eof) | Err(_) => break,
            Ok(_) => {}
        }
    }
    add_all(rows, found);
}

/// GeoTIFF's keys: numbers, and texts and doubles of two tags of their own.
fn words_of_geo(file: &TiffFile, first: &Directory, rows: &mut Rows) {
    let keys = first.numbers(file, GEO_KEYS, MOST_GEO_KEYS).unwrap_or_default();
    let texts = first.text(file, GEO_TEXTS, MOST_GEO_TEXT).ok().flatten().unwrap_or_default();
    let doubles = first.doubles(file, GEO_DOUBLES, MOST_GEO_KEYS).unwrap_or_default();
    let mut found = Rows::new();
    for &[key, place, count, value] in keys.as_chunks::<4>().0.iter().skip(1) {
        let (from, count) = (value as usize, count as usize);
        let end = from.saturating_add(count);
        let said = match u16::try_from(place).unwrap_or(u16::MAX) {
            0 => value_of_key(key, value),
            GEO_TEXTS => {
                let text = texts.get(from..end.min(texts.len())).unwrap_or_default();
                shown(text.trim_end_matches('|'))
            }
            GEO_DOUBLES => {
                let numbers = doubles.get(from..end.min(doubles.len())).unwrap_or_default();
                numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(", ")
            }
            _ => continue,
        };
        let name = GEO_KEY_NAMES.binary_search_by_key(&key, |(key, _)| u64::from(*key));
        let name = name.map_or_else(|_| format!("GeoKey {key}"), |at| GEO_KEY_NAMES[at].1.to_owned());
        found.extend((!said.is_empty()).then_some((name, said)));
    }
    add_all(rows, found);
}

/// The value of a key that is a number, in words where it is one of a short list.
fn value_of_key(key: u64, value: u64) -> String {
    const USER_DEFINED: u64 = 32767;
    let word = match (key, value) {
        (1024, 1) => "projected",
        (1024, 2) => "geographic",
        (1024, 3) => "geocentric",
        (1025, 1) => "texels are areas",
        (1025, 2) => "texels are points",
        (2052 | 3076 | 4099, 9001) => "metre",
        (2052 | 3076 | 4099, 9002) => "foot",
        (2052 | 3076 | 4099, 9003) => "US survey foot",
        (2054 | 2060, 9101) => "radian",
        (2054 | 2060, 9102) => "degree",
        (2048 | 3072 | 4096, 1024..USER_DEFINED) => return format!("EPSG:{value}"),
        (_, USER_DEFINED) => "defined by the file",
        _ => return value.to_string(),
    };
    format!("{word} ({value})")
}

/// The names of keys in OGC's GeoTIFF 1.1, by their numbers.
const GEO_KEY_NAMES: [(u16, &str); 46] = [
    (1024, "GTModelType"),
    (1025, "GTRasterType"),
    (1026, "GTCitation"),
    (2048, "GeodeticCRS"),
    (2049, "GeodeticCitation"),
    (2050, "GeodeticDatum"),
    (2051, "PrimeMeridian"),
    (2052, "GeogLinearUnits"),
    (2053, "GeogLinearUnitSize"),
    (2054, "GeogAngularUnits"),
    (2055, "GeogAngularUnitSize"),
    (2056, "Ellipsoid"),
    (2057, "EllipsoidSemiMajorAxis"),
    (2058, "EllipsoidSemiMinorAxis"),
    (2059, "EllipsoidInvFlattening"),
    (2060, "GeogAzimuthUnits"),
    (2061, "PrimeMeridianLongitude"),
    (2062, "GeogTOWGS84"),
    (3072, "ProjectedCRS"),
    (3073, "ProjectedCitation"),
    (3074, "Projection"),
    (3075, "ProjMethod"),
    (3076, "ProjLinearUnits"),
    (3077, "ProjLinearUnitSize"),
    (3078, "ProjStdParallel1"),
    (3079, "ProjStdParallel2"),
    (3080, "ProjNatOriginLong"),
    (3081, "ProjNatOriginLat"),
    (3082, "ProjFalseEasting"),
    (3083, "ProjFalseNorthing"),
    (3084, "ProjFalseOriginLong"),
    (3085, "ProjFalseOriginLat"),
    (3086, "ProjFalseOriginEasting"),
    (3087, "ProjFalseOriginNorthing"),
    (3088, "ProjCenterLong"),
    (3089, "ProjCenterLat"),
    (3090, "ProjCenterEasting"),
    (3091, "ProjCenterNorthing"),
    (3092, "ProjScaleAtNatOrigin"),
    (3093, "ProjScaleAtCenter"),
    (3094, "ProjAzimuthAngle"),
    (3095, "ProjStraightVertPoleLong"),
    (4096, "Vertical"),
    (4097, "VerticalCitation"),
    (4098, "VerticalDatum"),
    (4099, "VerticalUnits"),
];

#[cfg(test)]
mod tests {
    use super::*;

    fn row(name: &str, value: &str) -> (String, String) {
        (name.to_owned(), value.to_owned())
    }

    #[test]
    fn descriptions_are_cut_into_names_and_values() {
        let mut rows = Rows::new();
        words_of_aperio(
            "Aperio Image\r\n46000x32914 (256x256)|AppMag = 20|Date = 12/29/09|broken",
            &mut rows,
        );
        let expected = [
            row("description", "Aperio Image\n46000x32914 (256x256)"),
            row("AppMag", "20"),
            row("Date", "12/29/09"),
        ];
        assert_eq!(rows, expected);
        let mut rows = Rows::new();
        let ome = r#"<OME xmlns="a" Creator="b"><Image Name="c &amp; d"><AcquisitionDate>2020</AcquisitionDate>
            <Pixels SizeX="9"><TiffData IFD="0"><UUID FileName="f">u</UUID></TiffData></Pixels></Image></OME>"#;
        words_of_ome(ome, &mut rows);
        let expected = [
            row("OME Creator", "b"),
            row("Image Name", "c & d"),
            row("AcquisitionDate", "2020"),
            row("Pixels SizeX", "9"),
        ];
        assert_eq!(rows, expected);
        let mut rows = Rows::new();
        let gdal =
            r#"<GDALMetadata><Item name="A">1</Item><Item name="B" sample="1">x</Item></GDALMetadata>"#;
        words_of_gdal(gdal, &mut rows);
        assert_eq!(rows, [row("A", "1"), row("B of band 2", "x")]);
    }

    #[test]
    fn what_is_long_is_cut_off_and_says_so() {
        let long = "µ".repeat(MOST_SHOWN);
        let cut = shown(&long);
        assert!(cut.len() < MOST_SHOWN + 20 && cut.ends_with("… and more"));
        assert_eq!(shown("a\x1b[31m\tb\n"), "a[31m b");
        let mut rows = Rows::new();
        words_of_aperio(&format!("Aperio{}", "|a=b".repeat(1000)), &mut rows);
        assert_eq!(rows.len(), 2 + MOST_ROWS);
        assert_eq!(rows.last(), Some(&row("", "… and 744 more")));
    }

    #[test]
    fn keys_have_their_names() {
        assert!(GEO_KEY_NAMES.is_sorted_by_key(|(key, _)| *key));
        assert_eq!(value_of_key(1025, 2), "texels are points (2)");
        assert_eq!(value_of_key(3072, 32633), "EPSG:32633");
        assert_eq!(value_of_key(3072, 32767), "defined by the file (32767)");
        assert_eq!(value_of_key(2050, 6326), "6326");
    }
}
