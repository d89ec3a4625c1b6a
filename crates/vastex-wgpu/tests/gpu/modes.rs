//! Feedback from the main pass beside that of a pass of its own: which surface is heard, and whose turn it
//! is.

use vastex_core::shader_constants::JITTER_CYCLE;
use vastex_core::{Geometry, GeometrySpec, LayerFormat};
use vastex_wgpu::{
    FEEDBACK_DEPTH_FORMAT, FEEDBACK_FORMAT, FeedbackMode, FeedbackScale, FeedbackTarget, Filter,
    InlinePipelines, InlineTarget, RawFeedback,
};

use crate::common::{Bindings, GPU, World, storage};

const PICTURE: [u32; 2] = [203, 77];
const COLOUR: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

/// Surfaces over the whole picture, in the order in which they are drawn: depth, opacity, and of how many
/// answers each gives one by turns.
pub(crate) const SURFACES: &str = include_str!("wgsl/surfaces.wgsl");

/// The views that are drawn into a pass of its own, and whose main pass tells.
const VIEWS: [u32; 2] = [2, 6];

/// A texture to bind, targets, and a pipeline for each of two modes.
struct Stage {
    world: World,
    bindings: Bindings,
    drawn: (wgpu::RenderPipeline, FeedbackTarget),
    told: (wgpu::RenderPipeline, InlineTarget),
}

impl Stage {
    fn new() -> Stage {
        let device = &GPU.device;
        let geometry = Geometry::new(GeometrySpec { page: 16, ..GeometrySpec::image(64, 64) }).unwrap();
        let world = World::new(&GPU, &geometry, LayerFormat::R8, 0.5, 1);
        let mut bindings = Bindings::new(&GPU, world.kind(0, Filter::Trilinear), FeedbackMode::Inline, false);
        let inline = InlinePipelines::new(device);
        // Views beside it, whose cells lie before and after, and move them.
        let views = &mut bindings.views;
        InlineTarget::new(device, &inline, views, 3, [99, 55]).unwrap();
        let told = InlineTarget::new(device, &inline, views, VIEWS[1], PICTURE).unwrap();
        assert!(views.is_moved() && !views.is_moved());
        InlineTarget::new(device, &inline, views, 0, [300, 400]).unwrap();
        assert!(views.is_moved());
        InlineTarget::new(device, &inline, views, 0, [400, 300]).unwrap();
        assert!(!views.is_moved(), "there is room for as many cells");
        let drawn = FeedbackTarget::new(device, PICTURE, FeedbackScale::Reduced).unwrap();
        Stage {
            drawn: (pipeline(&bindings, VIEWS[0], "draw", FEEDBACK_FORMAT, true), drawn),
            told: (pipeline(&bindings, VIEWS[1], "report", COLOUR, false), told),
            world,
            bindings,
        }
    }

    /// What cells hear of surfaces in a frame: in a pass of its own, whose depth test leaves the nearest, and
    /// from a main pass without any, whose fragments all run.
    fn frame(&mut self, frame: u64, surfaces: &[[f32; 4]], reversed_depth: bool) -> [RawFeedback; 2] {
        let (device, queue) = (&GPU.device, &GPU.queue);
        let buffer = storage(&GPU, bytemuck::cast_slice(surfaces));
        let of_texture = self.bindings.group(&GPU, &self.world);
        let draw = |pass: &mut wgpu::RenderPass<'_>, pipeline: &wgpu::RenderPipeline| {
            let of_surfaces = device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: None,
                layout: &pipeline.get_bind_group_layout(1),
                entries: &[wgpu::BindGroupEntry { binding: 0, resource: buffer.as_entire_binding() }],
            });
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, &of_texture, &[]);
            pass.set_bind_group(1, &of_surfaces, &[]);
            pass.draw(0..3, 0..surfaces.len() as u32);
        };
        let mut encoder = device.create_command_encoder(&Default::default());
        let (views, (pipeline, target)) = (&self.bindings.views, &self.drawn);
        draw(&mut target.begin(device, &mut encoder, views, VIEWS[0], frame, 1.0), pipeline);
        let (pipeline, inline) = &mut self.told;
        inline.begin(device, &mut encoder, views, frame, reversed_depth);
        draw(&mut begin_picture(&mut encoder), pipeline);
        inline.end(&mut encoder);
        queue.submit([encoder.finish()]);
        [target.raw(), inline.raw()].map(|raw| RawFeedback::read(device, queue, raw).unwrap())
    }
}

fn begin_picture(encoder: &mut wgpu::CommandEncoder) -> wgpu::RenderPass<'_> {
    let colour = GPU.device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width: PICTURE[0], height: PICTURE[1], depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: COLOUR,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
        view_formats: &[],
    });
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: &colour.create_view(&Default::default()),
            depth_slice: None,
            resolve_target: None,
            ops: Default::default(),
        })],
        ..Default::default()
    })
}

fn pipeline(
    bindings: &Bindings,
    view: u32,
    entry_point: &str,
    format: wgpu::TextureFormat,
    has_depth: bool,
) -> wgpu::RenderPipeline {
    let device = &GPU.device;
    let text = bindings.text(SURFACES, 0).with("VIEW", view);
    let module = text.module(device);
    let surfaces = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: None,
        entries: &[wgpu::BindGroupLayoutEntry {
            binding: 0,
            visibility: wgpu::ShaderStages::VERTEX_FRAGMENT,
            ty: wgpu::BindingType::Buffer {
                ty: wgpu::BufferBindingType::Storage { read_only: true },
                has_dynamic_offset: false,
                min_binding_size: None,
            },
            count: None,
        }],
    });
    let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: None,
        bind_group_layouts: &[Some(&bindings.layout), Some(&surfaces)],
        immediate_size: 0,
    });
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: None,
        layout: Some(&pipeline_layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("vertex"),
            compilation_options: text.options(),
            buffers: &[],
        },
        primitive: Default::default(),
        depth_stencil: has_depth.then(|| wgpu::DepthStencilState {
            format: FEEDBACK_DEPTH_FORMAT,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::Less),
            stencil: Default::default(),
            bias: Default::default(),
        }),
        multisample: Default::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some(entry_point),
            compilation_options: text.options(),
            targets: &[Some(format.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}

/// An opaque surface that gives one answer.
fn opaque(depth: f32) -> [f32; 4] {
    [depth, 1.0, 1.0, 0.0]
}

#[test]
fn the_nearest_surface_is_heard_in_whatever_order_they_are_drawn() {
    let mut stage = Stage::new();
    let nearest = |raw: &RawFeedback, nth: u32| {
        let heard: Vec<_> = raw.pixels.iter().filter(|pixel| pixel[3] != 0).collect();
        assert!(!heard.is_empty() && heard.iter().all(|pixel| pixel[0] == nth && pixel[2] == nth % 8));
    };
    for (frame, depths) in (0..).zip([
        [0.7, 0.2, 0.5],
        [0.2, 0.7, 0.5],
        [0.5, 0.7, 0.2],
        [0.2, 0.2, 0.9],
        [0.0, 1.0, 0.5],
        [0.9, 0.4, 0.4],
    ]) {
        let surfaces = depths.map(opaque);
        let [drawn, told] = stage.frame(frame, &surfaces, false);
        assert_eq!(drawn, told, "{depths:?}");
        // Of those that are as near, the first drawn stays, as with a depth test.
        let first = depths.iter().enumerate().min_by(|a, b| f32::total_cmp(a.1, b.1)).unwrap().0;
        nearest(&told, first as u32);
        let [_, reversed] = stage.frame(frame, &surfaces, true);
        let farthest = depths.iter().enumerate().rev().max_by(|a, b| f32::total_cmp(a.1, b.1)).unwrap().0;
        nearest(&reversed, farthest as u32);
    }
}

#[test]
fn of_more_surfaces_than_a_cell_has_room_for_those_drawn_first_are_heard() {
    let mut stage = Stage::new();
    let mut surfaces: Vec<_> = (0..40).map(|nth| opaque(0.1 + 0.02 * nth as f32)).collect();
    let [drawn, told] = stage.frame(3, &surfaces, false);
    assert_eq!(drawn, told, "the nearest is the first of them");
    surfaces.reverse();
    let [drawn, told] = stage.frame(3, &surfaces, false);
    for (drawn, told) in drawn.pixels.iter().zip(&told.pixels) {
        assert_eq!((drawn[3], drawn[0]), (told[3], if told[3] == 0 { 0 } else { 39 }));
        assert_eq!(told[0], if told[3] == 0 { 0 } else { 7 }, "the nearest of eight");
    }
}

#[test]
fn in_a_cycle_what_is_seen_through_is_wanted_and_so_is_what_lies_behind() {
    let mut stage = Stage::new();
    // Three behind one another, drawn from the back: each is seen in half of what is left.
    for (opacity, shares) in
        [(0.5, [0.25, 0.25, 0.5]), (0.99, [0.016, 0.109, 0.875]), (0.01, [0.766, 0.109, 0.125])]
    {
        let surfaces = [opaque(0.9), [0.6, opacity, 1.0, 0.0], [0.3, opacity, 1.0, 0.0]];
        let mut heard = [[0u32; 3]; 2];
        for frame in 0..u64::from(JITTER_CYCLE) {
            for (raw, heard) in stage.frame(frame, &surfaces, false).iter().zip(&mut heard) {
                let pixels = raw.pixels.iter().filter(|pixel| pixel[3] != 0);
                pixels.for_each(|pixel| heard[pixel[0] as usize] += 1);
            }
        }
        for heard in heard {
            let all = heard.iter().sum::<u32>();
            for (heard, share) in heard.iter().zip(shares) {
                let found = f64::from(*heard) / f64::from(all);
                assert!(
                    (found - share).abs() < 0.03 && *heard > 0,
                    "{opacity}: {heard} of {all}, not {share}"
                );
            }
        }
    }
    let unseen = [opaque(0.9), [0.3, 0.0, 1.0, 0.0]];
    let [drawn, told] = stage.frame(0, &unseen, false);
    assert!(drawn == told && told.pixels.iter().all(|pixel| pixel[0] == 0));
}

#[test]
fn turns_are_the_same_in_every_mode() {
    let mut stage = Stage::new();
    for count in [2u32, 3, 4, 8] {
        let mut given = vec![vec![0u32; count as usize]; 26 * 10];
        for frame in 0..u64::from(JITTER_CYCLE * count) {
            let [drawn, told] = stage.frame(frame, &[[0.5, 1.0, count as f32, 0.0]], false);
            assert_eq!(drawn, told, "{count} answers, frame {frame}");
            for (cell, pixel) in told.pixels.iter().enumerate().filter(|(_, pixel)| pixel[3] != 0) {
                given[cell][pixel[1] as usize] += 1;
            }
        }
        // Cells that lie within the picture give each answer from every position of the cycle.
        let whole = given.iter().filter(|given| given.iter().sum::<u32>() == JITTER_CYCLE * count);
        assert!(whole.clone().count() > 200 && whole.flatten().all(|&given| given == JITTER_CYCLE));
    }
}
