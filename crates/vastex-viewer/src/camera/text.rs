//! The text form of a pose, to be written down and found again: an image in texels, the plane in halves of
//! its width, the globe in degrees and metres.
//!
//! `image:x=5400.5,y=2700,zoom=12`, `plane:x=0,y=-0.45,z=0.29,yaw=0,pitch=45`,
//! `globe:lon=11.5,lat=46.4,alt=1200m`. An image that is turned has `,turn=90` as well, in degrees clockwise;
//! one whose left and right are exchanged first has `,mirror=1`.

use glam::{DVec2, DVec3};

use super::aim::Aim;
use super::orientation::Orientation;
use super::pose::{METRE, Pose};

/// A text is no pose.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "'{text}' is no view{}: write image:x=..,y=..,zoom=.. in texels, with turn=.. in degrees and mirror=1 if you \
     like, plane:x=..,y=..,z=..,yaw=..,pitch=.. in halves of its width and degrees, or globe:lon=..,lat=..,alt=..m in degrees and metres",
    .place.as_deref().map(|place| format!(", because of '{place}'")).unwrap_or_default()
)]
pub struct PoseTextError {
    /// The text.
    pub text: String,
    /// The part of the text that cannot be read; `None` if its kind is unknown.
    pub place: Option<String>,
}

impl Pose {
    /// The text of a pose over an image of `size` texels.
    pub fn to_text(&self, size: [u32; 2]) -> String {
        match *self {
            Pose::Image { centre, zoom, orientation } => {
                let DVec2 { x, y } = centre * DVec2::from(size.map(f64::from));
                let turn = match orientation.degrees() {
                    0.0 => String::new(),
                    degrees => format!(",turn={degrees}"),
                };
                let mirror = if orientation.is_mirrored() { ",mirror=1" } else { "" };
                format!("image:x={x},y={y},zoom={zoom}{turn}{mirror}")
            }
            Pose::Plane { eye: DVec3 { x, y, z }, yaw, pitch } => {
                format!("plane:x={x},y={y},z={z},yaw={},pitch={}", yaw.to_degrees(), pitch.to_degrees())
            }
            Pose::Globe { longitude, latitude, altitude, aim } => {
                let degrees = |name: &str, angle: f64| match angle {
                    0.0 => String::new(),
                    angle => format!(",{name}={}", angle.to_degrees()),
                };
                format!(
                    "globe:lon={},lat={},alt={}m{}{}",
                    longitude.to_degrees(),
                    latitude.to_degrees(),
                    altitude / METRE,
                    degrees("heading", aim.heading()),
                    degrees("tilt", aim.tilt())
                )
            }
        }
    }

    /// The pose of a text over an image of `size` texels, each number once and in any order.
    pub fn from_text(text: &str, size: [u32; 2]) -> Result<Pose, PoseTextError> {
        let error =
            |place: Option<&str>| PoseTextError { text: text.to_owned(), place: place.map(str::to_owned) };
        let (kind, words) = text.split_once(':').ok_or_else(|| error(None))?;
        let names: &[&str] = match kind {
            "image" => &["x", "y", "zoom", "turn", "mirror"],
            "plane" => &["x", "y", "z", "yaw", "pitch"],
            "globe" => &["lon", "lat", "alt", "heading", "tilt"],
            _ => return Err(error(Some(kind))),
        };
        let mut numbers: Vec<Option<f64>> = vec![None; names.len()];
        for word in words.split(',') {
            let found = word.split_once('=').and_then(|(name, number)| {
                let at = names.iter().position(|known| *known == name)?;
                let number = if name == "alt" { number.strip_suffix('m')? } else { number };
                Some((at, number.parse().ok().filter(|number: &f64| number.is_finite())?))
            });
            match found {
                Some((at, number)) if numbers[at].is_none() => numbers[at] = Some(number),
                _ => return Err(error(Some(word))),
            }
        }
        // What nothing is said of is as it is stored.
        for (name, number) in names.iter().zip(&mut numbers) {
            match name {
                &"turn" | &"mirror" | &"heading" | &"tilt" => *number = number.or(Some(0.0)),
                name if number.is_none() => return Err(error(Some(name))),
                _ => {}
            }
        }
        let numbers: Vec<f64> = numbers.into_iter().flatten().collect();
        let pose = match (kind, &numbers[..]) {
            ("image", &[x, y, zoom, turn, mirror]) if zoom > 0.0 => {
                let orientation = match mirror {
                    0.0 => Orientation::new(turn, false),
                    1.0 => Orientation::new(turn, true),
                    _ => return Err(error(Some("mirror"))),
                };
                let centre = DVec2::new(x, y) / DVec2::from(size.map(f64::from));
                Pose::Image { centre, zoom, orientation }
            }
            ("plane", &[x, y, z, yaw, pitch]) => {
                let (yaw, pitch) = (yaw.to_radians(), pitch.to_radians());
                Pose::Plane { eye: DVec3::new(x, y, z), yaw, pitch }
            }
            ("globe", &[lon, lat, alt, heading, tilt]) if alt > 0.0 => {
                let aim = Aim::new(heading.to_radians(), tilt.to_radians());
                Pose::globe(lon.to_radians(), lat.to_radians(), alt * METRE).with_aim(aim)
            }
            _ => return Err(error(Some(if kind == "globe" { "alt" } else { "zoom" }))),
        };
        // Within the bounds that a camera has.
        Ok(pose.at(pose.over()).zoomed(1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [u32; 2] = [1 << 31, 1 << 30];

    #[test]
    fn a_text_is_the_pose_again() {
        for pose in [
            Pose::image(DVec2::new(0.123_456_789_012, 0.7), 1.5e8),
            Pose::Image {
                centre: DVec2::new(0.25, 0.5),
                zoom: 2.0,
                orientation: Orientation::new(22.5, true),
            },
            Pose::Plane { eye: DVec3::new(0.1, -0.45, 0.29), yaw: 0.3, pitch: 0.785 },
            Pose::globe(-3.1, 0.81, 3e-7),
            Pose::globe(1.0, -0.4, 0.1).with_aim(Aim::new(5.0, 1.2)),
        ] {
            let text = pose.to_text(SIZE);
            let again = Pose::from_text(&text, SIZE).unwrap();
            assert!((again.over() - pose.over()).length() < 1e-15, "{text}: {again:?}");
            let near = |pose: Pose| match pose {
                Pose::Image { zoom, .. } => zoom,
                Pose::Plane { eye, .. } => eye.z,
                Pose::Globe { altitude, .. } => altitude,
            };
            assert!((near(again) / near(pose) - 1.0).abs() < 1e-14, "{text}");
            assert_eq!(again.orientation(), pose.orientation(), "{text}");
        }
        let text = "globe:lon=11.5,lat=46.4,alt=1200m";
        let Pose::Globe { latitude, .. } = Pose::from_text(text, SIZE).unwrap() else { panic!("{text}") };
        assert!((latitude.to_degrees() - 46.4).abs() < 1e-12);
    }

    #[test]
    fn what_is_no_pose_is_told_by_its_place() {
        for (text, place) in [
            ("", None),
            ("volume:x=1", Some("volume")),
            ("image:x=1,y=2", Some("zoom")),
            ("image:x=1,y=2,zoom=0", Some("zoom")),
            ("image:x=1,y=2,zoom=1,mirror=2", Some("mirror")),
            ("image:x=1,y=2,zoom=1,turn=a", Some("turn=a")),
            ("image:x=1,x=2,y=3,zoom=1", Some("x=2")),
            ("image:x=1,y=nan,zoom=1", Some("y=nan")),
            ("globe:lon=1,lat=2,alt=3", Some("alt=3")),
            ("plane:x=1,y=2,z=3,yaw=4,roll=5", Some("roll=5")),
        ] {
            let error = Pose::from_text(text, SIZE).unwrap_err();
            assert_eq!(error.place.as_deref(), place, "{error}");
            assert!(error.to_string().contains("globe:lon"), "{error}");
        }
    }
}
