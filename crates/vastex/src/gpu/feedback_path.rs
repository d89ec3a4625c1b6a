//! Where the feedback of a view is gathered, and its way back to the CPU.

use vastex_wgpu::{
    FeedbackMode, FeedbackTarget, InlinePipelines, InlineTarget, RawTexture, Readback, ReadbackPipelines,
};

/// What gathers feedback on a device, whatever the view and its size.
pub(super) struct FeedbackPipelines {
    pub(super) readback: ReadbackPipelines,
    /// where the mode is to tell it.
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

    pub(super) fn picture(&self) -> [u32; 2] {
        match &self.target {
            Target::Drawn(target) => target.picture(),
            Target::Reported(target) => target.picture(),
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
