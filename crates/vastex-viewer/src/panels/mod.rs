//! Panels beside a picture, for hosts that draw with egui (feature `egui`): how layers are displayed, how a
//! planet is lit, what keys do, where the camera is, a map of the image, and guides and shapes over it, what
//! is below the pointer, what went wrong; and of volumes their channels, and what lies over their pictures.
//! [`WindowPanel`] is all of them in one window of a program, [`PanelPainter`] draws what egui made of them.
//!
//! A panel is told what there is, shows it, changes the host's values in place and says that it did; the host
//! shows the change. No panel knows a window or a device.

mod bookmarks;
mod compare;
mod display;
mod file_about;
mod free_part;
mod guides;
mod info;
mod keys;
mod lengths;
mod map_place;
mod measure;
mod messages;
mod minimap;
mod painter;
mod palettes;
mod panes;
mod planet;
mod position;
mod runs;
mod shades;
mod shapes;
mod sphere;
mod status;
#[cfg(test)]
mod unnamed;
mod volume;
mod volume_histogram;
mod volume_panes;
mod volume_words;
mod window;

pub use crate::layers::Panes;
pub use bookmarks::{Bookmark, BookmarksChange, BookmarksPanel};
pub use compare::swipe_line;
pub use display::{DisplayPanel, PanelTexture, ShownTextures};
pub use file_about::{FileAbout, FileBands};
pub use free_part::free_in_panes;
pub use guides::{ImageView, paint_guides};
pub use info::InfoPanel;
pub use keys::{keys_window, keys_window_of};
pub use lengths::TexelSize;
pub use map_place::MapPlace;
pub use measure::{Measure, Measured};
pub use messages::Messages;
pub use minimap::Minimap;
pub use painter::PanelPainter;
pub use planet::planet_controls;
pub use position::{PositionChange, PositionPanel};
pub use shapes::{GeoJson, Shapes, ShapesError};
pub use status::{StatusPlace, foot_rise, status_line, status_text};
#[cfg(test)]
pub(crate) use unnamed::unnamed;
pub use volume::{VolumeChange, VolumePanel, VolumeStatus};
pub use volume_histogram::VolumeValues;
pub use volume_panes::VolumePanes;
pub use volume_words::{ray_cut_text, volume_status_text};
pub use window::{OfferedImages, WindowAsked, WindowOfVolume, WindowPanel, WindowStatus, say_below};
