//! The pool: fixed-size memory made of equal slots, for one set of layer formats and one tile size.
//!
//! Tiles of images lie in the images of a texture array, tiles of volumes in a 3-D texture. Both are a grid
//! of slots with three axes: a tile of an image is one texel deep, and each image of an array is one layer
//! of slots.
//!
//! Here stands how many slots a budget of bytes gives and where each lies; that the memory exists is the GPU
//! crate's business, which tile is in which slot the residency's.

use crate::shader_constants::POOL_SLOTS;
use crate::texture::format::Description;
use crate::texture::page::{Dims, TextureNumber};

/// Names a pool: the textures of a device are divided among pools by their tiles and formats. Counted from 0
/// in the order in which pools were made.
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

/// What a device allows for the textures that pools lie in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ArrayLimits {
    /// Texels per side of a 2-D texture.
    pub max_side: u32,
    /// Images in a texture array.
    pub max_images: u32,
    /// Texels per side of a 3-D texture.
    pub max_side_3d: u32,
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
        /// Slots that the budget gives.
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

/// How a pool is laid out: a grid of slots.
///
/// Slot `n` is found by counting along x first, then along y, then along z.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PoolLayout {
    /// Size of a slot in texels. Along z 1 for images, whose slots lie in a texture array, and more for
    /// volumes, whose slots lie in a 3-D texture.
    pub tile: [u32; 3],
    /// Slots along each axis; along z of a texture array its images.
    pub grid: [u32; 3],
    /// Bytes of a slot, all layers.
    pub tile_bytes: u64,
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
    /// No side is longer than the device allows, nor, of an image, than [`PoolLayout::MAX_SIDE`] texels or
    /// one tile, whichever is more. Of the layouts of a texture array with equally many slots, the one with
    /// the fewest images is taken; more than twice as many as are needed only where with fewer over 5 % of
    /// the budget would be wasted. Of those of a 3-D texture, the one nearest to a cube.
    pub fn fit(description: &Description, budget: u64, limits: ArrayLimits) -> Result<PoolLayout, PoolError> {
        let tile = description.geometry.tile();
        let tile_bytes = description.tile_bytes() as u64;
        let affordable = (budget / tile_bytes).min(u64::from(POOL_SLOTS)) as u32;
        let grid = match description.geometry.dims() {
            Dims::D2 => grid_of_images(tile, affordable, limits)?,
            Dims::D3 => grid_of_solid(tile, affordable, limits)?,
        };
        match grid.map(|grid| PoolLayout { tile, grid, tile_bytes }) {
            Some(layout) if layout.slots() >= Self::MIN_SLOTS => Ok(layout),
            _ => Err(PoolError::TooSmall { budget, slots: affordable, tile_bytes, needed: Self::MIN_SLOTS }),
        }
    }

    /// The smallest budget in bytes of which [`PoolLayout::fit`] makes so many slots or more: as their grid
    /// is a box, some numbers of slots are not to be had. `None` where no budget does on such a device.
    pub fn budget_for(description: &Description, slots: u32, limits: ArrayLimits) -> Option<u64> {
        let tile_bytes = description.tile_bytes() as u64;
        let slots = slots.max(Self::MIN_SLOTS);
        let is_enough = |affordable: u32| {
            let layout = PoolLayout::fit(description, u64::from(affordable) * tile_bytes, limits);
            layout.is_ok_and(|layout| layout.slots() >= slots)
        };
        if slots > POOL_SLOTS || !is_enough(POOL_SLOTS) {
            return None;
        }
        (slots..=POOL_SLOTS).find(|affordable| is_enough(*affordable)).map(|n| u64::from(n) * tile_bytes)
    }

    /// Returns true if the slots lie in a 3-D texture, and not in the images of a texture array.
    pub fn is_solid(&self) -> bool {
        self.tile[2] > 1
    }

    /// Slots of the pool.
    pub fn slots(&self) -> u32 {
        self.grid.iter().product()
    }

    /// Bytes of the pool, all layers.
    pub fn bytes(&self) -> u64 {
        u64::from(self.slots()) * self.tile_bytes
    }

    /// Size of the texture in texels; along z of a texture array its images.
    pub fn size(&self) -> [u32; 3] {
        std::array::from_fn(|axis| self.grid[axis] * self.tile[axis])
    }

    /// The first texel of a slot; along z of a texture array the image that the slot is in.
    pub fn origin(&self, slot: Slot) -> [u32; 3] {
        let [columns, rows, _] = self.grid;
        let row = slot.0 / columns;
        let cell = [slot.0 % columns, row % rows, row / rows];
        std::array::from_fn(|axis| cell[axis] * self.tile[axis])
    }
}

/// Slots along each axis of a texture array; `None` if not one is affordable.
fn grid_of_images(
    tile: [u32; 3],
    affordable: u32,
    limits: ArrayLimits,
) -> Result<Option<[u32; 3]>, PoolError> {
    let tile = tile[0].max(tile[1]);
    let per_side = limits.max_side.min(PoolLayout::MAX_SIDE.max(tile)) / tile;
    if per_side == 0 {
        return Err(PoolError::TileTooLarge { tile, max_side: limits.max_side });
    }
    let largest_image = u64::from(per_side) * u64::from(per_side);
    let fewest = u64::from(affordable).div_ceil(largest_image).clamp(1, u64::from(limits.max_images)) as u32;
    let slots = |grid: &[u32; 3]| grid.iter().product::<u32>();
    let mut best: Option<[u32; 3]> = None;
    for images in fewest..=limits.max_images.max(fewest) {
        let wastes_little = |best: &[u32; 3]| u64::from(slots(best)) * 100 >= u64::from(affordable) * 95;
        if images > 2 * fewest && best.as_ref().is_some_and(wastes_little) {
            break;
        }
        let share = affordable / images;
        for rows in 1..=per_side.min(share) {
            let grid = [(share / rows).min(per_side), rows, images];
            let squarer = |a: &[u32; 3], b: &[u32; 3]| a[0].abs_diff(a[1]) < b[0].abs_diff(b[1]);
            let better = |b: &[u32; 3]| {
                slots(&grid) > slots(b) || slots(&grid) == slots(b) && images == b[2] && squarer(&grid, b)
            };
            if best.as_ref().is_none_or(better) {
                best = Some(grid);
            }
        }
    }
    Ok(best)
}

/// Slots along each axis of a 3-D texture; `None` if not one is affordable.
fn grid_of_solid(
    tile: [u32; 3],
    affordable: u32,
    limits: ArrayLimits,
) -> Result<Option<[u32; 3]>, PoolError> {
    let most = tile.map(|side| limits.max_side_3d / side);
    if let Some(axis) = most.iter().position(|&slots| slots == 0) {
        return Err(PoolError::TileTooLarge { tile: tile[axis], max_side: limits.max_side_3d });
    }
    let mut best: Option<[u32; 3]> = None;
    for layers in 1..=most[2].min(affordable) {
        for rows in 1..=most[1].min(affordable / layers) {
            let grid = [(affordable / layers / rows).min(most[0]), rows, layers];
            // More slots, then a shorter longest side.
            let merit = |grid: &[u32; 3]| {
                let longest = (0..3).map(|axis| grid[axis] * tile[axis]).max();
                (grid.iter().product::<u32>(), std::cmp::Reverse(longest))
            };
            if best.as_ref().is_none_or(|best| merit(&grid) > merit(best)) {
                best = Some(grid);
            }
        }
    }
    Ok(best)
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

    const LIMITS: ArrayLimits = ArrayLimits { max_side: 4096, max_images: 256, max_side_3d: 2048 };

    #[test]
    fn a_mebibyte_holds_fourteen_tiles() {
        let layout = PoolLayout::fit(&description(128), 1 << 20, LIMITS).unwrap();
        assert_eq!((layout.slots(), layout.bytes(), layout.grid[2]), (14, 14 * 136 * 136 * 4, 1));
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
    const WIDE: ArrayLimits = ArrayLimits { max_side: 32768, max_images: 2048, max_side_3d: 16384 };

    #[test]
    fn no_image_is_larger_than_8192_texels_whatever_the_device_allows() {
        let budget = 4 << 30;
        let layout = PoolLayout::fit(&description(128), budget, WIDE).unwrap();
        assert!(layout.size().into_iter().all(|side| side <= 8192), "{layout:?}");
        // The same slots, in more images.
        let affordable = (budget / layout.tile_bytes) as u32;
        assert!(layout.slots() * 100 >= affordable * 95, "{layout:?} wastes slots of {affordable}");
        assert!(layout.grid[2] > 1, "{layout:?}");
    }

    #[test]
    fn the_largest_tile_is_an_image_by_itself() {
        let spec = GeometrySpec { page: 4096, border: 2048, ..GeometrySpec::image(100_000, 100_000) };
        let description = Description::one_layer(Geometry::new(spec).unwrap(), LayerFormat::R8);
        let layout = PoolLayout::fit(&description, 1 << 30, WIDE).unwrap();
        assert_eq!((layout.size(), layout.grid), ([8192, 8192, 16], [1, 1, 16]), "{layout:?}");
    }

    fn volume(page: u32) -> Description {
        let spec = GeometrySpec { page, border: 1, ..GeometrySpec::volume([700, 600, 500]) };
        Description::one_layer(Geometry::new(spec).unwrap(), LayerFormat::R8)
    }

    #[test]
    fn bricks_lie_in_a_3d_texture_near_a_cube() {
        let layout = PoolLayout::fit(&volume(64), 512 * 66 * 66 * 66, LIMITS).unwrap();
        assert_eq!((layout.tile, layout.grid, layout.is_solid()), ([66; 3], [8; 3], true));
        assert_eq!(layout.origin(Slot::new(8 * 8 * 3 + 8 * 2 + 1)), [66, 132, 198]);
        // A side of 2048 texels holds 31 bricks of 66.
        let layout = PoolLayout::fit(&volume(64), 1 << 50, LIMITS).unwrap();
        assert_eq!(layout.grid, [31; 3]);
        let limits = ArrayLimits { max_side_3d: 65, ..LIMITS };
        let error = PoolLayout::fit(&volume(64), 1 << 30, limits).unwrap_err();
        assert_eq!(error, PoolError::TileTooLarge { tile: 66, max_side: 65 });
        let error = PoolLayout::fit(&volume(64), 1 << 18, LIMITS).unwrap_err();
        assert!(matches!(error, PoolError::TooSmall { slots: 0, .. }), "{error}");
    }

    #[test]
    fn a_budget_for_slots_gives_as_many_and_hardly_more() {
        let bricks = volume(64);
        let brick = 66 * 66 * 66;
        for slots in (2..1500).chain([29_000, 29_791]) {
            let budget = PoolLayout::budget_for(&bricks, slots, LIMITS).unwrap();
            assert!(PoolLayout::fit(&bricks, budget, LIMITS).unwrap().slots() >= slots, "{slots}");
            assert!(
                PoolLayout::fit(&bricks, budget - brick, LIMITS).is_ok_and(|l| l.slots() < slots)
                    || slots == 2
            );
            assert!(budget / brick <= u64::from(slots + slots / 20 + 2), "{slots}: {}", budget / brick);
        }
        // 31 bricks along each side are all.
        assert_eq!(PoolLayout::budget_for(&bricks, 29_792, LIMITS), None);
        assert_eq!(PoolLayout::budget_for(&bricks, u32::MAX, LIMITS), None);
        let images = description(128);
        let budget = PoolLayout::budget_for(&images, 700, LIMITS).unwrap();
        assert!(PoolLayout::fit(&images, budget, LIMITS).unwrap().slots() >= 700);
    }

    proptest! {
        #[test]
        fn a_layout_stays_within_its_budget_and_its_device(
            budget in 1u64..1 << 33,
            page in 8u32..600,
            is_volume: bool,
        ) {
            let description = if is_volume { volume(page) } else { description(page) };
            let Ok(layout) = PoolLayout::fit(&description, budget, LIMITS) else { return Ok(()) };
            prop_assert!(layout.bytes() <= budget);
            let most = match is_volume {
                true => [LIMITS.max_side_3d; 3],
                false => [LIMITS.max_side, LIMITS.max_side, LIMITS.max_images],
            };
            prop_assert!((0..3).all(|axis| layout.size()[axis] <= most[axis]), "{layout:?}");
            let affordable = (budget / layout.tile_bytes) as u32;
            let largest = (0..3).map(|axis| u64::from(most[axis] / layout.tile[axis])).product::<u64>();
            let possible = u64::from(affordable.min(POOL_SLOTS)).min(largest);
            // A side of a 3-D texture has few bricks.
            let least = if is_volume { 50 } else { 90 };
            let slots = u64::from(layout.slots());
            prop_assert!(slots * 100 >= possible * least, "{layout:?} wastes slots of {affordable}");
            let last = layout.origin(Slot::new(layout.slots() - 1));
            prop_assert!((0..3).all(|a| last[a] + layout.tile[a] == layout.size()[a]));
        }
    }
}
