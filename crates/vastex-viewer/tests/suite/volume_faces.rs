//! Which way round volumes are seen: what each face and each slice has to its right and downward, by name.

use glam::DVec3;
use vastex_viewer::volume::{VolumeBox, VolumeView};

const BOX: VolumeBox = VolumeBox { size: [40, 30, 20], voxel: DVec3::new(0.5, 0.5, 2.0) };

/// What a picture has to its right and downward, by what rays of pixels are apart.
#[test]
fn faces_and_slices_have_these_axes_to_the_right_and_downward() {
    let named = |way: DVec3| {
        let axis = (0..3).find(|axis| way[*axis] != 0.0).unwrap();
        let name = ["x", "y", "z"][axis];
        assert_eq!(way.to_array().iter().filter(|part| **part != 0.0).count(), 1, "{way}");
        format!("{}{name}", if way[axis] > 0.0 { '+' } else { '-' })
    };
    let of = |view: VolumeView| {
        let rays = view.rays(&BOX, [64, 64]);
        [named(rays.origin[1]), named(rays.origin[2])].join(" ")
    };
    for (face, axes) in
        [("+z", "+x +y"), ("-z", "-x +y"), ("+x", "+y +z"), ("-x", "-y +z"), ("+y", "-x +z"), ("-y", "+x +z")]
    {
        assert_eq!(of(VolumeView::Face(face.parse().unwrap())), axes, "{face}");
    }
    for (axis, axes) in [(2, "+x +y"), (1, "+x +z"), (0, "+y +z")] {
        assert_eq!(of(VolumeView::Slice { axis, voxel: 3 }), axes, "across {axis}");
    }
}
