//! Panels beside a picture, for hosts that draw with egui (feature `egui`): how layers are displayed, and what keys do.
//!
//! A panel is told what there is, shows it, changes the host's values in place and says that it did; the host shows the change. Nothing here
//! knows a window or a device.

mod display;
mod keys;
mod shades;

pub use display::{DisplayPanel, ShownTexture};
pub use keys::keys_window;
