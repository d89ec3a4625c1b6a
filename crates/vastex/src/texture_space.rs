//! What a view wants, from levels drawn in texture space.

use vastex_core::{Feedback, SurveySettings, TextureId};
use vastex_wgpu::TextureSpace;

use crate::error::Error;
use crate::settings::Pace;
use crate::textures::{BindGroups, Textures};

/// Frames after which what was drawn acts in lock-step, as feedback does.
const LATENCY: u64 = 2;

/// Where the levels of a texture are drawn, and what was drawn last.
pub(crate) struct TextureSpacePath {
    texture: TextureId,
    target: TextureSpace,
    wanted: Option<Feedback>,
}

impl Textures {
    /// The format of the target for [`Textures::texture_space`], for the application's pipeline.
    pub const TEXTURE_SPACE_FORMAT: wgpu::TextureFormat = vastex_wgpu::TEXTURE_SPACE_FORMAT;
    /// How that pipeline blends.
    pub const TEXTURE_SPACE_BLEND: wgpu::BlendState = vastex_wgpu::TEXTURE_SPACE_BLEND;

    /// Draws the level that the view needs of each part of a texture, in texture space, and says what the view wants by the last of
    /// them that have come back, about two frames old: nothing in the first frames. To be given to [`Textures::want`], or beside
    /// feedback to [`Textures::expect`]; those of several textures together, by [`Feedback::of_pages`].
    ///
    /// `draw` draws every surface that shows the texture, with a pipeline whose vertex shader gives `vastex_texture_space_clip(uv)` as
    /// the position and the picture's clip position to its fragment shader, which returns `vastex_texture_space(uv, clip, picture)`; into
    /// [`Textures::TEXTURE_SPACE_FORMAT`], blended by [`Textures::TEXTURE_SPACE_BLEND`], without culling and without depth. `uv`
    /// is 0 to 1. What is hidden is wanted as well. Of [`SurveySettings`] only the number of pages counts. Costs the GPU at most
    /// 65,536 fragments, whatever the picture's size; to be called once per frame and texture, before [`Textures::update`].
    pub fn texture_space(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        texture: TextureId,
        settings: SurveySettings,
        draw: impl FnOnce(&mut wgpu::RenderPass<'_>, &BindGroups),
    ) -> Result<Option<Feedback>, Error> {
        if self.settings.pace == Pace::Realtime {
            self.poll_device()?;
        }
        let Some(Some(state)) = self.textures.get(usize::from(texture.number())) else { return Ok(None) };
        let geometry = &state.description.geometry;
        let place = match self.texture_spaces.iter().position(|path| path.texture == texture) {
            Some(place) => place,
            None => {
                let target = TextureSpace::new(&self.device, geometry)?;
                self.texture_spaces.push(TextureSpacePath { texture, target, wanted: None });
                self.texture_spaces.len() - 1
            }
        };
        let path = &mut self.texture_spaces[place];
        let arrived = match (self.settings.pace, self.frame.checked_sub(LATENCY)) {
            (Pace::Realtime, _) => path.target.poll()?,
            (Pace::LockStep { .. }, Some(frame)) => path.target.wait(&self.device, &self.queue, frame)?,
            (Pace::LockStep { .. }, None) => None,
        };
        if let Some((frame, levels)) = arrived {
            path.wanted = Some(levels.pages(texture, geometry, settings.max_pages, frame));
        }
        draw(&mut path.target.begin(encoder), &self.views[0].groups);
        path.target.record(encoder, self.frame);
        Ok(path.wanted.clone())
    }

    /// Forgets what was drawn of a texture, or of all.
    pub(crate) fn forget_texture_space(&mut self, texture: Option<TextureId>) {
        self.texture_spaces.retain(|path| texture.is_some_and(|texture| path.texture != texture));
    }
}
