//! What a window's panel is told, and what a person asks for in it.

use std::ffi::OsString;

use super::super::{Bookmark, FileBands, MapPlace, ShownTextures, TexelSize};
use crate::camera::{Move, Pose};
use crate::scene::Scene;
use crate::surface::PlanetOptions;
use crate::view_text::ViewText;

/// Something that a person asks for in a window's panel, for the host to do.
#[derive(Clone, Debug, PartialEq)]
pub enum WindowAsked {
    /// A file in the place of what is displayed.
    Open(OsString),
    /// Bands of a file, counted from 1, in the place of what is displayed.
    OpenBands(OsString, Vec<u16>),
    /// A file over what is displayed.
    LayOver(OsString),
    /// A file in the place of what is displayed, by the system's dialog.
    Choose,
    /// A folder in the place of what is displayed, by the system's dialog: tiles and volumes lie in some.
    ChooseFolder,
    /// A file over what is displayed, by the system's dialog.
    ChooseOver,
    /// The file so many after this one, or before it.
    File(i32),
    /// What is displayed on this scene.
    Scene(Scene),
    /// The first pose again.
    Fit,
    /// The camera there, in the scene of the pose.
    Go(Pose),
    /// The camera there, and what is shown as it says.
    Show(Box<ViewText>),
    /// What is shown of a volume as this text says.
    ShowText(String),
    /// What is shown, as a text, into the clipboard.
    CopyView,
    /// What is shown with its files as a link, into the clipboard.
    CopyLink,
    /// What is shown as a bookmark of this name.
    Keep(String),
    /// The bookmark of this index gone.
    Forget(usize),
    /// The camera moved.
    Move(Move),
}

/// What a window's panel is told of an image, or of what else there is, for one frame.
pub struct WindowStatus<'a> {
    /// Name of what is displayed.
    pub name: &'a str,
    /// Name of what is being opened, and how much of it is done, 0 to 1.
    pub opening: Option<(&'a str, f64)>,
    /// What there is to say to a person.
    pub notice: Option<&'a str>,
    /// What lies below the pointer, in words; `None` where nothing does or it is not shown.
    pub below: Option<&'a str>,
    /// Panes of the picture, side by side.
    pub panes: u32,
    /// The scene that the file is displayed on.
    pub scene: Scene,
    /// Where the camera is, and columns and rows of the image.
    pub position: (Pose, [u32; 2]),
    /// How large the image's texels are in the world, if that is known.
    pub texel_size: Option<&'a TexelSize>,
    /// Where the image lies in its file's own coordinate system, if that is known.
    pub map: Option<&'a MapPlace>,
    /// The images of the file, if there are several; each with its name and the path that opens it.
    pub images: &'a [(String, OsString)],
    /// The bands of the file, if it has more than a picture.
    pub bands: Option<&'a FileBands>,
    /// How the planet is lit, where the scene is one; changed in place.
    pub planet: Option<&'a mut PlanetOptions>,
    /// What the file says of itself: a name and a value each.
    pub rows: &'a [(String, String)],
    /// What is displayed, if anything is.
    pub texture: Option<ShownTextures<'a>>,
    /// Paths of files that were opened lately, the last one first.
    pub recent: &'a [String],
    /// Views of the file that a person keeps, the oldest first.
    pub bookmarks: &'a [Bookmark],
}
