//! What a TIFF file says of its texels besides their values: where on the Earth they lie, how large they are,
//! and through which magnification they were seen.
//!
//! GeoTIFF says the first by tags, OME-TIFF by XML and Aperio's SVS by words, both in the description of
//! the first image; others say how many texels make a centimetre. Nothing is reprojected; what makes no
//! sense is left out.

mod kept;
mod ome;
mod words;

use std::path::Path;

use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

use super::TiffFile;
use super::entry::Directory;
use crate::image::InputFault;
pub(super) use ome::{OmeImage, OmeImages};

/// Tags.
const DESCRIPTION: u16 = 270;
const PIXEL_SCALE: u16 = 33550;
const TIEPOINT: u16 = 33922;
const TRANSFORMATION: u16 = 34264;
const GEO_KEYS: u16 = 34735;
const GEO_DOUBLES: u16 = 34736;
const GEO_TEXTS: u16 = 34737;
const METADATA: u16 = 42112;
const NODATA: u16 = 42113;
const SAMPLES: u16 = 277;
/// Bands that are listed.
const MOST_BANDS: u64 = 512;

/// Bytes of a description that are looked at, and of GeoTIFF's texts.
const MOST_TEXT: u64 = 1 << 20;
const MOST_GEO_TEXT: u64 = 1 << 14;
const MOST_GEO_KEYS: u64 = 4 * 1024;

/// What a TIFF file says of its texels besides their values.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct TiffAbout {
    /// Width and height of a texel of level 0.
    pub pixel_size: Option<PixelSize>,
    /// Where the image lies in a coordinate system of the Earth.
    pub place: Option<GeoPlace>,
    /// How many times an objective magnified what was scanned.
    pub magnification: Option<f64>,
    /// The bands of a texel, which are its samples, with the names that GDAL gives them.
    pub bands: Vec<Option<String>>,
    /// The value of texels where nothing is known, as GDAL writes it; it may be no number (NaN).
    pub nodata: Option<f64>,
    /// Metadata in words, for people: a name and a value each; a row without a name continues the one before.
    /// Kind of samples, maker and software, the values of the description (Aperio, OME-XML), GDAL's metadata,
    /// and the keys of GeoTIFF.
    pub words: Vec<(String, String)>,
}

impl TiffAbout {
    /// What a TIFF file says, of whatever kind its image is; `None` if a file is none or cannot be read as
    /// one. Reads its first directory.
    pub fn of_file(path: &Path) -> Option<TiffAbout> {
        let file = TiffFile::open(path).ok()??;
        let first = file.directory(file.first).ok()?;
        read(&file, &first).ok().map(|(_, about)| about)
    }
}

/// Width and height of a texel of level 0.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct PixelSize {
    /// Width and height, both positive, in [`PixelSize::unit`].
    pub size: [f64; 2],
    /// A unit of length as the file writes it: `µm` for slides; of a map `metre`, `degree`, or `unit` where
    /// the file does not say which.
    pub unit: String,
}

/// Where an image lies in a coordinate system of the Earth, as GeoTIFF says it.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct GeoPlace {
    /// Coordinates of a point of level 0, from its column `x` and row `y`, counted in texels from the upper
    /// left corner of the image: `[m[0] * x + m[1] * y + m[2], m[3] * x + m[4] * y + m[5]]`. Where the file
    /// places texels by their middles, this is moved by half a texel.
    pub from_texels: [f64; 6],
    /// The number of the coordinate system in EPSG's list.
    pub epsg: Option<u16>,
    /// What the file calls its coordinate system.
    pub name: Option<String>,
    /// Metres of the mean radius of the body that it lies on, (2a + b) / 3 of its ellipsoid, if the file says
    /// what that is: of the Moon and of Mars they do.
    pub radius: Option<f64>,
}

/// Which kind of file the first description is of.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Aperio,
    /// With the images that it names.
    Ome(OmeImages),
    Other,
}

/// What a directory says in words; see [`TiffAbout::words`].
pub(super) fn words_of(file: &TiffFile, directory: &Directory) -> Vec<(String, String)> {
    let description = directory.text(file, DESCRIPTION, MOST_TEXT).ok().flatten().unwrap_or_default();
    words::read(file, directory, &description)
}

/// Reads what the first directory says, and of which kind the file is.
pub(super) fn read(file: &TiffFile, first: &Directory) -> Result<(Kind, TiffAbout), InputFault> {
    let description = first.text(file, DESCRIPTION, MOST_TEXT)?.unwrap_or_default();
    let (nodata, bands) = (nodata(file, first)?, bands(file, first)?);
    let words = words::read(file, first, &description);
    let mut about = TiffAbout { nodata, bands, words, ..TiffAbout::default() };
    let kind = match description.trim_start() {
        text if text.starts_with("Aperio") => {
            aperio(&description, &mut about);
            Kind::Aperio
        }
        text if text.contains("<OME") => Kind::Ome(ome::read(&description, &mut about)),
        _ => {
            geo(file, first, &mut about)?;
            if about.place.is_none() {
                let size = words::micrometres(file, first);
                about.pixel_size = size.map(|size| PixelSize { size, unit: "µm".into() });
            }
            Kind::Other
        }
    };
    Ok((kind, about))
}

/// The bands of a texel, and their names among GDAL's metadata: `<Item name="DESCRIPTION" sample="0"
/// role="description">Red</Item>`.
fn bands(file: &TiffFile, first: &Directory) -> Result<Vec<Option<String>>, InputFault> {
    let count = first.number(file, SAMPLES)?.unwrap_or(1).min(MOST_BANDS);
    let mut bands = vec![None; count as usize];
    let text = first.text(file, METADATA, MOST_TEXT)?.unwrap_or_default();
    let mut reader = Reader::from_str(&text);
    let mut named = None;
    loop {
        match reader.read_event() {
            Ok(Event::Start(item)) => {
                let is_name = attribute(&item, "role").as_deref() == Some("description");
                named = attribute(&item, "sample").filter(|_| is_name).and_then(|n| n.parse::<usize>().ok());
            }
            Ok(Event::Text(text)) => {
                let band = named.take().and_then(|n| bands.get_mut(n));
                let text = String::from_utf8_lossy(&text).trim().to_owned();
                if let Some(band) = band.filter(|_| !text.is_empty()) {
                    *band = Some(text);
                }
            }
            Ok(Event::Eof) | Err(_) => return Ok(bands),
            Ok(_) => named = None,
        }
    }
}

/// The value of texels where nothing is known.
pub(super) fn nodata(file: &TiffFile, directory: &Directory) -> Result<Option<f64>, InputFault> {
    let text = directory.text(file, NODATA, 64)?;
    Ok(text.and_then(|text| text.trim().parse().ok()))
}

/// The words of the description of an image.
pub(super) fn description(file: &TiffFile, directory: &Directory) -> Result<String, InputFault> {
    Ok(directory.text(file, DESCRIPTION, 1 << 12)?.unwrap_or_default())
}

/// Of `MPP = 0.499|AppMag = 20` among words between bars.
fn aperio(text: &str, about: &mut TiffAbout) {
    let value = |name: &str| {
        let found = text.split('|').filter_map(|part| part.split_once('='));
        let mut named = found.filter(|(key, _)| key.trim() == name);
        named.next().and_then(|(_, value)| positive(value.trim().parse().ok()?))
    };
    about.magnification = value("AppMag");
    about.pixel_size = value("MPP").map(|side| PixelSize { size: [side; 2], unit: "µm".into() });
}

fn attribute(element: &BytesStart<'_>, name: &str) -> Option<String> {
    let found = element.try_get_attribute(name).ok()??;
    let text = String::from_utf8_lossy(&found.value);
    // What names no character stays as it is written.
    Some(quick_xml::escape::unescape(&text).map_or_else(|_| text.to_string(), |text| text.into_owned()))
}

fn positive(value: f64) -> Option<f64> {
    (value.is_finite() && value > 0.0).then_some(value)
}

/// GeoTIFF's tags.
fn geo(file: &TiffFile, first: &Directory, about: &mut TiffAbout) -> Result<(), InputFault> {
    let keys = first.numbers(file, GEO_KEYS, MOST_GEO_KEYS).unwrap_or_default();
    let texts = first.text(file, GEO_TEXTS, MOST_GEO_TEXT)?.unwrap_or_default();
    let key = |wanted: u64| {
        let found = keys.chunks_exact(4).skip(1).find(|key| key[0] == wanted && key[1] == 0);
        found.map(|key| key[3])
    };
    let text = |wanted: u64| {
        let key =
            keys.chunks_exact(4).skip(1).find(|key| key[0] == wanted && key[1] == u64::from(GEO_TEXTS))?;
        let (from, len) = (key[3] as usize, key[2] as usize);
        let found = texts.get(from..from.checked_add(len)?.min(texts.len()))?;
        let found = found.trim_end_matches('|').trim();
        let plain: String = found.chars().filter(|letter| !letter.is_control()).collect();
        (!plain.is_empty()).then_some(plain)
    };
    const IS_POINT: u64 = 2;
    let is_point = key(1025) == Some(IS_POINT);
    let Some(from_texels) = from_texels(file, first, is_point)? else { return Ok(()) };
    let [a, b, _, d, e, _] = from_texels;
    let size = [a.hypot(d), b.hypot(e)];
    // Angles where the model is of degrees, which most files leave to be understood.
    let unit = match (key(1024), key(3076)) {
        (Some(1), None | Some(9001)) => "metre",
        (Some(2), _) if key(2054).is_none_or(|unit| unit == 9102) => "degree",
        _ => "unit",
    };
    about.pixel_size =
        (size.iter().all(|side| positive(*side).is_some())).then(|| PixelSize { size, unit: unit.into() });
    const USER_DEFINED: u64 = 32767;
    let epsg = key(3072).or_else(|| key(2048)).filter(|code| (1024..USER_DEFINED).contains(code));
    let name = text(3073).or_else(|| text(1026)).or_else(|| text(2049));
    let radius = radius(file, first, &keys);
    about.place = Some(GeoPlace { from_texels, epsg: epsg.map(|code| code as u16), name, radius });
    Ok(())
}

/// The mean radius of the ellipsoid that GeoTIFF's keys name.
fn radius(file: &TiffFile, first: &Directory, keys: &[u64]) -> Option<f64> {
    let doubles = first.doubles(file, GEO_DOUBLES, MOST_GEO_KEYS).ok()?;
    let of = |wanted: u64| {
        let is_it = |key: &&[u64]| key[0] == wanted && key[1] == u64::from(GEO_DOUBLES);
        let place = keys.chunks_exact(4).skip(1).find(is_it)?[3];
        doubles.get(usize::try_from(place).ok()?).copied().filter(|value| value.is_finite())
    };
    let major = of(2057).and_then(positive)?;
    // Of a sphere the inverse of the flattening is written as 0.
    let flattened = || of(2059).filter(|inverse| *inverse > 1.0).map(|inverse| major - major / inverse);
    let minor = of(2058).and_then(positive).or_else(flattened).unwrap_or(major);
    positive((2.0 * major + minor) / 3.0)
}

/// From texels to coordinates, counted from corners; `None` if the file does not say.
fn from_texels(file: &TiffFile, first: &Directory, is_point: bool) -> Result<Option<[f64; 6]>, InputFault> {
    let matrix = first.doubles(file, TRANSFORMATION, 16)?;
    let (scale, tie) = (first.doubles(file, PIXEL_SCALE, 3)?, first.doubles(file, TIEPOINT, 6)?);
    let mut m = match (matrix.as_slice(), scale.as_slice(), tie.as_slice()) {
        (&[a, b, _, c, d, e, _, f, ..], _, _) => [a, b, c, d, e, f],
        (_, &[x, y, ..], &[column, row, _, east, north, _]) => {
            [x, 0.0, east - column * x, 0.0, -y, north + row * y]
        }
        _ => return Ok(None),
    };
    if is_point {
        // The places are those of the middles.
        m[2] -= 0.5 * (m[0] + m[1]);
        m[5] -= 0.5 * (m[3] + m[4]);
    }
    Ok(m.iter().all(|value| value.is_finite()).then_some(m))
}
