//! What a picture shows: one view of the scene, or two of them side by side, each a view of its own to the textures.

use glam::Vec2;

use crate::compare::Picture;
use crate::pose::Pose;

/// The views that are drawn in a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Views {
    /// One.
    #[default]
    One,
    /// What two eyes see, the left one's on the left.
    Stereo,
    /// What lies ahead, and on the right what a mirror shows: what lies behind, or on the other side. It is looked at in every
    /// fourth frame.
    Mirror,
}

/// Half the distance between two eyes, in the unit of [`Pose::walked`].
const HALF_EYES: f32 = 0.03;

impl Views {
    /// All of them.
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
        let aside = |distance| pose.walked(Vec2::new(distance, 0.0));
        match self {
            Views::One => (pose, None),
            Views::Stereo => (aside(-HALF_EYES), Some(aside(HALF_EYES))),
            Views::Mirror => (pose, Some(pose.turned_round())),
        }
    }

    /// Whether the second view says in a frame what it wants.
    pub(crate) fn is_due(self, frame: u64) -> bool {
        frame.is_multiple_of(self.every())
    }

    /// Frames between two feedbacks of the view that is drawn least often.
    pub(crate) fn every(self) -> u64 {
        if self == Views::Mirror { 4 } else { 1 }
    }

    /// What a pixel of the second view counts beside one of the main view.
    pub(crate) fn weight(self) -> f32 {
        if self == Views::Mirror { 0.5 } else { 1.0 }
    }

    /// Pixels of each view, where all of them are in a picture of so many.
    pub(crate) fn size_of_each(self, [width, height]: [u32; 2]) -> [u32; 2] {
        if self == Views::One { [width, height] } else { [width.div_ceil(2), height] }
    }
}

/// Puts pictures of the same size side by side and cuts what is beyond `size`.
pub(crate) fn side_by_side(pictures: &[Picture], size: [u32; 2]) -> Picture {
    let mut rgba = Vec::with_capacity(size[0] as usize * size[1] as usize * 4);
    for y in 0..size[1] as usize {
        let begin = rgba.len();
        for picture in pictures {
            let row = picture.size[0] as usize * 4;
            rgba.extend_from_slice(&picture.rgba[y * row..(y + 1) * row]);
        }
        rgba.truncate(begin + size[0] as usize * 4);
    }
    Picture { size, rgba }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_side_by_side_fill_the_size_whatever_it_is() {
        for size in [[8, 2], [7, 3], [1, 1]] {
            let each = Views::Stereo.size_of_each(size);
            let picture =
                |value: u8| Picture { size: each, rgba: vec![value; (each[0] * each[1] * 4) as usize] };
            let joined = side_by_side(&[picture(1), picture(2)], size);
            let row: Vec<u8> =
                joined.rgba.chunks_exact(4).take(size[0] as usize).map(|pixel| pixel[0]).collect();
            let expected: Vec<u8> = (0..size[0]).map(|x| if x < each[0] { 1 } else { 2 }).collect();
            assert_eq!((row, joined.rgba.len()), (expected, (size[0] * size[1] * 4) as usize));
        }
    }
}
