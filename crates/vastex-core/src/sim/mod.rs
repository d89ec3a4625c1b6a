//! The simulated world: the whole loop without a GPU, a disk or a clock.
//!
//! A [`World`] has a virtual texture, a camera that moves along a [`Path`], a loader with latency, bandwidth
//! and failures, and a pager. [`World::step`] plays one frame, checks what must hold, and is the same for the
//! same [`Knobs`]. A [`Crowd`] is many textures in several pools. Eviction bugs become unit tests here.

mod camera;
mod contents;
mod crowd;
mod loader;
mod log;
mod random;
mod sharpness;
mod world;

pub use camera::{Path, View};
pub use contents::contents_of_chance;
pub use crowd::{Crowd, Watch};
pub use loader::Loads;
pub use log::Log;
pub use random::Random;
pub use sharpness::Sharpness;
pub use world::{Knobs, World};
