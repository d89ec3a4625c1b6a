//! How an image is turned and mirrored in a picture of it.

use glam::{DMat2, DVec2};

/// How an image is turned in a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Orientation {
    /// By how much it is turned clockwise, in degrees, 0 to 360, after it was mirrored.
    degrees: f64,
    /// True if left and right of it are exchanged.
    is_mirrored: bool,
}

impl Orientation {
    /// The orientation of an image that is shown as it is stored.
    pub const UPRIGHT: Orientation = Orientation { degrees: 0.0, is_mirrored: false };

    /// Mirrored from left to right, if so, and then turned clockwise by so many degrees; by none where that
    /// is no number.
    pub fn new(degrees: f64, is_mirrored: bool) -> Orientation {
        // A remainder may be rounded up to the whole.
        let within = degrees.rem_euclid(360.0);
        Orientation { degrees: if within < 360.0 { within } else { 0.0 }, is_mirrored }
    }

    /// By how much the image is turned clockwise, in degrees from 0 to less than 360, after it was mirrored.
    pub fn degrees(self) -> f64 {
        self.degrees
    }

    /// Returns true if left and right of the image are exchanged before it is turned.
    pub fn is_mirrored(self) -> bool {
        self.is_mirrored
    }

    /// What is seen, turned clockwise by so many degrees more.
    #[must_use]
    pub fn turned(self, degrees: f64) -> Orientation {
        Orientation::new(self.degrees + degrees, self.is_mirrored)
    }

    /// What is seen, with left and right exchanged.
    #[must_use]
    pub fn mirrored(self) -> Orientation {
        Orientation::new(-self.degrees, !self.is_mirrored)
    }

    /// Returns true if rows of the image are rows or columns of the picture.
    pub fn is_axis_aligned(self) -> bool {
        self.degrees % 90.0 == 0.0
    }

    /// Sine and cosine of the turn, exact for whole quarters.
    fn sine_and_cosine(self) -> (f64, f64) {
        match self.degrees {
            0.0 => (0.0, 1.0),
            90.0 => (1.0, 0.0),
            180.0 => (0.0, -1.0),
            270.0 => (-1.0, 0.0),
            degrees => degrees.to_radians().sin_cos(),
        }
    }

    /// A step in the image as it is seen; both to the right and downwards.
    pub(crate) fn seen_from_image(self) -> DMat2 {
        let (sine, cosine) = self.sine_and_cosine();
        let across = if self.is_mirrored { -1.0 } else { 1.0 };
        DMat2::from_cols(across * DVec2::new(cosine, sine), DVec2::new(-sine, cosine))
    }

    /// A step in the picture as it is one in the image; both to the right and downwards.
    pub(crate) fn image_from_seen(self) -> DMat2 {
        // A turn's inverse, and a mirror's, is its transpose.
        self.seen_from_image().transpose()
    }

    /// Width and height of what an image of so much takes when it is turned.
    pub(crate) fn extent(self, size: DVec2) -> DVec2 {
        self.seen_from_image().abs() * size
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_turned_and_mirrored_comes_back() {
        for (degrees, is_mirrored) in [(0.0, false), (90.0, false), (200.0, true), (359.9, true)] {
            let orientation = Orientation::new(degrees, is_mirrored);
            assert_eq!(orientation.turned(90.0).turned(-90.0).is_mirrored(), is_mirrored);
            assert!((orientation.turned(77.0).turned(-77.0).degrees() - degrees).abs() < 1e-9);
            let twice = orientation.mirrored().mirrored();
            assert!((twice.degrees() - degrees).abs() < 1e-9 && twice.is_mirrored() == is_mirrored);
        }
        assert_eq!(Orientation::new(-90.0, false).degrees(), 270.0);
        assert_eq!(Orientation::new(-1e-20, false).degrees(), 0.0);
        assert_eq!(Orientation::new(f64::NAN, false), Orientation::UPRIGHT);
    }

    #[test]
    fn a_turn_is_clockwise_as_it_is_seen_whether_it_is_mirrored_or_not() {
        let right = DVec2::X;
        let seen = |orientation: Orientation, step: DVec2| orientation.seen_from_image() * step;
        assert_eq!(seen(Orientation::new(90.0, false), right), DVec2::Y, "what was to the right is below");
        assert_eq!(seen(Orientation::UPRIGHT.mirrored(), right), -DVec2::X);
        assert_eq!(seen(Orientation::UPRIGHT.mirrored().turned(90.0), right), -DVec2::Y);
        // What lies above stays above when left and right of a turned picture are exchanged.
        let up = Orientation::new(90.0, false).mirrored();
        assert_eq!((seen(up, right), seen(up, DVec2::Y)), (DVec2::Y, DVec2::X));
        assert_eq!(Orientation::new(90.0, true).extent(DVec2::new(4.0, 3.0)), DVec2::new(3.0, 4.0));
    }
}
