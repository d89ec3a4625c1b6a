//! The belt: rooms come back, no more are made than are filled at once, and nothing is waited for.

use std::sync::Arc;

use vastex_core::{Description, Geometry, GeometrySpec, Layer, LayerFormat, PoolLayout, Slot};
use vastex_wgpu::test_device::{TestDevice, finish};
use vastex_wgpu::{Belt, BeltCounts, BeltLayout, BeltTile, GpuError, Pool, limits, poll};

fn pool(gpu: &TestDevice, format: LayerFormat) -> Pool {
    let geometry = Geometry::new(GeometrySpec::image(1000, 1000)).unwrap();
    let description = Description::one_layer(geometry, format);
    let layout = PoolLayout::fit(&description, 1 << 20, limits(&gpu.device)).unwrap();
    Pool::new(&gpu.device, &gpu.queue, &layout, &[Layer::new("color", format)]).unwrap()
}

fn tile(layout: &BeltLayout) -> Vec<u8> {
    (0..layout.tile_bytes()).map(|n| (n % 251) as u8).collect()
}

fn upload(gpu: &TestDevice, pool: &Pool, tiles: &[BeltTile]) {
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    for (slot, tile) in (0..).zip(tiles) {
        pool.upload_from(&mut encoder, Slot::new(slot), tile).unwrap();
    }
    gpu.queue.submit([encoder.finish()]);
}

/// Until the GPU has given everything back.
fn settle(gpu: &TestDevice) {
    finish(&gpu.device);
    poll(&gpu.device).unwrap();
}

#[test]
fn rooms_come_back_and_no_more_are_made_than_are_filled_at_once() {
    let gpu = TestDevice::new();
    let pool = pool(&gpu, LayerFormat::Rgba8);
    let (belt, layout) = (Belt::new(&gpu.device, 1 << 20), pool.belt_layout().clone());
    let bytes = tile(&layout);
    for _ in 0..20 {
        let tiles: Vec<BeltTile> = (0..4).map(|_| belt.put(&layout, &bytes).unwrap()).collect();
        upload(&gpu, &pool, &tiles[..3]);
        // Three go back by the GPU, one as it is.
        drop(tiles);
        settle(&gpu);
    }
    assert_eq!(belt.counts(), BeltCounts { put: 80, refused: 0, made: 4 });
    assert_eq!(belt.bytes(), 4 * layout.bytes());
}

#[test]
fn commands_that_are_dropped_keep_no_room() {
    let gpu = TestDevice::new();
    let pool = pool(&gpu, LayerFormat::R8);
    let (belt, layout) = (Belt::new(&gpu.device, 1 << 20), pool.belt_layout().clone());
    for _ in 0..10 {
        let tile = belt.put(&layout, &tile(&layout)).unwrap();
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        pool.upload_from(&mut encoder, Slot::new(1), &tile).unwrap();
        drop(encoder);
        // They are recorded anew.
        upload(&gpu, &pool, std::slice::from_ref(&tile));
        drop(tile);
        settle(&gpu);
    }
    assert_eq!(belt.counts().made, 1);
}

#[test]
fn a_full_belt_says_so_at_once_and_rooms_give_way_to_those_of_others() {
    let gpu = TestDevice::new();
    let [wide, narrow] =
        [LayerFormat::Rgba8, LayerFormat::R8].map(|format| pool(&gpu, format).belt_layout().clone());
    let belt = Belt::new(&gpu.device, 2 * wide.bytes());
    let put = |layout: &Arc<BeltLayout>| belt.put(layout, &tile(layout));
    let (first, second) = (put(&wide).unwrap(), put(&wide).unwrap());
    assert!(put(&wide).is_none() && put(&narrow).is_none());
    assert_eq!(belt.counts(), BeltCounts { put: 2, refused: 2, made: 2 });
    drop(second);
    let other = put(&narrow).unwrap();
    assert!(belt.bytes() <= 2 * wide.bytes());
    drop((first, other));
    assert!(belt.bytes() <= 2 * wide.bytes());
    assert!(belt.put(&wide, &[0; 3]).is_none(), "that is no tile");
}

#[test]
fn what_does_not_fit_a_pool_is_refused() {
    let gpu = TestDevice::new();
    let [wide, narrow] = [LayerFormat::Rgba8, LayerFormat::R8].map(|format| pool(&gpu, format));
    let (belt, layout) = (Belt::new(&gpu.device, 1 << 20), narrow.belt_layout());
    let tile = belt.put(layout, &tile(layout)).unwrap();
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    assert!(matches!(wide.upload_from(&mut encoder, Slot::new(0), &tile), Err(GpuError::TileBytes { .. })));
    let slots = narrow.layout().slots();
    let beyond = narrow.upload_from(&mut encoder, Slot::new(slots), &tile);
    assert_eq!(beyond, Err(GpuError::NoSuchSlot { slot: slots, slots }));
}

#[test]
fn on_a_lost_device_there_is_no_room_and_nothing_panics() {
    let gpu = TestDevice::new();
    let pool = pool(&gpu, LayerFormat::Rgba8);
    let (belt, layout) = (Belt::new(&gpu.device, 1 << 20), pool.belt_layout().clone());
    let tiles: Vec<BeltTile> = (0..3).map(|_| belt.put(&layout, &tile(&layout)).unwrap()).collect();
    upload(&gpu, &pool, &tiles[..1]);
    gpu.device.destroy();
    drop(tiles);
    let _ = gpu.device.poll(wgpu::PollType::Poll);
    // What is mapped may be filled still, though nobody will read it.
    drop((0..9).map(|_| belt.put(&layout, &tile(&layout))).collect::<Vec<_>>());
    assert!(belt.bytes() <= 1 << 20);
    drop((belt, gpu));
}

#[test]
fn the_values_of_a_volumes_tile_are_looked_through_where_it_is_put() {
    let gpu = TestDevice::new();
    let belt = Belt::new(&gpu.device, 1 << 20);
    let range = |tile: [u32; 3], format, bytes: &[u8]| {
        let layout = BeltLayout::new(tile, &[Layer::new("value", format)]).unwrap();
        belt.put(&Arc::new(layout), bytes).unwrap().range()
    };
    assert_eq!(range([2; 3], LayerFormat::R8, &[51, 102, 51, 51, 255, 51, 51, 51]), [0.2, 1.0]);
    let any = [-f32::MAX, f32::MAX];
    assert_eq!(range([4, 2, 1], LayerFormat::R8, &[51; 8]), any, "of an image nobody asks");
    assert_eq!(range([2; 3], LayerFormat::Rg8, &[51; 16]), any, "what has two channels has no order");
}
