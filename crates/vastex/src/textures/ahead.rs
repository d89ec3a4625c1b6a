//! Ahead of time: what an application asks for before a view wants it, explicitly, or as what a moving camera
//! is expected to see.
//!
//! What is in view comes first, whatever is asked for here (`vastex_core::Pager`).

use vastex_core::{AskError, Feedback, Region, SurveySettings, TextureNumber, Urgency, ViewId};

use super::Textures;
use crate::error::Error;
use crate::gpu::{BindGroups, FEEDBACK_FRAMES};
use crate::ids::TextureId;
use crate::paging::Ticket;

/// Frames that a tile is thought to take before any has come.
const FIRST_GUESS: u64 = 4;

/// Requests ahead of what views want; returned by [`Textures::ahead`].
pub struct Ahead<'a> {
    pub(super) textures: &'a mut Textures,
}

impl Textures {
    /// Requests ahead of what views want: prefetches and pins, what a moving camera is expected to see, and
    /// the traces that prefetch sets are learnt from.
    pub fn ahead(&mut self) -> Ahead<'_> {
        Ahead { textures: self }
    }
}

impl Ahead<'_> {
    fn number(&self, texture: TextureId) -> Result<TextureNumber, AskError> {
        self.textures.number(texture).ok_or(AskError::NoTexture(texture.number().number()))
    }

    /// Loads a region of a texture after everything in view, and keeps it until all of it is loaded or, if
    /// there is one, until its deadline, as long as pages in view leave slots. A deadline is the number of a
    /// frame, as [`Inspect::frame`](crate::Inspect::frame) counts them. The region chooses the levels
    /// ([`Region::on_levels`]); their ancestors come with them. For what a camera will see,
    /// [`Ahead::prefetch_view`] is easier.
    ///
    /// Fails, and requests nothing, if there is no such texture, or if the region with its ancestors has more
    /// pages than the texture's pool has slots beside tails ([`AskError::TooManyPages`] says how many of
    /// each).
    ///
    /// ```no_run
    /// # use vastex::{Region, Urgency};
    /// # fn look_ahead(textures: &mut vastex::Textures, earth: vastex::TextureId) -> Result<(), vastex::AskError> {
    /// // Where the camera will be in two seconds, at 60 frames a second, on levels 2 to 4.
    /// let landing = Region::image(8000..12000, 4000..6000).on_levels(2..=4);
    /// let deadline = Some(textures.inspect().frame() + 120);
    /// let ticket = textures.ahead().prefetch(earth, &landing, Urgency { priority: 0, deadline })?;
    /// // ... frames later: ticket.progress(), or ticket.await
    /// # let _ = ticket;
    /// # Ok(()) }
    /// ```
    pub fn prefetch(
        &mut self,
        texture: TextureId,
        region: &Region,
        urgency: Urgency,
    ) -> Result<Ticket, AskError> {
        let number = self.number(texture)?;
        self.textures.paging.prefetch(number, region, urgency)
    }

    /// Loads what a view will want, before it is drawn: what a [`survey::Survey`](crate::survey::Survey) or a
    /// [`CpuFeedback`](crate::CpuFeedback) has found for a camera before it cuts there. The pages of every
    /// texture are loaded after everything in view, coarsest first, at the mip bias in force, and kept as
    /// [`Ahead::prefetch`] keeps a region. Once the ticket is done, a cut to that view is sharp at once.
    ///
    /// Fails, and requests nothing, if the pages and their ancestors in one pool are more than the pool has
    /// slots beside tails ([`AskError::TooManyPages`]). Textures that do not exist are left out. Costs a
    /// visit of each page now and in each frame while the ticket is open.
    ///
    /// ```no_run
    /// # use vastex::{TicketState, Urgency};
    /// # use vastex::survey::{Camera, FlatSurface, Survey, SurveySettings};
    /// # fn cut(textures: &mut vastex::Textures, ground: vastex::TextureId, surface: &FlatSurface, clip_from_world: [[f32; 4]; 4])
    /// #     -> Result<(), Box<dyn std::error::Error>> {
    /// let mut survey = Survey::new(Camera::new(clip_from_world, [1280, 720]), SurveySettings::default());
    /// if let Ok(texture) = textures.texture(ground) {
    ///     survey.surface(texture.surveyed(), surface);
    /// }
    /// let seen = survey.finish(textures.inspect().frame()).seen;
    /// let ahead = textures.ahead().prefetch_view(&seen, Urgency::default())?;
    /// // ... frames later:
    /// if !ahead.is_open() { /* move the camera, and textures.view_mut(ViewId::MAIN)?.cut() */ }
    /// # Ok(()) }
    /// ```
    pub fn prefetch_view(&mut self, feedback: &Feedback, urgency: Urgency) -> Result<Ticket, AskError> {
        self.textures.paging.prefetch_view(feedback, urgency)
    }

    /// Loads a region of a texture and keeps it, whatever the view wants, until its ticket is released: it
    /// counts as in view, at every mip bias.
    ///
    /// Fails where there is no such texture, and where pins, tails included, would take more than their share
    /// of the pool's slots ([`AskError::TooManyPins`],
    /// [`PoolTuning::pin_share`](crate::PoolTuning::pin_share)).
    pub fn pin(&mut self, texture: TextureId, region: &Region) -> Result<Ticket, AskError> {
        let number = self.number(texture)?;
        self.textures.paging.pin(number, region)
    }

    /// Cancels a prefetch, or unpins. Returns true if there was anything to release, false for a ticket of
    /// other textures. Pages that were loaded stay until their slots are needed.
    pub fn release(&mut self, ticket: &Ticket) -> bool {
        self.textures.paging.release(ticket)
    }

    /// Says what the view is expected to want by the time that tiles requested now have arrived: the feedback
    /// of a camera that goes on moving as it does, for as many frames ahead as a tile takes. To be called
    /// once per frame, before [`Textures::update`]; [`CpuFeedback`](crate::CpuFeedback) makes such a feedback
    /// without drawing anything. Pages in view come first, so a prediction costs nothing when bandwidth is
    /// short.
    pub fn expect(&mut self, feedback: &Feedback) {
        self.textures.paging.expect(feedback);
    }

    /// How many frames ahead a camera should be predicted: 2 that feedback takes, and the frames within which
    /// 95 % of the last tiles have come after their request (4 before any has).
    /// [`prefetch::Motion`](crate::prefetch::Motion) computes where a camera will be then.
    pub fn frames(&self) -> u64 {
        FEEDBACK_FRAMES + self.textures.paging.pager().arrival_frames().map_or(FIRST_GUESS, u64::from)
    }

    /// Returns true if [`Ahead::feedback`] would draw: it does not while pages in view wait for the in-flight
    /// budget.
    pub fn can_look_ahead(&self) -> bool {
        !self.textures.paging.pager().is_short_of_bandwidth()
    }

    /// Draws the view expected in [`Ahead::frames`] frames as [`Textures::feedback`] draws the present one,
    /// but at a quarter of the cost; its pages are loaded after everything in view. At most once per frame,
    /// with the bind groups that `draw` is given. If bandwidth is short for the view itself, it draws
    /// nothing, and costs nothing; returns true if it has drawn. Not inside a pass of the main view that was
    /// begun and not ended, since shaders know both by the same number ([`Error::FeedbackNotEnded`]; that
    /// pass is then discarded).
    ///
    /// ```no_run
    /// # fn draw(_: &mut wgpu::RenderPass<'_>, _: Option<&wgpu::BindGroup>, _camera: [f64; 3]) {}
    /// # fn frame(textures: &mut vastex::Textures, encoder: &mut wgpu::CommandEncoder, earth: vastex::TextureId,
    /// #     before: [[f64; 3]; 2], now: [f64; 3]) -> Result<(), vastex::Error> {
    /// textures.feedback(encoder, [1280, 720], |pass, groups| draw(pass, groups.get(earth), now))?;
    /// let motion = vastex::prefetch::Motion::through([before[0], before[1], now]);
    /// let then = motion.position_after(textures.ahead().frames() as f64);
    /// textures.ahead().feedback(encoder, [1280, 720], |pass, groups| draw(pass, groups.get(earth), then))?;
    /// textures.update()?;
    /// # Ok(()) }
    /// ```
    pub fn feedback(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        picture: [u32; 2],
        draw: impl FnOnce(&mut wgpu::RenderPass<'_>, &BindGroups),
    ) -> Result<bool, Error> {
        let can = self.can_look_ahead();
        if can {
            self.textures.view_mut(ViewId::EXPECTED)?.feedback(encoder, picture, draw)?;
        }
        Ok(can)
    }

    /// Draws the level that the view needs of each part of a texture, in texture space, and returns what the
    /// view wants by the last such drawing that was read back, about two frames old: nothing in the first
    /// frames. Fails if there is no such texture. Give the result to [`ViewMut::want`](crate::ViewMut::want),
    /// or beside feedback to [`Ahead::expect`]; join those of several textures by [`Feedback::of_pages`].
    ///
    /// `draw` draws every surface that shows the texture, with a pipeline whose vertex shader gives
    /// `vastex_texture_space_clip(uv)` as the position and the picture's clip position to its fragment
    /// shader, which returns `vastex_texture_space(id, uv, clip, picture)`; into
    /// [`Textures::TEXTURE_SPACE_FORMAT`], blended by [`Textures::TEXTURE_SPACE_BLEND`], without culling and
    /// without depth. `uv` is 0 to 1. What is hidden is wanted as well. Of [`SurveySettings`] only the number
    /// of pages counts. Costs the GPU at most 65,536 fragments, whatever the picture's size; to be called
    /// once per frame and texture, before [`Textures::update`].
    pub fn texture_space(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        texture: TextureId,
        settings: SurveySettings,
        draw: impl FnOnce(&mut wgpu::RenderPass<'_>, &BindGroups),
    ) -> Result<Option<Feedback>, Error> {
        let Textures { paging, gpu, .. } = &mut *self.textures;
        let number = texture.number();
        let state = paging.texture(number).filter(|_| gpu.has(texture)).ok_or(Error::NoTexture(texture))?;
        let of = (number, &state.description.geometry);
        gpu.texture_space(encoder, of, settings.max_pages, paging.frame(), draw)
    }
}
