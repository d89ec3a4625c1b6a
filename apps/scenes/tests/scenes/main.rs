//! What the scenes show: the same as an ordinary texture, and the best that is there while it streams.

#![allow(clippy::unwrap_used, clippy::panic, reason = "clippy takes helpers of tests for production code")]

mod ahead;
mod beside_panels;
mod by_texel;
mod common;
mod compiling;
mod descent;
mod estimates;
mod fade;
mod feedback_modes;
mod filters;
mod fixed;
mod fixed_heights;
mod floor;
mod golden;
mod heights;
mod layers;
mod lit_planet;
mod many_layers;
mod matrix;
mod overlays;
mod pictures;
mod planet;
mod policies;
mod seams;
mod shaders;
mod sharing;
mod shown_layers;
mod streaming;
mod targets;
mod tones;
mod values;
mod views;
mod whole;
