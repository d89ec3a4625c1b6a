//! A scene in a window without a window: sources come, frames are drawn, panels run, and at rest none is due.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use egui::{Context, Pos2, RawInput, Rect};
use vastex::{
    FeedbackMode, ImageOptions, ImageSource, LayerFormat, Settings, TextureSettings, Textures, TileSource,
};
use vastex_viewer::beside::Wake;
use vastex_viewer::hud::Chosen;
use vastex_viewer::input::Action;
use vastex_viewer::layers::CompareMode;
use vastex_viewer::panels::{FileAbout, PanelPainter};
use vastex_viewer::stage::{Canvas, Target, TargetKind, TextureRead};
use vastex_viewer::surface_scene::{
    DisplayError, DisplaySettings, FirstDisplay, Growth, PictureFormats, PreparedSource, SurfaceScene,
};
use vastex_viewer::window_scene::{ShownVolume, WindowScene};
use vastex_viewer::{DisplayOptions, Gpu, Pose, Scene, ViewText};

/// Pixels of the window, and points as well.
pub(crate) const SIZE: [u32; 2] = [128, 96];
/// Columns and rows of the image.
const IMAGE: [u32; 2] = [640, 480];
/// From frame to frame.
const STEP: u64 = 16;

pub(crate) struct Window {
    pub(crate) gpu: Gpu,
    pub(crate) scene: SurfaceScene,
    /// What is shown in its place.
    pub(crate) volume: Option<ShownVolume>,
    pub(crate) formats: PictureFormats,
    context: Context,
    painter: PanelPainter,
    /// The host's clock, in milliseconds.
    pub(crate) time: Arc<AtomicU64>,
    /// True if egui wants to run.
    pub(crate) panels_are_due: bool,
}

impl Window {
    pub(crate) fn new() -> Window {
        Window::showing(DisplayOptions::default())
    }

    /// One that shows what it shows in such a way.
    pub(crate) fn showing(options: DisplayOptions) -> Window {
        Window::hearing(options, None)
    }

    /// One that hears what it lacks by such feedback.
    pub(crate) fn hearing(options: DisplayOptions, feedback: Option<FeedbackMode>) -> Window {
        use wgpu::TextureFormat::{Rgba8Unorm, Rgba8UnormSrgb};
        let gpu = pollster::block_on(Gpu::headless()).unwrap();
        let settings = Settings { fade: Duration::ZERO, feedback, ..Settings::default() };
        let textures = Textures::new(&gpu.device, &gpu.queue, settings).unwrap();
        let formats = PictureFormats::new(&gpu.adapter, vec![Rgba8UnormSrgb, Rgba8Unorm], Rgba8Unorm);
        let settings = DisplaySettings {
            scene: Scene::Image,
            options,
            overlay: None,
            may_be_crisp: true,
            range_is_free: true,
        };
        let first = FirstDisplay { layers: Vec::new(), settings, is_asked: true };
        let time = Arc::new(AtomicU64::new(1000));
        let clock = {
            let time = time.clone();
            Arc::new(move || Duration::from_millis(time.load(Ordering::Relaxed)))
        };
        let pictures = (formats.clone(), SIZE);
        let scene = SurfaceScene::new((gpu.clone(), textures), pictures, first, Chosen::default(), clock);
        let (context, painter) = (Context::default(), PanelPainter::default());
        Window { gpu, scene, volume: None, formats, context, painter, time, panels_are_due: false }
    }

    /// The window goes on with another device, as after the loss of this one.
    pub(crate) fn on_another_device(mut self) -> Window {
        self.scene.leave_device();
        self.painter.forget_device();
        self.gpu = pollster::block_on(Gpu::headless()).unwrap();
        self.scene = self.scene.restored(&self.gpu, self.formats.clone()).unwrap();
        self.volume.iter_mut().for_each(|volume| volume.restore(&self.gpu, &self.formats).unwrap());
        self
    }

    /// The device is lost: in the next frame nothing panics, and a host that asks hears of it.
    pub(crate) fn lose_device(&mut self) {
        self.gpu.device.destroy();
        self.volume.iter_mut().for_each(ShownVolume::refresh);
        let pose = Pose::first(self.scene.settings().scene);
        let canvas = Canvas::new(&self.gpu, SIZE, wgpu::TextureFormat::Rgba8Unorm, TargetKind::Direct);
        let mut shown = WindowScene::of(&mut self.scene, self.volume.as_mut());
        let begun = shown.begin_frame((pose, true), &mut self.painter).map_err(DisplayError::from);
        let drawn = begun.and_then(|_| shown.record(pose, &canvas.target(), &mut |_, _| {}).map(drop));
        assert!(drawn.err().is_none_or(|error| error.is_device_lost()));
        assert!(shown.textures().inspect().check_device().is_err());
    }

    /// An image of one colour, as a host hands it over; one that grows has so many of its rows.
    pub(crate) fn source(&self, color: [u8; 3], rows: Option<Arc<AtomicU64>>) -> PreparedSource {
        let [r, g, b] = color;
        let pixels = [r, g, b, 255].repeat((IMAGE[0] * IMAGE[1]) as usize);
        self.source_of((LayerFormat::Rgba8, pixels), rows)
    }

    /// An image of such pixels, as a host hands it over.
    pub(crate) fn source_of(
        &self,
        (format, pixels): (LayerFormat, Vec<u8>),
        rows: Option<Arc<AtomicU64>>,
    ) -> PreparedSource {
        let image = ImageSource::new(format, IMAGE, pixels, &ImageOptions::default()).unwrap();
        let tiles: Arc<dyn TileSource> = Arc::new(image);
        let prepared = self.scene.preparer().read_blocking(tiles.clone(), TextureSettings::default());
        let growth = match rows {
            None => Growth::Whole,
            Some(rows) => Growth::Rows(Arc::new(move || rows.load(Ordering::Relaxed) as u32)),
        };
        PreparedSource {
            prepared: prepared.unwrap(),
            tiles,
            size: IMAGE,
            about: FileAbout::default(),
            growth,
        }
    }

    /// What is shown.
    pub(crate) fn shown(&mut self) -> WindowScene<'_> {
        WindowScene::of(&mut self.scene, self.volume.as_mut())
    }

    /// A frame as a host draws it, whatever is shown; gives back a pixel of the picture, or `None` where the
    /// frame need not be drawn.
    pub(crate) fn pixel_of_frame(&mut self, [x, y]: [u32; 2]) -> Option<[u8; 4]> {
        self.time.fetch_add(STEP, Ordering::Relaxed);
        let pose = Pose::first(self.scene.settings().scene);
        let mut shown = WindowScene::of(&mut self.scene, self.volume.as_mut());
        if !shown.begin_frame((pose, self.panels_are_due), &mut self.painter).unwrap() {
            return None;
        }
        let format = shown.format().unwrap().clone();
        let canvas = Canvas::new(&self.gpu, SIZE, format.viewed, format.kind);
        run_panels(&mut shown, pose, (&self.context, &mut self.painter));
        let recorded = shown.record(pose, &canvas.target(), &mut |_, _| {}).unwrap();
        let encoder = || self.gpu.device.create_command_encoder(&Default::default());
        let mut encoder = recorded.unwrap_or_else(encoder);
        let view = canvas.picture().create_view(&Default::default());
        self.painter.paint(&self.gpu, &mut encoder, (&view, format.viewed), SIZE);
        let read = TextureRead::submit(&self.gpu, encoder, canvas.picture(), 4);
        let limit = Some(Duration::from_secs(300));
        self.gpu.device.poll(wgpu::PollType::Wait { submission_index: None, timeout: limit }).unwrap();
        shown.end_frame();
        let pixels = read.take().unwrap().unwrap();
        Some(pixels.as_chunks::<4>().0[(y * SIZE[0] + x) as usize])
    }

    /// A frame of surfaces into a target of a host's own, without its panels. Gives back its parts.
    pub(crate) fn parts_of_frame(&mut self, pose: Pose, target: &Target<'_>) -> Vec<&'static str> {
        self.time.fetch_add(STEP, Ordering::Relaxed);
        let mut shown = WindowScene::of(&mut self.scene, None);
        shown.begin_frame((pose, true), &mut self.painter).unwrap();
        run_panels(&mut shown, pose, (&self.context, &mut self.painter));
        let mut parts = Vec::new();
        let encoder = shown.record(pose, target, &mut |_, part| parts.extend(part)).unwrap().unwrap();
        self.gpu.queue.submit([encoder.finish()]);
        let limit = Some(Duration::from_secs(300));
        self.gpu.device.poll(wgpu::PollType::Wait { submission_index: None, timeout: limit }).unwrap();
        shown.end_frame();
        parts
    }

    /// A frame of surfaces; gives back a pixel of the picture that nothing lies over, in the middle near the
    /// top.
    fn frame(&mut self) -> [u8; 4] {
        self.pixel_of_frame([SIZE[0] / 2, 10]).unwrap()
    }

    /// When the next frame is due.
    pub(crate) fn next_frame(&mut self, awake: bool) -> Wake {
        self.shown().next_frame(awake, None)
    }

    /// Frames until none is due at once any more. Gives back that pixel of the last one.
    pub(crate) fn settle(&mut self) -> [u8; 4] {
        self.settle_by(Window::frame).0
    }

    /// Frames until none is due any more that the view needs, which `draw` draws where somebody sees them.
    /// Gives back what it gave last, and how many were seen and unseen.
    fn settle_by<T>(&mut self, mut draw: impl FnMut(&mut Window) -> T) -> (T, [usize; 2]) {
        let (mut seen, mut frames) = (draw(self), [1, 0]);
        while frames.iter().sum::<usize>() < 2000 {
            match self.next_frame(false) {
                Wake::Now => {
                    seen = draw(self);
                    frames[0] += 1;
                }
                Wake::Unseen(pause) => {
                    self.time.fetch_add(pause.as_millis() as u64, Ordering::Relaxed);
                    self.draw_unseen();
                    frames[1] += 1;
                }
                Wake::After(_) | Wake::OnEvent => return (seen, frames),
            }
        }
        panic!("the picture does not settle");
    }

    /// A frame that nobody sees.
    fn draw_unseen(&mut self) {
        let pose = Pose::first(self.scene.settings().scene);
        self.shown().draw_unseen(pose).unwrap();
        let limit = Some(Duration::from_secs(300));
        self.gpu.device.poll(wgpu::PollType::Wait { submission_index: None, timeout: limit }).unwrap();
    }
}

/// egui runs once, as a host has it run.
fn run_panels(shown: &mut WindowScene<'_>, pose: Pose, (context, painter): (&Context, &mut PanelPainter)) {
    shown.show_panels(pose, (&[], &[]), |show| {
        let size = SIZE.map(|side| side as f32);
        let screen_rect = Some(Rect::from_min_size(Pos2::ZERO, size.into()));
        let mut output = context.run_ui(RawInput { screen_rect, ..RawInput::default() }, show);
        painter.take(context, &mut output);
        output.textures_delta.clear();
    });
}

#[test]
fn a_window_shows_a_source_and_what_is_said_and_rests() {
    let mut window = Window::new();
    assert!(window.scene.is_empty() && window.scene.format().is_none());
    assert_eq!(window.next_frame(false), Wake::OnEvent);
    let source = window.source([200, 100, 50], None);
    assert_eq!(window.scene.show_source(1, "a.png", source).unwrap(), Scene::Image);
    assert_eq!(window.next_frame(false), Wake::Now);
    assert_eq!(window.settle(), [200, 100, 50, 255]);
    assert_eq!(window.next_frame(false), Wake::OnEvent);
    let stats = window.scene.textures().stats();
    let title = window.shown().title(&stats, Pose::first(Scene::Image)).map(str::to_owned);
    assert!(title.is_some_and(|title| title.starts_with("a.png – ")));
    // What is said is seen in the next frame and for some seconds, and said elsewhere too.
    window.scene.announce("it is so");
    assert_eq!(window.scene.beside.take_log(), ["a.png: it is so"]);
    assert_eq!(window.settle(), [200, 100, 50, 255]);
    let Wake::After(left) = window.next_frame(false) else { panic!("it stays for good") };
    assert!(left > Duration::from_secs(5));
    window.time.fetch_add(left.as_millis() as u64 + 1, Ordering::Relaxed);
    assert_eq!(window.next_frame(false), Wake::After(Duration::ZERO));
    window.settle();
    assert_eq!(window.next_frame(false), Wake::OnEvent);
    // A terrain needs heights, and what goes wrong leaves all as it was.
    assert!(window.scene.put_on(Scene::Terrain).is_err());
    assert_eq!((window.scene.settings().scene, window.settle()), (Scene::Image, [200, 100, 50, 255]));
    window.scene.beside.set_hidden(true);
    assert_eq!(window.next_frame(true), Wake::SLOWLY);
}

/// A frame costs what a picture costs, and a view needs two dozen after each change: a whole jitter cycle of
/// feedback. Where the picture is the same, that is looked at without it.
#[test]
fn a_picture_that_stays_as_it_is_is_not_drawn_while_it_is_asked_what_it_lacks() {
    let mut window = Window::new();
    let source = window.source([200, 100, 50], None);
    window.scene.show_source(1, "a.png", source).unwrap();
    let (color, [seen, unseen]) = window.settle_by(Window::frame);
    assert_eq!(color, [200, 100, 50, 255]);
    assert!(unseen >= 12 && seen <= 8, "{seen} frames are seen, {unseen} are not");
    assert!(window.scene.textures().stats().converged);
    // What changes is seen at once, and so is the last frame, whose panels know that the view has settled.
    window.scene.expose(-1.0);
    assert_eq!(window.next_frame(false), Wake::Now);
    let changed = window.frame();
    assert!(changed[0] < color[0]);
    let Wake::Unseen(pause) = window.next_frame(false) else { panic!("the picture is drawn again") };
    assert!(pause <= Duration::from_millis(16));
    // They come as often as the display shows frames, where that is known.
    for (rate, expected) in [
        (Some(144_000), 6_944),
        (Some(30_000), 33_333),
        (Some(0), 16_000),
        (Some(75_000), 13_333),
        (None, 16_000),
    ] {
        window.scene.beside.set_refresh_rate(rate);
        let Wake::Unseen(pause) = window.next_frame(false) else { panic!("the picture is drawn again") };
        assert_eq!(pause.as_micros(), expected, "{rate:?}");
    }
    let (color, [seen, unseen]) = window.settle_by(Window::frame);
    assert_eq!(color, changed);
    assert!(unseen >= 12 && seen <= 3, "{seen} frames are seen, {unseen} are not");
    // A camera elsewhere has another picture, and is told by nobody before.
    window.scene.wake();
    window.frame();
    assert!(matches!(window.next_frame(false), Wake::Unseen(_)));
    window.shown().draw_unseen(Pose::first(Scene::Plane)).unwrap();
    assert_eq!(window.next_frame(false), Wake::Now);
    // An overlay shows what is wanted, in each frame.
    window.settle();
    window.scene.next_overlay();
    window.scene.wake();
    let (_, [seen, unseen]) = window.settle_by(Window::frame);
    assert!(seen >= 24 && unseen == 0, "{seen} frames are seen, {unseen} are not");
}

/// While what the machine does is shown, its graphs go on, if not in each frame.
#[test]
fn what_the_machine_does_is_seen_while_a_view_settles() {
    let mut window = Window::new();
    let source = window.source([200, 100, 50], None);
    window.scene.show_source(1, "a.png", source).unwrap();
    window.shown().perform(&Action::Hud);
    window.settle();
    window.scene.wake();
    window.frame();
    let (mut unseen, mut waited) = (0, Duration::ZERO);
    while let Wake::Unseen(pause) = window.next_frame(false) {
        window.time.fetch_add(pause.as_millis() as u64, Ordering::Relaxed);
        window.draw_unseen();
        (unseen, waited) = (unseen + 1, waited + pause);
    }
    assert_eq!(window.next_frame(false), Wake::Now);
    assert!(!window.scene.beside.is_busy(), "the frame before was seen by nobody");
    assert!(unseen > 2 && waited < Duration::from_millis(300), "{unseen} frames in {waited:?}");
}

/// What changes by itself is seen at its time, also where a host comes late and where a view settles.
#[test]
fn a_flicker_is_seen_while_a_view_settles() {
    let compare_mode = CompareMode::Flicker(0.5);
    let mut window = Window::showing(DisplayOptions { compare_mode, ..DisplayOptions::default() });
    let source = window.source([200, 100, 50], None);
    window.scene.show_source(1, "a.png", source).unwrap();
    let late = |window: &mut Window| {
        window.settle();
        // The layer has just begun to be shown, so that its turn is not over before that of the next frame.
        let time = window.time.load(Ordering::Relaxed);
        window.time.store(time.next_multiple_of(1000), Ordering::Relaxed);
        window.scene.wake();
        window.frame();
        assert!(matches!(window.next_frame(false), Wake::Unseen(_)));
        window.time.fetch_add(500, Ordering::Relaxed);
        window.next_frame(false)
    };
    assert!(matches!(late(&mut window), Wake::Unseen(_)), "one layer alone does not flicker");
    let over = window.source([10, 20, 30], None);
    window.scene.lay_over("b.png", over).unwrap();
    assert_eq!(late(&mut window), Wake::Now);
}

/// Frames that nobody sees wait for one another, and hear by themselves of what the device is done with.
#[test]
fn a_view_settles_by_unseen_frames_whose_device_nobody_asks() {
    let mut window = Window::new();
    let source = window.source([200, 100, 50], None);
    window.scene.show_source(1, "a.png", source).unwrap();
    window.settle();
    window.scene.wake();
    window.frame();
    let mut looks = 0;
    while let Wake::Unseen(_) = window.next_frame(false) {
        window.shown().draw_unseen(Pose::first(Scene::Image)).unwrap();
        std::thread::sleep(Duration::from_millis(1));
        looks += 1;
        assert!(looks < 60_000, "the view does not settle");
    }
    assert_eq!(window.next_frame(false), Wake::Now, "a picture is owed");
    assert!(window.scene.textures().stats().converged && looks > 8, "after {looks}");
    window.settle();
}

/// What was read is read no more, and what was chosen stays.
#[test]
fn surfaces_are_shown_as_they_were_after_their_device_was_lost() {
    let mut window = Window::new();
    let source = window.source([200, 100, 50], None);
    window.scene.show_source(1, "a.png", source).unwrap();
    window.scene.expose(-1.0);
    let before = window.settle();
    assert_ne!(before, [200, 100, 50, 255]);
    window.lose_device();
    let mut window = window.on_another_device();
    assert_eq!(window.next_frame(false), Wake::Now);
    assert_eq!(window.settle(), before);
    assert_ne!(window.next_frame(false), Wake::Now);
}

#[test]
fn a_source_takes_the_place_of_its_preview_and_gives_way_to_something_else() {
    let mut window = Window::new();
    let rows = Arc::new(AtomicU64::new(480));
    let preview = window.source([10, 200, 30], Some(rows.clone()));
    window.scene.show_preview(3, "b.png", preview).unwrap();
    window.scene.set_opening("b.png", 0.5).unwrap();
    assert_eq!(window.settle(), [10, 200, 30, 255]);
    assert!(!window.scene.display().is_source());
    let source = window.source([30, 40, 220], None);
    window.scene.show_source(3, "b.png", source).unwrap();
    window.scene.end_opening().unwrap();
    assert!(window.scene.display().next().is_some(), "it is asked what it wants behind its preview");
    assert_eq!(window.frame(), [10, 200, 30, 255]);
    assert_eq!(window.settle(), [30, 40, 220, 255]);
    assert!(window.scene.display().is_source());
    // Layers are displayed otherwise.
    window.scene.expose(-1.0);
    let [r, g, b, _] = window.settle();
    assert!(r < 30 && g < 40 && (100..200).contains(&b), "{r}, {g}, {b}");
    // What another opening brought is shown by the host, in its place.
    window.scene.give_way(4, "head.zarr");
    assert!(window.scene.format().is_none() && !window.scene.is_empty());
    assert_eq!(window.scene.name(), "head.zarr");
    let source = window.source([1, 2, 3], None);
    window.scene.show_source(5, "c.png", source).unwrap();
    assert_eq!((window.settle(), window.scene.name()), ([1, 2, 3, 255], "c.png"));
}

/// Words of 16 bits, of which few values are used: their first range is the one of these values.
#[test]
fn a_range_over_the_whole_scale_comes_back_from_a_text_and_what_is_unsaid_is_no_range_of_the_values() {
    let mut window = Window::new();
    let words = (0..IMAGE[0] * IMAGE[1]).flat_map(|n| (n as u16 % 2000).to_le_bytes()).collect();
    let source = window.source_of((LayerFormat::R16, words), None);
    window.scene.show_source(1, "a.png", source).unwrap();
    window.settle();
    let range =
        |window: &Window| window.scene.settings().options.layers.first().and_then(|layer| layer.range);
    let automatic = range(&window).unwrap();
    assert!(automatic[1] < 0.1, "{automatic:?}");
    let pose = Pose::first(Scene::Image);
    let show = |window: &mut Window, text: &str| {
        assert!(window.scene.show_view(&ViewText::from_text(text, IMAGE).unwrap()));
        window.settle();
        range(window)
    };
    let first = window.scene.view_text(pose).unwrap();
    let place = first.split(';').next().unwrap();
    assert_eq!(show(&mut window, &format!("{place};layer=:range=0..1")), Some([0.0, 1.0]));
    let whole = window.scene.view_text(pose).unwrap();
    assert!(whole.contains("range=0..1"), "{whole}");
    assert_eq!(show(&mut window, &first), Some(automatic));
    assert_eq!(show(&mut window, &whole), Some([0.0, 1.0]));
    assert_eq!(show(&mut window, &first), Some(automatic));
    assert_eq!(show(&mut window, &format!("{place};layer=")), Some([0.0, 1.0]), "as render draws it");
    assert_eq!(show(&mut window, &first), Some(automatic));
    assert_eq!(show(&mut window, place), Some(automatic), "a place says nothing of layers");
}

/// A link may be copied before the values of an image are there, or while few of its rows are.
#[test]
fn a_text_of_before_the_range_of_the_values_is_known_leaves_it_to_them() {
    let mut window = Window::new();
    let pose = Pose::first(Scene::Image);
    let words = || (0..IMAGE[0] * IMAGE[1]).flat_map(|n| (n as u16 % 2000).to_le_bytes()).collect();
    let names_layers = |window: &Window| {
        ViewText::from_text(&window.scene.view_text(pose).unwrap(), IMAGE).unwrap().names_layers()
    };
    let rows = Arc::new(AtomicU64::new(240));
    let preview = window.source_of((LayerFormat::R16, words()), Some(rows));
    window.scene.show_preview(1, "a.png", preview).unwrap();
    assert!(!names_layers(&window));
    window.settle();
    assert!(!names_layers(&window), "half of the rows are there");
    let source = window.source_of((LayerFormat::R16, words()), None);
    window.scene.show_source(1, "a.png", source).unwrap();
    window.settle();
    assert!(names_layers(&window));
    // What was found of one file says nothing of the next.
    let next = window.source_of((LayerFormat::R16, words()), None);
    window.scene.show_source(2, "b.png", next).unwrap();
    let early = window.scene.view_text(pose).unwrap();
    assert!(!early.contains("layer="), "{early}");
    window.settle();
    let range = |window: &Window| window.scene.settings().options.layers[0].range;
    let automatic = range(&window);
    assert!(window.scene.show_view(&ViewText::from_text(&early, IMAGE).unwrap()));
    window.settle();
    assert!(automatic.is_some_and(|[_, white]| white < 0.1) && range(&window) == automatic);
}

/// Heights of another file are those of the file that they were named with.
#[test]
fn files_beside_one_that_cannot_be_displayed_go_with_it() {
    for is_forgotten in [false, true] {
        let mut window = Window::new();
        let mut settings = window.scene.settings().clone();
        settings.options.heights.texture = Some(1);
        window.scene.set_first_display(FirstDisplay { layers: Vec::new(), settings, is_asked: true });
        if is_forgotten {
            window.scene.forget_asked();
        }
        let source = window.source([30, 40, 220], None);
        window.scene.show_source(2, "b.png", source).unwrap();
        assert_eq!(window.scene.settings().options.heights.texture.is_none(), is_forgotten);
    }
}
