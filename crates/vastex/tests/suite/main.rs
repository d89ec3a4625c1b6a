//! The integration tests of the whole loop on a GPU, in one program.
#![allow(clippy::unwrap_used, clippy::panic, reason = "helpers of tests fail by panicking")]

mod ahead;

mod common;
mod dropped;
mod example;
mod explain;
mod explicit;
mod fade;
mod failing;
mod frame_loop;
mod groups;
mod growth;
mod host_groups;
mod host_passes;
mod ids;
mod labels;
mod materials;
mod mixing;
mod moving;
mod names;
mod page_tables;
mod pages;
mod pools;
mod prepared;
mod property;
mod ranks;
mod resize;
mod sample_cpu;
mod settings;
mod slow_sources;
mod small_triangles;
mod survives;
mod telemetry;
mod uploads;
mod views;
