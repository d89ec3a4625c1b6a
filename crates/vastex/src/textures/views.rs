//! Views: the main view and any beside it, one at a time.
//!
//! Each has a feedback target, a way back and a number of its own, so that several can be drawn in one
//! encoder.

use vastex_core::{Feedback, ViewId};

use super::Textures;
use crate::error::Error;
use crate::gpu::{BindGroups, FeedbackPass};
use crate::paging::Convergence;

/// How a view counts among the others.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct ViewSettings {
    /// How much a pixel of the view counts when the order of loading is decided, where one of the main view
    /// counts 1: 1/256 to 256, and 1 by default. A view with a small weight gets all of its pages, too, only
    /// later.
    pub weight: f32,
    /// An upper estimate of the bricks that a ray of the view's shaders meets, if they march rays through
    /// volumes, each of which asks for several bricks; 0, the default, if they show surfaces. See
    /// [`ViewMut::set_bricks_of_a_ray`].
    pub bricks_of_a_ray: u32,
}

impl Default for ViewSettings {
    fn default() -> ViewSettings {
        ViewSettings { weight: 1.0, bricks_of_a_ray: 0 }
    }
}

impl ViewSettings {
    /// Sets the weight.
    pub fn with_weight(self, weight: f32) -> ViewSettings {
        ViewSettings { weight, ..self }
    }

    /// Sets how many bricks a ray meets.
    pub fn with_bricks_of_a_ray(self, bricks: u32) -> ViewSettings {
        ViewSettings { bricks_of_a_ray: bricks, ..self }
    }
}

/// A view, to be asked about itself; returned by [`Textures::view`].
#[derive(Clone, Copy)]
pub struct ViewRef<'a> {
    textures: &'a Textures,
    id: ViewId,
}

/// A view, to be drawn or changed; returned by [`Textures::view_mut`].
pub struct ViewMut<'a> {
    textures: &'a mut Textures,
    id: ViewId,
}

impl Textures {
    /// Adds a view beside the main one: a mirror, a shadow, a second eye, a second window. What any view
    /// wants is loaded.
    ///
    /// Costs a feedback target once it is drawn. Shaders know the view by its [number](ViewRef::number).
    pub fn add_view(&mut self, settings: ViewSettings) -> Result<ViewId, Error> {
        let view = self.paging.add_view(settings.weight)?;
        self.gpu.begin_view(view);
        self.view_mut(view)?.set_bricks_of_a_ray(settings.bricks_of_a_ray);
        Ok(view)
    }

    /// A view, to be asked about itself: [`ViewId::MAIN`] or one that was added. Fails where it was removed.
    pub fn view(&self, view: ViewId) -> Result<ViewRef<'_>, Error> {
        self.check_view(view)?;
        Ok(ViewRef { textures: self, id: view })
    }

    /// A view, to be drawn or changed: [`ViewId::MAIN`], one that was added, or [`ViewId::EXPECTED`], by
    /// which [`Ahead::feedback`](crate::Ahead::feedback) is drawn in a pass of the application's own. Fails
    /// where it was removed.
    pub fn view_mut(&mut self, view: ViewId) -> Result<ViewMut<'_>, Error> {
        self.check_view(view)?;
        if !self.gpu.has_view(view) {
            self.gpu.begin_view(view); // that of what is expected, which few applications draw
        }
        Ok(ViewMut { textures: self, id: view })
    }

    fn check_view(&self, view: ViewId) -> Result<(), Error> {
        let exists = view == ViewId::EXPECTED || self.gpu.has_view(view);
        if exists { Ok(()) } else { Err(Error::NoView(view)) }
    }
}

impl ViewRef<'_> {
    /// The number by which shaders know the view, 0 to 7. [`ViewId::MAIN`] and [`ViewId::EXPECTED`] have 0.
    pub fn number(&self) -> u32 {
        self.textures.gpu.view_number(self.id)
    }

    /// Returns true if the view has been drawn for a whole jitter cycle since it last jumped (a view of rays
    /// for as many as they need, [`ViewMut::set_bricks_of_a_ray`]), and all pages that it wanted in that time
    /// are in the pools at the bias in force, or could not be read; whatever other views want. A view of rays
    /// that rests has also found no gap ([`ViewMut::set_resting`]). A second view from where the camera will
    /// cut to loads what that cut needs, and this says when. Costs a visit of each page of the working sets.
    pub fn is_converged(&self) -> bool {
        let (frame, cycle) = (self.textures.paging.frame(), self.textures.paging.pager().feedback_cycle());
        self.textures.gpu.is_view_seen_whole(self.id, frame, cycle) == Some(true)
            && self.textures.paging.pager().is_view_converged(self.id)
    }
}

impl ViewMut<'_> {
    /// Sets how much a pixel of the view counts, from its next feedback on; see [`ViewSettings::weight`].
    pub fn set_weight(&mut self, weight: f32) {
        self.textures.paging.set_view_weight(self.id, weight);
    }

    /// Sets an upper estimate of the bricks that a ray of the view's shaders meets, if they march rays
    /// through volumes; 0 if they show surfaces, as at first: then what was held for rays that rest is let go
    /// of, and the view does not rest. In a frame each ray asks for up to 8 bricks
    /// (`vastex_ray_turn`), so several jitter cycles, at most 15, are needed until each ray has asked for all
    /// of its bricks: for that long a brick stays wanted, and that long the view must be drawn before it has
    /// converged. Of a ray through more than 120 bricks some may be missing.
    ///
    /// A view of rays shows no surfaces: those need a view of their own. While the camera moves, 8 lets the
    /// view forget bricks as soon as a view of surfaces forgets pages; set the whole number when the camera
    /// rests. A slice needs one brick for each pixel; with 8 its gaps are looked for in 8 passes in place of
    /// 64. Rays say what they want in a feedback pass, whatever the mode. Costs a feedback target with up to
    /// 8 times as many rows as for surfaces, made in the next feedback pass when the number has changed.
    pub fn set_bricks_of_a_ray(&mut self, bricks: u32) {
        if self.textures.gpu.set_bricks_of_a_ray(self.id, bricks) {
            self.textures.paging.set_view_turns(self.id, self.textures.gpu.turns_of(self.id));
            self.set_resting(self.textures.gpu.rests(self.id));
        }
    }

    /// Says that a view of rays ([`ViewMut::set_bricks_of_a_ray`]) sees what it saw in the frame before, or
    /// that it does not, which holds until something is said.
    ///
    /// The jitter cycle looks at a quarter of all pixels, so it may miss a brick that few rays meet. When
    /// a view rests, was seen for one jitter cycle, and all that this has named is there, its next feedback
    /// passes look for *gaps*: in 8 passes, or 64 if a ray meets one brick, each pixel of the picture names
    /// something that is missing on its ray (`vastex_ray_seeks`). Those pages are held until the view does
    /// not rest any more, or is [cut](ViewMut::cut). The view has converged when no pixel finds a gap,
    /// however many bricks its ray meets; the jitter cycles that rays would take otherwise are not waited
    /// for. While something of the view could not be read, the passes are repeated until each pixel has named
    /// whatever else its ray lacks, behind up to 31 such bricks. If shaders begin to show something else, say
    /// once that the view does not rest, so that those pages are let go. Without effect for views that show
    /// surfaces.
    pub fn set_resting(&mut self, rests: bool) {
        let passes = self.textures.gpu.set_resting(self.id, rests);
        self.textures.paging.set_gap_passes(self.id, passes);
    }

    /// Says that the view has jumped: what it wanted before is no hint at what it wants from this frame on.
    /// Other views are not affected.
    pub fn cut(&mut self) {
        self.textures.paging.view_cut(self.id);
        self.textures.gpu.view_cut(self.id);
    }

    /// Removes the view; pages that only it wanted are then out of view. Returns true if it was removed; the
    /// main view never is.
    pub fn remove(self) -> bool {
        let was_there = self.textures.paging.remove_view(self.id);
        if was_there {
            self.textures.gpu.remove_view(self.id);
        }
        was_there
    }

    /// A future of [`ViewRef::is_converged`]: it gives true when that does, false if the view is removed
    /// first. Only [`Textures::update`] drives it.
    pub fn converged(&mut self) -> Convergence {
        self.textures.paging.converged_view(self.id)
    }

    /// Says what the view wants in this frame, in place of [`ViewMut::feedback`]: the result of a
    /// [`survey::Survey`](crate::survey::Survey), or of anything else. It acts in the next
    /// [`Textures::update`], without the frames that feedback takes to be read back; of several calls before
    /// that the last counts. Call it in every frame: pages that were not named for a jitter cycle are no
    /// longer wanted, and the view converges only after a cycle of calls.
    ///
    /// ```no_run
    /// # use vastex::ViewId;
    /// # use vastex::survey::{Camera, GlobeSurface, Survey, SurveySettings};
    /// # fn look(textures: &mut vastex::Textures, earth: vastex::TextureId, clip_from_world: [[f32; 4]; 4]) -> Result<(), vastex::Error> {
    /// let camera = Camera::new(clip_from_world, [1280, 720]);
    /// let mut survey = Survey::new(camera, SurveySettings { unseen: Some(2.0), ..Default::default() });
    /// if let Ok(texture) = textures.texture(earth) {
    ///     survey.surface(texture.surveyed(), &GlobeSurface::sphere([0.0; 3], 6371.0));
    /// }
    /// let found = survey.finish(textures.inspect().frame());
    /// textures.view_mut(ViewId::MAIN)?.want(found.seen); // and no feedback pass
    /// textures.ahead().expect(&found.unseen); // loaded when there is nothing better to do
    /// # Ok(()) }
    /// ```
    pub fn want(&mut self, feedback: Feedback) {
        self.textures.paging.ingest(Feedback { view: self.id, ..feedback });
    }

    /// Draws the feedback pass of the view as [`Textures::feedback`] draws that of the main one: at most once
    /// per frame, by shaders that are given [the view's number](ViewRef::number). A view need not be drawn in
    /// every frame: what it wanted in its last 16 feedbacks stays wanted.
    pub fn feedback(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        picture: [u32; 2],
        draw: impl FnOnce(&mut wgpu::RenderPass<'_>, &BindGroups),
    ) -> Result<(), Error> {
        self.textures.draw_feedback(encoder, self.id, picture, draw)
    }

    /// As [`ViewMut::feedback`], for a pass that the application begins itself, as in a render graph: points
    /// the view's shaders at its feedback target, by a command in `encoder`, and returns what the pass is
    /// begun with. Record this in front of the pass, and [`ViewMut::end_feedback`] behind it, in the same
    /// encoder or in another one that is submitted later; record both before [`Textures::update`], and submit
    /// them whenever you like. `None` if the mode is [`Inline`](crate::FeedbackMode::Inline) and the
    /// view is of surfaces: its main pass says what it wants. A view of rays
    /// ([`ViewSettings::with_bricks_of_a_ray`]) has a pass of its own in every mode. For
    /// [`ViewId::EXPECTED`] it is the pass of [`Ahead::feedback`](crate::Ahead::feedback), which is worth
    /// drawing only if [`Ahead::can_look_ahead`](crate::Ahead::can_look_ahead) is true.
    ///
    /// Fails if the picture has no pixels or too many, if the view's feedback of this frame is recorded
    /// already ([`Error::FeedbackTwice`]), and if the view's previous pass was not ended: what that pass drew
    /// is discarded, and the next call begins anew.
    ///
    /// ```no_run
    /// # use vastex::ViewId;
    /// # fn draw(_: &mut wgpu::RenderPass<'_>) {}
    /// # fn frame(textures: &mut vastex::Textures, encoder: &mut wgpu::CommandEncoder) -> Result<(), vastex::Error> {
    /// if let Some(begun) = textures.view_mut(ViewId::MAIN)?.begin_feedback(encoder, [1280, 720])? {
    ///     let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
    ///         color_attachments: &[Some(begun.color_attachment())],
    ///         depth_stencil_attachment: Some(begun.depth_attachment()),
    ///         ..Default::default()
    ///     });
    ///     let [x, y, width, height] = begun.scissor();
    ///     pass.set_scissor_rect(x, y, width, height);
    ///     draw(&mut pass);
    ///     drop(pass);
    ///     textures.view_mut(ViewId::MAIN)?.end_feedback(encoder)?;
    /// }
    /// # Ok(()) }
    /// ```
    pub fn begin_feedback(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        picture: [u32; 2],
    ) -> Result<Option<FeedbackPass>, Error> {
        let view = self.id;
        if self.textures.gpu.needs_feedback_path(view, picture) {
            self.textures.catch_up()?;
        }
        self.textures.gpu.begin_feedback(encoder, view, picture, self.textures.paging.frame())
    }

    /// Records compaction and read-back of what was drawn in the pass that [`ViewMut::begin_feedback`] was
    /// called for. Fails if there is no such pass.
    pub fn end_feedback(&mut self, encoder: &mut wgpu::CommandEncoder) -> Result<(), Error> {
        self.textures.gpu.end_feedback(encoder, self.id)
    }

    /// Draws the view's picture as [`Textures::main_pass`] draws that of the main one: at most once per
    /// frame, by shaders that are given [the view's number](ViewRef::number).
    pub fn main_pass(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        picture: [u32; 2],
        draw: impl FnOnce(&mut wgpu::CommandEncoder, &BindGroups),
    ) -> Result<(), Error> {
        self.textures.draw_main_pass(encoder, self.id, picture, draw)
    }
}
