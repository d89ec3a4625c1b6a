//! Filters, address modes, formats, scenes and views by chance, all with all: each picture equals that of an
//! ordinary texture.
//!
//! `VASTEX_PICTURES` says how many (`cargo xtask campaign` asks for more and more), `VASTEX_PICTURE` for a
//! single one by its number.

use glam::{BVec2, DVec2, DVec3, Vec2};
use vastex::{AddressMode, Filter, MaxTaps, Region};
use vastex_scenes::{DisplayOptions, Offscreen, Pose, Scene, Tiling};

use crate::common::{Image, gpu, settings};
use crate::filters::texture;
use crate::pictures::assert_alike;

/// So many in the suite.
const FEW: u64 = 8;
const SIZE: [u32; 2] = [96, 64];

/// Small, seeded and the same everywhere (splitmix64).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ mixed >> 31
    }

    fn of<T: Copy>(&mut self, choices: &[T]) -> T {
        choices[(self.next() % choices.len() as u64) as usize]
    }

    fn between(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * (self.next() >> 40) as f32 / (1u64 << 24) as f32
    }
}

fn image(random: &mut Random) -> Image {
    use AddressMode::{Border, Clamp, Mirror, Wrap};
    use png::ColorType::{Grayscale, GrayscaleAlpha, Rgb, Rgba};
    let modes = [Clamp, Wrap, Mirror, Border];
    let side = |random: &mut Random| match random.next() % 4 {
        0 => 1 << random.between(3.0, 9.9) as u32,
        _ => random.between(3.0, 700.0) as u32,
    };
    let (channels, sixteen_bit) = random.of(&[
        (Grayscale, false),
        (GrayscaleAlpha, false),
        (Rgb, false),
        (Rgba, false),
        (Grayscale, true),
        (Rgba, true),
    ]);
    let (width, height, page) = (side(random), side(random), random.of(&[24, 64, 120]));
    let address = [random.of(&modes), random.of(&modes)];
    Image { address, channels, sixteen_bit, ..Image::new(width, height, page) }
}

fn pose(scene: Scene, random: &mut Random) -> Pose {
    let mut between = |low, high| f64::from(random.between(low, high));
    match scene {
        Scene::Image => {
            Pose::image(DVec2::new(between(0.0, 1.0), between(0.0, 1.0)), between(-1.0, 6.0).exp2())
        }
        Scene::Plane | Scene::Terrain => Pose::Plane {
            eye: DVec3::new(between(-0.8, 0.8), between(-0.9, 0.2), between(-6.0, -1.0).exp2()),
            yaw: between(-0.8, 0.8),
            pitch: between(0.05, 1.2),
        },
        Scene::Globe | Scene::Planet => {
            Pose::globe(between(-3.15, 3.15), between(-1.55, 1.55), between(-4.0, 1.0).exp2())
        }
    }
}

/// Picture number `nth`.
fn check(nth: u64) {
    let mut random = Random(nth);
    let image = image(&mut random);
    let taps = MaxTaps::ALL.map(Filter::Anisotropic);
    let others = [Filter::Nearest, Filter::Bilinear, Filter::Trilinear, Filter::Bicubic];
    let filters: Vec<Filter> = taps.into_iter().chain(others).collect();
    let (filter, scene) = (random.of(&filters), random.of(&Scene::SMOOTH));
    let tiling = match random.next() % 3 {
        0 => Tiling {
            repeats: Vec2::new(random.between(0.5, 3.0), random.between(0.5, 3.0)),
            first: Vec2::new(random.between(-1.0, 1.0), random.between(-1.0, 1.0)),
            folded: BVec2::FALSE,
        },
        _ => Tiling::default(),
    };
    let (_directory, file) = image.build();
    let shown = DisplayOptions { tiling, ..DisplayOptions::default() };
    let source = vastex::open(file).unwrap();
    let mut offscreen = Offscreen::showing(&shown, gpu(), source, scene, SIZE, settings(64, filter)).unwrap();
    let texture = texture(&offscreen);
    let ticket = offscreen.textures_mut().ahead().pin(texture, &Region::whole()).unwrap();
    while ticket.progress().resident < ticket.progress().pages {
        offscreen.frame(Pose::first(scene)).unwrap();
    }
    for _ in 0..3 {
        let pose = pose(scene, &mut random);
        offscreen.frame(pose).unwrap();
        let what = format!("VASTEX_PICTURE={nth}: {filter} {image:?} {tiling:?} {pose:?}");
        assert_alike(&offscreen.compare().unwrap().0, &what);
    }
}

#[test]
fn pictures_by_chance_equal_those_of_an_ordinary_texture() {
    let number = |name| std::env::var(name).ok().and_then(|number| number.parse().ok());
    match number("VASTEX_PICTURE") {
        Some(nth) => check(nth),
        None => (0..number("VASTEX_PICTURES").unwrap_or(FEW)).for_each(check),
    }
}
