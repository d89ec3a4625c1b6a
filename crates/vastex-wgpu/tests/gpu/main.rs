//! What the shaders do on a device, against their twins on the CPU. One binary, so that wgpu is linked once.

mod common;
mod errors;
mod feedback;
mod sampling;
mod tables;
