//! Room for the panel and for what the machine does. A window that is too narrow for both shows the one
//! that was asked for last, and the other one again once it is wider or that one is hidden.

use vastex_viewer::hud::Hud;

/// Points that the panel is wide.
pub(super) const PANEL_WIDTH: f32 = 320.0;
/// Points of the picture between both, at least.
const BETWEEN: f32 = 92.0;

/// What there is room for, as the last frame found it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Room {
    /// True if both are wanted, and there is room for one.
    is_for_one: bool,
    machine_came_last: bool,
}

impl Room {
    /// Notes how many points of the window are free, and whether what the machine does is shown at all.
    pub(super) fn measure(&mut self, width: f32, machine_is_shown: bool) {
        self.is_for_one = machine_is_shown && width < Hud::WIDTH + PANEL_WIDTH + BETWEEN;
    }

    /// Returns true if the panel, which is open, is seen.
    pub(super) fn has_panel(self) -> bool {
        !(self.is_for_one && self.machine_came_last)
    }

    /// Returns true if what the machine does is seen beside the panel, which is open.
    pub(super) fn has_machine(self) -> bool {
        !self.is_for_one || self.machine_came_last
    }

    pub(super) fn panel_comes(&mut self) {
        self.machine_came_last = false;
    }

    pub(super) fn machine_comes(&mut self) {
        self.machine_came_last = true;
    }
}
