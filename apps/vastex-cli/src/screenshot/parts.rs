//! A picture in parts, each small enough to be drawn at once: which they are, and what a camera sees in one.

use glam::DVec2;
use vastex_scenes::{Picture, Pose};
use vastex_viewer::layers::CompareMode;

/// A part of a picture. The last ones may reach beyond it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Part {
    /// Its first pixel.
    pub(super) at: [u32; 2],
    /// Its width and height, the same of all parts.
    pub(super) size: [u32; 2],
}

/// The parts of a picture with at most so many pixels a side each, row by row.
pub(super) fn parts(size: [u32; 2], most: u32) -> Vec<Part> {
    let count = size.map(|side| side.div_ceil(most.max(1)).max(1));
    let side = [0, 1].map(|n: usize| size[n].div_ceil(count[n]));
    let part = |column: u32, row: u32| Part { at: [column * side[0], row * side[1]], size: side };
    (0..count[1]).flat_map(|row| (0..count[0]).map(move |column| part(column, row))).collect()
}

impl Part {
    /// Puts the picture of the part into the whole.
    pub(super) fn put(&self, picture: &Picture, whole: &mut Picture) {
        let [left, top] = self.at.map(|at| at as usize);
        let [width, height] = whole.size.map(|side| side as usize);
        let count = (self.size[0] as usize).min(width.saturating_sub(left));
        let rows = picture.rgba.chunks_exact(picture.size[0] as usize * 4);
        for (row, pixels) in rows.enumerate().take(height.saturating_sub(top)) {
            let start = ((top + row) * width + left) * 4;
            whole.rgba[start..start + count * 4].copy_from_slice(&pixels[..count * 4]);
        }
    }

    /// The part of the whole; beyond it nothing.
    pub(super) fn of(&self, whole: &Picture) -> Picture {
        let [left, top] = self.at.map(|at| at as usize);
        let [width, height] = whole.size.map(|side| side as usize);
        let line = self.size[0] as usize * 4;
        let mut rgba = vec![0; line * self.size[1] as usize];
        let count = (self.size[0] as usize).min(width.saturating_sub(left));
        for (row, pixels) in rgba.chunks_exact_mut(line).enumerate().take(height.saturating_sub(top)) {
            let start = ((top + row) * width + left) * 4;
            pixels[..count * 4].copy_from_slice(&whole.rgba[start..start + count * 4]);
        }
        Picture { size: self.size, rgba }
    }
}

/// The pose by which a part shows what it is of a picture of `size` pixels over an image of `image` texels. A
/// pose of a scene with perspective, which has one part, stays.
pub(super) fn pose_of_part(pose: &Pose, size: [u32; 2], image: [u32; 2], part: &Part) -> Pose {
    let (Some(placed), Pose::Image { zoom, orientation, .. }) = (pose.placement(size, image), *pose) else {
        return *pose;
    };
    if *part == (Part { at: [0; 2], size }) {
        return *pose;
    }
    let middle = DVec2::from(part.at.map(f64::from)) + DVec2::from(part.size.map(f64::from)) / 2.0;
    let centre = placed.texel(middle) / DVec2::from(image.map(f64::from));
    let there = Pose::Image { centre, zoom, orientation };
    let scale = there.magnification(part.size, image).unwrap_or(placed.scale);
    Pose::Image { centre, zoom: zoom * placed.scale / scale, orientation }
}

/// How layers are compared in a part: the line of a swipe lies where it lies in the whole.
pub(super) fn swipe_of_part(mode: CompareMode, size: [u32; 2], part: &Part) -> CompareMode {
    match mode {
        CompareMode::Swipe(at) => {
            let within = f64::from(at) * f64::from(size[0]) - f64::from(part.at[0]);
            CompareMode::Swipe((within / f64::from(part.size[0])).clamp(0.0, 1.0) as f32)
        }
        mode => mode,
    }
}

#[cfg(test)]
mod tests {
    use vastex_viewer::camera::Orientation;

    use super::*;

    #[test]
    fn parts_cover_a_picture_and_put_it_together() {
        for (size, most) in [([7, 5], 3), ([8, 8], 8), ([9, 1], 4), ([1, 1], 100), ([16, 3], 5)] {
            let pixels = size[0] * size[1] * 4;
            let whole = Picture { size, rgba: (0..pixels).map(|n| n as u8).collect() };
            let mut again = Picture { size, rgba: vec![0; pixels as usize] };
            for part in parts(size, most) {
                assert!(part.size.iter().all(|side| (1..=most).contains(side)), "{part:?}");
                part.put(&part.of(&whole), &mut again);
            }
            assert_eq!(again, whole, "{size:?} {most}");
        }
        assert_eq!(parts([100, 50], 100), [Part { at: [0; 2], size: [100, 50] }]);
    }

    #[test]
    fn a_part_shows_what_it_is_of_the_whole() {
        let (size, image) = ([1000, 700], [5000, 3000]);
        for (degrees, is_mirrored) in [(0.0, false), (90.0, true), (33.0, false)] {
            let orientation = Orientation::new(degrees, is_mirrored);
            let pose = Pose::Image { centre: DVec2::new(0.3, 0.6), zoom: 3.0, orientation };
            let whole = pose.placement(size, image).unwrap();
            for part in parts(size, 300) {
                let placed = pose_of_part(&pose, size, image, &part).placement(part.size, image).unwrap();
                for pixel in [DVec2::ZERO, DVec2::new(17.5, 201.0)] {
                    let expected = whole.texel(pixel + DVec2::from(part.at.map(f64::from)));
                    assert!(placed.texel(pixel).distance(expected) < 1e-6, "{part:?} {pixel}");
                }
            }
        }
        let globe = Pose::first(vastex_scenes::Scene::Globe);
        assert_eq!(pose_of_part(&globe, size, image, &Part { at: [0; 2], size }), globe);
    }

    #[test]
    fn the_line_of_a_swipe_stays_where_it_is() {
        let lines: Vec<CompareMode> = parts([100, 10], 40)
            .iter()
            .map(|part| swipe_of_part(CompareMode::Swipe(0.5), [100, 10], part))
            .collect();
        // Parts of 34 pixels: it is beyond the first, in the second at 16, and before the third.
        assert_eq!(lines, [1.0, 16.0 / 34.0, 0.0].map(CompareMode::Swipe));
    }
}
