//! Levels drawn in texture space: what comes back, and that where surfaces overlap the sharpest stays.

use vastex_core::{Geometry, GeometrySpec, LayerFormat, LevelImage, PagePos, WantedPage};
use vastex_wgpu::{FeedbackMode, Filter, TEXTURE_SPACE_BLEND, TEXTURE_SPACE_FORMAT, TextureSpace};

use crate::common::{Bindings, GPU, NUMBER, World};

/// A picture of 64x64 pixels. Each instance draws the whole texture into it, at so many times its size; the
/// last one is beside it.
pub(crate) const SHADER: &str = include_str!("wgsl/texture_space.wgsl");

/// What is wanted when these instances are drawn.
fn drawn(geometry: &Geometry, entry: &str, instances: std::ops::Range<u32>) -> Vec<WantedPage> {
    let gpu = &*GPU;
    let world = World::new(gpu, geometry, LayerFormat::Rgba8, 0.0, 7);
    let bindings = Bindings::new(gpu, world.kind(0, Filter::Nearest), FeedbackMode::Separate, false);
    let group = bindings.group(gpu, &world);
    let text = bindings.text(SHADER, world.id);
    let module = text.module(&gpu.device);
    let pipeline_layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: None,
        bind_group_layouts: &[Some(&bindings.layout)],
        immediate_size: 0,
    });
    let pipeline = gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: None,
        layout: Some(&pipeline_layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("spread"),
            compilation_options: text.options(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState {
            topology: wgpu::PrimitiveTopology::TriangleStrip,
            ..Default::default()
        },
        depth_stencil: None,
        multisample: Default::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some(entry),
            compilation_options: text.options(),
            targets: &[Some(wgpu::ColorTargetState {
                blend: Some(TEXTURE_SPACE_BLEND),
                ..TEXTURE_SPACE_FORMAT.into()
            })],
        }),
        multiview_mask: None,
        cache: None,
    });
    let mut target = TextureSpace::new(&gpu.device, geometry).unwrap();
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let mut pass = target.begin(&mut encoder);
    pass.set_pipeline(&pipeline);
    pass.set_bind_group(0, &group, &[]);
    pass.draw(0..4, instances);
    drop(pass);
    assert!(target.record(&mut encoder, 4));
    gpu.queue.submit([encoder.finish()]);
    assert!(target.wait(&gpu.device, &gpu.queue, 3).unwrap().is_none(), "frame 4 is not asked for");
    let (frame, levels): (u64, LevelImage) = target.wait(&gpu.device, &gpu.queue, 4).unwrap().unwrap();
    assert_eq!(frame, 4);
    assert!(target.poll().unwrap().is_none(), "it is handed out once");
    levels.pages(NUMBER, geometry, 1000, frame).pages
}

#[test]
fn levels_come_back_and_the_sharpest_of_what_overlaps_stays() {
    // 256 texels over 28.8 pixels want level 3.15, over 115.2 pixels level 1.15 where they are in the
    // picture.
    let geometry =
        Geometry::new(GeometrySpec { page: 16, border: 2, ..GeometrySpec::image(256, 256) }).unwrap();
    let positions = |instances| -> Vec<PagePos> {
        let wanted = drawn(&geometry, "need", instances);
        wanted.iter().map(|wanted| wanted.page.pos(geometry.dims())).collect()
    };
    assert!(drawn(&geometry, "need", 0..1).iter().all(|wanted| wanted.eighth == 1));
    let far = positions(0..1);
    assert_eq!(far.len(), 4, "the pages of level 3: {far:?}");
    assert!(far.iter().all(|page| page.level == 3));
    let near = positions(1..2);
    // A little more than the middle half of 8 by 8 pages of level 1, and what texels touch that lie across
    // its edge.
    let inner = |page: &PagePos| page.level == 1 && (2..6).contains(&page.x) && (2..6).contains(&page.y);
    assert_eq!(near.iter().filter(|page| inner(page)).count(), 16, "{near:?}");
    assert!(near.len() <= 36 && near.iter().all(|page| page.level == 1), "{near:?}");
    let both = positions(0..2);
    assert!(near.iter().all(|page| both.contains(page)), "{both:?}");
    let rest: Vec<_> = both.iter().filter(|page| !near.contains(page)).collect();
    assert!(
        !rest.is_empty() && rest.iter().all(|page| page.level > 1),
        "what is only in the far one: {both:?}"
    );
    assert!(positions(2..3).is_empty(), "it is beside the picture");
}

#[test]
fn what_is_seen_from_behind_may_be_left_out() {
    let geometry =
        Geometry::new(GeometrySpec { page: 16, border: 2, ..GeometrySpec::image(256, 256) }).unwrap();
    assert!(drawn(&geometry, "need_front", 0..1).is_empty(), "its uv is mirrored");
}
