//! What the pages of a stack are, by the description of the first one: OME-XML, or ImageJ's lines.

use quick_xml::events::Event;
use quick_xml::{Reader, XmlVersion};

use crate::units::{self, OneUnit};
use crate::volume::VolumeChannel;

/// Which axis the pages of a stack count first: the others follow.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct PageOrder {
    /// Of `Z`, `C` and `T`, the slowest first.
    pub(super) slowest_first: [char; 3],
}

impl PageOrder {
    /// Of OME's DimensionOrder, XYZCT for one; `None` of other words.
    fn of_ome(text: &str) -> Option<PageOrder> {
        let rest: Vec<char> = text.strip_prefix("XY")?.chars().collect();
        let mut sorted = rest.clone();
        sorted.sort_unstable();
        let order = <[char; 3]>::try_from(rest).ok().filter(|_| sorted == ['C', 'T', 'Z'])?;
        Some(PageOrder { slowest_first: [order[2], order[1], order[0]] })
    }

    /// Pages along each axis, the slowest first.
    pub(super) fn shape(self, times: u64, channels: u64, slices: u64) -> [u64; 3] {
        self.slowest_first.map(|axis| match axis {
            'T' => times,
            'C' => channels,
            _ => slices,
        })
    }

    /// The place of an axis among them.
    pub(super) fn place(self, axis: char) -> usize {
        self.slowest_first.iter().position(|other| *other == axis).unwrap_or(0)
    }
}

/// What tags of the first page say, beside its description.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct PageTags {
    /// Colours within each page, or 1.
    pub(super) samples: u64,
    /// Pixels in a unit along x and y.
    pub(super) pixels: [Option<f64>; 2],
    /// That unit, where it is one of length.
    pub(super) unit: Option<&'static str>,
}

/// What the pages are.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct StackAbout {
    pub(super) channels: u64,
    pub(super) slices: u64,
    pub(super) times: u64,
    pub(super) order: PageOrder,
    pub(super) scale: [f64; 3],
    pub(super) unit: Option<String>,
    pub(super) names: Vec<VolumeChannel>,
}

/// Returns true if a description is OME's or ImageJ's: pages without one may be anything.
pub(super) fn says_stack(description: &str) -> bool {
    let trimmed = description.trim_start_matches('\u{feff}').trim_start();
    trimmed.starts_with("ImageJ=") || trimmed.contains("<OME")
}

/// Elements of OME-XML that are looked at: the first image comes first.
const MOST_ELEMENTS: usize = 100_000;
/// Channels whose names are kept.
const MOST_CHANNELS: usize = 4096;

impl StackAbout {
    /// Layers, and nothing else.
    fn layers(count: u64) -> StackAbout {
        StackAbout {
            channels: 1,
            slices: count,
            times: 1,
            order: PageOrder { slowest_first: ['T', 'C', 'Z'] },
            scale: [1.0; 3],
            unit: None,
            names: Vec::new(),
        }
    }

    /// Of so many pages, by a description and the tags beside it. Where its numbers make another number of
    /// pages, all are layers, and that is said.
    pub(super) fn read(
        description: &str,
        count: u64,
        tags: &PageTags,
        oddities: &mut Vec<String>,
    ) -> StackAbout {
        let trimmed = description.trim_start_matches('\u{feff}').trim_start();
        let found = if trimmed.starts_with("ImageJ=") {
            Some(of_imagej(trimmed, count, tags, oddities))
        } else if trimmed.starts_with('<') && trimmed.contains("OME") {
            of_ome(trimmed, oddities)
        } else {
            None
        };
        let Some(found) = found else { return StackAbout::layers(count) };
        let makes = |channels: u64| {
            let sides = [channels, found.slices, found.times];
            sides.iter().try_fold(1_u64, |a, b| a.checked_mul(*b)) == Some(count)
        };
        if makes(found.channels) {
            return found;
        }
        // Channels count the colours within a page, too.
        let of_pages = found.channels / tags.samples.max(1);
        if of_pages * tags.samples == found.channels && makes(of_pages) {
            return StackAbout { channels: of_pages, ..found };
        }
        oddities.push(format!(
            "the description makes {} channels, {} layers and {} times, and there are {count} pages; all are taken for layers",
            found.channels, found.slices, found.times
        ));
        StackAbout { scale: found.scale, unit: found.unit, ..StackAbout::layers(count) }
    }
}

fn of_imagej(text: &str, count: u64, tags: &PageTags, oddities: &mut Vec<String>) -> StackAbout {
    let value = |key: &str| text.lines().find_map(|line| line.strip_prefix(key)?.strip_prefix('='));
    let number = |key: &str| value(key).and_then(|text| text.trim().parse::<u64>().ok()).filter(|n| *n > 0);
    let (channels, times) = (number("channels").unwrap_or(1), number("frames").unwrap_or(1));
    let rest = count / channels.saturating_mul(times).max(1);
    let slices = number("slices").unwrap_or(rest.max(1));
    let spacing = value("spacing").and_then(|text| text.trim().parse::<f64>().ok()).map(f64::abs);
    let spacing = spacing.filter(|step| step.is_normal());
    let unit = |key: &str| {
        let unit = value(key)?.trim().replace("\\u00B5", "µ");
        (!unit.is_empty()).then_some(unit)
    };
    // Tags count pixels in the unit that the description names, whatever theirs is. Of files without one 72
    // in an inch are what printers are told, and say nothing of what is seen.
    let named = unit("unit");
    let is_of_printers = named.is_none()
        && tags.unit == Some("inch")
        && tags.pixels.iter().flatten().all(|pixels| (pixels - 72.0).abs() < 1e-3);
    let pixels = if is_of_printers { [None; 2] } else { tags.pixels };
    let [x, y] = pixels.map(|pixels| pixels.map(f64::recip).filter(|side| side.is_normal() && *side > 0.0));
    let of_tags = || tags.unit.filter(|_| x.is_some()).map(str::to_owned);
    let unit_of_x = named.or_else(of_tags);
    let [unit_of_y, unit_of_z] =
        [("yunit", y), ("zunit", spacing)].map(|(key, side)| side.and_then(|_| unit(key)));
    let scale = [x.or(y), y.or(x), spacing].map(|side| side.unwrap_or(1.0));
    let (scale, unit) = in_one(&[unit_of_x, unit_of_y, unit_of_z], scale, oddities);
    StackAbout {
        channels,
        slices,
        times,
        order: PageOrder { slowest_first: ['T', 'Z', 'C'] },
        scale,
        unit,
        names: Vec::new(),
    }
}

/// Sides of a voxel in one unit, the one of the first axis that names one.
fn in_one(
    units: &[Option<String>; 3],
    scale: [f64; 3],
    oddities: &mut Vec<String>,
) -> ([f64; 3], Option<String>) {
    let OneUnit { unit, factors, oddities: odd } = units::one_unit(units);
    oddities.extend(odd);
    (std::array::from_fn(|axis| scale[axis] * factors[axis]), unit)
}

fn of_ome(text: &str, oddities: &mut Vec<String>) -> Option<StackAbout> {
    let mut reader = Reader::from_str(text);
    let mut found: Option<StackAbout> = None;
    for _ in 0..MOST_ELEMENTS {
        let element = match reader.read_event() {
            Ok(Event::Start(element) | Event::Empty(element)) => element,
            Ok(Event::End(end)) if end.local_name().as_ref() == b"Pixels" => return found,
            Ok(Event::Eof) | Err(_) => return found,
            Ok(_) => continue,
        };
        let attribute = |name: &str| {
            let attribute = element.try_get_attribute(name).ok().flatten()?;
            // A unit may be written as &#181;m.
            let value = attribute.normalized_value(XmlVersion::Implicit1_0).ok();
            Some(value.unwrap_or_else(|| String::from_utf8_lossy(&attribute.value)).into_owned())
        };
        match (element.local_name().as_ref(), &mut found) {
            (b"Pixels", None) => {
                let count =
                    |name: &str| attribute(name).and_then(|text| text.parse::<u64>().ok()).filter(|n| *n > 0);
                let side = |name: &str| {
                    attribute(name)
                        .and_then(|text| text.parse::<f64>().ok())
                        .filter(|side| side.is_normal() && *side > 0.0)
                };
                let sides = ["PhysicalSizeX", "PhysicalSizeY", "PhysicalSizeZ"].map(side);
                // OME's default.
                let unit = |name: &str| attribute(name).unwrap_or("µm".into());
                let units = ["PhysicalSizeXUnit", "PhysicalSizeYUnit", "PhysicalSizeZUnit"];
                let units = std::array::from_fn(|axis| sides[axis].map(|_| unit(units[axis])));
                let (scale, unit) = in_one(&units, sides.map(|side| side.unwrap_or(1.0)), oddities);
                found = Some(StackAbout {
                    channels: count("SizeC")?,
                    slices: count("SizeZ")?,
                    times: count("SizeT")?,
                    order: PageOrder::of_ome(&attribute("DimensionOrder")?)?,
                    scale,
                    unit,
                    names: Vec::new(),
                });
            }
            (b"Channel", Some(found)) if found.names.len() < MOST_CHANNELS => {
                // A signed number: red, green, blue, alpha from the top.
                let color = attribute("Color").and_then(|text| text.parse::<i32>().ok());
                let color = color.map(|color| [24, 16, 8].map(|shift| (color as u32 >> shift) as u8));
                found.names.push(VolumeChannel {
                    name: attribute("Name"),
                    color,
                    ..VolumeChannel::default()
                });
            }
            _ => {}
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLAIN: PageTags = PageTags { samples: 1, pixels: [None; 2], unit: None };

    /// The sides of a voxel and their unit, rounded to what can be read.
    fn sides(found: &StackAbout) -> ([f64; 3], Option<&str>) {
        (found.scale.map(|side| (side * 1e9).round() / 1e9), found.unit.as_deref())
    }

    #[test]
    fn imagej_says_in_two_places_how_large_a_voxel_is() {
        let tags = |x: f64, y: f64, unit| PageTags { samples: 1, pixels: [x, y].map(Some), unit };
        for (says, tags, expected) in [
            ("spacing=0.5\nunit=micron", tags(10.0, 8.0, None), ([0.1, 0.125, 0.5], Some("micron"))),
            // The description's unit is the one.
            ("spacing=0.5\nunit=micron", tags(10.0, 8.0, Some("inch")), ([0.1, 0.125, 0.5], Some("micron"))),
            ("spacing=0.5", tags(10.0, 10.0, Some("centimeter")), ([0.1, 0.1, 0.5], Some("centimeter"))),
            ("spacing=0.5", tags(72.0, 72.0, Some("inch")), ([1.0, 1.0, 0.5], None)),
            (
                "unit=nm\nyunit=um\nspacing=2\nzunit=um",
                tags(0.1, 10.0, None),
                ([10.0, 100.0, 2000.0], Some("nm")),
            ),
            ("unit=nm", tags(0.0, f64::NAN, None), ([1.0; 3], Some("nm"))),
            ("unit=\\u00B5m\nspacing=-3", PLAIN, ([1.0, 1.0, 3.0], Some("µm"))),
        ] {
            let mut odd = Vec::new();
            let found = StackAbout::read(&format!("ImageJ=1.54f\n{says}\n"), 4, &tags, &mut odd);
            assert_eq!(sides(&found), expected, "{says}");
            assert_eq!(odd.len(), 2 * usize::from(says.contains("zunit")), "{says}: {odd:?}");
        }
    }

    #[test]
    fn ome_names_a_unit_for_each_axis() {
        let read = |says: &str, count, samples| {
            let text = format!("<OME><Pixels DimensionOrder=\"XYCZT\" {says}/></OME>");
            let mut odd = Vec::new();
            let found = StackAbout::read(&text, count, &PageTags { samples, ..PLAIN }, &mut odd);
            (found, odd)
        };
        let plain = r#"SizeZ="3" SizeC="1" SizeT="1" "#;
        let nm = r#"PhysicalSizeX="100" PhysicalSizeXUnit="nm" PhysicalSizeY="100" PhysicalSizeYUnit="nm""#;
        let (found, odd) = read(&format!("{plain} {nm} PhysicalSizeZ=\"0.5\""), 3, 1);
        assert_eq!((sides(&found), odd.len()), (([100.0, 100.0, 500.0], Some("nm")), 1), "{odd:?}");
        let escaped =
            r#"PhysicalSizeX="2" PhysicalSizeXUnit="&#181;m" PhysicalSizeZ="3" PhysicalSizeZUnit="px""#;
        let (found, odd) = read(&format!("{plain} {escaped}"), 3, 1);
        assert_eq!(sides(&found), ([2.0, 1.0, 3.0], Some("µm")));
        assert!(odd.len() == 1 && odd[0].contains("cannot be compared"), "{odd:?}");
        // Three colours within each page are three channels, and no pages of their own.
        for (channels, count, pages, odd) in [(3, 10, 1, 0), (6, 20, 2, 0), (3, 30, 3, 0), (4, 10, 1, 1)] {
            let says = format!(r#"SizeZ="5" SizeC="{channels}" SizeT="2""#);
            let (found, said) = read(&says, count, 3);
            assert_eq!((found.channels, said.len()), (pages, odd), "{channels} in {count}: {said:?}");
            assert_eq!(found.times, if odd == 0 { 2 } else { 1 });
        }
    }

    #[test]
    fn descriptions_are_understood() {
        let mut odd = Vec::new();
        let text = "ImageJ=1.54f\nimages=12\nchannels=2\nslices=3\nframes=2\nspacing=0.5\nunit=micron\n";
        let found = StackAbout::read(text, 12, &PLAIN, &mut odd);
        assert_eq!((found.channels, found.slices, found.times), (2, 3, 2));
        assert_eq!((found.order.shape(2, 2, 3), found.scale[2]), ([2, 3, 2], 0.5));
        let text = r#"<?xml version="1.0"?><OME xmlns="x"><Image ID="Image:0"><Pixels DimensionOrder="XYCZT" SizeX="4" SizeY="5"
            SizeZ="3" SizeC="2" SizeT="1" PhysicalSizeX="0.36" PhysicalSizeZ="1.5"><Channel Name="DAPI" Color="65535"/>
            <Channel Name="GFP"/></Pixels></Image></OME>"#;
        let found = StackAbout::read(text, 6, &PLAIN, &mut odd);
        assert_eq!((found.channels, found.slices, found.order.slowest_first), (2, 3, ['T', 'Z', 'C']));
        assert_eq!((found.scale, found.unit.as_deref()), ([0.36, 1.0, 1.5], Some("µm")));
        assert_eq!((found.names[0].name.as_deref(), found.names[0].color), (Some("DAPI"), Some([0, 0, 255])));
        assert!(odd.is_empty());
    }

    #[test]
    fn what_makes_another_number_of_pages_is_not_followed() {
        let mut odd = Vec::new();
        for text in [
            "ImageJ=1\nchannels=7\n",
            "<OME><Pixels DimensionOrder=\"XYZCT\" SizeZ=\"9\" SizeC=\"9\" SizeT=\"9\"/></OME>",
        ] {
            assert_eq!(StackAbout::read(text, 6, &PLAIN, &mut odd).slices, 6, "{text}");
        }
        assert_eq!(odd.len(), 2);
        for text in ["", "<OME", "{\"shape\": [6, 2]}", "<OME><Pixels SizeZ=\"0\"/></OME>"] {
            assert_eq!(StackAbout::read(text, 6, &PLAIN, &mut odd), StackAbout::layers(6), "{text}");
        }
    }
}
