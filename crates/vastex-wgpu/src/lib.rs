//! The part of Vastex that executes, on a GPU through `wgpu`.
//!
//! Here are a [`Pool`] of tiles in GPU memory, its page tables and the changes that keep them true
//! ([`PoolTables`]), the records of all textures ([`ParamStore`]), the text that an application adds to its
//! own shaders ([`wgsl()`]), made for all textures of some [`Kinds`], and what it binds ([`layout_entries`],
//! [`entries`]), the target into which a view says which pages it wants ([`FeedbackTarget`]), its compaction
//! and its way back ([`Readback`]). All shaders have a naive twin on the CPU ([`twins`]), which tests compare
//! them with and which stands in where no GPU can.
//!
//! This crate never chooses a page and never sees a source: it carries out what `vastex-core`'s pager
//! returns. It asks a device for nothing beyond WebGPU's default limits, and uses what optional features and
//! larger limits there are ([`required_features`], [`required_limits`]); with less, down to WebGL 2's, it
//! has another mode ([`FeedbackMode`]). It installs nothing on a device; that one was lost shows as
//! [`GpuError::DeviceLost`] wherever something is read back.
//!
//! In the order in which a frame meets them: [`FeedbackTarget::begin`] and the scene's draws,
//! [`Readback::record`], [`Readback::poll`] or [`Readback::wait`], then, for what the pager returns,
//! [`Pool::upload`], [`PoolTables::apply`] and [`Pool::set_bias`], and the scene's main pass.

mod arena;
mod belt;
mod bind;
mod compact;
mod device;
mod error;
mod fade;
mod feedback;
mod feedback_mode;
mod filter;
mod filters;
mod inline;
mod instance;
mod kind;
mod layer;
mod mapping;
mod mirror;
mod module;
mod names;
mod needed;
mod param_store;
mod pixel;
mod pool;
mod ranges;
mod raw;
mod readback;
mod record;
mod shader;
mod tables;
#[cfg(feature = "test-device")]
mod test_counters;
#[cfg(feature = "test-device")]
pub mod test_device;
mod texture_space;
pub mod twins;
mod views;

pub use belt::{Belt, BeltCounts, BeltLayout, BeltTile};
pub use bind::{BindingPlace, Bound, check_bindings, entries, layout_entries, new_sampler};
pub use device::{alive, array_limits, limits, poll, required_features, required_limits};
pub use error::GpuError;
pub use fade::Fades;
pub use feedback::{FEEDBACK_DEPTH_FORMAT, FeedbackPass, FeedbackScale, FeedbackTarget, FeedbackView};
pub use feedback_mode::FeedbackMode;
pub use filter::{Filter, MaxTaps, UnknownFilter};
pub use filters::{VolumeFilters, filters_text, half_bits};
pub use inline::{InlinePipelines, InlineTarget};
pub use instance::instance_for;
pub use kind::{Atlas, Kind, KindMember, Kinds, PageSides, TableChoice, TableKind};
pub use layer::{held_format, held_volume_format, texture_format, volume_texture_format};
pub use module::shader_module;
pub use needed::only_needed;
pub use param_store::{ParamStore, ParamsWritten};
pub use pixel::PixelReadback;
pub use pool::Pool;
pub use raw::{FEEDBACK_FORMAT, RawFeedback, RawTexture};
pub use readback::{Readback, ReadbackPipelines};
pub use record::{
    MOST_UNALIGNED_LEVELS, RECORD_WORDS, RecordOf, group_record, no_record, shader_id, texture_record,
};
pub use shader::{compute_texts, wgsl};
pub use tables::{Placement, PoolApplied, PoolTableChanger, PoolTables, RECORDED_AHEAD, Resident};
pub use texture_space::{TEXTURE_SPACE_BLEND, TEXTURE_SPACE_FORMAT, TextureSpace};
pub use views::Views;
