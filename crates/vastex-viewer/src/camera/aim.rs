//! Where a camera over a globe looks: straight down, or aslant in some direction.

use glam::{DMat3, DVec3};

use crate::scene::direction_f64;

/// How far from straight down a camera looks at most: 85 degrees.
const MOST_TILT: f64 = 85.0 * std::f64::consts::PI / 180.0;

/// Where a camera over a globe looks. Straight down north is upwards in the picture.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Aim {
    heading: f64,
    tilt: f64,
}

impl Aim {
    /// Straight down, north upwards.
    pub const DOWN: Aim = Aim { heading: 0.0, tilt: 0.0 };

    /// In a direction clockwise from north, so far from straight down, both in radians: the nearest to it
    /// that a camera can have.
    pub fn new(heading: f64, tilt: f64) -> Aim {
        Aim { heading: heading.rem_euclid(std::f64::consts::TAU), tilt: tilt.clamp(0.0, MOST_TILT) }
    }

    /// Radians clockwise from north, 0 to 2 pi.
    pub fn heading(self) -> f64 {
        self.heading
    }

    /// Radians from straight down, 0 to 85 degrees.
    pub fn tilt(self) -> f64 {
        self.tilt
    }

    /// Directions to the right, upwards in the picture and ahead, as columns: each by its parts to the east,
    /// to the north and upwards.
    pub(crate) fn local_from_view(self) -> DMat3 {
        let ((sin_heading, cos_heading), (sin_tilt, cos_tilt)) =
            (self.heading.sin_cos(), self.tilt.sin_cos());
        let along = DVec3::new(sin_heading, cos_heading, 0.0);
        DMat3::from_cols(
            DVec3::new(cos_heading, -sin_heading, 0.0),
            along * cos_tilt + DVec3::Z * sin_tilt,
            along * sin_tilt - DVec3::Z * cos_tilt,
        )
    }
}

/// Directions to the east, to the north and upwards over a globe, as columns.
pub(super) fn world_from_local(longitude: f64, latitude: f64) -> DMat3 {
    let ((sin_lon, cos_lon), (sin_lat, cos_lat)) = (longitude.sin_cos(), latitude.sin_cos());
    DMat3::from_cols(
        DVec3::new(-sin_lon, cos_lon, 0.0),
        DVec3::new(-cos_lon * sin_lat, -sin_lon * sin_lat, cos_lat),
        direction_f64(longitude, latitude),
    )
}
