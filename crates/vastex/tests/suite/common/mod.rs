//! What the tests of the frame loop share: a screen that shows textures, each by an affine mapping of its
//! own.

#![allow(unreachable_pub, reason = "a module of a test program")]

mod copied;
pub mod texts;
pub mod tiles;

use std::ops::Range;
use std::sync::Arc;
use std::time::Duration;

use vastex::{
    Error, Event, Feedback, Pace, Sampled, Settings, TextureId, TextureSettings, Textures, TileSource,
    Urgency, ViewId,
};
use vastex_core::{AddressMode, Geometry, GeometrySpec};
use vastex_tiles::PropertySource;
use vastex_wgpu::test_device::TestDevice;

pub use texts::{PICTURE, SCREEN};

const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
/// The number of the main view.
const MAIN: u32 = 0;
/// Frames after which every pixel has been looked at and what it wants has been asked for.
const JITTER_FRAMES: u32 = 18;
const PATIENCE_FRAMES: u32 = 600;

/// `uv = origin + along_x * x + along_y * y` at the centre `(x, y)` of a pixel.
#[derive(Clone, Copy, Debug)]
pub struct Mapping {
    pub origin: [f32; 2],
    pub along_x: [f32; 2],
    pub along_y: [f32; 2],
}

impl Mapping {
    /// `centre` of the texture in the middle of the picture, turned by `angle` radians; a pixel is `texels`
    /// texels of level 0 along x and `texels * stretch` along y.
    pub fn new(size: [u32; 2], centre: [f64; 2], texels: f64, stretch: f64, angle: f64) -> Mapping {
        let [width, height] = size.map(f64::from);
        let x = [texels * angle.cos() / width, texels * angle.sin() / height];
        let y = [-texels * stretch * angle.sin() / width, texels * stretch * angle.cos() / height];
        let [right, down] = PICTURE.map(|side| f64::from(side) / 2.0);
        let origin = std::array::from_fn(|a| (centre[a] - x[a] * right - y[a] * down) as f32);
        Mapping { origin, along_x: x.map(|n| n as f32), along_y: y.map(|n| n as f32) }
    }
}

/// A source whose texels say where they are.
pub fn property(size: [u32; 2], page: u32, address: AddressMode) -> Arc<dyn TileSource> {
    let spec = GeometrySpec { page, address: [address; 3], ..GeometrySpec::image(size[0], size[1]) };
    Arc::new(PropertySource::new(Geometry::new(spec).unwrap()))
}

/// Raw texels, the same pictures every time.
pub fn settings() -> Settings {
    Settings {
        filter: vastex::Filter::Nearest,
        pace: Pace::LockStep { latency_frames: 1 },
        ..Settings::default()
    }
}

struct Shown {
    sampled: Sampled,
    columns: [f32; 2],
    uniform: wgpu::Buffer,
    group: wgpu::BindGroup,
    picture: wgpu::RenderPipeline,
    wanted: wgpu::RenderPipeline,
    /// Of the strip of triangles that is drawn.
    vertices: u32,
    is_gone: bool,
}

impl Shown {
    /// Tells shaders what is shown: of groups, up to four members.
    fn tell_ids(&self, gpu: &TestDevice, textures: &Textures) {
        let mut ids = [0u32; 8];
        ids.iter_mut()
            .zip(textures.bindings().ids(self.sampled).unwrap())
            .for_each(|(place, id)| *place = id);
        gpu.queue.write_buffer(&self.uniform, 48, bytemuck::bytes_of(&ids));
    }
}

/// Adds a texture with settings of its own.
pub fn add_with(
    textures: &mut Textures,
    source: Arc<dyn TileSource>,
    settings: TextureSettings,
) -> Result<TextureId, Error> {
    let prepared = textures.preparer().read_blocking(source, settings)?;
    Ok(textures.add(prepared)?)
}

/// Textures side by side, drawn by the frame loop.
pub struct Screen {
    pub gpu: TestDevice,
    pub textures: Textures,
    shown: Vec<Shown>,
    shader: String,
    colour: wgpu::Texture,
    depth: wgpu::Texture,
}

impl Screen {
    pub fn new(sources: &[Arc<dyn TileSource>], settings: Settings) -> Screen {
        let gpu = TestDevice::new();
        let mut textures = Textures::new(&gpu.device, &gpu.queue, settings).unwrap();
        let ids: Vec<Sampled> =
            sources.iter().map(|source| textures.add_blocking(source.clone()).unwrap().into()).collect();
        Screen::of(gpu, textures, &ids, SCREEN)
    }

    /// What `add` makes of textures, drawn by a shader of its own.
    pub fn showing<S: Into<Sampled>>(
        settings: Settings,
        shader: &str,
        add: impl FnOnce(&mut Textures) -> S,
    ) -> Screen {
        Screen::showing_all(settings, shader, |textures| vec![add(textures)])
    }

    /// The same of several, each in a column.
    pub fn showing_all<S: Into<Sampled>>(
        settings: Settings,
        shader: &str,
        add: impl FnOnce(&mut Textures) -> Vec<S>,
    ) -> Screen {
        let gpu = TestDevice::new();
        let mut textures = Textures::new(&gpu.device, &gpu.queue, settings).unwrap();
        let shown: Vec<Sampled> = add(&mut textures).into_iter().map(Into::into).collect();
        Screen::of(gpu, textures, &shown, shader)
    }

    /// The same textures on another device, with nothing of the old one. Mappings are to be set again.
    pub fn on_another_device(mut self) -> Screen {
        let gpu = TestDevice::new();
        self.textures.memory().restore(&gpu.device, &gpu.queue).unwrap();
        let ids: Vec<Sampled> = self.shown.iter().map(|shown| shown.sampled).collect();
        Screen::of(gpu, self.textures, &ids, &self.shader)
    }

    fn of(gpu: TestDevice, textures: Textures, ids: &[Sampled], shader: &str) -> Screen {
        let device = &gpu.device;
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: None,
            entries: &[wgpu::BindGroupLayoutEntry {
                binding: 0,
                visibility: wgpu::ShaderStages::VERTEX_FRAGMENT,
                ty: wgpu::BindingType::Buffer {
                    ty: wgpu::BufferBindingType::Uniform,
                    has_dynamic_offset: false,
                    min_binding_size: None,
                },
                count: None,
            }],
        });
        let share = 1.0 / ids.len() as f32;
        let shown: Vec<Shown> = (0..)
            .zip(ids)
            .map(|(nth, &sampled)| {
                let uniform = device.create_buffer(&wgpu::BufferDescriptor {
                    label: None,
                    size: 80,
                    usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                    mapped_at_creation: false,
                });
                let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
                    label: None,
                    layout: &layout,
                    entries: &[wgpu::BindGroupEntry { binding: 0, resource: uniform.as_entire_binding() }],
                });
                let [picture, wanted] = pipelines(device, &textures, sampled, shader, &layout);
                let columns = [nth as f32 * share, (nth + 1) as f32 * share];
                let shown =
                    Shown { sampled, columns, uniform, group, picture, wanted, vertices: 4, is_gone: false };
                shown.tell_ids(&gpu, &textures);
                shown
            })
            .collect();
        let target = |format, usage| {
            device.create_texture(&wgpu::TextureDescriptor {
                label: None,
                size: wgpu::Extent3d { width: PICTURE[0], height: PICTURE[1], depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT | usage,
                view_formats: &[],
            })
        };
        let colour = target(FORMAT, wgpu::TextureUsages::COPY_SRC);
        let depth = target(Textures::FEEDBACK_DEPTH_FORMAT, wgpu::TextureUsages::empty());
        Screen { gpu, textures, shown, shader: shader.to_owned(), colour, depth }
    }

    /// Removes a texture; its column stays empty.
    pub fn remove(&mut self, nth: usize) {
        assert!(self.textures.remove(self.texture(nth)));
        self.shown[nth].is_gone = true;
    }

    /// Shows another texture where one was removed, of the same pool.
    pub fn replace(&mut self, nth: usize, source: Arc<dyn TileSource>) {
        self.replace_with(nth, |textures| textures.add_blocking(source).unwrap().into());
    }

    /// The same of one that is added otherwise.
    pub fn replace_with(&mut self, nth: usize, add: impl FnOnce(&mut Textures) -> Sampled) {
        self.shown[nth].sampled = add(&mut self.textures);
        self.shown[nth].is_gone = false;
        self.shown[nth].tell_ids(&self.gpu, &self.textures);
    }

    /// Tells shaders another id in one of the places of those of what is shown; 0 is that of what is sampled.
    pub fn set_id(&self, nth: usize, place: u64, id: u32) {
        self.gpu.queue.write_buffer(&self.shown[nth].uniform, 48 + 4 * place, bytemuck::bytes_of(&id));
    }

    /// For a shader that makes something else of a strip than a rectangle: so many vertices.
    pub fn set_vertices(&mut self, nth: usize, vertices: u32) {
        self.shown[nth].vertices = vertices;
    }

    pub fn texture(&self, nth: usize) -> TextureId {
        match self.shown[nth].sampled {
            Sampled::Layer(layer) => layer.texture(),
            Sampled::Group(group) => panic!("{group:?} is no texture"),
        }
    }

    pub fn set_mapping(&mut self, nth: usize, mapping: &Mapping) {
        self.set_anchored(nth, mapping, [0; 2]);
    }

    /// For a shader in fixed point: the mapping is in texels from the beginning of texel `anchor`.
    pub fn set_anchored(&mut self, nth: usize, mapping: &Mapping, anchor: [u32; 2]) {
        let shown = &self.shown[nth];
        let picture = PICTURE.map(|side| side as f32);
        let uniform = [mapping.origin, mapping.along_x, mapping.along_y, picture, shown.columns];
        self.gpu.queue.write_buffer(&shown.uniform, 0, bytemuck::bytes_of(&uniform));
        self.gpu.queue.write_buffer(&shown.uniform, 40, bytemuck::bytes_of(&anchor));
    }

    /// One frame, but for the picture.
    pub fn frame(&mut self) -> Result<Vec<Event>, Error> {
        let all = 0..self.shown.len();
        self.frame_of(&[(ViewId::MAIN, PICTURE, all)])
    }

    /// One frame of views, each with a picture of so many pixels of some of the textures.
    pub fn frame_of(&mut self, views: &[(ViewId, [u32; 2], Range<usize>)]) -> Result<Vec<Event>, Error> {
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        for (view, picture, shown) in views {
            let shown = &self.shown[shown.clone()];
            let number = self.textures.view(*view).unwrap().number();
            self.textures.view_mut(*view).unwrap().feedback(&mut encoder, *picture, |pass, groups| {
                draw(pass, number, shown, |shown| (&shown.wanted, groups.get(shown.sampled).unwrap()));
            })?;
        }
        self.textures.update()?;
        self.gpu.queue.submit([encoder.finish()]);
        Ok(std::iter::from_fn(|| self.textures.poll_event()).collect())
    }

    /// A feedback pass that the application begins itself; returns true if there was anything to draw.
    pub fn draw_by_host(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        view: ViewId,
        picture: [u32; 2],
    ) -> Result<bool, Error> {
        let Some(begun) = self.textures.view_mut(view).unwrap().begin_feedback(encoder, picture)? else {
            return Ok(false);
        };
        let number = begun.view_number();
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(begun.color_attachment())],
            depth_stencil_attachment: Some(begun.depth_attachment()),
            ..Default::default()
        });
        let [x, y, width, height] = begun.scissor();
        pass.set_scissor_rect(x, y, width, height);
        draw(&mut pass, number, &self.shown, |shown| {
            (&shown.wanted, self.textures.bind_group(shown.sampled).unwrap())
        });
        Ok(true)
    }

    /// The feedback pass of a frame, not yet submitted.
    pub fn record_wanted(&mut self, picture: [u32; 2]) -> wgpu::CommandEncoder {
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        let shown = &self.shown;
        let recorded = self.textures.feedback(&mut encoder, picture, |pass, groups| {
            draw(pass, MAIN, shown, |shown| (&shown.wanted, groups.get(shown.sampled).unwrap()));
        });
        recorded.unwrap();
        encoder
    }

    /// The picture of a frame, which may say what it wants; not yet submitted. Its target is the screen's,
    /// whatever the picture's size.
    pub fn record_picture(&mut self, picture: [u32; 2]) -> wgpu::CommandEncoder {
        self.record_picture_by(picture, None)
    }

    /// The same by a bind group that was kept, where there is one.
    pub fn record_picture_by(
        &mut self,
        picture: [u32; 2],
        kept: Option<&wgpu::BindGroup>,
    ) -> wgpu::CommandEncoder {
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        let (shown, colour) = (&self.shown, self.colour.create_view(&Default::default()));
        let depth = self.depth.create_view(&Default::default());
        let recorded = self.textures.main_pass(&mut encoder, picture, |encoder, groups| {
            let mut pass = begin_picture(encoder, &colour, &depth);
            let group = |shown: &Shown| kept.unwrap_or_else(|| groups.get(shown.sampled).unwrap());
            draw(&mut pass, MAIN, shown, |shown| (&shown.picture, group(shown)));
        });
        recorded.unwrap();
        encoder
    }

    /// Frames until nothing is missing, from a view that may be new.
    pub fn converge(&mut self) {
        for frame in 0..PATIENCE_FRAMES {
            self.frame().unwrap();
            if frame >= JITTER_FRAMES && self.textures.stats().converged {
                return;
            }
        }
        panic!("not converged: {:?}", self.textures.stats());
    }

    /// Loads what every pixel wants, of a view that has converged: feedback, which is of a part of the
    /// pixels, may miss corners of pages of a pixel or two. Says what they want.
    pub fn complete(&mut self) -> Feedback {
        let wanted = self.feedback_of_every_pixel();
        let ahead = self.textures.ahead().prefetch_view(&wanted, Urgency::default()).unwrap();
        let progress = self.textures.finish(&ahead, Duration::from_secs(60)).unwrap();
        assert_eq!(progress.resident, progress.pages);
        wanted
    }

    pub fn feedback_of_every_pixel(&mut self) -> Feedback {
        let shown = &self.shown;
        let drawn = self.textures.pixels().feedback_of_every(PICTURE, |pass, groups| {
            draw(pass, MAIN, shown, |shown| (&shown.wanted, groups.get(shown.sampled).unwrap()));
        });
        drawn.unwrap()
    }

    /// Asks why a pixel shows what it shows.
    pub fn explain(&mut self, pixel: [u32; 2]) -> Result<(), Error> {
        let shown = &self.shown;
        self.textures.pixels().explain(PICTURE, pixel, |pass, groups| {
            draw(pass, MAIN, shown, |shown| (&shown.wanted, groups.get(shown.sampled).unwrap()));
        })
    }
}

fn begin_picture<'encoder>(
    encoder: &'encoder mut wgpu::CommandEncoder,
    colour: &wgpu::TextureView,
    depth: &wgpu::TextureView,
) -> wgpu::RenderPass<'encoder> {
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: colour,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations::default(),
        })],
        depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
            view: depth,
            depth_ops: Some(wgpu::Operations {
                load: wgpu::LoadOp::Clear(1.0),
                store: wgpu::StoreOp::Discard,
            }),
            stencil_ops: None,
        }),
        ..Default::default()
    })
}

fn draw<'g>(
    pass: &mut wgpu::RenderPass<'_>,
    view: u32,
    shown: &'g [Shown],
    with: impl Fn(&'g Shown) -> (&'g wgpu::RenderPipeline, &'g wgpu::BindGroup),
) {
    for shown in shown.iter().filter(|shown| !shown.is_gone) {
        let (pipeline, group) = with(shown);
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, group, &[]);
        pass.set_bind_group(1, &shown.group, &[]);
        pass.draw(0..shown.vertices, view..view + 1);
    }
}

/// For the picture, and for the feedback pass.
fn pipelines(
    device: &wgpu::Device,
    textures: &Textures,
    sampled: Sampled,
    shader: &str,
    mapping: &wgpu::BindGroupLayout,
) -> [wgpu::RenderPipeline; 2] {
    let kinds = textures.kinds(sampled).unwrap();
    let module = vastex_wgpu::shader_module(device, None, shader.to_owned() + &textures.wgsl(&kinds));
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: None,
        bind_group_layouts: &[Some(&textures.bind_group_layout(&kinds)), Some(mapping)],
        immediate_size: 0,
    });
    let depth = wgpu::DepthStencilState {
        format: Textures::FEEDBACK_DEPTH_FORMAT,
        depth_write_enabled: Some(true),
        depth_compare: Some(wgpu::CompareFunction::Less),
        stencil: Default::default(),
        bias: Default::default(),
    };
    let passes = [("place", "shade", FORMAT), ("place_feedback", "want", Textures::FEEDBACK_FORMAT)];
    passes.map(|(place, shade, format)| {
        device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: None,
            layout: Some(&layout),
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some(place),
                compilation_options: Default::default(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState {
                topology: wgpu::PrimitiveTopology::TriangleStrip,
                ..Default::default()
            },
            depth_stencil: Some(depth.clone()),
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some(shade),
                compilation_options: Default::default(),
                targets: &[Some(format.into())],
            }),
            multiview_mask: None,
            cache: None,
        })
    })
}
