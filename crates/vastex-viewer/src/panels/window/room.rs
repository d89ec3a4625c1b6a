//! Room for the panel, for what the machine does, and for the picture. A window that is too narrow for both
//! shows the one that was asked for last, and the other one again once it is wider or that one is hidden. One
//! in which either would leave too little of the picture shows the picture, until one of them is asked for.

use crate::hud::Hud;

/// Points that the panel is wide.
pub(super) const PANEL_WIDTH: f32 = 320.0;
/// Points of the picture that are left beside them, at least.
const PICTURE_WIDTH: f32 = 200.0;

/// What there is room for, as the last frame found it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Room {
    /// True if both are wanted, and there is room for one.
    is_for_one: bool,
    /// True if there is no room for the panel alone, or for what the machine does.
    lacks_panel: bool,
    lacks_machine: bool,
    machine_came_last: bool,
    /// True if what came last was asked for since the window has been so narrow.
    was_asked: bool,
}

impl Room {
    /// Notes how many points of the window are free, and whether what the machine does is shown at all.
    pub(super) fn measure(&mut self, width: f32, machine_is_shown: bool) {
        self.is_for_one = machine_is_shown && width < Hud::WIDTH + PANEL_WIDTH + PICTURE_WIDTH;
        self.lacks_panel = width < PANEL_WIDTH + PICTURE_WIDTH;
        self.lacks_machine = width < Hud::WIDTH + PICTURE_WIDTH;
        self.was_asked &= self.lacks_machine;
    }

    /// Returns true if the panel, which is open, is seen.
    pub(super) fn has_panel(self) -> bool {
        let gives_way = self.is_for_one && self.machine_came_last;
        !gives_way && (!self.lacks_panel || self.was_asked && !self.machine_came_last)
    }

    /// Returns true if what the machine does is seen, beside the panel if that `is_open`.
    pub(super) fn has_machine(self, is_open: bool) -> bool {
        let gives_way = is_open && self.is_for_one && !self.machine_came_last;
        !gives_way && (!self.lacks_machine || self.was_asked && self.machine_came_last)
    }

    pub(super) fn panel_comes(&mut self) {
        (self.machine_came_last, self.was_asked) = (false, true);
    }

    pub(super) fn machine_comes(&mut self) {
        (self.machine_came_last, self.was_asked) = (true, true);
    }
}
