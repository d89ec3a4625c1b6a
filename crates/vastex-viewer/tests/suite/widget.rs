//! The widget in a program without a window: egui runs, its shapes are painted by egui-wgpu, and pixels are
//! read back.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use egui::epaint::mutex::RwLock;
use egui::{Context, Event, Modifiers, MouseWheelUnit, PointerButton, Pos2, RawInput, Rect, Vec2};
use egui_wgpu::{RenderState, Renderer, RendererOptions, ScreenDescriptor};
use vastex::source::{ReadError, ReadFuture};
use vastex::{
    Description, ImageOptions, ImageSource, LayerFormat, PagePos, Settings, TextureSettings, TileSource,
};
use vastex_viewer::stage::{Canvas, TargetKind, TextureRead};
use vastex_viewer::widget::VastexImage;
use vastex_viewer::{Gpu, Pose, Scene};

/// What a window would have.
const PICTURE: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

/// Points of the window, and pixels: one and a half each.
const POINTS: [f32; 2] = [160.0, 80.0];
const PIXELS: [u32; 2] = [240, 120];

struct Program {
    context: Context,
    state: RenderState,
    image: VastexImage,
    gpu: Gpu,
    time: f64,
    /// True if egui was asked for another frame at once by the last one, and after how long it was asked for
    /// one.
    goes_on: bool,
    delay: Duration,
}

impl Program {
    fn new(source: impl TileSource + 'static) -> Program {
        let gpu = pollster::block_on(Gpu::headless()).unwrap();
        // Without egui's dither. It moves a colour by up to 0.475 of a step, so that an error of 0.025 of a
        // step is enough to round to the next; egui decodes and encodes sRGB by the device's powers, and not
        // every device's are as exact as that.
        let options = RendererOptions { dithering: false, ..RendererOptions::default() };
        let renderer = Renderer::new(&gpu.device, PICTURE, options);
        let state = RenderState {
            adapter: gpu.adapter.clone(),
            available_adapters: Vec::new(),
            instance: gpu.instance.clone(),
            device: gpu.device.clone(),
            queue: gpu.queue.clone(),
            target_format: PICTURE,
            renderer: Arc::new(RwLock::new(renderer)),
        };
        let mut image = VastexImage::new(&state, Settings::default()).unwrap();
        let reading = image.preparer().read_blocking(Arc::new(source), TextureSettings::default());
        image.set_image(reading.unwrap()).unwrap();
        Program {
            context: Context::default(),
            state,
            image,
            gpu,
            time: 0.0,
            goes_on: false,
            delay: Duration::MAX,
        }
    }

    /// A frame of the program, as a host runs it; gives back what is seen.
    fn frame(&mut self, events: Vec<Event>) -> Vec<[u8; 4]> {
        self.time += 1.0 / 60.0;
        let screen_rect = Some(Rect::from_min_size(Pos2::ZERO, POINTS.into()));
        let mut input = RawInput { screen_rect, time: Some(self.time), events, ..RawInput::default() };
        input.viewports.entry(egui::ViewportId::ROOT).or_default().native_pixels_per_point = Some(1.5);
        let image = &mut self.image;
        let mut output = self.context.run_ui(input, |ui| {
            image.show(ui);
        });
        let viewport = output.viewport_output.get(&egui::ViewportId::ROOT);
        self.delay = viewport.map_or(Duration::MAX, |viewport| viewport.repaint_delay);
        self.goes_on = self.delay == Duration::ZERO;
        let Gpu { device, queue, .. } = &self.gpu;
        let mut painter = self.state.renderer.write();
        for (id, deltas) in std::mem::take(&mut output.textures_delta.set) {
            deltas.iter().for_each(|delta| painter.update_texture(device, queue, id, delta));
        }
        output.textures_delta.clear();
        let pixels_per_point = output.pixels_per_point;
        let jobs = self.context.tessellate(std::mem::take(&mut output.shapes), pixels_per_point);
        let screen = ScreenDescriptor { size_in_pixels: PIXELS, pixels_per_point };
        let canvas = Canvas::new(&self.gpu, PIXELS, PICTURE, TargetKind::Direct);
        let view = canvas.picture().create_view(&Default::default());
        let mut encoder = device.create_command_encoder(&Default::default());
        painter.update_buffers(device, queue, &mut encoder, &jobs, &screen);
        let ops =
            wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::RED), store: wgpu::StoreOp::Store };
        let attachment =
            wgpu::RenderPassColorAttachment { view: &view, depth_slice: None, resolve_target: None, ops };
        let pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(attachment)],
            ..Default::default()
        });
        painter.render(&mut pass.forget_lifetime(), &jobs, &screen);
        drop(painter);
        let read = TextureRead::submit(&self.gpu, encoder, canvas.picture(), 4);
        let limit = Some(std::time::Duration::from_secs(300));
        self.gpu.device.poll(wgpu::PollType::Wait { submission_index: None, timeout: limit }).unwrap();
        read.take().unwrap().unwrap().as_chunks::<4>().0.to_vec()
    }

    /// Frames until the picture stays.
    fn settle(&mut self) -> Vec<[u8; 4]> {
        for _ in 0..2000 {
            let seen = self.frame(Vec::new());
            assert_eq!(self.image.error(), None);
            if self.image.is_settled() && !self.goes_on {
                return seen;
            }
        }
        panic!("the picture does not settle");
    }

    fn press(pos: Pos2, pressed: bool) -> Event {
        Event::PointerButton { pos, button: PointerButton::Primary, pressed, modifiers: Modifiers::NONE }
    }
}

/// Red says the column and green the row, in steps of the texel.
fn squares() -> ImageSource {
    let pixels: Vec<u8> =
        (0..400u32 * 1200).flat_map(|n| [(n % 1200 / 5) as u8, (n / 1200 / 2) as u8, 77, 255]).collect();
    let options = ImageOptions::default();
    ImageSource::new(LayerFormat::Rgba8, [1200, 400], pixels, &options).unwrap()
}

#[test]
fn a_program_shows_an_image_and_a_person_moves_it() {
    let mut program = Program::new(squares());
    let seen = program.settle();
    let at = |seen: &[[u8; 4]], x: u32, y: u32| seen[(y * PIXELS[0] + x) as usize];
    // Fitted in: 1200 texels in 240 pixels, 400 of them in the middle 80 of 120 rows.
    let near = |a: [u8; 4], b: [u8; 4]| a.iter().zip(b).all(|(a, b)| a.abs_diff(b) <= 2);
    for (x, y) in [(0, 20), (120, 60), (239, 99)] {
        let texel = [(x * 5 + 2) / 5, (y - 20) * 5 / 2 + 1, 77, 255].map(|value: u32| value as u8);
        assert!(near(at(&seen, x, y), texel), "{x},{y}: {:?} {texel:?}", at(&seen, x, y));
    }
    let beside = at(&seen, 120, 5);
    assert!(beside[2] != 77, "{beside:?} is beside the image");
    assert!(!program.goes_on, "an image at rest asks for no frame");

    // A drag by 30 points to the left is one by 45 pixels, so 225 texels.
    let (from, to) = (Pos2::new(100.0, 40.0), Pos2::new(70.0, 40.0));
    let value_before = program.image.texel_at(to).unwrap().texel;
    program.frame(vec![Event::PointerMoved(from)]);
    program.frame(vec![Program::press(from, true)]);
    program.frame(vec![Event::PointerMoved(to)]);
    for _ in 0..20 {
        program.frame(vec![Event::PointerMoved(to)]);
    }
    program.frame(vec![Program::press(to, false)]);
    let seen = program.settle();
    let value = program.image.texel_at(to).unwrap().texel;
    assert!(value[0].abs_diff(value_before[0] + 225) <= 2, "{value_before:?} {value:?}");
    let texel = (value[0] / 5) as u8;
    assert!(at(&seen, 105, 60)[0].abs_diff(texel) <= 2, "{:?} {texel}", at(&seen, 105, 60));

    // The wheel zooms to the pointer: the texel below it stays.
    let wheel = Event::MouseWheel {
        unit: MouseWheelUnit::Point,
        delta: Vec2::new(0.0, 200.0),
        phase: egui::TouchPhase::Move,
        source: egui::MouseWheelSource::Unknown,
        modifiers: Modifiers::NONE,
    };
    program.frame(vec![Event::PointerMoved(to), wheel]);
    program.settle();
    let zoomed = program.image.texel_at(to).unwrap().texel;
    assert!(zoomed[0].abs_diff(value[0]) <= 1 && zoomed[1].abs_diff(value[1]) <= 1, "{value:?} {zoomed:?}");
    let Pose::Image { zoom, .. } = program.image.pose() else { panic!("it is an image") };
    assert!(zoom > 2.0, "{zoom}");

    // A key shows so many pixels a texel, and another all of it.
    let key = |key, pressed| Event::Key {
        key,
        physical_key: None,
        pressed,
        repeat: false,
        modifiers: Modifiers::NONE,
    };
    program.frame(vec![key(egui::Key::Num8, true), key(egui::Key::Num8, false)]);
    let seen = program.settle();
    let scale = program.image.pose().magnification(PIXELS, program.image.size().unwrap()).unwrap();
    assert!((scale - 8.0).abs() < 1e-9, "{scale}");
    let row: Vec<u8> = (0..PIXELS[0]).map(|x| at(&seen, x, 60)[0]).collect();
    assert!(
        row.chunk_by(|a, b| a == b).skip(1).all(|run| run.len() >= 8 || run.len() == row.len() % 8),
        "{row:?}"
    );
    program.frame(vec![key(egui::Key::Num0, true)]);
    program.settle();
    assert_eq!(program.image.pose(), Pose::first(Scene::Image));
}

/// An image on a disk that can be out of reach.
struct Failing {
    image: ImageSource,
    is_gone: Arc<AtomicBool>,
}

impl TileSource for Failing {
    fn description(&self) -> &Arc<Description> {
        self.image.description()
    }

    fn behind(&self) -> Option<&dyn TileSource> {
        Some(&self.image)
    }

    fn read(&self, pos: PagePos) -> ReadFuture<'_> {
        match self.is_gone.load(Ordering::Relaxed) {
            false => self.image.read(pos),
            true => Box::pin(async move {
                let (place, error) = ("a disk".to_owned(), "it is out of reach".to_owned());
                Err(ReadError::Store { pos, place, error })
            }),
        }
    }
}

/// Nobody touches anything: the program draws when egui says so.
#[test]
fn tiles_that_failed_are_tried_again_by_a_program_at_rest() {
    let expected = Program::new(squares()).settle();
    let is_gone = Arc::new(AtomicBool::new(false));
    let mut program = Program::new(Failing { image: squares(), is_gone: is_gone.clone() });
    is_gone.store(true, Ordering::Relaxed);
    let coarse = program.settle();
    assert!(coarse != expected, "nothing failed");
    let fault = program.image.fault().unwrap().to_owned();
    assert!(fault.contains("it is out of reach"), "{fault}");
    assert_eq!(program.image.error(), None, "a coarser picture is shown");
    is_gone.store(false, Ordering::Relaxed);
    let mut seen = coarse;
    for _ in 0..2000 {
        if program.delay > Duration::from_secs(1) {
            break;
        }
        seen = program.frame(Vec::new());
    }
    assert!(program.delay > Duration::from_secs(1), "it asks for frames without end");
    assert!(program.image.is_settled() && program.image.fault().is_none());
    assert!(seen == expected, "what failed was not tried again");
}
