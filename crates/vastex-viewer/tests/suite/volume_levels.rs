//! Which level and which brick each sample of a ray is of, read from pictures: every voxel of the volume says
//! which it is, and what is left of the rays is so thin that each has one sample. The oracle is written from
//! the rule alone: the coarsest level of which no voxel is larger than a pixel along any axis, but that those
//! of level 0 may be. It shares neither rays nor levels with what draws, nor with the reference. A second
//! oracle says from the same rule where levels change along a ray that goes through several.

use std::sync::Arc;

use glam::DVec3;
use vastex::{Description, LayerFormat, StoredLevel, TableChoice};
use vastex_viewer::volume::{
    VolumeCamera, VolumeChannel, VolumeClip, VolumeDesc, VolumeFace, VolumeMode, VolumeView,
};

use super::volume_reference::{ArrayLevel, picture};
use super::volume_world::{ArrayVolume, World, geometry};

const SIZE: [u32; 3] = [48, 40, 32];
const PAGE: u32 = 16;
/// Sides of a voxel of level 0 in the world.
const VOXEL: [f64; 3] = [1.0, 1.0, 1.5];
const LEVELS: u32 = 3;

fn size_of(level: u32) -> [u32; 3] {
    SIZE.map(|side| side.div_ceil(1 << level))
}

/// The number of a level and a brick of it.
fn number(level: u32, voxel: [u32; 3]) -> u32 {
    let pages = size_of(level).map(|side| side.div_ceil(PAGE));
    let [x, y, z] = voxel.map(|at| at / PAGE);
    100 * level + (z * pages[1] + y) * pages[0] + x
}

/// Every voxel has the number of its level and brick.
fn volume() -> ArrayVolume {
    let geometry = geometry(SIZE, PAGE);
    let level = |level: u32| {
        let size = size_of(level);
        let places = (0..size[2]).flat_map(|z| (0..size[1]).map(move |y| (y, z)));
        let rows = places.flat_map(|(y, z)| (0..size[0]).map(move |x| [x, y, z]));
        let values = rows.map(|at| f64::from(number(level.min(LEVELS - 1), at))).collect();
        let scale = [f64::from(1 << level); 3];
        ArrayLevel { size, scale, origin: [0.0; 3], values, formula: None }
    };
    let levels = (0..geometry.levels().len() as u32).map(level).collect();
    let description = Arc::new(Description::one_layer(geometry, LayerFormat::R32Float));
    ArrayVolume { description, levels, voxels: None }
}

/// What the rule says of a sample: the number of its level and brick. `None` where a voxel of another brick
/// is blended in, and where the pixel is so near to a level's voxels that rounding decides.
fn expected(place: DVec3, pixel: f64) -> Option<u32> {
    let fits =
        |level: u32, pixel: f64| VOXEL.iter().all(|side| side * f64::from(1 << level) <= pixel.max(*side));
    let coarsest = |pixel: f64| (0..LEVELS).rev().find(|level| fits(*level, pixel)).unwrap_or(0);
    let level = coarsest(pixel);
    if coarsest(pixel * 0.95) != coarsest(pixel * 1.05) {
        return None;
    }
    let size = size_of(level);
    let corner = |after: f64| -> [u32; 3] {
        std::array::from_fn(|a| {
            let at = place[a] / (VOXEL[a] * f64::from(1 << level)) - 0.5;
            (at.floor() + after).clamp(0.0, f64::from(size[a] - 1)) as u32
        })
    };
    let [first, last] = [corner(0.0), corner(1.0)].map(|voxel| number(level, voxel));
    (first == last).then_some(first)
}

#[test]
fn each_sample_is_of_the_level_and_the_brick_of_the_rule() {
    let mut world = World::of(vec![Arc::new(volume())], 200, TableChoice::Direct);
    world.of.voxel = DVec3::from_array(VOXEL);
    world.load_all();
    let channel = VolumeChannel { range: [0.0, 255.0], ..VolumeChannel::new(world.ids[0]) };
    let desc =
        VolumeDesc { mode: VolumeMode::Mip, is_exact: true, ..VolumeDesc::new(world.of, vec![channel]) };
    let mut renderer = world.renderer(desc.clone());
    let extent = DVec3::new(48.0, 40.0, 48.0);
    // From before: right is +x, down is +y. 150 away a pixel is about as large as a voxel of level 1.
    let (eye, half_height) = (DVec3::new(30.0, 17.0, -120.0), 0.3_f64);
    let camera = VolumeCamera { target: eye + DVec3::Z, eye, down: DVec3::Y, half_height };
    let face = VolumeView::Face(VolumeFace::PlusZ);
    let mut seen = std::collections::BTreeSet::new();
    for (view, [width, height]) in [
        (face, [48, 40]),
        (face, [24, 20]),
        (face, [15, 13]),
        (face, [7, 6]),
        (VolumeView::Around(camera), [32, 28]),
        (VolumeView::Around(camera), [16, 14]),
    ] {
        let (mut looked_at, mut inside) = (0, 0);
        for nth in 0..8 {
            // So thin that half of a step is longer.
            let middle = 48.0 * (f64::from(nth) + 0.5) / 8.0;
            let corners = [-0.2, 0.2].map(|off| middle + off);
            let corners = [DVec3::new(-1.0, -1.0, corners[0]), DVec3::new(99.0, 99.0, corners[1])];
            renderer.set(VolumeDesc { clip: VolumeClip { corners, plane: None }, ..desc.clone() });
            let drawn = world.shot(&renderer, view, [width, height]);
            for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
                // From the middle of the picture [pixels].
                let right = f64::from(x) + 0.5 - f64::from(width) / 2.0;
                let down = f64::from(y) + 0.5 - f64::from(height) / 2.0;
                let (place, pixel) = match view {
                    VolumeView::Face(_) => {
                        let pixel = (48.0 / f64::from(width)).max(40.0 / f64::from(height));
                        (DVec3::new(24.0 + right * pixel, 20.0 + down * pixel, middle), pixel)
                    }
                    _ => {
                        let a_length = 2.0 * half_height.tan() / f64::from(height);
                        let way = middle - eye.z;
                        let toward = DVec3::new(right * a_length, down * a_length, 1.0);
                        (eye + toward * way, a_length * way * toward.length())
                    }
                };
                if place.cmplt(DVec3::ZERO).any() || place.cmpge(extent).any() {
                    continue;
                }
                inside += 1;
                let Some(number) = expected(place, pixel) else { continue };
                looked_at += 1;
                seen.insert(number);
                let is = drawn[(y * width + x) as usize][0];
                assert_eq!(u32::from(is), number, "{view:?}, pixel {x},{y} of {width}x{height}, {place}");
            }
        }
        assert!(looked_at * 2 > inside && looked_at > 100, "{view:?}: {looked_at} of {inside} samples");
    }
    // Of all levels, and of nearly every brick of the finer ones.
    assert!(seen.iter().filter(|number| **number < 100).count() >= 16, "{seen:?}");
    assert!(seen.iter().any(|number| (100..200).contains(number)) && seen.contains(&200), "{seen:?}");
}

/// Levels of which each has voxels four times as large as the one before, of a volume so many voxels deep.
fn by_fours(depth: u64, count: u32, value: impl Fn([f64; 3]) -> f64) -> ArrayVolume {
    let level = |level: u32| {
        let side = 4_u64.pow(level);
        let size = [16, 16, depth].map(|of: u64| of.div_ceil(side));
        StoredLevel { size, scale: [side as f64; 3], origin: [0.0; 3] }
    };
    let levels: Vec<StoredLevel> = (0..count).map(level).collect();
    ArrayVolume::stored(&levels, LayerFormat::R32Float, value)
}

/// A ray along the middle of the volume, which is the only pixel, from so far before it: how large the pixel
/// is in a distance of 1.
fn one_ray(before: f64, pixel: f64) -> VolumeView {
    let eye = DVec3::new(8.0, 8.0, -before);
    let half_height = (pixel / 2.0).atan();
    VolumeView::Around(VolumeCamera { target: eye + DVec3::Z, eye, down: DVec3::Y, half_height })
}

/// Every voxel is as bright as the number of its level: the average says how long the ray is of each. Where
/// the level changes follows from how large a pixel is, and the picture may differ from that by half of the
/// coarser level's step for each change.
#[test]
fn levels_change_along_a_ray_where_pixels_have_become_as_large_as_voxels() {
    const DEPTH: f64 = 64.0;
    let mut volume = by_fours(64, 3, |_| 0.0);
    for (nth, level) in volume.levels.iter_mut().enumerate() {
        // Coarser ones than level 2 are made of it, and wanted where pixels are larger still.
        level.values.fill(nth.min(2) as f64);
    }
    let mut world = World::of(vec![Arc::new(volume)], 200, TableChoice::Direct);
    world.of.voxel = DVec3::ONE;
    world.load_all();
    let channel = VolumeChannel { range: [0.0, 2.0], ..VolumeChannel::new(world.ids[0]) };
    let desc = VolumeDesc { is_exact: true, ..VolumeDesc::new(world.of, vec![channel]) };
    let desc = VolumeDesc { mode: VolumeMode::Average, ..desc };
    let renderer = world.renderer(desc.clone());
    for before in [1.0, 2.0, 5.0] {
        for coarsest_from in [5.0, 7.9, 8.1, 12.0, 15.9, 16.1, 23.9, 30.0, 40.1] {
            // A pixel is as large as a voxel of level 2 there.
            let pixel = 16.0 / (before + coarsest_from);
            let coarser_from = f64::max(4.0 / pixel - before, 0.0);
            let view = one_ray(before, pixel);
            let drawn = f64::from(world.shot(&renderer, view, [1, 1])[0][0]) / 127.5;
            let expected = ((coarsest_from - coarser_from) + 2.0 * (DEPTH - coarsest_from)) / DEPTH;
            let half_steps = 4.0 / 2.0 + 16.0 / 2.0;
            let what = format!("level 1 from {coarser_from} on, level 2 from {coarsest_from} on");
            println!("{what}: {drawn:.3} drawn, {expected:.3} expected");
            assert!((drawn - expected).abs() < half_steps / DEPTH + 0.005, "{what}: {drawn}, not {expected}");
            let twin = picture(&desc, &world.arrays(&desc), &view, [1, 1])[0][0] / 127.5;
            assert!((drawn - twin).abs() < 0.01, "{what}: {drawn}, and {twin} by the reference");
        }
    }
}

/// Where a coarser level has no sample any more before the ray ends, the finer one goes on to the end.
#[test]
fn the_last_voxel_of_a_ray_is_seen_whatever_level_is_wanted_there() {
    let volume = by_fours(18, 2, |[_, _, z]| if z > 17.0 { 1.0 } else { 0.0 });
    let mut world = World::of(vec![Arc::new(volume)], 200, TableChoice::Direct);
    world.of.voxel = DVec3::ONE;
    world.load_all();
    let channel = VolumeChannel::new(world.ids[0]);
    let desc = VolumeDesc { is_exact: true, ..VolumeDesc::new(world.of, vec![channel]) };
    let desc = VolumeDesc { mode: VolumeMode::Mip, ..desc };
    let renderer = world.renderer(desc.clone());
    for coarser_from in [14.5, 15.5, 16.1, 17.0, 17.9, 30.0] {
        let view = one_ray(2.0, 4.0 / (2.0 + coarser_from));
        let drawn = world.shot(&renderer, view, [1, 1])[0][0];
        assert_eq!(drawn, 255, "level 1 from {coarser_from} on");
        let twin = picture(&desc, &world.arrays(&desc), &view, [1, 1])[0][0];
        assert!((twin - 255.0).abs() < 1.0, "level 1 from {coarser_from} on: {twin} by the reference");
    }
}
