//! Channels that share one walk along each ray are what each of them is alone, however unlike they are: the
//! same everywhere in many bricks, without numbers, of levels that are not there, of levels of their own.

use std::sync::Arc;

use glam::{DVec3, Vec3};
use vastex::{LayerFormat, LevelRule, Region, TableChoice};
use vastex_viewer::volume::{
    VolumeCamera, VolumeChannel, VolumeDesc, VolumeError, VolumeFace, VolumeMode, VolumeRenderer, VolumeView,
};

use super::volume_reference::coarser_picture;
use super::volume_world::{ArrayVolume, PATIENCE, PICTURE, World, geometry, waves, within};

const SIZE: [u32; 3] = [40, 36, 28];

/// Detail everywhere; next to nothing but in a corner; and voxels of which one of eleven is no number, the
/// others as small as nothing else.
fn unlike() -> World {
    let in_corner = |at: [f64; 3]| if at.iter().all(|at| *at < 13.0) { waves(1.0)(at) } else { 0.0 };
    let odd = |at: [f64; 3]| {
        let nth = at.map(|at| at.floor() as u64).iter().sum::<u64>();
        if nth.is_multiple_of(11) { f64::NAN } else { 0.9 * waves(2.0)(at) }
    };
    let values: [&dyn Fn([f64; 3]) -> f64; 3] = [&waves(0.0), &in_corner, &odd];
    let volume = |value| Arc::new(ArrayVolume::new(geometry(SIZE, 16), LayerFormat::R32Float, value));
    let mut world = World::of(values.map(volume).to_vec(), 400, TableChoice::BySize);
    world.of.voxel = DVec3::ONE;
    world
}

/// In red, green and blue, so that each part of a pixel is of one channel, and in windows of their own.
fn channels(world: &World) -> Vec<VolumeChannel> {
    let looks = [(Vec3::X, [0.1, 0.9], 1.0), (Vec3::Y, [1.2, 0.0], 0.7), (Vec3::Z, [-0.2, 1.0], 1.4)];
    let channel = |(id, (color, range, gamma)): (&vastex::TextureId, (Vec3, [f32; 2], f32))| VolumeChannel {
        color,
        range,
        gamma,
        ..VolumeChannel::new(*id)
    };
    world.ids.iter().zip(looks).map(channel).collect()
}

/// From a face, and from within, so that levels change along the rays.
fn views() -> [(VolumeView, [u32; 2]); 2] {
    let (eye, target) = (DVec3::new(1.5, 2.5, 1.0), DVec3::new(30.0, 24.0, 20.0));
    let camera = VolumeCamera { target, eye, down: DVec3::Z, half_height: 0.7 };
    [(VolumeView::Face(VolumeFace::PlusZ), [40, 36]), (VolumeView::Around(camera), [28, 20])]
}

fn shows_each_as_it_is_alone(world: &mut World) {
    let all = channels(world);
    for mode in [VolumeMode::Mip, VolumeMode::Minip, VolumeMode::Average, VolumeMode::Iso] {
        let desc = |channels| VolumeDesc { mode, iso: 0.55, ..VolumeDesc::new(world.of, channels) };
        let (together, alone) = (desc(all.clone()), [0, 1, 2].map(|nth| desc(vec![all[nth]])));
        let (together, alone) = (world.renderer(together), alone.map(|desc| world.renderer(desc)));
        for (view, size) in views() {
            let drawn = world.shot(&together, view, size);
            let each = alone.each_ref().map(|renderer| world.shot(renderer, view, size));
            for nth in 0..3 {
                assert!(each[nth].iter().any(|pixel| pixel[nth] > 20), "{mode:?}: channel {nth} is seen");
            }
            for (at, pixel) in drawn.iter().enumerate() {
                let of = |nth: usize| each[nth][at];
                let is_so = match mode {
                    VolumeMode::Iso => (0..3).any(|nth| *pixel == of(nth)),
                    _ => *pixel == [of(0)[0], of(1)[1], of(2)[2], 255],
                };
                assert!(
                    is_so,
                    "{mode:?}, {view:?}: pixel {at} is {pixel:?}, not {:?}",
                    [of(0), of(1), of(2)]
                );
            }
        }
        for renderer in alone.into_iter().chain([together]) {
            renderer.forget(&mut world.textures);
        }
    }
}

#[test]
fn channels_of_one_walk_are_what_each_is_alone() {
    let mut world = unlike();
    // Of the first one all is there, and of the others only what always is.
    let ticket = world.textures.ahead().pin(world.ids[0], &Region::whole()).unwrap();
    for _ in 0..PATIENCE {
        world.textures.update().unwrap();
        if ticket.progress().resident == ticket.progress().pages {
            break;
        }
    }
    assert_eq!(ticket.progress().resident, ticket.progress().pages);
    shows_each_as_it_is_alone(&mut world);
    world.load_all();
    shows_each_as_it_is_alone(&mut world);
}

/// A walk goes as the first channel's levels are: a channel that is shown on a finer one, by a rule of its
/// own, has several bricks where the first has one.
#[test]
fn a_channel_of_finer_levels_is_seen_in_all_of_its_bricks() {
    let center = [22.5, 9.5, 20.5];
    let spot = move |at: [f64; 3]| {
        let away = (0..3).map(|axis| (at[axis] - center[axis]).powi(2)).sum::<f64>().sqrt();
        if away < 3.0 { 1.0 } else { 0.1 + 0.05 * waves(1.0)(at) }
    };
    let geometry = geometry([32, 32, 32], 8);
    let dim = |at| 0.9 * waves(0.0)(at);
    let first = ArrayVolume::new(geometry.clone(), LayerFormat::R32Float, dim);
    let second = ArrayVolume::new(geometry, LayerFormat::R32Float, spot);
    let mut world = World::of(vec![Arc::new(first), Arc::new(second)], 400, TableChoice::BySize);
    world.of.voxel = DVec3::ONE;
    let rule = |finest, coarsest| LevelRule { finest, coarsest, ..LevelRule::default() };
    world.textures.texture_mut(world.ids[0]).unwrap().set_levels(rule(1, u8::MAX));
    world.textures.texture_mut(world.ids[1]).unwrap().set_levels(rule(0, 0));
    world.load_all();
    let all = channels(&world);
    let second = VolumeChannel { range: [0.0, 1.0], gamma: 1.0, ..all[1] };
    for mode in [VolumeMode::Mip, VolumeMode::Iso] {
        let desc = VolumeDesc { mode, iso: 0.97, ..VolumeDesc::new(world.of, vec![all[0], second]) };
        let renderer = world.renderer(desc);
        let drawn = world.shot(&renderer, VolumeView::Face(VolumeFace::PlusZ), [32, 32]);
        let at_spot = drawn[9 * 32 + 22];
        assert!(at_spot[1] > 120, "{mode:?}: {at_spot:?}");
    }
}

/// A walk, the place at which it meets a surface and that surface's slope are all of the level of the first
/// channel's bias, whatever the bias of the channel that has the surface.
#[test]
fn a_surface_is_of_the_level_of_the_walk() {
    let geometry = geometry(SIZE, 16);
    let volume = |value: &dyn Fn([f64; 3]) -> f64| {
        Arc::new(ArrayVolume::new(geometry.clone(), LayerFormat::R32Float, value))
    };
    let mut world = World::of(vec![volume(&|_| 0.0), volume(&waves(1.0))], 400, TableChoice::BySize);
    world.of.voxel = DVec3::ONE;
    world.load_all();
    let desc = VolumeDesc {
        mode: VolumeMode::Iso,
        iso: 0.55,
        is_exact: true,
        ..VolumeDesc::new(world.of, channels(&world)[..2].to_vec())
    };
    let renderer = world.renderer(desc.clone());
    let (view, size) = (VolumeView::Face(VolumeFace::PlusZ), [40, 36]);
    let mut of_levels = Vec::new();
    for level in [0.0, 1.0] {
        let expected = coarser_picture(&desc, &world.arrays(&desc), &view, size, level);
        for other in [0.0, 1.0, 2.0] {
            for (id, bias) in world.ids.clone().into_iter().zip([level, other]) {
                let rule = LevelRule { bias: bias as f32, ..LevelRule::default() };
                world.textures.texture_mut(id).unwrap().set_levels(rule);
            }
            world.textures.update().unwrap();
            let drawn = world.shot(&renderer, view, size);
            let (share, _) = within(&drawn, &expected, 2.0);
            assert!(share >= 0.999, "level {level}, beside {other}: {share}");
        }
        of_levels.push(expected);
    }
    let unlike =
        of_levels[0].iter().zip(&of_levels[1]).filter(|(one, other)| (one[1] - other[1]).abs() > 4.0);
    assert!(unlike.count() > 200, "levels are told apart");
}

/// No order of channels: also where some are shown on other levels than the first one, of which all is there.
#[test]
fn emission_hangs_on_no_order_of_channels() {
    let mut world = unlike();
    let all = channels(&world);
    let ordered = [[0, 1, 2], [1, 2, 0], [2, 0, 1]].map(|order| {
        let channels = order.map(|nth: usize| VolumeChannel { opacity: 0.3, ..all[nth] }).to_vec();
        VolumeDesc { mode: VolumeMode::Emission, ..VolumeDesc::new(world.of, channels) }
    });
    let mut renderer = world.renderer(ordered[0].clone());
    let mut drawn = |world: &mut World| {
        ordered.each_ref().map(|desc| {
            renderer.show(&mut world.textures, desc.clone()).unwrap();
            views().map(|(view, size)| world.shot(&renderer, view, size)).concat()
        })
    };
    let mut pictures = Vec::new();
    for is_all_there in [false, true] {
        let whole = Region::whole();
        let ticket = world.textures.ahead().pin(world.ids[0], &whole).unwrap();
        (0..50).for_each(|_| world.textures.update().unwrap());
        assert_eq!(ticket.progress().resident, ticket.progress().pages);
        if is_all_there {
            world.load_all();
        }
        let [first, others @ ..] = drawn(&mut world);
        for other in others {
            let apart = first.iter().zip(&other).flat_map(|(a, b)| (0..3).map(|c| a[c].abs_diff(b[c])));
            assert!(apart.max() <= Some(1), "{is_all_there}");
        }
        pictures.push(first);
    }
    assert_ne!(pictures[0], pictures[1], "other levels are seen at first");
}

#[test]
fn channels_of_other_sizes_are_refused() {
    let volume = |size| Arc::new(ArrayVolume::new(geometry(size, 16), LayerFormat::R16, waves(0.0)));
    let volumes = vec![volume(SIZE), volume(SIZE), volume([40, 36, 29])];
    let mut world = World::of(volumes, 200, TableChoice::Direct);
    let all = world.desc(VolumeMode::Mip);
    let refused = VolumeRenderer::new(&world.gpu, &mut world.textures, all.clone(), PICTURE);
    assert!(matches!(refused, Err(VolumeError::Unlike)), "{refused:?}");
    let two = VolumeDesc { channels: all.channels[..2].to_vec(), ..all.clone() };
    let mut renderer = VolumeRenderer::new(&world.gpu, &mut world.textures, two, PICTURE).unwrap();
    let shown = renderer.show(&mut world.textures, all);
    assert!(matches!(shown, Err(VolumeError::Unlike)), "{shown:?}");
}
