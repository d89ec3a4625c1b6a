//! Pictures of volumes beside what they must be: every mode, from faces and in perspective, on several
//! levels, in every format and with either kind of page table.

use std::sync::Arc;

use glam::DVec3;
use vastex::{LayerFormat, StoredLevel, TableChoice, ViewId};
use vastex_viewer::Palette;
use vastex_viewer::stage::{Canvas, Frame, Pictures, StageScene, StageView, TargetKind, draw_again};
use vastex_viewer::volume::{VolumeCamera, VolumeDesc, VolumeFace, VolumeMode, VolumeRenderer, VolumeView};

use super::volume_reference::{level_of, pictures};
use super::volume_world::{ArrayVolume, PICTURE, World, face_size, geometry, psnr, read, waves, within};

#[test]
fn every_mode_from_every_face_is_the_reference() {
    let mut world = World::new(&geometry([40, 36, 28], 16), LayerFormat::R16, 1, 200, TableChoice::BySize);
    world.load_all();
    for (is_exact, codes, share) in [(true, 2.0, 0.999), (false, 4.0, 0.99)] {
        let descs = VolumeMode::ALL.map(|mode| VolumeDesc { is_exact, ..world.desc(mode) });
        let mut renderer = world.renderer(descs[0].clone());
        for face in VolumeFace::ALL {
            let (view, size) = (VolumeView::Face(face), face_size(&world.of, face, 1.0));
            let expected = pictures(&descs, &world.levels(), &view, size);
            for (desc, expected) in descs.iter().zip(&expected) {
                renderer.set(desc.clone());
                let (is, most) = within(&world.shot(&renderer, view, size), expected, codes);
                assert!(is >= share, "{face} {:?}, exact: {is_exact}: {is}, up to {most}", desc.mode);
            }
        }
    }
}

#[test]
fn three_channels_add_their_light() {
    let mut world =
        World::new(&geometry([40, 36, 28], 16), LayerFormat::R32Float, 3, 400, TableChoice::BySize);
    for mode in [VolumeMode::Average, VolumeMode::Emission, VolumeMode::Iso] {
        let desc = VolumeDesc { is_exact: true, step: 1.0 / 3.0, ..world.desc(mode) };
        let (within, most) = world.compare(&desc, VolumeView::Face(VolumeFace::PlusZ), [40, 36], 2.0);
        assert!(within >= 0.999, "{mode:?}: {within}, up to {most}");
    }
}

#[test]
fn a_map_gives_every_value_its_colour() {
    let mut world = World::new(&geometry([40, 36, 28], 16), LayerFormat::R16, 2, 400, TableChoice::BySize);
    for mode in VolumeMode::ALL {
        let mut desc = VolumeDesc { is_exact: true, ..world.desc(mode) };
        desc.channels[0].map = Some(Palette::VIRIDIS.reversed());
        desc.channels[0].gamma = 0.8;
        let views = [VolumeView::Face(VolumeFace::PlusZ), VolumeView::Slice { axis: 2, voxel: 13 }];
        for view in views.into_iter().take(if mode == VolumeMode::Mip { 2 } else { 1 }) {
            let (within, most) = world.compare(&desc, view, [40, 36], 2.0);
            assert!(within >= 0.999, "{mode:?}, {view:?}: {within}, up to {most}");
            // The other channel keeps its colour, and the map is seen.
            let plain = world.desc(mode);
            assert!(world.drawn(desc.clone(), view, [40, 36]).0 != world.drawn(plain, view, [40, 36]).0);
        }
    }
}

#[test]
fn small_pictures_are_drawn_from_coarse_levels() {
    let mut world = World::new(&geometry([70, 60, 50], 16), LayerFormat::R8, 1, 300, TableChoice::Hashed);
    world.of.voxel = DVec3::ONE;
    for size in [[35, 30], [24, 20], [100, 90]] {
        let view = VolumeView::Face(VolumeFace::PlusZ);
        let desc = VolumeDesc { is_exact: true, ..world.desc(VolumeMode::Average) };
        let pixel = view.rays(&world.of, size).pixel;
        let level = level_of(&world.of, &world.volumes[0].levels, pixel);
        let (within, most) = world.compare(&desc, view, size, 2.0);
        assert!(within >= 0.999, "{size:?}, level {level}: {within}, up to {most}");
        assert_eq!(level, usize::from(size[0] < 70), "the sizes are on both sides of a level");
    }
}

/// Ratios of 3.02, 1 and 2.5, levels that begin elsewhere: bricks are cut by whole factors all the same.
#[test]
fn levels_of_any_ratio_lie_where_the_file_says() {
    let level = |size, scale, origin| StoredLevel { size, scale, origin };
    let stored = [
        level([145, 60, 50], [1.0; 3], [0.0; 3]),
        level([48, 60, 20], [145.0 / 48.0, 1.0, 2.5], [0.0, 0.0, 0.25]),
        // Of sides that the next level, which is made, does not leave shorter.
        level([16, 10, 7], [145.0 / 16.0, 6.0, 7.0], [0.0, 0.0, 0.5]),
    ];
    for (table, size, level) in [
        (TableChoice::Direct, [145, 60], 0),
        (TableChoice::Direct, [36, 15], 1),
        (TableChoice::Hashed, [36, 15], 1),
        (TableChoice::Hashed, [14, 6], 2),
    ] {
        let volume = ArrayVolume::stored(&stored, LayerFormat::R16, waves(0.0));
        let is_aligned = |level: &vastex::VoxelLevel| level.is_aligned;
        assert!(!volume.voxels.as_ref().unwrap().levels().iter().all(is_aligned));
        let mut world = World::of(vec![Arc::new(volume)], 400, table);
        world.of.voxel = DVec3::ONE;
        let view = VolumeView::Face(VolumeFace::PlusZ);
        let pixel = view.rays(&world.of, size).pixel;
        assert_eq!(level_of(&world.of, &world.volumes[0].levels, pixel), level);
        let desc = VolumeDesc { is_exact: true, ..world.desc(VolumeMode::Average) };
        let (within, most) = world.compare(&desc, view, size, 2.0);
        assert!(within >= 0.999, "level {level}, {table:?}: {within}, up to {most}");
    }
}

/// At the face's own size a pixel is a voxel, also where the next level has larger ones along the finest axis
/// alone, which may be one that the picture has or the one that is looked along.
#[test]
fn a_picture_as_large_as_the_face_shows_level_0_in_every_mode() {
    for fine in 0..3 {
        let (mut size, mut coarse, mut voxel, mut scale) = ([20, 18, 16], [20, 18, 16], [1.0; 3], [1.0; 3]);
        (size[fine], coarse[fine], voxel[fine], scale[fine]) = (40, 20, 0.25, 0.5);
        let level =
            |size: [u32; 3], scale| StoredLevel { size: size.map(u64::from), scale, origin: [0.0; 3] };
        let stored = [level(size, voxel), level(coarse, scale)];
        // Every other voxel is bright.
        let value = |at: [f64; 3]| {
            let wave = waves(0.3)(at);
            0.25 + 0.5 * wave + if (at[fine] as u64).is_multiple_of(2) { 0.25 } else { -0.25 }
        };
        let volume = Arc::new(ArrayVolume::stored(&stored, LayerFormat::R16, value));
        let mut world = World::of(vec![volume.clone()], 200, TableChoice::BySize);
        world.of.voxel = voxel.into();
        world.load_all();
        let finest = &volume.levels[0];
        let desc = world.desc(VolumeMode::Mip);
        let codes = |value: f64| [255.0 * desc.channels[0].shown(value); 3];
        let mut renderer = world.renderer(desc.clone());
        for (axis, face) in [VolumeFace::PlusX, VolumeFace::MinusY, VolumeFace::PlusZ].into_iter().enumerate()
        {
            let [right, down, _] = face.axes();
            let pixels = face_size(&world.of, face, 1.0);
            // The voxel of a pixel, so far away from the viewer.
            let voxel = |x: u32, y: u32, away: u32| {
                let mut at = [0_i64; 3];
                for (way, n) in [(right, x), (down, y)] {
                    let along = (0..3).find(|a| way[*a] != 0.0).unwrap();
                    let last = i64::from(size[along]) - 1;
                    at[along] = if way[along] > 0.0 { n.into() } else { last - i64::from(n) };
                }
                at[axis] = away.into();
                finest.voxel(at)
            };
            let all = |x, y| (0..size[axis]).map(move |away| voxel(x, y, away));
            let of_pixels = |pixel: &dyn Fn(u32, u32) -> f64| {
                let places = (0..pixels[1]).flat_map(|y| (0..pixels[0]).map(move |x| (x, y)));
                places.map(|(x, y)| codes(pixel(x, y))).collect::<Vec<_>>()
            };
            for (mode, expected) in [
                (VolumeMode::Mip, of_pixels(&|x, y| all(x, y).fold(f64::MIN, f64::max))),
                (VolumeMode::Minip, of_pixels(&|x, y| all(x, y).fold(f64::MAX, f64::min))),
                (VolumeMode::Average, of_pixels(&|x, y| all(x, y).sum::<f64>() / f64::from(size[axis]))),
            ] {
                renderer.set(VolumeDesc { mode, ..desc.clone() });
                let (share, most) =
                    within(&world.shot(&renderer, VolumeView::Face(face), pixels), &expected, 1.0);
                assert_eq!(share, 1.0, "{mode:?} from {face}, fine along {fine}: up to {most}");
            }
            if face == VolumeFace::MinusY {
                continue; // Its slices are seen the other way round.
            }
            for nth in [0, 5, size[axis] - 1] {
                let slice = VolumeView::Slice { axis: axis as u8, voxel: nth };
                let expected = of_pixels(&|x, y| voxel(x, y, nth));
                let (share, most) = within(&world.shot(&renderer, slice, pixels), &expected, 1.0);
                assert_eq!(share, 1.0, "slice {nth} across {axis}, fine along {fine}: up to {most}");
            }
        }
    }
}

#[test]
fn slices_are_the_voxels() {
    let mut world = World::new(&geometry([40, 36, 28], 16), LayerFormat::R8, 1, 200, TableChoice::BySize);
    for (axis, voxel, size) in [(2, 13, [40, 36]), (1, 35, [40, 28]), (0, 0, [36, 28])] {
        let desc = world.desc(VolumeMode::Mip);
        let (within, most) = world.compare(&desc, VolumeView::Slice { axis, voxel }, size, 1.0);
        assert_eq!(within, 1.0, "across {axis}: up to {most}");
    }
}

/// What the CPU says of a place is what lies there, at the level that is in memory.
#[test]
fn the_cpu_samples_what_is_drawn() {
    let mut world = World::new(&geometry([40, 36, 28], 16), LayerFormat::R16, 1, 200, TableChoice::BySize);
    let places = [[0.0, 0.0, 0.0], [15.7, 16.2, 13.3], [39.9, 35.9, 27.9], [20.5, 3.5, 16.0]];
    let sample = |world: &World, place, level| {
        let mut sampler = world.textures.cpu().sampler(world.ids[0]).unwrap();
        sampler.volume(place, level, None).unwrap()
    };
    let first = sample(&world, places[1], 0);
    assert!(first.level > 0.0, "nothing but the tail is there yet");
    world.drawn(world.desc(VolumeMode::Average), VolumeView::Face(VolumeFace::PlusZ), [40, 36]);
    for place in places {
        let found = sample(&world, place, 0);
        let levels = &world.volumes[0].levels;
        let expected = levels[found.level as usize].sample(DVec3::from_array(place));
        assert!((f64::from(found.value[0]) - expected).abs() < 1e-4, "{place:?}: {found:?}, not {expected}");
    }
    let coarse = sample(&world, places[1], 9);
    assert_eq!(coarse.level as usize, world.volumes[0].levels.len() - 1);
}

/// Views of one volume see slices and all of it in one frame, in whatever order they are placed.
#[test]
fn a_slice_beside_it_changes_no_other_view() {
    let mut world = World::new(&geometry([40, 36, 28], 16), LayerFormat::R8, 1, 200, TableChoice::BySize);
    let (face, size) = (VolumeView::Face(VolumeFace::PlusZ), [40, 36]);
    let (expected, _) = world.drawn(world.desc(VolumeMode::Mip), face, size);
    let desc = world.desc(VolumeMode::Mip);
    let renderer = VolumeRenderer::new(&world.gpu, &mut world.textures, desc, PICTURE).unwrap();
    let beside = renderer.new_camera(0);
    renderer.place(renderer.camera(), &world.gpu.queue, &world.textures, &face, size);
    let slice = VolumeView::Slice { axis: 2, voxel: 3 };
    renderer.place(&beside, &world.gpu.queue, &world.textures, &slice, size);
    let canvas = Canvas::new(&world.gpu, size, PICTURE, TargetKind::Direct);
    let mut encoder = world.gpu.device.create_command_encoder(&Default::default());
    draw_again(&mut encoder, &world.textures, &renderer, renderer.camera(), &canvas.target());
    assert_eq!(read(&world.gpu, encoder, &canvas), expected);
}

#[test]
fn a_camera_around_it_sees_the_reference() {
    let mut world = World::new(&geometry([40, 36, 28], 16), LayerFormat::R16, 1, 200, TableChoice::BySize);
    let camera = VolumeCamera::around(&world.of, [1.0, 0.7, 0.5], [0.0, 0.0, 1.0]);
    let (view, size) = (VolumeView::Around(camera), [64, 48]);
    let descs = VolumeMode::ALL.map(|mode| world.desc(mode));
    let expected = pictures(&descs, &world.levels(), &view, size);
    world.drawn(descs[0].clone(), view, size);
    for is_exact in [true, false] {
        let mut renderer = world.renderer(VolumeDesc { is_exact, ..descs[0].clone() });
        for (desc, expected) in descs.iter().zip(&expected) {
            renderer.set(VolumeDesc { is_exact, ..desc.clone() });
            let db = psnr(&world.shot(&renderer, view, size), expected);
            assert!(db >= 40.0, "{:?}, exact: {is_exact}: {db} dB", desc.mode);
        }
    }
}

#[test]
fn a_pool_that_is_too_small_makes_a_coarser_picture() {
    // Of each channel 27 bricks on level 0 and 8 on level 1.
    for (channels, slots) in [(1, 12), (3, 20)] {
        let mut world =
            World::new(&geometry([48, 48, 48], 16), LayerFormat::R8, channels, slots, TableChoice::BySize);
        let desc = world.desc(VolumeMode::Average);
        let (drawn, _) = world.drawn(desc.clone(), VolumeView::Face(VolumeFace::PlusZ), [48, 48]);
        let (before, frames) = (world.textures.stats(), 40);
        assert!(before.pager.bias_eighths > 0, "{channels} channels: {before:?}");
        assert!(drawn.iter().all(|pixel| pixel[..3].iter().any(|part| *part > 0) && pixel[3] == 255));
        // A camera that does not move loads nothing anew.
        let renderer = VolumeRenderer::new(&world.gpu, &mut world.textures, desc, PICTURE).unwrap();
        let canvas = Canvas::new(&world.gpu, [48, 48], PICTURE, TargetKind::Direct);
        for _ in 0..frames {
            let pose = VolumeView::Face(VolumeFace::PlusZ);
            let views = [StageView { view: ViewId::MAIN, camera: renderer.camera(), pose }];
            let pictures = Pictures::ForFeedback;
            let frame =
                Frame { views: &views, expected: None, picture: [48, 48], has_feedback: true, pictures };
            let (gpu, target) = (&world.gpu, canvas.target());
            let encoder = frame.record(gpu, &mut world.textures, &renderer, &target, |_, _| Ok(())).unwrap();
            gpu.queue.submit([encoder.finish()]);
        }
        let after = world.textures.stats();
        assert_eq!(before.pager.loaded, after.pager.loaded, "{channels} channels: {after:?}");
    }
}
