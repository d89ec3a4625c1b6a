//! What a picture shows: one view of the scene, or two of them side by side, each a view of its own to the
//! textures.

use glam::DVec2;

use super::pose::Pose;

/// The views that are drawn in a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Views {
    /// One.
    #[default]
    One,
    /// What two eyes see, the left one's on the left.
    Stereo,
    /// The view ahead, and on the right a mirror: what lies behind, or on the other side. The mirror is drawn
    /// in every fourth frame.
    Mirror,
}

/// Half the distance between two eyes, in the unit of [`Pose::walked`].
const HALF_EYES: f64 = 0.03;

impl Views {
    /// Every choice of views.
    pub const ALL: [Views; 3] = [Views::One, Views::Stereo, Views::Mirror];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Views::One => "one",
            Views::Stereo => "stereo",
            Views::Mirror => "mirror",
        }
    }

    /// The poses of the views, where the camera has this one; that of the main view first.
    pub fn poses(self, pose: Pose) -> (Pose, Option<Pose>) {
        // A step to the side, as in a square.
        let aside = |distance| pose.walked(DVec2::new(distance, 0.0), 1.0);
        match self {
            Views::One => (pose, None),
            Views::Stereo => (aside(-HALF_EYES), Some(aside(HALF_EYES))),
            Views::Mirror => (pose, Some(pose.turned_round())),
        }
    }

    /// Returns true if the second view says in a frame what it wants.
    pub fn is_due(self, frame: u64) -> bool {
        frame.is_multiple_of(self.every())
    }

    /// Frames between two feedbacks of the view that is drawn least often.
    pub fn every(self) -> u64 {
        if self == Views::Mirror { 4 } else { 1 }
    }

    /// What a pixel of the second view counts beside one of the main view.
    pub fn weight(self) -> f32 {
        if self == Views::Mirror { 0.5 } else { 1.0 }
    }

    /// Pixels of each view, where all of them are in a picture of so many.
    pub fn size_of_each(self, [width, height]: [u32; 2]) -> [u32; 2] {
        if self == Views::One { [width, height] } else { [width.div_ceil(2), height] }
    }
}
