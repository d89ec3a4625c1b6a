//! What a view wants, from levels drawn in texture space.

use vastex_core::{Feedback, Geometry, TextureNumber};
use vastex_wgpu::TextureSpace;

use super::due_feedback::FEEDBACK_FRAMES;
use super::{BindGroups, Gpu};
use crate::error::Error;
use crate::settings::Pace;

/// Where the levels of a texture are drawn, and what was drawn last.
pub(super) struct TextureSpacePath {
    texture: TextureNumber,
    target: TextureSpace,
    wanted: Option<Feedback>,
}

impl Gpu {
    /// Draws the levels that the view needs of a texture, and says what it wants by the last of them that
    /// have come back.
    pub(crate) fn texture_space(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        (texture, geometry): (TextureNumber, &Geometry),
        max_pages: usize,
        frame: u64,
        draw: impl FnOnce(&mut wgpu::RenderPass<'_>, &BindGroups),
    ) -> Result<Option<Feedback>, Error> {
        if self.pace == Pace::Realtime {
            self.poll_device()?;
        }
        let place = match self.texture_spaces.iter().position(|path| path.texture == texture) {
            Some(place) => place,
            None => {
                let target = TextureSpace::new(&self.device, geometry)?;
                self.texture_spaces.push(TextureSpacePath { texture, target, wanted: None });
                self.texture_spaces.len() - 1
            }
        };
        let path = &mut self.texture_spaces[place];
        let arrived = match (self.pace, frame.checked_sub(FEEDBACK_FRAMES)) {
            (Pace::Realtime, _) => path.target.poll()?,
            (Pace::LockStep { .. }, Some(frame)) => path.target.wait(&self.device, &self.queue, frame)?,
            (Pace::LockStep { .. }, None) => None,
        };
        if let Some((frame, levels)) = arrived {
            path.wanted = Some(levels.pages(texture, geometry, max_pages, frame));
        }
        draw(&mut path.target.begin(encoder), &self.bind_groups);
        path.target.record(encoder, frame);
        Ok(path.wanted.clone())
    }

    /// Forgets what was drawn of a texture, or of all.
    pub(super) fn forget_texture_space(&mut self, texture: Option<TextureNumber>) {
        self.texture_spaces.retain(|path| texture.is_some_and(|texture| path.texture != texture));
    }
}
