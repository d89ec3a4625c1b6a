//! How much is loaded that no ray meets: of all that is resident of a volume that nobody has looked at
//! before, in every mode but the least values, of one channel and of two.

use std::collections::BTreeSet;
use std::sync::Arc;

use glam::DVec3;
use vastex::{Dims, LayerFormat, PageId, TableChoice, TextureId};
use vastex_viewer::volume::{VolumeCamera, VolumeDesc, VolumeFace, VolumeMode, VolumeView};

use super::volume_feedback::{PAGE, ball, with_ancestors};
use super::volume_real::real_in_bricks;
use super::volume_reference::bricks_met;
use super::volume_world::{ArrayVolume, World, geometry};

/// Balls that glow in the middle of nothing, each channel's a bit further along x.
fn balls(channels: u32) -> World {
    let volume = |nth: u32| {
        let value = move |[x, y, z]: [f64; 3]| ball([x - 12.0 * f64::from(nth), y, z]);
        Arc::new(ArrayVolume::new(geometry([128, 112, 96], PAGE), LayerFormat::R16, value))
    };
    World::of((0..channels).map(volume).collect(), 600 * u64::from(channels), TableChoice::Direct)
}

/// Level and place of each brick of a texture that is resident, in view or no more, and that is no tail.
fn resident(world: &World, id: TextureId) -> BTreeSet<(u8, [u32; 3])> {
    let texture = world.textures.texture(id).unwrap();
    let tail = texture.description().geometry.tail().first_level();
    let place = |page: PageId| {
        let pos = page.pos(Dims::D3);
        (pos.level, [pos.x, pos.y, pos.z])
    };
    let slots = world.textures.inspect().slots(texture.pool().unwrap());
    let own = slots.iter().flatten().filter(|usage| usage.page.texture() == id.number());
    own.map(|usage| place(usage.page)).filter(|(level, _)| *level < tail).collect()
}

/// Draws a volume that nobody has looked at before. Every brick that a ray meets is there then. Of what is
/// there beside, bricks above those that are met do not count, neither as too many nor as wanted; of the
/// others at most a tenth is met by no ray.
fn check_what_is_resident(
    world: &mut World,
    desc: &VolumeDesc,
    (view, size): (VolumeView, [u32; 2]),
    page: u32,
) {
    world.drawn(desc.clone(), view, size);
    let stats = world.textures.stats().pager;
    assert_eq!((stats.evicted, stats.bias_eighths), (0, 0));
    let met = bricks_met(desc, &world.arrays(desc), (&view, size), page);
    let above: BTreeSet<_> = with_ancestors(&met).difference(&met).copied().collect();
    for id in &world.ids {
        let what = format!("{:?}, {} channels, {view:?}, {id:?}", desc.mode, world.ids.len());
        let all = resident(world, *id);
        let missing: Vec<_> = met.difference(&all).collect();
        assert!(missing.is_empty(), "{what}: {missing:?} of {}", met.len());
        let own: BTreeSet<_> = all.difference(&above).copied().collect();
        let beyond = own.difference(&met).count();
        assert!(beyond * 10 <= own.len(), "{what}: {beyond} of {}", own.len());
        assert!(met.len() > 60, "{what}: {}", met.len());
    }
}

#[test]
fn little_is_resident_that_no_ray_meets() {
    for (mode, channels, is_around) in [
        (VolumeMode::Emission, 1, true),
        (VolumeMode::Emission, 2, false),
        (VolumeMode::Iso, 1, false),
        (VolumeMode::Iso, 2, true),
        (VolumeMode::Average, 2, true),
        (VolumeMode::Mip, 1, true),
    ] {
        let mut world = balls(channels);
        let around = VolumeCamera::around(&world.of, [1.0, 0.7, 0.5], [0.0, 0.0, 1.0]);
        let picture = match is_around {
            true => (VolumeView::Around(around), [96, 80]),
            false => (VolumeView::Face(VolumeFace::PlusZ), [128, 112]),
        };
        let desc = VolumeDesc { density: 20.0, ..world.desc(mode) };
        check_what_is_resident(&mut world, &desc, picture, PAGE);
    }
}

/// The real head in three channels, of voxels that are half as long again along z.
#[test]
fn little_of_the_real_head_is_resident_that_no_ray_meets() {
    let mut world = real_in_bricks("head.zip", PAGE, 4000);
    world.of.voxel = DVec3::new(1.0, 1.0, 1.5);
    let around = VolumeCamera::around(&world.of, [1.0, 0.7, 0.5], [0.0, 0.0, 1.0]);
    let desc = VolumeDesc { density: 20.0, ..world.desc(VolumeMode::Emission) };
    check_what_is_resident(&mut world, &desc, (VolumeView::Around(around), [72, 64]), PAGE);
}
