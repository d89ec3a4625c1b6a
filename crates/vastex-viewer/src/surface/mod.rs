//! A texture on a surface: as an image, on a plane, on a globe, with or without heights.

mod camera_binding;
mod compiled;
mod display_options;
mod fixed;
mod fixed_relief;
mod globe_grid;
mod heights_ray;
mod large_texels;
mod layer_text;
mod mesh;
mod patches;
mod pipeline;
mod planet;
mod poles;
mod relief;
mod renderer;
mod scene_pipelines;
mod seen_heights;
pub mod shaders;
mod sight;
mod tiling;

pub use camera_binding::CameraBinding;
pub use display_options::{DescribeError, DisplayOptions, LayerOptions, LayerOptionsError, PlanetOptions};
pub use globe_grid::{GlobeGrid, GlobePose};
pub use large_texels::shows_large_texels;
pub(crate) use layer_text::file_of_text;
pub use layer_text::{MOST_STOPS, ParseLayerError, range_of};
pub use mesh::{Mesh, Vertex, surface};
pub use pipeline::{Corners, PipelineParts};
pub use planet::PlanetLight;
pub use relief::{Heights, HeightsError, Relief};
#[cfg(feature = "egui")]
pub(crate) use renderer::Told;
pub use renderer::{SceneDesc, SceneRenderer};
pub use scene_pipelines::ScenePipelines;
pub use seen_heights::SeenHeights;
pub use sight::{SeenPlace, Sight};
pub use tiling::Tiling;
