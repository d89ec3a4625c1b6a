//! How large a pool a picture asks for, before anything was drawn: the arithmetic behind pools without a size
//! of their own.

use std::fmt;

use crate::texture::format::Description;
use crate::texture::page::Dims;

/// A pool in which the working set of one picture fits without a mip bias, if its surfaces cover each pixel
/// once and are not cut into many small pieces: textures share the pixels of the picture, so their number
/// hardly matters. Of a volume it is one in which all fits that rays through the picture meet, as deep as the
/// picture is wide, and no more than four volumes of its size have: channels share a pool.
///
/// ```
/// use vastex_core::{Description, Geometry, GeometrySpec, LayerFormat, PoolEstimate};
/// let geometry = Geometry::new(GeometrySpec::image(10800, 5400))?; // pages of 128 texels, border 4
/// let estimate = PoolEstimate::new(&Description::one_layer(geometry, LayerFormat::Rgba8), [1280, 720]);
/// assert_eq!((estimate.in_view, estimate.with_ancestors, estimate.slots), (22 * 14, 411, 514));
/// assert_eq!(estimate.bytes(), 514 * 136 * 136 * 4);
/// # Ok::<(), vastex_core::GeometryError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PoolEstimate {
    /// Size of the picture in pixels.
    pub picture: [u32; 2],
    /// Payload of a page in texels; along z 1 for an image.
    pub page: [u32; 3],
    /// Pages across and down that a surface over the whole picture shows, however it is turned: of the wanted
    /// level up to two texels fall on a pixel along each axis, and one page more is cut at each edge. Of a
    /// volume also away from the viewer; of an image one.
    pub pages: [u64; 3],
    /// Pages in view, of the wanted level: the product of `pages`, but of a volume no more than four of its
    /// size have.
    pub in_view: u64,
    /// Pages in view with their ancestors: of an image a quarter as many on each coarser level, a third more
    /// in all; of a volume an eighth as many, a seventh more.
    pub with_ancestors: u64,
    /// Slots for pages in view and their ancestors, with head room: a bias falls again only where the set
    /// fits 80 % of the slots.
    pub slots: u64,
    /// Bytes of a tile, all layers and the border.
    pub tile_bytes: u64,
}

/// Channels of a volume that a pool is made for.
const CHANNELS: u64 = 4;

impl PoolEstimate {
    /// No pool is made larger unless it is told to be: 1 GiB.
    pub const MOST_BYTES: u64 = 1 << 30;

    /// For a texture and a picture of `picture` pixels.
    pub fn new(description: &Description, picture: [u32; 2]) -> PoolEstimate {
        let geometry = &description.geometry;
        let page = geometry.page();
        let [width, height] = picture;
        let across = |pixels: u32, side: u32| (2 * u64::from(pixels)).div_ceil(u64::from(side.max(1))) + 2;
        let [x, y] = [across(width, page[0]), across(height, page[1])];
        // What is in view of an image is never more than the picture asks for, whatever the image repeats.
        let (z, most, ancestors) = match geometry.dims() {
            Dims::D2 => (1, u64::MAX, [4, 3]),
            Dims::D3 => {
                let all = geometry.level(0).page_count().saturating_mul(CHANNELS);
                (across(width.max(height), page[2]), all, [8, 7])
            }
        };
        let pages = [x, y, z];
        let in_view = x.saturating_mul(y).saturating_mul(z).min(most);
        let with_ancestors = in_view.saturating_mul(ancestors[0]).div_ceil(ancestors[1]);
        let slots = with_ancestors.saturating_mul(5).div_ceil(4);
        let tile_bytes = description.tile_bytes() as u64;
        PoolEstimate { picture, page, pages, in_view, with_ancestors, slots, tile_bytes }
    }

    /// Bytes of the pool, at most [`PoolEstimate::MOST_BYTES`].
    pub fn bytes(&self) -> u64 {
        self.slots.saturating_mul(self.tile_bytes).min(Self::MOST_BYTES)
    }
}

/// The arithmetic, step by step, a line each.
impl fmt::Display for PoolEstimate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let PoolEstimate { picture, page, pages, in_view, with_ancestors, slots, tile_bytes } = self;
        let is_solid = pages[2] > 1;
        let deep = (picture[0].max(picture[1]), "away");
        let axes = [(picture[0], "across"), (picture[1], "down"), deep];
        for (axis, (pixels, name)) in axes.into_iter().enumerate().take(if is_solid { 3 } else { 2 }) {
            let (side, count) = (page[axis], pages[axis]);
            writeln!(f, "{count} pages {name}: 2 x {pixels} texels / {side} a page, and 1 cut at each edge")?;
        }
        let (x, y, z) = (pages[0], pages[1], pages[2]);
        match is_solid {
            true => writeln!(
                f,
                "{in_view} pages in view: {x} x {y} x {z}, but no more than {CHANNELS} channels have"
            )?,
            false => writeln!(f, "{in_view} pages in view: {x} x {y}")?,
        }
        writeln!(f, "{with_ancestors} with their ancestors: x {}", if is_solid { "8/7" } else { "4/3" })?;
        writeln!(f, "{slots} slots with head room: / 80 %")?;
        let most = if self.bytes() == Self::MOST_BYTES { ", but no more unless it is set" } else { "" };
        write!(f, "{} bytes: {slots} x {tile_bytes} a tile, all layers{most}", self.bytes())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::texture::format::LayerFormat;
    use crate::texture::geometry::{Geometry, GeometrySpec};

    #[test]
    fn a_volume_is_as_deep_as_its_picture_is_wide_and_has_no_more_bricks_than_channels_have() {
        let of = |size, picture| {
            let geometry = Geometry::new(GeometrySpec { page: 64, ..GeometrySpec::volume(size) }).unwrap();
            PoolEstimate::new(&Description::one_layer(geometry, LayerFormat::R8), picture)
        };
        let small = of([512; 3], [1280, 720]);
        assert_eq!((small.pages, small.in_view, small.with_ancestors), ([42, 25, 42], 4 * 512, 2341));
        let large = of([100_000; 3], [128, 64]);
        assert_eq!((large.pages, large.in_view), ([6, 4, 6], 144));
        assert!(large.to_string().contains("6 x 4 x 6"), "{large}");
        assert_eq!(of([100_000; 3], [16_384; 2]).bytes(), PoolEstimate::MOST_BYTES);
    }
}
