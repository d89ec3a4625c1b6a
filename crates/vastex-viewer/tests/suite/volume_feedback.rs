//! Which bricks of a volume are loaded: those that rays meet, beside an oracle that marches each of them.

use std::collections::BTreeSet;
use std::sync::Arc;

use glam::DVec3;
use vastex::{Dims, LayerFormat, PageId, TableChoice};
use vastex_viewer::volume::{VolumeCamera, VolumeDesc, VolumeFace, VolumeMode, VolumeView};

use super::volume_reference::bricks_met;
use super::volume_world::{ArrayVolume, World, geometry};

pub(crate) const PAGE: u32 = 16;

/// A ball that glows in the middle of nothing.
pub(crate) fn ball([x, y, z]: [f64; 3]) -> f64 {
    let from_middle = DVec3::new(x, y, z) - DVec3::new(64.0, 56.0, 48.0);
    (1.6 - from_middle.length() / 24.0).clamp(0.0, 0.9)
}

fn world_of(value: impl Fn([f64; 3]) -> f64, slots: u64, table: TableChoice) -> World {
    let volume = ArrayVolume::new(geometry([128, 112, 96], PAGE), LayerFormat::R16, value);
    World::of(vec![Arc::new(volume)], slots, table)
}

/// Level and place of each resident brick that is no tail: all of them, and those that are in view.
fn resident(world: &World) -> [BTreeSet<(u8, [u32; 3])>; 2] {
    let texture = world.textures.texture(world.ids[0]).unwrap();
    let tail = texture.description().geometry.tail().first_level();
    let slots = world.textures.inspect().slots(texture.pool().unwrap());
    let place = |page: PageId| {
        let pos = page.pos(Dims::D3);
        (pos.level, [pos.x, pos.y, pos.z])
    };
    let paged = || slots.iter().flatten().filter(|usage| place(usage.page).0 < tail);
    let in_view = paged().filter(|usage| usage.is_in_view).map(|usage| place(usage.page)).collect();
    [paged().map(|usage| place(usage.page)).collect(), in_view]
}

/// Those and all that lie above them.
pub(crate) fn with_ancestors(bricks: &BTreeSet<(u8, [u32; 3])>) -> BTreeSet<(u8, [u32; 3])> {
    let above = |&(level, at): &(u8, [u32; 3])| (0..8).map(move |n| (level + n, at.map(|side| side >> n)));
    bricks.iter().flat_map(above).collect()
}

/// Where it has converged, every brick that the ray of any pixel meets through which light comes is resident.
/// At most a tenth of the bricks that are in view is met by none; those above bricks that are met apart.
#[test]
fn bricks_are_loaded_where_rays_meet_them() {
    for table in [TableChoice::Direct, TableChoice::Hashed] {
        let mut world = world_of(ball, 600, table);
        let around = VolumeCamera::around(&world.of, [1.0, 0.7, 0.5], [0.0, 0.0, 1.0]);
        for (mode, view, size) in [
            (VolumeMode::Emission, VolumeView::Face(VolumeFace::PlusZ), [128, 112]),
            (VolumeMode::Emission, VolumeView::Around(around), [96, 80]),
            (VolumeMode::Mip, VolumeView::Around(around), [96, 80]),
        ] {
            let desc = VolumeDesc { density: 20.0, ..world.desc(mode) };
            let (_, frames) = world.drawn(desc.clone(), view, size);
            let stats = world.textures.stats().pager;
            assert_eq!((stats.reloaded, stats.bias_eighths), (0, 0));
            // A jitter cycle, all pixels once or twice, and what the answers take.
            assert!(frames < 50, "{mode:?} {table:?}: {frames}");
            let channels = world.arrays(&desc);
            let [all, in_view] = resident(&world);
            let by_any = bricks_met(&desc, &channels, (&view, size), PAGE);
            let missing: Vec<_> = by_any.difference(&all).collect();
            assert!(missing.is_empty(), "{mode:?} {table:?}: {missing:?} of {}", by_any.len());
            let above: BTreeSet<_> = with_ancestors(&by_any).difference(&by_any).copied().collect();
            let own: BTreeSet<_> = in_view.difference(&above).copied().collect();
            let beyond = own.difference(&by_any).count();
            assert!(beyond * 10 <= own.len(), "{mode:?} {table:?}: {beyond} of {}", own.len());
            assert!(by_any.len() > 200, "most bricks are met");
        }
    }
}

/// What hides nothing of what is behind it would need many more bricks: those behind the ball are not loaded.
#[test]
fn what_is_hidden_is_not_loaded() {
    let mut world = world_of(ball, 600, TableChoice::Direct);
    let view = VolumeView::Face(VolumeFace::PlusZ);
    let desc = VolumeDesc { density: 20.0, ..world.desc(VolumeMode::Emission) };
    world.drawn(desc, view, [128, 112]);
    let [all, _] = resident(&world);
    let behind = (0, [4, 3, 4]);
    assert!(!all.contains(&behind), "it lies behind the middle of the ball");
    world.drawn(world.desc(VolumeMode::Mip), view, [128, 112]);
    assert!(resident(&world)[0].contains(&behind), "mip looks through it");
}
