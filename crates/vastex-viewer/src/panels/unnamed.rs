//! For tests of panels, here and in the program: which controls a person can use and a screen reader could
//! not name.

use egui::accesskit::{Action, Role};
use egui_kittest::kittest::NodeT;

/// The controls below a node that have no name.
pub(crate) fn unnamed(root: &egui_kittest::Node<'_>) -> Vec<String> {
    let node = root.accesskit_node();
    // Texts that can be selected, ways to scroll and the window itself are no controls.
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
    let mut found = Vec::new();
    if is_used && !is_plain && !has_name {
        found.push(format!("{:?} {:?}", node.role(), node.value()));
    }
    found.extend(root.children().flat_map(|child| unnamed(&child)));
    found
}
