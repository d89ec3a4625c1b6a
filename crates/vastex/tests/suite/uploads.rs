//! Tiles by the belt and through the queue: the same pictures, within the same budgets, and nothing left
//! behind.

use std::sync::Arc;
use std::time::Duration;

use crate::common::{Mapping, SCREEN, Screen, property, settings};
use vastex::source::{Codec, ReadFuture, Tile};
use vastex::{
    AddressMode, Description, Filter, Geometry, GeometrySpec, Layer, LayerFormat, Pace, PagePos, Settings,
    TileSource, UploadMode,
};

const SIZE: [u32; 2] = [1500, 1000];

/// Layers of many formats and resolutions, of blocks and texels of any content.
struct Noise(Arc<Description>);

impl Noise {
    fn new() -> Arc<Noise> {
        let layers = vec![
            Layer::new("a", LayerFormat::Rgba8),
            Layer { scale: 2, ..Layer::new("b", LayerFormat::Bc1) },
            Layer::new("c", LayerFormat::R8),
            Layer { scale: 4, ..Layer::new("d", LayerFormat::Rg8) },
        ];
        let tail_align = Description::tail_align(&layers);
        let spec = GeometrySpec { page: 64, border: 8, tail_align, ..GeometrySpec::image(SIZE[0], SIZE[1]) };
        Arc::new(Noise(Arc::new(Description::new(Geometry::new(spec).unwrap(), layers))))
    }
}

impl TileSource for Noise {
    fn description(&self) -> &Arc<Description> {
        &self.0
    }

    fn read(&self, pos: PagePos) -> ReadFuture<'_> {
        let mut state = u32::from(pos.level) << 20 ^ pos.x << 10 ^ pos.y ^ 0x9e37_79b9;
        let byte = |_| {
            state ^= state << 13;
            state ^= state >> 17;
            state ^= state << 5;
            (state >> 11) as u8
        };
        let bytes: Vec<u8> = (0..self.0.tile_bytes()).map(byte).collect();
        Box::pin(async move { Ok(Tile { codec: Codec::Raw, bytes: bytes.into() }) })
    }
}

fn by(uploads: UploadMode) -> Settings {
    Settings { uploads, ..settings() }
}

fn mapping(texels: f64, centre: f64) -> Mapping {
    Mapping::new(SIZE, [centre, 0.5], texels, 1.2, 0.4)
}

/// A layer as it is drawn after so many frames.
fn pictures(uploads: UploadMode, layer: &str) -> Vec<Vec<[u8; 4]>> {
    let settings = Settings { filter: Filter::Trilinear, ..by(uploads) };
    let mut screen = Screen::showing(settings, SCREEN, |textures| {
        let texture = textures.add_blocking(Noise::new()).unwrap();
        textures.texture(texture).unwrap().layer(layer).unwrap()
    });
    let mut pictures = Vec::new();
    for (texels, centre) in [(0.8, 0.4), (2.1, 0.6), (0.5, 0.3)] {
        screen.set_mapping(0, &mapping(texels, centre));
        for _ in 0..4 {
            screen.frame().unwrap();
            pictures.push(screen.picture());
        }
        screen.converge();
        pictures.push(screen.picture());
    }
    let (stats, went) = (screen.textures.inspect().upload_stats(), screen.textures.stats().pager.loaded);
    let expected = if uploads == UploadMode::Belt { went } else { 0 };
    assert!(went > 40 && stats.by_belt >= expected && stats.staged == 0, "{stats:?} of {went}");
    pictures
}

#[test]
fn every_frame_is_the_same_by_the_belt_and_through_the_queue() {
    for layer in ["a", "b", "c", "d"] {
        assert!(pictures(UploadMode::Belt, layer) == pictures(UploadMode::Queue, layer), "layer {layer}");
    }
}

#[test]
fn by_default_tiles_go_by_the_belt_in_real_time_and_through_the_queue_in_lock_step() {
    let lock_step = by(UploadMode::Best).pace;
    for (pace, is_by_belt) in [(lock_step, false), (Pace::Realtime, true)] {
        let settings = Settings { pace, ..by(UploadMode::Best) };
        let mut screen = Screen::new(&[property(SIZE, 64, AddressMode::Clamp)], settings);
        screen.set_mapping(0, &mapping(1.0, 0.5));
        let came = (0..3000).any(|_| {
            screen.frame().unwrap();
            std::thread::sleep(Duration::from_millis(1));
            screen.textures.stats().pager.loaded > 10
        });
        let stats = screen.textures.inspect().upload_stats();
        assert!(came && (stats.by_belt > 0) == is_by_belt, "{pace:?}: {stats:?}");
    }
}

#[test]
fn after_the_first_frames_no_room_is_made_and_the_budget_holds() {
    let budget = 1 << 20;
    let settings = Settings { in_flight_bytes: budget, ..by(UploadMode::Belt) };
    let mut screen = Screen::new(&[property([20_000, 2000], 64, AddressMode::Clamp)], settings);
    let mut walk = |frames: std::ops::Range<u32>| {
        for frame in frames {
            let centre = 0.05 + f64::from(frame) * 0.002;
            screen.set_mapping(0, &Mapping::new([20_000, 2000], [centre, 0.5], 1.0, 1.0, 0.0));
            screen.frame().unwrap();
            assert!(screen.textures.stats().pager.in_flight_bytes <= budget);
        }
        (screen.textures.inspect().upload_stats(), screen.textures.stats().pager.loaded)
    };
    let (warm, loaded_before) = walk(0..60);
    let (stats, loaded) = walk(60..400);
    assert!(loaded > loaded_before + 300, "{loaded_before} to {loaded}");
    assert_eq!(stats.rooms_made, warm.rooms_made);
    assert!(stats.belt_bytes <= budget + 6 * (2 << 20), "{stats:?}");
}

#[test]
fn a_belt_without_room_keeps_nothing_from_the_screen() {
    let settings = Settings { in_flight_bytes: 1, upload_bytes_per_frame: 5000, ..by(UploadMode::Belt) };
    let mut screen = Screen::new(&[property(SIZE, 64, AddressMode::Clamp)], settings);
    screen.set_mapping(0, &mapping(3.0, 0.5));
    screen.converge();
    let stats = screen.textures.inspect().upload_stats();
    assert!(stats.by_belt == 0 && stats.without_room > 0, "{stats:?}");
}

/// Some frames, a lost device, and the same textures on another one.
fn on_another_device(pace: Pace) -> Screen {
    let settings = Settings { pace, ..by(UploadMode::Belt) };
    let mut screen = Screen::new(&[property(SIZE, 64, AddressMode::Clamp)], settings);
    screen.set_mapping(0, &mapping(0.8, 0.4));
    (0..6).for_each(|_| drop(screen.frame().unwrap()));
    screen.gpu.device.destroy();
    // In real time a frame that has nothing to upload does not see it.
    let is_lost = |_| {
        std::thread::sleep(Duration::from_millis(1));
        screen.frame().is_err()
    };
    assert!((0..5000).any(is_lost));
    let mut screen = screen.on_another_device();
    screen.set_mapping(0, &mapping(0.8, 0.4));
    screen
}

#[test]
fn a_lost_device_takes_its_belt_with_it() {
    let mut screen = on_another_device(Pace::LockStep { latency_frames: 3 });
    screen.converge();
    let mut other = Screen::new(&[property(SIZE, 64, AddressMode::Clamp)], by(UploadMode::Queue));
    other.set_mapping(0, &mapping(0.8, 0.4));
    other.converge();
    assert!(screen.picture() == other.picture());
    assert!(screen.textures.inspect().upload_stats().by_belt > 0);
}

#[test]
fn textures_may_be_dropped_while_tiles_are_on_their_way() {
    for pace in [Pace::LockStep { latency_frames: 3 }, Pace::Realtime] {
        let mut screen = on_another_device(pace);
        (0..4).for_each(|_| drop(screen.frame().unwrap()));
        screen.remove(0);
        drop(screen.frame().unwrap());
        drop(screen);
    }
}
