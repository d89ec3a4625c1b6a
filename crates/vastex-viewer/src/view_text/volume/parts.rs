//! The parts of a text of a view of a volume, each read by itself.

use super::{SCHEME, ViewChannel, ViewLabels, ViewSlices, VolumeViewText};
use crate::volume::{OtherLabels, parse_label};
use crate::volume_scene::{LabelsLook, SliceTilt, VolumeLayout, VolumePane};
use crate::words::{color_of, unescaped};

/// Where the camera is.
pub(super) fn camera_of(text: &str) -> Result<VolumeViewText, String> {
    let shape =
        "write volume:x=..,y=..,z=..,zoom=..,yaw=..,pitch=.., x, y and z in voxels, angles in degrees";
    let words = text.strip_prefix(SCHEME).ok_or(shape)?;
    let mut found = [None; 6];
    for word in words.split(',') {
        let (name, value) = word.split_once('=').ok_or_else(|| format!("because of '{word}': {shape}"))?;
        let nth = ["x", "y", "z", "zoom", "yaw", "pitch"].iter().position(|known| *known == name);
        let value = value.parse().ok().filter(|value: &f64| value.is_finite() && value.abs() <= 1e12);
        match (nth, value) {
            (Some(nth), Some(value)) if found[nth].is_none() => found[nth] = Some(value),
            _ => return Err(format!("because of '{word}': {shape}")),
        }
    }
    let [Some(x), Some(y), Some(z), Some(zoom), Some(yaw), Some(pitch)] = found else {
        return Err(format!("something is missing: {shape}"));
    };
    if zoom <= 0.0 {
        return Err("a zoom is greater than 0".into());
    }
    Ok(VolumeViewText { target: [x, y, z], zoom, yaw, pitch, ..VolumeViewText::default() })
}

const LAYOUTS: [VolumeLayout; 5] = [
    VolumeLayout::Four,
    VolumeLayout::One(VolumePane::X),
    VolumeLayout::One(VolumePane::Y),
    VolumeLayout::One(VolumePane::Z),
    VolumeLayout::One(VolumePane::Space),
];

const SLICES: [VolumePane; 3] = [VolumePane::X, VolumePane::Y, VolumePane::Z];

pub(super) fn name_of(panes: VolumeLayout) -> &'static str {
    match panes {
        VolumeLayout::Four => "four",
        VolumeLayout::One(pane) => pane.name(),
    }
}

pub(super) fn panes_of(text: &str) -> Result<VolumeLayout, String> {
    let found = LAYOUTS.into_iter().find(|panes| name_of(*panes) == text);
    found.ok_or_else(|| "the pictures are four, x, y, z and 3d".into())
}

pub(super) fn slices_of(text: &str) -> Result<ViewSlices, String> {
    let mut words = text.split(':');
    let at = numbers(words.next().unwrap_or_default())?;
    let is_voxel = |at: &f64| at.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(at);
    if !at.iter().all(is_voxel) {
        return Err("voxels are counted from 0, as in slices=20,15,10".into());
    }
    let mut slices = ViewSlices { at: at.map(|at| at as u32), place: None, middle: None, zoom: 1.0 };
    for word in words {
        match word.split_once('=') {
            Some(("place", value)) => slices.place = Some(numbers(value)?),
            Some(("middle", value)) => slices.middle = Some(numbers(value)?),
            Some(("zoom", value)) => slices.zoom = number(value, 1e-3, 1e9)?,
            _ => {
                return Err(format!("'{word}': after the voxels stand place=X,Y,Z, middle=X,Y,Z and zoom=N"));
            }
        }
    }
    Ok(slices)
}

/// How slices are turned: `z:30,-10:x:5,0`, or `off`.
pub(super) fn tilt_text(tilts: [SliceTilt; 3]) -> String {
    let said = SLICES.iter().filter(|pane| !tilts[pane.number()].is_upright()).map(|pane| {
        let SliceTilt { yaw, pitch } = tilts[pane.number()];
        format!("{}:{yaw},{pitch}", pane.name())
    });
    let said: Vec<String> = said.collect();
    if said.is_empty() { "off".into() } else { said.join(":") }
}

pub(super) fn tilts_of(text: &str) -> Result<[SliceTilt; 3], String> {
    let shape = "write a slice, x, y or z, and degrees from -89 to 89, as in tilt=z:30,-10";
    let mut tilts = [SliceTilt::default(); 3];
    if text == "off" {
        return Ok(tilts);
    }
    let words: Vec<&str> = text.split(':').collect();
    for pair in words.chunks(2) {
        let [name, degrees] = pair else { return Err(shape.into()) };
        let pane = SLICES.iter().find(|pane| pane.name() == *name).ok_or(shape)?;
        let (yaw, pitch) = degrees.split_once(',').ok_or(shape)?;
        let degrees = |text: &str| number(text, -89.0, 89.0).map_err(|why| format!("{why}; {shape}"));
        let tilt = SliceTilt { yaw: degrees(yaw)?, pitch: degrees(pitch)? };
        if !std::mem::replace(&mut tilts[pane.number()], tilt).is_upright() {
            return Err(format!("{name} is told twice"));
        }
    }
    Ok(tilts)
}

pub(super) fn channel_of(text: &str) -> Result<ViewChannel, String> {
    let mut words = text.split(':');
    let number_of = || "the number of a channel comes first, from 0 on, as in channel=0".to_owned();
    let channel = words.next().and_then(|word| word.parse().ok()).ok_or_else(number_of)?;
    let mut said = ViewChannel { channel, ..ViewChannel::default() };
    for word in words {
        let (key, value) = word.split_once('=').unwrap_or((word, ""));
        match key {
            "color" => said.color = Some(color_of(value).ok_or("a colour is RRGGBB, as in color=ff0080")?),
            "map" => said.map = Some(value.parse().map_err(|error| format!("'{value}': {error}"))?),
            "range" => {
                let ends = value.split_once("..").ok_or("write range=LO..HI, as in range=0..255")?;
                said.range = Some([number(ends.0, f64::MIN, f64::MAX)?, number(ends.1, f64::MIN, f64::MAX)?]);
            }
            "gamma" => said.gamma = Some(number(value, 0.01, 100.0)? as f32),
            "opacity" => said.opacity = Some(number(value, 0.0, 1.0)? as f32),
            _ => return Err(format!("'{word}': there are color, map, range, gamma and opacity")),
        }
    }
    Ok(said)
}

pub(super) fn labels_of(text: &str) -> Result<ViewLabels, String> {
    let mut words = text.split(':');
    let name = words.next().filter(|name| !name.is_empty()).ok_or("the name of labels comes first")?;
    let usual = LabelsLook::default();
    let LabelsLook { opacity, outlines, selected, others, .. } = usual;
    let mut said = ViewLabels { name: unescaped(name), opacity, outlines, selected, others };
    for word in words {
        match word.split_once('=').unwrap_or((word, "")) {
            ("opacity", value) => said.opacity = number(value, 0.0, 1.0)? as f32,
            ("outlines", "") => said.outlines = true,
            ("selected", value) => {
                said.selected = Some(parse_label(value).map_err(|why| format!("'{value}': {why}"))?);
            }
            ("others", value) => {
                let others = OtherLabels::ALL.into_iter().find(|others| others.name() == value);
                said.others = others.ok_or("others are dimmed or hidden")?;
            }
            _ => return Err(format!("'{word}': there are opacity, outlines, selected and others")),
        }
    }
    Ok(said)
}

pub(super) fn clip_of(text: &str) -> Result<[[f64; 2]; 3], String> {
    let mut shares = [[0.0, 1.0]; 3];
    let shape = "write shares from 0 to 1, as in clip=0..0.5,0..1,0.25..1";
    let mut words = text.split(',');
    for share in &mut shares {
        let (low, high) = words.next().and_then(|word| word.split_once("..")).ok_or(shape)?;
        let ends = [number(low, 0.0, 1.0).map_err(|_| shape)?, number(high, 0.0, 1.0).map_err(|_| shape)?];
        if ends[0] > ends[1] {
            return Err(shape.into());
        }
        *share = ends;
    }
    words.next().map_or(Ok(shares), |_| Err(shape.into()))
}

pub(super) fn number(text: &str, least: f64, most: f64) -> Result<f64, String> {
    let number = text.parse().ok().filter(|number| (least..=most).contains(number));
    number.ok_or_else(|| match most {
        f64::MAX => format!("'{text}' is no number"),
        _ => format!("'{text}': write a number from {least} to {most}"),
    })
}

/// Three finite numbers.
pub(super) fn numbers(text: &str) -> Result<[f64; 3], String> {
    let found: Vec<f64> = text.split(',').filter_map(|word| number(word, -1e12, 1e12).ok()).collect();
    let is_whole = text.split(',').count() == 3;
    <[f64; 3]>::try_from(found)
        .ok()
        .filter(|_| is_whole)
        .ok_or_else(|| format!("'{text}': write three numbers"))
}
