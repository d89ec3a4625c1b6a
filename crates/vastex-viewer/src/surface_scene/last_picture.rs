//! The picture that was drawn last, and what is kept of it. Where something over it changes, as panels do
//! below a pointer, a frame shows what was kept and draws nothing of the scene.
//!
//! A picture that is kept ([`KeptPicture`](crate::stage::KeptPicture), or the light that it was encoded from)
//! stands for the one that a frame would draw if nothing is different of all that this would follow from:
//!
//! - the camera's pose;
//! - what the shaders are told ([`Told`]): sizes, panes, places, ranges, colours, lights, rows of a preview
//!   that grows, the theme's ground; and the renderer, which is another one for other layers and filters;
//! - what the textures have ([`Content`]): tiles, page tables, biases, pools, and none that fades in;
//! - where it is kept: another size or format of the window has another place.
//!
//! Whatever changes a picture in yet another way says so ([`SurfaceScene::wake`]), and then it is drawn.
//! Nothing is kept of the first picture from another pose, which another may follow at once, of overlays and
//! of previews behind which a source waits, which are drawn otherwise, nor by inline feedback, where pictures
//! say themselves what they want. In all other modes frames say that in a pass of their own, those with a
//! kept picture like any other, so that the pager hears of no difference. A frame that was recorded and never
//! submitted has kept nothing ([`SurfaceScene::end_frame`]).

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use vastex::FeedbackMode;
use vastex::diagnostics::FrameStats;

use super::SurfaceScene;
use crate::camera::Pose;
use crate::layers::CompareMode;
use crate::stage::Target;
use crate::surface::Told;

/// What a picture shows of the textures, and how.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Content {
    /// Tiles that came and went so far, and bytes of changes of page tables.
    tiles: u64,
    tables: u64,
    /// Levels that it is coarser than wanted, in eighths, mixed of each pool, and bytes of all pools.
    biases: u64,
    pools: u64,
    /// How layers are compared, if they can be: a flicker shows another one after a while.
    compared: Option<CompareMode>,
}

impl Content {
    /// `None` while tiles fade in, and each frame shows something else.
    pub(super) fn of(stats: &FrameStats, compared: Option<CompareMode>) -> Option<Content> {
        let pager = &stats.pager;
        let tiles = pager.loaded + pager.shared + pager.refreshed + pager.evicted;
        let mixed = |all: u64, bias: u16| all.wrapping_mul(1031).wrapping_add(bias.into());
        let biases = stats.pools.iter().fold(0, |all, pool| mixed(all, pool.pager.bias_eighths));
        let (tables, pools) = (stats.table_bytes_sent, stats.pool_bytes);
        (stats.fading == 0).then_some(Content { tiles, tables, biases, pools, compared })
    }
}

/// What a picture that is kept was drawn by, and where it lies.
#[derive(PartialEq)]
pub(super) struct Kept {
    told: Told,
    place: wgpu::TextureView,
}

/// The picture that was drawn last.
#[derive(Default)]
pub(super) struct LastPicture {
    /// Where the camera was and what the textures had; nothing, if it is to be drawn anew.
    pub(super) of: Option<(Pose, Content)>,
    /// Where the camera was, also if it is to be drawn anew.
    pose: Option<Pose>,
    /// What is kept of it.
    kept: Option<Kept>,
    /// What will be, once it is submitted.
    recorded: Option<Kept>,
    pub(super) at: Duration,
    /// True if frames that nobody saw came after it, so that one more picture is owed.
    pub(super) owes_picture: bool,
    /// Turns true once the GPU is done with the last frame that nobody saw.
    pub(super) unseen_is_done: Option<Arc<AtomicBool>>,
}

impl LastPicture {
    /// The next picture is another one.
    pub(super) fn forget(&mut self) {
        (self.of, self.kept, self.recorded) = (None, None, None);
    }

    /// The frame that was recorded is submitted.
    pub(super) fn confirm(&mut self) {
        self.kept = self.recorded.take();
    }

    /// Returns true if the camera stands where it was in it.
    pub(super) fn stands(&self, pose: &Pose) -> bool {
        self.pose.as_ref() == Some(pose)
    }

    /// Returns true while the GPU is at work on a frame that nobody is to see.
    pub(super) fn is_awaited(&self) -> bool {
        self.unseen_is_done.as_ref().is_some_and(|is_done| !is_done.load(Ordering::Acquire))
    }
}

impl SurfaceScene {
    /// Returns true if pictures are kept of a camera that stands: surfaces are displayed, without an overlay,
    /// which hides the picture and shows what is wanted, and not by inline feedback, where pictures say
    /// themselves what they lack.
    pub fn keeps_pictures(&self) -> bool {
        let is_inline = self.textures.inspect().feedback_mode() == FeedbackMode::Inline;
        !is_inline && self.settings.overlay.is_none() && self.display.displayed().is_some()
    }

    /// What the picture of a frame shows whose textures were updated.
    pub(super) fn content(&self) -> Option<Content> {
        // As layers were compared when it was drawn; how they are to be compared by now, `unsettled_wake`
        // asks.
        let compared = self.comparable().map(|layers| layers.compare_mode());
        Content::of(&self.textures.stats(), compared)
    }

    /// What will be kept of a picture that is drawn into a target now, with the camera in its place.
    pub(super) fn kept_in(&self, target: &Target<'_>) -> Option<Kept> {
        let (told, place) = (self.display.displayed()?.renderer.told(), target.lasting()?.clone());
        Some(Kept { told, place })
    }

    /// Returns true if the picture that would be kept of a frame is the one that is kept already. To be asked
    /// after the update of the textures, of frames that may show one that is kept.
    pub(super) fn is_kept(&self, pose: Pose, kept: &Kept) -> bool {
        let LastPicture { of, kept: last, .. } = &self.last_picture;
        let content = self.content();
        content.is_some_and(|content| *of == Some((pose, content))) && last.as_ref() == Some(kept)
    }

    /// A picture was recorded, of which something is kept or nothing, or shown again.
    pub(super) fn note_picture(&mut self, pose: Pose, recorded: Option<Kept>) {
        let (of, at) = (self.content().map(|content| (pose, content)), self.beside.now());
        let unseen_is_done = self.last_picture.unseen_is_done.take();
        let pose = Some(pose);
        self.last_picture =
            LastPicture { of, pose, kept: None, recorded, at, owes_picture: false, unseen_is_done };
    }
}
