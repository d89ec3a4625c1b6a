//! The viewer of Vastex, apart from any window: how scenes with virtual textures on them are drawn and looked
//! at.
//!
//! Everything here is an application of the crate `vastex`, and calls its frame loop unchanged. A program
//! brings the window, the clock and the words of its command line.

#[cfg(feature = "egui")]
pub mod beside;
pub mod camera;
pub mod figures;
pub mod gpu;
#[cfg(feature = "egui")]
pub mod hud;
pub mod input;
pub mod inspect;
pub mod layers;
pub mod link;
pub mod overlay;
#[cfg(feature = "egui")]
pub mod panels;
mod picture;
#[cfg(feature = "egui")]
mod remembered;
mod scene;
pub mod stage;
pub mod surface;
#[cfg(feature = "egui")]
pub mod surface_scene;
pub mod title;
pub mod view_text;
pub mod volume;
pub mod volume_scene;
#[cfg(feature = "egui")]
pub mod widget;
#[cfg(feature = "egui")]
pub mod window_scene;
mod words;

pub use camera::{CameraPath, CameraPathError, Path, PathChannels, PathPlace, Pose, Views};
pub use gpu::{Gpu, GpuSetupError};
pub use layers::{
    Bands, ColorMap, Curve, Layers, LayersError, LayersText, Nodata, Palette, PlanetText, ShownLayer, Tone,
    UnknownLayer,
};
pub use link::{Link, LinkError};
pub use overlay::{Overlay, OverlayRenderer};
pub use picture::{Picture, PicturePart, side_by_side};
#[cfg(feature = "egui")]
pub use remembered::{ChosenGround, KeptPool, KeptRule, Remembered, Theme};
pub use scene::{Scene, direction};
pub use stage::{Target, depth_view};
pub use surface::shaders;
pub use surface::{
    CameraBinding, DescribeError, DisplayOptions, GlobeGrid, GlobePose, Heights, HeightsError, LayerOptions,
    LayerOptionsError, Mesh, PlanetLight, PlanetOptions, Relief, SceneDesc, ScenePipelines, SceneRenderer,
    Tiling, Vertex, surface,
};
pub use view_text::{
    Sun, ViewPlanet, ViewText, ViewTextError, VolumeFlight, VolumePlace, VolumeViewError, VolumeViewText,
};
