//! Pictures that are drawn part by part, and pane by pane.

use std::time::Duration;

use vastex::Ticket;
use vastex_viewer::layers::Ground;
use vastex_viewer::{PicturePart, Pose, ShownLayer};

use super::Offscreen;
use crate::error::OffscreenError;

/// How long is waited for the ground below a camera.
const MOST_LOADING: Duration = Duration::from_secs(60);

impl Offscreen {
    /// What is seen around the surface and through it, from the next frame on.
    pub fn lay_on(&mut self, ground: Ground) {
        self.renderer.set_ground(ground);
    }

    /// What pictures show of a whole one from the next frame on, as
    /// [`show_part`](vastex_viewer::SceneRenderer::show_part) of their renderer has it; the part has the size
    /// of the pictures.
    pub fn show_part(&mut self, part: Option<PicturePart>) {
        self.renderer.show_part(part);
    }

    /// Where in pictures, or panes, of its size what a camera sees has its place from the next frame on, as
    /// [`set_view`](vastex_viewer::SceneRenderer::set_view) of their renderer has it.
    pub fn set_view(&mut self, view: Option<PicturePart>) {
        self.renderer.set_view(view);
    }

    /// Which part of pictures panes share from the next frame on, as
    /// [`set_room`](vastex_viewer::SceneRenderer::set_room) of their renderer has it.
    pub fn set_room(&mut self, room: Option<PicturePart>) {
        self.renderer.set_room(room);
    }

    /// Of layers side by side shows that of one pane alone from the next frame on, in pictures of a pane.
    /// Gives back the layers that are hidden for it.
    pub fn show_pane_alone(&mut self, pane: u32) -> Result<Vec<usize>, OffscreenError> {
        let mut others = self.renderer.layers().numbers_in_panes();
        if (pane as usize) < others.len() {
            others.remove(pane as usize);
        }
        for &n in &others {
            self.change_layer(n, |shown| ShownLayer { is_visible: false, ..shown })?;
        }
        Ok(others)
    }

    /// Shows layers that were hidden.
    pub fn show_again(&mut self, hidden: &[usize]) -> Result<(), OffscreenError> {
        for &n in hidden {
            self.change_layer(n, |shown| ShownLayer { is_visible: true, ..shown })?;
        }
        Ok(())
    }

    /// Loads the heights that say how high the ground is below a camera in a picture of so many pixels, and
    /// keeps them until the ticket is released, so that the camera is as high whatever is seen. `None` if
    /// no heights displace the scene, and if the pool has no room for them.
    pub fn keep_ground(&mut self, pose: &Pose, picture: [u32; 2]) -> Result<Option<Ticket>, OffscreenError> {
        let Some((texture, region)) = self.renderer.ground_below(&self.textures, pose, picture) else {
            return Ok(None);
        };
        let Ok(ticket) = self.textures.ahead().pin(texture, &region) else { return Ok(None) };
        self.textures.finish(&ticket, MOST_LOADING)?;
        Ok(Some(ticket))
    }
}
