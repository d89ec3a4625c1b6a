//! How bright what glows is: the same at every step and on every level, of a box of one value as the law has
//! it, of the real head nearly. And how bright an average is: the same wherever two levels meet in a ray.

use std::sync::Arc;

use glam::DVec3;
use vastex::{LayerFormat, TableChoice};
use vastex_viewer::volume::{VolumeCamera, VolumeChannel, VolumeDesc, VolumeFace, VolumeMode, VolumeView};

use super::volume_real::real;
use super::volume_reference::{display, level_of, light_of, picture, ways_through};
use super::volume_world::{ArrayVolume, World, face_size, geometry};

const STEPS: [f64; 3] = [1.0, 1.0 / 3.0, 0.2];

/// A box of one value, of sides that no coarser voxel divides: from faces and in perspective, on three
/// levels, what is let through is what the law says of the way through it.
#[test]
fn a_box_of_one_value_is_as_bright_at_every_step_and_level() {
    let volume = ArrayVolume::new(geometry([42, 38, 30], 16), LayerFormat::R8, |_| 0.4);
    let value = volume.levels[0].values[0];
    let mut world = World::of(vec![Arc::new(volume)], 200, TableChoice::BySize);
    world.of.voxel = DVec3::ONE;
    let channel = VolumeChannel { opacity: 0.4, ..VolumeChannel::new(world.ids[0]) };
    let around = VolumeView::Around(VolumeCamera::around(&world.of, [1.0, 0.7, 0.5], [0.0, 0.0, 1.0]));
    let faces = [VolumeFace::PlusX, VolumeFace::MinusY, VolumeFace::PlusZ].map(VolumeView::Face);
    let density = 2.0;
    world.load_all();
    let tau = -(1.0 - f64::from(channel.opacity) * value).ln() * density * 100.0 / 42.0;
    for is_exact in [true, false] {
        let desc = VolumeDesc { density, is_exact, ..VolumeDesc::new(world.of, vec![channel]) };
        let desc = VolumeDesc { mode: VolumeMode::Emission, ..desc };
        let mut renderer = world.renderer(desc.clone());
        for (voxels, view) in [1.0, 2.05, 4.2].into_iter().flat_map(|n| faces.map(|view| (n, view))) {
            let VolumeView::Face(face) = view else { continue };
            let size = face_size(&world.of, face, voxels);
            let pixel = view.rays(&world.of, size).pixel;
            let level = level_of(&world.of, &world.volumes[0].levels, pixel);
            assert_eq!(level, voxels.log2() as usize, "{face}, {size:?}");
            for step in STEPS {
                for mode in [VolumeMode::Emission, VolumeMode::Average] {
                    renderer.set(VolumeDesc { step, mode, ..desc.clone() });
                    let law = |way: f64| match mode {
                        VolumeMode::Emission => display(1.0 - (-tau * way).exp()),
                        _ if way > 0.0 => display(f64::from(channel.opacity) * light_of(value)),
                        _ => 0.0,
                    };
                    let expected = ways_through(&world.of, &view, size);
                    let drawn = world.shot(&renderer, view, size);
                    let off = expected.iter().zip(&drawn);
                    let off = off.map(|(way, pixel)| (255.0 * law(*way) - f64::from(pixel[0])).abs());
                    let most = off.fold(0.0, f64::max);
                    assert!(most <= 1.0, "{face}, {size:?}, step {step}, {mode:?}: {most}");
                }
            }
        }
        // In perspective rays have ways of any length.
        for (step, size) in STEPS.into_iter().flat_map(|step| [[64, 56], [24, 20]].map(|size| (step, size))) {
            renderer.set(VolumeDesc { step, ..desc.clone() });
            let drawn = world.shot(&renderer, around, size);
            let expected = ways_through(&world.of, &around, size);
            let off = expected.iter().zip(&drawn);
            let off = off
                .map(|(way, pixel)| (255.0 * display(1.0 - (-tau * way).exp()) - f64::from(pixel[0])).abs());
            let most = off.fold(0.0, f64::max);
            assert!(most <= 1.0, "around, {size:?}, step {step}: {most}");
        }
    }
}

/// The real head in the look of its file: within 2 % from a step of 1 to a fifth of that, within 5 % from
/// level 0 to level 1, and where it is translucent from level 1 to level 2 as well. What hides all that is
/// behind it is larger by its blurred edges on coarse levels, whatever the march does (docs/volumes.md).
#[test]
fn the_head_glows_alike_at_every_step_and_level() {
    let mut world = real("head.zip");
    let colors = [[255, 255, 255], [255, 128, 0], [0, 128, 255]].into_iter();
    let channels = world.ids.iter().zip(colors);
    let channels = channels.map(|(id, color)| VolumeChannel::new(*id).in_color(color)).collect();
    let around = VolumeView::Around(VolumeCamera::around(&world.of, [1.0, 0.7, 0.5], [0.0, 0.0, 1.0]));
    let face = VolumeView::Face(VolumeFace::PlusZ);
    let desc = VolumeDesc { mode: VolumeMode::Emission, ..VolumeDesc::new(world.of, channels) };
    world.load_all();
    let mut renderer = world.renderer(desc.clone());
    // All light that comes to the eye, whatever size pixels have.
    let mut light = |view: VolumeView, size: [u32; 2], density: f64, step: f64| {
        renderer.set(VolumeDesc { density, step, ..desc.clone() });
        let rays = view.rays(&world.of, size);
        let shot = world.shot(&renderer, view, size);
        let codes = shot.iter().flat_map(|pixel| &pixel[..3]);
        let sum: f64 = codes.map(|code| light_of(f64::from(*code) / 255.0)).sum();
        sum * (rays.pixel + rays.growth).powi(2)
    };
    // A pixel is as large as a voxel of the level, or just smaller than one of the next.
    let levels = [[50, 59], [49, 58], [25, 29]];
    for (view, size) in [(face, levels[0]), (face, levels[1]), (around, [64, 64]), (around, [40, 40])] {
        let [coarse, fine] = [STEPS[0], STEPS[2]].map(|step| light(view, size, 1.0, step));
        assert!((fine / coarse - 1.0).abs() < 0.02, "{view:?}, {size:?}: {coarse}, by finer steps {fine}");
    }
    for (density, count) in [(1.0, 2), (0.03, 3)] {
        let of_levels: Vec<f64> =
            levels[..count].iter().map(|size| light(face, *size, density, 1.0)).collect();
        for two in of_levels.windows(2) {
            assert!((two[1] / two[0] - 1.0).abs() < 0.05, "density {density}: {of_levels:?}");
        }
    }
    // On level 2 an opaque head is brighter, which is none of the march's doing: the reference says the same.
    let of_reference = |size: [u32; 2]| {
        let pixels = picture(&desc, &world.arrays(&desc), &face, size);
        let sum: f64 = pixels.iter().flatten().map(|code| light_of(code / 255.0)).sum();
        sum * face.rays(&world.of, size).pixel.powi(2)
    };
    let reference = of_reference(levels[2]) / of_reference(levels[1]);
    let drawn = light(face, levels[2], 1.0, 1.0) / light(face, levels[1], 1.0, 1.0);
    println!("level 2 beside level 1: {drawn:.4} as bright, {reference:.4} by the reference");
    assert!((drawn / reference - 1.0).abs() < 0.01, "{drawn} as bright, {reference} by the reference");
}

/// A box that is bright in its first half and dark in the other one, seen along it in perspective: the middle
/// of the picture is the mean of both, from either side, wherever levels meet: where pixels of many sizes put
/// that, and where pools do that are too small for what is wanted.
#[test]
fn an_average_in_perspective_hangs_on_neither_levels_nor_side() {
    let (size, [near, far]) = ([32, 32, 128], [220.0 / 255.0, 20.0 / 255.0]);
    let value = |[_, _, z]: [f64; 3]| if z < 64.0 { near } else { far };
    // As far from the box as that is long: a pixel of its far side is twice as large as one of its near side.
    let around = |nth: usize, pixel: f64, rows: u32| {
        let (eye, toward) = [(-128.0, DVec3::Z), (256.0, DVec3::NEG_Z)][nth];
        let eye = DVec3::new(16.0, 16.0, eye);
        let half_height = (pixel / 128.0 * f64::from(rows) / 2.0).atan();
        VolumeView::Around(VolumeCamera { target: eye + toward, eye, down: DVec3::Y, half_height })
    };
    let picture_size = [9, 9];
    let middle = 4 * 9 + 4;
    let expected = 255.0 * (near + far) / 2.0;
    let mut biases = std::collections::BTreeSet::new();
    for slots in [100, 20, 10, 6] {
        let volume = ArrayVolume::new(geometry(size, 16), LayerFormat::R8, value);
        let mut world = World::of(vec![Arc::new(volume)], slots, TableChoice::BySize);
        world.of.voxel = DVec3::ONE;
        let channel = VolumeChannel::new(world.ids[0]);
        let desc = VolumeDesc { is_exact: true, ..VolumeDesc::new(world.of, vec![channel]) };
        let desc = VolumeDesc { mode: VolumeMode::Average, ..desc };
        let pixels = [1.05, 1.25, 1.5, 1.75, 1.95];
        for (nth, pixel) in [0, 1].into_iter().flat_map(|nth| pixels.map(|pixel| (nth, pixel))) {
            let view = around(nth, pixel, picture_size[1]);
            let drawn = world.drawn(desc.clone(), view, picture_size).0[middle][0];
            let bias = world.textures.stats().pager.bias_eighths;
            let what = format!("side {nth}, pixels from {pixel} voxels on, bias {bias}/8");
            biases.insert(bias);
            // The last sample's part may be half of it longer or shorter than what is left of the ray.
            let off = (f64::from(drawn) - expected).abs();
            assert!(off <= 4.0, "{what}: {drawn}, and not {expected}");
            if bias == 0 {
                let twin = picture(&desc, &world.arrays(&desc), &view, picture_size)[middle][0];
                assert!((f64::from(drawn) - twin).abs() <= 1.5, "{what}: {drawn}, and not {twin}");
            }
        }
    }
    assert!(biases.contains(&0) && biases.len() >= 3, "{biases:?}");
}
