//! All that is shown of a volume as one line of text: from where, how, at which time, which channels, labels
//! and slices, and what is cut away.
//!
//! `volume:x=49,y=58,z=47,zoom=1,yaw=30,pitch=20;panes=four;mode=mip;channel=0:color=00ff00:range=0..255`
//!
//! The parts stand between semicolons, the camera first, each other one as KEY=VALUE. [`VOLUME_KEYS`] are all
//! keys. Places are in voxels of the finest level, so that a text means the same whatever the units of the
//! file. What a text says nothing of stays as it is; but of channels those alone are shown that a text names,
//! and one that says which channels or labels are shown says all of what is cut away and of how samples are
//! taken.

mod parts;

use std::fmt::{self, Display};
use std::str::FromStr;

use glam::DVec3;

use crate::layers::Palette;
use crate::volume::{MOST_CHANNELS, OtherLabels, RAY_STEPS, VolumeMode};
use crate::volume_scene::{LabelsLook, SliceTilt, VolumeFacts, VolumeLayout, VolumeLook};
use crate::words::escaped;
use parts::{camera_of, channel_of, clip_of, labels_of, name_of, number, numbers, panes_of, slices_of};
use parts::{tilt_text, tilts_of};

/// What the text of a view of a volume begins with.
const SCHEME: &str = "volume:";

/// The keys of a text after its camera, each with what stands after it.
pub const VOLUME_KEYS: [(&str, &str); 13] = [
    ("panes", "four, x, y, z or 3d"),
    ("slices", "X,Y,Z[:place=X,Y,Z][:middle=X,Y,Z][:zoom=N]"),
    ("tilt", "x, y or z:YAW,PITCH[:z:YAW,PITCH].., or off"),
    ("mode", "mip, minip, average, emission or iso"),
    ("step", "N"),
    ("density", "N"),
    ("iso", "V or auto"),
    ("time", "T"),
    ("channel", "I[:color=RRGGBB][:map=NAME][:range=LO..HI][:gamma=G][:opacity=O]"),
    ("channels", "none"),
    ("labels", "NAME[:opacity=O][:outlines][:selected=ID][:others=hidden], or off"),
    ("clip", "X0..X1,Y0..Y1,Z0..Z1 (shares of the box)"),
    ("plane", "YAW,PITCH,DEPTH or off"),
];

/// What a view shows of a volume; nothing of what is `None`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VolumeViewText {
    /// What is in the middle of the picture in 3-D, in voxels of the finest level along x, y and z.
    pub target: [f64; 3],
    /// How near that is: 1 where all of the box fits.
    pub zoom: f64,
    /// Degrees, as [`crate::volume_scene::VolumeOrbit`] has them.
    pub yaw: f64,
    /// See [`VolumeViewText::yaw`].
    pub pitch: f64,
    /// Which pictures there are.
    pub panes: Option<VolumeLayout>,
    /// Where slices are.
    pub slices: Option<ViewSlices>,
    /// How far the slices across x, y and z are turned; with [`VolumeViewText::slices`] not at all where
    /// nothing is said.
    pub tilts: Option<[SliceTilt; 3]>,
    /// What becomes of samples along a ray.
    pub mode: Option<VolumeMode>,
    /// How far samples are apart, in sides of a voxel.
    pub step: Option<f64>,
    /// How dense it is in emission.
    pub density: Option<f64>,
    /// The stored value at which a surface is, or the middle of a range.
    pub iso: Option<Option<f64>>,
    /// The time, from 0.
    pub time: Option<u64>,
    /// The channels that are shown, which may be none.
    pub channels: Option<Vec<ViewChannel>>,
    /// The labels that are shown, or none.
    pub labels: Option<Option<ViewLabels>>,
    /// What is seen along x, y and z, as shares of the box.
    pub clip: Option<[[f64; 2]; 3]>,
    /// The plane that hides what lies before it: yaw, pitch and depth; or none.
    pub plane: Option<Option<[f64; 3]>>,
}

/// Where slices are, in voxels of the finest level along x, y and z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewSlices {
    /// The voxel at which they meet.
    pub at: [u32; 3],
    /// The place in it, where one is tilted; its middle, if nothing is said.
    pub place: Option<[f64; 3]>,
    /// What is in the middle of the pictures; where slices meet, if nothing is said.
    pub middle: Option<[f64; 3]>,
    /// How large the slices are seen: 1 where all of them fit.
    pub zoom: f64,
}

/// How a channel is shown; what is `None` is as it was.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ViewChannel {
    /// Which, from 0.
    pub channel: u64,
    /// sRGB codes.
    pub color: Option<[u8; 3]>,
    /// What makes colours in the place of the one.
    pub map: Option<Palette>,
    /// The stored values that are dark and bright.
    pub range: Option<[f64; 2]>,
    /// The exponent of a value's place in the range.
    pub gamma: Option<f32>,
    /// How much light it adds, and in emission how much it hides: 0 to 1.
    pub opacity: Option<f32>,
}

/// How labels are shown.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewLabels {
    /// Which of those beside the volume.
    pub name: String,
    /// How much labels hide: 0 to 1.
    pub opacity: f32,
    /// True if slices show outlines alone.
    pub outlines: bool,
    /// The label that is shown in full.
    pub selected: Option<i128>,
    /// What the others look like then.
    pub others: OtherLabels,
}

/// A text says of no view of a volume what it shows.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("'{part}' is no part of a view of a volume: {why}")]
pub struct VolumeViewError {
    /// The part.
    pub part: String,
    /// What is wrong with the text.
    pub why: String,
}

impl VolumeViewText {
    /// Returns true if a text is meant as a view of a volume, sound or not.
    pub fn is_meant(text: &str) -> bool {
        text.trim_start().starts_with(SCHEME)
    }

    /// All that is shown.
    pub fn of(look: &VolumeLook, facts: &VolumeFacts) -> VolumeViewText {
        let voxels = |place: DVec3| (place / facts.of.voxel).to_array();
        let channel = |nth: usize| {
            let channel = &look.channels[nth];
            ViewChannel {
                channel: nth as u64,
                color: Some(channel.color),
                map: channel.map,
                range: channel.range.filter(|range| range.iter().all(|end| end.is_finite())),
                gamma: Some(channel.gamma).filter(|gamma| *gamma != 1.0),
                opacity: Some(channel.opacity).filter(|opacity| *opacity != 1.0),
            }
        };
        let labels = look.labels.shown.and_then(|nth| facts.labels.get(nth)).map(|name| {
            let LabelsLook { opacity, outlines, selected, others, .. } = look.labels;
            ViewLabels { name: name.clone(), opacity, outlines, selected, others }
        });
        let clip = look.clip;
        let is_cut = clip.shares != [[0.0, 1.0]; 3];
        VolumeViewText {
            target: voxels(look.orbit.target),
            zoom: look.orbit.zoom,
            yaw: look.orbit.yaw,
            pitch: look.orbit.pitch,
            panes: Some(look.layout),
            slices: Some(ViewSlices {
                at: look.voxel(&facts.of),
                place: (!look.is_upright()).then(|| voxels(look.cross)),
                middle: Some(voxels(look.centre)),
                zoom: look.zoom,
            }),
            tilts: (!look.is_upright()).then_some(look.tilts),
            mode: Some(look.mode),
            step: Some(look.step).filter(|step| *step != 1.0),
            density: Some(look.density).filter(|density| *density != 1.0),
            iso: Some(look.iso).filter(|_| look.mode == VolumeMode::Iso),
            time: Some(look.time).filter(|_| facts.times > 1),
            channels: Some(look.shown().map(channel).collect()),
            labels: (!facts.labels.is_empty()).then_some(labels),
            clip: is_cut.then_some(clip.shares),
            plane: clip.has_plane.then_some(Some([clip.plane_yaw, clip.plane_pitch, clip.plane_depth])),
        }
    }

    /// Applies the view to a look. Settings that the text does not name stay as they are; but a text that
    /// names channels or labels also sets what is cut away and how samples are taken. Fails, and changes
    /// nothing, if the volume does not have what the text names.
    pub fn change(&self, look: &mut VolumeLook, facts: &VolumeFacts) -> Result<(), VolumeViewError> {
        let mut to = look.clone();
        let wrong = |part: String, why: String| VolumeViewError { part, why };
        let world = |voxels: [f64; 3]| DVec3::from_array(voxels) * facts.of.voxel;
        to.orbit.target = world(self.target);
        (to.orbit.zoom, to.orbit.yaw, to.orbit.pitch) = (self.zoom, self.yaw, self.pitch);
        to.layout = self.panes.unwrap_or(to.layout);
        if self.slices.is_some() || self.tilts.is_some() {
            to.tilts = self.tilts.unwrap_or_default();
        }
        if let Some(slices) = self.slices {
            let place = slices.place.unwrap_or(slices.at.map(|at| f64::from(at) + 0.5));
            to.put_cross(&facts.of, world(place));
            to.centre = slices.middle.map_or(to.cross, world);
            to.zoom = slices.zoom;
        }
        to.mode = self.mode.unwrap_or(to.mode);
        if self.channels.is_some() || self.labels.is_some() {
            (to.step, to.density, to.clip) = (1.0, 1.0, Default::default());
        }
        if self.channels.is_some() {
            to.channels.iter_mut().for_each(|channel| channel.is_shown = false);
        }
        to.step = self.step.unwrap_or(to.step);
        to.density = self.density.unwrap_or(to.density);
        to.iso = self.iso.unwrap_or(to.iso);
        if let Some(time) = self.time {
            if time >= facts.times {
                let why = format!("{} has the times 0 to {}", facts.name, facts.times.saturating_sub(1));
                return Err(wrong(format!("time={time}"), why));
            }
            to.time = time;
        }
        for said in self.channels.iter().flatten() {
            let channel = usize::try_from(said.channel).ok().and_then(|nth| to.channels.get_mut(nth));
            let Some(channel) = channel else {
                let why = match facts.channels.len() {
                    0 => format!("{} is a volume of labels, which have colours of their own", facts.name),
                    count => format!("{} has the channels 0 to {}", facts.name, count - 1),
                };
                return Err(wrong(format!("channel={}", said.channel), why));
            };
            channel.is_shown = true;
            channel.color = said.color.unwrap_or(channel.color);
            channel.range = said.range.or(channel.range);
            (channel.gamma, channel.opacity) = (said.gamma.unwrap_or(1.0), said.opacity.unwrap_or(1.0));
            channel.map = said.map;
        }
        match &self.labels {
            Some(Some(said)) => {
                let shown = facts.labels.iter().position(|name| *name == said.name);
                let Some(nth) = shown else {
                    let why = match facts.labels.is_empty() {
                        true => format!("no labels lie beside {}", facts.name),
                        false => format!("{} has the labels {}", facts.name, facts.labels.join(", ")),
                    };
                    return Err(wrong(format!("labels={}", said.name), why));
                };
                let fault = said.selected.and_then(|label| Some((label, facts.label_fault(nth, label)?)));
                if let Some((label, why)) = fault {
                    return Err(wrong(format!("labels={}:selected={label}", said.name), why));
                }
                let ViewLabels { opacity, outlines, selected, others, .. } = *said;
                to.labels = LabelsLook { shown, opacity, outlines, selected, others };
            }
            Some(None) => to.labels.shown = None,
            None => {}
        }
        to.clip.shares = self.clip.unwrap_or(to.clip.shares);
        if let Some(plane) = self.plane {
            to.clip.has_plane = plane.is_some();
            if let Some(plane) = plane {
                [to.clip.plane_yaw, to.clip.plane_pitch, to.clip.plane_depth] = plane;
            }
        }
        to.tidy();
        *look = to;
        Ok(())
    }
}

/// The view as a text.
impl Display for VolumeViewText {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let VolumeViewText { target: [x, y, z], zoom, yaw, pitch, .. } = self;
        write!(f, "{SCHEME}x={x},y={y},z={z},zoom={zoom},yaw={yaw},pitch={pitch}")?;
        if let Some(panes) = self.panes {
            write!(f, ";panes={}", name_of(panes))?;
        }
        if let Some(ViewSlices { at: [x, y, z], place, middle, zoom }) = self.slices {
            write!(f, ";slices={x},{y},{z}")?;
            if let Some([x, y, z]) = place {
                write!(f, ":place={x},{y},{z}")?;
            }
            if let Some([x, y, z]) = middle {
                write!(f, ":middle={x},{y},{z}")?;
            }
            if zoom != 1.0 {
                write!(f, ":zoom={zoom}")?;
            }
        }
        self.tilts.map_or(Ok(()), |tilts| write!(f, ";tilt={}", tilt_text(tilts)))?;
        let mode = self.mode.map(VolumeMode::name);
        let iso = self.iso.map(|iso| iso.map_or("auto".to_owned(), |iso| iso.to_string()));
        let parts: [(&str, Option<&dyn Display>); 5] = [
            ("mode", mode.as_ref().map(|mode| mode as &dyn Display)),
            ("step", self.step.as_ref().map(|step| step as &dyn Display)),
            ("density", self.density.as_ref().map(|density| density as &dyn Display)),
            ("iso", iso.as_ref().map(|iso| iso as &dyn Display)),
            ("time", self.time.as_ref().map(|time| time as &dyn Display)),
        ];
        for (key, value) in parts {
            value.map_or(Ok(()), |value| write!(f, ";{key}={value}"))?;
        }
        for ViewChannel { channel, color, map, range, gamma, opacity } in self.channels.iter().flatten() {
            write!(f, ";channel={channel}")?;
            color.map_or(Ok(()), |[r, g, b]| write!(f, ":color={r:02x}{g:02x}{b:02x}"))?;
            map.map_or(Ok(()), |map| write!(f, ":map={map}"))?;
            range.map_or(Ok(()), |[low, high]| write!(f, ":range={low}..{high}"))?;
            gamma.map_or(Ok(()), |gamma| write!(f, ":gamma={gamma}"))?;
            opacity.map_or(Ok(()), |opacity| write!(f, ":opacity={opacity}"))?;
        }
        if self.channels.as_ref().is_some_and(Vec::is_empty) {
            f.write_str(";channels=none")?;
        }
        match &self.labels {
            Some(Some(labels)) => {
                // Labels of this name are told from none by a code.
                let name = if labels.name == "off" { "%6Fff".into() } else { escaped(&labels.name) };
                write!(f, ";labels={name}:opacity={}", labels.opacity)?;
                f.write_str(if labels.outlines { ":outlines" } else { "" })?;
                labels.selected.map_or(Ok(()), |selected| write!(f, ":selected={selected}"))?;
                f.write_str(if labels.others == OtherLabels::Hidden { ":others=hidden" } else { "" })?;
            }
            Some(None) => f.write_str(";labels=off")?,
            None => {}
        }
        if let Some([[x0, x1], [y0, y1], [z0, z1]]) = self.clip {
            write!(f, ";clip={x0}..{x1},{y0}..{y1},{z0}..{z1}")?;
        }
        match self.plane {
            Some(Some([yaw, pitch, depth])) => write!(f, ";plane={yaw},{pitch},{depth}"),
            Some(None) => f.write_str(";plane=off"),
            None => Ok(()),
        }
    }
}

impl FromStr for VolumeViewText {
    type Err = VolumeViewError;

    fn from_str(text: &str) -> Result<VolumeViewText, VolumeViewError> {
        let mut parts = text.trim().split(';').map(str::trim);
        let first = parts.next().unwrap_or_default();
        let error = |part: &str, why: String| VolumeViewError { part: part.to_owned(), why };
        let mut view = camera_of(first).map_err(|why| error(first, why))?;
        let mut told: Vec<&str> = Vec::new();
        for part in parts {
            let (key, value) = part.split_once('=').unwrap_or((part, ""));
            if key != "channel" && told.contains(&key) {
                return Err(error(part, format!("{key} is told twice")));
            }
            told.push(key);
            view.read(key, value).map_err(|why| error(part, why))?;
        }
        Ok(view)
    }
}

impl VolumeViewText {
    /// Takes in one part of a text.
    fn read(&mut self, key: &str, value: &str) -> Result<(), String> {
        match key {
            "panes" => self.panes = Some(panes_of(value)?),
            "slices" => self.slices = Some(slices_of(value)?),
            "tilt" => self.tilts = Some(tilts_of(value)?),
            "mode" => {
                let mode = VolumeMode::ALL.into_iter().find(|mode| mode.name() == value);
                let names = || VolumeMode::ALL.map(VolumeMode::name).join(", ");
                self.mode = Some(mode.ok_or_else(|| format!("the modes are {}", names()))?);
            }
            "step" => self.step = Some(number(value, *RAY_STEPS.start(), *RAY_STEPS.end())?),
            "density" => self.density = Some(number(value, 0.01, 100.0)?),
            "iso" if value == "auto" => self.iso = Some(None),
            "iso" => self.iso = Some(Some(number(value, f64::MIN, f64::MAX)?)),
            "time" => self.time = Some(value.parse().map_err(|_| "write a whole number from 0 on")?),
            "channels" if value != "none" => {
                return Err("channels=none shows none; each that is shown is a channel=".into());
            }
            "channels" if self.channels.is_some() => return Err("channels are named beside it".into()),
            "channels" => self.channels = Some(Vec::new()),
            "channel" => {
                let channel = channel_of(value)?;
                match &mut self.channels {
                    Some(others) if others.is_empty() => return Err("channels=none shows none".into()),
                    Some(others) if others.iter().any(|other| other.channel == channel.channel) => {
                        return Err(format!("channel {} is told twice", channel.channel));
                    }
                    Some(others) if others.len() == MOST_CHANNELS => {
                        return Err(format!("{MOST_CHANNELS} channels are shown at most"));
                    }
                    Some(others) => others.push(channel),
                    None => self.channels = Some(vec![channel]),
                }
            }
            "labels" if value == "off" => self.labels = Some(None),
            "labels" => self.labels = Some(Some(labels_of(value)?)),
            "clip" => self.clip = Some(clip_of(value)?),
            "plane" if value == "off" => self.plane = Some(None),
            "plane" => {
                let [yaw, pitch, depth] = numbers(value)?;
                if !(0.0..=1.0).contains(&depth) || yaw.abs() > 360.0 || pitch.abs() > 360.0 {
                    return Err("write degrees to 360 and a depth from 0 to 1, as in plane=30,20,0.5".into());
                }
                self.plane = Some(Some([yaw, pitch, depth]));
            }
            _ => {
                let keys = VOLUME_KEYS.map(|(key, value)| format!("{key}={value}")).join("; ");
                return Err(format!(
                    "there is no '{key}'; after where the camera is, parts are {keys}, each after a semicolon"
                ));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
