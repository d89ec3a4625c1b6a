//! What every other folder stands on: hashes, the curve of sRGB, what threads share, where paths lead, and
//! words for what the system refuses.

pub(crate) mod advice;
pub(crate) mod hash;
pub(crate) mod place;
pub(crate) mod srgb;
pub(crate) mod sync;
