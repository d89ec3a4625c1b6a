//! Huge textures for an existing `wgpu` renderer.
//!
//! An application adds a texture of any size, adds generated WGSL to its own shader and calls
//! `vastex_sample(uv)` where it called `textureSample`; each frame it draws its scene once more, small, so that
//! [`Textures`] learns what is in view, and once for the picture. Only the pages that the view touches, at the
//! resolution at which it touches them, are ever in GPU memory, within a budget of bytes.
//!
//! ```no_run
//! # fn draw(_: &mut wgpu::RenderPass<'_>, _: &wgpu::BindGroup) {}
//! # fn app(device: &wgpu::Device, queue: &wgpu::Queue) -> Result<(), vastex::Error> {
//! let mut textures = vastex::Textures::new(device, queue, vastex::Settings::default())?;
//! let earth = textures.add(vastex::open("earth.vastex")?)?;
//! let shader = "@fragment fn shade() { /* ... vastex_sample(uv) ... */ }".to_owned() + &textures.wgsl(earth);
//! # let _ = shader;
//!
//! // each frame, in the application's own encoder
//! # let mut encoder = device.create_command_encoder(&Default::default());
//! textures.feedback(&mut encoder, [1280, 720], |pass, groups| draw(pass, &groups[earth]))?; // what is wanted
//! textures.update()?;                                  // observe, load, upload, change tables: never waits
//! // ... draw the picture with textures.bind_group(earth), or in textures.main_pass(..) for feedback without a pass of its own ...
//! queue.submit([encoder.finish()]);
//! while let Some(event) = textures.poll_event() { /* Converged, Oversubscribed, Failed, ... */ }
//! # Ok(()) }
//! ```
//!
//! What is decided is decided in `vastex-core`, what is read is read by `vastex-tiles`, and what happens on the GPU
//! happens in `vastex-wgpu`; this crate joins them.

mod ahead;
mod by_hand;
#[cfg(not(target_family = "wasm"))]
mod cpu;
mod cpu_feedback;
mod cpu_tiles;
mod cycle;
mod decoded;
mod dump;
mod error;
mod fades;
mod feedback;
mod frame;
mod groups;
mod inspect;
mod layer;
mod lock_step;
mod pool_settings;
mod pools;
mod recorder;
mod resize;
mod restore;
mod sample_cpu;
mod settings;
mod settings_file;
mod stats;
mod survey;
mod tables;
mod tail;
mod telemetry;
mod texture_space;
mod textures;
mod uploads;
mod views;
mod whole;

pub use by_hand::Ticket;
#[cfg(not(target_family = "wasm"))]
pub use cpu::CpuTexture;
pub use cpu_feedback::CpuFeedback;
pub use cpu_tiles::CpuStats;
pub use dump::{DumpedPool, DumpedTexture, LevelPages, PoolDump};
pub use error::Error;
pub use groups::{Member, Sampled};
pub use inspect::ExplainedPixel;
pub use layer::LayerId;
pub use pool_settings::{PoolRule, PoolSettings, PoolTuning, ScaleGroups};
pub use pools::PoolStats;
pub use resize::PoolResize;
pub use sample_cpu::{CpuSample, CpuSampler};
pub use settings::{
    FeedbackWay, Filter, MaxTaps, Pace, Settings, TableChoice, TextureSettings, UnknownFilter, UploadWay,
};
pub use settings_file::{Platform, SettingsError};
pub use stats::FrameStats;
pub use telemetry::{Cell, PoolRecord};
pub use textures::{BindGroups, Textures};
pub use uploads::UploadStats;
pub use vastex_core::shader_constants::JITTER_CYCLE;
pub use vastex_core::{
    AddressMode, AskError, BiasRule, Box3, Description, Dims, Event, Explanation, Feedback, Geometry,
    GeometryError, GeometrySpec, GroupError, GroupId, History, Integrator, Layer, LayerFormat, LevelRule,
    Motion, PageId, PagePos, PageState, PoolEstimate, PoolFrame, PoolId, Progress, Region, SlotUsage, Stats,
    Step, TexelPositions, TextureId, TexturePages, TicketState, TimeToSharp, Trace, Urgency, ViewError,
    ViewId, Wait, fold,
};
pub use vastex_core::{
    Camera, FlatSurface, GlobeSurface, LearnError, LearnSettings, Patch, Place, PrefetchSets, SetsError,
    Surface, Survey, SurveySettings, Surveyed, SurveyedObject, SurveyedTexture, UvBox,
};
pub use vastex_tiles::{
    Codec, ContainerError, DecodeError, LimitedSource, PlanetError, PlanetImage, PlanetSource, ReadError,
    ReadFuture, ReadLimit, SourceKey, StoreStats, TierStats, Tiers, Tile, TileSource, decode_layer,
};
#[cfg(not(target_family = "wasm"))]
pub use vastex_tiles::{DiskCache, DiskTier, DiskTierError};
pub use vastex_wgpu::{
    Atlas, FeedbackTarget, GpuError, instance_for, only_needed, required_features, required_limits,
    shader_module, texture_format,
};
pub use views::ViewSettings;

/// Opens a `.vastex` file.
#[cfg(not(target_family = "wasm"))]
pub fn open(path: impl AsRef<std::path::Path>) -> Result<std::sync::Arc<dyn TileSource>, Error> {
    Ok(std::sync::Arc::new(vastex_tiles::Container::open_file(path)?))
}
