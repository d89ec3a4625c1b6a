//! What the examples have in common, and any application has in its own way: a device without a window,
//! pictures, pipelines, images.
//!
//! Nothing here is for Vastex but the features that the device is asked for, and that `painted` is a source
//! of tiles.

pub(crate) mod headless;
pub(crate) mod painted;
