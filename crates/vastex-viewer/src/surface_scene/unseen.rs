//! Frames without a picture of their own. While a picture stays as it is, what it lacks is found by feedback
//! alone, in frames that nobody sees: to draw it again would show the same. Where something over it changes,
//! as panels do below a pointer, a frame is seen and shows the picture that was kept of the last one.
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
//! Nothing is kept of overlays and of previews behind which a source waits, which are drawn otherwise, nor by
//! inline feedback, where pictures say themselves what they want. In all other modes frames say that in a
//! pass of their own, those with a kept picture like any other, so that the pager hears of no difference.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use vastex::diagnostics::FrameStats;
use vastex::{FeedbackMode, ViewId};

use super::SurfaceScene;
use super::source::DisplayError;
use crate::beside::Wake;
use crate::camera::Pose;
use crate::layers::CompareMode;
use crate::stage::{Frame, Pictures, StageView, Target};
use crate::surface::Told;

/// For so long what is shown of the machine may be old.
const HUD_PAUSE: Duration = Duration::from_millis(250);

/// What a picture shows of the textures, and how.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Content {
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
    fn of(stats: &FrameStats, compared: Option<CompareMode>) -> Option<Content> {
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
    of: Option<(Pose, Content)>,
    /// Where the camera was, also if it is to be drawn anew.
    pose: Option<Pose>,
    /// What is kept of it.
    kept: Option<Kept>,
    at: Duration,
    /// True if frames that nobody saw came after it, so that one more picture is owed.
    owes_picture: bool,
    /// Turns true once the GPU is done with the last frame that nobody saw.
    unseen_is_done: Option<Arc<AtomicBool>>,
}

impl LastPicture {
    /// The next picture is another one.
    pub(super) fn forget(&mut self) {
        self.of = None;
    }

    /// Returns true if the camera stands where it was in it.
    pub(super) fn stands(&self, pose: &Pose) -> bool {
        self.pose.as_ref() == Some(pose)
    }

    /// Returns true while the GPU is at work on a frame that nobody is to see.
    fn is_awaited(&self) -> bool {
        self.unseen_is_done.as_ref().is_some_and(|is_done| !is_done.load(Ordering::Acquire))
    }
}

impl SurfaceScene {
    /// What the picture of a frame shows whose textures were updated.
    fn content(&self) -> Option<Content> {
        // As they are compared in it, which was before it was drawn.
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

    /// A picture was drawn, of which something is kept or nothing, or shown again.
    pub(super) fn note_picture(&mut self, pose: Pose, kept: Option<Kept>) {
        let (of, at) = (self.content().map(|content| (pose, content)), self.beside.now());
        let unseen_is_done = self.last_picture.unseen_is_done.take();
        let pose = Some(pose);
        self.last_picture = LastPicture { of, pose, kept, at, owes_picture: false, unseen_is_done };
    }

    /// Returns true if the picture is to be drawn once more, since nobody saw the frames after it: what lies
    /// over it may say more of a view that has settled.
    pub(super) fn owes_picture(&self) -> bool {
        self.last_picture.owes_picture
    }

    /// When a frame of a view is due that has not settled: one that nobody sees, if its picture would be the
    /// last one.
    pub(super) fn unsettled_wake(&self, stats: &FrameStats) -> Wake {
        let LastPicture { of, at, .. } = &self.last_picture;
        let compared = self.comparable().map(|_| self.compared());
        let is_same = of.is_some_and(|(_, content)| Content::of(stats, compared) == Some(content));
        // By inline feedback pictures say themselves what they lack, and overlays show what is wanted.
        let stays_the_same = self.textures.inspect().feedback_mode() != FeedbackMode::Inline
            && self.settings.overlay.is_none()
            && !self.is_empty();
        let hud = &self.beside.hud;
        let is_quiet =
            !hud.is_shown() || !hud.has_news() && self.beside.now().saturating_sub(*at) < HUD_PAUSE;
        if !(is_same && stays_the_same && is_quiet) {
            return Wake::Now;
        }
        Wake::Unseen(self.beside.due_after(self.beside.frame_pause))
    }

    /// A frame that nobody sees ([`Wake::Unseen`]), of a camera where it was in the last picture. Nothing is
    /// drawn while the GPU is at work on the last such frame.
    pub fn draw_unseen(&mut self, pose: Pose) -> Result<(), DisplayError> {
        let is_moved = self.last_picture.of.is_none_or(|(seen, _)| seen != pose);
        let Some(displayed) = self.display.displayed().filter(|_| !is_moved) else {
            self.last_picture.forget();
            return Ok(());
        };
        let since = self.beside.count_unseen_frame();
        if self.last_picture.is_awaited() {
            // Nothing else keeps such frames from piling up before a GPU that takes longer than the pause.
            // Submitting nothing has the device say what it is done with.
            self.gpu.queue.submit([]);
            if self.last_picture.is_awaited() {
                return Ok(());
            }
        }
        if let Some(since) = since {
            self.textures.set_frame_time(since);
        }
        let renderer = &displayed.renderer;
        let views = [StageView { view: ViewId::MAIN, camera: renderer.camera(), pose }];
        let (picture, pictures) = (self.size, Pictures::Never);
        let frame = Frame { views: &views, expected: None, picture, has_feedback: true, pictures };
        let (gpu, textures) = (&self.gpu, &mut self.textures);
        let encoder = frame.record_wanted(gpu, textures, renderer, |_, _| Ok(()), |_, _| {})?;
        self.gpu.queue.submit([encoder.finish()]);
        let is_done = Arc::new(AtomicBool::new(false));
        self.last_picture.unseen_is_done = Some(is_done.clone());
        self.gpu.queue.on_submitted_work_done(move || is_done.store(true, Ordering::Release));
        self.last_picture.owes_picture = true;
        self.count_unsettled();
        Ok(())
    }

    /// One frame fewer is to be drawn before the view may have settled.
    pub(super) fn count_unsettled(&mut self) {
        self.unsettled = self.unsettled.saturating_sub(1);
        if self.unsettled == 0 && self.textures.inspect().settings().picture != self.size {
            self.fit_pools();
        }
    }
}

#[cfg(test)]
mod tests {
    use vastex::{ImageOptions, ImageSource, LayerFormat, Settings, TextureSettings, Textures, TileSource};

    use super::*;
    use crate::gpu::Gpu;
    use crate::hud::Chosen;
    use crate::panels::FileAbout;
    use crate::scene::Scene;
    use crate::surface::DisplayOptions;
    use crate::surface_scene::{DisplaySettings, FirstDisplay, Growth, PictureFormats, PreparedSource};

    fn device() -> (Gpu, PictureFormats) {
        use wgpu::TextureFormat::{Rgba8Unorm, Rgba8UnormSrgb};
        let gpu = pollster::block_on(Gpu::headless()).unwrap();
        let formats = PictureFormats::new(&gpu.adapter, vec![Rgba8UnormSrgb, Rgba8Unorm], Rgba8Unorm);
        (gpu, formats)
    }

    /// A scene that shows an image of one colour.
    fn scene() -> SurfaceScene {
        let (gpu, formats) = device();
        let textures = Textures::new(&gpu.device, &gpu.queue, Settings::default()).unwrap();
        let settings = DisplaySettings {
            scene: Scene::Image,
            options: DisplayOptions::default(),
            overlay: None,
            may_be_crisp: true,
            range_is_free: true,
        };
        let first = FirstDisplay { layers: Vec::new(), settings, is_asked: true };
        let pictures = (formats, [64, 48]);
        let clock = Arc::new(|| Duration::from_secs(1));
        let mut scene = SurfaceScene::new((gpu, textures), pictures, first, Chosen::default(), clock);
        let pixels = vec![255; 4 * 64 * 48];
        let image = ImageSource::new(LayerFormat::Rgba8, [64, 48], pixels, &ImageOptions::default()).unwrap();
        let tiles: Arc<dyn TileSource> = Arc::new(image);
        let prepared = scene.preparer().read_blocking(tiles.clone(), TextureSettings::default()).unwrap();
        let (about, growth) = (FileAbout::default(), Growth::Whole);
        let source = PreparedSource { prepared, tiles, size: [64, 48], about, growth };
        scene.show_source(1, "a.png", source).unwrap();
        scene
    }

    /// The GPU says when it is done with a frame, however long that takes: until then none is drawn.
    #[test]
    fn a_frame_that_nobody_sees_waits_for_the_one_before_it() {
        let (mut scene, pose) = (scene(), Pose::first(Scene::Image));
        scene.note_picture(pose, None);
        let is_done = Arc::new(AtomicBool::new(false));
        scene.last_picture.unseen_is_done = Some(is_done.clone());
        let mut frames = || {
            scene.draw_unseen(pose).unwrap();
            scene.textures.inspect().frame()
        };
        let before = frames();
        assert_eq!(frames(), before, "the GPU is at work");
        is_done.store(true, Ordering::Release);
        assert_eq!(frames(), before + 1);
    }

    /// A device that was lost never says that it is done.
    #[test]
    fn a_restored_scene_waits_for_no_frame_of_the_device_before() {
        let (mut scene, pose) = (scene(), Pose::first(Scene::Image));
        scene.last_picture.unseen_is_done = Some(Arc::default());
        scene.leave_device();
        let (gpu, formats) = device();
        let mut scene = scene.restored(&gpu, formats).unwrap();
        scene.note_picture(pose, None);
        let before = scene.textures.inspect().frame();
        scene.draw_unseen(pose).unwrap();
        assert_eq!(scene.textures.inspect().frame(), before + 1);
    }
}
