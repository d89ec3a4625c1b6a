//! Pictures that have been drawn, as bytes, and parts of pictures: those that are drawn on their own, and
//! those around which a picture shows more.

use glam::{DMat4, DVec2, DVec4, Mat4};

/// A picture: RGBA, 8 bits each, row by row. An alpha of 0 says that the texture does not cover the pixel.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Four bytes for each pixel.
    pub rgba: Vec<u8>,
}

/// A part of a picture that is drawn on its own, as it is seen in the whole: by the same camera, at the same
/// levels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PicturePart {
    /// Width and height of the whole, in pixels.
    pub whole: [u32; 2],
    /// Column and row of the part's first pixel in the whole; it may lie before it.
    pub at: [i64; 2],
    /// Width and height of the part, which may reach beyond the whole.
    pub size: [u32; 2],
}

impl PicturePart {
    /// All of a picture.
    pub fn all(size: [u32; 2]) -> PicturePart {
        PicturePart { whole: size, at: [0; 2], size }
    }

    /// A picture of so many pixels, of which nothing covers the part between the corners `free`, in pixels
    /// from the top left, as the part that it is of what a camera sees: the camera looks at the middle of the
    /// free part, and the picture shows more around what it sees.
    ///
    /// The whole is as wide as the free part and as high. Where that is narrower than high, it is lower, so
    /// that as much is seen across it as upwards; but in a picture that is narrower than high, no more than
    /// in all of it. All of the picture if the free part is less than a pixel wide or high.
    pub fn around(picture: [u32; 2], free: [DVec2; 2]) -> PicturePart {
        let sides = DVec2::from(picture.map(f64::from));
        let (low, high) = (free[0].max(DVec2::ZERO).ceil(), free[1].min(sides).floor());
        let size = high - low;
        if !size.cmpge(DVec2::ONE).all() || size == sides {
            return PicturePart::all(picture);
        }
        let least_across = (sides.x / sides.y).min(1.0);
        let above = ((size.y - size.y.min(size.x / least_across)) / 2.0).floor();
        PicturePart {
            whole: [size.x as u32, (size.y - 2.0 * above) as u32],
            at: [-low.x as i64, -(low.y + above) as i64],
            size: picture,
        }
    }

    /// Where a camera sees a place of the part, told in pixels from the part's top left: in heights of the
    /// whole from its middle, x to the right and y downwards, as moves of a camera are told.
    pub fn point(&self, pixel: DVec2) -> DVec2 {
        let whole = DVec2::from(self.whole.map(f64::from));
        let at = DVec2::new(self.at[0] as f64, self.at[1] as f64);
        (pixel + at - 0.5 * whole) / whole.y.max(1.0)
    }

    /// From places of the part, -1 to 1 to the right and upwards, to those of the whole: what they are
    /// multiplied by, and then what is added.
    pub(crate) fn whole_from_part(&self) -> [DVec2; 2] {
        let sides = |sides: [u32; 2]| DVec2::from(sides.map(f64::from));
        let (whole, size) = (sides(self.whole), sides(self.size));
        let at = DVec2::new(self.at[0] as f64, self.at[1] as f64);
        let middle = (2.0 * at + size) / whole - 1.0;
        [size / whole, DVec2::new(middle.x, -middle.y)]
    }

    /// A matrix to the clip space of the whole, to that of the part.
    pub(crate) fn cropped(&self, clip_from_world: Mat4) -> Mat4 {
        if *self == PicturePart::all(self.whole) {
            return clip_from_world;
        }
        (self.clip_from_whole() * clip_from_world.as_dmat4()).as_mat4()
    }

    /// From the clip space of the whole to that of the part.
    pub(crate) fn clip_from_whole(&self) -> DMat4 {
        let [scale, offset] = self.whole_from_part();
        let shift = -offset / scale;
        DMat4::from_cols(
            DVec4::new(1.0 / scale.x, 0.0, 0.0, 0.0),
            DVec4::new(0.0, 1.0 / scale.y, 0.0, 0.0),
            DVec4::Z,
            DVec4::new(shift.x, shift.y, 0.0, 1.0),
        )
    }
}

impl From<[u32; 2]> for PicturePart {
    /// All of a picture of so many pixels.
    fn from(size: [u32; 2]) -> PicturePart {
        PicturePart::all(size)
    }
}

/// Puts pictures of the same size side by side and cuts what is beyond `size`.
pub fn side_by_side(pictures: &[Picture], size: [u32; 2]) -> Picture {
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
    use crate::camera::Views;

    #[test]
    fn a_part_is_seen_where_it_is_in_the_whole() {
        let whole = [1000, 700];
        let part = PicturePart { whole, at: [-32, 600], size: [300, 128] };
        let clip = |pixel: DVec2, at: DVec2, size: [u32; 2]| {
            let place = (pixel - at) / DVec2::from(size.map(f64::from)) * 2.0 - 1.0;
            DVec2::new(place.x, -place.y)
        };
        for pixel in [DVec2::new(-32.0, 600.0), DVec2::new(17.5, 650.25), DVec2::new(268.0, 728.0)] {
            let seen = clip(pixel, DVec2::new(-32.0, 600.0), part.size);
            let in_whole = clip(pixel, DVec2::ZERO, whole);
            let [scale, offset] = part.whole_from_part();
            assert!((seen * scale + offset).distance(in_whole) < 1e-12, "{pixel}");
            // Whatever is farther away has a larger w.
            let w = 3.5;
            let clipped = part.clip_from_whole() * (in_whole * w).extend(0.25).extend(w);
            assert!((clipped.truncate().truncate() / w).distance(seen) < 1e-12, "{pixel}");
            assert_eq!((clipped.z, clipped.w), (0.25, w));
        }
        assert_eq!(PicturePart::all(whole).whole_from_part(), [DVec2::ONE, DVec2::ZERO]);
        assert_eq!(PicturePart::all(whole).clip_from_whole(), DMat4::IDENTITY);
    }

    #[test]
    fn a_camera_looks_at_the_middle_of_what_is_free() {
        let free = |low: [f64; 2], high: [f64; 2]| [DVec2::from(low), DVec2::from(high)];
        for (picture, [low, high], height) in [
            // Beside a panel; between two; beside one in a narrow window; below titles, with half pixels.
            ([1280, 800], free([0.0, 0.0], [960.0, 800.0]), 800),
            ([1280, 800], free([348.0, 0.0], [960.0, 800.0]), 612),
            ([640, 480], free([0.0, 0.0], [320.0, 480.0]), 320),
            ([641, 479], free([0.4, 32.0], [321.6, 479.0]), 321),
            // What is narrower than high stays as it is where nothing is narrower than the picture.
            ([400, 800], free([0.0, 100.0], [400.0, 800.0]), 700),
            ([400, 800], free([0.0, 0.0], [200.0, 800.0]), 400),
            // A picture that is as high as wide, and what a camera makes of a single row.
            ([100, 100], free([20.0, 50.0], [80.0, 51.0]), 1),
        ] {
            let part = PicturePart::around(picture, [low, high]);
            let (low, high) = (low.ceil(), high.floor());
            assert_eq!((part.whole[0], part.size), ((high.x - low.x) as u32, picture), "{part:?}");
            // To a pixel, so that its rows are a whole number above and below.
            assert!(part.whole[1].abs_diff(height) <= 1, "{part:?}");
            let middle = (low + high) / 2.0;
            assert_eq!(part.point(middle), DVec2::ZERO, "{part:?}");
            let whole = DVec2::from(part.whole.map(f64::from));
            let step = DVec2::new(30.0, -20.0);
            assert!(part.point(middle + step).distance(step / whole.y) < 1e-12);
            // The matrix has it there, too.
            let [scale, offset] = part.whole_from_part();
            let place = middle / DVec2::from(picture.map(f64::from)) * 2.0 - 1.0;
            assert!((place * DVec2::new(1.0, -1.0) * scale + offset).length() < 1e-12, "{part:?}");
        }
        let picture = [300, 200];
        for all in [
            free([0.0, 0.0], [300.0, 200.0]),
            free([-8.0, 0.0], [500.0, 200.0]),
            free([120.0, 0.0], [120.5, 200.0]),
            free([200.0, 0.0], [100.0, 200.0]),
            [DVec2::NAN, DVec2::NAN],
        ] {
            assert_eq!(PicturePart::around(picture, all), PicturePart::all(picture), "{all:?}");
        }
        let all = PicturePart::from(picture);
        assert_eq!(all.point(DVec2::new(150.0, 100.0)), DVec2::ZERO);
        assert_eq!(all.point(DVec2::new(0.0, 200.0)), DVec2::new(-0.75, 0.5));
    }

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
