//! What judges pictures: the ordinary-texture reference, the CPU's pictures, costs, estimates, and scenes
//! that only tests and examples draw.
//!
//! What is drawn is `vastex-viewer`'s, and named here too. The words of the command line and the window are
//! the program's.

mod attribute;
mod clock;
mod compare;
mod cpu_picture;
mod descent;
mod error;
mod estimate;
mod levels;
mod offscreen;
mod places;
mod planet;
mod planet_image;
mod reference;
pub mod shaders;
mod traced;
mod wait;

pub use attribute::Attribute;
pub use clock::GpuClock;
pub use compare::Comparison;
pub use descent::Descent;
pub use error::OffscreenError;
pub use estimate::{Estimate, Estimating};
pub use levels::LevelError;
pub use offscreen::{
    CostsBeside, DrawCosts, Offscreen, Outcome, PATIENCE_FRAMES, ReferenceKind, SceneImage, Until, Watched,
};
pub use planet::{Part, Planet};
pub use planet_image::{PlanetImageError, planet_image};
pub use reference::{Reference, ReferenceError, Taps};
pub use traced::{trace_of, trace_of_every};
pub use vastex_viewer::{
    CameraBinding, ColorMap, DescribeError, DisplayOptions, GlobeGrid, GlobePose, Gpu, GpuSetupError,
    Heights, HeightsError, LayerOptions, Layers, LayersError, Mesh, Overlay, OverlayRenderer, Path, Picture,
    PlanetLight, PlanetOptions, Pose, Relief, Scene, SceneDesc, ScenePipelines, SceneRenderer, ShownLayer,
    Target, Tiling, UnknownLayer, Vertex, Views, depth_view, surface,
};
pub use wait::headless_gpu;
