//! What a person sets of a volume in a window: everything that a picture of it follows from, beside its size.

mod clip;
mod tilt;

use std::sync::Arc;

use glam::DVec3;
use vastex::VoxelLevels;

use crate::layers::Palette;
use crate::volume::{
    FIRST_CHANNELS, MOST_CHANNELS, OtherLabels, VolumeBox, VolumeCamera, VolumeMode, usual_channel_color,
};
pub use clip::ClipLook;
use tilt::MOST_TILT;
pub use tilt::{SliceTilt, cut_of};

/// Half of the angle from the upper to the lower edge of a picture in perspective, in degrees.
const HALF_HEIGHT: f64 = 15.0;
/// Zooms of slices and in perspective.
const ZOOMS: [f64; 2] = [0.05, 1e6];

/// What is known of a volume before any of it is read.
#[derive(Clone, Debug, PartialEq)]
pub struct VolumeFacts {
    /// The volume's name.
    pub name: String,
    /// The volume's box. The world of a scene begins at its first corner.
    pub of: VolumeBox,
    /// Where that corner lies in the file's own system, and how long a unit of the scene's world is there.
    pub origin: [f64; 3],
    /// See [`VolumeFacts::origin`].
    pub unit_length: f64,
    /// The unit of the file's coordinates, as files name it (`micrometer`), if the file says so.
    pub unit: Option<String>,
    /// The volume's channels; none of labels by themselves.
    pub channels: Vec<ChannelFacts>,
    /// Labels that lie beside the volume, by their names; for a volume of labels, the volume itself.
    pub labels: Vec<String>,
    /// Of each of them the least and the greatest number that its values can have.
    pub label_bounds: Vec<[i128; 2]>,
    /// Times that the volume has, at least one.
    pub times: u64,
    /// A stored value is `base + gain * sampled`.
    pub base: f64,
    /// See [`VolumeFacts::base`].
    pub gain: f64,
    /// The least and the greatest value that its kind of number can have; `None` for floats.
    pub bounds: Option<[f64; 2]>,
    /// How the volume's coarser levels were made, if the file says so.
    pub downsample: Option<String>,
    /// How levels are made that the file lacks, `mean` for one; `None` if it lacks none.
    pub made_by: Option<String>,
    /// Voxels of a brick along each side.
    pub brick: u32,
    /// Where the voxels of the levels lie, if that is known: it says how much rays meet.
    pub levels: Option<Arc<VoxelLevels>>,
}

impl VolumeFacts {
    /// A box of which nothing else is known: one channel, at one time.
    pub fn of_box(of: VolumeBox) -> VolumeFacts {
        VolumeFacts {
            name: String::new(),
            of,
            origin: [0.0; 3],
            unit_length: 1.0,
            unit: None,
            channels: vec![ChannelFacts::default()],
            labels: Vec::new(),
            label_bounds: Vec::new(),
            times: 1,
            base: 0.0,
            gain: 1.0,
            bounds: None,
            downsample: None,
            made_by: None,
            brick: 64,
            levels: None,
        }
    }

    /// Why labels cannot have one of this number, if they cannot.
    pub fn label_fault(&self, labels: usize, label: i128) -> Option<String> {
        let [least, most] = *self.label_bounds.get(labels)?;
        let name = self.labels.get(labels).map_or("", String::as_str);
        let is_within = (least..=most).contains(&label);
        (!is_within).then(|| format!("{name} has no label {label}: its values are {least} to {most}"))
    }

    /// What a channel is called.
    pub fn channel_name(&self, channel: usize) -> String {
        let named = self.channels.get(channel).and_then(|channel| channel.name.clone());
        named.unwrap_or_else(|| format!("channel {channel}"))
    }
}

/// What is known of a channel.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ChannelFacts {
    /// The channel's name.
    pub name: Option<String>,
    /// As sRGB codes.
    pub color: Option<[u8; 3]>,
    /// `Some(true)` if the file says that the channel is shown at first, `Some(false)` if hidden.
    pub is_active: Option<bool>,
}

/// One of the pictures that a volume is seen in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum VolumePane {
    /// The slice across x: right is +y, down is +z.
    X,
    /// The slice across y: right is +x, down is +z.
    Y,
    /// The slice across z: right is +x, down is +y.
    Z,
    /// The whole volume, from a point around it.
    #[default]
    Space,
}

impl VolumePane {
    /// Every picture, in the order in which they lie beside each other, row by row.
    pub const ALL: [VolumePane; 4] = [VolumePane::Z, VolumePane::X, VolumePane::Y, VolumePane::Space];

    /// The axis that a slice is across, 0 to 2; `None` for all of it.
    pub const fn axis(self) -> Option<usize> {
        match self {
            VolumePane::X => Some(0),
            VolumePane::Y => Some(1),
            VolumePane::Z => Some(2),
            VolumePane::Space => None,
        }
    }

    /// The picture's name: `x`, `y`, `z` or `3d`.
    pub const fn name(self) -> &'static str {
        match self {
            VolumePane::X => "x",
            VolumePane::Y => "y",
            VolumePane::Z => "z",
            VolumePane::Space => "3d",
        }
    }

    /// The picture's number, 0 to 3.
    pub const fn number(self) -> usize {
        match self {
            VolumePane::X => 0,
            VolumePane::Y => 1,
            VolumePane::Z => 2,
            VolumePane::Space => 3,
        }
    }

    /// The axes to the right and downward in a slice, 0 to 2.
    pub const fn axes(self) -> [usize; 2] {
        match self {
            VolumePane::X => [1, 2],
            VolumePane::Y => [0, 2],
            VolumePane::Z | VolumePane::Space => [0, 1],
        }
    }
}

/// Which pictures of a volume are seen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum VolumeLayout {
    /// All four.
    #[default]
    Four,
    /// One alone.
    One(VolumePane),
}

/// From where all of a volume is seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VolumeOrbit {
    /// Degrees round the z axis: at 0 +y is ahead and -x to the right.
    pub yaw: f64,
    /// Degrees towards +z; beyond 90 the picture stands on its head.
    pub pitch: f64,
    /// What is in the middle, in the scene's world.
    pub target: DVec3,
    /// The zoom: 1 if the whole box fits, 2 from half as far.
    pub zoom: f64,
}

impl VolumeOrbit {
    /// The way ahead, and those to the right and downward in the picture.
    pub fn axes(&self) -> [DVec3; 3] {
        let ((sy, cy), (sp, cp)) = (self.yaw.to_radians().sin_cos(), self.pitch.to_radians().sin_cos());
        let ahead = DVec3::new(-sy * cp, cy * cp, sp);
        let right = DVec3::new(-cy, -sy, 0.0);
        [ahead, right, ahead.cross(right)]
    }

    /// The camera for a picture of so many pixels.
    pub fn camera(&self, of: &VolumeBox, picture: [u32; 2]) -> VolumeCamera {
        let [ahead, _, down] = self.axes();
        let half_height = HALF_HEIGHT.to_radians();
        let [width, height] = picture.map(|side| f64::from(side.max(1)));
        // Where the picture is narrow its width decides.
        let distance = of.extent().length() / 2.0 / half_height.sin() * (height / width).max(1.0) / self.zoom;
        VolumeCamera { target: self.target, eye: self.target - ahead * distance, down, half_height }
    }
}

/// How a channel is shown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChannelLook {
    /// True if the channel is shown.
    pub is_shown: bool,
    /// sRGB codes.
    pub color: [u8; 3],
    /// The stored values that are dark and bright; `None` until it is known which are usual.
    pub range: Option<[f64; 2]>,
    /// The exponent of a value's place in the range.
    pub gamma: f32,
    /// How much light it adds, and in emission how much it hides: 0 to 1.
    pub opacity: f32,
    /// The colours of places in the range, in the place of the one colour.
    pub map: Option<Palette>,
}

impl ChannelLook {
    /// What a stored value becomes: 0 to 1.
    pub fn shown(&self, stored: f64) -> f64 {
        let [low, high] = self.range.unwrap_or([0.0, 1.0]);
        let x = ((stored - low) / (high - low)).clamp(0.0, 1.0);
        if x.is_nan() { 0.0 } else { x.powf(f64::from(self.gamma)) }
    }

    /// The colour of a place in the range, 0 to 1, with gamma: sRGB codes.
    pub fn color_at(&self, place: f32) -> [u8; 3] {
        let x = place.clamp(0.0, 1.0).powf(self.gamma);
        let plain = self.color.map(|code| f32::from(code) / 255.0 * x);
        self.map.map_or(plain, |map| map.color(x)).map(|value| (value * 255.0).round() as u8)
    }
}

/// How labels are shown over the channels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LabelsLook {
    /// Which of [`VolumeFacts::labels`], if any.
    pub shown: Option<usize>,
    /// How much labels hide of what lies under them: 0 to 1.
    pub opacity: f32,
    /// True if slices show the labels' outlines alone.
    pub outlines: bool,
    /// The label that is shown in full, through all others, by its number.
    pub selected: Option<i128>,
    /// What the others look like then.
    pub others: OtherLabels,
}

impl Default for LabelsLook {
    /// None are shown; once they are, half opaque.
    fn default() -> LabelsLook {
        let others = OtherLabels::default();
        LabelsLook { shown: None, opacity: 0.5, outlines: false, selected: None, others }
    }
}

/// All that a person sets.
#[derive(Clone, Debug, PartialEq)]
pub struct VolumeLook {
    /// Of each channel.
    pub channels: Vec<ChannelLook>,
    /// Of the labels over them.
    pub labels: LabelsLook,
    /// What becomes of samples along a ray.
    pub mode: VolumeMode,
    /// How far samples are apart, in sides of a voxel.
    pub step: f64,
    /// How dense it is in emission.
    pub density: f64,
    /// The stored value at which a surface is; `None` for the middle of the range of the first channel shown.
    pub iso: Option<f64>,
    /// The time, from 0.
    pub time: u64,
    /// Where the slices meet, in the scene's world.
    pub cross: DVec3,
    /// What is in the middle of the slices.
    pub centre: DVec3,
    /// How large slices are seen: 1 where all of them fit.
    pub zoom: f64,
    /// How far the slices across x, y and z are turned.
    pub tilts: [SliceTilt; 3],
    /// From where all of it is seen.
    pub orbit: VolumeOrbit,
    /// Which pictures there are.
    pub layout: VolumeLayout,
    /// What is cut away.
    pub clip: ClipLook,
}

impl VolumeLook {
    /// How a volume is shown at first: with the channels that the file shows, else the first ones, at the
    /// middle of its box; a flat one as a picture.
    pub fn first(facts: &VolumeFacts) -> VolumeLook {
        let middle = facts.of.extent() / 2.0;
        let is_named = facts.channels.iter().any(|channel| channel.is_active == Some(true));
        let mut left = if is_named { MOST_CHANNELS } else { FIRST_CHANNELS };
        let count = facts.channels.len();
        let channels = facts.channels.iter().enumerate().map(|(nth, channel)| {
            let is_shown = left > 0 && (!is_named || channel.is_active == Some(true));
            left -= usize::from(is_shown);
            let color = usual_channel_color(nth, count, channel.color);
            ChannelLook { is_shown, color, range: None, gamma: 1.0, opacity: 1.0, map: None }
        });
        let layout = match facts.of.size {
            [_, _, 1] => VolumeLayout::One(VolumePane::Z),
            _ => VolumeLayout::Four,
        };
        let mut look = VolumeLook {
            channels: channels.collect(),
            labels: match count {
                // Labels by themselves hide nothing.
                0 => LabelsLook { shown: Some(0), opacity: 1.0, ..LabelsLook::default() },
                _ => LabelsLook::default(),
            },
            mode: VolumeMode::Mip,
            step: 1.0,
            density: 1.0,
            iso: None,
            time: 0,
            cross: middle,
            centre: middle,
            zoom: 1.0,
            tilts: Default::default(),
            orbit: VolumeOrbit { yaw: 30.0, pitch: 20.0, target: middle, zoom: 1.0 },
            layout,
            clip: ClipLook::default(),
        };
        look.put_cross(&facts.of, middle);
        look
    }

    /// The numbers of the channels that are shown, as many as one picture can show.
    pub fn shown(&self) -> impl Iterator<Item = usize> + '_ {
        let shown = self.channels.iter().enumerate().filter(|(_, channel)| channel.is_shown);
        shown.map(|(nth, _)| nth).take(MOST_CHANNELS)
    }

    /// The stored value at which a surface is: the one that was chosen, else the middle of the range of the
    /// first channel that is shown, once that is known.
    pub fn iso_or_middle(&self) -> Option<f64> {
        let range = || self.shown().find_map(|nth| self.channels[nth].range);
        self.iso.or_else(|| range().map(|[low, high]| (low + high) / 2.0))
    }

    /// The voxel of level 0 at which slices meet.
    pub fn voxel(&self, of: &VolumeBox) -> [u32; 3] {
        let at = self.cross / of.voxel;
        std::array::from_fn(|axis| (at[axis].floor().max(0.0) as u32).min(of.size[axis].saturating_sub(1)))
    }

    /// Has slices meet in the middle of the voxel at a place, or of the nearest one; where one is tilted, at
    /// the place itself.
    pub fn put_cross(&mut self, of: &VolumeBox, place: DVec3) {
        self.cross = place.clamp(DVec3::ZERO, of.extent());
        if !self.is_upright() {
            return;
        }
        let voxel = self.voxel(of);
        self.cross = DVec3::from_array(voxel.map(f64::from)) * of.voxel + of.voxel / 2.0;
    }

    /// Goes so many slices on along an axis.
    pub fn step_slice(&mut self, of: &VolumeBox, axis: usize, steps: i64) {
        let last = i64::from(of.size[axis].saturating_sub(1));
        let to = (i64::from(self.voxel(of)[axis]) + steps).clamp(0, last);
        self.cross[axis] = (to as f64 + 0.5) * of.voxel[axis];
    }

    /// Where nothing was moved: all of it is seen, from the first place, at the middle.
    pub fn fit(&mut self, facts: &VolumeFacts) {
        let first = VolumeLook::first(facts);
        (self.centre, self.zoom, self.orbit) = (first.centre, first.zoom, first.orbit);
        self.put_upright(&facts.of);
    }

    /// Keeps zooms and angles within what they may be.
    pub fn tidy(&mut self) {
        let zoom = |zoom: f64| if zoom.is_finite() { zoom.clamp(ZOOMS[0], ZOOMS[1]) } else { 1.0 };
        (self.zoom, self.orbit.zoom) = (zoom(self.zoom), zoom(self.orbit.zoom));
        let turn = |degrees: f64| match (-180.0..180.0).contains(&degrees) {
            true => degrees,
            false => (degrees + 180.0).rem_euclid(360.0) - 180.0,
        };
        (self.orbit.yaw, self.orbit.pitch) = (turn(self.orbit.yaw), turn(self.orbit.pitch));
        let tilt = |degrees: f64| if degrees.is_nan() { 0.0 } else { degrees.clamp(-MOST_TILT, MOST_TILT) };
        for SliceTilt { yaw, pitch } in &mut self.tilts {
            (*yaw, *pitch) = (tilt(*yaw), tilt(*pitch));
        }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// A volume of three channels, 40 x 30 x 20 voxels of 0.5, 0.5 and 2 micrometres.
    pub(crate) fn facts() -> VolumeFacts {
        let named = |name: &str| ChannelFacts { name: Some(name.into()), ..ChannelFacts::default() };
        VolumeFacts {
            name: "cells".into(),
            of: VolumeBox::new([40, 30, 20], [0.25, 0.25, 1.0]),
            origin: [100.0, 0.0, -4.0],
            unit_length: 2.0,
            unit: Some("micrometer".into()),
            channels: vec![named("nuclei"), named("membranes"), ChannelFacts::default()],
            labels: vec!["cells".into()],
            label_bounds: vec![[i128::from(i64::MIN), i128::from(u64::MAX)]],
            times: 5,
            base: 0.0,
            gain: 65535.0,
            bounds: Some([0.0, 65535.0]),
            downsample: Some("mean".into()),
            made_by: None,
            brick: 64,
            levels: None,
        }
    }

    #[test]
    fn the_camera_stands_as_the_faces_do() {
        let look = |yaw, pitch| VolumeOrbit { yaw, pitch, target: DVec3::ZERO, zoom: 1.0 }.axes();
        let near = |found: [DVec3; 3], said: [DVec3; 3]| {
            found.iter().zip(said).all(|(a, b)| (*a - b).length() < 1e-12)
        };
        // Along +y: -x to the right, +z downward; along -x: -y to the right.
        assert!(near(look(0.0, 0.0), [DVec3::Y, DVec3::NEG_X, DVec3::Z]));
        assert!(near(look(90.0, 0.0), [DVec3::NEG_X, DVec3::NEG_Y, DVec3::Z]));
        assert!(near(look(0.0, 90.0), [DVec3::Z, DVec3::NEG_X, DVec3::NEG_Y]));
        for (yaw, pitch) in [(12.0, 34.0), (200.0, -89.0), (-70.0, 150.0)] {
            let [ahead, right, down] = look(yaw, pitch);
            assert!((right.cross(down) - ahead).length() < 1e-12, "never mirrored");
        }
    }

    #[test]
    fn what_is_shown_at_first_is_what_the_file_shows() {
        let mut facts = facts();
        let look = VolumeLook::first(&facts);
        assert_eq!(look.shown().collect::<Vec<_>>(), [0, 1, 2]);
        assert_eq!(look.voxel(&facts.of), [20, 15, 10]);
        facts.channels[1].is_active = Some(true);
        facts.channels[0].is_active = Some(false);
        facts.channels[1].color = Some([1, 2, 3]);
        let look = VolumeLook::first(&facts);
        assert_eq!((look.shown().collect::<Vec<_>>(), look.labels.shown), (vec![1], None));
        let alone = VolumeLook::first(&VolumeFacts { channels: Vec::new(), ..facts.clone() });
        assert_eq!((alone.shown().count(), alone.labels.shown, alone.labels.opacity), (0, Some(0), 1.0));
        assert_eq!(look.channels[1].color, [1, 2, 3]);
        facts.of.size[2] = 1;
        assert_eq!(VolumeLook::first(&facts).layout, VolumeLayout::One(VolumePane::Z));
    }

    #[test]
    fn slices_stay_within_the_volume() {
        let facts = facts();
        let mut look = VolumeLook::first(&facts);
        look.step_slice(&facts.of, 2, 3);
        assert_eq!((look.voxel(&facts.of)[2], look.cross.z), (13, 13.5));
        look.step_slice(&facts.of, 2, i64::from(i32::MAX));
        assert_eq!(look.voxel(&facts.of)[2], 19);
        look.put_cross(&facts.of, DVec3::new(-5.0, 1e9, 0.3));
        assert_eq!(look.voxel(&facts.of), [0, 29, 0]);
        assert_eq!(look.cross, DVec3::new(0.125, 7.375, 0.5));
    }
}
