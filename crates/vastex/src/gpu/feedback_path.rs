//! Where the feedback of a view is gathered, and its way back to the CPU.

use vastex_wgpu::{
    FeedbackMode, FeedbackTarget, InlinePipelines, InlineTarget, RawTexture, Readback, ReadbackPipelines,
};

/// What gathers feedback on a device, whatever the view and its size.
pub(super) struct FeedbackPipelines {
    pub(super) readback: ReadbackPipelines,
    /// There where feedback is inline.
    pub(super) inline: Option<InlinePipelines>,
}

impl FeedbackPipelines {
    pub(super) fn new(device: &wgpu::Device, mode: FeedbackMode) -> FeedbackPipelines {
        FeedbackPipelines {
            readback: ReadbackPipelines::new(device, mode),
            inline: (mode == FeedbackMode::Inline).then(|| InlinePipelines::new(device)),
        }
    }
}

/// Where feedback of a view is gathered, and its way back.
pub(super) struct FeedbackPath {
    pub(super) target: Target,
    pub(super) readback: Readback,
}

pub(super) enum Target {
    /// By a pass of its own.
    Drawn(FeedbackTarget),
    /// From the main pass.
    Reported(InlineTarget),
}

impl FeedbackPath {
    pub(super) fn oldest(&self) -> Option<u64> {
        self.readback.oldest()
    }

    pub(super) fn bytes_read(&self) -> u64 {
        self.readback.bytes_read()
    }

    /// Returns true if it is for pictures of this size, with so many answers of each block; 0 for those of
    /// surfaces.
    pub(super) fn fits(&self, picture: [u32; 2], answers: u32) -> bool {
        match &self.target {
            Target::Drawn(target) => (target.picture(), target.answers()) == (picture, answers.max(1)),
            Target::Reported(target) => target.picture() == picture && answers == 0,
        }
    }
}

impl Target {
    pub(super) fn raw(&self) -> &RawTexture {
        match self {
            Target::Drawn(target) => target.raw(),
            Target::Reported(target) => target.raw(),
        }
    }
}
