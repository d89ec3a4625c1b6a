//! What each command does, but for `view`: one module each.

#[cfg(feature = "build")]
pub(crate) mod build;
pub(crate) mod info;
pub(crate) mod render;
pub(crate) mod verify;
