//! Pictures that are kept: a frame in which only panels change draws nothing of the scene, and each reason
//! for another picture brings one.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use glam::DVec2;
use vastex::{FeedbackMode, LayerFormat, Region};
use vastex_viewer::beside::WindowState;
use vastex_viewer::layers::CompareMode;
use vastex_viewer::stage::{KeptPicture, LinearTarget, Target, TargetKind, TextureRead, depth_view};
use vastex_viewer::surface_scene::FirstDisplay;
use vastex_viewer::{DisplayOptions, LayerOptions, Pose, Scene};

use super::surface_scene::{SIZE, Window};

/// A window whose pictures are others in each frame, and what is kept of them.
struct Host {
    window: Window,
    size: [u32; 2],
    pictures: Vec<wgpu::Texture>,
    depth: wgpu::TextureView,
    kept: Option<KeptPicture>,
    light: Option<LinearTarget>,
    frames: usize,
    /// True if its pictures are stored in another format than they are drawn to.
    is_viewed: bool,
}

impl Host {
    /// A window that shows so many layers of an image in which no two parts are alike.
    fn new(layers: usize, feedback: Option<FeedbackMode>) -> Host {
        let mut window = Window::hearing(DisplayOptions::default(), feedback);
        let settings = window.scene.settings().clone();
        let layers = vec![LayerOptions::default(); layers];
        window.scene.set_first_display(FirstDisplay { layers, settings, is_asked: true });
        let texel = |n: u32| [n * 89 % 251, n / 640 % 256, n % 199, 255].map(|code| code as u8);
        let source = window.source_of((LayerFormat::Rgba8, (0..640 * 480).flat_map(texel).collect()), None);
        window.scene.show_source(1, "a.png", source).unwrap();
        Host::of(window)
    }

    fn of(window: Window) -> Host {
        let depth = depth_view(&window.gpu.device, [1, 1]);
        let (pictures, kept, light) = (Vec::new(), None, None);
        let mut host =
            Host { window, size: [0; 2], pictures, depth, kept, light, frames: 0, is_viewed: false };
        host.resize(SIZE);
        host
    }

    /// The window has another size, or layers need other pictures.
    fn resize(&mut self, size: [u32; 2]) {
        let (device, format) = (&self.window.gpu.device, self.window.scene.format().unwrap());
        let stored = match format.viewed {
            viewed if !self.is_viewed => viewed,
            viewed if viewed.is_srgb() => viewed.remove_srgb_suffix(),
            viewed => viewed.add_srgb_suffix(),
        };
        let picture = || {
            device.create_texture(&wgpu::TextureDescriptor {
                label: Some("window"),
                size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: stored,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT
                    | wgpu::TextureUsages::COPY_SRC
                    | wgpu::TextureUsages::COPY_DST,
                view_formats: &[format.viewed],
            })
        };
        self.pictures = vec![picture(), picture()];
        self.depth = depth_view(device, size);
        let is_light = format.kind == TargetKind::Linear;
        self.kept = (!is_light).then(|| KeptPicture::new(device, size, [stored, format.viewed]));
        self.light = is_light.then(|| LinearTarget::new(device, size, format.viewed));
        if std::mem::replace(&mut self.size, size) != size {
            self.window.scene.resize(size);
        }
    }

    /// A frame from a pose. Gives back its parts.
    fn frame_from(&mut self, pose: Pose) -> Vec<&'static str> {
        self.frames += 1;
        let picture = self.picture();
        let target = Target::new(&picture, &self.depth, self.light.as_ref());
        self.window.parts_of_frame(pose, &target.keeping(self.kept.as_ref()))
    }

    /// The picture of the window that this frame is drawn into.
    fn picture(&self) -> wgpu::TextureView {
        let format = Some(self.window.scene.format().unwrap().viewed);
        let described = wgpu::TextureViewDescriptor { format, ..Default::default() };
        self.pictures[self.frames % 2].create_view(&described)
    }

    fn pose(&self) -> Pose {
        Pose::first(self.window.scene.settings().scene)
    }

    /// Returns true if the next frame draws the scene.
    fn draws(&mut self) -> bool {
        let pose = self.pose();
        self.draws_from(pose)
    }

    fn draws_from(&mut self, pose: Pose) -> bool {
        let parts = self.frame_from(pose);
        let [draws, keeps] = ["picture", "kept"].map(|part| parts.contains(&part));
        assert!(draws != keeps && parts[0] == "feedback", "{parts:?}");
        draws
    }

    /// Frames until the view has settled and nothing of the scene is drawn any more.
    fn settle(&mut self) {
        for _ in 0..2000 {
            let stats = self.window.scene.textures().stats();
            // Pools are made to fit once all is settled.
            let is_settled = self.window.scene.is_settled(&stats);
            if !self.draws() && is_settled {
                return;
            }
        }
        panic!("the picture is drawn in each frame");
    }

    /// The picture of the last frame.
    fn seen(&self) -> Vec<u8> {
        let gpu = &self.window.gpu;
        let encoder = gpu.device.create_command_encoder(&Default::default());
        let read = TextureRead::submit(gpu, encoder, &self.pictures[self.frames % 2], 4);
        let limit = Some(Duration::from_secs(300));
        gpu.device.poll(wgpu::PollType::Wait { submission_index: None, timeout: limit }).unwrap();
        read.take().unwrap().unwrap()
    }

    /// What was changed brings another picture, or one that is the same; a frame after it brings none.
    fn brings(&mut self, why: &str, is_other: bool) {
        let before = self.seen();
        assert!(self.draws(), "{why}: the picture is the one that was kept");
        assert_eq!(self.seen() != before, is_other, "{why}");
        self.settle();
        assert_eq!(self.seen() != before, is_other, "{why}");
    }
}

#[test]
fn a_frame_in_which_only_panels_change_shows_what_was_kept_and_says_what_it_wants() {
    let mut host = Host::new(1, None);
    host.settle();
    let (shown, pages) = (host.seen(), host.window.scene.textures().stats().pager.resident);
    for notice in ["one", "two", "three"] {
        host.window.scene.beside.notify(notice);
        assert!(!host.draws(), "a notice draws the scene");
        assert_eq!(host.seen(), shown);
    }
    // As many frames as the pager looks back: all that is seen is still wanted.
    (0..40).for_each(|_| assert!(!host.draws()));
    let stats = host.window.scene.textures().stats();
    assert!(stats.converged && stats.pager.resident == pages);
    // What was kept is what is drawn.
    host.window.scene.wake();
    host.brings("a change that says nothing of itself", false);
    // A camera that moves copies nothing, and the picture where it stands still is kept.
    assert!((1..4).all(|step| host.draws_from(place(step))));
    assert!(host.draws_from(place(3)), "what was drawn on the way is not kept");
    assert!((0..2000).any(|_| !host.draws_from(place(3))), "a camera that stands has it drawn in each frame");
    assert!(host.draws(), "back at the first place");
    host.settle();
    assert_eq!(host.seen(), shown);
}

#[test]
fn pictures_are_kept_that_are_stored_otherwise_than_they_are_drawn() {
    let mut host = Host::new(1, None);
    host.settle();
    let shown = host.seen();
    host.is_viewed = true;
    host.resize(SIZE);
    host.settle();
    assert!(!host.draws() && host.seen() == shown);
}

#[test]
fn a_frame_that_was_recorded_and_dropped_has_kept_nothing() {
    let mut host = Host::new(1, None);
    host.settle();
    host.window.scene.expose(-1.0);
    let (pose, picture) = (host.pose(), host.picture());
    let target = Target::new(&picture, &host.depth, None).keeping(host.kept.as_ref());
    drop(host.window.scene.record(pose, &target, &mut |_, _| {}).unwrap());
    host.brings("a frame after one that nobody submitted", true);
}

#[test]
fn each_reason_for_another_picture_brings_one() {
    let mut host = Host::new(1, None);
    host.settle();
    host.window.scene.expose(-1.0);
    host.brings("other colours", true);
    host.window.scene.beside.set_window(WindowState { is_dark: true, ..WindowState::default() });
    assert!(host.draws(), "another theme has another ground");
    host.settle();
    // What is read again comes at its time, and says nothing of itself to the scene.
    let texture = host.window.scene.display().displayed().unwrap().textures()[0];
    let mut texture = host.window.scene.textures_mut().texture_mut(texture).unwrap();
    assert!(texture.invalidate(&Region::whole()) > 0);
    assert!((0..2000).any(|_| host.draws()), "tiles that came are not drawn");
    host.settle();
    // Other pictures of the window have nothing in them.
    host.resize(SIZE);
    assert!(host.draws(), "other pictures of the window");
    host.settle();
    host.resize([SIZE[0] + 32, SIZE[1]]);
    assert!(host.draws(), "another size");
    host.settle();
    host.window.scene.put_on(Scene::Globe).unwrap();
    host.brings("another scene", true);
    // A device after a lost one has nothing of what was kept.
    host.window.lose_device();
    let mut host = Host::of(host.window.on_another_device());
    assert!(host.draws(), "another device");
    host.settle();
}

#[test]
fn light_is_kept_of_several_layers_in_panes_and_over_one_another() {
    let mut host = Host::new(2, None);
    assert!(host.light.is_some() && host.kept.is_none());
    let over = host.window.source([10, 20, 30], None);
    host.window.scene.lay_over("b.png", over).unwrap();
    host.settle();
    host.window.scene.put_beside();
    host.brings("panes", true);
    host.window.scene.put_beside();
    host.brings("one picture", true);
    while host.window.scene.settings().options.compare_mode != CompareMode::Flicker(0.5) {
        host.window.scene.compare_next();
        host.settle();
    }
    // Frames of two seconds, in which a layer is seen, and hidden, for half a second.
    let drawn = (0..125).filter(|_| host.draws()).count();
    assert!((3..=5).contains(&drawn), "of a flicker {drawn} pictures are drawn");
}

#[test]
fn rows_of_a_preview_that_come_are_drawn() {
    let mut window = Window::new();
    let rows = Arc::new(AtomicU64::new(100));
    let preview = window.source([200, 100, 50], Some(rows.clone()));
    window.scene.show_preview(1, "a.png", preview).unwrap();
    let mut host = Host::of(window);
    host.settle();
    rows.store(300, Ordering::Relaxed);
    host.window.scene.set_opening("a.png", 0.6).unwrap();
    host.brings("more rows", true);
}

#[test]
fn nothing_is_kept_of_overlays_nor_where_pictures_say_what_they_want() {
    let mut host = Host::new(1, None);
    host.settle();
    host.window.scene.next_overlay();
    for _ in 0..3 {
        let pose = host.pose();
        let parts = host.frame_from(pose);
        assert!(parts.contains(&"overlay") && !parts.contains(&"kept"), "{parts:?}");
    }
    let mut host = Host::new(1, Some(FeedbackMode::Inline));
    assert!((0..40).all(|_| host.draws()));
}

/// A place of a camera on its way over an image.
fn place(step: u32) -> Pose {
    match Pose::first(Scene::Image) {
        Pose::Image { centre, zoom, orientation } => {
            Pose::Image { centre: centre + DVec2::new(0.01 * f64::from(step), 0.0), zoom, orientation }
        }
        other => other,
    }
}
