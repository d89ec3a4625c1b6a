//! The example of a renderer that uses four bind groups works as it stands: its picture is that of ordinary
//! textures, it sets no group beyond the fourth, makes groups anew only when it is told to, and hears of the
//! nearest surface alone.

#[path = "../../examples/four_groups/main.rs"]
#[allow(dead_code, reason = "the test gives the argument that `main` reads")]
mod four_groups;

use std::sync::Arc;

use four_groups::chess::LEAD;
use four_groups::common::headless::Headless;
use four_groups::common::painted::Painted;
use four_groups::renderer::{MATERIALS, Renderer};
use four_groups::setup::layout_entry;
use four_groups::{draw, images};
use vastex::{TextureId, TileSource};

const SIZE: [u32; 2] = [320, 180];
const SIDES: [u32; MATERIALS] = [512, 512, 256, 256, 512];
const PAGE: u32 = 32;

fn sources() -> [Arc<dyn TileSource>; MATERIALS] {
    images(SIDES, PAGE).unwrap().map(|image| -> Arc<dyn TileSource> { Arc::new(image) })
}

/// An image as an ordinary texture with all its levels.
fn ordinary(target: &Headless, image: &Painted) -> wgpu::TextureView {
    let geometry = &image.description().geometry;
    let size = |level: u8| {
        let [width, height, _] = geometry.level(level).size;
        wgpu::Extent3d { width, height, depth_or_array_layers: 1 }
    };
    let texture = target.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("ordinary"),
        size: size(0),
        mip_level_count: u32::from(geometry.coarsest()) + 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba8UnormSrgb,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    for level in 0..=geometry.coarsest() {
        let of_level = size(level);
        let places = (0..of_level.height).flat_map(|y| (0..of_level.width).map(move |x| [x, y]));
        let texels: Vec<u8> = places.flat_map(|texel| image.colour(level, texel)).collect();
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(4 * of_level.width),
            rows_per_image: None,
        };
        let at = wgpu::TexelCopyTextureInfo { mip_level: level.into(), ..texture.as_image_copy() };
        target.queue.write_texture(at, &texels, layout, of_level);
    }
    texture.create_view(&Default::default())
}

/// The same scene by a host that has never heard of Vastex.
fn drawn_with_ordinary_textures() -> Vec<u8> {
    let target = Headless::new(SIZE).unwrap();
    let image = wgpu::BindingType::Texture {
        sample_type: wgpu::TextureSampleType::Float { filterable: true },
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled: false,
    };
    let sampler = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering);
    let text =
        [include_str!("../../examples/four_groups/scene.wgsl"), include_str!("ordinary.wgsl")].concat();
    let entries = [layout_entry(1, image), layout_entry(2, sampler)];
    let renderer = Renderer::new(&target, SIZE, text, &entries, [0; MATERIALS]);
    let sampler = target.device.create_sampler(&wgpu::SamplerDescriptor {
        address_mode_u: wgpu::AddressMode::Repeat,
        address_mode_v: wgpu::AddressMode::Repeat,
        mag_filter: wgpu::FilterMode::Linear,
        min_filter: wgpu::FilterMode::Linear,
        mipmap_filter: wgpu::MipmapFilterMode::Linear,
        ..Default::default()
    });
    let views = images(SIDES, PAGE).unwrap().map(|image| ordinary(&target, &image));
    let groups: Vec<wgpu::BindGroup> = (0..)
        .zip(&views)
        .map(|(nth, view)| {
            let resources =
                [wgpu::BindingResource::TextureView(view), wgpu::BindingResource::Sampler(&sampler)];
            let entry = |(binding, resource)| wgpu::BindGroupEntry { binding, resource };
            renderer.material_group(&target.device, nth, (1..).zip(resources).map(entry).collect())
        })
        .collect();
    let mut encoder = target.device.create_command_encoder(&Default::default());
    renderer.draw_shadows(&mut encoder);
    renderer.draw_picture(&mut encoder, &target, &groups);
    target.queue.submit([encoder.finish()]);
    target.read().unwrap()
}

#[test]
fn a_host_that_uses_all_four_groups_draws_what_it_drew_with_ordinary_textures() {
    let (mut bind_groups, mut changes, mut pages) = (Vec::new(), 0, Vec::new());
    let drawn = draw(SIZE, sources(), |textures, ids| {
        // What a revision tells the host is seen here by the bind groups that Vastex itself makes.
        let now: Vec<wgpu::BindGroup> =
            ids.iter().map(|id| textures.bind_group(*id).unwrap().clone()).collect();
        changes += bind_groups.iter().zip(&now).filter(|(before, now)| before != now).count();
        bind_groups = now;
        let dump = textures.inspect().pool_usage();
        let of_all: Vec<_> = dump.pools.iter().flat_map(|pool| &pool.textures).collect();
        let of_one =
            |id: &TextureId| of_all.iter().find(|of| of.texture == id.number().number()).map(|of| of.pages);
        pages = ids.iter().filter_map(of_one).collect::<Vec<u32>>();
    })
    .unwrap();
    assert_eq!(drawn.highest_group, 3);
    assert!(changes > 0, "no bind group has changed in {} frames", drawn.frames);
    assert_eq!(drawn.groups_made, MATERIALS + changes, "in {} frames", drawn.frames);
    // The lead within the kings is drawn last and seen by nobody: there is its tail alone.
    let [seen @ .., hidden] = &pages[..] else { panic!("{pages:?}") };
    assert!(*hidden == 1 && seen.len() == LEAD && seen.iter().all(|pages| *pages > 8), "{pages:?}");

    let expected = drawn_with_ordinary_textures();
    let off = |by: u8| drawn.pixels.iter().zip(&expected).filter(|(a, b)| a.abs_diff(**b) > by).count();
    assert_eq!(off(3), 0, "of {}; {} are off by more than 1", expected.len(), off(1));
}
