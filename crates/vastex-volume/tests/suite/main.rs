//! Volumes that other programs wrote, read whole and in parts, and what damage does to them.
#![allow(clippy::unwrap_used, clippy::panic, reason = "helpers of tests fail by panicking")]

mod about;
mod bounds;
mod bricks;
mod damage;
mod fixtures;
mod generated;
mod hostile;
mod made;
mod messages;
mod oddities;
mod sampling;
mod source;
mod sparse;
mod values;
