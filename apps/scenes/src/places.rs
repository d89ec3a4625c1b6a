//! Where on its texture each pixel of a picture is, as the scene's own shaders have it: to measure pictures
//! by, and for those that the CPU makes.

use glam::{DVec2, Vec2};
use vastex::Textures;
use vastex_viewer::stage::StageScene;
use vastex_viewer::{Gpu, Pose, SceneRenderer, depth_view};

use crate::wait::read_texture;

/// Bytes of a pixel of a target: four floats.
const PIXEL_BYTES: u32 = 16;
const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Float;

/// What a pixel sees.
pub(crate) struct PixelPlace {
    /// From the texture's first corner, in texels of level 0.
    pub(crate) texels: DVec2,
    /// uv along one pixel to the right, and downward.
    pub(crate) along: [Vec2; 2],
    /// How light the ground is.
    pub(crate) light: f32,
}

/// What every pixel sees, row by row, in a picture that the scene's own camera has been placed for; `None` if
/// it does not see the texture.
pub(crate) fn places(
    shown: (&Gpu, &Textures, &SceneRenderer),
    pose: &Pose,
    size: [u32; 2],
) -> Vec<Option<PixelPlace>> {
    let (_, textures, renderer) = shown;
    let Ok(texture) = textures.texture(renderer.layer().texture()) else { return Vec::new() };
    let [width, height, _] = texture.description().geometry.size();
    let texels = DVec2::new(width.into(), height.into());
    let anchor = renderer.anchor(textures, pose, size);
    let [place_and_dx, rest] = coordinates(shown, size);
    let place = |([x, y, dx_x, dx_y], [dy_x, dy_y, covered, light]): ([f32; 4], [f32; 4])| {
        let (place, along) = (Vec2::new(x, y).as_dvec2(), [Vec2::new(dx_x, dx_y), Vec2::new(dy_x, dy_y)]);
        // In fixed point in texels from the anchor, else in uv.
        let (texels, along) = match anchor {
            Some([x, y]) => (
                DVec2::new(x.into(), y.into()) + place,
                along.map(|along| (along.as_dvec2() / texels).as_vec2()),
            ),
            None => (place * texels, along),
        };
        (covered != 0.0).then_some(PixelPlace { texels, along, light })
    };
    place_and_dx.into_iter().zip(rest).map(place).collect()
}

/// Both targets of coordinates.wgsl.
fn coordinates(
    (gpu, textures, renderer): (&Gpu, &Textures, &SceneRenderer),
    size: [u32; 2],
) -> [Vec<[f32; 4]>; 2] {
    let device = &gpu.device;
    let pipelines = renderer.pipelines("locate", None, &[FORMAT, FORMAT]);
    let target = || {
        device.create_texture(&wgpu::TextureDescriptor {
            label: Some("coordinates"),
            size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: FORMAT,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        })
    };
    let (targets, depth) = ([target(), target()], depth_view(device, size));
    let views = targets.each_ref().map(|target| target.create_view(&Default::default()));
    let mut encoder = device.create_command_encoder(&Default::default());
    let attachments = views.each_ref().map(|view| {
        Some(wgpu::RenderPassColorAttachment {
            view,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations {
                load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                store: wgpu::StoreOp::Store,
            },
        })
    });
    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some("coordinates"),
        color_attachments: &attachments,
        depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
            view: &depth,
            depth_ops: Some(wgpu::Operations {
                load: wgpu::LoadOp::Clear(1.0),
                store: wgpu::StoreOp::Discard,
            }),
            stencil_ops: None,
        }),
        ..Default::default()
    });
    if let Ok(group) = textures.bind_group(renderer.sampled()) {
        renderer.draw(&mut pass, &pipelines, group);
    }
    drop(pass);
    gpu.queue.submit([encoder.finish()]);
    targets.map(|target| {
        let encoder = device.create_command_encoder(&Default::default());
        let bytes = read_texture(gpu, encoder, &target, PIXEL_BYTES);
        bytes.chunks_exact(PIXEL_BYTES as usize).map(bytemuck::pod_read_unaligned).collect()
    })
}
