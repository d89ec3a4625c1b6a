//! What is refused, and what a lost device looks like.

use vastex_core::{
    ArrayLimits, ChangeRule, Description, Geometry, GeometrySpec, Layer, LayerFormat, PageId, PagePos,
    PoolLayout, Slot, TableChange, TableEntry,
};
use vastex_wgpu::test_device::TestDevice;
use vastex_wgpu::{
    FeedbackMode, FeedbackScale, FeedbackTarget, GpuError, ParamStore, Pool, PoolTableChanger, PoolTables,
    RawFeedback, Readback, ReadbackPipelines, Views, limits,
};

use crate::common::{GPU, NUMBER};

fn layers(format: LayerFormat) -> [Layer; 1] {
    [Layer::new("color", format)]
}

fn geometry() -> Geometry {
    Geometry::new(GeometrySpec::image(1000, 1000)).unwrap()
}

fn layout(limits: ArrayLimits) -> PoolLayout {
    PoolLayout::fit(&Description::one_layer(geometry(), LayerFormat::Rgba8), 1 << 20, limits).unwrap()
}

#[test]
fn a_pool_refuses_what_does_not_fit_it() {
    let gpu = &*GPU;
    let layout = layout(limits(&gpu.device));
    let pool = Pool::new(&gpu.device, &gpu.queue, &layout, &layers(LayerFormat::Rgba8)).unwrap();
    let slots = layout.slots();
    let beyond = pool.upload(&gpu.queue, Slot::new(slots), &[]);
    assert_eq!(beyond, Err(GpuError::NoSuchSlot { slot: slots, slots }));
    let short = pool.upload(&gpu.queue, Slot::new(0), &[0; 9]);
    assert_eq!(short, Err(GpuError::TileBytes { got: 9, expected: layout.tile_bytes }));
    let wrong = Pool::new(&gpu.device, &gpu.queue, &layout, &layers(LayerFormat::R8));
    assert!(matches!(wrong, Err(GpuError::PoolFormats { .. })));
    let wide = PoolLayout { grid: [1000, layout.grid[1], layout.grid[2]], ..layout };
    assert!(matches!(
        Pool::new(&gpu.device, &gpu.queue, &wide, &layers(LayerFormat::Rgba8)),
        Err(GpuError::PoolLimits { .. })
    ));
}

#[test]
fn a_table_beyond_the_device_is_refused() {
    let geometry = Geometry::new(GeometrySpec::image(1 << 31, 1 << 30)).unwrap();
    let (device, mode) = (&GPU.device, FeedbackMode::Separate);
    assert!(PoolTables::full_entries(&geometry) > PoolTables::most_entries(device, mode));
    let mut direct = PoolTables::direct(device, mode).unwrap();
    assert!(!direct.has_room(&geometry));
    assert!(matches!(direct.add(NUMBER, &geometry, Slot::new(0)), Err(GpuError::TableTooLarge { .. })));
    // A hashed one fits whatever the texture's size.
    let mut hashed = PoolTables::hashed(device, &GPU.queue, mode, 100).unwrap();
    assert!(hashed.has_room(&geometry) && hashed.add(NUMBER, &geometry, Slot::new(0)).is_ok());
}

#[test]
fn a_target_of_no_pixels_or_too_many_is_refused() {
    for picture in [[0, 10], [10, 0], [u32::MAX, 10]] {
        let target = FeedbackTarget::new(&GPU.device, picture, FeedbackScale::Reduced);
        assert!(matches!(target, Err(GpuError::TargetSize { .. })), "{picture:?}");
    }
}

#[test]
fn a_lost_device_is_an_error_wherever_something_is_read() {
    let gpu = TestDevice::new();
    let (device, queue) = (&gpu.device, &gpu.queue);
    let target = FeedbackTarget::new(device, [64, 64], FeedbackScale::Reduced).unwrap();
    let views = Views::new(device, queue, FeedbackMode::Separate);
    let pipelines = ReadbackPipelines::new(device, FeedbackMode::Separate);
    let mut readback = Readback::new(device, &pipelines, target.raw()).unwrap();
    let record = |readback: &mut Readback, frame| {
        let mut encoder = device.create_command_encoder(&Default::default());
        drop(target.begin(device, &mut encoder, &views, 0, frame, 1.0));
        assert!(readback.record(device, &mut encoder, frame));
        queue.submit([encoder.finish()]);
    };
    let (layout, geometry) = (layout(limits(device)), geometry());
    let pool = Pool::new(device, queue, &layout, &layers(LayerFormat::Rgba8)).unwrap();
    let mode = FeedbackMode::Separate;
    let mut tables = PoolTables::direct(device, mode).unwrap();
    tables.add(NUMBER, &geometry, Slot::new(0)).unwrap();
    let changer = PoolTableChanger::new(device, mode);
    record(&mut readback, 1);
    assert!(readback.wait(device, queue, 1).is_ok());
    device.destroy();
    record(&mut readback, 2);
    assert_eq!(readback.wait(device, queue, 2), Err(GpuError::DeviceLost));
    record(&mut readback, 3);
    let polled = vastex_wgpu::poll(device).and_then(|()| readback.poll());
    assert_eq!(polled, Err(GpuError::DeviceLost));
    assert_eq!(RawFeedback::read(device, queue, target.raw()), Err(GpuError::DeviceLost));

    // So it is wherever something is made; what only writes to what exists goes on in silence.
    let made = Pool::new(device, queue, &layout, &layers(LayerFormat::Rgba8));
    assert_eq!(made.unwrap_err(), GpuError::DeviceLost);
    assert_eq!(PoolTables::direct(device, mode).unwrap_err(), GpuError::DeviceLost);
    assert_eq!(PoolTables::hashed(device, queue, mode, 9).unwrap_err(), GpuError::DeviceLost);
    assert_eq!(ParamStore::new(device, 5).unwrap_err(), GpuError::DeviceLost);
    let made = FeedbackTarget::new(device, [64, 64], FeedbackScale::Reduced);
    assert_eq!(made.unwrap_err(), GpuError::DeviceLost);
    assert_eq!(Readback::new(device, &pipelines, target.raw()).unwrap_err(), GpuError::DeviceLost);
    pool.upload(queue, Slot::new(0), &vec![0; layout.tile_bytes as usize]).unwrap();
    let page = PageId::new(NUMBER, geometry.dims(), PagePos::new_2d(0, 1, 1)).unwrap();
    let change = TableChange { page, rule: ChangeRule::Coarser, entry: TableEntry::new(0, Slot::new(1)) };
    let mut encoder = device.create_command_encoder(&Default::default());
    let mut budget = u64::MAX;
    let applied = tables.apply(&changer, device, queue, &mut encoder, &[change], &mut |_, _| (), &mut budget);
    assert_eq!(applied.unwrap_err(), GpuError::DeviceLost);
}
