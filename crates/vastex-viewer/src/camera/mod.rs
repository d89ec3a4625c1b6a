//! Where a camera is, what moves it, and what it is expected to do.

mod ahead;
mod aim;
mod controller;
mod edges;
mod flight;
mod ground;
mod keyframes;
mod orientation;
mod over_heights;
mod path;
mod placement;
mod places;
mod pose;
mod rays;
mod text;
mod views;

pub use ahead::Ahead;
pub use aim::Aim;
pub use controller::{Aspects, Controller, Move};
pub use flight::{Flight, LeftOut, Recorded, WhyLeftOut};
pub(crate) use keyframes::TOLERANCE;
pub use keyframes::{CameraPath, CameraPathError};
pub use orientation::Orientation;
pub use over_heights::GroundHeights;
pub use path::Path;
pub use placement::ImagePlacement;
pub use places::{PathChannels, PathPlace};
pub use pose::Pose;
pub(crate) use pose::{FIELD_OF_VIEW, METRE};
pub(crate) use rays::{Ground, Ray};
pub use text::PoseTextError;
pub use views::Views;
