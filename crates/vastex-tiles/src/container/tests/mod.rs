//! Round trips, damage of every kind, and what a writer leaves behind.

mod align;
mod conforming;
mod damage;
#[cfg(not(target_family = "wasm"))]
mod direct;
#[cfg(not(target_family = "wasm"))]
mod flips;
#[cfg(not(target_family = "wasm"))]
mod reorder;
mod round_trip;
#[cfg(not(target_family = "wasm"))]
mod update;
mod versions;
mod volume;
