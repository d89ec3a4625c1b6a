//! The integration tests of the preparing part, in one program: images in, containers and tile directories
//! out.
#![allow(clippy::unwrap_used, clippy::panic, reason = "helpers of tests fail by panicking")]

mod bad_input;
mod bands;
#[cfg(feature = "bc")]
mod block_source;
mod bombs;
mod coarse_jpeg;
mod colors;
mod common;
mod crop_stopped;
mod directories;
mod filters;
mod halfs;
mod inputs;
mod insets;
#[cfg(feature = "bc")]
mod insets_layers;
#[cfg(feature = "bc")]
mod layers;
mod memory_image;
mod nodata;
mod orientation;
mod parts;
mod pyramid;
mod pyramids;
mod readers;
mod replace;
#[cfg(feature = "bc")]
mod replace_layers;
mod resume;
mod same_input;
mod sparse;
mod sparse_tiff;
mod streamed_tiff;
mod tiff_kinds;
#[cfg(feature = "volumes")]
mod volumes;
