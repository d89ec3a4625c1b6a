//! Which patches a surface with heights is drawn of: a quadtree over uv, finer where the camera is nearer,
//! and between two sizes of patches one that turns into the other.
//!
//! A patch is a grid of quads. With its distance from the camera a vertex moves to its neighbour of the next
//! coarser grid, and is there before a patch is drawn in the coarser one, so that edges of neighbours have
//! the same vertices. All of that follows from a vertex's own uv, never from its patch or its height; uv of
//! vertices are exact (dyadic) numbers. How high the surface is there is `relief`'s business, and the
//! shaders': `relief_uv` in relief.wgsl is `Patches::vertex`.
//!
//! Patches are chosen in f64 and told as whole numbers ([`Cell`]); what shaders are told of them differs
//! between surfaces in uv ([`Patch`]) and in fixed point (`fixed_relief`).

use glam::{DMat3, DMat4, DVec2, DVec3, DVec4, Mat4, Vec2, Vec3};

use crate::scene::{direction, direction_f64};

/// Quads along each side of a patch.
pub(crate) const QUADS: u32 = 16;
/// Patches that are drawn at most.
pub(crate) const MOST_PATCHES: usize = 1 << 14;
/// Shares of a patch's range between which its vertices move to the next coarser grid.
pub(crate) const MORPH: [f32; 2] = [0.75, 0.98];
/// Range of patches by their diagonal: at least what keeps neighbours within one level of each other, and
/// vertices that a finer patch has too from moving, with MORPH; at most what makes too many of them.
const RANGES: [f32; 2] = [4.25, 12.0];
/// Pixels between two vertices, about.
pub(super) const PIXELS_PER_QUAD: f32 = 8.0;
/// Halvings of a patch that leave its vertices exact in f32.
const MOST_DEPTH: u32 = 17;
/// Halvings of a patch in fixed point beyond the texels of heights, where those are larger than pixels.
const SUBDIVISIONS: f32 = 3.0;
/// Halvings of the largest patches in fixed point, at most.
const MOST_FIXED_DEPTH: f32 = 34.0;

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

    /// The point at `uv`, in f64.
    pub(crate) fn point_f64(self, uv: DVec2) -> DVec3 {
        match self {
            Base::Flat { image } => DVec3::new(2.0 * uv.x - 1.0, (1.0 - 2.0 * uv.y) / f64::from(image), 0.0),
            Base::Globe => {
                direction_f64((uv.x - 0.5) * std::f64::consts::TAU, (0.5 - uv.y) * std::f64::consts::PI)
            }
        }
    }

    /// The point at `uv` and a height.
    pub(crate) fn lifted(self, uv: DVec2, height: f64) -> DVec3 {
        match self {
            Base::Flat { .. } => self.point_f64(uv) + height * DVec3::Z,
            Base::Globe => self.point_f64(uv) * (1.0 + height),
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
    pub(crate) fn roots(self) -> [u32; 2] {
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

/// A patch: its column and row among those of its size, each halving of the largest ones doubling their
/// number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Cell {
    /// The first of its columns.
    pub(crate) column: u64,
    pub(crate) row: u64,
    /// Halvings.
    pub(crate) depth: u32,
    /// The binary logarithm of its columns: more than 0 near a pole of a globe in fixed point, where columns
    /// are narrow.
    pub(crate) merged: u32,
}

impl Cell {
    /// uv of its first corner, and how far it goes from there.
    pub(crate) fn extent(self, base: Base) -> [DVec2; 2] {
        let [columns, rows] = base.roots().map(|roots| f64::from(roots) * f64::from(self.depth).exp2());
        let side = DVec2::new(1.0 / columns, 1.0 / rows);
        [
            DVec2::new(self.column as f64, self.row as f64) * side,
            side * DVec2::new(self.columns() as f64, 1.0),
        ]
    }

    /// Columns that it is wide.
    pub(crate) fn columns(self) -> u64 {
        1 << self.merged
    }

    /// The binary logarithm of columns that are together at most a quarter as wide as one at the equator, so
    /// that arcs round the pole are straight enough, for patches that begin at an edge of the row and go on
    /// towards the pole: the upper one (0) or the lower one (1).
    pub(crate) fn merged_beyond(self, base: Base, edge: u64) -> u32 {
        let rows = f64::from(base.roots()[1]) * f64::from(self.depth).exp2();
        let cosine = ((self.row + edge) as f64 / rows * std::f64::consts::PI).sin();
        // At the pole itself nothing begins.
        (0.25 / cosine.max(f64::EPSILON)).log2().floor().max(0.0) as u32
    }

    /// The cell's quarters or, where they are merged beside a pole, fewer.
    fn children(self, base: Base, is_merging: bool) -> impl Iterator<Item = Cell> {
        let rows = u64::from(base.roots()[1]) << (self.depth + 1);
        (0..2).flat_map(move |down| {
            let child = Cell {
                column: 2 * self.column,
                row: 2 * self.row + down,
                depth: self.depth + 1,
                merged: self.merged,
            };
            // Where it begins: at the edge that is nearer to the equator.
            let edge = u64::from(2 * child.row + 1 < rows);
            let is_beside_equator = 2 * child.row + 1 == rows; // a row that the equator halves
            let merged = match is_merging && !is_beside_equator {
                true => child.merged_beyond(base, edge).min(self.merged + 1),
                false => 0,
            };
            let halves = if merged > self.merged { 1 } else { 2 };
            (0..halves).map(move |right| Cell { column: child.column + (right << merged), merged, ..child })
        })
    }

    /// As the vertex stage gets it that knows uv.
    pub(crate) fn patch(self, base: Base) -> Patch {
        let [origin, side] = self.extent(base).map(DVec2::as_vec2);
        Patch { origin, side }
    }
}

/// How a surface is cut into patches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Patches {
    pub(crate) base: Base,
    /// The distance from the camera within which a patch is drawn, by its side along u.
    pub(crate) range_per_side: f32,
    pub(crate) depth: u32,
    /// True if columns are merged near the poles. In uv they are not, and there are the more of them.
    is_merging: bool,
}

/// What is in view: planes, positive on the side that is seen, in directions of their own from a place.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frustum {
    planes: [DVec4; 5],
    place: DVec3,
    local_from_world: DMat3,
}

impl Frustum {
    pub(crate) fn new(clip_from_world: Mat4) -> Frustum {
        Frustum::from_place(clip_from_world.as_dmat4(), DVec3::ZERO, DMat3::IDENTITY)
    }

    /// Of a matrix that is told in directions of its own, from a place.
    pub(crate) fn from_place(clip_from_local: DMat4, place: DVec3, local_from_world: DMat3) -> Frustum {
        let [x, y, z, w] = [0, 1, 2, 3].map(|row| clip_from_local.row(row));
        // Nothing ends a view but the depth buffer's far side, which leaves everything in.
        let planes = [w + x, w - x, w + y, w - y, z].map(|plane| plane / plane.truncate().length());
        Frustum { planes, place, local_from_world }
    }

    fn sees(&self, centre: DVec3, radius: f64) -> bool {
        let seen = (self.local_from_world * (centre - self.place)).extend(1.0);
        self.planes.iter().all(|plane| plane.dot(seen) >= -radius)
    }
}

/// What is known of a patch before it is drawn: its middle and half its sides in uv, and how far it is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PatchPlace {
    pub(crate) middle: DVec2,
    pub(crate) half: DVec2,
    /// From the camera, at least.
    pub(crate) nearest: f64,
}

/// Between which heights a patch lies.
pub(crate) type HeightsOf<'a> = dyn FnMut(&PatchPlace) -> [f64; 2] + 'a;

impl Patches {
    /// For heights of so many texels, in a picture of so many rows.
    pub(crate) fn new(base: Base, heights: [u32; 2], picture_rows: u32) -> Patches {
        let depth = texel_depth(base, heights).clamp(0.0, MOST_DEPTH as f32);
        Patches::to_depth(base, depth, picture_rows, false)
    }

    /// Patches in fixed point, where nothing but texels limits how fine they are.
    pub(crate) fn fixed(base: Base, heights: [u32; 2], picture_rows: u32) -> Patches {
        let depth = (texel_depth(base, heights) + SUBDIVISIONS).clamp(0.0, MOST_FIXED_DEPTH);
        Patches::to_depth(base, depth, picture_rows, base == Base::Globe)
    }

    fn to_depth(base: Base, depth: f32, picture_rows: u32, is_merging: bool) -> Patches {
        let roots = base.roots();
        let side = Vec2::new(1.0 / roots[0] as f32, 1.0 / roots[1] as f32);
        // A quad at the far end of a range is twice as large as at the near end.
        let rows_per_slope = 0.866 * picture_rows as f32;
        let range = rows_per_slope * std::f32::consts::SQRT_2 / (QUADS as f32 * PIXELS_PER_QUAD);
        let range = range.clamp(RANGES[0], RANGES[1]);
        let range_per_side = range * (side * base.extent()).length() / side.x;
        Patches { base, depth: depth as u32, range_per_side, is_merging }
    }

    /// uv from one vertex to the next, by distance.
    pub(crate) fn spacing(&self) -> Vec2 {
        let [columns, rows] = self.base.roots().map(|n| n as f32);
        2.0 / (self.range_per_side * QUADS as f32) * Vec2::new(1.0, columns / rows)
    }

    /// The patches to be drawn for levels by the distance from `eye`, a place over the surface without
    /// heights: those in view. The nearest come first where there are more than can be drawn.
    pub(crate) fn select(&self, eye: DVec3, frustum: &Frustum, heights: &mut HeightsOf<'_>) -> Vec<Cell> {
        let [columns, rows] = self.base.roots().map(u64::from);
        let mut selected = Vec::new();
        for (column, row) in (0..rows).flat_map(|row| (0..columns).map(move |column| (column, row))) {
            self.descend(Cell { column, row, depth: 0, merged: 0 }, eye, (frustum, heights), &mut selected);
        }
        if selected.len() > MOST_PATCHES {
            selected.sort_by_key(|cell| std::cmp::Reverse(cell.depth));
            selected.truncate(MOST_PATCHES);
        }
        selected
    }

    fn descend(
        &self,
        cell: Cell,
        eye: DVec3,
        (frustum, heights): (&Frustum, &mut HeightsOf<'_>),
        selected: &mut Vec<Cell>,
    ) {
        let [origin, side] = cell.extent(self.base);
        let half = 0.5 * side;
        let middle = origin + half;
        // No point of it is farther from its middle: the way there along the axes of uv is no shorter. Merged
        // columns are no wider than one at the equator.
        let column = half.x / cell.columns() as f64;
        let radius = (DVec2::new(column, half.y) * self.base.extent().as_dvec2()).length();
        let nearest = eye.distance(self.base.point_f64(middle)) - radius;
        let [low, high] = heights(&PatchPlace { middle, half, nearest });
        let reach = radius * (1.0 + high.max(0.0)) + 0.5 * (high - low);
        if !frustum.sees(self.base.lifted(middle, 0.5 * (low + high)), reach) {
            return;
        }
        if cell.depth == self.depth || nearest >= f64::from(self.range_per_side) * column {
            selected.push(cell);
            return;
        }
        for child in cell.children(self.base, self.is_merging) {
            self.descend(child, eye, (frustum, &mut *heights), selected);
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

/// Halvings of the largest patches after which a quad is no larger than a texel of heights.
fn texel_depth(base: Base, heights: [u32; 2]) -> f32 {
    let roots = base.roots();
    let quads = |axis: usize| (heights[axis] as f32 / (roots[axis] * QUADS) as f32).log2().ceil();
    quads(0).max(quads(1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashMap;

    /// The patches to be drawn where everything is in view.
    fn all(patches: &Patches, eye: Vec3) -> Vec<Patch> {
        let frustum =
            Frustum { planes: [DVec4::W; 5], place: DVec3::ZERO, local_from_world: DMat3::IDENTITY };
        chosen(patches, eye, &frustum, 0.0)
    }

    fn chosen(patches: &Patches, eye: Vec3, frustum: &Frustum, high: f64) -> Vec<Patch> {
        let cells = patches.select(eye.as_dvec3(), frustum, &mut |_| [0.0, high]);
        cells.into_iter().map(|cell| cell.patch(patches.base)).collect()
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
            let selected = all(&patches, eye);
            assert!(selected.len() < MOST_PATCHES, "{}", selected.len());
            let area: f64 = selected.iter().map(|p| f64::from(p.side.x) * f64::from(p.side.y)).sum();
            assert_eq!(area, 1.0);
        }
    }

    /// The edges of all patches, piece by piece: what is not on the rim of the surface is there twice, once
    /// from either side, bit by bit the same. On the globe the rim is the poles alone.
    #[test]
    fn edges_of_neighbours_agree() {
        for (patches, eye) in cases() {
            let bits = |uv: Vec2| {
                let u = if patches.base == Base::Globe && uv.x == 1.0 { 0.0 } else { uv.x };
                [u.to_bits(), uv.y.to_bits()]
            };
            let mut pieces: HashMap<[[u32; 2]; 2], u32> = HashMap::new();
            for patch in &all(&patches, eye) {
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
            for patch in all(&patches, eye) {
                let uv = patch.origin + 0.5 * patch.side;
                let distance = eye.distance(patches.base.point(uv));
                let quad = patch.side.x / QUADS as f32;
                let said = patches.spacing().x * distance;
                // Finer near the eye, where heights have no more to say; twice as far apart at the far end of
                // a range, and farther in patches whose siblings are nearer, and beyond the largest.
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
        let seen = chosen(&patches, eye, &Frustum::new(matrix), 0.1);
        let everything = all(&patches, eye);
        assert!(seen.len() * 5 < everything.len() * 4, "{} of {}", seen.len(), everything.len());
        for patch in &everything {
            let inside = |corner: Vec2| {
                let point = patches.base.lifted((patch.origin + corner * patch.side).as_dvec2(), 0.05);
                let clip = matrix * point.as_vec3().extend(1.0);
                clip.x.abs() < clip.w && clip.y.abs() < clip.w
            };
            let is_seen = [Vec2::ZERO, Vec2::X, Vec2::Y, Vec2::ONE].into_iter().any(inside);
            assert!(!is_seen || seen.contains(patch), "{patch:?}");
        }
    }
}
