//! The parts of this program that others call too: programs that are run within a limit, where these find
//! compiled shaders, and the record, a short form of which runs in the suite of the program `vastex`.
//!
//! What a person types is `main`'s business.

pub mod compiled_shaders;
pub mod limited;
pub mod record;
