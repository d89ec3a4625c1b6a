//! What pictures of volumes must be, in `f64` over whole arrays, as docs/volumes.md says it: nothing here is
//! shared with what draws them but the numbers that a person sets.

use std::collections::BTreeSet;

use glam::DVec3;
use vastex_viewer::Palette;
use vastex_viewer::volume::{VolumeBox, VolumeChannel, VolumeDesc, VolumeMode, VolumeView};

/// A level as an array: what shaders sample, 0 to 1.
pub(crate) struct ArrayLevel {
    pub(crate) size: [u32; 3],
    /// Voxels of level 0 along one of this level.
    pub(crate) scale: [f64; 3],
    /// Where the first voxel begins, in voxels of level 0.
    pub(crate) origin: [f64; 3],
    pub(crate) values: Vec<f64>,
    /// Says the value of a voxel of the level where there is no array.
    pub(crate) formula: Option<Box<dyn Fn([i64; 3]) -> f64 + Send + Sync>>,
}

impl ArrayLevel {
    /// The value of a voxel; beyond the faces that of the last one.
    pub(crate) fn voxel(&self, at: [i64; 3]) -> f64 {
        let at: [i64; 3] = std::array::from_fn(|a| at[a].clamp(0, i64::from(self.size[a]) - 1));
        if let Some(formula) = &self.formula {
            return formula(at);
        }
        let [x, y, z] = at.map(|at| at as usize);
        self.values[(z * self.size[1] as usize + y) * self.size[0] as usize + x]
    }

    /// Trilinear, at a place in voxels of level 0.
    pub(crate) fn sample(&self, place: DVec3) -> f64 {
        let at: [f64; 3] = std::array::from_fn(|a| (place[a] - self.origin[a]) / self.scale[a] - 0.5);
        let first = at.map(f64::floor);
        let mut value = 0.0;
        for corner in 0..8 {
            let of = |a: usize| f64::from((corner >> a & 1) as u8);
            let weight: f64 = (0..3)
                .map(|a| {
                    let share = at[a] - first[a];
                    if of(a) == 1.0 { share } else { 1.0 - share }
                })
                .product();
            value += weight * self.voxel(std::array::from_fn(|a| (first[a] + of(a)) as i64));
        }
        value
    }
}

/// A channel as it is shown, and its levels.
pub(crate) type ArrayChannel<'a> = (VolumeChannel, &'a [ArrayLevel]);

/// A ray within the box, in the world.
struct Ray {
    origin: DVec3,
    direction: DVec3,
    begin: f64,
    end: f64,
}

/// A picture as it must be: codes of red, green and blue.
pub(crate) fn picture(
    desc: &VolumeDesc,
    channels: &[ArrayChannel<'_>],
    view: &VolumeView,
    size: [u32; 2],
) -> Vec<[f64; 3]> {
    let rays = view.rays(&desc.of, size);
    let mut pixels = Vec::new();
    for y in 0..size[1] {
        for x in 0..size[0] {
            let (x, y) = (f64::from(x) + 0.5, f64::from(y) + 0.5);
            let along = |of: [DVec3; 3]| of[0] + of[1] * x + of[2] * y;
            let (origin, direction) = (along(rays.origin), along(rays.toward).normalize());
            let light = match view.is_slice() {
                true => slice(desc, channels, origin, rays.pixel),
                false => {
                    let (begin, end) = within(&desc.of, origin, direction);
                    let ray = Ray { origin, direction, begin, end };
                    let pixel = |way: f64| rays.pixel + rays.growth * way;
                    if begin < end { light(desc, channels, &ray, &pixel) } else { DVec3::ZERO }
                }
            };
            pixels.push(light.to_array().map(|light| 255.0 * display(light)));
        }
    }
    pixels
}

/// The bricks of `page` voxels a side that samples of the rays of some pixels lie in, where more than 1/256
/// of the light behind them is let through: by level and place. Levels are halves of one another.
pub(crate) fn bricks_met(
    desc: &VolumeDesc,
    channels: &[ArrayChannel<'_>],
    (view, size): (&VolumeView, [u32; 2]),
    page: u32,
    is_looked_at: impl Fn([u32; 2]) -> bool,
) -> BTreeSet<(u8, [u32; 3])> {
    let rays = view.rays(&desc.of, size);
    let mut met = BTreeSet::new();
    for (x, y) in (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x, y))) {
        let along = |of: [DVec3; 3]| of[0] + of[1] * (f64::from(x) + 0.5) + of[2] * (f64::from(y) + 0.5);
        let (origin, direction) = (along(rays.origin), along(rays.toward).normalize());
        let (begin, end) = within(&desc.of, origin, direction);
        if begin >= end || !is_looked_at([x, y]) {
            continue;
        }
        let ray = Ray { origin, direction, begin, end };
        let pixel = |way: f64| rays.pixel + rays.growth * way;
        let density = desc.density * 100.0 / desc.of.extent().max_element();
        let mut through = 1.0;
        for (way, step) in samples(desc, channels[0].1, &ray, &pixel) {
            if desc.mode == VolumeMode::Emission && through <= 1.0 / 256.0 {
                break;
            }
            let place = (ray.origin + ray.direction * way) / desc.of.voxel;
            let level = level_of(&desc.of, channels[0].1, pixel(way));
            let side = f64::from(page) * channels[0].1[level].scale[0];
            met.insert((level as u8, std::array::from_fn(|a| (place[a] / side) as u32)));
            for (channel, levels) in channels {
                let x = channel.shown(levels[level].sample(place));
                through *= (1.0 - (f64::from(channel.opacity) * x).min(0.999)).powf(density * step);
            }
        }
    }
    met
}

fn within(of: &VolumeBox, origin: DVec3, direction: DVec3) -> (f64, f64) {
    let (mut begin, mut end) = (0.0f64, f64::INFINITY);
    for axis in 0..3 {
        let (low, high) = (0.0, of.extent()[axis]);
        if direction[axis] == 0.0 {
            if !(low..high).contains(&origin[axis]) {
                return (1.0, 0.0);
            }
            continue;
        }
        let [a, b] = [low, high].map(|side| (side - origin[axis]) / direction[axis]);
        (begin, end) = (begin.max(a.min(b)), end.min(a.max(b)));
    }
    (begin, end)
}

/// The coarsest level of which no voxel is larger than a pixel, but that those of level 0 may be.
pub(crate) fn level_of(of: &VolumeBox, levels: &[ArrayLevel], pixel: f64) -> usize {
    let is_fit =
        |level: &ArrayLevel| (0..3).all(|a| level.scale[a] * of.voxel[a] <= 1.00001 * pixel.max(of.voxel[a]));
    levels.iter().rposition(is_fit).unwrap_or(0)
}

fn at_level(of: &VolumeBox, levels: &[ArrayLevel], world: DVec3, pixel: f64) -> f64 {
    levels[level_of(of, levels, pixel)].sample(world / of.voxel)
}

fn slice(desc: &VolumeDesc, channels: &[ArrayChannel<'_>], at: DVec3, pixel: f64) -> DVec3 {
    let extent = desc.of.extent();
    if !(0..3).all(|a| (0.0..extent[a]).contains(&at[a])) {
        return DVec3::ZERO;
    }
    let of = |(channel, levels): &ArrayChannel<'_>| {
        shown(channel, at_level(&desc.of, levels, at, pixel)) * f64::from(channel.opacity)
    };
    channels.iter().map(of).sum()
}

/// The light of a channel in full at a value.
fn shown(channel: &VolumeChannel, value: f64) -> DVec3 {
    let x = channel.shown(value);
    let plain = channel.color.as_dvec3() * x;
    channel.map.map_or(plain, |map| of_map(map, x)).to_array().map(light_of).into()
}

/// The colour that does not hang on how bright a value is, but where a map has one for each.
fn glow(channel: &VolumeChannel, value: f64) -> DVec3 {
    let plain = channel.color.as_dvec3();
    let of_value = |map| of_map(map, channel.shown(value));
    channel.map.map_or(plain, of_value).to_array().map(light_of).into()
}

fn of_map(map: Palette, x: f64) -> DVec3 {
    map.color(x as f32).map(f64::from).into()
}

/// The middles of the samples of a ray, and how long the part of each is.
fn samples(
    desc: &VolumeDesc,
    levels: &[ArrayLevel],
    ray: &Ray,
    pixel: &dyn Fn(f64) -> f64,
) -> Vec<(f64, f64)> {
    let mut found = Vec::new();
    let (mut base, mut nth, mut level, mut step) = (ray.begin, 0.0, usize::MAX, 0.0);
    loop {
        let front = base + nth * step;
        let wanted = level_of(&desc.of, levels, pixel(front));
        if wanted != level {
            let voxel: [f64; 3] = std::array::from_fn(|a| desc.of.voxel[a] * levels[wanted].scale[a]);
            let most = (0..3).map(|a| ray.direction[a].abs() / voxel[a]).fold(0.0, f64::max);
            let length = ray.end - ray.begin;
            let of_level = desc.step / most;
            let step_of_ray = if 0.5 * of_level >= length { length } else { of_level };
            (base, nth, level, step) = (front, 0.0, wanted, step_of_ray);
        }
        let middle = base + (nth + 0.5) * step;
        if middle >= ray.end {
            return found;
        }
        found.push((middle, step));
        nth += 1.0;
    }
}

fn light(desc: &VolumeDesc, channels: &[ArrayChannel<'_>], ray: &Ray, pixel: &dyn Fn(f64) -> f64) -> DVec3 {
    let of = &desc.of;
    let steps = samples(desc, channels[0].1, ray, pixel);
    let value =
        |levels: &[ArrayLevel], way: f64| at_level(of, levels, ray.origin + ray.direction * way, pixel(way));
    let reduced = |reduce: &dyn Fn(&[f64]) -> f64| {
        let of_channel = |(channel, levels): &ArrayChannel<'_>| {
            let values: Vec<f64> = steps.iter().map(|(way, _)| value(levels, *way)).collect();
            if values.is_empty() {
                return DVec3::ZERO;
            }
            shown(channel, reduce(&values)) * f64::from(channel.opacity)
        };
        channels.iter().map(of_channel).sum::<DVec3>()
    };
    match desc.mode {
        VolumeMode::Mip => reduced(&|values| values.iter().copied().fold(f64::MIN, f64::max)),
        VolumeMode::Minip => reduced(&|values| values.iter().copied().fold(f64::MAX, f64::min)),
        VolumeMode::Average => reduced(&|values| values.iter().sum::<f64>() / values.len() as f64),
        VolumeMode::Emission => {
            let density = desc.density * 100.0 / of.extent().max_element();
            let (mut light, mut through) = (DVec3::ZERO, 1.0);
            for (way, step) in steps {
                let (mut tau, mut gathered) = (0.0, DVec3::ZERO);
                for (channel, levels) in channels {
                    let value = value(levels, way);
                    let x = channel.shown(value);
                    let own = -(1.0 - (f64::from(channel.opacity) * x).min(0.999)).ln() * density;
                    (tau, gathered) = (tau + own, gathered + glow(channel, value) * own);
                }
                let passed = (-tau * step).exp();
                if tau > 0.0 {
                    light += through * (1.0 - passed) * gathered / tau;
                }
                through *= passed;
                if through < 1e-6 {
                    break;
                }
            }
            light
        }
        VolumeMode::Iso => surface(desc, channels, ray, pixel, &steps),
    }
}

fn surface(
    desc: &VolumeDesc,
    channels: &[ArrayChannel<'_>],
    ray: &Ray,
    pixel: &dyn Fn(f64) -> f64,
    steps: &[(f64, f64)],
) -> DVec3 {
    let (of, iso) = (&desc.of, f64::from(desc.iso));
    let mut nearest: Option<(f64, DVec3)> = None;
    for (channel, levels) in channels {
        let at = |world: DVec3, way: f64| at_level(of, levels, world, pixel(way));
        let value = |way: f64| at(ray.origin + ray.direction * way, way);
        let mut last = (ray.begin, value(ray.begin));
        let mut crossing = (last.1 >= iso).then_some(ray.begin);
        for &(way, _) in steps.iter().take_while(|_| crossing.is_none()).collect::<Vec<_>>() {
            let now = value(way);
            if crossing.is_none() && now >= iso {
                let (mut before, mut after) = (last, (way, now));
                for _ in 0..4 {
                    let middle = (before.0 + after.0) / 2.0;
                    let found = (middle, value(middle));
                    if found.1 >= iso { after = found } else { before = found }
                }
                let found = before.0 + (after.0 - before.0) * (iso - before.1) / (after.1 - before.1);
                crossing = Some(found);
            }
            last = (way, now);
        }
        let Some(way) = crossing.filter(|way| nearest.is_none_or(|(nearest, _)| *way < nearest)) else {
            continue;
        };
        let world = ray.origin + ray.direction * way;
        let scale = levels[level_of(of, levels, pixel(way))].scale;
        let slope = DVec3::from_array(std::array::from_fn(|a| {
            let half = DVec3::AXES[a] * (scale[a] * of.voxel[a] / 2.0);
            (at(world + half, way) - at(world - half, way)) / (scale[a] * of.voxel[a])
        }));
        let lit = match slope.length() {
            0.0 => 1.0,
            steepness => 0.2 + 0.8 * (slope / steepness).dot(ray.direction).abs(),
        };
        nearest = Some((way, glow(channel, iso) * lit * f64::from(channel.opacity)));
    }
    nearest.map_or(DVec3::ZERO, |(_, light)| light)
}

fn light_of(display: f64) -> f64 {
    if display <= 0.04045 { display / 12.92 } else { ((display + 0.055) / 1.055).powf(2.4) }
}

fn display(light: f64) -> f64 {
    let light = light.clamp(0.0, 1.0);
    if light <= 0.0031308 { light * 12.92 } else { 1.055 * light.powf(1.0 / 2.4) - 0.055 }
}
