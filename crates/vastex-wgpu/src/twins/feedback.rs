//! Twin of feedback.wgsl: the page that a pixel wants at mip bias 0.

use vastex_core::shader_constants::{FEEDBACK_DEGENERATE, FEEDBACK_WANTED, STEPS_PER_LEVEL};
use vastex_core::{PageId, PagePos};

use super::Texture;
use super::level::degenerate_lambda;
use super::lookup::Position;

impl Texture<'_> {
    /// `vastex_feedback_grad`: a feedback pixel, from gradients of uv along one pixel of the target.
    pub fn feedback_grad(&self, uv: [f32; 2], ddx: [f32; 2], ddy: [f32; 2]) -> [u32; 4] {
        let [dx, dy] = [ddx, ddy].map(|gradient| self.texels(gradient));
        self.by_uv().feedback_texel_grad(self.position_from_uv(uv), dx, dy)
    }

    /// `vastex_feedback_level`: the same for an explicit level.
    pub fn feedback_level(&self, uv: [f32; 2], level: f32) -> [u32; 4] {
        self.by_uv().feedback(self.position_from_uv(uv), level)
    }

    /// `vastexi_feedback`: at a position, from gradients in texels.
    pub(super) fn feedback_texel_grad(&self, position: Position, dx: [f32; 2], dy: [f32; 2]) -> [u32; 4] {
        let flag = if degenerate_lambda(dx, dy).is_none() { FEEDBACK_WANTED } else { FEEDBACK_DEGENERATE };
        self.feedback_lambda(position, self.footprint(dx, dy).lambda + self.level_offset, flag)
    }

    /// At a position and an explicit level.
    pub(super) fn feedback(&self, position: Position, level: f32) -> [u32; 4] {
        self.feedback_lambda(position, level, FEEDBACK_WANTED)
    }

    fn feedback_lambda(&self, position: Position, lambda: f32, flag: u32) -> [u32; 4] {
        let tail = self.geometry.tail().first_level();
        let steps = (self.unbiased_level(lambda) * STEPS_PER_LEVEL as f32).floor() as u32;
        let level = (steps / STEPS_PER_LEVEL).min(u32::from(tail)) as u8;
        let eighth = (steps - u32::from(level) * STEPS_PER_LEVEL).min(STEPS_PER_LEVEL - 1);
        let pos: PagePos =
            if level < tail { self.page_from_position(position, level) } else { self.geometry.tail_pos() };
        // Every page of a geometry fits a page id.
        let id = PageId::new(self.number, self.geometry.dims(), pos).unwrap_or(PageId::NONE).to_bits();
        [id as u32, (id >> 32) as u32, eighth, flag]
    }
}
