//! What an application asks for explicitly: prefetches and pins, predictions, and content that changes.

#[cfg(not(target_family = "wasm"))]
use std::time::{Duration, Instant};

use vastex_core::{AskError, Feedback, Region, TextureId, Urgency};
#[cfg(not(target_family = "wasm"))]
use vastex_core::{Progress, TicketState};

use super::Textures;
#[cfg(not(target_family = "wasm"))]
use crate::error::Error;
use crate::paging::Ticket;

impl Textures {
    /// Loads a region of a texture after everything in view, and keeps it until all of it is here or, where there is one, until its
    /// deadline, as long as what is in view leaves slots. A deadline is the number of a frame, as [`Textures::frame`] counts them. Levels
    /// are chosen by the region ([`Region::on_levels`]); their ancestors come with them. What a camera will see is asked for more easily
    /// with [`Textures::prefetch_view`].
    ///
    /// Fails where there is no such texture, and where the region with its ancestors has more pages than the texture's pool has slots beside tails
    /// ([`AskError::TooManyPages`] says how many of each): nothing is asked for then.
    ///
    /// ```no_run
    /// # use vastex::{Region, Urgency};
    /// # fn look_ahead(textures: &mut vastex::Textures, earth: vastex::TextureId) -> Result<(), vastex::AskError> {
    /// // Where the camera will be in two seconds, at 60 frames a second, on levels 2 to 4.
    /// let landing = Region::image(8000..12000, 4000..6000).on_levels(2..=4);
    /// let deadline = Some(textures.frame() + 120);
    /// let ticket = textures.prefetch(earth, &landing, Urgency { priority: 0, deadline })?;
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
        self.paging.prefetch(texture, region, urgency)
    }

    /// Loads what a view will want, before it is drawn: what a [`crate::Survey`] or a [`crate::CpuFeedback`] has found of a camera that is
    /// yet to cut there. Of every texture, after everything in view, coarsest first, at the mip bias in force, and kept as
    /// [`Textures::prefetch`] keeps a region. When the ticket is done, a cut to that view is sharp at once.
    ///
    /// Fails where the pages and their ancestors of one pool are more than the pool has slots beside tails ([`AskError::TooManyPages`]), and then
    /// asks for nothing. Textures that there are not are left out. Costs a visit of each page now and in each frame while the ticket is open.
    ///
    /// ```no_run
    /// # use vastex::{Camera, FlatSurface, Survey, SurveySettings, TicketState, Urgency};
    /// # fn cut(textures: &mut vastex::Textures, ground: vastex::TextureId, surface: &FlatSurface, clip_from_world: [[f32; 4]; 4])
    /// #     -> Result<(), vastex::AskError> {
    /// let mut survey = Survey::new(Camera::new(clip_from_world, [1280, 720]), SurveySettings::default());
    /// if let Some(texture) = textures.surveyed(ground) {
    ///     survey.surface(texture, surface);
    /// }
    /// let ahead = textures.prefetch_view(&survey.finish(textures.frame()).seen, Urgency::default())?;
    /// // ... frames later:
    /// if !ahead.is_open() { /* move the camera, and textures.view_cut() */ }
    /// # Ok(()) }
    /// ```
    pub fn prefetch_view(&mut self, feedback: &Feedback, urgency: Urgency) -> Result<Ticket, AskError> {
        self.paging.prefetch_view(feedback, urgency)
    }

    /// Waits for a ticket: calls [`Textures::update`] until it ends or so much time has passed, and says how far it is then. For loading
    /// screens and tools. Nothing is drawn meanwhile, what views want stays as it was, and frames are counted
    /// ([`Textures::frame`]), so a deadline of the ticket may pass. Events are there to be polled afterwards. Not in a browser, where nothing
    /// may be waited for.
    ///
    /// Fails as an update does; the ticket is still open then.
    #[cfg(not(target_family = "wasm"))]
    pub fn finish(&mut self, ticket: &Ticket, at_most: Duration) -> Result<Progress, Error> {
        /// As often as a fast display has frames, so that the budget of uploads is one of bytes in time.
        const FRAME: Duration = Duration::from_millis(4);
        let begin = Instant::now();
        loop {
            self.update()?;
            let progress = ticket.progress();
            let left = at_most.saturating_sub(begin.elapsed());
            if progress.state != TicketState::Open || left.is_zero() {
                return Ok(progress);
            }
            std::thread::sleep(left.min(FRAME));
        }
    }

    /// Loads a region of a texture and keeps it, whatever the view wants, until its ticket is released: it counts as in view, at every mip
    /// bias.
    ///
    /// Fails where there is no such texture, and where pins, tails included, would take more than their share of the pool's slots
    /// ([`AskError::TooManyPins`], [`crate::PoolTuning::pin_share`]).
    pub fn pin(&mut self, texture: TextureId, region: &Region) -> Result<Ticket, AskError> {
        self.paging.pin(texture, region)
    }

    /// Cancels a prefetch, or unpins. Says whether there was anything to let go of. What has been loaded stays until its slot is
    /// needed.
    pub fn release(&mut self, ticket: &Ticket) -> bool {
        self.paging.release(ticket)
    }

    /// Says what the view is expected to want when tiles that are asked for now will be here: the feedback of a camera that goes
    /// on as it does, for as many frames ahead as a tile takes. To be called once per frame, before [`Textures::update`];
    /// [`crate::CpuFeedback`] makes such a feedback without drawing anything. What is in view comes first, so a prediction
    /// costs nothing where bandwidth is short; see [`vastex_core::Pager::expect`].
    pub fn expect(&mut self, feedback: &Feedback) {
        self.paging.expect(feedback);
    }

    /// The content of a region has changed where it comes from: its resident tiles are read again and replaced where they
    /// are, the old ones staying on screen until then. What caches keep of it is dropped; see [`TileSource::changed`]. Says
    /// how many pages the pager knew of.
    ///
    /// [`TileSource::changed`]: crate::TileSource::changed
    pub fn invalidate(&mut self, texture: TextureId, region: &Region) -> u32 {
        let known = self.paging.invalidate(texture, region);
        if let Some(state) = self.paging.texture(texture) {
            self.cpu.forget(texture, &state.description.geometry, region);
        }
        known
    }
}
