//! Twin of sample.wgsl, of the filters' modules and of the atlases': sampling of tiles in memory.

use vastex_core::{LayerFormat, Slot};

use super::Texture;
use super::level::Footprint;
use super::lookup::{Place, Position};
use crate::filter::Filter;

/// A texture with what is needed to sample it.
pub struct Sampler<'a> {
    /// The texture.
    pub texture: Texture<'a>,
    /// The format of the sampled layer, as its tiles are given.
    pub format: LayerFormat,
    /// The sampled layer's texels of the tile in a slot, row by row, [decoded](LayerFormat::decoded).
    pub tile: &'a dyn Fn(Slot) -> &'a [u8],
}

impl std::fmt::Debug for Sampler<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Sampler")
            .field("texture", &self.texture)
            .field("format", &self.format)
            .finish_non_exhaustive()
    }
}

impl<'a> Sampler<'a> {
    fn by_uv(&self) -> Sampler<'a> {
        Sampler { texture: self.texture.by_uv(), format: self.format, tile: self.tile }
    }
}

impl Sampler<'_> {
    /// `vastex_sample_grad`: the colour at `uv`, from gradients of uv along one pixel; linear, 0 to 1.
    pub fn sample_grad(&self, uv: [f32; 2], ddx: [f32; 2], ddy: [f32; 2]) -> [f32; 4] {
        let texture = &self.texture;
        let [dx, dy] = [ddx, ddy].map(|gradient| texture.texels(gradient));
        self.by_uv().sample_texel_grad(texture.position_from_uv(uv), dx, dy)
    }

    /// `vastex_sample_level`: the same, `level` levels coarser than level 0, biases to be added.
    pub fn sample_level(&self, uv: [f32; 2], level: f32) -> [f32; 4] {
        self.by_uv().sample_position(self.texture.position_from_uv(uv), Footprint::of_level(level))
    }

    /// `vastexi_sample_texels`: at a position, from gradients in texels of level 0.
    pub(super) fn sample_texel_grad(&self, position: Position, dx: [f32; 2], dy: [f32; 2]) -> [f32; 4] {
        let mut footprint = self.texture.footprint(dx, dy);
        footprint.axis = [0, 1].map(|a| footprint.axis[a] * position.direction[a]);
        self.sample_position(position, footprint)
    }

    /// `vastexi_sample`: what a pixel shows that covers so much around a position.
    pub(super) fn sample_position(&self, position: Position, footprint: Footprint) -> [f32; 4] {
        let level = self.texture.level(footprint.lambda);
        let finer = level.floor() as u8;
        let share = level - f32::from(finer);
        let taken = |place, wanted| match self.texture.filter {
            Filter::Nearest => self.nearest(place),
            Filter::Bilinear | Filter::Trilinear => self.linear(place),
            Filter::Anisotropic(_) => self.along(position, place, footprint, level, wanted),
            Filter::Bicubic => self.cubic_or_linear(position, place, footprint.lambda, wanted),
        };
        let filtered = |wanted| self.texture.shown(position, wanted, |place| taken(place, wanted));
        let is_one_level = matches!(self.texture.filter, Filter::Nearest | Filter::Bilinear);
        if is_one_level || share == 0.0 {
            return filtered(finer);
        }
        mix(filtered(finer), filtered(finer + 1), share)
    }

    fn along(
        &self,
        position: Position,
        place: Place,
        footprint: Footprint,
        level: f32,
        wanted: u8,
    ) -> [f32; 4] {
        let texture = &self.texture;
        let bounds = texture.tile_bounds(position, place.level);
        let (mut sum, mut taps) = ([0.0; 4], 0.0);
        for offset in footprint.taps(level, texture.filter.max_taps()) {
            let tap = match texture.place_in_tile(position, place, bounds, offset) {
                Some(place) => self.linear(place),
                None => self.beside(position, offset, wanted),
            };
            sum = std::array::from_fn(|c| sum[c] + tap[c]);
            taps += 1.0;
        }
        sum.map(|sum| sum / taps)
    }

    /// One tap `offset` texels of level 0 from a position, in the page that covers it.
    fn beside(&self, position: Position, offset: [f32; 2], wanted: u8) -> [f32; 4] {
        let beside = self.texture.position_beside(position, offset);
        self.texture.shown(beside, wanted, |place| self.linear(place))
    }

    fn cubic_or_linear(&self, position: Position, place: Place, lambda: f32, wanted: u8) -> [f32; 4] {
        let texture = &self.texture;
        let share = (texture.unbiased_level(lambda) - (lambda + texture.rule.bias)).clamp(0.0, 1.0);
        if share == 0.0 {
            self.linear(place)
        } else {
            mix(self.linear(place), self.cubic(position, place, wanted), share)
        }
    }

    fn cubic(&self, position: Position, place: Place, wanted: u8) -> [f32; 4] {
        let texture = &self.texture;
        let middle = texture.free_tile_texel(position, place.level);
        let centred = middle.map(|texel| texel - 0.5);
        let first = centred.map(|texel| texel.floor() - 1.0);
        let [x, y] = centred.map(|texel| cubic_weights(texel - texel.floor()));
        let [low, high] = texture.tile_bounds(position, place.level);
        let is_within = (0..2).all(|a| first[a] >= low[a] - 0.5 && first[a] + 3.5 < high[a]);
        let scale = texture.geometry.level(place.level).scale.map(|s| s as f32 * texture.layer_scale as f32);
        let mut sum = [0.0; 4];
        for (row, column) in (0..4).flat_map(|row| (0..4).map(move |column| (row, column))) {
            let texel = [first[0] + column as f32, first[1] + row as f32];
            let offset = [0, 1].map(|a| (texel[a] + 0.5 - middle[a]) * scale[a]);
            let tap = match is_within {
                true => self.texel(place.slot, texel),
                false => self.beside(position, offset, wanted),
            };
            sum = std::array::from_fn(|c| sum[c] + x[column] * y[row] * tap[c]);
        }
        sum
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

    /// One texel of a tile, decoded. Borders are at least as wide as a filter reaches, so the place is in the
    /// tile.
    fn texel(&self, slot: Slot, tile_texel: [f32; 2]) -> [f32; 4] {
        let tile = self.texture.geometry.tile().map(|side| side / self.texture.layer_scale);
        let [x, y] = [0, 1].map(|a| (tile_texel[a].max(0.0) as usize).min(tile[a] as usize - 1));
        let first = (y * tile[0] as usize + x) * self.format.texel_bytes();
        decode(self.format, &(self.tile)(slot)[first..][..self.format.texel_bytes()])
    }
}

/// Weights of the four texels around a place that lies `at`, 0 to 1, between the middle two: the cubic of
/// Catmull and Rom.
fn cubic_weights(at: f32) -> [f32; 4] {
    [
        at * (at * (1.0 - 0.5 * at) - 0.5),
        at * at * (1.5 * at - 2.5) + 1.0,
        at * (at * (2.0 - 1.5 * at) + 0.5),
        at * at * (0.5 * at - 0.5),
    ]
}

fn mix(a: [f32; 4], b: [f32; 4], weight: f32) -> [f32; 4] {
    std::array::from_fn(|c| a[c] * (1.0 - weight) + b[c] * weight)
}

pub(super) fn decode(format: LayerFormat, bytes: &[u8]) -> [f32; 4] {
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
