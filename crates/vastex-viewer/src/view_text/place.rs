//! Places of a camera round a volume and of its slices, and paths through them.

use std::fmt::{self, Display};
use std::str::FromStr;

use glam::DVec3;

use super::{ViewSlices, VolumeViewText};
use crate::camera::{CameraPath, CameraPathError, PathChannels, PathPlace, TOLERANCE};
use crate::volume::VolumeBox;
use crate::volume_scene::{SliceTilt, VolumeFacts, VolumeLook};

/// From where a volume is seen, where its slices are and at which time, as parts of the text of a view of it
/// say.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VolumePlace {
    /// What is in the middle of the picture, in voxels of the finest level.
    pub target: [f64; 3],
    /// How near that is: 1 where all of the box fits. Greater than 0.
    pub zoom: f64,
    /// Degrees, as [`VolumeOrbit`](crate::volume_scene::VolumeOrbit) has them.
    pub yaw: f64,
    /// See [`VolumePlace::yaw`].
    pub pitch: f64,
    /// Where slices are; `None` leaves them where they are.
    pub slices: Option<ViewSlices>,
    /// How far slices are turned, if it is said where they are; not at all if nothing is said.
    pub tilts: Option<[SliceTilt; 3]>,
    /// The time, from 0; `None` leaves it as it is.
    pub time: Option<u64>,
}

/// Which channels are angles: of the camera, and none of slices, whose angles do not go round.
const ANGLES: [usize; 2] = [4, 5];
/// Voxels by which slices, and times by which the time of a recording may lie beside what was seen: less than
/// what would be another.
const BESIDE: f64 = 0.25;

impl VolumePlace {
    /// What is shown of a volume: all parts of it, the time if there are several.
    pub fn seen(look: &VolumeLook, facts: &VolumeFacts) -> VolumePlace {
        let VolumeViewText { target, zoom, yaw, pitch, slices, tilts, time, .. } =
            VolumeViewText::of(look, facts);
        VolumePlace { target, zoom, yaw, pitch, slices, tilts, time }
    }

    /// A view from this place, in all else as it is.
    pub fn of(self, view: &VolumeViewText) -> VolumeViewText {
        let VolumePlace { target, zoom, yaw, pitch, slices, tilts, time } = self;
        let (slices, tilts) = match slices {
            Some(slices) => (Some(slices), tilts),
            None => (view.slices, view.tilts),
        };
        VolumeViewText { target, zoom, yaw, pitch, slices, tilts, time: time.or(view.time), ..view.clone() }
    }

    /// The place with no more parts than another one has.
    pub(crate) fn parts_of(self, other: &VolumePlace) -> VolumePlace {
        let has_slices = other.slices.is_some();
        VolumePlace {
            slices: self.slices.filter(|_| has_slices),
            tilts: self.tilts.filter(|_| has_slices),
            time: self.time.filter(|_| other.time.is_some()),
            ..self
        }
    }

    /// Where slices meet, and what is in their middle, in voxels.
    fn meet(slices: &ViewSlices) -> [DVec3; 2] {
        let meet = slices.place.map_or(DVec3::from_array(slices.at.map(f64::from)) + 0.5, DVec3::from_array);
        [meet, slices.middle.map_or(meet, DVec3::from_array)]
    }
}

impl PathPlace for VolumePlace {
    fn kind(&self) -> &'static str {
        match (self.slices, self.time) {
            (None, None) => "a volume",
            (Some(_), None) => "a volume with slices",
            (None, Some(_)) => "a volume with a time",
            (Some(_), Some(_)) => "a volume with slices and a time",
        }
    }

    fn channels(&self) -> PathChannels {
        let mut channels = PathChannels::default();
        channels[..3].copy_from_slice(&self.target);
        channels[3..6].copy_from_slice(&[self.zoom.ln(), self.yaw.to_radians(), self.pitch.to_radians()]);
        if let Some(slices) = &self.slices {
            let [meet, middle] = VolumePlace::meet(slices);
            channels[6..9].copy_from_slice(&meet.to_array());
            channels[9..12].copy_from_slice(&middle.to_array());
            channels[12] = slices.zoom.ln();
        }
        for (nth, tilt) in self.tilts.unwrap_or_default().iter().enumerate() {
            channels[13 + 2 * nth..][..2].copy_from_slice(&[tilt.yaw, tilt.pitch]);
        }
        channels[19] = self.time.map_or(0.0, |time| time as f64);
        channels
    }

    fn at(&self, channels: PathChannels) -> VolumePlace {
        let [x, y, z, zoom, yaw, pitch, ..] = channels;
        let slices = self.slices.map(|_| {
            let meet: [f64; 3] = std::array::from_fn(|axis| channels[6 + axis]);
            let middle = std::array::from_fn(|axis| channels[9 + axis]);
            // Upright ones go from voxel to voxel.
            let at = meet.map(|voxel| voxel.max(0.0).floor() as u32);
            ViewSlices { at, place: Some(meet), middle: Some(middle), zoom: channels[12].exp() }
        });
        let tilts = std::array::from_fn(|nth| SliceTilt {
            yaw: channels[13 + 2 * nth],
            pitch: channels[14 + 2 * nth],
        });
        VolumePlace {
            target: [x, y, z],
            zoom: zoom.exp(),
            yaw: yaw.to_degrees(),
            pitch: pitch.to_degrees(),
            slices,
            tilts: slices.map(|_| tilts),
            time: self.time.map(|_| channels[19].max(0.0).round() as u64),
        }
    }

    fn angles(&self) -> &'static [usize] {
        &ANGLES
    }
}

/// Its text.
impl Display for VolumePlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.of(&VolumeViewText::default()).fmt(f)
    }
}

/// Fails, with what is wrong, where a text says something else than a place, or more than that.
impl FromStr for VolumePlace {
    type Err = String;

    fn from_str(text: &str) -> Result<VolumePlace, String> {
        let view: VolumeViewText = text.parse().map_err(|error| format!("{error}"))?;
        let VolumeViewText { target, zoom, yaw, pitch, slices, tilts, time, .. } = view;
        if tilts.is_some() && slices.is_none() {
            return Err("tilt= is of slices: say with slices= where they are".into());
        }
        let place = VolumePlace { target, zoom, yaw, pitch, slices, tilts, time };
        if place.of(&VolumeViewText::default()) != view {
            return Err("a path says where the camera and slices are and the time, and nothing else: leave \
                 out all but slices=, tilt= and time= after the camera; --view and the other options say what \
                 is shown"
                .into());
        }
        Ok(place)
    }
}

impl CameraPath<VolumePlace> {
    /// Reads a path round a volume.
    pub fn of_volume(text: &str) -> Result<CameraPath<VolumePlace>, CameraPathError> {
        CameraPath::read(text, str::parse, "volume:x=49,y=58,z=47,zoom=1,yaw=30,pitch=20")
    }

    /// The path of what was seen at these times in seconds of a volume of this box, with no more places than
    /// it takes to pass close to all of them: to a five-hundredth of the view, through the same slices and
    /// times. Slices, or a time, that stayed as they were are left out. Nothing if nothing was seen.
    pub fn recorded_of_volume(
        rate: f64,
        seen: &[(f64, VolumePlace)],
        of: &VolumeBox,
    ) -> Option<CameraPath<VolumePlace>> {
        let (_, first) = seen.first()?;
        let is_other = |differs: &dyn Fn(&VolumePlace) -> bool| seen.iter().any(|(_, place)| differs(place));
        let slices_move = is_other(&|place| (place.slices, place.tilts) != (first.slices, first.tilts));
        let time_goes_on = is_other(&|place| place.time != first.time);
        let parts = VolumePlace {
            slices: first.slices.filter(|_| slices_move),
            time: first.time.filter(|_| time_goes_on),
            ..*first
        };
        let seen: Vec<_> = seen.iter().map(|(time, place)| (*time, place.parts_of(&parts))).collect();
        CameraPath::recorded_with(rate, &seen, |place| {
            // Half of what is seen, in voxels along each axis.
            let half = DVec3::splat(of.extent().length() / 2.0) / of.voxel;
            let slice = |nearer: f64| (half / nearer).max(DVec3::splat(BESIDE / TOLERANCE));
            let of_slices = slice(place.slices.map_or(1.0, |slices| slices.zoom));
            let mut scales: PathChannels = [1.0; 20];
            scales[..3].copy_from_slice(&(half / place.zoom).to_array());
            scales[6..9].copy_from_slice(&of_slices.to_array());
            scales[9..12].copy_from_slice(&of_slices.to_array());
            // Angles of slices are in degrees.
            scales[13..19].fill(1f64.to_degrees());
            scales[19] = BESIDE / TOLERANCE;
            scales
        })
    }

    /// The text of a path round a volume.
    pub fn volume_text(&self) -> String {
        self.written(VolumePlace::to_string)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_around_a_volume_goes_as_one_over_an_image() {
        let text = "vastex path 1\nfps 10\n0 volume:x=10,y=20,z=30,zoom=1,yaw=170,pitch=0\n\
            2 volume:x=20,y=20,z=30,zoom=4,yaw=-170,pitch=40\n";
        let path = CameraPath::of_volume(text).unwrap();
        assert_eq!((path.frames(), path.keys().len()), (21, 2));
        assert_eq!(CameraPath::of_volume(&path.volume_text()), Ok(path.clone()));
        let VolumePlace { target, zoom, yaw, pitch, .. } = path.pose_of_frame(10);
        assert_eq!((target, (zoom - 2.0).abs() < 1e-9), ([15.0, 20.0, 30.0], true), "an even factor");
        assert!((yaw - 180.0).abs() < 1e-9 && (pitch - 20.0).abs() < 1e-9, "the shorter way: {yaw}");
        let head = "vastex path 1\n";
        for (line, why) in [
            ("0 image:x=1,y=2,zoom=3", "write volume:x=..,y=..,z=.."),
            ("soon volume:x=1", "'2.5 volume:x=49,"),
            ("0 volume:x=1,y=2,z=3,zoom=1,yaw=0,pitch=0;mode=mip", "nothing else"),
            ("0 volume:x=1,y=2,z=3,zoom=0,yaw=0,pitch=0", "greater than 0"),
            ("0 volume:x=1,y=2,z=3,zoom=1,yaw=0,pitch=0;tilt=z:1,2", "with slices="),
            ("# nothing", "as '0 volume:x=49,"),
        ] {
            let error = CameraPath::of_volume(&format!("{head}{line}\n")).unwrap_err();
            assert!(error.line <= 2 && error.why.contains(why), "{line}: {error}");
        }
    }

    const CAMERA: &str = "volume:x=10,y=20,z=30,zoom=1,yaw=0,pitch=0";

    #[test]
    fn slices_and_times_go_along() {
        let text = format!(
            "vastex path 1\nfps 10\n0 {CAMERA};slices=10,10,10:zoom=1;time=0\n\
             2 {CAMERA};slices=20,10,30:middle=4,5,6:zoom=4;tilt=z:40,0;time=5\n"
        );
        let path = CameraPath::of_volume(&text).unwrap();
        assert_eq!(CameraPath::of_volume(&path.volume_text()), Ok(path.clone()));
        let middle = path.pose(1.0);
        let slices = middle.slices.unwrap();
        assert_eq!((slices.at, slices.place), ([15, 10, 20], Some([15.5, 10.5, 20.5])));
        assert!((slices.zoom - 2.0).abs() < 1e-9, "an even factor");
        assert_eq!((middle.time, middle.tilts.unwrap()[2].yaw), (Some(3), 20.0));
        let times: Vec<u64> = (0..=20).map(|frame| path.pose_of_frame(frame).time.unwrap()).collect();
        assert!(times.is_sorted() && times[0] == 0 && times[20] == 5, "{times:?}");
        // Every line says as much as the others.
        let uneven = format!("vastex path 1\n0 {CAMERA};time=0\n1 {CAMERA}\n");
        let error = CameraPath::of_volume(&uneven).unwrap_err();
        assert!(error.line == 3 && error.why.contains("as much as the others"), "{error}");
    }

    #[test]
    fn a_recording_has_what_moved_and_passes_through_every_slice() {
        let of = VolumeBox::new([400, 300, 200], [1.0, 1.0, 2.0]);
        let place = |n: u32| VolumePlace {
            slices: Some(ViewSlices { at: [10, 20, n / 3], place: None, middle: None, zoom: 1.0 }),
            ..CAMERA.parse().unwrap()
        };
        let seen: Vec<(f64, VolumePlace)> = (0..=300).map(|n| (f64::from(n) / 30.0, place(n))).collect();
        let path = CameraPath::recorded_of_volume(30.0, &seen, &of).unwrap();
        for (time, place) in &seen {
            assert_eq!(path.pose(*time).slices.unwrap().at, place.slices.unwrap().at, "{time}");
        }
        assert_eq!(CameraPath::of_volume(&path.volume_text()), Ok(path));
        // Only the camera moves.
        let turned = |n: u32| VolumePlace { yaw: f64::from(n), time: Some(3), ..place(0) };
        let seen: Vec<(f64, VolumePlace)> = (0..=170).map(|n| (f64::from(n) / 30.0, turned(n))).collect();
        let path = CameraPath::recorded_of_volume(30.0, &seen, &of).unwrap();
        assert!(path.keys().iter().all(|(_, place)| place.slices.is_none() && place.time.is_none()));
        assert!(path.keys().len() < 20, "{}", path.keys().len());
        assert!((path.pose(2.0).yaw - 60.0).abs() < 0.2);
        assert_eq!(CameraPath::recorded_of_volume(30.0, &[], &of), None);
    }
}
