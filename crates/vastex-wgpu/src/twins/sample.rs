//! Twin of sample.wgsl: nearest, bilinear and trilinear sampling of tiles in memory.

use vastex_core::{LayerFormat, Slot};

use super::Texture;
use super::lookup::{Place, Position};
use crate::shader::Filter;

/// A texture with what is needed to sample it.
pub struct Sampler<'a> {
    /// The texture.
    pub texture: Texture<'a>,
    /// The format of the sampled layer, as its tiles are given.
    pub format: LayerFormat,
    /// How texels are blended.
    pub filter: Filter,
    /// The sampled layer's texels of the tile in a slot, row by row, [decoded](LayerFormat::decoded).
    pub tile: &'a dyn Fn(Slot) -> &'a [u8],
}

impl std::fmt::Debug for Sampler<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Sampler")
            .field("texture", &self.texture)
            .field("format", &self.format)
            .field("filter", &self.filter)
            .finish_non_exhaustive()
    }
}

impl Sampler<'_> {
    /// `vastex_sample_grad`: the colour at `uv`, from gradients of uv along one pixel; linear, 0 to 1.
    pub fn sample_grad(&self, uv: [f32; 2], ddx: [f32; 2], ddy: [f32; 2]) -> [f32; 4] {
        self.sample_level(uv, self.texture.lambda(ddx, ddy))
    }

    /// `vastex_sample_level`: the same, `level` levels coarser than level 0, biases to be added.
    pub fn sample_level(&self, uv: [f32; 2], level: f32) -> [f32; 4] {
        self.sample_at(self.texture.position_from_uv(uv), level)
    }

    /// `vastex_sample_lambda`: at a position.
    pub(super) fn sample_at(&self, position: Position, level: f32) -> [f32; 4] {
        let level = self.texture.level(level);
        let finer = level.floor() as u8;
        let place = self.texture.place_of(position, finer);
        match self.filter {
            Filter::Nearest => self.nearest(place),
            Filter::Bilinear => self.linear(place),
            Filter::Trilinear => {
                let coarser = (finer + 1).min(self.texture.geometry.coarsest());
                let blurred = self.linear(self.texture.place_of(position, coarser));
                mix(self.linear(place), blurred, level - f32::from(finer))
            }
        }
    }

    fn nearest(&self, place: Place) -> [f32; 4] {
        self.texel(place.slot, place.tile_texel.map(f32::floor))
    }

    fn linear(&self, place: Place) -> [f32; 4] {
        let centred = place.tile_texel.map(|texel| texel - 0.5);
        let first = centred.map(f32::floor);
        let tap = |x: f32, y: f32| self.texel(place.slot, [first[0] + x, first[1] + y]);
        let weight = [0, 1].map(|a| centred[a] - first[a]);
        mix(
            mix(tap(0.0, 0.0), tap(1.0, 0.0), weight[0]),
            mix(tap(0.0, 1.0), tap(1.0, 1.0), weight[0]),
            weight[1],
        )
    }

    /// One texel of a tile, decoded. Borders are at least as wide as a filter reaches, so the place is in the tile.
    fn texel(&self, slot: Slot, tile_texel: [f32; 2]) -> [f32; 4] {
        let tile = self.texture.geometry.tile().map(|side| side / self.texture.layer_scale);
        let [x, y] = [0, 1].map(|a| (tile_texel[a].max(0.0) as usize).min(tile[a] as usize - 1));
        let first = (y * tile[0] as usize + x) * self.format.texel_bytes();
        decode(self.format, &(self.tile)(slot)[first..][..self.format.texel_bytes()])
    }
}

fn mix(a: [f32; 4], b: [f32; 4], weight: f32) -> [f32; 4] {
    std::array::from_fn(|c| a[c] * (1.0 - weight) + b[c] * weight)
}

fn decode(format: LayerFormat, bytes: &[u8]) -> [f32; 4] {
    use LayerFormat::{R8, R16, R16Float, R32Float, Rg8, Rgba8Srgb, Rgba16, Rgba16Float};
    let unorm = |channel: usize| f32::from(bytes[channel]) / 255.0;
    let word = |channel: usize| [bytes[2 * channel], bytes[2 * channel + 1]];
    let unorm16 = |channel: usize| f32::from(u16::from_le_bytes(word(channel))) / 65535.0;
    let half = |channel: usize| half::f16::from_le_bytes(word(channel)).to_f32();
    match format.decoded() {
        R8 => [unorm(0), 0.0, 0.0, 1.0],
        Rg8 => [unorm(0), unorm(1), 0.0, 1.0],
        Rgba8Srgb => {
            [linear_from_srgb(unorm(0)), linear_from_srgb(unorm(1)), linear_from_srgb(unorm(2)), unorm(3)]
        }
        R16 => [unorm16(0), 0.0, 0.0, 1.0],
        Rgba16 => std::array::from_fn(unorm16),
        R16Float => [half(0), 0.0, 0.0, 1.0],
        Rgba16Float => std::array::from_fn(half),
        R32Float => [f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]), 0.0, 0.0, 1.0],
        // Rgba8, and nothing else: no other format decodes to itself.
        _ => std::array::from_fn(unorm),
    }
}

fn linear_from_srgb(encoded: f32) -> f32 {
    if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}
