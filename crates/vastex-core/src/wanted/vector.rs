//! Arithmetic of points and directions in the world, as far as surveys and motions need it.

/// A point or a direction.
pub(crate) type Vec3 = [f64; 3];

pub(crate) fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(crate) fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub(crate) fn length(a: Vec3) -> f64 {
    dot(a, a).sqrt()
}

/// `a - factor * b`.
pub(crate) fn sub_scaled(a: Vec3, factor: f64, b: Vec3) -> Vec3 {
    std::array::from_fn(|axis| a[axis] - factor * b[axis])
}

/// The angle between two directions, 0 to pi; 0 where one has no length.
pub(crate) fn angle(a: Vec3, b: Vec3) -> f64 {
    length(cross(a, b)).atan2(dot(a, b))
}
