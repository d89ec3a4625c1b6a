//! What a view wants, as an application says it without a feedback pass.

use vastex_core::{Feedback, SurveyedTexture, TextureId};

use super::Textures;

impl Textures {
    /// Says what a view wants in this frame, in place of [`Textures::feedback`]: what a [`crate::Survey`] has found, or anything
    /// else that knows. The main view, unless [`Feedback::view`] names another. It acts in the next [`Textures::update`], without
    /// the frames that feedback takes to come back; said again before, the last counts. To be said once per frame, since what
    /// was not said for a jitter cycle is no longer wanted, and only what was said for one can have converged.
    ///
    /// ```no_run
    /// # use vastex::{Camera, GlobeSurface, Survey, SurveySettings};
    /// # fn look(textures: &mut vastex::Textures, earth: vastex::TextureId, clip_from_world: [[f32; 4]; 4]) {
    /// let camera = Camera::new(clip_from_world, [1280, 720]);
    /// let mut survey = Survey::new(camera, SurveySettings { unseen: Some(2.0), ..Default::default() });
    /// if let Some(texture) = textures.surveyed(earth) {
    ///     survey.surface(texture, &GlobeSurface::sphere([0.0; 3], 6371.0));
    /// }
    /// let found = survey.finish(textures.frame());
    /// textures.want(found.seen);      // and no feedback pass
    /// textures.expect(&found.unseen); // loaded when there is nothing better to do
    /// # }
    /// ```
    pub fn want(&mut self, feedback: Feedback) {
        self.paging.say(feedback);
    }

    /// A texture as a survey needs it, with the rule by which its levels are chosen.
    pub fn surveyed(&self, texture: TextureId) -> Option<SurveyedTexture<'_>> {
        let geometry = &self.paging.texture(texture)?.description.geometry;
        Some(SurveyedTexture { number: texture, geometry, rule: self.gpu.rule(texture)? })
    }
}
