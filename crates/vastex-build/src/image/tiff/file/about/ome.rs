//! What OME-XML, the description of the first image of an OME-TIFF, says: the size of texels, the
//! magnification, and which images of the file are called what.
//!
//! The text may be cut off, and what makes no sense of it is left out. Planes that lie in other files are no
//! images of this one.

use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

use super::{PixelSize, TiffAbout, attribute, positive};

/// Images that are listed. A plate has thousands, of which no name is looked for.
const MOST_IMAGES: usize = 1024;
/// Bytes of a name that are kept.
const MOST_NAME: usize = 200;

/// An image that OME-XML names.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(in super::super) struct OmeImage {
    /// What it is called.
    pub(in super::super) name: Option<String>,
    /// The directories of the chain that are its planes, counted from 0: a first one each, and how many.
    planes: Vec<[u64; 2]>,
}

/// The images that OME-XML names, in its order.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(in super::super) struct OmeImages(Vec<OmeImage>);

impl OmeImages {
    /// The image that a directory of the chain, counted from 0, is a plane of, where it is another one than
    /// the first.
    pub(in super::super) fn other_of(&self, directory: usize) -> Option<&OmeImage> {
        let has = |image: &&OmeImage| {
            image
                .planes
                .iter()
                .any(|[first, count]| (*first..first.saturating_add(*count)).contains(&(directory as u64)))
        };
        let found = self.0.iter().position(|image| has(&image)).filter(|number| *number > 0)?;
        self.0.get(found)
    }
}

impl OmeImage {
    /// What an image of a slide is by its name, as Bio-Formats (`label image`, `macro image`) and others give
    /// it; `None` of other names.
    pub(in super::super) fn role(&self) -> Option<&'static str> {
        let name = self.name.as_ref()?.to_lowercase();
        let has =
            |wanted: &[&str]| name.split(|c: char| !c.is_alphanumeric()).any(|word| wanted.contains(&word));
        match () {
            () if has(&["label"]) => Some("label"),
            () if has(&["macro", "overview"]) => Some("macro"),
            () if has(&["thumbnail", "thumb"]) => Some("thumbnail"),
            () => None,
        }
    }
}

/// Reads the size of texels and the magnification of the first image, and which images there are.
pub(super) fn read(text: &str, about: &mut TiffAbout) -> OmeImages {
    let mut reader = Reader::from_str(text);
    let mut images: Vec<OmeImage> = Vec::new();
    let (mut of_file, mut is_uuid) = (None, false);
    loop {
        match reader.read_event() {
            Ok(Event::Start(element)) => {
                is_uuid = element.local_name().as_ref() == b"UUID";
                take(&element, about, &mut images, &mut of_file);
            }
            Ok(Event::Empty(element)) => take(&element, about, &mut images, &mut of_file),
            Ok(Event::Text(uuid)) if is_uuid => {
                let uuid = String::from_utf8_lossy(&uuid);
                let is_other = of_file.as_ref().is_some_and(|own: &String| own.trim() != uuid.trim());
                if let Some(image) = images.last_mut().filter(|_| is_other) {
                    image.planes.pop();
                }
            }
            Ok(Event::Eof) | Err(_) => return OmeImages(images),
            Ok(_) => is_uuid = false,
        }
    }
}

fn take(
    element: &BytesStart<'_>,
    about: &mut TiffAbout,
    images: &mut Vec<OmeImage>,
    of_file: &mut Option<String>,
) {
    match element.local_name().as_ref() {
        b"OME" => *of_file = attribute(element, "UUID"),
        b"Image" if images.len() < MOST_IMAGES => {
            let name = attribute(element, "Name").map(|name| shortened(name.trim()));
            images.push(OmeImage { name: name.filter(|name| !name.is_empty()), planes: Vec::new() });
        }
        b"Pixels" if images.len() <= 1 => {
            about.pixel_size = about.pixel_size.take().or_else(|| pixel_size(element));
        }
        b"Objective" if images.is_empty() => {
            let found = attribute(element, "NominalMagnification");
            about.magnification = about.magnification.or(found.and_then(|text| positive(text.parse().ok()?)));
        }
        b"TiffData" => {
            let number = |name| attribute(element, name)?.trim().parse::<u64>().ok();
            // Without a directory the planes are those from the first on, which are the first image's.
            if let (Some(image), Some(first)) = (images.last_mut(), number("IFD")) {
                image.planes.push([first, number("PlaneCount").unwrap_or(1)]);
            }
        }
        _ => {}
    }
}

fn pixel_size(pixels: &BytesStart<'_>) -> Option<PixelSize> {
    let side = |name| positive(attribute(pixels, name)?.parse().ok()?);
    let unit = attribute(pixels, "PhysicalSizeXUnit").unwrap_or_else(|| "µm".into());
    let y_unit = attribute(pixels, "PhysicalSizeYUnit").unwrap_or_else(|| "µm".into());
    let size = [side("PhysicalSizeX")?, side("PhysicalSizeY")?];
    let plain = |unit: String| unit.chars().filter(|letter| !letter.is_control()).collect();
    (unit == y_unit).then(|| PixelSize { size, unit: plain(unit) })
}

fn shortened(name: &str) -> String {
    let end = (0..=MOST_NAME.min(name.len())).rev().find(|end| name.is_char_boundary(*end)).unwrap_or(0);
    name[..end].to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    const SLIDE: &str = r#"<?xml version="1.0"?>
        <OME UUID="urn:uuid:1"><Instrument><Objective NominalMagnification="40.0"/></Instrument>
        <Image Name="scan"><Pixels PhysicalSizeX="0.25" PhysicalSizeY="0.5" PhysicalSizeXUnit="µm"
            PhysicalSizeYUnit="µm"><TiffData IFD="0" PlaneCount="3"/></Pixels></Image>
        <Image Name="Label Image"><Pixels PhysicalSizeX="9" PhysicalSizeY="9"><TiffData IFD="3"><UUID
            FileName="a.ome.tif">urn:uuid:1</UUID></TiffData></Pixels></Image>
        <Image Name="macro image"><Pixels><TiffData IFD="4"><UUID FileName="b">urn:uuid:2</UUID></TiffData>
            <TiffData IFD="5"><UUID FileName="a.ome.tif">urn:uuid:1</UUID></TiffData></Pixels></Image>
        <Image Name="labels of nuclei"><Pixels><TiffData IFD="6"/></Pixels></Image><Image><Pix"#;

    #[test]
    fn images_are_told_apart_by_their_directories() {
        let mut about = TiffAbout::default();
        let images = read(SLIDE, &mut about);
        let role = |directory| images.other_of(directory).map(|image| (image.role(), image.name.clone()));
        assert_eq!([0, 1, 2, 4, 7].map(role), [const { None }; 5]);
        assert_eq!(role(3), Some((Some("label"), Some("Label Image".into()))));
        assert_eq!(role(5), Some((Some("macro"), Some("macro image".into()))));
        assert_eq!(role(6), Some((None, Some("labels of nuclei".into()))));
        let pixel = about.pixel_size.unwrap();
        assert_eq!((pixel.size, pixel.unit.as_str(), about.magnification), ([0.25, 0.5], "µm", Some(40.0)));
    }

    #[test]
    fn a_unit_controls_no_terminal() {
        let mut about = TiffAbout::default();
        let text = "<OME><Image><Pixels PhysicalSizeX='1' PhysicalSizeY='1' PhysicalSizeXUnit='\u{1b}m' \
                    PhysicalSizeYUnit='\u{1b}m'/></Image></OME>";
        read(text, &mut about);
        assert_eq!(about.pixel_size.unwrap().unit, "m");
    }

    #[test]
    fn roles_are_words_of_names() {
        for (name, role) in [
            ("macro image", Some("macro")),
            ("slide.svs [label]", Some("label")),
            ("Overview", Some("macro")),
            ("thumbnail image", Some("thumbnail")),
            ("labels", None),
            ("macrophages", None),
            ("", None),
        ] {
            let image = OmeImage { name: Some(name.into()), ..OmeImage::default() };
            assert_eq!(image.role(), role, "{name}");
        }
        assert_eq!(shortened(&"µ".repeat(150)).len(), 200);
    }

    #[test]
    fn planes_beyond_all_measure_are_planes() {
        let text =
            format!(r#"<OME><Image/><Image Name="label"><TiffData IFD="2" PlaneCount="{}"/>"#, u64::MAX);
        let images = read(&text, &mut TiffAbout::default());
        assert!(images.other_of(1).is_none() && images.other_of(2).is_some());
    }
}
