//! A picture whose texture is sampled on the CPU; only where each pixel is on the surface comes from the GPU.
//!
//! It is what pictures are compared with where an ordinary texture is beyond the device.

use vastex::{CpuTexture, Textures};

use crate::wait::read_texture;
use vastex_viewer::Gpu;
use vastex_viewer::Picture;
use vastex_viewer::stage::StageScene;
use vastex_viewer::{SceneRenderer, depth_view};

/// Bytes of a pixel of a coordinate target: four floats.
const PIXEL_BYTES: u32 = 16;
const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Float;

/// The picture of the scene at its present pose.
pub(crate) fn cpu_picture(
    gpu: &Gpu,
    textures: &Textures,
    renderer: &SceneRenderer,
    texture: &CpuTexture,
    size: [u32; 2],
) -> Result<Picture, vastex::Error> {
    let [uv_and_dx, dy_covered_and_light] = coordinates(gpu, textures, renderer, size);
    let color_map = renderer.color_map();
    let mut rgba = Vec::with_capacity(uv_and_dx.len());
    for ([u, v, dx_u, dx_v], [dy_u, dy_v, covered, light]) in uv_and_dx.into_iter().zip(dy_covered_and_light)
    {
        let pixel = if covered == 0.0 {
            [0; 4]
        } else {
            color_map.pixel_from_value(texture.sample_grad([u, v], [dx_u, dx_v], [dy_u, dy_v])?, light)
        };
        rgba.extend(pixel);
    }
    Ok(Picture { size, rgba })
}

/// uv and gradients of every pixel, row by row, as coordinates.wgsl tells them.
fn coordinates(
    gpu: &Gpu,
    textures: &Textures,
    renderer: &SceneRenderer,
    size: [u32; 2],
) -> [Vec<[f32; 4]>; 2] {
    let device = &gpu.device;
    let pipeline =
        renderer.other_pipeline(device, textures, [renderer.vertex_entry(), "tell"], None, &[FORMAT, FORMAT]);
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
        renderer.draw(&mut pass, &pipeline, group);
    }
    drop(pass);
    gpu.queue.submit([encoder.finish()]);
    targets.map(|target| {
        let encoder = device.create_command_encoder(&Default::default());
        let bytes = read_texture(gpu, encoder, &target, PIXEL_BYTES);
        bytes.chunks_exact(PIXEL_BYTES as usize).map(bytemuck::pod_read_unaligned).collect()
    })
}
