//! Damaged inputs for everything in Vastex that reads what others wrote.
//!
//! A [`Target`] takes bytes, hands them to a reader and asserts what must hold of any bytes; it has small
//! sound inputs to start from ([`Target::seeds`]), and [`mutate`] damages those, with the checksums made
//! right again half of the time. Two drivers share that: [`run`], which follows from its seed alone and
//! stands in the suite and behind `cargo xtask campaign fuzz`; and the targets of cargo-fuzz under `fuzz/`,
//! which are guided by coverage.
//!
//! What sound inputs must give is the business of each crate's own tests.

mod mutate;
mod reseal;
mod rng;
mod run;
mod seeds;
mod targets;
mod tree;

pub use mutate::mutate;
pub use run::{Failure, Harm, Limit, PATIENCE, Ran, run};
pub use targets::{TARGETS, Target};
pub use tree::Tree;
