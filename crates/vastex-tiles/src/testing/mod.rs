//! For tests: what every source must keep (`conformance`), a source that goes wrong as planned (`faults`),
//! and work that must end (`limit`).

#[cfg(not(target_family = "wasm"))]
mod conformance;
mod faults;
#[cfg(not(target_family = "wasm"))]
mod limit;
#[cfg(test)]
#[cfg(feature = "write")]
pub(crate) mod textures;

#[cfg(not(target_family = "wasm"))]
pub use conformance::conformance;
pub use faults::{FaultRates, Faults, Injection};
#[cfg(not(target_family = "wasm"))]
pub use limit::ends_within;
