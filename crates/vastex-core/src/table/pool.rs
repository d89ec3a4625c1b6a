//! The pool: fixed-size memory made of equal slots, for one set of layer formats and one tile size.
//!
//! Here stands how many slots a budget of bytes gives and where each lies; that the memory exists is the GPU
//! crate's business, which tile is in which slot the residency's.

use crate::shader_constants::POOL_SLOTS;
use crate::texture::format::Description;
use crate::texture::page::TextureNumber;

/// A pool among those of one [`crate::Pager`], counted from 0 in the order in which they were made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct PoolId(u16);

impl PoolId {
    /// The pool with this number.
    pub const fn new(number: u16) -> PoolId {
        PoolId(number)
    }

    /// The pool's number.
    pub const fn number(self) -> u16 {
        self.0
    }
}

/// The place of one tile in a pool, counted from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Slot(u32);

impl Slot {
    /// The slot with this number.
    pub const fn new(index: u32) -> Slot {
        Slot(index)
    }

    /// The slot's number.
    pub const fn index(self) -> u32 {
        self.0
    }
}

/// What a device allows for texture arrays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ArrayLimits {
    /// Texels per side of a 2-D texture.
    pub max_side: u32,
    /// Images in a texture array.
    pub max_images: u32,
}

/// Why no pool can be laid out.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PoolError {
    /// The budget is below one slot for each thing that must always be resident, and one more to work with.
    #[error(
        "a pool of {budget} bytes holds {slots} tiles of {tile_bytes} bytes, but {needed} are needed at least; \
         make the pool at least {} bytes or the pages smaller",
        *needed as u64 * *tile_bytes
    )]
    TooSmall {
        /// The budget in bytes.
        budget: u64,
        /// Slots that it gives.
        slots: u32,
        /// Bytes of one tile.
        tile_bytes: u64,
        /// Slots needed.
        needed: u32,
    },
    /// There are as many textures as page ids can tell apart.
    #[error("there are {} textures already, and page ids tell no more apart; remove one first", TextureNumber::MAX as u32 + 1)]
    TooManyTextures,
    /// There are as many pools as can be told apart.
    #[error("there are {} pools already; build textures with the same page, border and formats", u16::MAX)]
    TooManyPools,
    /// Every slot is in view, and the picture may not become coarser.
    #[error("all {slots} slots of the pool are in view; make the pool larger, or let the mip bias act")]
    AllInView {
        /// Slots of the pool.
        slots: u32,
    },
    /// One tile is larger than a texture of the device.
    #[error(
        "a tile of {tile} texels per side does not fit this device's textures of {max_side}; use smaller pages"
    )]
    TileTooLarge {
        /// Texels per side of a tile.
        tile: u32,
        /// Texels per side that the device allows.
        max_side: u32,
    },
}

/// How a pool is laid out: images of a texture array, each a grid of slots.
///
/// Slot `n` is in image `n / (columns * rows)`; within it, row by row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PoolLayout {
    /// Size of a slot in texels.
    pub tile: [u32; 2],
    /// Slots along x of an image.
    pub columns: u32,
    /// Slots along y of an image.
    pub rows: u32,
    /// Images in the array.
    pub images: u32,
    /// Bytes of a slot, all layers.
    pub tile_bytes: u64,
}

/// Where a slot lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SlotPlace {
    /// Image of the array.
    pub image: u32,
    /// First texel of the slot.
    pub origin: [u32; 2],
}

impl PoolLayout {
    /// Slots that a pool needs at least, for each texture in it: its tail, and one to work with.
    pub const MIN_SLOTS: u32 = 2;
    /// Texels per side of an image at most, unless one tile is larger: a place in a larger image has less
    /// than 10 bits below the texel in single precision, and a GPU clears a whole image when its first slot
    /// is filled.
    pub const MAX_SIDE: u32 = 8192;

    /// The layout with the most slots within `budget` bytes, up to [`POOL_SLOTS`]; fails below
    /// [`PoolLayout::MIN_SLOTS`].
    ///
    /// No side of an image is longer than the device allows, nor than [`PoolLayout::MAX_SIDE`] texels or one
    /// tile, whichever is more. Of the layouts with equally many slots, the one with the fewest images is
    /// taken; more than twice as many as are needed only where with fewer over 5 % of the budget would be
    /// wasted.
    pub fn fit(description: &Description, budget: u64, limits: ArrayLimits) -> Result<PoolLayout, PoolError> {
        let [width, height, _] = description.geometry.tile();
        let tile_bytes = description.tile_bytes() as u64;
        let tile = width.max(height);
        let per_side = limits.max_side.min(Self::MAX_SIDE.max(tile)) / tile;
        if per_side == 0 {
            return Err(PoolError::TileTooLarge { tile, max_side: limits.max_side });
        }
        let affordable = (budget / tile_bytes).min(u64::from(POOL_SLOTS)) as u32;
        let largest_image = u64::from(per_side) * u64::from(per_side);
        let fewest =
            u64::from(affordable).div_ceil(largest_image).clamp(1, u64::from(limits.max_images)) as u32;
        let mut best: Option<PoolLayout> = None;
        for images in fewest..=limits.max_images.max(fewest) {
            let wastes_little =
                |best: &PoolLayout| u64::from(best.slots()) * 100 >= u64::from(affordable) * 95;
            if images > 2 * fewest && best.as_ref().is_some_and(wastes_little) {
                break;
            }
            let share = affordable / images;
            for rows in 1..=per_side.min(share) {
                let columns = (share / rows).min(per_side);
                let layout = PoolLayout { tile: [width, height], columns, rows, images, tile_bytes };
                let squarer =
                    |a: &PoolLayout, b: &PoolLayout| a.columns.abs_diff(a.rows) < b.columns.abs_diff(b.rows);
                let better = |b: &PoolLayout| {
                    layout.slots() > b.slots()
                        || layout.slots() == b.slots() && layout.images == b.images && squarer(&layout, b)
                };
                if best.as_ref().is_none_or(better) {
                    best = Some(layout);
                }
            }
        }
        match best {
            Some(layout) if layout.slots() >= Self::MIN_SLOTS => Ok(layout),
            _ => Err(PoolError::TooSmall { budget, slots: affordable, tile_bytes, needed: Self::MIN_SLOTS }),
        }
    }

    /// Slots of the pool.
    pub fn slots(&self) -> u32 {
        self.columns * self.rows * self.images
    }

    /// Bytes of the pool, all layers.
    pub fn bytes(&self) -> u64 {
        u64::from(self.slots()) * self.tile_bytes
    }

    /// Size of one image in texels.
    pub fn image_size(&self) -> [u32; 2] {
        [self.columns * self.tile[0], self.rows * self.tile[1]]
    }

    /// Where a slot lies.
    pub fn place(&self, slot: Slot) -> SlotPlace {
        let per_image = self.columns * self.rows;
        let (image, cell) = (slot.0 / per_image, slot.0 % per_image);
        SlotPlace { image, origin: [cell % self.columns * self.tile[0], cell / self.columns * self.tile[1]] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::texture::format::LayerFormat;
    use crate::texture::geometry::{Geometry, GeometrySpec};
    use proptest::prelude::*;

    fn description(page: u32) -> Description {
        let geometry = Geometry::new(GeometrySpec { page, ..GeometrySpec::image(1000, 1000) }).unwrap();
        Description::one_layer(geometry, LayerFormat::Rgba8)
    }

    const LIMITS: ArrayLimits = ArrayLimits { max_side: 4096, max_images: 256 };

    #[test]
    fn a_mebibyte_holds_fourteen_tiles() {
        let layout = PoolLayout::fit(&description(128), 1 << 20, LIMITS).unwrap();
        assert_eq!((layout.slots(), layout.bytes(), layout.images), (14, 14 * 136 * 136 * 4, 1));
    }

    #[test]
    fn a_pool_without_room_is_refused_with_the_remedy() {
        let error = PoolLayout::fit(&description(128), 100_000, LIMITS).unwrap_err();
        assert_eq!(
            error.to_string(),
            "a pool of 100000 bytes holds 1 tiles of 73984 bytes, but 2 are needed at least; make the pool at least \
             147968 bytes or the pages smaller"
        );
        let limits = ArrayLimits { max_side: 100, ..LIMITS };
        assert!(matches!(
            PoolLayout::fit(&description(128), 1 << 20, limits),
            Err(PoolError::TileTooLarge { .. })
        ));
    }

    /// A device that allows sides of 32768 texels.
    const WIDE: ArrayLimits = ArrayLimits { max_side: 32768, max_images: 2048 };

    #[test]
    fn no_image_is_larger_than_8192_texels_whatever_the_device_allows() {
        let budget = 4 << 30;
        let layout = PoolLayout::fit(&description(128), budget, WIDE).unwrap();
        assert!(layout.image_size().into_iter().all(|side| side <= 8192), "{layout:?}");
        // The same slots, in more images.
        let affordable = (budget / layout.tile_bytes) as u32;
        assert!(layout.slots() * 100 >= affordable * 95, "{layout:?} wastes slots of {affordable}");
        assert!(layout.images > 1, "{layout:?}");
    }

    #[test]
    fn the_largest_tile_is_an_image_by_itself() {
        let spec = GeometrySpec { page: 4096, border: 2048, ..GeometrySpec::image(100_000, 100_000) };
        let description = Description::one_layer(Geometry::new(spec).unwrap(), LayerFormat::R8);
        let layout = PoolLayout::fit(&description, 1 << 30, WIDE).unwrap();
        assert_eq!((layout.image_size(), layout.columns, layout.images), ([8192; 2], 1, 16), "{layout:?}");
    }

    proptest! {
        #[test]
        fn a_layout_stays_within_its_budget_and_its_device(budget in 1u64..1 << 33, page in 8u32..600) {
            let description = description(page);
            let Ok(layout) = PoolLayout::fit(&description, budget, LIMITS) else { return Ok(()) };
            prop_assert!(layout.bytes() <= budget);
            prop_assert!(layout.image_size().into_iter().all(|side| side <= LIMITS.max_side));
            prop_assert!(layout.images <= LIMITS.max_images);
            let affordable = (budget / layout.tile_bytes) as u32;
            let largest = (LIMITS.max_side / layout.tile[0]).pow(2) * LIMITS.max_images;
            prop_assert!(layout.slots() * 100 >= affordable.min(largest).min(POOL_SLOTS) * 90, "{layout:?} wastes slots of {affordable}");
            let last = layout.place(Slot::new(layout.slots() - 1));
            prop_assert_eq!(last.image, layout.images - 1);
            prop_assert!((0..2).all(|a| last.origin[a] + layout.tile[a] <= layout.image_size()[a]));
        }
    }
}
