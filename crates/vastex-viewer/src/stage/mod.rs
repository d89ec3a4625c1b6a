//! How every kind of scene is drawn: the frame, its targets, the uniform buffer of a pass, and how pictures
//! are read back.

mod canvas;
mod frame;
mod kept;
mod linear;
mod read;
mod target;
#[cfg(feature = "gpu-times")]
mod timer;
mod uniform;

use std::sync::Arc;
use std::time::Duration;

pub use canvas::Canvas;
pub use frame::{Frame, PartTime, Pictures, StageScene, StageView, draw_again};
pub use kept::KeptPicture;
pub use linear::{LinearTarget, TargetKind, encode_text, takes_light};
pub use read::{ReadBackError, TextureRead};
pub use target::{DEPTH_FORMAT, Target, depth_view, filled_buffer};
#[cfg(feature = "gpu-times")]
pub use timer::GpuTimer;
pub use uniform::Uniform;

/// A clock: the time since the host began.
pub type Clock = Arc<dyn Fn() -> Duration + Send + Sync>;
