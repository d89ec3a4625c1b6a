//! For tests: what every source must keep (`conformance`), and a source that goes wrong as planned
//! (`faults`).

#[cfg(not(target_family = "wasm"))]
mod conformance;
mod faults;
#[cfg(test)]
#[cfg(feature = "write")]
pub(crate) mod textures;

#[cfg(not(target_family = "wasm"))]
pub use conformance::conformance;
pub use faults::{FaultRates, Faults, Injection};
