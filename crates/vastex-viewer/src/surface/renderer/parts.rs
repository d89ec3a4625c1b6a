//! Pictures of a scene that are parts of more than they show: of larger pictures, or of what a camera sees,
//! which has a place of its own in them.

use super::SceneRenderer;
use crate::layers::Panes;
use crate::picture::PicturePart;
use crate::scene::Scene;

impl SceneRenderer {
    /// From the next pose on, pictures of the part's size show it as it is in the whole: as if all of the
    /// whole were drawn, and the part cut out of it. Poses are those of the whole. Pictures of other sizes,
    /// and of several panes, are drawn as ever.
    pub fn show_part(&mut self, part: Option<PicturePart>) {
        self.part = part;
    }

    /// From the next pose on, what a camera sees in scenes with perspective has a place of its own in
    /// pictures, or panes, of `view.size` pixels: they are that part of it, as [`PicturePart::around`] makes
    /// one of what panels leave free. Everything that is asked about such a picture is answered of it as it
    /// is drawn. Images, whose camera is moved instead, and pictures of other sizes are drawn as ever.
    ///
    /// This holds for [`SceneRenderer::show_part`], too: its whole is such a picture.
    pub fn set_view(&mut self, view: Option<PicturePart>) {
        self.view = view;
    }

    /// What [`SceneRenderer::set_view`] was told last.
    pub fn view(&self) -> Option<PicturePart> {
        self.view
    }

    /// From the next pose on, panes of pictures of `room.whole` pixels share that part of them, which panels
    /// leave free ([`Panes::sharing`]); those of other pictures share all of them.
    pub fn set_room(&mut self, room: Option<PicturePart>) {
        self.room = room;
    }

    /// Where the panes of a picture of so many pixels are.
    pub fn panes_in(&self, picture: [u32; 2]) -> Panes {
        let room = self.room.filter(|room| room.whole == picture).unwrap_or(PicturePart::all(picture));
        let [first, width] = [room.at[0] as f64, room.size[0].into()];
        self.layers.panes_in(picture[0], [first, first + width])
    }

    /// Which part a picture of so many pixels, or a pane of it, is of what a camera sees.
    pub fn view_in(&self, picture: [u32; 2]) -> PicturePart {
        let view = self.view.filter(|view| view.size == picture && self.scene() != Scene::Image);
        view.unwrap_or(PicturePart::all(picture))
    }

    /// Which part of which whole a picture of so many pixels is.
    pub(super) fn part_of(&self, picture: [u32; 2]) -> PicturePart {
        let part = self.part.filter(|part| part.size == picture && self.layers.panes() == 1);
        part.unwrap_or(PicturePart::all(picture))
    }

    /// A part of a picture as the part that it is of what a camera sees.
    pub(super) fn seen_in(&self, part: &PicturePart) -> PicturePart {
        let PicturePart { whole, at, .. } = self.view_in(part.whole);
        PicturePart { whole, at: [at[0] + part.at[0], at[1] + part.at[1]], size: part.size }
    }
}
