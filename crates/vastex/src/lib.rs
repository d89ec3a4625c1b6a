//! Huge textures for an existing `wgpu` renderer.
//!
//! An application adds a texture of any size, adds generated WGSL to its own shader and calls
//! `vastex_sample(id, uv)` where it called `textureSample`; each frame it draws its scene once more, small, so that
//! [`Textures`] learns what is in view, and once for the picture. Only the pages that the view touches, at the
//! resolution at which it touches them, are ever in GPU memory, within a budget of bytes.
//!
//! ```no_run
//! # fn draw(_: &mut wgpu::RenderPass<'_>, _: Option<&wgpu::BindGroup>) {}
//! # fn app(device: &wgpu::Device, queue: &wgpu::Queue) -> Result<(), vastex::Error> {
//! let mut textures = vastex::Textures::new(device, queue, vastex::Settings::default())?;
//! let earth = textures.add_blocking(vastex::open("earth.vastex")?)?; // or `preparer` and `add`, without waiting
//! let kinds = textures.kinds(earth)?; // the same for all textures that share pipelines
//! let shader = "@fragment fn shade() { /* ... vastex_sample(id, uv) ... */ }".to_owned() + &textures.wgsl(&kinds);
//! let id = textures.shader_id(earth)?; // for a material, or an instance
//! # let _ = (shader, id);
//!
//! // each frame, in the application's own encoder
//! # let mut encoder = device.create_command_encoder(&Default::default());
//! textures.feedback(&mut encoder, [1280, 720], |pass, groups| draw(pass, groups.get(earth)))?; // what is wanted
//! textures.update()?;                                  // observe, load, upload, change tables: never waits
//! // ... draw the picture with textures.bind_group(earth)?, or in textures.main_pass(..) for feedback without a pass of its own ...
//! queue.submit([encoder.finish()]);
//! while let Some(event) = textures.poll_event() { /* Converged, Oversubscribed, Failed, ... */ }
//! # Ok(()) }
//! ```
//!
//! What is decided is decided in `vastex-core`, what is read is read by `vastex-tiles`, and what happens on the GPU
//! happens in `vastex-wgpu`; this crate joins them.

mod cpu;
mod error;
mod gpu;
mod ids;
mod paging;
mod settings;
mod sources;
mod textures;
mod watch;

#[cfg(not(target_family = "wasm"))]
pub use cpu::CpuTexture;
pub use cpu::{CpuFeedback, CpuSample, CpuSampler, CpuStats};
pub use error::Error;
pub use gpu::{BindGroups, FeedbackPass, PoolResize, UploadStats};
pub use ids::{GroupId, LayerId, Member, Sampled, TextureId};
pub use paging::{Convergence, Ticket};
pub use settings::{
    BindingPlace, FeedbackMode, Filter, MaxTaps, Pace, Platform, PoolRule, PoolSettings, PoolTuning,
    ScaleGroups, Settings, SettingsError, TableChoice, TextureSettings, UnknownFilter, UploadWay,
};
pub use sources::{Prepared, Preparer};
pub use textures::{
    AddError, Ahead, Bindings, Cpu, Inspect, Memory, Pixels, TextureMut, TextureRef, Textures, TraceControl,
    View, ViewSettings,
};
pub use vastex_core::shader_constants::JITTER_CYCLE;
pub use vastex_core::{
    AddressMode, AskError, BiasRule, Box3, Description, Dims, Event, Explanation, Feedback, Geometry,
    GeometryError, GeometrySpec, GroupError, GroupNumber, History, Integrator, Layer, LayerFormat, LevelRule,
    Motion, PageId, PagePos, PageState, PoolEstimate, PoolFrame, PoolId, Progress, Region, SlotUsage, Stats,
    Step, TexelPositions, TextureNumber, TexturePages, TicketState, TimeToSharp, Trace, Urgency, ViewError,
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
    Atlas, FeedbackTarget, GpuError, Kind, Kinds, instance_for, only_needed, required_features,
    required_limits, shader_module, texture_format,
};
// What public signatures mention, so that an application can name it without a dependency of its own.
pub use vastex_core::{
    FileError, GeometryBytesError, LayerError, Level, PageContents, PageIdError, PageSet, PoolError, Slot,
    TailLayout, TraceError, TraceRecordError, WantedPage,
};
pub use vastex_tiles::{
    Container, Info, LoadError, MaybeSend, MaybeSync, RamBudget, RamCache, Store, StoreError, StoreFuture,
};
pub use watch::{
    Cell, DumpedPool, DumpedTexture, ExplainedPixel, FrameStats, LevelPages, PoolDump, PoolRecord, PoolStats,
};
/// The `wgpu` whose devices and passes [`Textures`] takes: an application that uses this one has the version that fits.
pub use wgpu;

// They may be moved to the thread that draws, and looked at from any.
#[cfg(not(target_family = "wasm"))]
const _: () = {
    const fn is_shared_by_threads<T: Send + Sync>() {}
    is_shared_by_threads::<Textures>();
    is_shared_by_threads::<Preparer>();
    is_shared_by_threads::<Prepared>();
    is_shared_by_threads::<Ticket>();
    is_shared_by_threads::<Convergence>();
    is_shared_by_threads::<Settings>();
    is_shared_by_threads::<Event>();
    is_shared_by_threads::<Error>();
    is_shared_by_threads::<AddError>();
};

/// Opens a `.vastex` file.
#[cfg(not(target_family = "wasm"))]
pub fn open(path: impl AsRef<std::path::Path>) -> Result<std::sync::Arc<dyn TileSource>, Error> {
    Ok(std::sync::Arc::new(vastex_tiles::Container::open_file(path)?))
}
