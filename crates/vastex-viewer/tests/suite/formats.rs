//! Volumes on devices that filter some formats and others not: whatever the pool holds, the picture is the
//! reference.

use std::sync::Arc;

use vastex::{LayerFormat, TableChoice, VolumeFilters};
use vastex_viewer::Gpu;
use vastex_viewer::volume::{VolumeDesc, VolumeFace, VolumeMode, VolumeView};

use super::volume_world::{ArrayVolume, World, geometry, waves};

/// What the device of the tests turns out to filter: whatever passes is within the tolerance, so that nobody
/// sees bands.
#[test]
fn filters_are_tried_once_and_kept() {
    let gpu = pollster::block_on(Gpu::headless()).unwrap();
    let first = VolumeFilters::of(&gpu.device, &gpu.queue);
    // Floats of the software driver, and of every GPU that there is.
    assert!(first.r16f, "{first:?}");
    let again = pollster::block_on(Gpu::headless()).unwrap();
    assert_eq!(VolumeFilters::of(&again.device, &again.queue), first);
}

#[test]
fn every_rung_of_the_ladder_draws_the_reference() {
    let none = VolumeFilters { r8: false, r16: false, high_low: false, r16f: false, r32f: false };
    let by_r16 = VolumeFilters { r16: true, ..none };
    let by_halves = VolumeFilters { high_low: true, ..none };
    let by_floats = VolumeFilters { r16f: true, ..none };
    for (format, filters, told) in [
        (LayerFormat::R8, by_r16, "voxels of r16"),
        (LayerFormat::R8, by_floats, "voxels of r16f"),
        (LayerFormat::R8, none, "voxels of r8, blended by the shader"),
        (LayerFormat::R16, by_r16, "voxels of r16"),
        (LayerFormat::R16, by_halves, "voxels of r16, filtered in two halves"),
        (LayerFormat::R16, none, "voxels of r16, blended by the shader"),
        (LayerFormat::R32Float, none, "voxels of r32f, blended by the shader"),
    ] {
        let volume = Arc::new(ArrayVolume::new(geometry([40, 36, 28], 16), format, waves(0.0)));
        let mut world = World::filtered(vec![volume], 400, TableChoice::BySize, Some(filters));
        let tiles = world.textures.stats().pools[0].tiles.to_string();
        assert!(tiles.ends_with(told), "{tiles}");
        // Halves are blended by the device in as many bits as it blends 8 with.
        let (most, share) = if filters == by_halves { (4.0, 0.9) } else { (4.0, 0.99) };
        let view = VolumeView::Face(VolumeFace::PlusX);
        let desc = world.desc(VolumeMode::Average);
        let (within, largest) = world.compare(&desc, view, [30, 24], most);
        assert!(within >= share, "{format:?}, {filters:?}: {within}, up to {largest}");
        let desc = VolumeDesc { is_exact: true, ..desc };
        let (within, largest) = world.compare(&desc, view, [30, 24], 2.0);
        assert!(within >= 0.999, "{format:?}, {filters:?}, blended exactly: {within}, up to {largest}");
    }
}
