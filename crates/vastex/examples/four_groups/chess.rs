//! What is shown: chessmen on a board on a table, where they stand, and the eye and the light.

use std::f32::consts::TAU;
use std::ops::Range;

use glam::camera::rh::{
    proj::directx::{orthographic, perspective_infinite_reverse},
    view::look_at_mat4,
};
use glam::{Mat4, Quat, Vec2, Vec3};

/// Of a mesh.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
pub(crate) struct Vertex {
    place: [f32; 3],
    normal: [f32; 3],
    uv: [f32; 2],
}

/// Triangles, three indices of vertices each.
#[derive(Default)]
pub(crate) struct Mesh {
    pub(crate) vertices: Vec<Vertex>,
    pub(crate) indices: Vec<u32>,
}

/// Places of the materials.
pub(crate) const TABLE: usize = 0;
pub(crate) const BOARD: usize = 1;
pub(crate) const WHITE: usize = 2;
pub(crate) const BLACK: usize = 3;
pub(crate) const LEAD: usize = 4;

/// Something that is drawn.
pub(crate) struct Object {
    /// Its mesh's place among [`meshes`].
    pub(crate) mesh: usize,
    pub(crate) material: usize,
    pub(crate) world_from_object: Mat4,
}

const BOARD_HEIGHT: f32 = 0.28;
/// Half of its side, frame included: a square's side is 1.
const BOARD_HALF: f32 = 4.5;
const TABLE_HALF: f32 = 40.0;
/// Meshes before those of the chessmen.
const LEVEL: usize = 0;
const SLAB: usize = 1;
const BALL: usize = 2;
const FIRST_MAN: usize = 3;

/// The men by their letters; black's are small.
const MEN: &str = "PRBQK";
/// What each is turned to on a lathe: radius, height, radius, height, from the foot to the top.
const PROFILES: [&[f32]; 5] = [
    &[
        0.0, 0.0, 0.33, 0.0, 0.35, 0.06, 0.33, 0.14, 0.25, 0.2, 0.18, 0.32, 0.14, 0.5, 0.13, 0.62, 0.22,
        0.67, 0.22, 0.71, 0.13, 0.75, 0.17, 0.83, 0.21, 0.93, 0.19, 1.03, 0.11, 1.1, 0.0, 1.12,
    ],
    &[
        0.0, 0.0, 0.36, 0.0, 0.38, 0.07, 0.36, 0.16, 0.28, 0.23, 0.22, 0.38, 0.19, 0.62, 0.2, 0.84, 0.28,
        0.9, 0.3, 0.97, 0.3, 1.17, 0.27, 1.2, 0.22, 1.17, 0.2, 1.1, 0.0, 1.08,
    ],
    &[
        0.0, 0.0, 0.36, 0.0, 0.38, 0.07, 0.35, 0.16, 0.25, 0.25, 0.17, 0.45, 0.13, 0.75, 0.13, 0.9, 0.24,
        0.95, 0.24, 0.99, 0.14, 1.04, 0.18, 1.14, 0.21, 1.27, 0.17, 1.43, 0.08, 1.54, 0.05, 1.57, 0.09, 1.63,
        0.06, 1.69, 0.0, 1.71,
    ],
    &[
        0.0, 0.0, 0.39, 0.0, 0.41, 0.08, 0.38, 0.18, 0.28, 0.28, 0.19, 0.52, 0.14, 0.9, 0.14, 1.15, 0.27,
        1.21, 0.27, 1.26, 0.15, 1.32, 0.19, 1.5, 0.29, 1.72, 0.27, 1.77, 0.18, 1.78, 0.08, 1.84, 0.1, 1.91,
        0.06, 1.98, 0.0, 2.0,
    ],
    &[
        0.0, 0.0, 0.41, 0.0, 0.43, 0.08, 0.4, 0.18, 0.29, 0.29, 0.2, 0.55, 0.15, 0.95, 0.15, 1.25, 0.29,
        1.31, 0.29, 1.37, 0.16, 1.43, 0.2, 1.6, 0.27, 1.85, 0.24, 1.92, 0.1, 1.97, 0.06, 2.03, 0.12, 2.12,
        0.12, 2.2, 0.05, 2.27, 0.0, 2.29,
    ],
];
/// Where they stand, from black's side to white's.
const POSITION: [&str; 8] =
    ["..r..rk.", "..q...pp", "pb..p...", "...p.p..", "...P....", ".P.QB..P", "P....PP.", "R...R.K."];

/// The clip position of a place in the world, and the eye, for a picture of this size. Depth is 1 near the
/// eye and 0 far away.
pub(crate) fn eye([width, height]: [u32; 2]) -> (Mat4, Vec3) {
    let eye = Vec3::new(6.6, -7.2, 3.9);
    let view = look_at_mat4(eye, Vec3::new(0.75, 0.1, -0.1), Vec3::Z);
    (perspective_infinite_reverse(0.6, width as f32 / height as f32, 0.1) * view, eye)
}

/// The clip position in the shadow map, and the way to the sun.
pub(crate) fn sun() -> (Mat4, Vec3) {
    let sunward = Vec3::new(-0.62, -0.28, 0.73).normalize();
    let view = look_at_mat4(20.0 * sunward, Vec3::ZERO, Vec3::Z);
    (orthographic(-7.5, 7.5, -7.5, 7.5, 5.0, 35.0) * view, sunward)
}

/// Where everything stands. In the kings are weights of lead, which nobody sees; they come last.
pub(crate) fn objects() -> Vec<Object> {
    let down = Mat4::from_translation(Vec3::new(0.0, 0.0, -BOARD_HEIGHT));
    let table = down * Mat4::from_scale(Vec3::new(TABLE_HALF, TABLE_HALF, 1.0));
    let object = |mesh, material, world_from_object| Object { mesh, material, world_from_object };
    let (mut whites, mut blacks, mut weights) = (Vec::new(), Vec::new(), Vec::new());
    for (row, line) in (0u8..).zip(POSITION) {
        for (file, letter) in (0u8..).zip(line.chars()) {
            let Some(man) = MEN.find(letter.to_ascii_uppercase()) else { continue };
            let square = Mat4::from_translation(Vec3::new(f32::from(file) - 3.5, 3.5 - f32::from(row), 0.0));
            // Each shows another side of the stone.
            let turned = square * Mat4::from_rotation_z(2.4 * f32::from(row + file));
            match letter.is_uppercase() {
                true => whites.push(object(FIRST_MAN + man, WHITE, turned)),
                false => blacks.push(object(FIRST_MAN + man, BLACK, turned)),
            }
            if MEN[man..].starts_with('K') {
                let within = Mat4::from_translation(Vec3::new(0.0, 0.0, 0.2));
                weights.push(object(BALL, LEAD, square * within * Mat4::from_scale(Vec3::splat(0.13))));
            }
        }
    }
    // One of black's pawns is taken already.
    let taken = Mat4::from_translation(Vec3::new(5.55, -0.75, 0.345 - BOARD_HEIGHT));
    let lies = Mat4::from_rotation_z(2.75) * Mat4::from_rotation_x(-1.716);
    blacks.push(object(FIRST_MAN, BLACK, taken * lies));
    let still = [object(LEVEL, TABLE, table), object(SLAB, BOARD, Mat4::IDENTITY)];
    still.into_iter().chain(whites).chain(blacks).chain(weights).collect()
}

/// Every mesh that objects have, as fine as a picture of so many rows shows them.
pub(crate) fn meshes(height: u32) -> Vec<Mesh> {
    let sides = (height / 20).clamp(12, 36) as u16;
    let steps = sides.div_ceil(12);
    // A turn of the lathe is about as long as a man's profile. Of lead a small part shows.
    let man = |profile| turned(profile, sides, steps, [1.0, 0.45]);
    let level = grid(1, 1, |u, v| {
        let place = Vec3::new(2.0 * u - 1.0, 2.0 * v - 1.0, 0.0);
        // So often the image lies on the table.
        Vertex { place: place.to_array(), normal: [0.0, 0.0, 1.0], uv: [5.0 * u, 5.0 * v] }
    });
    let ball: Vec<f32> =
        (0..=12u8).map(|n| f32::from(n) * TAU / 24.0).flat_map(|t| [t.sin(), -t.cos()]).collect();
    let ball = turned(&ball, sides, steps, [0.05, 0.05]);
    [level, slab(), ball].into_iter().chain(PROFILES.map(man)).collect()
}

/// The board: its top, and four sides on which the image goes on.
fn slab() -> Mesh {
    let half = BOARD_HALF;
    let vertex = |place: Vec3, normal: Vec3| {
        // Downward along a side the image comes inward, as if it were folded over the edge.
        let inward = if normal.z > 0.5 { Vec2::ZERO } else { -normal.truncate() * -place.z };
        let at = (place.truncate() - inward) / half * Vec2::new(0.5, -0.5) + 0.5;
        Vertex { place: place.to_array(), normal: normal.to_array(), uv: at.to_array() }
    };
    let mut slab =
        grid(1, 1, |u, v| vertex(Vec3::new(half * (2.0 * u - 1.0), half * (2.0 * v - 1.0), 0.0), Vec3::Z));
    for side in 0..4u8 {
        let turn = Quat::from_rotation_z(f32::from(side) * TAU / 4.0);
        let along = |u: f32, v: f32| Vec3::new(half * (2.0 * u - 1.0), -half, BOARD_HEIGHT * (v - 1.0));
        slab.add(grid(1, 1, |u, v| vertex(turn * along(u, v), turn * -Vec3::Y)));
    }
    slab
}

/// A surface of revolution around z, smooth through the points of a profile, in so many steps from one to the
/// next. `uv` is what of the image goes around, and along a unit of the profile.
fn turned(profile: &[f32], sides: u16, steps: u16, uv: [f32; 2]) -> Mesh {
    let points: Vec<Vec2> = profile.chunks_exact(2).map(Vec2::from_slice).collect();
    let point = |n: usize| points[n.min(points.len() - 1)];
    let rings = steps * (points.len() - 1) as u16;
    // Catmull and Rom's spline, and the way along it.
    let spline = |t: f32| {
        let (nth, t) = (t as usize, t.fract());
        let (a, b, c, d) = (point(nth.max(1) - 1), point(nth), point(nth + 1), point(nth + 2));
        let (one, two, three) = (c - a, 2.0 * a - 5.0 * b + 4.0 * c - d, 3.0 * (b - c) + d - a);
        let at = b + 0.5 * t * (one + t * (two + t * three));
        (at.max(Vec2::ZERO), one + t * (2.0 * two + 3.0 * t * three))
    };
    let lengths: Vec<f32> = (0..=rings)
        .map(|ring| spline(f32::from(ring) / f32::from(steps)).0)
        .scan((points[0], 0.0), |(before, length), at| {
            *length += at.distance(*before);
            *before = at;
            Some(*length)
        })
        .collect();
    grid(sides, rings, |u, v| {
        let ring = (v * f32::from(rings)).round();
        let (at, along) = spline(ring / f32::from(steps));
        let out = Vec2::from_angle(TAU * u);
        let slope = Vec2::new(along.y, -along.x).normalize_or(Vec2::Y);
        let normal = (out * slope.x).extend(slope.y);
        Vertex {
            place: (out * at.x).extend(at.y).to_array(),
            normal: normal.to_array(),
            uv: [uv[0] * u, uv[1] * lengths[ring as usize]],
        }
    })
}

/// Two triangles between each four corners of a grid.
fn grid(columns: u16, rows: u16, vertex: impl Fn(f32, f32) -> Vertex) -> Mesh {
    let places = (0..=rows).flat_map(|y| (0..=columns).map(move |x| (x, y)));
    let at = |(x, y)| vertex(f32::from(x) / f32::from(columns), f32::from(y) / f32::from(rows));
    let line = u32::from(columns) + 1;
    let cells = (0..u32::from(rows)).flat_map(|y| (0..u32::from(columns)).map(move |x| y * line + x));
    let corners = |first| [first, first + 1, first + line, first + line, first + 1, first + line + 1];
    Mesh { vertices: places.map(at).collect(), indices: cells.flat_map(corners).collect() }
}

impl Mesh {
    /// Adds another, and says where its indices are.
    pub(crate) fn add(&mut self, other: Mesh) -> Range<u32> {
        let (vertices, first) = (self.vertices.len() as u32, self.indices.len() as u32);
        self.vertices.extend(other.vertices);
        self.indices.extend(other.indices.into_iter().map(|index| vertices + index));
        first..self.indices.len() as u32
    }
}
