//! The viewer as its hosts have it: what takes a device and a host to be seen.
#![allow(clippy::unwrap_used, clippy::panic, reason = "helpers of tests fail by panicking")]

#[cfg(feature = "egui")]
#[allow(dead_code, reason = "it is compiled, and nothing here runs it")]
mod eframe_example;
#[cfg(feature = "egui")]
mod growing;
#[cfg(feature = "egui")]
mod kept_pictures;
#[cfg(feature = "egui")]
mod surface_scene;
#[cfg(feature = "egui")]
mod widget;
#[cfg(feature = "egui")]
mod window_scene;

// What the example finds under the name of eframe.
#[cfg(feature = "egui")]
extern crate self as eframe;
#[cfg(feature = "egui")]
pub(crate) use ::egui;
#[cfg(feature = "egui")]
pub(crate) use eframe_example::stand_in::{
    App, CreationContext, Frame, NativeOptions, Renderer, Result, run_native,
};

mod formats;
mod huge;
// Where the system tells how much memory a process had.
#[cfg(target_os = "linux")]
mod huge_memory;
mod label_reference;
mod labels;
mod still;
mod volume_bright;
mod volume_channels;
mod volume_coverage;
mod volume_faces;
mod volume_feedback;
mod volume_levels;
mod volume_life;
mod volume_paths;
mod volume_real;
mod volume_reference;
mod volume_rest;
mod volume_scene_labels;
mod volume_scenes;
mod volume_world;
mod volumes;
