//! Twin of position.wgsl, and of what takes a place in fixed point: a place that is given as a whole-numbered
//! anchor and an offset from it.

use vastex_core::AddressMode;
use vastex_core::shader_constants::FIXED_REACH;

use super::level::Footprint;
use super::lookup::{Place, Position};
use super::{Sampler, Texture};

/// A place along an axis, folded by an address mode.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coordinate {
    /// A texel of level 0.
    pub texel: u32,
    /// How far into it; beyond an edge that is clamped or has a border colour, less than 0 or more than 1.
    pub fraction: f32,
    /// -1 where a mirrored texture runs backwards, else 1.
    pub direction: f32,
}

/// `vastexi_folded_texel`: the place `offset` texels after the beginning of texel `anchor`, folded into
/// `size` texels.
pub fn folded_texel(anchor: u32, offset: f32, size: u32, mode: AddressMode) -> Coordinate {
    let offset = offset.clamp(-(FIXED_REACH as f32), FIXED_REACH as f32);
    let (size, fraction) = (i64::from(size), offset - offset.floor());
    let texel = i64::from(anchor).min(size - 1) + offset.floor() as i64;
    let inside = texel.clamp(0, size - 1);
    let (texel, fraction, direction) = match mode {
        AddressMode::Clamp | AddressMode::Border => (inside, (texel - inside) as f32 + fraction, 1.0),
        AddressMode::Wrap => (texel.rem_euclid(size), fraction, 1.0),
        AddressMode::Mirror => match texel.rem_euclid(2 * size) {
            turn if turn < size => (turn, fraction, 1.0),
            turn => (2 * size - 1 - turn, 1.0 - fraction, -1.0),
        },
    };
    Coordinate { texel: texel as u32, fraction, direction }
}

impl Texture<'_> {
    pub(super) fn position_from_fixed(&self, anchor: [u32; 2], offset: [f32; 2]) -> Position {
        let (size, address) = (self.geometry.size(), self.geometry.address());
        let folded = [0, 1].map(|a| folded_texel(anchor[a], offset[a], size[a], address[a]));
        Position {
            texel: folded.map(|at| at.texel),
            fraction: folded.map(|at| at.fraction),
            direction: folded.map(|at| at.direction),
        }
    }

    /// Where the finest resident page that covers a texel of level 0 at `wanted`, a level of the texture, has
    /// it.
    pub fn place_of_texel(&self, texel: [u32; 2], wanted: u8) -> Place {
        self.place_of(self.position_from_fixed(texel, [0.5; 2]), wanted)
    }

    /// `vastex_feedback_fixed_grad`: a feedback pixel, from gradients in texels of level 0 along one pixel of
    /// the target.
    pub fn feedback_fixed_grad(
        &self,
        anchor: [u32; 2],
        offset: [f32; 2],
        ddx: [f32; 2],
        ddy: [f32; 2],
    ) -> [u32; 4] {
        self.feedback_texel_grad(self.position_from_fixed(anchor, offset), ddx, ddy)
    }

    /// `vastex_feedback_fixed_level`: the same for an explicit level.
    pub fn feedback_fixed_level(&self, anchor: [u32; 2], offset: [f32; 2], level: f32) -> [u32; 4] {
        self.feedback(self.position_from_fixed(anchor, offset), level)
    }
}

impl Sampler<'_> {
    /// `vastex_sample_fixed_grad`: the colour `offset` texels of level 0 after the beginning of texel
    /// `anchor`, from gradients in texels along one pixel; linear, 0 to 1.
    pub fn sample_fixed_grad(
        &self,
        anchor: [u32; 2],
        offset: [f32; 2],
        ddx: [f32; 2],
        ddy: [f32; 2],
    ) -> [f32; 4] {
        self.sample_texel_grad(self.texture.position_from_fixed(anchor, offset), ddx, ddy)
    }

    /// `vastex_sample_fixed_level`: the same, `level` levels coarser than level 0, biases to be added.
    pub fn sample_fixed_level(&self, anchor: [u32; 2], offset: [f32; 2], level: f32) -> [f32; 4] {
        self.sample_position(self.texture.position_from_fixed(anchor, offset), Footprint::of_level(level))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use AddressMode::{Border, Clamp, Mirror, Wrap};

    /// The far edges of the largest texture: nothing overflows, and the turns meet.
    #[test]
    fn the_ends_of_the_largest_texture_fold() {
        let size = 1 << 31;
        let last = size - 1;
        let folded = |anchor, offset, mode| {
            let at = folded_texel(anchor, offset, size, mode);
            (at.texel, at.fraction)
        };
        for (mode, before, after) in [
            (Clamp, (0, -0.25), (last, 2.5)),
            (Wrap, (last, 0.75), (1, 0.5)),
            (Mirror, (0, 0.25), (last - 1, 0.5)),
            (Border, (0, -0.25), (last, 2.5)),
        ] {
            assert_eq!(folded(0, -0.25, mode), before, "{mode:?}");
            assert_eq!(folded(last, 2.5, mode), after, "{mode:?}");
            assert_eq!(folded(last, -0.5, mode), (last - 1, 0.5), "{mode:?}");
        }
        assert_eq!(folded(0, -(FIXED_REACH as f32), Wrap), (size - FIXED_REACH, 0.0));
        assert_eq!(folded(last, f32::INFINITY, Wrap), (FIXED_REACH - 1, 0.0));
    }
}
