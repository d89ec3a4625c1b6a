//! Panels beside a picture, for hosts that draw with egui (feature `egui`): how layers are displayed, what keys do, where the
//! camera is, a map of the image, and guides and shapes over it.
//!
//! A panel is told what there is, shows it, changes the host's values in place and says that it did; the host shows the change. Nothing here
//! knows a window or a device.

mod compare;
mod display;
mod guides;
mod keys;
mod lengths;
mod measure;
mod minimap;
mod position;
mod shades;
mod shapes;

pub use compare::swipe_line;
pub use display::{DisplayPanel, PanelTexture, ShownTextures};
pub use guides::{ImageView, paint_guides};
pub use keys::keys_window;
pub use lengths::TexelSize;
pub use measure::{Measure, Measured};
pub use minimap::Minimap;
pub use position::{PositionChange, PositionPanel};
pub use shapes::{Shapes, ShapesError};
