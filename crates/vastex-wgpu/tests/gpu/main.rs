//! What the shaders do on a device, against their twins on the CPU. One binary, so that wgpu is linked once.

#![expect(clippy::unwrap_used, reason = "a test's helpers fail as the test itself does")]

mod belt;
mod common;
mod device;
mod drawing;
mod errors;
mod exact;
mod fade;
mod feedback;
mod fixed;
mod groups;
mod inspect;
mod modes;
mod params;
mod pool_tables;
mod pool_tables_sizes;
mod pool_tables_wgsl;
mod pool_world;
mod reached;
mod sampling;
mod seams;
mod stages;
mod table_texts;
mod test_text;
mod texture_space;
mod unlike;
