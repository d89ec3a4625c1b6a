//! A generated planet of 2^31 texels, from orbit to the ground: every pixel is what the source says lies
//! where its ray meets the ground, and memory stays as it is.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use glam::{DVec2, DVec3};
use vastex::source::{PlanetImage, PlanetSource};
use vastex::{Filter, TileSource};
use vastex_scenes::{Descent, GlobePose};

use crate::common::{gpu, settings};

const SIZE: [u32; 2] = [96, 64];
const TEXELS: [u32; 2] = [1 << 31, 1 << 30];

/// Bands of land and sea, so that sampling the wrong place shows from orbit too.
fn planet() -> Arc<PlanetSource> {
    let texel = |n: u32| match (n % 64 / 7 + n / 64 / 5) % 3 {
        0 => [24, 48, 110, 255],
        1 => [150, 130, 80, 255],
        _ => [70, 110, 50, 255],
    };
    let image = PlanetImage { size: [64, 32], texels: (0..64 * 32).map(texel).collect() };
    Arc::new(PlanetSource::new(image, PlanetSource::MOST_BITS).unwrap())
}

fn descent(source: Arc<PlanetSource>) -> Descent {
    Descent::new(gpu(), source, SIZE, settings(24, Filter::Trilinear)).unwrap()
}

fn converge(descent: &mut Descent, pose: &GlobePose) {
    for frame in 0..3000 {
        let stats = descent.frame(pose).unwrap();
        if frame > 20 && stats.converged {
            return;
        }
    }
    panic!("not converged: {:?}", descent.textures().stats());
}

/// Where the ray through a point of the picture, in pixels, meets the ground: texels of level 0 from the
/// texel below the camera.
fn ground(pose: &GlobePose, at: DVec2) -> Option<DVec2> {
    let [width, height] = SIZE.map(f64::from);
    let half = (PI / 6.0).tan();
    let screen = DVec2::new((2.0 * at.x / width - 1.0) * width / height, 1.0 - 2.0 * at.y / height) * half;
    let ray = (pose.camera() * DVec3::new(screen.x, screen.y, -1.0)).normalize();
    // The sphere of radius 1 about a point 1 + altitude below.
    let (b, c) = ((1.0 + pose.altitude) * ray.z, pose.altitude * (2.0 + pose.altitude));
    let root = b * b - c;
    if b >= 0.0 || root < 0.0 {
        return None;
    }
    let hit = ray * (c / (-b + root.sqrt()));
    let (sin, cos) = pose.latitude.sin_cos();
    let up = 1.0 + pose.altitude + hit.z;
    let east = hit.x.atan2(up * cos - hit.y * sin);
    // The latitude's difference from its chord, which f64 holds where the angle itself would not.
    let north = (hit.y * cos + (hit.z + pose.altitude) * sin).clamp(-2.0, 2.0);
    let latitude = if north.abs() < 1e-4 {
        north / cos + 0.5 * north * north * sin / cos.powi(3)
    } else {
        (sin + north).asin() - pose.latitude
    };
    Some(DVec2::new(east / TAU * f64::from(TEXELS[0]), -latitude / PI * f64::from(TEXELS[1])))
}

fn linear(encoded: u8) -> f64 {
    let value = f64::from(encoded) / 255.0;
    if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
}

fn encoded(linear: f64) -> f64 {
    255.0 * if linear <= 0.003_130_8 { linear * 12.92 } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// Four texels of a level around a place, blended; linear.
fn bilinear(source: &PlanetSource, level: u8, texel: DVec2) -> DVec3 {
    let [width, height, _] = source.description().geometry.level(level).size.map(i64::from);
    let at = texel / f64::from(1u32 << level) - 0.5;
    let first = at.floor();
    let fold = |n: f64, d: i64| (n as i64 + d).rem_euclid(width) as u32;
    let clamp = |n: f64, d: i64| (n as i64 + d).clamp(0, height - 1) as u32;
    let colors =
        source.colors(level, &[fold(first.x, 0), fold(first.x, 1)], &[clamp(first.y, 0), clamp(first.y, 1)]);
    let [a, b, c, d] = [0, 1, 2, 3].map(|n| {
        let [red, green, blue, _]: [u8; 4] = colors[n];
        DVec3::new(linear(red), linear(green), linear(blue))
    });
    let weight = at - first;
    a.lerp(b, weight.x).lerp(c.lerp(d, weight.x), weight.y)
}

/// Share of the pixels that are within 4/255 of what the source says; those whose neighbours' rays miss the
/// ground do not count.
fn share_as_the_source_says(source: &PlanetSource, descent: &Descent, pose: &GlobePose) -> f64 {
    let picture = descent.picture();
    let below = pose.texel(TEXELS);
    let (mut alike, mut all) = (0, 0);
    for (n, pixel) in picture.rgba.chunks_exact(4).enumerate() {
        let at = DVec2::new((n as u32 % SIZE[0]) as f64 + 0.5, (n as u32 / SIZE[0]) as f64 + 0.5);
        let near =
            [DVec2::ZERO, DVec2::X, DVec2::Y, -DVec2::X, -DVec2::Y].map(|step| ground(pose, at + step));
        let [Some(here), Some(right), Some(down), Some(_), Some(_)] = near else { continue };
        assert_eq!(pixel[3], 255, "a hole at {at}");
        let longest = (right - here).length().max((down - here).length());
        let level = longest.log2().clamp(0.0, f64::from(source.description().geometry.coarsest()));
        let finer = level.floor();
        let coarser = (finer + 1.0).min(f64::from(source.description().geometry.coarsest()));
        let blend = |level: f64| bilinear(source, level as u8, below + here);
        let expected = blend(finer).lerp(blend(coarser), level - finer);
        let is_alike = (0..3).all(|c| (encoded(expected[c]) - f64::from(pixel[c])).abs() <= 4.0);
        alike += u32::from(is_alike);
        all += 1;
    }
    assert!(all > 1500, "{all} pixels of ground");
    f64::from(alike) / f64::from(all)
}

#[test]
fn every_pixel_is_what_lies_on_the_ground_there() {
    let source = planet();
    let mut descent = descent(source.clone());
    let metre = GlobePose::METRE;
    for (altitude, pitch, share) in [
        // Towards the limb the ground's quads are chords of the sphere, and pixels are long.
        (1.5, 0.0, 0.93),
        (1e5 * metre, 0.3, 0.97),
        (1e3 * metre, 0.0, 0.99),
        (20.0 * metre, 0.5, 0.99),
        (2.0 * metre, 0.0, 0.99),
        (0.3 * metre, 0.0, 0.99),
    ] {
        let pose = GlobePose { longitude: 1.234_567_89, latitude: 0.6, altitude, pitch };
        converge(&mut descent, &pose);
        let found = share_as_the_source_says(&source, &descent, &pose);
        assert!(found >= share, "{:.1} m: {found}", altitude / metre);
    }
}

/// Steps of a quarter of a texel, half a millimetre on the ground: the picture follows each of them exactly,
/// across the date line too.
#[test]
fn nothing_trembles_half_a_metre_above_the_ground() {
    let source = planet();
    let mut descent = descent(source.clone());
    let texel = TAU / f64::from(TEXELS[0]);
    for longitude in [0.3, PI - 2.5 * texel] {
        for step in 0..6 {
            let pose = GlobePose {
                longitude: longitude + 0.25 * texel * f64::from(step),
                latitude: 0.2,
                altitude: 0.5 * GlobePose::METRE,
                pitch: 0.0,
            };
            converge(&mut descent, &pose);
            let found = share_as_the_source_says(&source, &descent, &pose);
            assert!(found >= 0.99, "step {step} from {longitude}: {found}");
        }
    }
}

#[test]
fn memory_stays_as_it_is_on_the_way_down() {
    let mut descent = descent(planet());
    let mut first = None;
    for frame in (0..Descent::FRAMES).step_by(6) {
        let stats = descent.frame(&Descent::pose(frame)).unwrap();
        let bytes = (stats.pool_bytes, stats.table_bytes);
        assert_eq!(*first.get_or_insert(bytes), bytes, "frame {frame}");
    }
    let stats = descent.textures().stats();
    assert!(stats.pager.loaded > 80 && stats.pager.failed == 0, "{:?}", stats.pager);
    // A hash table of the pool: a bucket of 12 bytes for each quarter of a slot, whatever the texture's size.
    let slots = stats.pools.iter().map(|pool| u64::from(pool.pager.slots)).sum::<u64>();
    assert!(
        stats.table_bytes <= 48 * slots.next_power_of_two(),
        "{} bytes for {slots} slots",
        stats.table_bytes
    );
}
