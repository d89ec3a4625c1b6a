//! Slices that lie askew: each can be turned out of its place upright on an axis.

use glam::DVec3;

use super::{VolumeLook, VolumePane};
use crate::volume::VolumeBox;

/// How far a slice is turned out of its place upright on an axis, in degrees: first about what is downward in
/// its picture, then about what is to the right there. Where both are 0 it is upright.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SliceTilt {
    /// The right half of the picture goes away from the eye where it is greater than 0.
    pub yaw: f64,
    /// The lower half does.
    pub pitch: f64,
}

impl SliceTilt {
    /// Returns true if the slice is upright on its axis.
    pub fn is_upright(&self) -> bool {
        *self == SliceTilt::default()
    }
}

/// Degrees that a slice is turned by at most, either way: beyond them it would be another slice.
pub(super) const MOST_TILT: f64 = 89.0;

impl VolumePane {
    /// The axis upright on a slice, away from the eye, and those to the right and downward in its picture
    /// where it is turned so far; each of unit length. Of what is seen in 3-D those of the slice across z.
    pub fn turned(self, tilt: SliceTilt) -> [DVec3; 3] {
        let [right, down] = self.axes().map(|axis| DVec3::AXES[axis]);
        let ahead = right.cross(down);
        if tilt.is_upright() {
            return [ahead, right, down];
        }
        let (sy, cy) = tilt.yaw.to_radians().sin_cos();
        let (sp, cp) = tilt.pitch.to_radians().sin_cos();
        let (right, ahead) = (right * cy + ahead * sy, ahead * cy - right * sy);
        let (down, ahead) = (down * cp + ahead * sp, ahead * cp - down * sp);
        [ahead, right, down]
    }
}

impl VolumeLook {
    /// How far a slice is turned; not at all where all is seen in 3-D.
    pub fn tilt(&self, pane: VolumePane) -> SliceTilt {
        self.tilts.get(pane.number()).copied().unwrap_or_default()
    }

    /// The axis upright on a slice, and those to the right and downward in its picture
    /// ([`VolumePane::turned`]).
    pub fn slice_axes(&self, pane: VolumePane) -> [DVec3; 3] {
        pane.turned(self.tilt(pane))
    }

    /// Returns true if all slices are upright on their axes.
    pub fn is_upright(&self) -> bool {
        self.tilts.iter().all(SliceTilt::is_upright)
    }

    /// Turns a slice by so many degrees.
    pub fn tilt_by(&mut self, pane: VolumePane, yaw: f64, pitch: f64) {
        if let Some(tilt) = self.tilts.get_mut(pane.number()) {
            (tilt.yaw, tilt.pitch) = (tilt.yaw + yaw, tilt.pitch + pitch);
        }
        self.tidy();
    }

    /// Puts all slices upright, through the middle of the voxel at which they meet.
    pub fn put_upright(&mut self, of: &VolumeBox) {
        self.tilts = Default::default();
        self.put_cross(of, self.cross);
    }

    /// Where a slice passes: the place at which slices meet, or of one that is upright the middle of the
    /// voxel there.
    pub fn met_by(&self, pane: VolumePane, of: &VolumeBox) -> DVec3 {
        match self.tilt(pane).is_upright() {
            true => (DVec3::from_array(self.voxel(of).map(f64::from)) + 0.5) * of.voxel,
            false => self.cross,
        }
    }

    /// Goes so many slices on: of one that is upright voxel by voxel, else by a side of a voxel, along the
    /// axis that is most nearly upright on it, as long as where slices meet stays in the volume.
    pub fn step_pane(&mut self, of: &VolumeBox, pane: VolumePane, steps: i64) {
        let Some(axis) = pane.axis() else { return };
        if self.tilt(pane).is_upright() {
            return self.step_slice(of, axis, steps);
        }
        let [ahead, ..] = self.slice_axes(pane);
        // As slices that are upright go on: towards larger numbers of voxels.
        let ahead = if ahead[axis] < 0.0 { -ahead } else { ahead };
        let one = 1.0 / (ahead.abs() / of.voxel).max_element();
        // How far the place may go along the way, in whole steps.
        let (mut least, mut most) = (f64::NEG_INFINITY, f64::INFINITY);
        for axis in (0..3).filter(|axis| ahead[*axis] != 0.0) {
            let ends = [0.0, of.extent()[axis]].map(|end| (end - self.cross[axis]) / ahead[axis]);
            (least, most) = (least.max(ends[0].min(ends[1])), most.min(ends[0].max(ends[1])));
        }
        let by = (steps as f64).clamp((least.min(0.0) / one).ceil(), (most.max(0.0) / one).floor());
        self.cross += ahead * one * by;
    }
}

/// The corners of the part of a box that a plane cuts, in their order round it: `axes` as
/// [`VolumePane::turned`] gives them, through a place. Fewer than three where it does not cut it.
pub fn cut_of(of: &VolumeBox, through: DVec3, [ahead, right, down]: [DVec3; 3]) -> Vec<DVec3> {
    let extent = of.extent();
    let corner = |bits: usize| {
        DVec3::from_array([0, 1, 2].map(|axis| if bits >> axis & 1 == 1 { extent[axis] } else { 0.0 }))
    };
    let away = |place: DVec3| (place - through).dot(ahead);
    let mut corners = Vec::new();
    for (axis, first) in (0..3).flat_map(|axis| (0..8).map(move |first| (axis, first))) {
        if first >> axis & 1 == 1 {
            continue;
        }
        let (from, to) = (corner(first), corner(first | 1 << axis));
        let (a, b) = (away(from), away(to));
        if (a < 0.0) != (b < 0.0) {
            corners.push(from + (to - from) * (a / (a - b)));
        }
    }
    let middle = corners.iter().sum::<DVec3>() / corners.len().max(1) as f64;
    let angle = |place: &DVec3| (*place - middle).dot(down).atan2((*place - middle).dot(right));
    corners.sort_by(|a, b| angle(a).total_cmp(&angle(b)));
    corners
}

#[cfg(test)]
mod tests {
    use super::super::tests::facts;
    use super::*;

    #[test]
    fn a_slice_is_turned_about_its_own_picture() {
        for pane in [VolumePane::X, VolumePane::Y, VolumePane::Z] {
            for (yaw, pitch) in [(0.0, 0.0), (30.0, 0.0), (0.0, -40.0), (25.0, 60.0)] {
                let [ahead, right, down] = pane.turned(SliceTilt { yaw, pitch });
                assert!((right.cross(down) - ahead).length() < 1e-12, "never mirrored");
                let [before, ..] = pane.turned(SliceTilt::default());
                let cosine = yaw.to_radians().cos() * pitch.to_radians().cos();
                assert!((ahead.dot(before) - cosine).abs() < 1e-12, "{pane:?} {yaw} {pitch}");
            }
            let [_, right, down] = pane.turned(SliceTilt { yaw: 10.0, pitch: 10.0 });
            let [before, ..] = pane.turned(SliceTilt::default());
            assert!(right.dot(before) > 0.1 && down.dot(before) > 0.1, "they go away from the eye");
        }
    }

    #[test]
    fn an_upright_slice_goes_through_voxels_and_a_tilted_one_through_the_place() {
        let facts = facts();
        let mut look = VolumeLook::first(&facts);
        look.tilt_by(VolumePane::Z, 30.0, 200.0);
        assert_eq!(look.tilt(VolumePane::Z), SliceTilt { yaw: 30.0, pitch: MOST_TILT });
        look.tilt_by(VolumePane::Z, 0.0, -MOST_TILT - 20.0);
        assert!(!look.is_upright() && look.tilt(VolumePane::X).is_upright());
        let place = DVec3::new(3.3, 4.1, 7.7);
        look.put_cross(&facts.of, place);
        assert_eq!((look.cross, look.voxel(&facts.of)), (place, [13, 16, 7]));
        assert_eq!(look.met_by(VolumePane::Z, &facts.of), place);
        assert_eq!(look.met_by(VolumePane::X, &facts.of).x, 13.5 * 0.25);
        // A side of a voxel along z, about: voxels are four times as large there.
        let [ahead, ..] = look.slice_axes(VolumePane::Z);
        look.step_pane(&facts.of, VolumePane::Z, 1);
        let by = (look.cross - place).dot(ahead);
        assert!((0.2..=1.1).contains(&by), "{by}");
        look.step_pane(&facts.of, VolumePane::Z, -1);
        assert!((look.cross - place).length() < 1e-9);
        look.step_pane(&facts.of, VolumePane::Z, i64::from(i32::MAX));
        let (end, extent) = (look.cross, facts.of.extent());
        assert!(end != place && end.cmpge(DVec3::ZERO).all() && end.cmple(extent).all(), "{end}");
        look.step_pane(&facts.of, VolumePane::Z, 1);
        assert_eq!(look.cross, end, "it ends there");
        look.put_upright(&facts.of);
        assert!(look.is_upright() && look.met_by(VolumePane::Z, &facts.of) == look.cross);
    }

    #[test]
    fn a_plane_cuts_a_box_in_a_polygon() {
        let of = facts().of;
        let middle = of.extent() / 2.0;
        let upright = cut_of(&of, middle, VolumePane::Z.turned(SliceTilt::default()));
        assert_eq!(upright.len(), 4);
        assert!(upright.iter().all(|corner| corner.z == middle.z));
        let tilt = SliceTilt { yaw: 40.0, pitch: 35.0 };
        let axes = VolumePane::Z.turned(tilt);
        let cut = cut_of(&of, middle, axes);
        assert!((3..=6).contains(&cut.len()));
        assert!(cut.iter().all(|corner| (*corner - middle).dot(axes[0]).abs() < 1e-9));
        assert!(cut_of(&of, middle * 9.0, axes).is_empty());
    }
}
