//! Where on its texture each pixel of a picture is, as the scene's own shaders have it: to measure pictures by.

use glam::DVec2;
use vastex::Textures;
use vastex_viewer::stage::{StageScene, depth_view};
use vastex_viewer::{Gpu, Pose, SceneRenderer};

use crate::wait::read_texture;

const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Float;
const PIXEL_BYTES: u32 = 16;

/// Texels of level 0 from the texture's first corner, of every pixel row by row; nothing where the pixel does not see the texture, or
/// where a scene is not drawn in fixed point at this pose.
pub(crate) fn places(
    gpu: &Gpu,
    textures: &Textures,
    renderer: &SceneRenderer,
    pose: &Pose,
    size: [u32; 2],
) -> Vec<Option<DVec2>> {
    let device = &gpu.device;
    let pipeline = renderer.fixed_pipeline(device, textures, "tell_fixed", FORMAT);
    let Some((pipeline, anchor)) = pipeline.zip(renderer.anchor(pose, size)) else { return Vec::new() };
    renderer.set_pose(&gpu.queue, textures, pose, size);
    let target = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("places"),
        size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: FORMAT,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    let (view, depth) = (target.create_view(&Default::default()), depth_view(device, size));
    let mut encoder = device.create_command_encoder(&Default::default());
    let into = vastex_viewer::Target::new(&view, &depth, None);
    let mut pass = into.begin(&mut encoder, glam::Vec4::ZERO);
    if let Ok(group) = textures.bind_group(renderer.sampled()) {
        renderer.draw_fixed(&mut pass, &pipeline, group);
    }
    drop(pass);
    let bytes = read_texture(gpu, encoder, &target, PIXEL_BYTES);
    let anchor = DVec2::new(anchor[0].into(), anchor[1].into());
    let place =
        |[x, y, is_met, _]: [f32; 4]| (is_met == 1.0).then(|| anchor + DVec2::new(x.into(), y.into()));
    bytes.chunks_exact(PIXEL_BYTES as usize).map(|bytes| place(bytemuck::pod_read_unaligned(bytes))).collect()
}
