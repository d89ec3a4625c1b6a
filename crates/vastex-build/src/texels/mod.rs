//! Texels and what is done to them: from an image's to a layer's, mixed, resampled, magnified, and compressed
//! in blocks.
//!
//! Nothing here knows of pages or levels; where rows come from is [`crate::image`]'s business, which level
//! they belong to [`crate::pyramid`]'s.

pub(crate) mod blend;
pub(crate) mod blocks;
pub(crate) mod convert;
pub(crate) mod filter;
pub(crate) mod halfs;
pub(crate) mod input;
pub(crate) mod magnify;
pub(crate) mod missing;
pub(crate) mod scaled;
mod srgb;
pub(crate) mod taps;
pub(crate) mod texel;

pub use blocks::Quality;
pub use filter::{FilterError, Kernel, LayerFilter, LevelsFrom, Meaning};
pub use input::LayerInput;
