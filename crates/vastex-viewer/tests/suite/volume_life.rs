//! What images have and volumes have with them: contents that change, pins, prefetches, another device,
//! several views.

use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};

use vastex::source::{Codec, ReadFuture, Tile};
use vastex::{
    Description, LayerFormat, PageId, PagePos, Region, TableChoice, TextureId, TextureSettings, TileSource,
    Urgency, ViewId, ViewSettings,
};
use vastex_viewer::Gpu;
use vastex_viewer::volume::{VolumeChannel, VolumeDesc, VolumeFace, VolumeMode, VolumeView};

use super::volume_world::{World, geometry};

const SIZE: [u32; 2] = [40, 36];
const FACE: VolumeView = VolumeView::Face(VolumeFace::PlusZ);

fn world() -> World {
    World::new(&geometry([40, 36, 28], 16), LayerFormat::R8, 1, 200, TableChoice::BySize)
}

/// A volume of one value, which changes.
struct Changing {
    description: Arc<Description>,
    value: AtomicU8,
}

impl TileSource for Changing {
    fn description(&self) -> &Arc<Description> {
        &self.description
    }

    fn read(&self, _: PagePos) -> ReadFuture<'_> {
        let bytes = vec![self.value.load(Ordering::Relaxed); self.description.tile_bytes()];
        Box::pin(async move { Ok(Tile { codec: Codec::Raw, bytes: bytes.into() }) })
    }
}

#[test]
fn what_changed_is_drawn_anew_and_no_range_of_before_hides_it() {
    let mut world = world();
    let geometry = geometry([40, 36, 28], 16);
    let description = Arc::new(Description::one_layer(geometry, LayerFormat::R8));
    let source = Arc::new(Changing { description, value: AtomicU8::new(60) });
    let tiles: Arc<dyn TileSource> = source.clone();
    let prepared = world.textures.preparer().read_blocking(tiles, TextureSettings::default()).unwrap();
    let id = world.textures.add(prepared).unwrap();
    for mode in [VolumeMode::Mip, VolumeMode::Emission, VolumeMode::Minip] {
        let channel = VolumeChannel { opacity: 0.5, ..VolumeChannel::new(id) };
        let desc = VolumeDesc { mode, ..VolumeDesc::new(world.of, vec![channel]) };
        for value in [60, 0, 200] {
            source.value.store(value, Ordering::Relaxed);
            world.textures.texture_mut(id).unwrap().invalidate(&Region::whole());
            let (drawn, _) = world.drawn(desc.clone(), FACE, SIZE);
            let is_lit = |pixel: &[u8; 4]| match mode {
                VolumeMode::Emission => (pixel[0] > 20) == (value > 0),
                _ => pixel[0].abs_diff(value / 2 + value % 2) <= 100 && (pixel[0] > 0) == (value > 0),
            };
            assert!(drawn.iter().all(is_lit), "{mode:?} {value}: {:?}", drawn[700]);
        }
    }
}

#[test]
fn what_is_pinned_or_prefetched_is_loaded_out_of_view() {
    let mut world = world();
    let slice = VolumeView::Slice { axis: 2, voxel: 1 };
    world.drawn(world.desc(VolumeMode::Mip), slice, SIZE);
    let (texture, state) = (world.ids[0], |world: &World, z| {
        let page = PageId::new(world.ids[0].number(), vastex::Dims::D3, PagePos { level: 0, x: 1, y: 1, z });
        world.textures.inspect().state(page.unwrap())
    });
    let is_there = |world: &World, z| matches!(state(world, z), vastex::diagnostics::PageState::Resident(_));
    assert!(is_there(&world, 0) && !is_there(&world, 1), "a slice wants the bricks that it cuts");
    let behind = Region { texels: [16..32, 16..32, 16..28], levels: 0..=0 };
    let ticket = world.textures.ahead().pin(texture, &behind).unwrap();
    world.drawn(world.desc(VolumeMode::Mip), slice, SIZE);
    assert!(is_there(&world, 1) && ticket.progress().resident > 0, "{:?}", ticket.progress());
    assert!(world.textures.ahead().release(&ticket));
    let beside = Region { texels: [0..16, 0..16, 16..28], levels: 0..=0 };
    let ticket = world.textures.ahead().prefetch(texture, &beside, Urgency::default()).unwrap();
    world.drawn(world.desc(VolumeMode::Mip), slice, SIZE);
    assert!(!ticket.is_open(), "{:?}", ticket.progress());
}

#[test]
fn another_device_shows_the_same() {
    let mut world = world();
    for mode in [VolumeMode::Mip, VolumeMode::Emission] {
        let desc = world.desc(mode);
        let (before, _) = world.drawn(desc.clone(), FACE, SIZE);
        let gpu = pollster::block_on(Gpu::headless()).unwrap();
        world.textures.memory().restore(&gpu.device, &gpu.queue).unwrap();
        world.gpu = gpu;
        let (after, _) = world.drawn(desc, FACE, SIZE);
        assert!(before == after, "{mode:?}");
    }
}

/// The numbers of rays and bricks are those of each view: one of rays beside one of surfaces.
#[test]
fn views_of_rays_come_and_go() {
    let mut world = world();
    let (alone, frames) = world.drawn(world.desc(VolumeMode::Average), FACE, SIZE);
    let beside = world.textures.add_view(ViewSettings::default().with_bricks_of_a_ray(120)).unwrap();
    let (with_another, _) = world.drawn(world.desc(VolumeMode::Average), FACE, SIZE);
    assert!(alone == with_another);
    assert!(world.textures.view_mut(beside).unwrap().remove());
    let (_, again) = world.drawn(world.desc(VolumeMode::Average), FACE, SIZE);
    assert!(again <= frames, "what is removed is not waited for: {again} frames after {frames}");
}

/// 0 bricks of a ray are what surfaces have: nothing is held for rays that rest, until it is said again how
/// many they meet.
#[test]
fn a_view_whose_rays_meet_no_bricks_is_one_of_surfaces() {
    let mut world = world();
    let desc = world.desc(VolumeMode::Average);
    let (before, _) = world.drawn(desc.clone(), FACE, SIZE);
    let wanted = world.textures.stats().pager.wanted;
    let mut view = world.textures.view_mut(ViewId::MAIN).unwrap();
    view.set_bricks_of_a_ray(0);
    // One of surfaces has no gaps to be looked for, and converges without.
    view.set_resting(true);
    for frame in 0..2 * u64::from(vastex::JITTER_CYCLE) {
        let mut encoder = world.gpu.device.create_command_encoder(&Default::default());
        let mut view = world.textures.view_mut(ViewId::MAIN).unwrap();
        view.feedback(&mut encoder, SIZE, |_, _| ()).unwrap();
        world.gpu.queue.submit([encoder.finish()]);
        world.textures.update().unwrap();
        assert_eq!(world.textures.stats().pager.missing, 0, "frame {frame}");
    }
    let stats = world.textures.stats();
    assert!(
        stats.converged && 2 * stats.pager.wanted < wanted,
        "nothing is held: {stats:?}, {wanted} before"
    );
    let (after, _) = world.drawn(desc, FACE, SIZE);
    assert!(before == after);
}

/// A slot that was another volume's says nothing of what is in it now: the tail of a bright volume comes
/// where dark bricks were.
#[test]
fn no_range_of_a_volume_that_is_gone_hides_another() {
    let mut world = World::new(&geometry([40, 36, 28], 16), LayerFormat::R8, 1, 30, TableChoice::BySize);
    let geometry = geometry([40, 36, 28], 16);
    let description = Arc::new(Description::one_layer(geometry, LayerFormat::R8));
    let add = |world: &mut World, value: u8| {
        let source = Changing { description: description.clone(), value: AtomicU8::new(value) };
        let tiles: Arc<dyn TileSource> = Arc::new(source);
        let prepared = world.textures.preparer().read_blocking(tiles, TextureSettings::default()).unwrap();
        world.textures.add(prepared).unwrap()
    };
    for mode in [VolumeMode::Mip, VolumeMode::Emission] {
        let dark = add(&mut world, 0);
        let of = |world: &World, id: TextureId| VolumeDesc {
            mode,
            ..VolumeDesc::new(world.of, vec![VolumeChannel::new(id)])
        };
        let desc = of(&world, dark);
        world.drawn(desc, FACE, SIZE);
        assert!(world.textures.remove(dark));
        let bright = add(&mut world, 200);
        let desc = of(&world, bright);
        // A picture of few pixels, which is that of the tail.
        let (drawn, _) = world.drawn(desc, FACE, [4, 4]);
        assert!(drawn.iter().any(|pixel| pixel[0] > 100), "{mode:?}: {drawn:?}");
        assert!(world.textures.remove(bright));
    }
}
