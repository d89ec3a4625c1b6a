//! What must hold of the code itself: the house and its arrows, what each crate may not see, and the style.
//!
//! ARCHITECTURE.md states these as absences; here each is a test. They read the sources and ask `cargo tree`,
//! and take seconds.

mod absences;
mod arrows;
mod demo;
mod docs;
mod fuzzing;
mod help;
mod locks;
mod rooms;
mod sources;
mod style;
mod tree;
mod wgsl;
