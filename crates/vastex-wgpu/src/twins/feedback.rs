//! Twin of feedback.wgsl: the page that a pixel wants at mip bias 0.

use vastex_core::shared::{FEEDBACK_DEGENERATE, FEEDBACK_WANTED, STEPS_PER_LEVEL};
use vastex_core::{PageId, PagePos};

use super::Texture;
use super::level::degenerate_lambda;

impl Texture<'_> {
    /// `vastex_feedback_grad`: a feedback pixel, from gradients of uv along one pixel of the target.
    pub fn feedback_grad(&self, uv: [f32; 2], ddx: [f32; 2], ddy: [f32; 2]) -> [u32; 4] {
        let ordinary = degenerate_lambda(self.texels(ddx), self.texels(ddy)).is_none();
        let flag = if ordinary { FEEDBACK_WANTED } else { FEEDBACK_DEGENERATE };
        self.feedback(uv, self.lambda(ddx, ddy) + self.level_offset, flag)
    }

    /// `vastex_feedback_level`: the same for an explicit level.
    pub fn feedback_level(&self, uv: [f32; 2], level: f32) -> [u32; 4] {
        self.feedback(uv, level, FEEDBACK_WANTED)
    }

    fn feedback(&self, uv: [f32; 2], lambda: f32, flag: u32) -> [u32; 4] {
        let tail = self.geometry.tail().first_level();
        let steps = (self.unbiased_level(lambda) * STEPS_PER_LEVEL as f32).floor() as u32;
        let level = (steps / STEPS_PER_LEVEL).min(u32::from(tail)) as u8;
        let eighth = (steps - u32::from(level) * STEPS_PER_LEVEL).min(STEPS_PER_LEVEL - 1);
        let pos: PagePos = if level < tail {
            self.page_from_position(self.position_from_uv(uv), level)
        } else {
            self.geometry.tail_pos()
        };
        // Every page of a geometry fits a page id.
        let id = PageId::new(self.number, self.geometry.dims(), pos).unwrap_or(PageId::NONE).to_bits();
        [id as u32, (id >> 32) as u32, eighth, flag]
    }
}
