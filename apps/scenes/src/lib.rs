//! What Vastex draws, for the program, the tests and the browser: scenes, cameras and the ordinary-texture reference.
//!
//! Everything here is an application of the crate `vastex`, and calls its frame loop unchanged. The words of the command
//! line and the window are the program's.

mod ahead;
mod clock;
mod compare;
mod cpu_picture;
mod descent;
mod draw;
mod estimate;
mod eye;
mod globe_grid;
mod gpu;
mod levels;
mod look;
mod overlay;
mod patches;
mod path;
mod pipeline;
mod planet;
mod planet_image;
mod planet_reference;
mod pose;
mod read;
mod reference;
mod relief;
mod scene;
pub mod shaders;
mod studio;
mod tiling;
mod traced;
mod uniform;
mod views;

pub use clock::GpuClock;
pub use compare::{Comparison, Picture};
pub use descent::Descent;
pub use draw::{Drawn, PictureTarget, SceneRenderer, depth_view};
pub use estimate::{Estimate, Estimating};
pub use eye::Eye;
pub use globe_grid::{GlobeGrid, GlobePose};
pub use gpu::{Gpu, GpuSetupError};
pub use levels::LevelError;
pub use look::{Look, Shown, UnknownLayer};
pub use overlay::{Overlay, OverlayRenderer};
pub use path::Path;
pub use planet::{Attribute, Part, Planet};
pub use planet_image::{PlanetImageError, planet_image};
pub use pose::Pose;
pub use reference::{Reference, ReferenceError, Taps};
pub use relief::{Heights, HeightsError, Relief};
pub use scene::{Mesh, Scene, Vertex, surface};
pub use studio::{
    CostsBeside, DrawCosts, Outcome, PATIENCE_FRAMES, ReferenceKind, Studio, StudioError, Until,
};
pub use tiling::Tiling;
pub use traced::trace_of;
pub use views::Views;
