//! The program as a person or a script meets it: the built binary, its exit codes, and what it says and
//! leaves behind.
#![cfg(feature = "build")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "where a test cannot go on, it fails")]

mod bad_input;
mod bands;
mod cache;
mod camera;
mod disk_cache;
mod estimates;
mod export;
mod feedback_modes;
#[cfg(feature = "view")]
mod first_range;
mod heights;
#[cfg(unix)]
mod hostile;
mod in_place;
mod inset;
mod layers;
mod learn;
mod links;
mod nodata;
mod out;
mod overlays;
mod parts;
mod places;
mod planet;
mod record;
mod replay;
mod resume;
mod round_trip;
mod settings;
mod telemetry;
mod tool;
#[cfg(feature = "volumes")]
mod volume_damage;
#[cfg(feature = "volumes")]
mod volume_gallery;
#[cfg(feature = "volumes")]
mod volume_labels;
#[cfg(feature = "volumes")]
mod volume_path;
#[cfg(feature = "volumes")]
mod volume_pictures;
#[cfg(feature = "volumes")]
mod volume_raw;
#[cfg(feature = "volumes")]
mod volume_sparse;
#[cfg(feature = "volumes")]
mod volume_view;
#[cfg(feature = "volumes")]
mod volume_watch;
#[cfg(feature = "volumes")]
mod volume_words;
#[cfg(feature = "volumes")]
mod volumes;
mod words;
