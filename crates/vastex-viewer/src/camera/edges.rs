//! Steps over an image by what is seen of it: to its edges, and on by a whole view.

use glam::DVec2;

use super::controller::Aspects;
use super::pose::Pose;

/// What is seen of an image, in its widths, with axes as they are seen: to the right and downwards.
struct Seen {
    /// The middle of the view, from the middle of the image.
    middle: DVec2,
    /// Half the width and the height of the view.
    half_view: DVec2,
    /// How far the middle of a view may be from that of the image, so that nothing beyond the image is seen;
    /// 0 where all of the image has room.
    farthest: DVec2,
}

impl Pose {
    /// An image with its edge on a side of it at that side of the view, where `side` points to the right and
    /// downwards as they are seen; in its middle where all of it has room. One that is turned by no quarter
    /// counts as the upright rectangle around it. Other poses stay as they are.
    pub(super) fn at_edge(self, side: DVec2, aspects: Aspects) -> Pose {
        let Some(seen) = self.seen(aspects) else { return self };
        let at_edge = side.signum() * seen.farthest;
        self.looking_at(DVec2::select(side.cmpne(DVec2::ZERO), at_edge, seen.middle), aspects)
    }

    /// An image a view further to a side, but with nothing beyond its edge in view that was not before. Other
    /// poses stay as they are.
    pub(super) fn a_view_on(self, side: DVec2, aspects: Aspects) -> Pose {
        let Some(Seen { middle, half_view, farthest }) = self.seen(aspects) else { return self };
        let step = side * 2.0 * half_view;
        // Where more than that is in view it stays so.
        let (least, most) = ((-farthest).min(middle), farthest.max(middle));
        self.looking_at((middle + step).clamp(least, most), aspects)
    }

    fn seen(self, [view, image]: Aspects) -> Option<Seen> {
        let Pose::Image { centre, orientation, .. } = self else { return None };
        let size = DVec2::new(1.0, 1.0 / image);
        let height = self.view_height(view, image);
        let half_view = DVec2::new(height * view, height) / 2.0;
        let farthest = (orientation.extent(size) / 2.0 - half_view).max(DVec2::ZERO);
        let middle = orientation.seen_from_image() * ((centre - 0.5) * size);
        Some(Seen { middle, half_view, farthest })
    }

    /// This pose with another middle, as [`Seen`] has it.
    fn looking_at(self, middle: DVec2, [_, image]: Aspects) -> Pose {
        let Pose::Image { orientation, .. } = self else { return self };
        let size = DVec2::new(1.0, 1.0 / image);
        self.at(0.5 + orientation.image_from_seen() * middle / size)
    }
}

#[cfg(test)]
mod tests {
    use super::super::orientation::Orientation;
    use super::*;

    const VIEW: f64 = 1.5;
    const IMAGE: f64 = 2.0;
    const ASPECTS: Aspects = [VIEW, IMAGE];

    fn centre(pose: Pose) -> DVec2 {
        let Pose::Image { centre, .. } = pose else { panic!("{pose:?}") };
        centre
    }

    /// At a zoom of 4 the view has a quarter of the width, and by its shape a third of the height.
    #[test]
    fn an_image_goes_to_its_edges_and_stays_within_them() {
        let pose = Pose::image(DVec2::splat(0.5), 4.0);
        let half = DVec2::new(1.0 / 8.0, 1.0 / 6.0);
        let is_at = |pose: Pose, expected: DVec2| {
            assert!(centre(pose).distance(expected) < 1e-12, "{pose:?}, not at {expected}");
        };
        is_at(pose.at_edge(DVec2::NEG_X, ASPECTS), DVec2::new(half.x, 0.5));
        is_at(pose.at_edge(DVec2::X, ASPECTS), DVec2::new(1.0 - half.x, 0.5));
        is_at(pose.at_edge(DVec2::NEG_Y, ASPECTS), DVec2::new(0.5, half.y));
        let corner = pose.at_edge(DVec2::Y, ASPECTS).at_edge(DVec2::X, ASPECTS);
        is_at(corner, DVec2::ONE - half);
        is_at(corner.at_edge(DVec2::X, ASPECTS), DVec2::ONE - half);
        // On by views: 0.5, 0.75, and then what is left.
        let on = pose.a_view_on(DVec2::X, ASPECTS);
        is_at(on, DVec2::new(0.75, 0.5));
        is_at(on.a_view_on(DVec2::X, ASPECTS), DVec2::new(1.0 - half.x, 0.5));
        is_at(pose.a_view_on(DVec2::NEG_Y, ASPECTS), DVec2::new(0.5, half.y));
        // Beyond the edge already it neither goes further nor comes back.
        let beyond = Pose::image(DVec2::new(0.99, 0.5), 4.0);
        is_at(beyond.a_view_on(DVec2::X, ASPECTS), DVec2::new(0.99, 0.5));
        is_at(beyond.a_view_on(DVec2::NEG_X, ASPECTS), DVec2::new(0.74, 0.5));
    }

    #[test]
    fn sides_are_those_that_are_seen() {
        for (orientation, to_the_right) in [
            (Orientation::UPRIGHT.mirrored(), DVec2::NEG_X),
            (Orientation::new(180.0, false), DVec2::NEG_X),
            // What is seen at the right of an image that is turned clockwise by a quarter is its top.
            (Orientation::new(90.0, false), DVec2::NEG_Y),
        ] {
            let pose = Pose::Image { centre: DVec2::splat(0.5), zoom: 6.0, orientation };
            for moved in [pose.at_edge(DVec2::X, ASPECTS), pose.a_view_on(DVec2::X, ASPECTS)] {
                let step = (centre(moved) - 0.5).normalize();
                assert!(step.distance(to_the_right) < 1e-9, "{orientation:?}: {step}");
            }
        }
    }

    #[test]
    fn what_has_room_goes_to_its_middle_and_other_scenes_stay() {
        let small = Pose::image(DVec2::new(0.2, 0.9), 0.5);
        assert!(centre(small.at_edge(DVec2::X, ASPECTS)).distance(DVec2::new(0.5, 0.9)) < 1e-12);
        assert!(centre(small.a_view_on(DVec2::Y, ASPECTS)).distance(DVec2::new(0.2, 0.9)) < 1e-12);
        let globe = Pose::globe(0.1, 0.2, 1.0);
        assert_eq!(globe.at_edge(DVec2::X, ASPECTS), globe);
        assert_eq!(globe.a_view_on(DVec2::X, ASPECTS), globe);
    }
}
