//! What pictures of volumes must be, in `f64` over whole arrays, as docs/volumes.md says it: nothing here is
//! shared with what draws them but the numbers that a person sets.

use std::cell::Cell;
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
        let (mut first, mut share) = ([0; 3], [0.0; 3]);
        for a in 0..3 {
            let at = (place[a] - self.origin[a]) / self.scale[a] - 0.5;
            (first[a], share[a]) = (at.floor() as i64, at - at.floor());
        }
        let mut value = 0.0;
        for corner in 0..8 {
            let (mut weight, mut at) = (1.0, first);
            for a in 0..3 {
                let is_next = corner >> a & 1 == 1;
                weight *= if is_next { share[a] } else { 1.0 - share[a] };
                at[a] += i64::from(is_next);
            }
            // What weighs nothing need not be looked at, as where samples are the middles of voxels.
            if weight > 1e-9 {
                value += weight * self.voxel(at);
            }
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
    coarser_picture(desc, channels, view, size, 0.0)
}

/// The same at a mip bias, in levels: pixels are as much larger where they choose a level.
pub(crate) fn coarser_picture(
    desc: &VolumeDesc,
    channels: &[ArrayChannel<'_>],
    view: &VolumeView,
    size: [u32; 2],
    mip_bias: f64,
) -> Vec<[f64; 3]> {
    let levels: Vec<&[ArrayLevel]> = channels.iter().map(|(_, levels)| *levels).collect();
    pictures_at(std::slice::from_ref(desc), &levels, view, size, mip_bias).remove(0)
}

/// Pictures of one volume by several modes and looks, with one box and one step: what is sampled along a ray
/// is sampled once for all of them. `levels` are those of the channels.
pub(crate) fn pictures(
    descs: &[VolumeDesc],
    levels: &[&[ArrayLevel]],
    view: &VolumeView,
    size: [u32; 2],
) -> Vec<Vec<[f64; 3]>> {
    pictures_at(descs, levels, view, size, 0.0)
}

fn pictures_at(
    descs: &[VolumeDesc],
    levels: &[&[ArrayLevel]],
    view: &VolumeView,
    size: [u32; 2],
    mip_bias: f64,
) -> Vec<Vec<[f64; 3]>> {
    let of = &descs[0].of;
    assert!(descs.iter().all(|desc| desc.of == *of && desc.step == descs[0].step));
    let rays = view.rays(of, size);
    let coarser = mip_bias.exp2();
    let pixel = |way: f64| (rays.pixel + rays.growth * way) * coarser;
    let mut pictures = vec![Vec::new(); descs.len()];
    for (x, y) in (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x, y))) {
        let (x, y) = (f64::from(x) + 0.5, f64::from(y) + 0.5);
        let along = |of: [DVec3; 3]| of[0] + of[1] * x + of[2] * y;
        let (origin, direction) = (along(rays.origin), along(rays.toward).normalize());
        let (begin, end) = within(of, origin, direction);
        let ray = Ray { origin, direction, begin, end };
        let is_seen = !view.is_slice() && begin < end;
        let sampled = is_seen.then(|| Sampled::new(&descs[0], levels, &ray, &pixel));
        for (desc, pixels) in descs.iter().zip(&mut pictures) {
            let light = match &sampled {
                Some(sampled) => sampled.light(desc),
                None if view.is_slice() => slice(desc, levels, origin, rays.pixel * coarser),
                None => DVec3::ZERO,
            };
            pixels.push(light.to_array().map(|light| 255.0 * display(light)));
        }
    }
    pictures
}

/// How far the ray of each pixel goes through the box, in the world: 0 where it misses it.
pub(crate) fn ways_through(of: &VolumeBox, view: &VolumeView, size: [u32; 2]) -> Vec<f64> {
    let rays = view.rays(of, size);
    let way = |(x, y): (u32, u32)| {
        let along = |of: [DVec3; 3]| of[0] + of[1] * (f64::from(x) + 0.5) + of[2] * (f64::from(y) + 0.5);
        let (begin, end) = within(of, along(rays.origin), along(rays.toward).normalize());
        (end - begin).max(0.0)
    };
    (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x, y))).map(way).collect()
}

/// The bricks of `page` voxels a side that samples of the rays of some pixels lie in, where more than 1/256
/// of the light behind them is let through, or up to the surface: by level and place. Levels are halves of
/// one another.
pub(crate) fn bricks_met(
    desc: &VolumeDesc,
    channels: &[ArrayChannel<'_>],
    (view, size): (&VolumeView, [u32; 2]),
    page: u32,
) -> BTreeSet<(u8, [u32; 3])> {
    let rays = view.rays(&desc.of, size);
    let mut met = BTreeSet::new();
    for (x, y) in (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x, y))) {
        let along = |of: [DVec3; 3]| of[0] + of[1] * (f64::from(x) + 0.5) + of[2] * (f64::from(y) + 0.5);
        let (origin, direction) = (along(rays.origin), along(rays.toward).normalize());
        let (begin, end) = within(&desc.of, origin, direction);
        if begin >= end {
            continue;
        }
        let ray = Ray { origin, direction, begin, end };
        let pixel = |way: f64| rays.pixel + rays.growth * way;
        let density = desc.density * 100.0 / desc.of.extent().max_element();
        let mut through = 1.0;
        for Sample { way, level, length, .. } in samples(desc, channels[0].1, &ray, &pixel) {
            if desc.mode == VolumeMode::Emission && through <= 1.0 / 256.0 {
                break;
            }
            let place = (ray.origin + ray.direction * way) / desc.of.voxel;
            let side = f64::from(page) * channels[0].1[level].scale[0];
            met.insert((level as u8, std::array::from_fn(|a| (place[a] / side) as u32)));
            let mut is_surface = false;
            for (channel, levels) in channels {
                let value = levels[level].sample(place);
                is_surface |= desc.mode == VolumeMode::Iso && value >= f64::from(desc.iso);
                let x = channel.shown(value);
                through *= (1.0 - (f64::from(channel.opacity) * x).min(0.999)).powf(density * length);
            }
            if is_surface {
                break;
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

fn slice(desc: &VolumeDesc, levels: &[&[ArrayLevel]], at: DVec3, pixel: f64) -> DVec3 {
    let extent = desc.of.extent();
    if !(0..3).all(|a| (0.0..extent[a]).contains(&at[a])) {
        return DVec3::ZERO;
    }
    let of = |(channel, levels): (&VolumeChannel, &&[ArrayLevel])| {
        shown(channel, at_level(&desc.of, levels, at, pixel)) * f64::from(channel.opacity)
    };
    desc.channels.iter().zip(levels).map(of).sum()
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

/// A sample of a ray.
#[derive(Clone, Copy)]
struct Sample {
    /// How far along the ray it lies.
    way: f64,
    /// Which level it is of.
    level: usize,
    /// How long its part of the ray is: from where the part before ends to half of a step behind it.
    part: f64,
    /// The same of parts that end with the ray: those of all samples are together as long as that.
    length: f64,
}

/// The samples of a ray: those of a level are all counted from where the ray begins. The first of a coarser
/// level is the first that does not lie before the place where the level is wanted, if the ray is so long;
/// those of the finer level go on to that place, or to where the part of that first one begins.
fn samples(desc: &VolumeDesc, levels: &[ArrayLevel], ray: &Ray, pixel: &dyn Fn(f64) -> f64) -> Vec<Sample> {
    let voxel = |level: usize, a: usize| desc.of.voxel[a] * levels[level].scale[a];
    let step_of = |level: usize| {
        desc.step / (0..3).map(|a| ray.direction[a].abs() / voxel(level, a)).fold(0.0, f64::max)
    };
    // Where pixels have become as large as a level's voxels.
    let growth = pixel(1.0) - pixel(0.0);
    let wanted_from = |level: usize| {
        let larger = (0..3).filter(|a| voxel(level, *a) > 1.00001 * desc.of.voxel[*a]);
        let least = larger.map(|a| voxel(level, a) / 1.00001).fold(0.0, f64::max);
        (least - pixel(0.0)) / growth
    };
    let coarser_than = |level: usize| {
        let all = (level + 1..levels.len()).filter(|_| growth > 0.0);
        let all = all.map(|level| (wanted_from(level), level)).filter(|(way, _)| *way < ray.end);
        // Of those that are wanted from one place on, the coarsest.
        all.min_by(|one, other| one.0.total_cmp(&other.0).then(other.1.cmp(&one.1)))
    };
    let mut found: Vec<Sample> = Vec::new();
    let (mut level, mut from, mut front) =
        (level_of(&desc.of, levels, pixel(ray.begin)), ray.begin, ray.begin);
    loop {
        let (step, coarser) = (step_of(level), coarser_than(level));
        let begins = |(way, level): (f64, usize)| {
            let (step, wanted) = (step_of(level), way.max(from));
            let first = ((wanted - ray.begin) / step - 0.5).ceil().max(0.0);
            let side = (ray.begin + first * step).min(way + step / 2.0);
            (ray.begin + (first + 0.5) * step < ray.end).then(|| (level, wanted.max(side)))
        };
        let next = coarser.and_then(begins);
        let until = next.map_or(ray.end, |(_, until)| until);
        let mut nth = ((from - ray.begin) / step - 0.5).ceil().max(0.0);
        while ray.begin + (nth + 0.5) * step < until {
            let (way, end) = (ray.begin + (nth + 0.5) * step, ray.begin + (nth + 1.0) * step);
            found.push(Sample { way, level, part: end - front, length: end - front });
            (front, nth) = (end, nth + 1.0);
        }
        let Some((next, until)) = next else { break };
        (level, from) = (next, until);
    }
    let length = ray.end - ray.begin;
    match found.last_mut() {
        Some(sample) => sample.length += ray.end - front,
        None => found.push(Sample { way: ray.begin + length / 2.0, level, part: length, length }),
    }
    found
}

/// What lies along a ray, sampled as far as anybody asks.
struct Sampled<'a> {
    of: &'a VolumeBox,
    levels: &'a [&'a [ArrayLevel]],
    ray: &'a Ray,
    pixel: &'a dyn Fn(f64) -> f64,
    steps: Vec<Sample>,
    values: Vec<Vec<Cell<Option<f64>>>>,
}

impl<'a> Sampled<'a> {
    fn new(
        desc: &'a VolumeDesc,
        levels: &'a [&'a [ArrayLevel]],
        ray: &'a Ray,
        pixel: &'a dyn Fn(f64) -> f64,
    ) -> Sampled<'a> {
        let steps = samples(desc, levels[0], ray, pixel);
        let values = vec![vec![Cell::new(None); steps.len()]; levels.len()];
        Sampled { of: &desc.of, levels, ray, pixel, steps, values }
    }

    /// The value of a channel at a place, of a level.
    fn at(&self, channel: usize, world: DVec3, level: usize) -> f64 {
        self.levels[channel][level].sample(world / self.of.voxel)
    }

    /// The value of a channel at a way along the ray.
    fn value(&self, channel: usize, way: f64, level: usize) -> f64 {
        self.at(channel, self.ray.origin + self.ray.direction * way, level)
    }

    /// That of a sample.
    fn sample(&self, channel: usize, nth: usize) -> f64 {
        let known = &self.values[channel][nth];
        let Sample { way, level, .. } = self.steps[nth];
        let place = (self.ray.origin + self.ray.direction * way) / self.of.voxel;
        let value = known.get().unwrap_or_else(|| self.levels[channel][level].sample(place));
        known.set(Some(value));
        value
    }

    fn light(&self, desc: &VolumeDesc) -> DVec3 {
        let reduced = |reduce: &dyn Fn(&[f64]) -> f64| {
            let of_channel = |(nth, channel): (usize, &VolumeChannel)| {
                let values: Vec<f64> = (0..self.steps.len()).map(|step| self.sample(nth, step)).collect();
                if values.is_empty() {
                    return DVec3::ZERO;
                }
                shown(channel, reduce(&values)) * f64::from(channel.opacity)
            };
            desc.channels.iter().enumerate().map(of_channel).sum::<DVec3>()
        };
        match desc.mode {
            VolumeMode::Mip => reduced(&|values| values.iter().copied().fold(f64::MIN, f64::max)),
            VolumeMode::Minip => reduced(&|values| values.iter().copied().fold(f64::MAX, f64::min)),
            VolumeMode::Average => reduced(&|values| {
                let weighed = values.iter().zip(&self.steps).map(|(value, sample)| value * sample.part);
                weighed.sum::<f64>() / self.steps.iter().map(|sample| sample.part).sum::<f64>()
            }),
            VolumeMode::Emission => self.emission(desc),
            VolumeMode::Iso => self.surface(desc),
        }
    }

    fn emission(&self, desc: &VolumeDesc) -> DVec3 {
        let density = desc.density * 100.0 / self.of.extent().max_element();
        let plain: Vec<DVec3> = desc.channels.iter().map(|channel| glow(channel, 0.0)).collect();
        let (mut light, mut through) = (DVec3::ZERO, 1.0);
        for (step, Sample { length, .. }) in self.steps.iter().enumerate() {
            let (mut tau, mut gathered) = (0.0, DVec3::ZERO);
            for (nth, channel) in desc.channels.iter().enumerate() {
                let value = self.sample(nth, step);
                let x = channel.shown(value);
                let own = -(1.0 - (f64::from(channel.opacity) * x).min(0.999)).ln() * density;
                let color = if channel.map.is_some() { glow(channel, value) } else { plain[nth] };
                (tau, gathered) = (tau + own, gathered + color * own);
            }
            let passed = (-tau * length).exp();
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

    fn surface(&self, desc: &VolumeDesc) -> DVec3 {
        let iso = f64::from(desc.iso);
        let mut nearest: Option<(f64, DVec3)> = None;
        for (nth, channel) in desc.channels.iter().enumerate() {
            let mut last = self.ray.begin;
            let level = level_of(self.of, self.levels[nth], (self.pixel)(last));
            let mut crossing = (self.value(nth, last, level) >= iso).then_some((last, level));
            for (step, Sample { way, level, .. }) in self.steps.iter().enumerate() {
                if crossing.is_some() {
                    break;
                }
                if self.sample(nth, step) >= iso {
                    crossing = Some((self.refined(nth, iso, [last, *way], *level), *level));
                }
                last = *way;
            }
            let is_nearer = |(way, _): &(f64, usize)| nearest.is_none_or(|(nearest, _)| *way < nearest);
            let Some((way, level)) = crossing.filter(is_nearer) else { continue };
            let world = self.ray.origin + self.ray.direction * way;
            let scale = self.levels[nth][level].scale;
            let slope = DVec3::from_array(std::array::from_fn(|a| {
                let side = scale[a] * self.of.voxel[a];
                let half = DVec3::AXES[a] * (side / 2.0);
                (self.at(nth, world + half, level) - self.at(nth, world - half, level)) / side
            }));
            let lit = match slope.length() {
                0.0 => 1.0,
                steepness => 0.2 + 0.8 * (slope / steepness).dot(self.ray.direction).abs(),
            };
            nearest = Some((way, glow(channel, iso) * lit * f64::from(channel.opacity)));
        }
        nearest.map_or(DVec3::ZERO, |(_, light)| light)
    }

    /// Where a channel reaches a value between two samples, by the level of the second. Where that has
    /// reached it at the first one already, which was of a finer level, it is there.
    fn refined(&self, nth: usize, iso: f64, ways: [f64; 2], level: usize) -> f64 {
        let [mut before, mut after] = ways.map(|way| (way, self.value(nth, way, level)));
        for _ in 0..4 {
            let middle = (before.0 + after.0) / 2.0;
            let found = (middle, self.value(nth, middle, level));
            if found.1 >= iso { after = found } else { before = found }
        }
        if before.1 >= iso {
            return before.0;
        }
        before.0 + (after.0 - before.0) * (iso - before.1) / (after.1 - before.1)
    }
}

pub(crate) fn light_of(display: f64) -> f64 {
    if display <= 0.04045 { display / 12.92 } else { ((display + 0.055) / 1.055).powf(2.4) }
}

pub(crate) fn display(light: f64) -> f64 {
    let light = light.clamp(0.0, 1.0);
    if light <= 0.0031308 { light * 12.92 } else { 1.055 * light.powf(1.0 / 2.4) - 0.055 }
}
