//! Round trips, damage of every kind, and what a writer leaves behind.

mod conforming;
mod damage;
mod round_trip;
#[cfg(not(target_family = "wasm"))]
mod update;
mod versions;
