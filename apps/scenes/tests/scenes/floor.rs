//! The floor: devices without compute shaders and storage buffers, such as those of WebGL 2, draw what all
//! others do.

use std::sync::Arc;

use vastex::{AddressMode, FeedbackMode, Filter, Geometry, Settings, TileSource};
use vastex_core::GeometrySpec;
use vastex_scenes::{Attribute, Gpu, Offscreen, Path, Planet, Scene, Until};
use vastex_tiles::PropertySource;

use crate::common::{Image, gpu, settings};
use crate::pictures::assert_alike;

const SIZE: [u32; 2] = [320, 180];

/// The adapter as one of WebGL 2, with no feature and none but its limits.
fn floor() -> Gpu {
    with_limits(wgpu::Limits::downlevel_webgl2_defaults())
}

/// One whose pools are laid out as those of the floor, but that has all the rest.
fn above() -> Gpu {
    let wgpu::Limits { max_texture_dimension_2d, max_texture_array_layers, .. } = floor().device.limits();
    with_limits(wgpu::Limits { max_texture_dimension_2d, max_texture_array_layers, ..Default::default() })
}

fn with_limits(required_limits: wgpu::Limits) -> Gpu {
    let Gpu { instance, adapter, .. } = gpu().clone();
    of_adapter(instance, adapter, required_limits)
}

fn of_adapter(instance: wgpu::Instance, adapter: wgpu::Adapter, required_limits: wgpu::Limits) -> Gpu {
    let descriptor = wgpu::DeviceDescriptor { label: Some("floor"), required_limits, ..Default::default() };
    let (device, queue) = pollster::block_on(adapter.request_device(&descriptor)).unwrap();
    Gpu::new(instance, adapter, device, queue)
}

fn offscreen(gpu: &Gpu, source: Arc<dyn TileSource>, scene: Scene, settings: Settings) -> Offscreen {
    Offscreen::new(gpu, source, scene, SIZE, settings).unwrap()
}

#[test]
fn the_floor_takes_the_way_that_it_has_and_refuses_the_others() {
    let device = floor().device;
    assert_eq!(FeedbackMode::best(&device), FeedbackMode::Raw);
    assert_eq!(FeedbackMode::best(&gpu().device), FeedbackMode::Separate);
    for mode in [FeedbackMode::Separate, FeedbackMode::Inline] {
        let refused = mode.check(&device).unwrap_err().to_string();
        assert!(refused.contains(mode.name()) && refused.contains("\"raw\""), "{refused}");
    }
    // What is asked for by default suffices for every mode.
    let asked = with_limits(vastex::required_limits(&gpu().adapter)).device;
    FeedbackMode::ALL.iter().for_each(|mode| mode.check(&asked).unwrap());
    FeedbackMode::ALL.iter().for_each(|mode| mode.check(&gpu().device).unwrap());
}

#[test]
fn pictures_of_the_floor_equal_those_of_an_ordinary_texture() {
    check_pictures(&floor());
}

/// Returns true where wgpu 30 believes that a driver's OpenGL 3.3 has compute shaders, since the driver names
/// the extensions, as NVIDIA's does. GLSL 3.30, which wgpu writes for it, has neither compute shaders nor
/// bindings: wgpu's own compute shaders, which check indirect calls, cannot be compiled, and every device is
/// lost (gfx-rs/wgpu#4751, #8616); without them all textures of a shader would be bound to one place.
fn is_misread(adapter: &wgpu::Adapter) -> bool {
    let info = adapter.get_info().driver_info;
    let mut version = info.split(['.', ' ']).map_while(|number| number.parse::<u32>().ok());
    let (Some(major), Some(minor)) = (version.next(), version.next()) else { return false };
    let flags = adapter.get_downlevel_capabilities().flags;
    (major, minor) < (4, 2) && flags.contains(wgpu::DownlevelFlags::COMPUTE_SHADERS)
}

/// The same by OpenGL, where the machine has a driver of it that wgpu can use.
#[test]
fn pictures_by_opengl_equal_those_of_an_ordinary_texture() {
    let described = wgpu::InstanceDescriptor::new_without_display_handle();
    let instance =
        wgpu::Instance::new(wgpu::InstanceDescriptor { backends: wgpu::Backends::GL, ..described });
    let adapter = pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions::default()));
    match adapter {
        Ok(adapter) if is_misread(&adapter) => {
            let info = adapter.get_info();
            println!(
                "NOT TESTED: wgpu believes that OpenGL {} of {} has compute shaders",
                info.driver_info, info.name
            );
        }
        Ok(adapter) => {
            let info = adapter.get_info();
            println!("by OpenGL {} on {}", info.driver_info, info.name);
            check_pictures(&of_adapter(instance, adapter, wgpu::Limits::downlevel_webgl2_defaults()));
        }
        Err(why) => {
            println!("NOT TESTED: this machine has no OpenGL driver ({why}); on Debian it is libegl1");
        }
    }
}

fn check_pictures(floor: &Gpu) {
    for scene in Scene::SMOOTH {
        let image = Image { address: [AddressMode::Wrap, AddressMode::Clamp], ..Image::new(1000, 777, 128) };
        let (_directory, file) = image.build();
        let mut offscreen =
            offscreen(floor, vastex::open(file).unwrap(), scene, settings(16, Filter::Trilinear));
        assert_eq!(offscreen.textures().inspect().feedback_mode(), FeedbackMode::Raw);
        let outcome = offscreen.run(Path::Still, Until::Converged, |_, _| ()).unwrap();
        assert!(outcome.converged && offscreen.share_at_wanted_level().unwrap() == 1.0, "{scene:?}");
        assert_alike(&offscreen.compare().unwrap().0, &format!("{scene:?}"));
    }
}

/// A flight through a pool that is too small, so that pages come and go: frame by frame the same as where
/// tables lie in buffers and compute compacts.
#[test]
fn a_flight_on_the_floor_is_the_same_frame_by_frame() {
    let source = || -> Arc<dyn TileSource> {
        let spec = GeometrySpec { page: 64, ..GeometrySpec::image(16384, 8192) };
        Arc::new(PropertySource::new(Geometry::new(spec).unwrap()))
    };
    let mut both =
        [floor(), above()].map(|gpu| offscreen(&gpu, source(), Scene::Plane, settings(2, Filter::Nearest)));
    for part in 0..6 {
        let [low, high] = both.each_mut().map(|offscreen| {
            for frame in 0..10 {
                offscreen.frame(Path::Fly.pose(Scene::Plane, 2.0, part * 45 + frame)).unwrap();
            }
            let stats = offscreen.textures().stats();
            (offscreen.picture(), stats.pager)
        });
        assert_eq!(low.1, high.1, "part {part}");
        assert!(low.0 == high.0, "part {part}: the pictures differ");
    }
    let stats = both[0].textures().stats();
    assert!(stats.pager.evicted >= 50, "pages go: {}", stats.pager.evicted);
    let each = stats.table_bytes_sent / (stats.pager.loaded + stats.pager.evicted);
    println!("{} bytes of the table sent, {each} for each page that came or went", stats.table_bytes_sent);
}

#[test]
fn a_group_on_the_floor_is_drawn_as_elsewhere() {
    let source = |width, height| -> Arc<dyn TileSource> {
        let spec = GeometrySpec { page: 64, ..GeometrySpec::image(width, height) };
        Arc::new(PropertySource::new(Geometry::new(spec).unwrap()))
    };
    let pictures = [floor(), above()].map(|gpu| {
        let parts = vec![(Attribute::Color, source(2048, 1024)), (Attribute::Night, source(1000, 500))];
        let mut planet = Planet::new(&gpu, parts, SIZE, settings(16, Filter::Trilinear)).unwrap();
        let pose = Path::Still.pose(Scene::Globe, 2.0, 0);
        let sharp = (0..500).any(|_| planet.frame(pose).unwrap().converged);
        assert!(sharp);
        planet.picture()
    });
    assert!(pictures[0] == pictures[1]);
}
