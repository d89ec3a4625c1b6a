//! Where a camera is, what moves it, and what it is expected to do.

mod ahead;
mod controller;
mod path;
mod pose;
mod text;
mod views;

pub use ahead::Ahead;
pub use controller::{Aspects, Controller, Move};
pub use path::Path;
pub use pose::Pose;
pub(crate) use pose::{FIELD_OF_VIEW, METRE};
pub use text::PoseTextError;
pub use views::Views;
