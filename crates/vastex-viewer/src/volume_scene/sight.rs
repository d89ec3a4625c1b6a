//! Where the pictures of a volume lie beside each other, and which place of the volume each pixel shows.

use glam::{DVec2, DVec3};

use super::look::{VolumeLayout, VolumeLook, VolumePane};
use crate::volume::{VolumeBox, VolumeCamera, VolumePlane, VolumeView};

/// Pixels between pictures.
const GAP: u32 = 2;
/// How much larger a picture is than the slice that fits it.
const ROOM: f64 = 1.06;

/// Where a picture lies in the area of all of them, in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PaneRect {
    /// Which picture it is.
    pub pane: VolumePane,
    /// The picture's upper left corner.
    pub at: [u32; 2],
    /// The picture's width and height, at least 1.
    pub size: [u32; 2],
}

impl PaneRect {
    /// Returns true if a pixel of the area lies in the picture.
    pub fn contains(&self, pixel: DVec2) -> bool {
        let within = pixel - DVec2::from_array(self.at.map(f64::from));
        let size = DVec2::from_array(self.size.map(f64::from));
        within.cmpge(DVec2::ZERO).all() && within.cmplt(size).all()
    }

    /// A pixel of the area as one of the picture.
    pub fn within(&self, pixel: DVec2) -> DVec2 {
        pixel - DVec2::from_array(self.at.map(f64::from))
    }
}

/// Where the pictures lie in an area of so many pixels.
pub fn pane_rects(layout: VolumeLayout, area: [u32; 2]) -> Vec<PaneRect> {
    let area = area.map(|side| side.max(1));
    match layout {
        VolumeLayout::One(pane) => vec![PaneRect { pane, at: [0, 0], size: area }],
        VolumeLayout::Four => {
            let first = area.map(|side| (side.saturating_sub(GAP) / 2).max(1));
            let second = [0, 1].map(|axis| (first[axis] + GAP).min(area[axis] - 1));
            let rest = [0, 1].map(|axis| (area[axis] - second[axis]).max(1));
            let place = |nth: usize| {
                let (right, down) = (nth % 2 == 1, nth / 2 == 1);
                let part = |axis: usize, is_second: bool| match is_second {
                    true => (second[axis], rest[axis]),
                    false => (0, first[axis]),
                };
                let ((x, width), (y, height)) = (part(0, right), part(1, down));
                ([x, y], [width, height])
            };
            let rect = |(nth, pane): (usize, &VolumePane)| {
                let (at, size) = place(nth);
                PaneRect { pane: *pane, at, size }
            };
            VolumePane::ALL.iter().enumerate().map(rect).collect()
        }
    }
}

/// What a picture sees: which place a pixel shows, and which pixel shows a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PaneSight {
    /// Width and height of the picture in pixels.
    pub size: [u32; 2],
    seen: Seen,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Seen {
    Plane(VolumePlane),
    Space(VolumeCamera),
}

impl PaneSight {
    /// Of one of several pictures, which have one scale.
    pub fn of(look: &VolumeLook, of: &VolumeBox, panes: &[PaneRect], pane: &PaneRect) -> PaneSight {
        let Some(axis) = pane.pane.axis() else {
            return PaneSight { size: pane.size, seen: Seen::Space(look.orbit.camera(of, pane.size)) };
        };
        let ([ahead, right, down], through) = (look.slice_axes(pane.pane), look.met_by(pane.pane, of));
        // What is in the middle of all slices, as it lies before or behind this one.
        let mut middle = look.centre - ahead * (look.centre - through).dot(ahead);
        if look.tilt(pane.pane).is_upright() {
            middle[axis] = through[axis];
        }
        let pixel = fitting_pixel(of, panes) / look.zoom;
        let plane = VolumePlane { middle, right, down, pixel };
        PaneSight { size: pane.size, seen: Seen::Plane(plane) }
    }

    /// What is drawn in a picture that is so many times smaller along each side.
    pub fn view(&self, smaller: u32) -> VolumeView {
        match self.seen {
            Seen::Plane(plane) => {
                // Where sides are no multiples, a little more is seen, not something else.
                let size = self.smaller(smaller);
                let pixel = plane.pixel * f64::from(self.size[0]) / f64::from(size[0]);
                VolumeView::Plane(VolumePlane { pixel, ..plane })
            }
            Seen::Space(camera) => VolumeView::Around(camera),
        }
    }

    /// The size of such a picture.
    pub fn smaller(&self, times: u32) -> [u32; 2] {
        self.size.map(|side| side.div_ceil(times.max(1)).max(1))
    }

    /// The pixel that shows a place; `None` behind the camera. Places beside a slice are seen as if they were
    /// on it.
    pub fn pixel_of(&self, place: DVec3) -> Option<DVec2> {
        let middle = DVec2::from_array(self.size.map(f64::from)) / 2.0;
        match self.seen {
            Seen::Plane(plane) => {
                let from = place - plane.middle;
                Some(middle + DVec2::new(from.dot(plane.right), from.dot(plane.down)) / plane.pixel)
            }
            Seen::Space(camera) => {
                let [ahead, right, down] = axes_of(&camera);
                let from = place - camera.eye;
                let depth = from.dot(ahead);
                let pixel = self.pixel_at_unit(&camera);
                let near = depth > 1e-9 * (camera.target - camera.eye).length();
                near.then(|| middle + DVec2::new(from.dot(right), from.dot(down)) / (depth * pixel))
            }
        }
    }

    /// Where the ray through a pixel begins, and which way it goes, of unit length: in a slice it begins at
    /// the place that is seen.
    pub fn ray(&self, pixel: DVec2) -> [DVec3; 2] {
        let from_middle = pixel - DVec2::from_array(self.size.map(f64::from)) / 2.0;
        match self.seen {
            Seen::Plane(plane) => {
                let at = from_middle * plane.pixel;
                let place = plane.middle + plane.right * at.x + plane.down * at.y;
                [place, plane.right.cross(plane.down)]
            }
            Seen::Space(camera) => {
                let [ahead, right, down] = axes_of(&camera);
                let at = from_middle * self.pixel_at_unit(&camera);
                [camera.eye, (ahead + right * at.x + down * at.y).normalize()]
            }
        }
    }

    /// The ways to the right and downward in the picture, of unit length.
    pub fn across(&self) -> [DVec3; 2] {
        match self.seen {
            Seen::Plane(plane) => [plane.right, plane.down],
            Seen::Space(camera) => {
                let [_, right, down] = axes_of(&camera);
                [right, down]
            }
        }
    }

    /// The side of a pixel in the world: of a slice anywhere, else at the middle of what is looked at.
    pub fn pixel(&self) -> f64 {
        match self.seen {
            Seen::Plane(plane) => plane.pixel,
            Seen::Space(camera) => self.pixel_at_unit(&camera) * (camera.target - camera.eye).length(),
        }
    }

    /// Which way one looks from the place where a point of the world is.
    pub fn toward(&self, place: DVec3) -> DVec3 {
        match self.seen {
            Seen::Plane(plane) => plane.right.cross(plane.down),
            Seen::Space(camera) => place - camera.eye,
        }
    }

    fn pixel_at_unit(&self, camera: &VolumeCamera) -> f64 {
        2.0 * camera.half_height.tan() / f64::from(self.size[1].max(1))
    }
}

/// The side of a pixel with which all slices fit into their pictures.
fn fitting_pixel(of: &VolumeBox, panes: &[PaneRect]) -> f64 {
    let extent = of.extent();
    let of_pane = |pane: &PaneRect| {
        pane.pane.axis()?;
        let [right, down] = pane.pane.axes();
        let [width, height] = pane.size.map(f64::from);
        Some((extent[right] / width).max(extent[down] / height))
    };
    panes.iter().filter_map(of_pane).fold(0.0, f64::max).max(f64::MIN_POSITIVE) * ROOM
}

fn axes_of(camera: &VolumeCamera) -> [DVec3; 3] {
    let ahead = (camera.target - camera.eye).normalize_or(DVec3::Z);
    let right = camera.down.cross(ahead).normalize_or(ahead.any_orthonormal_vector());
    [ahead, right, ahead.cross(right)]
}

#[cfg(test)]
mod tests {
    use super::super::look::tests::facts;
    use super::*;

    #[test]
    fn four_pictures_fill_the_area_without_meeting() {
        let panes = pane_rects(VolumeLayout::Four, [801, 602]);
        let covered: u32 = panes.iter().map(|pane| pane.size[0] * pane.size[1]).sum();
        assert_eq!(covered, (801 - 2) * (602 - 2));
        for pane in &panes {
            let corner = DVec2::from_array(pane.at.map(f64::from));
            let seen = panes.iter().filter(|other| other.contains(corner)).count();
            assert_eq!(seen, 1);
        }
        for area in [[0, 0], [1, 1], [2, 3]] {
            let panes = pane_rects(VolumeLayout::Four, area);
            assert!(panes.iter().all(|pane| pane.size.iter().all(|side| *side > 0)), "{area:?}");
        }
    }

    #[test]
    fn pixels_show_places_and_places_are_in_pixels() {
        let facts = facts();
        let mut look = VolumeLook::first(&facts);
        (look.zoom, look.centre) = (2.0, DVec3::new(3.0, 4.0, 5.0));
        look.tilt_by(VolumePane::Y, 25.0, -50.0);
        look.put_cross(&facts.of, DVec3::new(3.1, 4.2, 6.3));
        let panes = pane_rects(VolumeLayout::Four, [640, 480]);
        for pane in &panes {
            let sight = PaneSight::of(&look, &facts.of, &panes, pane);
            for pixel in [DVec2::new(0.0, 0.0), DVec2::new(100.5, 37.25)] {
                let [from, toward] = sight.ray(pixel);
                for way in [0.0, 12.0] {
                    let place = from + toward * if pane.pane == VolumePane::Space { way + 1.0 } else { way };
                    let back = sight.pixel_of(place).unwrap();
                    assert!((back - pixel).length() < 1e-6, "{pane:?}: {pixel} came back as {back}");
                }
            }
            // What is drawn is what the pointer is told.
            let rays = sight.view(1).rays(&facts.of, sight.size);
            let at = |of: &[DVec3; 3]| of[0] + of[1] * 100.5 + of[2] * 37.25;
            let [from, toward] = sight.ray(DVec2::new(100.5, 37.25));
            assert!((at(&rays.origin) - from).length() < 1e-9, "{pane:?}");
            assert!((at(&rays.toward).normalize() - toward).length() < 1e-9, "{pane:?}");
            // A tilted slice goes through the place at which slices meet, others through its voxel.
            if pane.pane.axis().is_some() {
                let away = (look.met_by(pane.pane, &facts.of) - from).dot(toward);
                assert!(away.abs() < 1e-9, "{pane:?}: {away}");
            }
        }
    }

    #[test]
    fn all_slices_have_one_scale_in_which_all_of_them_fit() {
        let facts = facts();
        let look = VolumeLook::first(&facts);
        let panes = pane_rects(VolumeLayout::Four, [640, 480]);
        let slices = panes.iter().filter(|pane| pane.pane.axis().is_some());
        let pixels: Vec<f64> =
            slices.clone().map(|pane| PaneSight::of(&look, &facts.of, &panes, pane).pixel()).collect();
        assert!(pixels.iter().all(|pixel| *pixel == pixels[0]), "{pixels:?}");
        for pane in slices {
            let sight = PaneSight::of(&look, &facts.of, &panes, pane);
            for corner in [DVec3::ZERO, facts.of.extent()] {
                let pixel = sight.pixel_of(corner).unwrap();
                let size = DVec2::from_array(pane.size.map(f64::from));
                assert!(pixel.cmpge(DVec2::ZERO).all() && pixel.cmple(size).all(), "{pane:?} {pixel}");
            }
        }
    }
}
