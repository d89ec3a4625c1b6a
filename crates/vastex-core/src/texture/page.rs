//! Names of pages: which texture, which level, where.
//!
//! [`PagePos`] is a page of one texture, spelt out; [`PageId`] is a page of any texture, packed into 64 bits
//! so that it can be a key, cross to the GPU and back, and be compared at once. What a page covers is
//! [`Geometry`](crate::Geometry)'s business.
//!
//! | bits of a `PageId` | field |
//! |---|---|
//! | 0..48 | coordinates: x 24 and y 24 bits in 2-D; x, y and z 16 bits each in 3-D |
//! | 48..53 | level |
//! | 53..64 | texture |

use crate::shader_constants::{
    COORD_BITS_2D, COORD_BITS_3D, LEVEL_BITS, LEVEL_SHIFT, TEXTURE_BITS, TEXTURE_SHIFT,
};

/// How many coordinates the pages of a texture have; decides how they are packed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Dims {
    /// An image: x and y, 24 bits each.
    #[default]
    D2,
    /// A volume: x, y and z, 16 bits each.
    D3,
}

impl Dims {
    /// Bits of one coordinate in a [`PageId`].
    pub const fn coord_bits(self) -> u32 {
        match self {
            Dims::D2 => COORD_BITS_2D,
            Dims::D3 => COORD_BITS_3D,
        }
    }
}

/// A virtual texture among those of all pools: 0 to 2046.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TextureNumber(u16);

impl TextureNumber {
    /// The largest number a texture may have; one less than 11 bits hold, so that no page packs to
    /// [`PageId::NONE`].
    pub const MAX: u16 = (1 << TEXTURE_BITS) - 2;

    /// The texture numbered `number`, or nothing beyond [`TextureNumber::MAX`].
    pub const fn new(number: u16) -> Option<TextureNumber> {
        if number <= Self::MAX { Some(TextureNumber(number)) } else { None }
    }

    /// The number given to [`TextureNumber::new`].
    pub const fn number(self) -> u16 {
        self.0
    }
}

/// A page of one texture: its level and its coordinates in pages of that level. `z` is 0 in 2-D.
///
/// The tail is the page at the level where it starts, with coordinates 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct PagePos {
    /// Mip level; 0 is the finest.
    pub level: u8,
    /// Column, in pages.
    pub x: u32,
    /// Row, in pages.
    pub y: u32,
    /// Slice, in pages.
    pub z: u32,
}

impl PagePos {
    /// A page of an image.
    pub const fn new_2d(level: u8, x: u32, y: u32) -> PagePos {
        PagePos { level, x, y, z: 0 }
    }

    /// A page at `coords`, in pages.
    pub const fn at(level: u8, coords: [u32; 3]) -> PagePos {
        PagePos { level, x: coords[0], y: coords[1], z: coords[2] }
    }

    /// x, y and z, in pages.
    pub const fn coords(self) -> [u32; 3] {
        [self.x, self.y, self.z]
    }
}

impl std::fmt::Display for PagePos {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "level {} page {},{}", self.level, self.x, self.y)?;
        if self.z != 0 { write!(f, ",{}", self.z) } else { Ok(()) }
    }
}

/// Why a page cannot be packed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PageIdError {
    /// The level needs more than 5 bits.
    #[error("level {0} is beyond the last that a page id can hold, {last}", last = (1u8 << LEVEL_BITS) - 1)]
    Level(u8),
    /// A coordinate needs more bits than its axis has.
    #[error("page coordinate {coord} needs more than {bits} bits")]
    Coord {
        /// The coordinate, in pages.
        coord: u32,
        /// Bits that an axis has in this texture.
        bits: u32,
    },
}

/// A page of any texture in 64 bits.
///
/// ```
/// use vastex_core::{Dims, PageId, PagePos, TextureNumber};
/// let texture = TextureNumber::new(3).unwrap();
/// let last = PagePos::new_2d(31, (1 << 24) - 1, (1 << 24) - 1);
/// let id = PageId::new(texture, Dims::D2, last).unwrap();
/// assert_eq!((id.texture(), id.pos(Dims::D2)), (texture, last));
/// assert!(PageId::new(texture, Dims::D2, PagePos::new_2d(0, 1 << 24, 0)).is_err());
/// assert!(PageId::new(texture, Dims::D2, PagePos::new_2d(32, 0, 0)).is_err());
/// assert!(TextureNumber::new(2047).is_none());
/// ```
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct PageId(u64);

impl PageId {
    /// All ones: no page.
    pub const NONE: PageId = PageId(u64::MAX);

    /// Packs a page; fails where a field needs more bits than it has.
    pub const fn new(texture: TextureNumber, dims: Dims, pos: PagePos) -> Result<PageId, PageIdError> {
        let bits = dims.coord_bits();
        if pos.level >= 1 << LEVEL_BITS {
            return Err(PageIdError::Level(pos.level));
        }
        if pos.x >> bits != 0 {
            return Err(PageIdError::Coord { coord: pos.x, bits });
        }
        if pos.y >> bits != 0 {
            return Err(PageIdError::Coord { coord: pos.y, bits });
        }
        let z_bits = if matches!(dims, Dims::D3) { bits } else { 0 };
        if pos.z >> z_bits != 0 {
            return Err(PageIdError::Coord { coord: pos.z, bits: z_bits });
        }
        let coords = pos.x as u64 | (pos.y as u64) << bits | (pos.z as u64) << ((2 * bits) % 48);
        Ok(PageId(coords | (pos.level as u64) << LEVEL_SHIFT | (texture.0 as u64) << TEXTURE_SHIFT))
    }

    /// The texture of the page.
    pub const fn texture(self) -> TextureNumber {
        TextureNumber((self.0 >> TEXTURE_SHIFT) as u16)
    }

    /// The level of the page.
    pub const fn level(self) -> u8 {
        (self.0 >> LEVEL_SHIFT) as u8 & ((1 << LEVEL_BITS) - 1)
    }

    /// Level and coordinates; `dims` must be those that the id was packed with.
    pub const fn pos(self, dims: Dims) -> PagePos {
        let bits = dims.coord_bits();
        let mask = (1 << bits) - 1;
        let z = match dims {
            Dims::D2 => 0,
            Dims::D3 => (self.0 >> (2 * bits)) & mask,
        };
        PagePos {
            level: self.level(),
            x: (self.0 & mask) as u32,
            y: ((self.0 >> bits) & mask) as u32,
            z: z as u32,
        }
    }

    /// The packed bits.
    pub const fn to_bits(self) -> u64 {
        self.0
    }

    /// An id from its packed bits, or `None` if they are [`PageId::NONE`] or name the reserved texture.
    pub const fn from_bits(bits: u64) -> Option<PageId> {
        if (bits >> TEXTURE_SHIFT) as u16 > TextureNumber::MAX { None } else { Some(PageId(bits)) }
    }
}

impl std::fmt::Debug for PageId {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if *self == PageId::NONE {
            return write!(f, "PageId::NONE");
        }
        write!(f, "PageId(t{} l{} {:#x})", self.texture().0, self.level(), self.0 & ((1 << LEVEL_SHIFT) - 1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn packing_round_trips(texture in 0..=TextureNumber::MAX, level in 0u8..32, c in prop::array::uniform3(any::<u32>()), volume: bool) {
            let dims = if volume { Dims::D3 } else { Dims::D2 };
            let mask = (1 << dims.coord_bits()) - 1;
            let z = if volume { c[2] & mask } else { 0 };
            let pos = PagePos { level, x: c[0] & mask, y: c[1] & mask, z };
            let texture = TextureNumber::new(texture).unwrap();
            let id = PageId::new(texture, dims, pos).unwrap();
            prop_assert_eq!(id.pos(dims), pos);
            prop_assert_eq!(id.texture(), texture);
            prop_assert_eq!(id.level(), level);
            prop_assert_ne!(id, PageId::NONE);
            prop_assert_eq!(PageId::from_bits(id.to_bits()), Some(id));
        }
    }

    #[test]
    fn fields_that_overflow_are_refused() {
        let t = TextureNumber::new(0).unwrap();
        assert_eq!(
            PageId::new(t, Dims::D2, PagePos::at(0, [0, 0, 1])),
            Err(PageIdError::Coord { coord: 1, bits: 0 })
        );
        assert_eq!(
            PageId::new(t, Dims::D3, PagePos::at(0, [0, 65536, 0])),
            Err(PageIdError::Coord { coord: 65536, bits: 16 })
        );
        assert_eq!(PageId::from_bits(u64::MAX), None);
    }
}
