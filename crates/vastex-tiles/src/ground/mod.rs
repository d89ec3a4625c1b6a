//! What every other folder stands on: hashes, what threads share, and words for what the system refuses.

pub(crate) mod advice;
pub(crate) mod hash;
pub(crate) mod sync;
