//! What textures outlive: devices that can do less, restores that fail, updates that fail in one pool, groups
//! that come and go.

use std::sync::Arc;

use vastex::source::{Codec, ReadFuture, Tile};
use vastex::{
    AddressMode, BindingPlace, Description, Error, FeedbackMode, Geometry, GeometrySpec, GpuError, Layer,
    LayerFormat, PagePos, Region, Settings, TextureId, Textures, TileSource,
};
use vastex_wgpu::test_device::{TestDevice, fail_after};

use crate::common::{Mapping, PICTURE, Screen, property, settings};

const SIZE: [u32; 2] = [1000, 777];
const UNKNOWN: [u8; 4] = [255, 0, 255, 255];

/// Of one value in every layer.
struct Plain(Arc<Description>);

impl Plain {
    fn of_layers(layers: Vec<Layer>) -> Arc<dyn TileSource> {
        let spec = GeometrySpec { page: 32, ..GeometrySpec::image(300, 300) };
        Arc::new(Plain(Arc::new(Description::new(Geometry::new(spec).unwrap(), layers))))
    }
}

impl TileSource for Plain {
    fn description(&self) -> &Arc<Description> {
        &self.0
    }

    fn read(&self, _: PagePos) -> ReadFuture<'_> {
        let bytes = vec![7; self.0.tile_bytes()].into();
        Box::pin(async move { Ok(Tile { codec: Codec::Raw, bytes }) })
    }
}

fn textures(gpu: &TestDevice) -> Textures {
    Textures::new(&gpu.device, &gpu.queue, Settings { picture: [160, 120], ..settings() }).unwrap()
}

/// What is bound is what the layout of the kinds asks for.
fn check_bindings(textures: &Textures, gpu: &TestDevice, texture: TextureId) {
    let kinds = textures.kinds(texture).unwrap();
    let entries = textures.bindings().entries(texture).unwrap();
    let scope = gpu.device.push_error_scope(wgpu::ErrorFilter::Validation);
    let _group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &textures.bind_group_layout(&kinds),
        entries: &entries,
    });
    assert!(pollster::block_on(scope.pop()).is_none(), "{kinds:?}");
}

fn with_limits(required_limits: wgpu::Limits) -> TestDevice {
    let described = wgpu::InstanceDescriptor::new_without_display_handle();
    let instance = pollster::block_on(vastex_wgpu::instance_for(described));
    let adapter = pollster::block_on(instance.request_adapter(&Default::default())).unwrap();
    let descriptor = wgpu::DeviceDescriptor { required_limits, ..Default::default() };
    let (device, queue) = pollster::block_on(adapter.request_device(&descriptor)).unwrap();
    TestDevice { device, queue, info: adapter.get_info() }
}

#[test]
fn a_device_that_gathers_feedback_otherwise_takes_the_place_of_one() {
    let gpu = TestDevice::new();
    let mut textures = textures(&gpu);
    let ids = [32, 16].map(|page| textures.add_blocking(property(SIZE, page, AddressMode::Clamp)).unwrap());
    let group = textures.add_group([("a", ids[0]), ("b", ids[1])]).unwrap();
    textures.update().unwrap();
    let other = with_limits(wgpu::Limits::downlevel_webgl2_defaults());
    textures.memory().restore(&other.device, &other.queue).unwrap();
    textures.update().unwrap();
    assert_eq!(textures.kinds(ids[0]).unwrap().mode(), FeedbackMode::Raw);
    assert_eq!(textures.kinds(group).unwrap().mode(), FeedbackMode::Raw);
    ids.into_iter().for_each(|id| check_bindings(&textures, &other, id));
    assert!(textures.bind_group(group).is_ok());
}

#[test]
fn a_device_that_holds_a_format_otherwise_takes_the_place_of_one() {
    let gpu = TestDevice::new();
    let mut textures = textures(&gpu);
    let id = textures.add_blocking(Plain::of_layers(vec![Layer::new("height", LayerFormat::R16)])).unwrap();
    textures.update().unwrap();
    let other = TestDevice::with_features(|_| wgpu::Features::empty());
    textures.memory().restore(&other.device, &other.queue).unwrap();
    textures.update().unwrap();
    check_bindings(&textures, &other, id);
}

#[test]
fn a_restore_that_failed_may_be_called_again() {
    for step in 0.. {
        let gpu = TestDevice::new();
        let mut textures = textures(&gpu);
        let ids =
            [32, 64].map(|page| textures.add_blocking(property(SIZE, page, AddressMode::Clamp)).unwrap());
        textures.update().unwrap();
        let other = TestDevice::new();
        fail_after(Some(step));
        let restored = textures.memory().restore(&other.device, &other.queue);
        fail_after(None);
        if restored.is_ok() {
            assert!(step > 3, "nothing failed");
            return;
        }
        textures.memory().restore(&other.device, &other.queue).unwrap();
        textures.update().unwrap();
        ids.into_iter().for_each(|id| assert!(textures.bind_group(id).is_ok(), "step {step}"));
    }
}

#[test]
fn an_update_that_fails_in_one_pool_loses_nothing_of_another() {
    let mapping = Mapping::new(SIZE, [0.5, 0.5], 1.1, 1.0, 0.2);
    let screen = || {
        let sources = [32, 64].map(|page| property(SIZE, page, AddressMode::Clamp));
        let mut screen = Screen::new(&sources, settings());
        (0..2).for_each(|nth| screen.set_mapping(nth, &mapping));
        screen
    };
    let mut undisturbed = screen();
    undisturbed.converge();
    let expected = undisturbed.picture();
    for step in 0..5 {
        let mut screen = screen();
        for _ in 0..40 {
            let wanted = screen.record_wanted(PICTURE);
            screen.gpu.queue.submit([wanted.finish()]);
            fail_after(Some(step));
            let failed = screen.textures.update().is_err();
            fail_after(None);
            if failed {
                screen.textures.update().unwrap();
            }
        }
        screen.converge();
        let wrong = screen.picture().iter().zip(&expected).filter(|(a, b)| a != b).count();
        assert_eq!(wrong, 0, "step {step}");
    }
}

#[test]
fn the_id_0_names_nothing_whatever_is_removed() {
    let sources = [property(SIZE, 32, AddressMode::Clamp), property(SIZE, 32, AddressMode::Clamp)];
    let mut screen = Screen::new(&sources, settings());
    (0..2).for_each(|nth| screen.set_mapping(nth, &Mapping::new(SIZE, [0.5, 0.5], 2.0, 1.0, 0.0)));
    screen.converge();
    screen.set_id(1, 0, 0);
    screen.remove(0);
    screen.frame().unwrap();
    let width = PICTURE[0] as usize;
    let picture = screen.picture();
    let of_it: Vec<[u8; 4]> = picture.chunks(width).flat_map(|row| row[width / 2 + 1..].to_vec()).collect();
    assert!(of_it.iter().all(|pixel| *pixel == UNKNOWN), "{:?}", of_it[0]);
    assert!(screen.feedback_of_every_pixel().pages.is_empty());
}

#[test]
fn a_late_layer_of_labels_is_as_good_as_an_early_one() {
    let gpu = TestDevice::new();
    let mut textures = textures(&gpu);
    let layers = |count: u32, labels: u32| {
        let layer = |n| Layer { is_mixable: n != labels, ..Layer::new(format!("l{n}"), LayerFormat::R8) };
        Plain::of_layers((0..count).map(layer).collect())
    };
    for (count, labels) in [(17, 16), (40, 35)] {
        let added = textures.add_blocking(layers(count, labels)).unwrap();
        let unmixed = (0..).map_while(|n| textures.texture(added).unwrap().kind(n));
        let unmixed: Vec<usize> =
            (0..).zip(unmixed).filter(|(_, kind)| !kind.is_mixed).map(|(n, _)| n).collect();
        assert_eq!(unmixed, [labels as usize]);
    }
    textures.update().unwrap();
}

#[test]
fn groups_that_come_and_go_leave_no_bind_groups() {
    let gpu = TestDevice::new();
    let mut textures = textures(&gpu);
    let ids = [16, 24, 32, 40]
        .map(|page| textures.add_blocking(property([300, 300], page, AddressMode::Clamp)).unwrap());
    let mut sets = Vec::new();
    for nth in 0..48 {
        let order = [nth % 4, nth / 4 % 4, nth / 16].map(|at| ids[at]);
        let group = textures.add_group(["a", "b", "c"].into_iter().zip(order)).unwrap();
        assert!(textures.remove(group));
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        textures
            .feedback(&mut encoder, [8, 8], |_, groups| {
                sets.push(format!("{groups:?}").matches("BindSet {").count());
            })
            .unwrap();
        drop(encoder);
    }
    assert!(sets.iter().all(|&sets| sets <= ids.len() + 1), "{sets:?}");
}

#[test]
fn a_place_of_bindings_that_the_device_does_not_have_is_refused() {
    let gpu = TestDevice::new();
    for (group, first) in [(4, 0), (0, 995), (u32::MAX, u32::MAX)] {
        let settings = Settings { binding: BindingPlace { group, first }, ..settings() };
        let refused = Textures::new(&gpu.device, &gpu.queue, settings).err().unwrap();
        assert!(matches!(refused, Error::Gpu(GpuError::BindingPlace { .. })), "{refused}");
        assert!(refused.to_string().contains("Settings::binding"), "{refused}");
    }
}

#[test]
fn a_ticket_of_other_textures_lets_go_of_nothing() {
    let gpu = TestDevice::new();
    let [(mut first, pinned), (mut second, other)] = [(); 2].map(|()| {
        let mut textures = textures(&gpu);
        let id = textures.add_blocking(property(SIZE, 32, AddressMode::Clamp)).unwrap();
        let pinned = textures.ahead().pin(id, &Region::image(0..100, 0..100)).unwrap();
        (textures, pinned)
    });
    assert!(!first.ahead().release(&other) && !second.ahead().release(&pinned));
    assert!(pinned.is_open() && other.is_open());
    assert!(first.ahead().release(&pinned) && second.ahead().release(&other));
    assert!(!pinned.is_open() && !other.is_open());
}
