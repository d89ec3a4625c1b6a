//! What a person may want, and which keys that are pressed once ask for it, alone and with others.

use glam::DVec2;

use super::Key;
use crate::camera::Move;
use crate::scene::Scene;

/// Something that a person wants.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Action {
    /// The camera elsewhere.
    Move(Move),
    /// The first pose again.
    Reset,
    /// The pointer, or a finger, was pressed and let go in the same place: there, in pixels from the top left
    /// of the view. Comes before a [`Action::DoubleClick`], too.
    Click(DVec2),
    /// The second of two clicks on the same place; the first came as [`Action::Click`]. A host that has no
    /// other use for it does what [`Action::Reset`] says.
    DoubleClick,
    /// Measuring, or not any more.
    Measure,
    /// What was done last while measuring, undone.
    Undo,
    /// An image with so many pixels a texel, towards a point in view heights from the middle.
    Magnify(f64, DVec2),
    /// A file that a person chooses in a dialog.
    Open,
    /// The file so many after the one that is shown, or before it.
    File(i32),
    /// Another scene, or the next.
    Scene(Option<Scene>),
    /// The next overlay in the place of the picture, or the picture again.
    Overlay,
    /// Why the pixel below the pointer shows what it shows, in pixels of the view.
    Explain([u32; 2]),
    /// The whole screen, or the window again.
    FillScreen,
    /// Black and white by the values that are in view.
    AutoRange,
    /// Lighter or darker by so many stops.
    Expose(f32),
    /// The next way of comparing the uppermost layer with those beneath it, or none.
    Compare,
    /// Layers side by side, or over one another again.
    Beside,
    /// The panel beside the picture, or the picture alone.
    Panel,
    /// The panel, with the keys in its first control.
    EnterPanel,
    /// What the file says of itself, in the panel.
    About,
    /// What the machine does, beside the picture, or the picture alone.
    Hud,
    /// The guides over an image, or the picture alone.
    Guides,
    /// The value below the pointer in the picture, or not.
    Values,
    /// The list of keys and gestures, or the picture alone.
    Keys,
    /// The picture, so many times as large as the view, into a file.
    Screenshot(u32),
    /// Where the camera goes from here on into a file, or the end of that.
    Record,
    /// The camera as it went when that was recorded last, or as a file says.
    Play,
    /// What is shown, as a text, into the clipboard.
    CopyView,
    /// What is shown and its files, as a link, into the clipboard.
    CopyLink,
    /// What a view or a link in the clipboard says is to be shown.
    PasteView,
    /// Another window, which offers to open a file.
    NewWindow,
    /// Another window with what is shown in this one.
    Duplicate,
    /// The picture again: it may be stale.
    Redraw,
    /// The end.
    Quit,
}

impl Action {
    /// Returns false if the action changes what lies over the picture or beside it alone, so that nothing
    /// else is wanted for it.
    pub fn may_change_picture(&self) -> bool {
        use Action::*;
        let is_beside = matches!(self, Panel | EnterPanel | Hud | Guides | Values | Keys);
        !is_beside && !matches!(self, CopyView | CopyLink | NewWindow | Duplicate | Quit)
    }

    /// Returns true if the action is of a window whatever that shows: a volume as well, which has keys of its
    /// own for all else.
    pub fn is_of_window(&self) -> bool {
        use Action::*;
        let is_beside = matches!(self, Panel | EnterPanel | About | Hud | Guides | Values | Keys);
        let goes_out = matches!(self, Screenshot(_) | CopyView | CopyLink | PasteView | Record | Play);
        let is_other = matches!(self, FillScreen | File(_) | Open | NewWindow | Duplicate | Redraw | Quit);
        is_beside || goes_out || is_other
    }
}

/// Stops by which a key makes a picture lighter.
const STOPS: f32 = 0.5;

/// What a letter does with control: what other programs have on it. What it does alone it does not do by
/// accident with control.
pub(super) fn action_with_control(letter: char) -> Option<Action> {
    Some(match letter.to_ascii_lowercase() {
        'c' if letter == 'C' => Action::CopyLink,
        'o' => Action::Open,
        'n' => Action::NewWindow,
        'd' => Action::Duplicate,
        's' => Action::Screenshot(1),
        'c' => Action::CopyView,
        'v' => Action::PasteView,
        'q' => Action::Quit,
        _ => return None,
    })
}

/// What a key does with Alt.
pub(super) fn action_with_alt(key: Key) -> Option<Action> {
    Some(match key {
        Key::Left => Action::File(-1),
        Key::Right => Action::File(1),
        Key::Enter => Action::About,
        // Closes windows: that is the window system's.
        Key::F(4) => return None,
        // Alone they do the same.
        Key::F(_) => return action_of(key),
        _ => return None,
    })
}

/// What a key does alone, once.
pub(super) fn action_of(key: Key) -> Option<Action> {
    Some(match key {
        Key::Escape | Key::Char('q' | 'Q') => Action::Quit,
        Key::Home | Key::Char('r' | 'R' | '0') => Action::Reset,
        Key::PageDown | Key::Char('n' | 'N') => Action::File(1),
        Key::PageUp | Key::Char('p' | 'P') => Action::File(-1),
        Key::Tab => Action::EnterPanel,
        Key::Char('e' | 'E') => Action::Scene(None),
        Key::Char('u' | 'U') => Action::Hud,
        Key::F(11) | Key::Char('f' | 'F') => Action::FillScreen,
        Key::Char('l' | 'L') => Action::Overlay,
        Key::Char('c' | 'C') => Action::AutoRange,
        Key::Char('[') => Action::Expose(-STOPS),
        Key::Char(']') => Action::Expose(STOPS),
        Key::Char('g' | 'G') => Action::Guides,
        Key::Char('j' | 'J') => Action::Values,
        Key::Char('v' | 'V') => Action::Compare,
        Key::Char('b' | 'B') => Action::Beside,
        Key::Char('k' | 'K') => Action::Measure,
        Key::Backspace => Action::Undo,
        Key::Char('t') => Action::Move(Move::Turn(90.0)),
        Key::Char('T') => Action::Move(Move::Turn(-90.0)),
        Key::Char('x' | 'X') => Action::Move(Move::Flip { is_vertical: false }),
        Key::Char('y' | 'Y') => Action::Move(Move::Flip { is_vertical: true }),
        Key::Char('z' | 'Z') => Action::Move(Move::Upright),
        Key::Char('m' | 'M') => Action::Panel,
        Key::Char('?' | 'h' | 'H') => Action::Keys,
        Key::F(5) => Action::Screenshot(1),
        Key::F(6) => Action::Screenshot(2),
        Key::F(7) => Action::Screenshot(4),
        Key::F(8) => Action::Record,
        Key::F(9) => Action::Play,
        Key::F(1) => Action::Scene(Some(Scene::Image)),
        Key::F(2) => Action::Scene(Some(Scene::Plane)),
        Key::F(3) => Action::Scene(Some(Scene::Globe)),
        Key::F(4) => Action::Scene(Some(Scene::Terrain)),
        Key::F(10) => Action::Scene(Some(Scene::Planet)),
        _ => return None,
    })
}
