//! Which patches a surface with heights is drawn of: a quadtree over uv, finer where the camera is nearer, and between two
//! sizes of patches one that turns into the other.
//!
//! A patch is a grid of quads. With its distance from the camera a vertex moves to its neighbour of the next coarser grid, and is
//! there before a patch is drawn in the coarser one, so that edges of neighbours have the same vertices. All of that follows
//! from a vertex's own uv, never from its patch or its height; uv of vertices are exact (dyadic) numbers. How high the surface
//! is there is `relief`'s business, and the shaders': `relief_uv` in relief.wgsl is `Patches::vertex`.

use glam::{Mat4, Vec2, Vec3, Vec4};

use crate::scene::direction;

/// Quads along each side of a patch.
pub(crate) const QUADS: u32 = 16;
/// Patches that are drawn at most.
pub(crate) const MOST_PATCHES: usize = 1 << 14;
/// Shares of a patch's range between which its vertices move to the next coarser grid.
pub(crate) const MORPH: [f32; 2] = [0.75, 0.98];
/// Range of patches by their diagonal: at least what keeps neighbours within one level of each other, and vertices that a finer
/// patch has too from moving, with MORPH; at most what makes too many of them.
const RANGES: [f32; 2] = [4.25, 12.0];
/// Pixels between two vertices, about.
const PIXELS_PER_QUAD: f32 = 8.0;
/// Halvings of a patch that leave its vertices exact.
const MOST_DEPTH: u32 = 17;

/// The surface where heights are zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Base {
    /// The rectangle of 2 by 2h/w on the ground, for an image of w/h.
    Flat { image: f32 },
    /// The unit sphere.
    Globe,
}

impl Base {
    /// The point at `uv`.
    pub(crate) fn point(self, uv: Vec2) -> Vec3 {
        match self {
            Base::Flat { image } => Vec3::new(2.0 * uv.x - 1.0, (1.0 - 2.0 * uv.y) / image, 0.0),
            Base::Globe => {
                // Both sides of the date line are one.
                direction((uv.x.fract() - 0.5) * std::f32::consts::TAU, (0.5 - uv.y) * std::f32::consts::PI)
            }
        }
    }

    /// The point at `uv` and a height.
    pub(crate) fn lifted(self, uv: Vec2, height: f32) -> Vec3 {
        match self {
            Base::Flat { .. } => self.point(uv) + height * Vec3::Z,
            Base::Globe => self.point(uv) * (1.0 + height),
        }
    }

    /// The uv below a place over the surface, or nearest to it.
    pub(crate) fn uv_below(self, place: Vec3) -> Vec2 {
        let uv = match self {
            Base::Flat { image } => Vec2::new(0.5 + 0.5 * place.x, 0.5 - 0.5 * place.y * image),
            Base::Globe => {
                let up = place.normalize_or(Vec3::Z);
                let turn = up.y.atan2(up.x) / std::f32::consts::TAU;
                Vec2::new(0.5 + turn, 0.5 - up.z.asin() / std::f32::consts::PI)
            }
        };
        uv.clamp(Vec2::ZERO, Vec2::ONE)
    }

    /// In the world, for a step of 1 in uv; on the globe at the equator, nowhere more.
    pub(crate) fn extent(self) -> Vec2 {
        match self {
            Base::Flat { image } => Vec2::new(2.0, 2.0 / image),
            Base::Globe => Vec2::new(std::f32::consts::TAU, std::f32::consts::PI),
        }
    }

    /// Columns and rows of the largest patches, which are about square: powers of two.
    fn roots(self) -> [u32; 2] {
        let Vec2 { x, y } = self.extent();
        let halvings = (x / y).log2().round().clamp(-10.0, 10.0);
        [1 << halvings.max(0.0) as u32, 1 << (-halvings).max(0.0) as u32]
    }
}

/// A patch, as the vertex stage gets it.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub(crate) struct Patch {
    /// uv of its first corner.
    pub(crate) origin: Vec2,
    /// How far it goes from there.
    pub(crate) side: Vec2,
}

/// How a surface is cut into patches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Patches {
    pub(crate) base: Base,
    /// The distance from the camera within which a patch is drawn, by its side along u.
    pub(crate) range_per_side: f32,
    depth: u32,
}

/// What is in view: planes, positive on the side that is seen, and how high the surface may lie.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frustum {
    planes: [Vec4; 5],
    heights: [f32; 2],
}

impl Frustum {
    pub(crate) fn new(clip_from_world: Mat4, heights: [f32; 2]) -> Frustum {
        let [x, y, z, w] = [0, 1, 2, 3].map(|row| clip_from_world.row(row));
        // Nothing ends a view but the depth buffer's far side, which leaves everything in.
        let planes = [w + x, w - x, w + y, w - y, z].map(|plane| plane / plane.truncate().length());
        Frustum { planes, heights }
    }

    fn sees(&self, centre: Vec3, radius: f32) -> bool {
        self.planes.iter().all(|plane| plane.dot(centre.extend(1.0)) >= -radius)
    }
}

impl Patches {
    /// For heights of so many texels, in a picture of so many rows.
    pub(crate) fn new(base: Base, heights: [u32; 2], picture_rows: u32) -> Patches {
        let roots = base.roots();
        let quads = |axis: usize| (heights[axis] as f32 / (roots[axis] * QUADS) as f32).log2().ceil();
        let depth = quads(0).max(quads(1)).clamp(0.0, MOST_DEPTH as f32) as u32;
        let side = Vec2::new(1.0 / roots[0] as f32, 1.0 / roots[1] as f32);
        // A quad at the far end of a range is twice as large as at the near end.
        let rows_per_slope = 0.866 * picture_rows as f32;
        let range = rows_per_slope * std::f32::consts::SQRT_2 / (QUADS as f32 * PIXELS_PER_QUAD);
        let range = range.clamp(RANGES[0], RANGES[1]);
        Patches { base, depth, range_per_side: range * (side * base.extent()).length() / side.x }
    }

    /// uv from one vertex to the next, by distance.
    pub(crate) fn spacing(&self) -> Vec2 {
        let [columns, rows] = self.base.roots().map(|n| n as f32);
        2.0 / (self.range_per_side * QUADS as f32) * Vec2::new(1.0, columns / rows)
    }

    /// The patches to be drawn for levels by the distance from `eye`, a place over the surface without heights: those in view.
    pub(crate) fn select(&self, eye: Vec3, frustum: &Frustum) -> Vec<Patch> {
        let [columns, rows] = self.base.roots();
        let side = Vec2::new(1.0 / columns as f32, 1.0 / rows as f32);
        let mut selected = Vec::new();
        for (x, y) in (0..rows).flat_map(|y| (0..columns).map(move |x| (x, y))) {
            let patch = Patch { origin: Vec2::new(x as f32, y as f32) * side, side };
            self.descend(patch, self.depth, eye, frustum, &mut selected);
        }
        selected.truncate(MOST_PATCHES);
        selected
    }

    fn descend(&self, patch: Patch, finer: u32, eye: Vec3, frustum: &Frustum, selected: &mut Vec<Patch>) {
        let middle = patch.origin + 0.5 * patch.side;
        // No point of it is farther from its middle: the way there along the axes of uv is no shorter.
        let radius = 0.5 * (patch.side * self.base.extent()).length();
        let [low, high] = frustum.heights;
        let reach = radius * (1.0 + high.max(0.0)) + 0.5 * (high - low);
        if !frustum.sees(self.base.lifted(middle, 0.5 * (low + high)), reach) {
            return;
        }
        let nearest = eye.distance(self.base.point(middle)) - radius;
        let half = 0.5 * patch.side;
        if finer == 0 || nearest >= self.range_per_side * half.x {
            selected.push(patch);
            return;
        }
        for corner in [Vec2::ZERO, Vec2::X, Vec2::Y, Vec2::ONE] {
            let quarter = Patch { origin: patch.origin + corner * half, side: half };
            self.descend(quarter, finer - 1, eye, frustum, selected);
        }
    }

    /// Twin of `relief_uv` in relief.wgsl: where a vertex of a patch lies.
    #[cfg(test)]
    fn vertex(&self, patch: &Patch, [column, row]: [u32; 2], eye: Vec3) -> Vec2 {
        let at = Vec2::new(column as f32, row as f32);
        let odd = Vec2::new((column % 2) as f32, (row % 2) as f32);
        let uv = patch.origin + patch.side * at / QUADS as f32;
        let coarse = uv - patch.side * odd / QUADS as f32;
        let share = eye.distance(self.base.point(uv)) / (self.range_per_side * patch.side.x);
        let morph = ((share - MORPH[0]) / (MORPH[1] - MORPH[0])).clamp(0.0, 1.0);
        if morph == 1.0 { coarse } else { uv + (coarse - uv) * morph }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashMap;

    /// Everything is in view.
    fn all() -> Frustum {
        Frustum { planes: [Vec4::W; 5], heights: [0.0; 2] }
    }

    fn cases() -> impl Iterator<Item = (Patches, Vec3)> {
        let flat = |image| Base::Flat { image };
        let eyes = [
            Vec3::new(0.1, -0.2, 0.02),
            Vec3::new(-0.77, 0.3, 0.003),
            Vec3::new(0.0, -0.6, 0.2),
            Vec3::new(-1.02, 0.01, 0.05),
            Vec3::new(0.2, 0.1, 1.01),
            Vec3::new(3.0, -2.0, 1.5),
        ];
        [flat(2.0), flat(0.7), flat(1.3), Base::Globe].into_iter().flat_map(move |base| {
            let patches = [180, 720, 2160].map(|rows| Patches::new(base, [4000, 2000], rows));
            patches.into_iter().flat_map(move |patches| eyes.map(|eye| (patches, eye)))
        })
    }

    #[test]
    fn patches_cover_everything_once() {
        for (patches, eye) in cases() {
            let selected = patches.select(eye, &all());
            assert!(selected.len() < MOST_PATCHES, "{}", selected.len());
            let area: f64 = selected.iter().map(|p| f64::from(p.side.x) * f64::from(p.side.y)).sum();
            assert_eq!(area, 1.0);
        }
    }

    /// The edges of all patches, piece by piece: what is not on the rim of the surface is there twice, once from either side,
    /// bit by bit the same. On the globe the rim is the poles alone.
    #[test]
    fn edges_of_neighbours_agree() {
        for (patches, eye) in cases() {
            let bits = |uv: Vec2| {
                let u = if patches.base == Base::Globe && uv.x == 1.0 { 0.0 } else { uv.x };
                [u.to_bits(), uv.y.to_bits()]
            };
            let mut pieces: HashMap<[[u32; 2]; 2], u32> = HashMap::new();
            for patch in &patches.select(eye, &all()) {
                let sides: [fn(u32) -> [u32; 2]; 4] =
                    [|n| [n, 0], |n| [n, QUADS], |n| [0, n], |n| [QUADS, n]];
                for (side, n) in sides.iter().flat_map(|side| (0..QUADS).map(move |n| (side, n))) {
                    let [a, b] = [n, n + 1].map(|n| patches.vertex(patch, side(n), eye));
                    let is_rim = |axis: usize| a[axis] == b[axis] && (a[axis] == 0.0 || a[axis] == 1.0);
                    let is_rim = is_rim(1) || is_rim(0) && patches.base != Base::Globe;
                    if a != b && !is_rim {
                        let mut piece = [bits(a), bits(b)];
                        piece.sort_unstable();
                        *pieces.entry(piece).or_default() += 1;
                    }
                }
            }
            let odd = pieces.values().filter(|&&count| count != 2).count();
            assert_eq!(odd, 0, "of {} pieces: {patches:?} from {eye}", pieces.len());
        }
    }

    #[test]
    fn vertices_are_as_far_apart_as_spacing_says() {
        for (patches, eye) in cases() {
            for patch in patches.select(eye, &all()) {
                let uv = patch.origin + 0.5 * patch.side;
                let distance = eye.distance(patches.base.point(uv));
                let quad = patch.side.x / QUADS as f32;
                let said = patches.spacing().x * distance;
                // Finer near the eye, where heights have no more to say; twice as far apart at the far end of a range, and
                // farther in patches whose siblings are nearer, and beyond the largest.
                let is_finest =
                    patch.side.x * (1 << patches.depth) as f32 <= 1.0 / patches.base.roots()[0] as f32;
                let is_largest = patch.side.x * patches.base.roots()[0] as f32 == 1.0;
                assert!(is_finest || said >= 0.7 * quad, "{said} of {quad}");
                assert!(is_largest || said <= 3.0 * quad, "{said} of {quad}");
            }
        }
    }

    #[test]
    fn what_is_not_in_view_is_left_out_and_what_is_is_not() {
        let patches = Patches::new(Base::Flat { image: 2.0 }, [4000, 2000], 360);
        let eye = Vec3::new(0.0, -0.5, 0.1);
        let look = glam::camera::rh::view::look_at_mat4(eye, Vec3::new(0.0, 0.5, 0.0), Vec3::Z);
        let matrix = glam::camera::rh::proj::directx::perspective(1.0, 1.6, 0.01, 20.0) * look;
        let seen = patches.select(eye, &Frustum::new(matrix, [0.0, 0.1]));
        let everything = patches.select(eye, &all());
        assert!(seen.len() * 5 < everything.len() * 4, "{} of {}", seen.len(), everything.len());
        for patch in &everything {
            let inside = |corner: Vec2| {
                let point = patches.base.lifted(patch.origin + corner * patch.side, 0.05);
                let clip = matrix * point.extend(1.0);
                clip.x.abs() < clip.w && clip.y.abs() < clip.w
            };
            let is_seen = [Vec2::ZERO, Vec2::X, Vec2::Y, Vec2::ONE].into_iter().any(inside);
            assert!(!is_seen || seen.contains(patch), "{patch:?}");
        }
    }
}
