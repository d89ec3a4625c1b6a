//! Surfaces with heights in fixed point: what relief_fixed.wgsl is told of a camera, and which patches are
//! drawn.
//!
//! Everything is worked out in f64 and told from the camera. Vertices stand on a grid of halvings of the
//! texture and are counted in its steps. How high the ground below the camera is the shaders look up
//! themselves; here it only says what is in view.

use std::f64::consts::{PI, TAU};

use glam::dcamera::rh::{proj::directx as projection, view::look_at_mat4};
use glam::{DMat3, DMat4, DVec2, DVec3, Mat4, Vec2};
use vastex::{CpuSampler, Textures};

use super::fixed::{FixedUniform, anchored};
use super::patches::{Base, Cell, Frustum, PatchPlace, Patches, QUADS};
use super::relief::{ReliefSurface, ReliefUniform};
use crate::camera::{Aim, FIELD_OF_VIEW, Pose};
use crate::picture::PicturePart;

/// The binary logarithm of the steps that the high part of a number of them counts.
const LOW_BITS: u32 = 16;
/// Patches of a larger share of the texture lie anywhere between the lowest and the highest value.
const LARGE: f64 = 1.0 / 64.0;
/// The shortest way in uv that queries on the CPU tell, and so over which they say how rough the ground is.
const FINEST_UV: f64 = 1.0 / (1 << 20) as f64;

/// A patch, as the vertex stage gets it in fixed point; `place` of `PatchStart` in relief_fixed.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub(crate) struct PatchStart {
    high: [i32; 2],
    low: [u16; 2],
    /// The binary logarithm of the steps along a quad, and of how much wider one is; whether there are half
    /// as many vertices on the upper edge, and on the lower one.
    shift: u8,
    merged: u8,
    is_halved: [u8; 2],
}

/// What the shaders are told of the grid; laid out as `ReliefGrid` in surface.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub(crate) struct GridUniform {
    step: Vec2,
    rest: Vec2,
    poles: [[i32; 2]; 2],
    size: [u32; 2],
    turn: i32,
    range_per_step: f32,
}

/// What is drawn of a surface with heights from a place, in fixed point.
pub(crate) struct FixedReliefView {
    /// From east, north and up of the camera, or from the axes of the world.
    pub(crate) clip_from_local: Mat4,
    pub(crate) uniform: ReliefUniform,
    pub(crate) fixed: FixedUniform,
    pub(crate) grid: GridUniform,
    /// The uv below the camera.
    pub(crate) middle: DVec2,
    pub(crate) patches: Vec<PatchStart>,
}

/// The grid that vertices stand on.
struct Grid {
    base: Base,
    /// Halvings of the largest patches after which quads are a step.
    depth: u32,
    /// Steps along both axes.
    steps: [i64; 2],
    /// The point before the camera.
    origin: [i64; 2],
}

impl Grid {
    /// A place is in texels of a texture of so many.
    fn new(patches: &Patches, place: DVec2, texels: DVec2) -> Grid {
        let roots = patches.base.roots();
        // At least so many steps that a turn is a whole number of high parts, and half of one too.
        let least = |roots: u32| (LOW_BITS + 1).saturating_sub(roots.ilog2() + QUADS.ilog2());
        let depth = patches.depth.max(least(roots[0])).max(least(roots[1]));
        let steps = roots.map(|roots| i64::from(roots * QUADS) << depth);
        let at = place / texels * DVec2::new(steps[0] as f64, steps[1] as f64);
        Grid { base: patches.base, depth, steps, origin: [at.x.floor() as i64, at.y.floor() as i64] }
    }

    fn uniform(&self, patches: &Patches, place: DVec2, size: [u32; 2]) -> GridUniform {
        let texels = DVec2::from(size.map(f64::from));
        let steps = DVec2::new(self.steps[0] as f64, self.steps[1] as f64);
        let origin = DVec2::new(self.origin[0] as f64, self.origin[1] as f64);
        let step = texels / steps;
        let rest = (place / step - origin) * step;
        GridUniform {
            step: step.as_vec2(),
            rest: rest.as_vec2(),
            poles: [0, self.steps[1]]
                .map(|row| parts(row - self.origin[1]))
                .map(|(high, low)| [high, low.into()]),
            size,
            turn: (self.steps[0] >> LOW_BITS) as i32,
            range_per_step: (f64::from(patches.range_per_side) * f64::from(QUADS) / steps.x) as f32,
        }
    }

    /// A patch from the point before the camera, on the globe the shorter way round.
    fn start(&self, cell: Cell) -> PatchStart {
        let shift = self.depth - cell.depth;
        let side = i64::from(QUADS) << shift;
        let mut from = [cell.column as i64 * side - self.origin[0], cell.row as i64 * side - self.origin[1]];
        let (middle, half) = (from[0] + side * cell.columns() as i64 / 2, self.steps[0] / 2);
        if self.base == Base::Globe && middle.abs() > half {
            from[0] -= middle.signum() * self.steps[0];
        }
        let [x, y] = from.map(parts);
        // Beyond an edge nearer to a pole patches may be wider.
        let is_wider = |edge| self.base == Base::Globe && cell.merged_beyond(self.base, edge) > cell.merged;
        let is_halved = [0, 1].map(|edge| u8::from(is_wider(edge)));
        PatchStart {
            high: [x.0, y.0],
            low: [x.1, y.1],
            shift: shift as u8,
            merged: cell.merged as u8,
            is_halved,
        }
    }
}

/// The high and the low part of a number of steps.
fn parts(steps: i64) -> (i32, u16) {
    ((steps >> LOW_BITS) as i32, (steps & ((1 << LOW_BITS) - 1)) as u16)
}

/// A camera in directions of its own: the place that it is over, in texels, how high, and what it sees.
struct Camera {
    place: DVec2,
    altitude: f64,
    latitude: f64,
    local_from_world: DMat3,
    clip_from_local: DMat4,
}

impl Camera {
    /// Nothing for an image, which heights do not displace.
    fn new(pose: &Pose, base: Base, texels: DVec2, view: f64) -> Option<Camera> {
        match *pose {
            Pose::Image { .. } => None,
            Pose::Globe { longitude, latitude, altitude, aim } => {
                let uv = DVec2::new((longitude / TAU + 0.5).rem_euclid(1.0), 0.5 - latitude / PI);
                let ((sin_lon, cos_lon), (sin_lat, cos_lat)) = (longitude.sin_cos(), latitude.sin_cos());
                let world_from_local = DMat3::from_cols(
                    DVec3::new(-sin_lon, cos_lon, 0.0),
                    DVec3::new(-cos_lon * sin_lat, -sin_lon * sin_lat, cos_lat),
                    DVec3::new(cos_lon * cos_lat, sin_lon * cos_lat, sin_lat),
                );
                Some(Camera {
                    place: uv * texels,
                    altitude,
                    latitude,
                    local_from_world: world_from_local.transpose(),
                    clip_from_local: projection::perspective(
                        FIELD_OF_VIEW,
                        view,
                        0.1 * altitude,
                        2.0 + altitude,
                    ) * eye_from_local(aim),
                })
            }
            Pose::Plane { eye, yaw, pitch } => {
                let extent = base.extent().as_dvec2();
                let uv = DVec2::new(0.5 + eye.x / extent.x, 0.5 - eye.y / extent.y);
                let forward = DVec3::new(-yaw.sin() * pitch.cos(), yaw.cos() * pitch.cos(), -pitch.sin());
                let near = 0.01 * eye.z.abs().max(1e-9);
                let look = look_at_mat4(DVec3::ZERO, forward, DVec3::Z);
                Some(Camera {
                    place: uv * texels,
                    altitude: eye.z,
                    latitude: 0.0,
                    local_from_world: DMat3::IDENTITY,
                    clip_from_local: projection::perspective(FIELD_OF_VIEW, view, near, 20.0) * look,
                })
            }
        }
    }
}

/// To the axes of a camera that looks along its -z, from those to the east, to the north and upwards.
fn eye_from_local(aim: Aim) -> DMat4 {
    if aim == Aim::DOWN {
        return DMat4::IDENTITY;
    }
    let DMat3 { x_axis, y_axis, z_axis } = aim.local_from_view();
    DMat4::from_mat3(DMat3::from_cols(x_axis, y_axis, -z_axis).transpose())
}

impl ReliefSurface {
    /// What a camera sees in fixed point that is so far above the ground as its pose says, of a texture of
    /// `size` texels in a part of a picture; `None` for the pose of an image.
    pub(crate) fn seen_in_fixed_point(
        &self,
        textures: &Textures,
        pose: &Pose,
        size: [u32; 2],
        part: &PicturePart,
    ) -> Option<FixedReliefView> {
        let (texels, picture) = (DVec2::from(size.map(f64::from)), part.whole);
        let camera = Camera::new(pose, self.base, texels, f64::from(picture[0]) / f64::from(picture[1]))?;
        let clip_from_local = match *part == PicturePart::all(picture) {
            true => camera.clip_from_local,
            false => part.clip_from_whole() * camera.clip_from_local,
        };
        let patches = Patches::fixed(self.base, self.texels(), picture[1]);
        let (uniform, grid) = (self.uniform(&patches, pose), Grid::new(&patches, camera.place, texels));
        let ground = f64::from(self.ground_below(textures, &uniform));
        let eye = pose.eye();
        let above = match self.base {
            Base::Flat { .. } => eye + ground * DVec3::Z,
            Base::Globe => eye + ground * eye.normalize_or(DVec3::Z),
        };
        let frustum = Frustum::from_place(clip_from_local, above, camera.local_from_world);
        let mut sampler = textures.cpu().sampler(self.layer());
        let texels_per_distance = (uniform.spacing * uniform.texels).max_element();
        let mut heights = |place: &PatchPlace| match &mut sampler {
            Some(sampler) if place.half.x < LARGE => {
                let level = (texels_per_distance * place.nearest.max(0.0) as f32).max(1.0).log2();
                self.heights_near(sampler, place, level)
            }
            _ => self.bounds(),
        };
        let cells = patches.select(eye, &frustum, &mut heights);
        Some(FixedReliefView {
            clip_from_local: clip_from_local.as_mat4(),
            uniform,
            fixed: self.fixed_uniform(&camera, texels),
            grid: grid.uniform(&patches, camera.place, size),
            middle: camera.place / texels,
            patches: cells.into_iter().map(|cell| grid.start(cell)).collect(),
        })
    }

    fn fixed_uniform(&self, camera: &Camera, texels: DVec2) -> FixedUniform {
        let (anchor, fraction) = anchored(camera.place, texels);
        FixedUniform {
            anchor,
            fraction,
            low: Vec2::ZERO,
            high: Vec2::ZERO,
            half: Vec2::ZERO,
            texels_per_unit: (texels / self.base.extent().as_dvec2()).as_vec2(),
            sine_and_cosine: DVec2::new(camera.latitude.sin(), camera.latitude.cos()).as_vec2(),
            altitude: camera.altitude as f32,
            unused: 0.0,
            turn: [[1.0, 0.0], [0.0, 1.0]],
            aim: [0.0, 1.0, 0.0, 1.0],
        }
    }

    /// Between which heights a patch lies, from those at its corners and its middle, as the CPU knows them,
    /// with room for what rises between them: as much again, and as much as the patch is wide.
    fn heights_near(&self, sampler: &mut CpuSampler<'_>, place: &PatchPlace, level: f32) -> [f64; 2] {
        let half = place.half.max(DVec2::splat(FINEST_UV));
        let mut found = [f64::INFINITY, f64::NEG_INFINITY];
        for corner in
            [DVec2::ZERO, DVec2::new(-1.0, -1.0), DVec2::new(1.0, -1.0), DVec2::new(-1.0, 1.0), DVec2::ONE]
        {
            let uv = place.middle + corner * half;
            let uv = DVec2::new(if self.base == Base::Globe { uv.x.rem_euclid(1.0) } else { uv.x }, uv.y);
            let uv = uv.clamp(DVec2::ZERO, DVec2::ONE).as_vec2();
            let height = f64::from(self.height(sampler.sample(uv.to_array(), level).value[0]));
            found = [found[0].min(height), found[1].max(height)];
        }
        let room = (found[1] - found[0]) + (2.0 * half * self.base.extent().as_dvec2()).length();
        let [low, high] = self.bounds();
        [(found[0] - room).max(low), (found[1] + room).min(high)]
    }
}
