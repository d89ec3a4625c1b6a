//! The example of many materials works as it stands: its picture is that of ordinary textures, and every
//! pixel of each of its textures is what its image has there.

#[path = "../../examples/many_materials/main.rs"]
#[allow(dead_code, reason = "the test gives the argument that `main` reads")]
mod many_materials;

use many_materials::common::headless::{self, DEPTH_FORMAT, Headless, PICTURE_FORMAT};
use many_materials::common::painted::Painted;
use many_materials::{Rectangle, TEXTURES, draw, instances, plain, uv_of};
use vastex::TileSource;

/// 32 by 32 pixels for each texture.
const SIZE: [u32; 2] = [640, 320];
const PIXELS: u32 = 32;

/// What a rectangle shows of an image as an ordinary texture, of the two levels between which it is sampled.
fn ordinary(target: &Headless, image: &Painted, [u0, v0, u1, v1]: [f32; 4]) -> wgpu::TextureView {
    let geometry = &image.description().geometry;
    let texels_in_pixel = (u1 - u0) * geometry.size()[0] as f32 / PIXELS as f32;
    // Where that is a whole level it may be rounded down.
    let finest = (texels_in_pixel.log2() - 0.01).floor() as u8;
    let [width, height, _] = geometry.level(finest).size;
    let texture = target.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("ordinary"),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 2,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba8Unorm,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    for mip in 0..2 {
        let [width, height, _] = geometry.level(finest + mip).size;
        let around = |first: f32, last: f32, texels: u32| {
            let first = (first * texels as f32 - 2.0).max(0.0) as u32;
            (first, (last * texels as f32 + 3.0).min(texels as f32) as u32)
        };
        let ((left, right), (top, bottom)) = (around(u0, u1, width), around(v0, v1, height));
        let places = (top..bottom).flat_map(|y| (left..right).map(move |x| [x, y]));
        let texels: Vec<u8> = places.flat_map(|texel| image.colour(finest + mip, texel)).collect();
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(4 * (right - left)),
            rows_per_image: None,
        };
        let at = wgpu::TexelCopyTextureInfo {
            mip_level: mip.into(),
            origin: wgpu::Origin3d { x: left, y: top, z: 0 },
            ..texture.as_image_copy()
        };
        let size = wgpu::Extent3d { width: right - left, height: bottom - top, depth_or_array_layers: 1 };
        target.queue.write_texture(at, &texels, layout, size);
    }
    texture.create_view(&Default::default())
}

/// The same scene by a host that has never heard of Vastex: a bind group and a draw for each texture.
fn drawn_with_ordinary_textures() -> Vec<u8> {
    let target = Headless::new(SIZE).unwrap();
    let device = &target.device;
    let materials = include_str!("../../examples/many_materials/materials.wgsl");
    let (materials, _) = materials.split_once("@vertex\nfn place_feedback").unwrap();
    let module = vastex::shader_module(device, None, materials.to_owned() + include_str!("ordinary.wgsl"));
    let entry = |binding, ty| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::FRAGMENT,
        ty,
        count: None,
    };
    let image = wgpu::BindingType::Texture {
        sample_type: wgpu::TextureSampleType::Float { filterable: true },
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled: false,
    };
    let sampler = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering);
    let of_group = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: None,
        entries: &[entry(1, image), entry(2, sampler)],
    });
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: None,
        bind_group_layouts: &[None, None, Some(&of_group)],
        immediate_size: 0,
    });
    let (entries, formats) = (["place", "shade"], [PICTURE_FORMAT, DEPTH_FORMAT]);
    let pipeline = headless::pipeline(
        device,
        &layout,
        &module,
        &[Some(Rectangle::LAYOUT)],
        entries,
        headless::nearest(formats),
    );
    let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
        mag_filter: wgpu::FilterMode::Linear,
        min_filter: wgpu::FilterMode::Linear,
        mipmap_filter: wgpu::MipmapFilterMode::Linear,
        ..Default::default()
    });
    let rectangles: Vec<Rectangle> = (0..TEXTURES).map(|nth| Rectangle::new(nth, 0)).collect();
    let instances = instances(device, &target.queue, &rectangles);
    let mut encoder = device.create_command_encoder(&Default::default());
    let mut pass = target.begin(&mut encoder, glam::Vec4::ZERO);
    pass.set_pipeline(&pipeline);
    pass.set_vertex_buffer(0, instances.slice(..));
    for nth in 0..TEXTURES {
        let view = ordinary(&target, &plain::image(nth).unwrap(), uv_of(nth));
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &of_group,
            entries: &[
                wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::TextureView(&view) },
                wgpu::BindGroupEntry { binding: 2, resource: wgpu::BindingResource::Sampler(&sampler) },
            ],
        });
        pass.set_bind_group(2, &group, &[]);
        pass.draw(0..4, nth as u32..nth as u32 + 1);
    }
    drop(pass);
    target.queue.submit([encoder.finish()]);
    target.read().unwrap()
}

#[test]
fn two_hundred_textures_are_drawn_with_a_bind_group_for_each_pool() {
    let drawn = draw(SIZE).unwrap();
    assert_eq!((drawn.kinds, drawn.pools, drawn.bind_groups_set), (3, 4, 4));
    let expected = drawn_with_ordinary_textures();
    let off = |by: u8| drawn.pixels.iter().zip(&expected).filter(|(a, b)| a.abs_diff(**b) > by).count();
    assert_eq!(off(2), 0, "of {}; {} are off by more than 1", expected.len(), off(1));
    // Nor do both show what the images do not have.
    let encoded = |light: f32| 255.0 * (1.055 * light.powf(1.0 / 2.4) - 0.055);
    for nth in 0..TEXTURES {
        let [left, top] = [nth % 20, nth / 20].map(|at| at as u32 * PIXELS);
        let [u0, v0, u1, v1] = uv_of(nth);
        for (y, x) in (0..PIXELS).flat_map(|y| (0..PIXELS).map(move |x| (y, x))) {
            let at = [x, y].map(|at| (at as f32 + 0.5) / PIXELS as f32);
            let uv = [u0 + (u1 - u0) * at[0], v0 + (v1 - v0) * at[1]];
            // An image that is seen whole goes on beyond its edges as it is there.
            if nth % 4 == 3 && uv.iter().any(|at| !(0.1..0.9).contains(at)) {
                continue;
            }
            let pixel = ((top + y) * SIZE[0] + left + x) as usize * 4;
            let (shown, expected) = (&drawn.pixels[pixel..pixel + 3], plain::light(nth, uv).map(encoded));
            let is_close = shown.iter().zip(expected).all(|(&a, b)| (f32::from(a) - b).abs() < 2.0);
            assert!(is_close, "texture {nth}, pixel {x},{y}: {shown:?} in the place of {expected:?}");
        }
    }
}
