//! Pictures that have been drawn, as bytes.

/// A picture: RGBA, 8 bits each, row by row. An alpha of 0 says that the texture does not cover the pixel.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Four bytes for each pixel.
    pub rgba: Vec<u8>,
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
