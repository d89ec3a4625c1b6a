//! What the pages of a stack are, by the description of the first one: OME-XML, or ImageJ's lines.

use quick_xml::Reader;
use quick_xml::events::Event;

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

    /// Of so many pages, by a description. Where its numbers make another number of pages, all are layers,
    /// and that is said.
    pub(super) fn read(description: &str, count: u64, oddities: &mut Vec<String>) -> StackAbout {
        let trimmed = description.trim_start_matches('\u{feff}').trim_start();
        let found = if trimmed.starts_with("ImageJ=") {
            Some(of_imagej(trimmed, count))
        } else if trimmed.starts_with('<') && trimmed.contains("OME") {
            of_ome(trimmed)
        } else {
            None
        };
        let Some(found) = found else { return StackAbout::layers(count) };
        let pages =
            [found.channels, found.slices, found.times].iter().try_fold(1_u64, |a, b| a.checked_mul(*b));
        if pages == Some(count) {
            return found;
        }
        oddities.push(format!(
            "the description makes {} channels, {} layers and {} times, and there are {count} pages; all are taken for layers",
            found.channels, found.slices, found.times
        ));
        StackAbout { scale: found.scale, unit: found.unit, ..StackAbout::layers(count) }
    }
}

fn of_imagej(text: &str, count: u64) -> StackAbout {
    let value = |key: &str| text.lines().find_map(|line| line.strip_prefix(key)?.strip_prefix('='));
    let number = |key: &str| value(key).and_then(|text| text.trim().parse::<u64>().ok()).filter(|n| *n > 0);
    let (channels, times) = (number("channels").unwrap_or(1), number("frames").unwrap_or(1));
    let rest = count / channels.saturating_mul(times).max(1);
    let slices = number("slices").unwrap_or(rest.max(1));
    let spacing = value("spacing").and_then(|text| text.trim().parse::<f64>().ok()).map(f64::abs);
    let spacing = spacing.filter(|step| step.is_normal());
    StackAbout {
        channels,
        slices,
        times,
        order: PageOrder { slowest_first: ['T', 'Z', 'C'] },
        scale: [1.0, 1.0, spacing.unwrap_or(1.0)],
        unit: value("unit").map(|unit| unit.trim().replace("\\u00B5", "µ")).filter(|unit| !unit.is_empty()),
        names: Vec::new(),
    }
}

fn of_ome(text: &str) -> Option<StackAbout> {
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
            Some(String::from_utf8_lossy(&attribute.value).into_owned())
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
                found = Some(StackAbout {
                    channels: count("SizeC")?,
                    slices: count("SizeZ")?,
                    times: count("SizeT")?,
                    order: PageOrder::of_ome(&attribute("DimensionOrder")?)?,
                    scale: ["PhysicalSizeX", "PhysicalSizeY", "PhysicalSizeZ"]
                        .map(|name| side(name).unwrap_or(1.0)),
                    // OME's default.
                    unit: side("PhysicalSizeX")
                        .map(|_| attribute("PhysicalSizeXUnit").unwrap_or("µm".into())),
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

    #[test]
    fn descriptions_are_understood() {
        let mut odd = Vec::new();
        let text = "ImageJ=1.54f\nimages=12\nchannels=2\nslices=3\nframes=2\nspacing=0.5\nunit=micron\n";
        let found = StackAbout::read(text, 12, &mut odd);
        assert_eq!((found.channels, found.slices, found.times), (2, 3, 2));
        assert_eq!((found.order.shape(2, 2, 3), found.scale[2]), ([2, 3, 2], 0.5));
        let text = r#"<?xml version="1.0"?><OME xmlns="x"><Image ID="Image:0"><Pixels DimensionOrder="XYCZT" SizeX="4" SizeY="5"
            SizeZ="3" SizeC="2" SizeT="1" PhysicalSizeX="0.36" PhysicalSizeZ="1.5"><Channel Name="DAPI" Color="65535"/>
            <Channel Name="GFP"/></Pixels></Image></OME>"#;
        let found = StackAbout::read(text, 6, &mut odd);
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
            assert_eq!(StackAbout::read(text, 6, &mut odd).slices, 6, "{text}");
        }
        assert_eq!(odd.len(), 2);
        for text in ["", "<OME", "{\"shape\": [6, 2]}", "<OME><Pixels SizeZ=\"0\"/></OME>"] {
            assert_eq!(StackAbout::read(text, 6, &mut odd), StackAbout::layers(6), "{text}");
        }
    }
}
