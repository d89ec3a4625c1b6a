//! From where a volume is seen: a face of its box, a slice, or any place around it.
//!
//! The world of a volume begins at the first corner of its first voxel; voxels have sides of any length in
//! it. All of this is in `f64`; what shaders are told is measured from an anchor near the middle of the view.

use std::fmt;
use std::str::FromStr;

use bytemuck::{Pod, Zeroable};
use glam::{DVec2, DVec3, UVec3, Vec3};

/// The box of a volume in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VolumeBox {
    /// Voxels of level 0 along x, y and z.
    pub size: [u32; 3],
    /// The sides of one of them, in units of the world: greater than 0.
    pub voxel: DVec3,
}

/// A way to look along an axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum VolumeFace {
    /// Along x: y to the right, z downward.
    PlusX,
    /// Against x: y to the left, z downward.
    MinusX,
    /// Along y: x to the left, z downward.
    PlusY,
    /// Against y: x to the right, z downward.
    MinusY,
    /// Along z: x to the right, y downward.
    #[default]
    PlusZ,
    /// Against z: x to the left, y downward.
    MinusZ,
}

/// What is seen of a volume, and from where.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum VolumeView {
    /// The whole volume in parallel rays, a face filling the picture as far as its proportions allow. Where
    /// the picture is as large as the face is in voxels, a pixel is a voxel, also of voxels that are no
    /// cubes.
    Face(VolumeFace),
    /// A plane of voxels: across which axis (0 to 2), and which, counted from 0 in voxels of level 0. z and y
    /// are seen with x to the right, x with y.
    Slice {
        /// The axis that the plane stands upright on.
        axis: u8,
        /// Which voxel along it.
        voxel: u32,
    },
    /// A plane at any place, as large as one likes.
    Plane(VolumePlane),
    /// In perspective from a point around it.
    Around(VolumeCamera),
}

/// A plane of a volume's world, seen at a right angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VolumePlane {
    /// What is in the middle of the picture.
    pub middle: DVec3,
    /// To the right in the picture, of unit length.
    pub right: DVec3,
    /// Downward in the picture, of unit length and at a right angle to that.
    pub down: DVec3,
    /// The side of a pixel in the world, greater than 0.
    pub pixel: f64,
}

/// The part of a volume that rays go through; slices show all of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VolumeClip {
    /// The corners of the box that is left, in the world. What of it lies outside of the volume is nothing.
    pub corners: [DVec3; 2],
    /// A plane that hides what lies beyond it: which way is beyond, of unit length, and how far along that it
    /// stands, in the world.
    pub plane: Option<(DVec3, f64)>,
}

impl Default for VolumeClip {
    /// All of the volume.
    fn default() -> VolumeClip {
        VolumeClip { corners: [DVec3::NEG_INFINITY, DVec3::INFINITY], plane: None }
    }
}

/// A camera that looks at a point of a volume's world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VolumeCamera {
    /// What is in the middle of the picture.
    pub target: DVec3,
    /// From where: a point that is another one.
    pub eye: DVec3,
    /// What is downward in the picture, about.
    pub down: DVec3,
    /// Half of the angle from the upper to the lower edge of the picture, in radians.
    pub half_height: f64,
}

impl VolumeBox {
    /// A box of so many voxels along x, y and z, with sides of these lengths.
    pub fn new(size: [u32; 3], voxel: [f64; 3]) -> VolumeBox {
        VolumeBox { size, voxel: voxel.into() }
    }

    /// The sides of the box in the world.
    pub fn extent(&self) -> DVec3 {
        UVec3::from_array(self.size).as_dvec3() * self.voxel
    }
}

impl VolumeFace {
    /// Every face.
    pub const ALL: [VolumeFace; 6] = {
        use VolumeFace::*;
        [PlusX, MinusX, PlusY, MinusY, PlusZ, MinusZ]
    };

    /// The face's name: `+x` to `-z`.
    pub const fn name(self) -> &'static str {
        match self {
            VolumeFace::PlusX => "+x",
            VolumeFace::MinusX => "-x",
            VolumeFace::PlusY => "+y",
            VolumeFace::MinusY => "-y",
            VolumeFace::PlusZ => "+z",
            VolumeFace::MinusZ => "-z",
        }
    }

    /// To the right, downward, and away from the viewer.
    pub fn axes(self) -> [DVec3; 3] {
        let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
        match self {
            VolumeFace::PlusX => [y, z, x],
            VolumeFace::MinusX => [-y, z, -x],
            VolumeFace::PlusY => [-x, z, y],
            VolumeFace::MinusY => [x, z, -y],
            VolumeFace::PlusZ => [x, y, z],
            VolumeFace::MinusZ => [-x, y, -z],
        }
    }
}

impl fmt::Display for VolumeFace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for VolumeFace {
    type Err = String;

    fn from_str(text: &str) -> Result<VolumeFace, String> {
        VolumeFace::ALL
            .into_iter()
            .find(|face| face.name() == text)
            .ok_or_else(|| "the faces are +x, -x, +y, -y, +z and -z".to_owned())
    }
}

/// The rays of a picture: origin and direction of the ray of each pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VolumeRays {
    /// Where the ray of the corner of pixel 0,0 begins, in the world; what is added for a pixel to the right,
    /// and downward.
    pub origin: [DVec3; 3],
    /// The ray's direction in the world, not of unit length; and what is added.
    pub toward: [DVec3; 3],
    /// The smaller side of a pixel at the beginning, in units of the world, which levels follow from; where
    /// the picture has as many pixels as the face has voxels, the smallest side of a voxel.
    pub pixel: f64,
    /// What that side grows by along a ray, per unit of the world.
    pub growth: f64,
    /// The point of the world in the middle of the view.
    pub middle: DVec3,
}

impl VolumeView {
    /// Returns true if the view is a slice.
    pub fn is_slice(&self) -> bool {
        matches!(self, VolumeView::Slice { .. } | VolumeView::Plane(_))
    }

    /// The rays of a picture of so many pixels.
    pub fn rays(&self, of: &VolumeBox, picture: [u32; 2]) -> VolumeRays {
        match *self {
            VolumeView::Face(face) => {
                let [right, down, forward] = face.axes();
                // Every ray begins before the box.
                let middle = of.extent() / 2.0;
                let before = middle - forward * (forward.dot(middle).abs() + of.extent().max_element());
                parallel(of, picture, [right, down, forward], before)
            }
            VolumeView::Slice { axis, voxel } => {
                let [right, down, forward] = match axis {
                    0 => [DVec3::Y, DVec3::Z, DVec3::X],
                    1 => [DVec3::X, DVec3::Z, DVec3::Y],
                    _ => [DVec3::X, DVec3::Y, DVec3::Z],
                };
                let mut middle = of.extent() / 2.0;
                let axis = usize::from(axis.min(2));
                middle[axis] = (f64::from(voxel) + 0.5) * of.voxel[axis];
                parallel(of, picture, [right, down, forward], middle)
            }
            VolumeView::Plane(plane) => plane.rays(picture),
            VolumeView::Around(camera) => camera.rays(picture),
        }
    }
}

impl VolumePlane {
    /// The plane through a point of the world with a normal of any length, which points away from the eye:
    /// all of the volume that it cuts fills a picture of so many pixels as far as its proportions allow.
    /// Downward is +z as far as it can be, +y where the normal is along z. `None` where it cuts nothing, and
    /// of a normal that is 0.
    pub fn through(of: &VolumeBox, at: DVec3, normal: DVec3, picture: [u32; 2]) -> Option<VolumePlane> {
        let forward = normal.try_normalize()?;
        let upright = if forward.z.abs() > 0.999_999 { DVec3::Y } else { DVec3::Z };
        let down = (upright - forward * upright.dot(forward)).try_normalize()?;
        let right = down.cross(forward);
        // Where it cuts the edges of the box, in the plane.
        let (mut least, mut most) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for (corner, axis) in (0..8_u32).flat_map(|corner| (0..3).map(move |axis| (corner, axis))) {
            if corner >> axis & 1 == 1 {
                continue;
            }
            let ends = [corner, corner | 1 << axis].map(|corner| {
                let at_end = UVec3::new(corner & 1, corner >> 1 & 1, corner >> 2).as_dvec3();
                at_end * of.extent() - at
            });
            let [before, behind] = ends.map(|end| end.dot(forward));
            if before.signum() == behind.signum() && before != 0.0 && behind != 0.0 {
                continue;
            }
            let share = if before == behind { 0.0 } else { before / (before - behind) };
            let cut = ends[0] + (ends[1] - ends[0]) * share;
            let cut = DVec2::new(cut.dot(right), cut.dot(down));
            (least, most) = (least.min(cut), most.max(cut));
        }
        let sides = most - least;
        let pixel = (sides / DVec2::new(picture[0].into(), picture[1].into())).max_element();
        let middle = (least + most) / 2.0;
        let is_seen = sides.min_element() > 0.0 && pixel.is_finite();
        is_seen.then(|| VolumePlane { middle: at + right * middle.x + down * middle.y, right, down, pixel })
    }

    fn rays(&self, picture: [u32; 2]) -> VolumeRays {
        let [width, height] = picture.map(f64::from);
        let (right, down) = (self.right * self.pixel, self.down * self.pixel);
        VolumeRays {
            origin: [self.middle - right * (width / 2.0) - down * (height / 2.0), right, down],
            toward: [self.right.cross(self.down), DVec3::ZERO, DVec3::ZERO],
            pixel: self.pixel,
            growth: 0.0,
            middle: self.middle,
        }
    }
}

/// Parallel rays along `forward`, that of the middle of the picture from `middle` on.
fn parallel(of: &VolumeBox, picture: [u32; 2], axes: [DVec3; 3], middle: DVec3) -> VolumeRays {
    let [right, down, forward] = axes;
    let size = UVec3::from_array(of.size).as_dvec3();
    let pixels = DVec2::new(picture[0].into(), picture[1].into());
    // Sides of the face, in voxels and in the world.
    let along = |sizes: DVec3| DVec2::new(right.dot(sizes).abs(), down.dot(sizes).abs());
    let (voxels, sides) = (along(size), along(of.extent()));
    let is_own_size = voxels == pixels;
    let pixel = if is_own_size { sides / voxels } else { DVec2::splat((sides / pixels).max_element()) };
    let (right, down) = (right * pixel.x, down * pixel.y);
    let corner = middle - right * (pixels.x / 2.0) - down * (pixels.y / 2.0);
    VolumeRays {
        origin: [corner, right, down],
        toward: [forward, DVec3::ZERO, DVec3::ZERO],
        // A pixel is a voxel there: no level is fine enough that has larger ones along any axis, also along
        // one that the picture does not have.
        pixel: if is_own_size { of.voxel.min_element() } else { pixel.x },
        growth: 0.0,
        middle,
    }
}

impl VolumeCamera {
    /// A camera that sees all of a box and looks `toward` a way in the world, of any length.
    pub fn around(of: &VolumeBox, toward: [f64; 3], down: [f64; 3]) -> VolumeCamera {
        let (toward, down) = (DVec3::from_array(toward), DVec3::from_array(down));
        let (target, half_height) = (of.extent() / 2.0, 20.0f64.to_radians());
        let distance = of.extent().length() / 2.0 / half_height.sin();
        VolumeCamera { target, eye: target - toward.normalize_or(DVec3::Z) * distance, down, half_height }
    }

    fn rays(&self, picture: [u32; 2]) -> VolumeRays {
        let pixels = DVec2::new(picture[0].into(), picture[1].into());
        let forward = (self.target - self.eye).normalize_or(DVec3::Z);
        let right = self.down.cross(forward).normalize_or(forward.any_orthonormal_vector());
        let down = forward.cross(right);
        // At a length of 1 along `forward` a pixel has this side.
        let pixel = 2.0 * self.half_height.tan() / pixels.y;
        let corner = forward - right * (pixels.x / 2.0 * pixel) - down * (pixels.y / 2.0 * pixel);
        VolumeRays {
            origin: [self.eye, DVec3::ZERO, DVec3::ZERO],
            toward: [corner, right * pixel, down * pixel],
            pixel: 0.0,
            growth: pixel,
            middle: self.target,
        }
    }
}

/// What shaders are told of the rays: the first part of `VolumeScene` of volume.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub(super) struct RayUniform {
    origin: [f32; 3],
    pixel: f32,
    origin_x: [f32; 3],
    pixel_growth: f32,
    origin_y: [f32; 3],
    pub(super) step: f32,
    toward: [f32; 3],
    pub(super) density: f32,
    toward_x: [f32; 3],
    pub(super) iso: f32,
    toward_y: [f32; 3],
    pub(super) share: f32,
    voxel: [f32; 3],
    pub(super) wants: u32,
    begin: [f32; 3],
    size_x: f32,
    end: [f32; 3],
    size_y: f32,
    pub(super) anchor: [u32; 3],
    pub(super) view: u32,
    plane: [f32; 4],
}

impl RayUniform {
    pub(super) fn new(of: &VolumeBox, rays: &VolumeRays, picture: [u32; 2]) -> RayUniform {
        let last = UVec3::from_array(of.size).saturating_sub(UVec3::ONE).as_dvec3();
        let anchor = (rays.middle / of.voxel).floor().clamp(DVec3::ZERO, last);
        let offset = |world: DVec3| (world / of.voxel - anchor).as_vec3().to_array();
        let way = |world: DVec3| (world / of.voxel).as_vec3().to_array();
        let plain = |world: DVec3| world.as_vec3().to_array();
        RayUniform {
            origin: offset(rays.origin[0]),
            pixel: rays.pixel as f32,
            origin_x: way(rays.origin[1]),
            pixel_growth: rays.growth as f32,
            origin_y: way(rays.origin[2]),
            toward: plain(rays.toward[0]),
            toward_x: plain(rays.toward[1]),
            toward_y: plain(rays.toward[2]),
            voxel: plain(of.voxel),
            begin: (-anchor).as_vec3().to_array(),
            end: (UVec3::from_array(of.size).as_dvec3() - anchor).as_vec3().to_array(),
            size_x: picture[0] as f32,
            size_y: picture[1] as f32,
            anchor: anchor.as_uvec3().to_array(),
            ..RayUniform::default()
        }
    }

    /// What of the box is left.
    pub(super) fn clip(&mut self, of: &VolumeBox, clip: &VolumeClip) {
        let anchor = UVec3::from_array(self.anchor).as_dvec3();
        let [begin, end] = clip.corners.map(|corner| (corner / of.voxel - anchor).as_vec3());
        self.begin = Vec3::from_array(self.begin).max(begin).to_array();
        self.end = Vec3::from_array(self.end).min(end).to_array();
        if let Some((beyond, at)) = clip.plane {
            // Of an offset in voxels from the anchor.
            let along = (beyond * of.voxel).as_vec3();
            self.plane = along.extend((at - beyond.dot(anchor * of.voxel)) as f32).to_array();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOX: VolumeBox = VolumeBox { size: [40, 30, 20], voxel: DVec3::new(0.5, 0.5, 2.0) };

    #[test]
    fn no_face_is_mirrored() {
        for face in VolumeFace::ALL {
            let [right, down, forward] = face.axes();
            // The eye's own axes are right-handed, with y down and z away.
            assert_eq!(right.cross(down), forward, "{face}");
            assert_eq!(face.name().parse(), Ok(face));
        }
        assert!("z".parse::<VolumeFace>().is_err());
    }

    #[test]
    fn a_pixel_is_a_voxel_where_the_picture_is_the_face() {
        let rays = VolumeView::Face(VolumeFace::MinusX).rays(&BOX, [30, 20]);
        // y to the left, z downward.
        assert_eq!(rays.origin[1], DVec3::new(0.0, -0.5, 0.0));
        assert_eq!(rays.origin[2], DVec3::new(0.0, 0.0, 2.0));
        let uniform = RayUniform::new(&BOX, &rays, [30, 20]);
        let at = |axis: usize, pixel: f32| {
            uniform.origin[axis] + uniform.origin_x[axis] * pixel + uniform.anchor[axis] as f32
        };
        assert_eq!((at(1, 0.0), at(1, 0.5), at(1, 30.0)), (30.0, 29.5, 0.0));
        assert!(at(0, 0.0) > 40.0, "before the box");
    }

    #[test]
    fn other_pictures_keep_the_proportions_of_the_world() {
        // 20 x 15 in the world.
        let rays = VolumeView::Face(VolumeFace::PlusZ).rays(&BOX, [100, 100]);
        assert_eq!((rays.origin[1].x, rays.origin[2].y, rays.pixel), (0.2, 0.2, 0.2));
        assert_eq!(rays.origin[0].x, 0.0);
        assert!((rays.origin[0].y - (7.5 - 10.0)).abs() < 1e-12, "centred");
        let slice = VolumeView::Slice { axis: 2, voxel: 7 }.rays(&BOX, [40, 30]);
        assert_eq!(slice.origin[0], DVec3::new(0.0, 0.0, 15.0));
        // At the face's own size no voxel of a level may be larger than the smallest side of one.
        for view in [VolumeView::Face(VolumeFace::PlusX), VolumeView::Slice { axis: 0, voxel: 3 }] {
            let flat = VolumeBox { voxel: DVec3::new(0.5, 1.0, 2.0), ..BOX };
            assert_eq!((view.rays(&flat, [30, 20]).pixel, view.rays(&flat, [60, 40]).pixel), (0.5, 1.0));
        }
    }

    #[test]
    fn a_plane_through_a_point_shows_all_that_it_cuts() {
        // 20 x 15 x 40 in the world; across z it is the slice.
        let at = DVec3::new(3.0, 4.0, 15.0);
        let plane = VolumePlane::through(&BOX, at, DVec3::Z * 7.0, [100, 100]).unwrap();
        let slice = VolumeView::Slice { axis: 2, voxel: 7 }.rays(&BOX, [100, 100]);
        let rays = VolumeView::Plane(plane).rays(&BOX, [100, 100]);
        assert_eq!((rays.origin, rays.toward, rays.pixel), (slice.origin, slice.toward, slice.pixel));
        // Along a diagonal of x and y: 25 wide at the most, here from face to face, and 40 high.
        let diagonal = DVec3::new(15.0, -20.0, 0.0);
        let plane = VolumePlane::through(&BOX, DVec3::new(10.0, 7.5, 1.0), diagonal, [50, 20]).unwrap();
        assert!((plane.pixel - 2.0).abs() < 1e-12 && plane.down == DVec3::Z);
        assert!(plane.middle.abs_diff_eq(DVec3::new(10.0, 7.5, 20.0), 1e-12), "{plane:?}");
        assert_eq!(plane.right.cross(plane.down), diagonal.normalize(), "not mirrored");
        for (at, normal) in [([0.0, 0.0, 41.0], DVec3::Z), ([0.0; 3], DVec3::ZERO), ([0.0; 3], DVec3::ONE)] {
            assert_eq!(VolumePlane::through(&BOX, at.into(), normal, [9, 9]), None, "{at:?}, {normal}");
        }
    }

    #[test]
    fn a_plane_lies_where_it_is_put() {
        let plane =
            VolumePlane { middle: DVec3::new(9.0, 7.0, 11.0), right: DVec3::X, down: DVec3::Z, pixel: 0.5 };
        let rays = VolumeView::Plane(plane).rays(&BOX, [40, 20]);
        assert_eq!(rays.origin[0], DVec3::new(-1.0, 7.0, 6.0));
        assert_eq!(rays.origin[0] + rays.origin[1] * 20.0 + rays.origin[2] * 10.0, plane.middle);
        assert_eq!((rays.pixel, rays.toward[0]), (0.5, DVec3::NEG_Y));
        assert!(VolumeView::Plane(plane).is_slice());
    }

    #[test]
    fn what_is_clipped_is_no_longer_in_the_box() {
        let rays = VolumeView::Face(VolumeFace::PlusZ).rays(&BOX, [40, 30]);
        let all = RayUniform::new(&BOX, &rays, [40, 30]);
        let mut none = all;
        none.clip(&BOX, &VolumeClip::default());
        assert_eq!(none, all);
        let corners = [DVec3::new(5.0, -1.0, 10.0), DVec3::new(15.0, 100.0, 20.0)];
        let mut clipped = all;
        clipped.clip(&BOX, &VolumeClip { corners, plane: Some((DVec3::X, 8.0)) });
        // The anchor is voxel 20,15,0; voxels are 0.5, 0.5 and 2 long.
        assert_eq!((clipped.begin, clipped.end), ([-10.0, -15.0, 5.0], [10.0, 15.0, 10.0]));
        // Voxel 16 along x, whose offset is -4, is at the plane.
        assert_eq!(clipped.plane, [0.5, 0.0, 0.0, -2.0]);
    }

    #[test]
    fn a_camera_sees_the_whole_box() {
        let camera = VolumeCamera::around(&BOX, [1.0; 3], [0.0, 0.0, 1.0]);
        let rays = VolumeView::Around(camera).rays(&BOX, [64, 48]);
        let middle = rays.toward[0] + rays.toward[1] * 32.0 + rays.toward[2] * 24.0;
        assert!(middle.normalize().dot((camera.target - camera.eye).normalize()) > 1.0 - 1e-12);
        assert!(rays.toward[2].dot(DVec3::Z) > 0.0, "z is downward");
    }
}
