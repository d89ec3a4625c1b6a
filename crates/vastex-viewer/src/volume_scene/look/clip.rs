//! What a person cuts away of a volume that is seen as a whole.

use glam::DVec3;

use super::VolumeOrbit;
use crate::volume::{VolumeBox, VolumeClip};

/// What is cut away of a volume that is seen as a whole.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClipLook {
    /// Of each axis, from where to where something is seen, as shares of the box.
    pub shares: [[f64; 2]; 3],
    /// True if a plane hides what lies on its near side, in the direction in which it looks.
    pub has_plane: bool,
    /// The direction in which the plane looks, in degrees as [`VolumeOrbit`] has them.
    pub plane_yaw: f64,
    /// See [`ClipLook::plane_yaw`].
    pub plane_pitch: f64,
    /// How deep the plane stands in the box: 0 hides nothing, 1 all of it.
    pub plane_depth: f64,
}

impl Default for ClipLook {
    fn default() -> ClipLook {
        ClipLook {
            shares: [[0.0, 1.0]; 3],
            has_plane: false,
            plane_yaw: 0.0,
            plane_pitch: 0.0,
            plane_depth: 0.5,
        }
    }
}

impl ClipLook {
    /// What is left of a box.
    pub fn of(&self, of: &VolumeBox) -> VolumeClip {
        let extent = of.extent();
        let corner = |end: usize| {
            let share = |axis: usize| self.shares[axis][end];
            let inside = DVec3::new(share(0), share(1), share(2)) * extent;
            // A face of the box is where the shader has it.
            let beyond = if end == 0 { DVec3::NEG_INFINITY } else { DVec3::INFINITY };
            let is_whole = |axis: usize| self.shares[axis][end] == end as f64;
            let part = |axis: usize| if is_whole(axis) { beyond[axis] } else { inside[axis] };
            DVec3::new(part(0), part(1), part(2))
        };
        let plane = self.has_plane.then(|| {
            let (yaw, pitch) = (self.plane_yaw, self.plane_pitch);
            let look = VolumeOrbit { yaw, pitch, target: DVec3::ZERO, zoom: 1.0 };
            let [ahead, ..] = look.axes();
            let (middle, reach) = (ahead.dot(extent / 2.0), ahead.abs().dot(extent) / 2.0);
            let at = middle + reach * (2.0 * self.plane_depth - 1.0);
            (-ahead, -at)
        });
        VolumeClip { corners: [corner(0), corner(1)], plane }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::facts;
    use super::*;

    #[test]
    fn what_is_cut_away_follows_shares_and_the_plane() {
        let of = facts().of;
        let whole = ClipLook::default();
        assert_eq!(whole.of(&of), VolumeClip::default());
        let mut cut = whole;
        cut.shares[0] = [0.5, 1.0];
        (cut.has_plane, cut.plane_depth) = (true, 0.25);
        let clip = cut.of(&of);
        assert_eq!((clip.corners[0].x, clip.corners[1].x), (5.0, f64::INFINITY));
        // It looks along +y, and hides the first quarter of what lies there.
        let (beyond, at) = clip.plane.unwrap();
        assert!((beyond - DVec3::NEG_Y).length() < 1e-12 && (at + 7.5 * 0.25).abs() < 1e-12, "{beyond} {at}");
    }
}
