//! Panels beside a picture, for hosts that draw with egui (feature `egui`): how layers are displayed, how a
//! planet is lit, what keys do, where the camera is, a map of the image, and guides and shapes over it, what
//! is below the pointer, what went wrong.
//!
//! A panel is told what there is, shows it, changes the host's values in place and says that it did; the host
//! shows the change. Nothing here knows a window or a device.

mod compare;
mod display;
mod guides;
mod info;
mod keys;
mod lengths;
mod measure;
mod messages;
mod minimap;
mod panes;
mod planet;
mod position;
mod runs;
mod shades;
mod shapes;
mod status;

pub use compare::swipe_line;
pub use display::{DisplayPanel, PanelTexture, ShownTextures};
pub use guides::{ImageView, paint_guides};
pub use info::InfoPanel;
pub use keys::keys_window;
pub use lengths::TexelSize;
pub use measure::{Measure, Measured};
pub use messages::Messages;
pub use minimap::Minimap;
pub use panes::Panes;
pub use planet::planet_controls;
pub use position::{Bookmark, PositionChange, PositionPanel};
pub use shapes::{GeoJson, Shapes, ShapesError};
pub use status::{status_line, status_text};

/// The controls below a node that have no name, for tests: what a person can use and a screen reader could
/// not tell.
#[cfg(test)]
pub(crate) fn unnamed(root: &egui_kittest::Node<'_>) -> Vec<String> {
    use egui::accesskit::{Action, Role};
    use egui_kittest::kittest::NodeT;
    let node = root.accesskit_node();
    // Ways to scroll and the window itself are no controls.
    let is_plain = matches!(
        node.role(),
        Role::Window
            | Role::Label
            | Role::ScrollBar
            | Role::ScrollView
            | Role::GenericContainer
            | Role::Unknown
    );
    let is_used =
        [Action::Focus, Action::Click].into_iter().any(|action| node.data().supports_action(action));
    let has_name = node.label().is_some_and(|label| !label.trim().is_empty());
    let mut unnamed = Vec::new();
    if is_used && !is_plain && !has_name {
        unnamed.push(format!("{:?} {:?}", node.role(), node.value()));
    }
    unnamed.extend(root.children().flat_map(|child| self::unnamed(&child)));
    unnamed
}
