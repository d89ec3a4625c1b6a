//! When a run ends, and how it ended.

use std::ops::ControlFlow;

use vastex::diagnostics::FrameStats;

/// Frames after the end of a path within which a view must converge.
pub const PATIENCE_FRAMES: u64 = 10_000;

/// When a run ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Until {
    /// After so many frames.
    Frames(u64),
    /// When the path is at its end, all is there and faded in; given up [`PATIENCE_FRAMES`] after the end.
    Converged,
}

/// How a run ended.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// True if the last view had converged, with all its tiles there.
    pub converged: bool,
    /// The loop at the end.
    pub stats: FrameStats,
}

/// What those who watch a run say after each frame: nothing, or whether it goes on.
pub trait Watched {
    /// Returns true if the run ends here.
    fn ends(self) -> bool;
}

impl Watched for () {
    fn ends(self) -> bool {
        false
    }
}

impl Watched for ControlFlow<()> {
    fn ends(self) -> bool {
        self.is_break()
    }
}
