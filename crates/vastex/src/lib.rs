//! Huge textures for an existing `wgpu` renderer.
//!
//! An application adds a texture of any size, adds generated WGSL to its own shader and calls
//! `vastex_sample(id, uv)` where it called `textureSample`; each frame it draws its scene once more, small,
//! so that [`Textures`] learns what is in view, and once for the picture. Only the pages that the view
//! touches, at the resolution at which it touches them, are ever in GPU memory, within a budget of bytes.
//!
//! ```no_run
//! # fn draw(_: &mut wgpu::RenderPass<'_>, _: Option<&wgpu::BindGroup>) {}
//! # fn app(device: &wgpu::Device, queue: &wgpu::Queue) -> Result<(), vastex::Error> {
//! let mut textures = vastex::Textures::new(device, queue, vastex::Settings::default())?;
//! let earth = textures.add_blocking(vastex::open("earth.vastex")?)?; // or `preparer` and `add`, without waiting
//! let kinds = textures.kinds(earth)?; // the same for all textures that share pipelines; group 0, or `Settings::binding`
//! let shader = "@fragment fn shade() { /* ... vastex_sample(id, uv) ... */ }".to_owned() + &textures.wgsl(&kinds);
//! let module = vastex::shader_module(device, Some("surface"), &shader); // or `only_needed`: what no entry point calls is left out
//! let id = textures.shader_id(earth)?; // for a material, or an instance
//! # let _ = (module, id);
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
//! What an application calls:
//!
//! | what | where |
//! |---|---|
//! | textures that come and go | [`Textures::add`], [`Preparer`], [`Textures::remove`], [`TextureRef`], [`TextureMut`] |
//! | what its pipelines need | [`Textures::kinds`], [`Textures::wgsl`], [`Textures::bind_group`], [`Textures::shader_id`]; for groups and merged layouts [`Bindings`] |
//! | each frame | [`Textures::feedback`], [`Textures::update`], [`Textures::main_pass`], [`Textures::poll_event`], [`Textures::view_mut`] |
//! | settings, with their defaults | [`Settings`], [`TextureSettings`] |
//! | ahead of time | [`Ahead`]: prefetches, pins, predictions, traces ([`TraceControl`]); [`prefetch`], [`survey`] |
//! | what a texture says at a point, on the CPU | [`Cpu`] |
//! | GPU memory, and a device that is lost | [`Memory`] |
//! | why a picture is as it is | [`Inspect`], [`Pixels`], [`diagnostics`] |
//! | where tiles come from | [`open`], [`ImageSource`] for pixels in memory, [`TileSource`], [`source`] |
//!
//! # What shaders call
//!
//! `id` is [`Textures::shader_id`], `view` is [`ViewRef::number`] (0 of the main view), `uv` is 0 to 1 over
//! the texture. [`wgsl()`] documents stages and ranges.
//!
//! | to | functions |
//! |---|---|
//! | sample | `vastex_sample(id, uv)`, `vastex_sample_wrapped` at a seam, `vastex_sample_grad`, `vastex_sample_level` |
//! | sample one texel | `vastex_sample_nearest(id, uv)`, `vastex_sample_nearest_grad`, `vastex_sample_nearest_level` |
//! | sample beyond 2^20 texels | `vastex_sample_fixed(id, anchor, offset)`, `vastex_sample_fixed_grad`, `vastex_sample_fixed_level` |
//! | say what is wanted | `vastex_feedback(id, view, uv)`, `vastex_feedback_wrapped`, `vastex_feedback_grad`, `vastex_feedback_level`, `vastex_feedback_fixed`, `vastex_feedback_fixed_grad`, `vastex_feedback_fixed_level` |
//! | place and thin out the feedback pass | `vastex_feedback_clip(view, clip)`, `vastex_gradients(position, uv)`, `vastex_dither(view, position, opacity)`, `vastex_turn(view, position, count)`, `vastex_pixel_scale(view)` |
//! | say it from the picture | `vastex_asked(view, position)`, `vastex_report(view, position, wanted)` |
//! | ask about a texture | `vastex_size(id)`, `vastex_level_of(id, ddx, ddy)`, `vastex_inspect(id, uv)`, `vastex_inspect_grad`, `vastex_inspect_fixed_grad(id, anchor, offset, ddx, ddy)` |
//! | look into the pool of a text | `vastex_inspect_page(id, page, level)`, `vastex_inspect_slot(slot, tile_texel)`, `vastex_inspect_slot_size()` |
//! | draw in texture space | `vastex_texture_space_clip(uv)`, `vastex_texture_space(id, uv, clip, picture)`, `vastex_texture_space_front` |
//!
//! A volume has these functions in the place of those that take a uv. A place in it is `offset` voxels
//! after voxel `anchor`; `ray` is a `VastexRay`, `brick` a `VastexBrick`, the voxels of a box in a slot.
//!
//! | to | functions |
//! |---|---|
//! | sample a volume | `vastex_volume_sample(id, anchor, offset, level)`, `vastex_volume_level(id, pixel)` |
//! | go through its bricks along a ray | `vastex_ray_within(ray, size)`, `vastex_ray_at(ray, along)`, `vastex_march(ray)`, `vastex_march_next(&march, id, ray)` |
//! | read a brick | `vastex_brick(id, anchor, offset, level)`, `vastex_brick_sample(brick, offset)`, `vastex_brick_exact`, `vastex_brick_nearest`, `vastex_brick_range(brick)`, `vastex_brick_exit(brick, offset, direction)` |
//! | read a label | `vastex_volume_whole(id, anchor, offset, level)`, `vastex_brick_whole(brick, offset)`, `vastex_brick_whole_at(brick, voxel)` |
//! | say what is wanted of a volume | `vastex_volume_feedback(id, anchor, offset, level)`, `vastex_march_feedback(id, view, position, ray)`, `vastex_ray_pixel(view, position, pixel)`, `vastex_ray_turn(view, position, count)`, `vastex_weighted(wanted, weight)`; where gaps are looked for, `vastex_ray_seeks(view)`, `vastex_march_gap(id, view, position, ray)`, `vastex_ray_passes_over(view, position)`, `vastex_brick_lacks(brick)` |
//! | ask about a volume | `vastex_volume_size(id)`, `vastex_volume_scale(id, level)`, `vastex_volume_whole_level(id, level)`, `vastex_volume_box(id, anchor, offset, level)`, `vastex_box_exit(box, offset, direction)` |
//!
//! For a [group](Textures::add_group) each member `NAME` has them with its name: `vastex_sample_NAME(id,
//! uv)`, `vastex_sample_NAME_grad`.
//!
//! # Crates
//!
//! `vastex-core` decides what is loaded and shown, `vastex-tiles` reads tiles, and `vastex-wgpu` works on the
//! GPU; this crate joins them.

mod cpu;
mod error;
mod gpu;
mod ids;
mod paging;
mod settings;
mod sources;
mod textures;
mod watch;

/// The bytes of tiles, which sources hand over ([`source::Tile`]).
pub use bytes::Bytes;
#[cfg(not(target_family = "wasm"))]
pub use cpu::CpuTexture;
pub use cpu::{CpuFeedback, CpuSample, CpuSampler};
pub use error::Error;
pub use gpu::{BindGroups, FeedbackPass, PoolResize};
pub use ids::{GroupId, LayerId, Member, Sampled, TextureId};
pub use paging::{Convergence, Ticket};
pub use settings::{
    BindingPlace, FeedbackMode, Filter, MaxTaps, Pace, Platform, PoolRule, PoolSettings, PoolTuning,
    ScaleGroups, Settings, SettingsError, TableChoice, TextureSettings, UnknownFilter, UploadMode,
};
pub use sources::{Prepared, Preparer};
pub use textures::{
    AddError, Ahead, Bindings, Cpu, Inspect, Memory, Pixels, TextureMut, TextureRef, Textures, TraceControl,
    ViewMut, ViewRef, ViewSettings,
};
pub use vastex_core::shader_constants::{JITTER_CYCLE, RAY_ANSWERS, RAY_BRICKS, RAY_TURNS};
pub use vastex_core::{
    AddressMode, AskError, BiasRule, Description, Dims, Event, Feedback, Geometry, GeometryError,
    GeometrySpec, GroupError, GroupNumber, Layer, LayerFormat, Level, LevelRule, NodataValue,
    NodataValueError, PageId, PagePos, PoolError, PoolId, Progress, Region, Slot, StoredLevel, TextureNumber,
    TicketState, Urgency, ViewError, ViewId, VoxelLevel, VoxelLevels, VoxelLevelsError, WantedPage,
};
pub use vastex_tiles::{ImageOptions, ImageSource, TileSource};
/// The text of a shader, function by function: what each is given and gives, its ranges, and the stages that
/// may call it.
#[doc(inline)]
pub use vastex_wgpu::wgsl;
pub use vastex_wgpu::{
    Atlas, GpuError, Kind, KindMember, Kinds, PageSides, TableKind, VolumeFilters, held_volume_format,
    instance_for, only_needed, required_features, required_limits, shader_module, texture_format,
};
/// The `wgpu` whose devices and passes [`Textures`] takes: an application that uses this one has the version
/// that fits.
pub use wgpu;

/// Where tiles come from: containers, caches, limits, planets without end, and what a source of an
/// application's own implements.
pub mod source {
    pub use vastex_core::{
        FileError, GeometryBytesError, LayerError, PageContents, PageIdError, PageSet, TailLayout,
    };
    pub use vastex_tiles::{
        Codec, Compression, Container, ContainerError, ContainerVolume, DecodeError, ImageSourceError, Info,
        LimitedSource, LoadError, MaybeSend, MaybeSync, MemoryStore, PlanetError, PlanetImage, PlanetSource,
        RamBudget, RamCache, ReadError, ReadFuture, ReadLimit, Reduction, Saved, SourceKey, Store,
        StoreError, StoreFuture, Tile, decode_layer,
    };
    #[cfg(not(target_family = "wasm"))]
    pub use vastex_tiles::{DiskCache, DiskTier, DiskTierError};
}

/// What a view wants, worked out on the CPU from its camera and the surfaces in the scene, without a feedback
/// pass.
pub mod survey {
    pub use vastex_core::{
        Box3, Camera, FlatSurface, GlobeSurface, Patch, Surface, Survey, SurveySettings, Surveyed,
        SurveyedObject, SurveyedTexture, TexelPositions, UvBox, fold,
    };
}

/// What is loaded before it is seen: motion, traces of what views wanted, and prefetch sets that are learnt
/// from them.
pub mod prefetch {
    pub use vastex_core::{
        CameraPosition, LearnError, LearnSettings, Motion, PrefetchSets, SetsError, Trace, TraceError,
        TraceRecordError,
    };
}

/// What is told of pools, pages, slots, frames and queries, for people and tools.
pub mod diagnostics {
    pub use crate::cpu::CpuStats;
    pub use crate::gpu::UploadStats;
    pub use crate::watch::{
        Cell, DumpedPool, DumpedTexture, ExplainedPixel, FrameStats, LevelPages, PoolDump, PoolRecord,
        PoolStats,
    };
    pub use vastex_core::{
        Explanation, History, Integrator, PageState, PoolEstimate, PoolFrame, SlotUsage, Stats, Step,
        TexturePages, TimeToSharp, Wait,
    };
    pub use vastex_tiles::{ChunkStats, StoreStats, TierStats, Tiers};
    pub use vastex_wgpu::{FeedbackPass, FeedbackScale, FeedbackTarget, RawTexture, Views};
}

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
