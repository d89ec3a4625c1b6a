//! The shaders' twins on the CPU, the head of each shader names the file of its twin.
//!
//! They are naive on purpose, so that they can be read beside the WGSL, and do the same arithmetic in `f32`.
//! Tests compare the two on the same inputs; a picture that is beyond a device's limits is compared with the
//! twin alone.

mod brick;
mod fade;
mod feedback;
mod fixed;
mod level;
mod lookup;
mod reach;
mod sample;

pub use brick::Bricks;
pub use fixed::{Coordinate, folded_texel};
pub use lookup::Place;
pub use sample::Sampler;

use vastex_core::{Geometry, LevelRule, PageTable, TextureNumber};

use crate::filter::Filter;

/// A virtual texture as shaders know it: its record and page table, and of its pool and the view what bears
/// on levels and on the layer. One whose values may not be mixed is as one of the filter [`Filter::Nearest`]
/// that does not fade.
#[derive(Clone, Copy, Debug)]
pub struct Texture<'a> {
    /// The texture's shape.
    pub geometry: &'a Geometry,
    /// The texture's page table.
    pub table: &'a dyn PageTable,
    /// How texels are blended, on which the level depends.
    pub filter: Filter,
    /// The texture's number in page ids.
    pub number: TextureNumber,
    /// How the texture's levels are chosen, as far as it has them.
    pub rule: LevelRule,
    /// The pool's mip bias, in eighths of a level.
    pub pool_bias: u16,
    /// Texels of the texture along one of the sampled layer: 1, 2 or 4.
    pub layer_scale: u32,
    /// Levels added in a feedback pass because its pixels are larger than the picture's.
    pub level_offset: f32,
    /// How much of what was there before a tile came remains, of 255, by slot
    /// ([`Fades::shares`](crate::Fades::shares)); of a slot beyond the end nothing.
    pub fades: &'a [u8],
}

impl<'a> Texture<'a> {
    /// A texture without biases and with all its tiles there, drawn by a trilinear filter at full resolution;
    /// a layer that has it, too.
    pub fn new(geometry: &'a Geometry, table: &'a dyn PageTable, number: TextureNumber) -> Texture<'a> {
        let rule = LevelRule::default().within(geometry);
        Texture {
            geometry,
            table,
            filter: Filter::default(),
            number,
            rule,
            pool_bias: 0,
            layer_scale: 1,
            level_offset: 0.0,
            fades: &[],
        }
    }

    /// `vastexi_texture_by_uv`: the same for functions that take a uv, which want no level finer than uv can
    /// tell.
    fn by_uv(&self) -> Texture<'a> {
        let least = crate::record::uv_finest(self.geometry);
        let LevelRule { bias, finest, coarsest } = self.rule;
        Texture {
            rule: LevelRule { bias, finest: finest.max(least), coarsest: coarsest.max(least) },
            ..*self
        }
    }
}
