//! Where a ray meets a surface with heights, as the CPU knows them: looked for along the ray in steps no
//! longer than the quads that are drawn there, then halved. In f64.
//!
//! What is drawn are quads whose corners have the heights; here every point has, blended between texels of
//! the same level. Both are within a share of a quad of each other, which is some eight pixels.

use glam::{DVec2, DVec3};
use vastex::{CpuSampler, Geometry, Textures};

use super::patches::Patches;
use super::poles::height_on_globe;
use super::relief::ReliefSurface;
use crate::camera::{Ground, Pose, Ray};

/// Steps along a ray, at most; where more were needed they become longer.
const MOST_STEPS: f64 = 512.0;
/// Halvings of the last step: to less than a hundredth of a pixel.
const HALVINGS: u32 = 12;
/// How much the shell is thicker in which the surface lies, so that rounding leaves none of it out.
const MARGIN: f64 = 1e-6;

/// A surface with heights, below a camera.
#[derive(Debug)]
pub(super) struct HeightsBelow<'a> {
    surface: &'a ReliefSurface,
    sampler: CpuSampler<'a>,
    geometry: &'a Geometry,
    /// Texels of the texture along one of the heights.
    scale: u32,
    ground: Ground,
    /// How high the camera is above the ground below it, and that above the surface without heights.
    altitude: f64,
    raised: f64,
    /// How many times as long steps are as quads.
    roughness: f64,
    /// Texels between two vertices, and how far they are apart in the world, both by their distance from the
    /// camera.
    texels_by_distance: f64,
    quad_by_distance: f64,
    bias: f64,
}

impl<'a> HeightsBelow<'a> {
    /// `None` where nothing is displaced, for the pose of an image, and where the texture is gone.
    pub(super) fn new(
        surface: &'a ReliefSurface,
        textures: &'a Textures,
        pose: &Pose,
        (picture, image): ([u32; 2], f64),
        roughness: f64,
    ) -> Option<HeightsBelow<'a>> {
        if surface.is_level() {
            return None;
        }
        let ground = pose.ground(image)?;
        let layer = surface.layer();
        let texture = textures.texture(layer.texture()).ok()?;
        let description: &'a vastex::Description = texture.description();
        let patches = Patches::new(surface.base, surface.texels(), picture[1]);
        let uniform = surface.uniform(&patches, pose);
        let texels_by_distance = f64::from((uniform.spacing * uniform.texels).max_element());
        let mut below = HeightsBelow {
            surface,
            sampler: textures.cpu().sampler(layer)?,
            geometry: &description.geometry,
            scale: description.layers.get(layer.index())?.scale,
            ground,
            altitude: pose.ray(DVec2::ZERO)?.from.z,
            raised: 0.0,
            roughness,
            texels_by_distance,
            quad_by_distance: f64::from(uniform.spacing.x) * ground.extent().x,
            bias: f64::from(texture.bias_eighths()) / 8.0,
        };
        below.raised = below.height_at(DVec3::ZERO);
        Some(below)
    }

    /// How high the ground is below the camera, above the surface without heights.
    pub(super) fn raised(&self) -> f64 {
        self.raised
    }

    /// How far along a ray of the pose it meets the surface, and where; `None` if it does not. Beside the
    /// edge of a terrain that may be from beneath, as it is drawn.
    pub(super) fn met_by(&mut self, ray: &Ray) -> Option<(f64, DVec3)> {
        // The pose is told from the ground.
        let ray = Ray { from: ray.from + DVec3::Z * self.raised, ..*ray };
        let [low, high] = self.surface.bounds();
        let margin = MARGIN * (high - low).max(f64::MIN_POSITIVE);
        let shell = self.ground.over_image(&ray, self.ground.beneath(&ray, high + margin)?)?;
        let [begin, mut end] = shell;
        if let Some([lowest, _]) = self.ground.beneath(&ray, low - margin).filter(|[at, _]| *at > begin) {
            end = end.min(lowest);
        }
        let (mut at, was_above) = (begin, self.is_above(ray.at(begin)));
        while at < end {
            let mut before = at;
            at = (at + self.step(&ray, at).max((end - begin) / MOST_STEPS)).min(end);
            if self.is_above(ray.at(at)) != was_above {
                for _ in 0..HALVINGS {
                    let middle = 0.5 * (before + at);
                    let is_before = self.is_above(ray.at(middle)) == was_above;
                    *(if is_before { &mut before } else { &mut at }) = middle;
                }
                let distance = 0.5 * (before + at);
                return Some((distance, ray.at(distance)));
            }
        }
        None
    }

    /// How long a step may be from there: as far as the ground below it is one quad farther.
    fn step(&self, ray: &Ray, at: f64) -> f64 {
        let place = ray.at(at);
        let rise = ray.direction.dot(self.ground.up(place));
        let along = (1.0 - rise * rise).max(0.0).sqrt();
        self.roughness * self.quad_by_distance * self.distance(place) / along.max(1e-9)
    }

    /// How far from the camera the ground without heights is below a place, as levels have it.
    fn distance(&self, place: DVec3) -> f64 {
        self.ground.below(place).distance(DVec3::new(0.0, 0.0, self.altitude))
    }

    fn is_above(&mut self, place: DVec3) -> bool {
        self.ground.height(place) > self.height_at(place)
    }

    /// How high the surface is below a place, at the level at which it is drawn there.
    fn height_at(&mut self, place: DVec3) -> f64 {
        let texels = self.roughness * self.texels_by_distance * self.distance(place);
        let drawn = texels.max(1e-6).log2();
        let level = (drawn + self.bias).clamp(0.0, f64::from(self.geometry.coarsest()));
        let (uv, rows) = (self.ground.uv(place), self.surface.texels()[1]);
        match self.ground {
            Ground::Globe { .. } => height_on_globe(uv, drawn, rows, |uv| self.height_of_texels(uv, level)),
            Ground::Flat { .. } => self.height_of_texels(uv, level),
        }
    }

    /// How high the texels of the two levels around one say that a place is.
    fn height_of_texels(&mut self, uv: DVec2, level: f64) -> f64 {
        let finer = level.floor();
        let value = self.value(uv, finer as u8);
        let share = level - finer;
        // Rough answers go without the blend, which costs as much again.
        let value = match share > 0.0 && self.roughness <= 1.0 {
            true => value + (self.value(uv, finer as u8 + 1) - value) * share,
            false => value,
        };
        f64::from(self.surface.height(value as f32))
    }

    /// The value of the heights at a uv, blended of the four nearest texels of a level, or of a coarser one
    /// where that is not in memory. Exact for textures of any size, as queries by uv in f32 are not.
    fn value(&mut self, uv: DVec2, level: u8) -> f64 {
        let mut level = level;
        loop {
            let size = self.geometry.size();
            let at = self.geometry.level(level);
            let offset = self.geometry.sample_offset(level);
            let (mut texels, mut weights) = ([[0; 2]; 2], [0.0; 2]);
            for axis in 0..2 {
                let scale = u64::from(self.scale);
                let step = at.scale[axis] * scale;
                let of_level = uv[axis] * f64::from(size[axis]) / at.scale[axis] as f64 + offset[axis];
                let centred = of_level / scale as f64 - 0.5;
                let count = u64::from(size[axis]).div_ceil(step) as i64;
                let is_wrapped = matches!(self.ground, Ground::Globe { .. }) && axis == 0;
                let first = centred.floor();
                weights[axis] = centred - first;
                texels[axis] = [0, 1].map(|beside| {
                    let n = first as i64 + beside;
                    let n = if is_wrapped { n.rem_euclid(count) } else { n.clamp(0, count - 1) };
                    (n as u64 * step) as u32
                });
            }
            let mut rows = [0.0; 2];
            let mut coarser = None;
            for (row, y) in texels[1].into_iter().enumerate() {
                let [left, right] = texels[0].map(|x| {
                    let sample = self.sampler.texel([x, y], level);
                    if sample.level > f32::from(level) {
                        coarser = Some(coarser.unwrap_or(0).max(sample.level as u8));
                    }
                    f64::from(sample.value[0])
                });
                rows[row] = left + (right - left) * weights[0];
            }
            match coarser {
                // Each turn is coarser, and the coarsest levels are always there.
                Some(coarser) => level = coarser,
                None => return rows[0] + (rows[1] - rows[0]) * weights[1],
            }
        }
    }
}
