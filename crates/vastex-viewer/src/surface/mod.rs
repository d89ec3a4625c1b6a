//! A texture on a surface: as an image, on a plane, on a globe, with or without heights.

mod camera_binding;
mod display_options;
mod fixed;
mod globe_grid;
mod layered;
mod mesh;
mod patches;
mod pipeline;
mod relief;
mod renderer;
pub mod shaders;
mod tiling;

pub use camera_binding::CameraBinding;
pub use display_options::DisplayOptions;
pub use globe_grid::{GlobeGrid, GlobePose};
pub use layered::LayeredRenderer;
pub use mesh::{Mesh, Vertex, surface};
pub use pipeline::{Corners, PipelineParts};
pub use relief::{Heights, HeightsError, Relief};
pub use renderer::{SceneDesc, SceneRenderer};
pub use tiling::Tiling;
