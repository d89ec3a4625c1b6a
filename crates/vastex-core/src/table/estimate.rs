//! How large a pool a picture asks for, before anything was drawn: the arithmetic behind pools without a size
//! of their own.

use std::fmt;

use crate::texture::format::Description;

/// A pool in which the working set of one picture fits without a mip bias, if its surfaces cover each pixel
/// once and are not cut into many small pieces: textures share the pixels of the picture, so their number
/// hardly matters.
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
    /// Payload of a page in texels.
    pub page: [u32; 2],
    /// Pages across and down that a surface over the whole picture shows, however it is turned: of the wanted
    /// level up to two texels fall on a pixel along each axis, and one page more is cut at each edge.
    pub pages: [u64; 2],
    /// Pages in view, of the wanted level: the product of `pages`.
    pub in_view: u64,
    /// Pages in view with their ancestors: a quarter as many on each coarser level, a third more in all.
    pub with_ancestors: u64,
    /// Slots for pages in view and their ancestors, with head room: a bias falls again only where the set
    /// fits 80 % of the slots.
    pub slots: u64,
    /// Bytes of a tile, all layers and the border.
    pub tile_bytes: u64,
}

impl PoolEstimate {
    /// No pool is made larger unless it is told to be: 1 GiB.
    pub const MOST_BYTES: u64 = 1 << 30;

    /// For a texture and a picture of `picture` pixels.
    pub fn new(description: &Description, picture: [u32; 2]) -> PoolEstimate {
        let [page_x, page_y, _] = description.geometry.page();
        let page = [page_x, page_y];
        let pages = std::array::from_fn(|axis| {
            (2 * u64::from(picture[axis])).div_ceil(u64::from(page[axis].max(1))) + 2
        });
        let in_view = pages[0] * pages[1];
        let with_ancestors = (in_view * 4).div_ceil(3);
        let slots = (with_ancestors * 5).div_ceil(4);
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
        let axes = [("across", 0), ("down", 1)];
        for (name, axis) in axes {
            let (pixels, side, count) = (picture[axis], page[axis], pages[axis]);
            writeln!(f, "{count} pages {name}: 2 x {pixels} texels / {side} a page, and 1 cut at each edge")?;
        }
        writeln!(f, "{in_view} pages in view: {} x {}", pages[0], pages[1])?;
        writeln!(f, "{with_ancestors} with their ancestors: x 4/3")?;
        writeln!(f, "{slots} slots with head room: / 80 %")?;
        let most = if self.bytes() == Self::MOST_BYTES { ", but no more unless it is set" } else { "" };
        write!(f, "{} bytes: {slots} x {tile_bytes} a tile, all layers{most}", self.bytes())
    }
}
