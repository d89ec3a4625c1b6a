//! Places of a camera round a volume, and paths through them.

use std::fmt::{self, Display};
use std::str::FromStr;

use super::VolumeViewText;
use crate::camera::{CameraPath, CameraPathError, PathChannels, PathPlace};

/// From where all of a volume is seen, as the first part of the text of a view of it says.
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
}

impl VolumePlace {
    /// A view from this place, in all else as it is.
    pub fn of(self, view: &VolumeViewText) -> VolumeViewText {
        let VolumePlace { target, zoom, yaw, pitch } = self;
        VolumeViewText { target, zoom, yaw, pitch, ..view.clone() }
    }
}

impl PathPlace for VolumePlace {
    fn kind(&self) -> &'static str {
        "volume"
    }

    fn channels(&self) -> PathChannels {
        let [x, y, z] = self.target;
        [x, y, z, self.zoom.ln(), self.yaw.to_radians(), self.pitch.to_radians()]
    }

    fn at(&self, [x, y, z, zoom, yaw, pitch]: PathChannels) -> VolumePlace {
        let (yaw, pitch) = (yaw.to_degrees(), pitch.to_degrees());
        VolumePlace { target: [x, y, z], zoom: zoom.exp(), yaw, pitch }
    }

    fn angles(&self) -> &'static [usize] {
        &[4, 5]
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
        let VolumeViewText { target, zoom, yaw, pitch, .. } = view;
        let place = VolumePlace { target, zoom, yaw, pitch };
        if place.of(&VolumeViewText::default()) != view {
            return Err("a path says where the camera is, and nothing else: leave out what is after that; \
                 --view and the other options say what is shown"
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
        let VolumePlace { target, zoom, yaw, pitch } = path.pose_of_frame(10);
        assert_eq!((target, (zoom - 2.0).abs() < 1e-9), ([15.0, 20.0, 30.0], true), "an even factor");
        assert!((yaw - 180.0).abs() < 1e-9 && (pitch - 20.0).abs() < 1e-9, "the shorter way: {yaw}");
        let head = "vastex path 1\n";
        for (line, why) in [
            ("0 image:x=1,y=2,zoom=3", "write volume:x=..,y=..,z=.."),
            ("soon volume:x=1", "'2.5 volume:x=49,"),
            ("0 volume:x=1,y=2,z=3,zoom=1,yaw=0,pitch=0;mode=mip", "nothing else"),
            ("0 volume:x=1,y=2,z=3,zoom=0,yaw=0,pitch=0", "greater than 0"),
            ("# nothing", "as '0 volume:x=49,"),
        ] {
            let error = CameraPath::of_volume(&format!("{head}{line}\n")).unwrap_err();
            assert!(error.line <= 2 && error.why.contains(why), "{line}: {error}");
        }
    }
}
