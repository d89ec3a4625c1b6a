//! The camera of a survey: what a matrix says of where things are in a picture, and how large they are there.

use crate::wanted::vector::{Vec3, angle, cross, dot, length, sub_scaled};

/// A camera, told by the matrix that the picture is drawn with. To survey a model in its own space, give
/// `clip_from_world * world_from_model`.
///
/// Depths are 0 to 1 as in WebGPU, reversed or not. A matrix with numbers that are none sees nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// The rows of `clip_from_world`, without their last numbers, and these.
    rows: [Vec3; 4],
    offsets: [f64; 4],
    /// Half the picture's size, in pixels.
    half_picture: [f64; 2],
    /// `None` if the projection is parallel.
    eye: Option<Vec3>,
    /// Pixels along one unit of the world, across the view, where clip w is 1.
    focal: f64,
    /// The least clip w, in the view, of a point at distance 1 from the eye.
    least_w: f64,
}

impl Camera {
    /// The camera that draws a picture of so many pixels with a matrix, given column by column.
    pub fn new(clip_from_world: [[f32; 4]; 4], picture: [u32; 2]) -> Camera {
        let entry = |row: usize, column: usize| f64::from(clip_from_world[column][row]);
        let rows: [Vec3; 4] = std::array::from_fn(|row| std::array::from_fn(|column| entry(row, column)));
        let offsets: [f64; 4] = std::array::from_fn(|row| entry(row, 3));
        let half_picture = picture.map(|side| f64::from(side) / 2.0);
        let forward = rows[3];
        let across = |axis: usize| {
            let square = dot(forward, forward);
            let along = if square > 0.0 { dot(rows[axis], forward) / square } else { 0.0 };
            length(sub_scaled(rows[axis], along, forward)) * half_picture[axis]
        };
        Camera {
            rows,
            offsets,
            half_picture,
            eye: eye(&rows, &offsets),
            focal: across(0).max(across(1)),
            least_w: least_w(&rows),
        }
    }

    /// Where the camera is; `None` if the projection is parallel.
    pub fn eye(&self) -> Option<[f64; 3]> {
        self.eye
    }

    /// Pixels of the picture.
    pub(super) fn pixels(&self) -> f64 {
        4.0 * self.half_picture[0] * self.half_picture[1]
    }

    pub(super) fn focal(&self) -> f64 {
        self.focal
    }

    /// Clip w of a point, and by how much it changes along a unit of the world.
    pub(super) fn w(&self, point: Vec3) -> f64 {
        self.clip(3, point)
    }

    pub(super) fn w_per_unit(&self) -> f64 {
        length(self.rows[3])
    }

    fn clip(&self, row: usize, point: Vec3) -> f64 {
        dot(self.rows[row], point) + self.offsets[row]
    }

    /// From the eye to a point; the direction of sight where the projection is parallel.
    pub(super) fn ray(&self, point: Vec3) -> Vec3 {
        match self.eye {
            Some(eye) => sub_scaled(point, 1.0, eye),
            None => cross(self.rows[0], self.rows[1]),
        }
    }

    /// The direction of what is seen at a point of the picture, 0 to 1 across and down.
    #[cfg(test)]
    pub(super) fn ray_through(&self, place: [f64; 2]) -> Vec3 {
        let [x, y] = [2.0 * place[0] - 1.0, 1.0 - 2.0 * place[1]];
        let ray = cross(sub_scaled(self.rows[0], x, self.rows[3]), sub_scaled(self.rows[1], y, self.rows[3]));
        if dot(self.rows[3], ray) < 0.0 { ray.map(|n| -n) } else { ray }
    }

    /// The angle between the ray to a point and the middle of the view; 0 where the projection is parallel.
    pub(super) fn off_axis(&self, point: Vec3) -> f64 {
        if self.eye.is_some() { angle(self.ray(point), self.rows[3]) } else { 0.0 }
    }

    /// The same for the farthest corner of the picture.
    pub(super) fn corner_angle(&self) -> f64 {
        (self.least_w / self.w_per_unit()).min(1.0).acos()
    }

    /// The half angle under which a sphere appears; 0 where the projection is parallel, pi where the eye is
    /// within.
    pub(super) fn half_angle(&self, centre: Vec3, radius: f64) -> f64 {
        match self.eye {
            Some(eye) => {
                let distance = length(sub_scaled(centre, 1.0, eye));
                if radius >= distance { std::f64::consts::PI } else { (radius / distance).asin() }
            }
            None => 0.0,
        }
    }

    /// Returns true if any of a sphere may lie in the view.
    pub(super) fn sees(&self, centre: Vec3, radius: f64) -> bool {
        let w = self.w(centre);
        let within = |row: usize, sign: f64| {
            let across: Vec3 = std::array::from_fn(|a| self.rows[3][a] + sign * self.rows[row][a]);
            w + sign * self.clip(row, centre) >= -radius * length(across)
        };
        let beside = (0..2).all(|row| within(row, 1.0) && within(row, -1.0));
        let deep = self.clip(2, centre) >= -radius * length(self.rows[2]) && within(2, -1.0);
        beside && deep && w >= -radius * self.w_per_unit()
    }

    /// A clip w that no point of a sphere in the view is below.
    pub(super) fn nearest_w(&self, centre: Vec3, radius: f64) -> f64 {
        let by_depth = self.w(centre) - radius * self.w_per_unit();
        match self.eye {
            Some(eye) => by_depth.max(self.least_w * (length(sub_scaled(centre, 1.0, eye)) - radius)),
            None => by_depth,
        }
    }

    /// The same for a camera that may turn to any point of the sphere.
    pub(super) fn nearest_w_turned(&self, centre: Vec3, radius: f64) -> f64 {
        match self.eye {
            Some(eye) => self.w_per_unit() * (length(sub_scaled(centre, 1.0, eye)) - radius),
            None => self.w(centre),
        }
    }

    /// Pixels that a point moves by, across and down, when it moves along a direction in the world.
    pub(super) fn pixels_along(&self, point: Vec3, along: Vec3) -> [f64; 2] {
        let w = self.w(point);
        [0, 1].map(|row| {
            let place = self.clip(row, point) / w;
            dot(sub_scaled(self.rows[row], place, self.rows[3]), along) / w * self.half_picture[row]
        })
    }
}

/// The point whose clip x, y and w are 0.
fn eye(rows: &[Vec3; 4], offsets: &[f64; 4]) -> Option<Vec3> {
    let (x, y, w) = (rows[0], rows[1], rows[3]);
    let volume = dot(x, cross(y, w));
    let scale = length(x) * length(y) * length(w);
    if scale == 0.0 || volume.abs() < 1e-9 * scale {
        return None;
    }
    let parts = [(offsets[0], cross(y, w)), (offsets[1], cross(w, x)), (offsets[3], cross(x, y))];
    let sum = parts.iter().fold([0.0; 3], |sum, &(offset, part)| sub_scaled(sum, offset, part));
    Some(sum.map(|coordinate| coordinate / volume))
}

/// Clip w at distance 1 along the rays through the corners of the picture, the least of them.
fn least_w(rows: &[Vec3; 4]) -> f64 {
    let corner = |x: f64, y: f64| {
        let ray = cross(sub_scaled(rows[0], x, rows[3]), sub_scaled(rows[1], y, rows[3]));
        if length(ray) > 0.0 { dot(rows[3], ray).abs() / length(ray) } else { 0.0 }
    };
    let corners = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(-1.0, 1.0), corner(1.0, 1.0)];
    corners.into_iter().fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// At (1, 2, 3), looking along +x, z up: half the height is the distance, and 16:9.
    fn looking_along_x() -> Camera {
        // clip x = -(y - 2) * 9 / 16, clip y = z - 3, clip z = w - 0.1, w = x - 1
        let rows: [[f32; 4]; 4] = [
            [0.0, -9.0 / 16.0, 0.0, 18.0 / 16.0],
            [0.0, 0.0, 1.0, -3.0],
            [1.0, 0.0, 0.0, -1.1],
            [1.0, 0.0, 0.0, -1.0],
        ];
        Camera::new(std::array::from_fn(|column| rows.map(|row| row[column])), [1600, 900])
    }

    #[test]
    fn the_eye_is_found_and_what_is_before_it_seen() {
        let camera = looking_along_x();
        let eye = camera.eye().unwrap();
        assert!(length(sub_scaled(eye, 1.0, [1.0, 2.0, 3.0])) < 1e-6, "{eye:?}");
        assert!(camera.sees([5.0, 2.0, 3.0], 0.0));
        assert!(!camera.sees([-5.0, 2.0, 3.0], 1.0) && camera.sees([-5.0, 2.0, 3.0], 7.0));
        // The left edge of the view is at y = 2 + 16/9 of the distance.
        assert!(camera.sees([2.0, 2.0 + 1.7, 3.0], 0.0) && !camera.sees([2.0, 2.0 + 1.8, 3.0], 0.0));
        assert!(camera.sees([2.0, 2.0 + 1.8, 3.0], 0.05));
        assert!(!camera.sees([f64::NAN; 3], 1.0));
    }

    #[test]
    fn sizes_are_those_of_the_picture() {
        let camera = looking_along_x();
        assert!((camera.focal() - 450.0).abs() < 1e-3);
        let [across, down] = camera.pixels_along([3.0, 2.0, 3.0], [0.0, 1.0, 1.0]);
        assert!((across + 225.0).abs() < 1e-3 && (down - 225.0).abs() < 1e-3, "{across} {down}");
        // In the corner w is the distance over the length of (1, 16/9, 1).
        let expected = 1.0 / (1.0 + 1.0 + (16.0f64 / 9.0).powi(2)).sqrt();
        assert!((camera.least_w - expected).abs() < 1e-6, "{}", camera.least_w);
    }

    #[test]
    fn a_parallel_projection_has_no_eye() {
        let mut identity = [[0.0; 4]; 4];
        (0..4).for_each(|n| identity[n][n] = 1.0);
        let camera = Camera::new(identity, [200, 100]);
        assert_eq!(camera.eye(), None);
        assert_eq!((camera.focal(), camera.nearest_w([0.0; 3], 5.0)), (100.0, 1.0));
        assert_eq!(camera.half_angle([0.0; 3], 5.0), 0.0);
    }
}
