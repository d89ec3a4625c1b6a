//! What every other folder stands on: hashes, and what threads share.

pub(crate) mod hash;
pub(crate) mod sync;
