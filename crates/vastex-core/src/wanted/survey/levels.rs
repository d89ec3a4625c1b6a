//! Levels drawn in texture space: a small image of a texture that says of each of its parts which level a
//! view needs there.
//!
//! How it is drawn is the GPU crate's business; here it becomes pages.

use super::look::{Footprint, feedback_pixels};
use super::surface::UvBox;
use super::walk::{Found, walk};
use crate::shader_constants::{STEPS_PER_LEVEL, TEXTURE_SPACE_FINEST};
use crate::texture::geometry::Geometry;
use crate::texture::page::{Dims, TextureNumber};
use crate::wanted::feedback::Feedback;

/// Texels of the image that are looked at for a page, along an axis; larger pages take texels of a coarser
/// image.
const LOOKED_AT: u32 = 8;

/// The level that each part of a texture needs, as drawn by `vastex_texture_space`: 0 where it is not seen,
/// else [`TEXTURE_SPACE_FINEST`] less the level in eighths.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LevelImage {
    /// The image, and images of half the size each, of the sharpest of the texels below.
    images: Vec<([u32; 2], Vec<u8>)>,
}

impl LevelImage {
    /// An image of so many texels, row by row; it stretches over the whole texture. Rows that lack count as
    /// not seen.
    pub fn new(size: [u32; 2], mut texels: Vec<u8>) -> LevelImage {
        let size = size.map(|side| side.max(1));
        texels.resize(size[0] as usize * size[1] as usize, 0);
        let mut images = vec![(size, texels)];
        while let Some((size, texels)) = images.last().filter(|(size, _)| *size != [1, 1]) {
            let half = size.map(|side| side.div_ceil(2));
            let mut sharpest = vec![0; half[0] as usize * half[1] as usize];
            for (at, &texel) in texels.iter().enumerate() {
                let (x, y) = (at as u32 % size[0], at as u32 / size[0]);
                let place = &mut sharpest[(y / 2 * half[0] + x / 2) as usize];
                *place = texel.max(*place);
            }
            images.push((half, sharpest));
        }
        LevelImage { images }
    }

    /// The pages that the view wants of a texture, at most `max_pages`, as the feedback of a frame. Every
    /// texel that a page touches counts for it, so where pages are smaller than texels more are wanted than
    /// need be. Of a volume nothing is.
    pub fn pages(
        &self,
        texture: TextureNumber,
        geometry: &Geometry,
        max_pages: usize,
        frame: u64,
    ) -> Feedback {
        let mut found = Found::default();
        if geometry.dims() == Dims::D2 {
            let size = [0, 1].map(|axis| f64::from(geometry.size()[axis]));
            walk(texture, geometry, max_pages, &mut found, |uv| self.look(uv, size));
        }
        Feedback::of_pages(frame, found.seen)
    }

    fn look(&self, uv: UvBox, size: [f64; 2]) -> Option<Footprint> {
        let sharpest = u32::from(self.sharpest(uv));
        let eighths = TEXTURE_SPACE_FINEST.checked_sub(sharpest).filter(|_| sharpest > 0)?;
        let lambda = f64::from(eighths) / f64::from(STEPS_PER_LEVEL);
        let texels: f64 = [0, 1].map(|axis| (uv[1][axis] - uv[0][axis]) * size[axis]).iter().product();
        Some(Footprint { lambda, pixels: feedback_pixels(texels / (2.0 * lambda).exp2()), is_seen: true })
    }

    /// The largest texel that a rectangle touches.
    fn sharpest(&self, uv: UvBox) -> u8 {
        let touched = |size: &[u32; 2]| {
            let first = [0, 1].map(|axis| ((uv[0][axis] * f64::from(size[axis])) as u32).min(size[axis] - 1));
            let last = [0, 1].map(|axis| {
                let end = (uv[1][axis] * f64::from(size[axis])).ceil() as u32;
                end.clamp(first[axis] + 1, size[axis]) - 1
            });
            (first, last)
        };
        let is_few = |(size, _): &&([u32; 2], Vec<u8>)| {
            let (first, last) = touched(size);
            (0..2).all(|axis| last[axis] - first[axis] < LOOKED_AT)
        };
        let Some((size, texels)) = self.images.iter().find(is_few) else { return 0 };
        let (first, last) = touched(size);
        let rows = (first[1]..=last[1]).map(|y| (y * size[0]) as usize);
        let of_row =
            |row: usize| texels[row + first[0] as usize..=row + last[0] as usize].iter().copied().max();
        rows.filter_map(of_row).max().unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::texture::geometry::GeometrySpec;

    fn texel(level: u32, eighth: u32) -> u8 {
        (TEXTURE_SPACE_FINEST - level * STEPS_PER_LEVEL - eighth) as u8
    }

    fn wanted(image: &LevelImage, geometry: &Geometry) -> Vec<(u8, u32, u32, u8)> {
        let feedback = image.pages(TextureNumber::new(1).unwrap(), geometry, 4096, 5);
        assert_eq!(feedback.frame, 5);
        let spelt_out = |wanted: &crate::wanted::feedback::WantedPage| {
            let pos = wanted.page.pos(geometry.dims());
            (pos.level, pos.x, pos.y, wanted.eighth)
        };
        feedback.pages.iter().map(spelt_out).collect()
    }

    #[test]
    fn each_page_is_wanted_as_sharply_as_the_sharpest_texel_in_it() {
        let geometry = Geometry::new(GeometrySpec::image(4096, 2048)).unwrap(); // 32 by 16 pages, tail from level 4 or 5
        let mut texels = vec![0; 64 * 32];
        texels[10 * 64 + 21] = texel(0, 3); // page 10,5
        texels[10 * 64 + 22] = texel(1, 2); // page 11,5 of level 0, so page 5,2 of level 1
        assert_eq!(wanted(&LevelImage::new([64, 32], texels), &geometry), [(0, 10, 5, 3), (1, 5, 2, 2)]);
        assert_eq!(wanted(&LevelImage::new([64, 32], Vec::new()), &geometry), []);
        let volume = Geometry::new(GeometrySpec::volume([64; 3])).unwrap();
        assert_eq!(wanted(&LevelImage::new([1, 1], vec![255]), &volume), []);
    }

    #[test]
    fn an_image_coarser_than_pages_wants_all_that_it_covers() {
        let geometry = Geometry::new(GeometrySpec::image(4096, 2048)).unwrap();
        let all = wanted(&LevelImage::new([3, 1], vec![0, texel(1, 0), 0]), &geometry);
        // The middle third of 16 pages of level 1, and what it touches.
        let columns: Vec<u32> = all.iter().filter(|(_, _, y, _)| *y == 0).map(|&(_, x, ..)| x).collect();
        assert_eq!((all.len(), columns), (6 * 8, (5..=10).collect()));
    }
}
