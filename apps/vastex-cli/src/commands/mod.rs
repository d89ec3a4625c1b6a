//! What each command does, but for `view`: one module each.

#[cfg(feature = "build")]
mod about_info;
#[cfg(feature = "build")]
pub(crate) mod build;
#[cfg(feature = "build")]
pub(crate) mod build_kind;
#[cfg(all(feature = "build", feature = "volumes"))]
mod build_volume;
mod compared;
#[cfg(feature = "build")]
pub(crate) mod crop;
#[cfg(feature = "build")]
pub(crate) mod export;
#[cfg(feature = "build")]
mod image_info;
pub(crate) mod info;
pub(crate) mod learn;
#[cfg(feature = "build")]
pub(crate) mod merge;
#[cfg(feature = "record")]
pub(crate) mod record;
pub(crate) mod render;
#[cfg(feature = "volumes")]
pub(crate) mod render_labels;
#[cfg(feature = "volumes")]
pub(crate) mod render_pools;
#[cfg(feature = "volumes")]
pub(crate) mod render_volume;
#[cfg(feature = "build")]
pub(crate) mod replace;
pub(crate) mod replay;
mod run_report;
mod source_info;
#[cfg(feature = "build")]
mod tiff_info;
pub(crate) mod verify;
#[cfg(feature = "volumes")]
pub(crate) mod volume;
