//! The shape of a virtual texture: its levels, its pages and how they nest.
//!
//! An image is a volume of depth 1, so there is one code path. Texel `i` of a level covers exactly the texels
//! of the next finer level that the level's factor says, counted from origin 0; so pages nest, always, and a
//! page has one parent. Nothing here assumes a power of two. Where texels lie inside tiles is
//! [`texture::space`](crate::texture::space)'s business, how the coarsest levels share one tile [`tail`]'s.

pub(crate) mod codec;
pub(crate) mod tail;

use crate::shader_constants;
use crate::texture::geometry::tail::TailLayout;
use crate::texture::page::{Dims, PageId, PagePos, TextureNumber};

/// Levels that a texture can have.
pub const MAX_LEVELS: usize = shader_constants::MAX_LEVELS as usize;
/// Texels that a texture can have per axis: 2^31.
pub const MAX_TEXELS: u32 = 1 << 31;
/// Texels that a page may have per side.
pub const PAGE_TEXELS: std::ops::RangeInclusive<u32> = 8..=4096;

/// What lies beyond the edge of a texture, along one axis. Stored with the texture, since it decides the
/// borders.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum AddressMode {
    /// The texel at the edge.
    #[default]
    Clamp,
    /// The texture again, from its other side.
    Wrap,
    /// The texture again, turned round.
    Mirror,
    /// One colour: the texture's [border colour](crate::Description::border_color).
    Border,
}

/// Where the texels of the coarser levels lie.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum TexelPositions {
    /// In the middle of the texels that they cover, as filters of even size put them.
    #[default]
    Centered,
    /// Where the first of the texels that they cover lies, as filters of odd size put them.
    Kept,
}

/// What a [`Geometry`] is made from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GeometrySpec {
    /// What the texture is: an image or a volume.
    pub dims: Dims,
    /// Size of level 0 in texels; the depth of an image is 1.
    pub size: [u32; 3],
    /// Payload of a page, in texels per side.
    pub page: u32,
    /// Texels copied from the neighbouring pages, on each side.
    pub border: u32,
    /// What lies beyond the edges, per axis.
    pub address: [AddressMode; 3],
    /// Where the texels of the coarser levels lie, along every axis.
    pub positions: TexelPositions,
    /// Texels that the places of levels in the tail are multiples of: 4, 8 or 16, as the layers need.
    pub tail_align: u32,
}

impl GeometrySpec {
    /// An image with 128-texel pages, 4-texel borders and clamped edges.
    pub const fn image(width: u32, height: u32) -> GeometrySpec {
        GeometrySpec {
            dims: Dims::D2,
            size: [width, height, 1],
            page: 128,
            border: 4,
            address: [AddressMode::Clamp; 3],
            positions: TexelPositions::Centered,
            tail_align: 4,
        }
    }

    /// What [`GeometrySpec::image`] gives, with the dimensions and the size of a volume.
    pub const fn volume(size: [u32; 3]) -> GeometrySpec {
        GeometrySpec { dims: Dims::D3, size, ..GeometrySpec::image(1, 1) }
    }
}

/// Why a shape is refused.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum GeometryError {
    /// A side has no texels or too many.
    #[error("a texture of {}x{}x{} texels: each side must have 1 to 2^31, and an image a depth of 1", .0[0], .0[1], .0[2])]
    Size([u32; 3]),
    /// The page's side is out of range.
    #[error("a page of {0} texels: its side must have {lo} to {hi}", lo = PAGE_TEXELS.start(), hi = PAGE_TEXELS.end())]
    Page(u32),
    /// The border is out of range.
    #[error("a border of {border} texels with pages of {page}: it must have 1 to {max}", max = max_border(*page))]
    Border {
        /// Texels of border on each side.
        border: u32,
        /// Texels of payload per side.
        page: u32,
    },
    /// A level would have more pages than a page id can tell apart.
    #[error(
        "a side of {texels} texels makes {pages} pages of {page}, more than the {max} that a page id can tell apart; use larger pages"
    )]
    Pages {
        /// Texels along the side.
        texels: u32,
        /// Pages along the side.
        pages: u32,
        /// Texels of payload per page.
        page: u32,
        /// The largest number of pages along a side.
        max: u32,
    },
    /// The alignment in the tail is none that is known.
    #[error("levels of the tail at multiples of {0} texels: it must be 4, 8 or 16")]
    TailAlign(u32),
    /// The levels given do not lead down to a texel in as many steps as a texture can have.
    #[error("level {0} is impossible: a factor is 0, or the levels do not end at 1x1x1 within {MAX_LEVELS}")]
    Levels(usize),
}

const fn max_border(page: u32) -> u32 {
    page / 2
}

/// One mip level.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Level {
    /// Size in texels.
    pub size: [u32; 3],
    /// Texels of the next finer level along one texel of this one; 1 at level 0.
    pub factor: [u32; 3],
    /// Texels of level 0 along one texel of this level: the product of the factors.
    pub scale: [u64; 3],
    /// Pages along each axis; the last may reach beyond the level.
    pub pages: [u32; 3],
}

impl Level {
    /// Pages of the level.
    pub fn page_count(&self) -> u64 {
        self.pages.iter().map(|&n| u64::from(n)).product()
    }
}

/// The shape of a virtual texture. Cheap to read; made once.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Geometry {
    spec: GeometrySpec,
    levels: Vec<Level>,
    tail: TailLayout,
}

impl Geometry {
    /// The geometry of everything that Vastex builds: each level halves the one before it, rounding up, down
    /// to 1x1.
    pub fn new(spec: GeometrySpec) -> Result<Geometry, GeometryError> {
        check_spec(&spec)?;
        let mut factors = Vec::new();
        let mut size = spec.size;
        while size != [1; 3] {
            let factor = match spec.dims {
                Dims::D2 => [2, 2, 1],
                Dims::D3 => [2, 2, 2],
            };
            size = std::array::from_fn(|axis| size[axis].div_ceil(factor[axis]));
            factors.push(factor);
        }
        Geometry::with_factors(spec, &factors)
    }

    /// A geometry whose level `n + 1` has `factors[n]` texels of level `n` along each of its texels.
    pub fn with_factors(spec: GeometrySpec, factors: &[[u32; 3]]) -> Result<Geometry, GeometryError> {
        check_spec(&spec)?;
        let levels = levels_of(&spec, factors)?;
        let tail = TailLayout::new(&spec, &levels);
        Ok(Geometry { spec, levels, tail })
    }

    /// The shape that a layer with one texel along each `scale` of the texture's sees: the same levels and
    /// pages, all sizes divided. `scale` divides page, border and the tail's alignment, as
    /// [`Description::check`](crate::Description::check) sees to.
    pub fn of_layer(&self, scale: u32) -> Geometry {
        let divided = |n: u32| if n == 1 { 1 } else { n.div_ceil(scale) };
        let spec = GeometrySpec {
            size: self.spec.size.map(divided),
            page: self.spec.page / scale,
            border: self.spec.border / scale,
            tail_align: self.spec.tail_align / scale,
            ..self.spec
        };
        let levels =
            self.levels.iter().map(|level| Level { size: level.size.map(divided), ..*level }).collect();
        Geometry { spec, levels, tail: self.tail.divided(scale) }
    }

    /// The offset that is added to a position of level 0, divided by the level's scale, to make it one of the
    /// level, along each axis: 0, or up to half a texel if texels [keep their
    /// positions](TexelPositions::Kept).
    pub fn sample_offset(&self, level: u8) -> [f64; 3] {
        match self.spec.positions {
            TexelPositions::Centered => [0.0; 3],
            TexelPositions::Kept => self.level(level).scale.map(|scale| 0.5 - 0.5 / scale as f64),
        }
    }

    /// What the geometry was made from.
    pub fn spec(&self) -> &GeometrySpec {
        &self.spec
    }

    /// Image or volume.
    pub fn dims(&self) -> Dims {
        self.spec.dims
    }

    /// Size of level 0 in texels.
    pub fn size(&self) -> [u32; 3] {
        self.spec.size
    }

    /// Payload of a page in texels; the depth of an image's page is 1.
    pub fn page(&self) -> [u32; 3] {
        page_box(&self.spec)
    }

    /// Border on each side in texels; 0 along the depth of an image.
    pub fn border(&self) -> [u32; 3] {
        border_box(&self.spec)
    }

    /// Size of a tile in texels: payload and both borders.
    pub fn tile(&self) -> [u32; 3] {
        tile_box(&self.spec)
    }

    /// Texels of a tile.
    pub fn tile_texels(&self) -> u64 {
        self.tile().iter().map(|&n| u64::from(n)).product()
    }

    /// What lies beyond the edges, per axis.
    pub fn address(&self) -> [AddressMode; 3] {
        self.spec.address
    }

    /// All levels, finest first; the last is 1x1x1.
    pub fn levels(&self) -> &[Level] {
        &self.levels
    }

    /// One level; `level` must exist.
    pub fn level(&self, level: u8) -> &Level {
        &self.levels[usize::from(level)]
    }

    /// The coarsest level.
    pub fn coarsest(&self) -> u8 {
        (self.levels.len() - 1) as u8
    }

    /// Where the coarsest levels lie in the tail's tile.
    pub fn tail(&self) -> &TailLayout {
        &self.tail
    }

    /// The page of the tail.
    pub fn tail_pos(&self) -> PagePos {
        PagePos::at(self.tail.first_level(), [0; 3])
    }

    /// Returns true if the page is the texture's tail.
    pub fn is_tail(&self, pos: PagePos) -> bool {
        pos.level >= self.tail.first_level()
    }

    /// Returns true if the page exists: one of a level finer than the tail, or the tail itself.
    pub fn contains(&self, pos: PagePos) -> bool {
        if pos.level >= self.tail.first_level() {
            return pos == self.tail_pos();
        }
        let pages = self.level(pos.level).pages;
        pos.x < pages[0] && pos.y < pages[1] && pos.z < pages[2]
    }

    /// The page of the next coarser level that covers this one (the tail, from the level before it on), or
    /// nothing for the tail.
    pub fn parent(&self, pos: PagePos) -> Option<PagePos> {
        (pos.level < self.tail.first_level()).then(|| self.ancestor(pos, pos.level + 1))
    }

    /// The page at `level` or, where that is in the tail, the tail, that covers `pos`. `level` is at least
    /// the page's own.
    pub fn ancestor(&self, pos: PagePos, level: u8) -> PagePos {
        if level >= self.tail.first_level() {
            return self.tail_pos();
        }
        let (from, to) = (self.level(pos.level).scale, self.level(level).scale);
        let coords = pos.coords();
        PagePos::at(level, std::array::from_fn(|a| (u64::from(coords[a]) / (to[a] / from[a])) as u32))
    }

    /// The pages of `level` (not coarser than the page's own, finer than the tail) that lie within the page,
    /// as the first and the one past the last, per axis.
    pub fn descendants(&self, pos: PagePos, level: u8) -> ([u32; 3], [u32; 3]) {
        let pages = self.level(level).pages;
        if self.is_tail(pos) {
            return ([0; 3], pages);
        }
        let (from, to) = (self.level(pos.level).scale, self.level(level).scale);
        let coords = pos.coords();
        let bound = |n: u64, a: usize| (n * (from[a] / to[a])).min(u64::from(pages[a])) as u32;
        (
            std::array::from_fn(|a| bound(u64::from(coords[a]), a)),
            std::array::from_fn(|a| bound(u64::from(coords[a]) + 1, a)),
        )
    }

    /// Every page: the tail first, then from coarse to fine, row by row within a level.
    pub fn pages(&self) -> impl Iterator<Item = PagePos> + '_ {
        let finer = (0..self.tail.first_level()).rev().flat_map(|level| self.pages_of_level(level));
        std::iter::once(self.tail_pos()).chain(finer)
    }

    /// The pages of a level finer than the tail, row by row.
    pub fn pages_of_level(&self, level: u8) -> impl Iterator<Item = PagePos> + use<> {
        let [nx, ny, nz] = self.level(level).pages;
        (0..nz).flat_map(move |z| (0..ny).flat_map(move |y| (0..nx).map(move |x| PagePos { level, x, y, z })))
    }

    /// Number of pages, the tail counted as one.
    pub fn page_count(&self) -> u64 {
        self.levels[..usize::from(self.tail.first_level())].iter().map(Level::page_count).sum::<u64>() + 1
    }
}

/// The levels that the factors give, checked.
fn levels_of(spec: &GeometrySpec, factors: &[[u32; 3]]) -> Result<Vec<Level>, GeometryError> {
    let max_pages = 1 << spec.dims.coord_bits();
    let page = page_box(spec);
    let mut levels: Vec<Level> = Vec::with_capacity(factors.len() + 1);
    for index in 0..=factors.len() {
        let (size, factor, scale) = match levels.last() {
            None => (spec.size, [1; 3], [1; 3]),
            Some(finer) => {
                let factor = factors[index - 1];
                if factor.contains(&0) || index >= MAX_LEVELS {
                    return Err(GeometryError::Levels(index));
                }
                let size = std::array::from_fn(|a| finer.size[a].div_ceil(factor[a]));
                (size, factor, std::array::from_fn(|a| finer.scale[a].saturating_mul(u64::from(factor[a]))))
            }
        };
        let pages: [u32; 3] = std::array::from_fn(|a| size[a].div_ceil(page[a]));
        for axis in 0..3 {
            if pages[axis] > max_pages {
                let (texels, pages) = (size[axis], pages[axis]);
                return Err(GeometryError::Pages { texels, pages, page: spec.page, max: max_pages });
            }
        }
        levels.push(Level { size, factor, scale, pages });
    }
    match levels.last() {
        Some(coarsest) if coarsest.size == [1; 3] => Ok(levels),
        _ => Err(GeometryError::Levels(factors.len())),
    }
}

fn check_spec(spec: &GeometrySpec) -> Result<(), GeometryError> {
    let in_range = spec.size.iter().all(|n| (1..=MAX_TEXELS).contains(n));
    if !in_range || (spec.dims == Dims::D2 && spec.size[2] != 1) {
        return Err(GeometryError::Size(spec.size));
    }
    if !PAGE_TEXELS.contains(&spec.page) {
        return Err(GeometryError::Page(spec.page));
    }
    if !(1..=max_border(spec.page)).contains(&spec.border) {
        return Err(GeometryError::Border { border: spec.border, page: spec.page });
    }
    if ![4, 8, 16].contains(&spec.tail_align) {
        return Err(GeometryError::TailAlign(spec.tail_align));
    }
    Ok(())
}

fn page_box(spec: &GeometrySpec) -> [u32; 3] {
    match spec.dims {
        Dims::D2 => [spec.page, spec.page, 1],
        Dims::D3 => [spec.page; 3],
    }
}

fn border_box(spec: &GeometrySpec) -> [u32; 3] {
    match spec.dims {
        Dims::D2 => [spec.border, spec.border, 0],
        Dims::D3 => [spec.border; 3],
    }
}

pub(crate) fn tile_box(spec: &GeometrySpec) -> [u32; 3] {
    let (page, border) = (page_box(spec), border_box(spec));
    std::array::from_fn(|a| page[a] + 2 * border[a])
}

/// Packs a page that exists; `None` cannot come of one, since geometries refuse what does not pack.
pub(crate) fn page_id(texture: TextureNumber, geometry: &Geometry, pos: PagePos) -> Option<PageId> {
    PageId::new(texture, geometry.dims(), pos).ok()
}

#[cfg(test)]
mod tests;
