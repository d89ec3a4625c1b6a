//! Twin of sample_fixed.wgsl and feedback_fixed.wgsl: a place that is given as a whole-numbered anchor and an offset from it.

use vastex_core::AddressMode;
use vastex_core::shared::FIXED_REACH;

use super::level::lambda;
use super::lookup::Position;
use super::{Sampler, Texture};

/// `vastex_folded_texel`: the place `offset` texels after the beginning of texel `anchor`, folded into `size` texels.
pub fn folded_texel(anchor: u32, offset: f32, size: u32, mode: AddressMode) -> (u32, f32) {
    let offset = offset.clamp(-(FIXED_REACH as f32), FIXED_REACH as f32);
    let (size, fraction) = (i64::from(size), offset - offset.floor());
    let texel = i64::from(anchor).min(size - 1) + offset.floor() as i64;
    let inside = texel.clamp(0, size - 1);
    match mode {
        AddressMode::Clamp if texel < 0 => (0, 0.0),
        AddressMode::Clamp if texel >= size => (inside as u32, 1.0),
        AddressMode::Clamp => (texel as u32, fraction),
        AddressMode::Border => (inside as u32, (texel - inside) as f32 + fraction),
        AddressMode::Wrap => (texel.rem_euclid(size) as u32, fraction),
        AddressMode::Mirror => match texel.rem_euclid(2 * size) {
            turn if turn < size => (turn as u32, fraction),
            turn => ((2 * size - 1 - turn) as u32, 1.0 - fraction),
        },
    }
}

impl Texture<'_> {
    fn position_from_fixed(&self, anchor: [u32; 2], offset: [f32; 2]) -> Position {
        let (size, address) = (self.geometry.size(), self.geometry.address());
        let folded = [0, 1].map(|a| folded_texel(anchor[a], offset[a], size[a], address[a]));
        Position { texel: folded.map(|(texel, _)| texel), fraction: folded.map(|(_, fraction)| fraction) }
    }

    /// `vastex_feedback_fixed_grad`: a feedback pixel, from gradients in texels of level 0 along one pixel of the target.
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
    /// `vastex_sample_fixed_grad`: the colour `offset` texels of level 0 after the beginning of texel `anchor`, from gradients
    /// in texels along one pixel; linear, 0 to 1.
    pub fn sample_fixed_grad(
        &self,
        anchor: [u32; 2],
        offset: [f32; 2],
        ddx: [f32; 2],
        ddy: [f32; 2],
    ) -> [f32; 4] {
        self.sample_fixed_level(anchor, offset, lambda(ddx, ddy))
    }

    /// `vastex_sample_fixed_level`: the same, `level` levels coarser than level 0, biases to be added.
    pub fn sample_fixed_level(&self, anchor: [u32; 2], offset: [f32; 2], level: f32) -> [f32; 4] {
        self.sample_at(self.texture.position_from_fixed(anchor, offset), level)
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
        for (mode, before, after) in [
            (Clamp, (0, 0.0), (last, 1.0)),
            (Wrap, (last, 0.75), (1, 0.5)),
            (Mirror, (0, 0.25), (last - 1, 0.5)),
            (Border, (0, -0.25), (last, 2.5)),
        ] {
            assert_eq!(folded_texel(0, -0.25, size, mode), before, "{mode:?}");
            assert_eq!(folded_texel(last, 2.5, size, mode), after, "{mode:?}");
            assert_eq!(folded_texel(last, -0.5, size, mode), (last - 1, 0.5), "{mode:?}");
        }
        assert_eq!(folded_texel(0, -(FIXED_REACH as f32), size, Wrap), (size - FIXED_REACH, 0.0));
        assert_eq!(folded_texel(last, f32::INFINITY, size, Wrap), (FIXED_REACH - 1, 0.0));
    }
}
