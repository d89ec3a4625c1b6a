//! Where a view says which pages it wants: the feedback target, and how the picture is put onto it.
//!
//! A target pixel stands for a block of [`shader_constants::FEEDBACK_SCALE`] pixels per side and looks at one
//! of them, another each frame: after a jitter cycle every row and column of the block was visited. What is
//! written into a pixel is the shader's business (feedback.wgsl), how it comes back that of
//! [`Readback`](crate::Readback); where the main pass says it instead, that is `inline`'s.

use vastex_core::shader_constants;

use crate::device::alive;
use crate::error::GpuError;
use crate::mirror::ViewParams;
use crate::raw::RawTexture;
use crate::views::{NO_VIEW, Views};

/// The format of its depth buffer.
pub const FEEDBACK_DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// Which pixel of its block a target pixel looks at, frame after frame: two in each row and each column, one
/// in each square of four, and, of whatever repeats after four pixels along either axis, such as surfaces
/// that are dithered into one another, each of the sixteen once. They are ordered so that those of a few
/// frames lie far apart.
const JITTER: [[u32; 2]; shader_constants::JITTER_CYCLE as usize] = [
    [5, 5],
    [0, 0],
    [4, 1],
    [1, 4],
    [4, 3],
    [1, 6],
    [5, 7],
    [0, 2],
    [6, 3],
    [3, 6],
    [7, 7],
    [2, 2],
    [6, 1],
    [3, 4],
    [7, 5],
    [2, 0],
];

/// Bits of what shaders know of a pass for gaps that say which pass it is; the others say of how many that
/// are not there a pixel names one (brick.wgsl).
const GAP_PASS_BITS: u32 = 8;

/// Which pixels of the picture a frame's feedback looks at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FeedbackPass {
    /// The pixels of a frame of the jitter cycle, by its number.
    Cycle(u64),
    /// Of rays, in a few passes all of them, by the number of the pass (`FeedbackView::gap_passes`): each
    /// pixel of the target looks at one of its own, and asks for something that is not there.
    Gaps {
        /// The number of the pass.
        pass: u64,
        /// Of how many that are not there a pixel asks for one, a different one each time that all pixels are
        /// looked at: 1 at least, 2^24 at most.
        turns: u32,
    },
}

impl From<u64> for FeedbackPass {
    fn from(frame: u64) -> FeedbackPass {
        FeedbackPass::Cycle(frame)
    }
}

/// How many pixels of the picture a pixel of the target stands for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum FeedbackScale {
    /// A block of 8 pixels per side, of which one is looked at. For every
    /// frame.
    #[default]
    Reduced,
    /// A block of twice as many per side, of which one is looked at: a quarter of the cost. For what is only
    /// expected.
    Coarse,
    /// One. For statistics of a whole picture.
    Full,
}

impl FeedbackScale {
    /// Pixels of the picture per side for which a pixel of the target stands.
    pub const fn block(self) -> u32 {
        match self {
            FeedbackScale::Reduced => shader_constants::FEEDBACK_SCALE,
            FeedbackScale::Coarse => 2 * shader_constants::FEEDBACK_SCALE,
            FeedbackScale::Full => 1,
        }
    }
}

/// How a picture is put onto a feedback target in one frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FeedbackView {
    picture: [u32; 2],
    scale: FeedbackScale,
    look: FeedbackPass,
    /// Answers of each block: as many pixels of the target below one another.
    answers: u32,
    /// The one that is looked at, where it is one.
    pixel: Option<[u32; 2]>,
}

impl FeedbackView {
    /// The view of a picture of so many pixels, in a frame of the jitter cycle.
    pub const fn new(picture: [u32; 2], scale: FeedbackScale, frame: u64) -> FeedbackView {
        FeedbackView { picture, scale, look: FeedbackPass::Cycle(frame), answers: 1, pixel: None }
    }

    /// Passes in which every pixel of the picture is looked at where gaps are looked for.
    pub const fn gap_passes(answers: u32) -> u32 {
        let block = FeedbackScale::Reduced.block();
        (block * block).div_ceil(if answers == 0 { 1 } else { answers })
    }

    /// This view with so many answers of each block, at least 1: for rays, each of which meets several
    /// bricks. They are pixels of the target below one another, which look at the same pixel of the picture.
    pub const fn with_answers(self, answers: u32) -> FeedbackView {
        FeedbackView { answers: if answers == 0 { 1 } else { answers }, ..self }
    }

    /// The view of a single pixel of a picture. Its target has the four pixels that share gradients, so that
    /// the pixel wants the same as in a view of the whole picture.
    pub const fn of_pixel(picture: [u32; 2], pixel: [u32; 2], frame: u64) -> FeedbackView {
        let look = FeedbackPass::Cycle(frame);
        FeedbackView { picture, scale: FeedbackScale::Full, look, answers: 1, pixel: Some(pixel) }
    }

    /// The first pixel of the picture that the target of one pixel shows.
    fn window([x, y]: [u32; 2]) -> [u32; 2] {
        [x / 2 * 2, y / 2 * 2]
    }

    /// Size of the target in pixels: enough to cover the picture, with a row for each answer.
    pub fn target_size(&self) -> [u32; 2] {
        let [columns, rows] = self.blocks();
        [columns, rows.saturating_mul(self.answers)]
    }

    /// Blocks that cover the picture, along each axis.
    fn blocks(&self) -> [u32; 2] {
        if self.pixel.is_some() {
            return [2; 2];
        }
        self.picture.map(|side| side.div_ceil(self.scale.block()))
    }

    /// Which pixel of its block each target pixel looks at in this frame: pixel `(i, j)` of the target at
    /// pixel `(block * i + x, block * j + y)` of the picture. Where gaps are looked for it is the first of
    /// the block, from which each finds its own.
    pub fn jitter(&self) -> [u32; 2] {
        let FeedbackPass::Cycle(frame) = self.look else { return [0; 2] };
        let nth = (frame % JITTER.len() as u64) as usize;
        match self.scale {
            FeedbackScale::Reduced => JITTER[nth],
            // Of the four pixels there another each time, so that none of a checkerboard is missed.
            FeedbackScale::Coarse => {
                [2 * JITTER[nth][0] + (nth as u32 & 1), 2 * JITTER[nth][1] + (nth as u32 >> 1 & 1)]
            }
            FeedbackScale::Full => [0, 0],
        }
    }

    /// Scale and offset that put the picture onto the target: a vertex at `clip` in the picture is drawn at
    /// `clip.xy * scale + offset * clip.w`. The centre of each target pixel then lies on the centre of the
    /// picture's pixel that it looks at; of several answers, those together do, and `vastex_ray_pixel` puts
    /// each there. In WGSL `vastex_feedback_clip` does this.
    pub fn clip_transform(&self) -> ([f32; 2], [f32; 2]) {
        if let Some(first) = self.pixel.map(FeedbackView::window) {
            let [x, y] = self.picture.map(|side| side as f32 / 2.0);
            return ([x, y], [x - first[0] as f32 - 1.0, first[1] as f32 + 1.0 - y]);
        }
        let (block, size, jitter) = (self.scale.block() as f32, self.blocks(), self.jitter());
        let axis = |a: usize, direction: f32| {
            let (pixels, covered) = (self.picture[a] as f32, block * size[a] as f32);
            let first = (pixels + block - 1.0 - 2.0 * jitter[a] as f32) / covered - 1.0;
            (pixels / covered, direction * first)
        };
        let ((scale_x, offset_x), (scale_y, offset_y)) = (axis(0, 1.0), axis(1, -1.0));
        ([scale_x, scale_y], [offset_x, offset_y])
    }

    /// Columns and rows of the target that look at pixels inside the picture in this frame; the rest is cut.
    pub fn covered(&self) -> [u32; 2] {
        let (block, jitter) = (self.scale.block(), self.jitter());
        let [columns, rows] = [0, 1].map(|a| self.picture[a].saturating_sub(jitter[a]).div_ceil(block));
        [columns, rows.saturating_mul(self.answers)]
    }

    /// Where the target is drawn into in this frame: its first column and row, and how many.
    fn scissor(&self) -> [u32; 4] {
        match self.pixel {
            Some(pixel) => {
                let first = FeedbackView::window(pixel);
                [pixel[0] - first[0], pixel[1] - first[1], 1, 1]
            }
            None => {
                let [columns, rows] = self.covered();
                [0, 0, columns, rows]
            }
        }
    }

    fn params(&self) -> ViewParams {
        let (clip_scale, clip_offset) = self.clip_transform();
        let level_offset = -(self.scale.block().ilog2() as f32);
        let (answers, block) = (self.answers, self.scale.block());
        let (frame, gaps) = match self.look {
            FeedbackPass::Cycle(frame) => (frame as u32, 0),
            FeedbackPass::Gaps { pass, turns } => {
                let passes = u64::from(FeedbackView::gap_passes(answers));
                let turns = turns.clamp(1, (1 << (32 - GAP_PASS_BITS)) - 1);
                ((pass / passes) as u32, (turns << GAP_PASS_BITS) | ((pass % passes) as u32 + 1))
            }
        };
        ViewParams { clip_scale, clip_offset, level_offset, frame, answers, block, gaps, ..NO_VIEW }
    }

    /// For the main pass that says by itself what it wants: its pixels are the picture's.
    pub(crate) fn inline_params(&self, reversed_depth: bool) -> ViewParams {
        let frame = match self.look {
            FeedbackPass::Cycle(frame) | FeedbackPass::Gaps { pass: frame, .. } => frame as u32,
        };
        ViewParams {
            frame,
            jitter: self.jitter(),
            columns: self.target_size()[0],
            rows: self.target_size()[1],
            cell: self.scale.block(),
            reversed_depth: u32::from(reversed_depth),
            ..NO_VIEW
        }
    }
}

/// The texture into which a view says which pages it wants, and its depth buffer.
///
/// 20 bytes for each pixel: at the reduced scale a third of a byte for each pixel of the picture and answer.
#[derive(Debug)]
pub struct FeedbackTarget {
    picture: [u32; 2],
    scale: FeedbackScale,
    answers: u32,
    /// The one that it is for, where it is one.
    pixel: Option<[u32; 2]>,
    raw: RawTexture,
    depth_view: wgpu::TextureView,
}

impl FeedbackTarget {
    /// A target for pictures of so many pixels.
    pub fn new(
        device: &wgpu::Device,
        picture: [u32; 2],
        scale: FeedbackScale,
    ) -> Result<FeedbackTarget, GpuError> {
        FeedbackTarget::of_view(device, FeedbackView::new(picture, scale, 0))
    }

    /// A target for pictures of rays, each of which gives so many answers in a frame, at least 1. Fails where
    /// a texture of so many rows is larger than the device allows.
    pub fn of_rays(
        device: &wgpu::Device,
        picture: [u32; 2],
        scale: FeedbackScale,
        answers: u32,
    ) -> Result<FeedbackTarget, GpuError> {
        FeedbackTarget::of_view(device, FeedbackView::new(picture, scale, 0).with_answers(answers))
    }

    /// A target for one pixel of pictures of so many pixels, which lies within them.
    pub fn of_pixel(
        device: &wgpu::Device,
        picture: [u32; 2],
        pixel: [u32; 2],
    ) -> Result<FeedbackTarget, GpuError> {
        FeedbackTarget::of_view(device, FeedbackView::of_pixel(picture, pixel, 0))
    }

    fn of_view(device: &wgpu::Device, view: FeedbackView) -> Result<FeedbackTarget, GpuError> {
        alive(device)?;
        let (FeedbackView { picture, scale, answers, pixel, .. }, size) = (view, view.target_size());
        let raw = RawTexture::new(device, size, wgpu::TextureUsages::RENDER_ATTACHMENT)?;
        let depth = raw.beside(device, FEEDBACK_DEPTH_FORMAT, wgpu::TextureUsages::RENDER_ATTACHMENT);
        let depth_view = depth.create_view(&Default::default());
        Ok(FeedbackTarget { picture, scale, answers, pixel, raw, depth_view })
    }

    /// Begins the feedback pass of a frame, which looks at the pixels of `look`: clears the target and its
    /// depth buffer, points the view of this number at it, and cuts what lies beyond the picture. The caller
    /// draws with a pipeline of `Rgba32Uint` without blending and `Depth32Float`, and leaves viewport and
    /// scissor as they are.
    pub fn begin<'encoder>(
        &self,
        device: &wgpu::Device,
        encoder: &'encoder mut wgpu::CommandEncoder,
        views: &Views,
        view: u32,
        look: impl Into<FeedbackPass>,
        clear_depth: f32,
    ) -> wgpu::RenderPass<'encoder> {
        let [x, y, columns, rows] = self.point(device, encoder, views, view, look);
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("vastex feedback"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: self.raw.view(),
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                    store: wgpu::StoreOp::Store,
                },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &self.depth_view,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(clear_depth),
                    store: wgpu::StoreOp::Discard,
                }),
                stencil_ops: None,
            }),
            timestamp_writes: None,
            occlusion_query_set: None,
            multiview_mask: None,
        });
        pass.set_scissor_rect(x, y, columns, rows);
        pass
    }

    /// Points the view of this number at the target, for a pass that the caller begins itself: into
    /// [`FeedbackTarget::color`], cleared to zeros and stored, and [`FeedbackTarget::depth`], with what this
    /// gives as the scissor: first column and row, and how many.
    pub fn point(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        views: &Views,
        view: u32,
        look: impl Into<FeedbackPass>,
    ) -> [u32; 4] {
        let frame_view = self.view(look.into());
        views.set(device, encoder, view, &frame_view.params());
        frame_view.scissor()
    }

    /// What is drawn into, of the format `Rgba32Uint`.
    pub fn color(&self) -> &wgpu::TextureView {
        self.raw.view()
    }

    /// The target's depth buffer, of the format `Depth32Float`.
    pub fn depth(&self) -> &wgpu::TextureView {
        &self.depth_view
    }

    fn view(&self, look: FeedbackPass) -> FeedbackView {
        let FeedbackTarget { picture, scale, answers, pixel, .. } = *self;
        FeedbackView { picture, scale, look, answers, pixel }
    }

    /// Where the one pixel that it is for lies in it.
    pub(crate) fn place_of_pixel(&self) -> [u32; 2] {
        let [x, y, ..] = self.view(FeedbackPass::Cycle(0)).scissor();
        [x, y]
    }

    /// Size in pixels.
    pub fn size(&self) -> [u32; 2] {
        self.raw.size()
    }

    /// Size of the picture that it is for, in pixels.
    pub fn picture(&self) -> [u32; 2] {
        self.picture
    }

    /// Answers of each of its blocks.
    pub fn answers(&self) -> u32 {
        self.answers
    }

    /// What is drawn into it, to be read back.
    pub fn raw(&self) -> &RawTexture {
        &self.raw
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_jitter_visits_every_row_and_every_column() {
        for axis in 0..2 {
            let mut visits = [0; shader_constants::FEEDBACK_SCALE as usize];
            for position in JITTER {
                visits[position[axis] as usize] += 1;
            }
            assert_eq!(visits, [2; shader_constants::FEEDBACK_SCALE as usize]);
        }
    }

    #[test]
    fn passes_for_gaps_say_which_they_are_and_of_how_many_bricks_one_is_named() {
        let params = |answers: u32, pass: u64, turns: u32| {
            let view = FeedbackView::new([64, 64], FeedbackScale::Reduced, 0).with_answers(answers);
            let params = FeedbackView { look: FeedbackPass::Gaps { pass, turns }, ..view }.params();
            (params.frame, params.gaps & 0xff, params.gaps >> 8)
        };
        assert_eq!(params(8, 0, 4), (0, 1, 4));
        assert_eq!(params(8, 19, 64), (2, 4, 64), "the fourth pass of the third round");
        assert_eq!(params(1, 63, 0), (0, 64, 1), "of one at least");
        assert_eq!(params(1, 64, u32::MAX), (1, 1, (1 << 24) - 1));
        let view = FeedbackView::new([64, 64], FeedbackScale::Reduced, 7);
        assert_eq!(view.params().gaps, 0);
    }

    #[test]
    fn the_jitter_misses_nothing_that_repeats_after_four_pixels() {
        type Place = fn([u32; 2]) -> [u32; 2];
        let in_squares: [Place; 2] = [|at| at.map(|n| n % 4), |at| at.map(|n| n / 2)];
        for place in in_squares {
            let distinct: std::collections::BTreeSet<_> = JITTER.into_iter().map(place).collect();
            assert_eq!(distinct.len(), JITTER.len());
        }
    }

    #[test]
    fn a_target_pixel_looks_at_the_centre_of_one_pixel_of_the_picture() {
        let pictures = [[1280, 720], [13, 7], [1, 1], [8, 9]];
        let scales = [FeedbackScale::Reduced, FeedbackScale::Coarse];
        for (picture, scale_of) in pictures.into_iter().flat_map(|p| scales.map(|scale| (p, scale))) {
            for frame in 0..u64::from(shader_constants::JITTER_CYCLE) {
                let view = FeedbackView::new(picture, scale_of, frame);
                let (scale, offset) = view.clip_transform();
                let (size, jitter) = (view.target_size(), view.jitter());
                for (axis, up) in [(0, 1.0), (1, -1.0)] {
                    for i in 0..size[axis] {
                        let seen = scale_of.block() * i + jitter[axis];
                        let ndc = up * (2.0 * (seen as f32 + 0.5) / picture[axis] as f32 - 1.0);
                        let in_target = up * (ndc * scale[axis] + offset[axis]);
                        let pixel = (in_target + 1.0) / 2.0 * size[axis] as f32;
                        assert!(
                            (pixel - (i as f32 + 0.5)).abs() < 1e-3,
                            "{picture:?} {frame} {axis} {i}: {pixel}"
                        );
                        assert_eq!(i < view.covered()[axis], seen < picture[axis]);
                    }
                }
            }
        }
    }

    #[test]
    fn the_view_of_a_pixel_has_it_where_its_gradients_are_those_of_the_whole_picture() {
        for picture in [[1280, 720], [13, 7], [1, 1], [8191, 4097]] {
            for pixel in [[0, 0], [picture[0] - 1, picture[1] - 1], [picture[0] / 2, picture[1] / 3]] {
                let view = FeedbackView::of_pixel(picture, pixel, 3);
                let ((scale, offset), size) = (view.clip_transform(), view.target_size());
                let [x, y, columns, rows] = view.scissor();
                assert_eq!((columns, rows, size), (1, 1, [2, 2]));
                assert_eq!([x, y], pixel.map(|at| at % 2), "its place among four is that in the picture");
                for (axis, up, place) in [(0, 1.0, x), (1, -1.0, y)] {
                    let ndc = up * (2.0 * (pixel[axis] as f32 + 0.5) / picture[axis] as f32 - 1.0);
                    let in_target = up * (ndc * scale[axis] + offset[axis]);
                    let found = (in_target + 1.0) / 2.0 * size[axis] as f32;
                    assert!((found - (place as f32 + 0.5)).abs() < 1e-2, "{picture:?} {pixel:?}: {found}");
                }
                assert_eq!(view.params().level_offset, 0.0);
            }
        }
    }

    #[test]
    fn the_full_scale_leaves_the_picture_where_it_is() {
        let view = FeedbackView::new([13, 7], FeedbackScale::Full, 5);
        assert_eq!(view.clip_transform(), ([1.0; 2], [0.0, -0.0]));
        assert_eq!((view.target_size(), view.covered()), ([13, 7], [13, 7]));
        assert_eq!(view.params().level_offset, 0.0);
    }
}
