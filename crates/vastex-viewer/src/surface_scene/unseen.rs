//! Frames that nobody sees. While a picture stays as it is, what it lacks is found by feedback alone: to draw
//! it again would show the same. What a picture is, and when it is the same, is in [`last_picture`](super::last_picture).

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use vastex::ViewId;
use vastex::diagnostics::FrameStats;

use super::SurfaceScene;
use super::last_picture::{Content, LastPicture};
use super::source::DisplayError;
use crate::beside::Wake;
use crate::camera::Pose;
use crate::stage::{Frame, Pictures, StageView};

/// For so long what is shown of the machine may be old.
const HUD_PAUSE: Duration = Duration::from_millis(250);

impl SurfaceScene {
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
        let hud = &self.beside.hud;
        let is_quiet =
            !hud.is_shown() || !hud.has_news() && self.beside.now().saturating_sub(*at) < HUD_PAUSE;
        if !(is_same && self.keeps_pictures() && is_quiet) {
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
