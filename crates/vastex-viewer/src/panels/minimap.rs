//! The whole image, small, in a corner of a view that shows a part of it: which part that is, and what of the
//! image is in memory.

use egui::{
    Area, Color32, ColorImage, Context, Id, Pos2, Rect, Sense, Shape, Stroke, StrokeKind, TextureHandle,
    TextureOptions, Vec2, WidgetInfo, pos2, vec2,
};
use glam::DVec2;

use super::ImageView;
use crate::camera::Pose;
use crate::inspect::Thumbnail;

/// The longer side, in points.
const SIDE: f32 = 160.0;
const MARGIN: f32 = 8.0;
/// Seconds between two thumbnails of a view that changes.
const EVERY: f64 = 0.3;

/// A map of the whole image. The same one goes on from frame to frame.
#[derive(Default)]
pub struct Minimap {
    taken: Option<Taken>,
}

struct Taken {
    thumbnail: Thumbnail,
    texture: TextureHandle,
    /// When it was taken, and whether the view had settled then.
    time: f64,
    is_last: bool,
}

impl Minimap {
    /// How much of a width a map takes at most with its margins, in points.
    pub(super) fn corner(width: f32) -> f32 {
        // Where it would be wider than a third, none is shown.
        SIDE.min(width / 3.0) + 2.0 * MARGIN
    }

    /// The picture or what is in memory of it is another from here on.
    pub fn age(&mut self) {
        self.taken.iter_mut().for_each(|taken| taken.is_last = false);
    }

    /// Another image is shown.
    pub fn forget(&mut self) {
        self.taken = None;
    }

    /// Shows the map in the top left corner of `free`, the part of the window that no panel covers, where the
    /// view shows a part of the image and there is room. `take` makes a thumbnail of so many pixels; it is
    /// called when a map is first seen, and three times a second until the view has settled. Gives back where
    /// the camera shall be when a person clicks on the map or drags over it.
    pub fn show(
        &mut self,
        context: &Context,
        free: Rect,
        view: &ImageView,
        is_settled: bool,
        take: impl FnOnce([usize; 2]) -> Option<Thumbnail>,
    ) -> Option<Pose> {
        let Pose::Image { centre: centre_before, zoom, orientation } = view.pose else { return None };
        let seen = seen_part(view)?;
        let size = map_size(view.image);
        if free.width() < 3.0 * size.x || free.height() < 3.0 * size.y {
            return None;
        }
        self.renew(context, size, is_settled, take);
        let Taken { thumbnail, texture, .. } = self.taken.as_ref()?;
        let area = Area::new(Id::unique(("minimap", view.left))).fixed_pos(free.min + Vec2::splat(MARGIN));
        let shown = area.show(context, |ui| {
            let (rect, response) = ui.allocate_exact_size(size, Sense::click_and_drag());
            response.widget_info(|| WidgetInfo::labeled(egui::Role::Image, true, "Map of the image"));
            let painter = ui.painter_at(rect.expand(2.0));
            painter.image(texture.id(), rect, Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0)), Color32::WHITE);
            // What would not be seen as sharp as this view at once is dark.
            let scale = view.pose.magnification(view.picture, view.image).unwrap_or(1.0);
            let drawn = (-scale.log2()).ceil().clamp(0.0, 31.0) as u8;
            let [columns, rows] = thumbnail.cells;
            let cell = rect.size() / vec2(columns.max(1) as f32, rows.max(1) as f32);
            for (n, _) in thumbnail.levels.iter().enumerate().filter(|(_, level)| **level > drawn) {
                let at = vec2((n % columns) as f32, (n / columns) as f32) * cell;
                let part = Rect::from_min_size(rect.min + at, cell);
                painter.rect_filled(part, 0.0, Color32::from_black_alpha(110));
            }
            painter.rect_stroke(rect, 0.0, Stroke::new(1.0, Color32::from_gray(120)), StrokeKind::Outside);
            let corner = |share: DVec2| rect.min + vec2(share.x as f32, share.y as f32) * rect.size();
            let mut frame: Vec<Pos2> = seen.into_iter().map(corner).collect();
            // However small the part is, its frame is seen.
            let bounds = Rect::from_points(&frame);
            if bounds.size().max_elem() < 5.0 {
                let least = Rect::from_center_size(bounds.center(), Vec2::splat(5.0));
                frame = vec![least.left_top(), least.right_top(), least.right_bottom(), least.left_bottom()];
            }
            for (width, color) in [(3.0, Color32::BLACK), (1.5, Color32::from_rgb(255, 210, 60))] {
                painter.add(Shape::closed_line(frame.clone(), Stroke::new(width, color)));
            }
            let pointer =
                response.interact_pointer_pos().filter(|_| response.clicked() || response.dragged())?;
            let share = (pointer - rect.min) / rect.size();
            let centre = DVec2::new(share.x.into(), share.y.into()).clamp(DVec2::ZERO, DVec2::ONE);
            // A pointer that is held changes nothing: the view settles below it.
            (centre != centre_before).then_some(Pose::Image { centre, zoom, orientation })
        });
        shown.inner
    }

    fn renew(
        &mut self,
        context: &Context,
        size: Vec2,
        is_settled: bool,
        take: impl FnOnce([usize; 2]) -> Option<Thumbnail>,
    ) {
        let now = context.input(|input| input.time);
        let is_due = self.taken.as_ref().is_none_or(|taken| match is_settled {
            true => !taken.is_last,
            false => now - taken.time >= EVERY,
        });
        if is_due {
            let [width, height] = [size.x, size.y].map(|side| side.round().max(1.0) as usize);
            let Some(thumbnail) = take([width, height]) else { return };
            let pixels = thumbnail.pixels.iter().map(|[r, g, b, _]| Color32::from_rgb(*r, *g, *b)).collect();
            let image = ColorImage::new(thumbnail.size, pixels);
            let texture = match self.taken.take() {
                Some(Taken { mut texture, .. }) => {
                    texture.set(image, TextureOptions::LINEAR);
                    texture
                }
                None => context.load_texture("minimap", image, TextureOptions::LINEAR),
            };
            self.taken = Some(Taken { thumbnail, texture, time: now, is_last: is_settled });
        }
        if !is_settled {
            context.request_repaint_after(std::time::Duration::from_secs_f64(EVERY));
        }
    }
}

/// The corners of the part of the picture in which the image is seen, in shares of the image, clockwise as
/// they are seen; `None` if all of the image is in view, or none of it.
fn seen_part(view: &ImageView) -> Option<[DVec2; 4]> {
    let placed = view.pose.placement(view.picture, view.image)?;
    let size = |sides: [u32; 2]| DVec2::from(sides.map(|side| f64::from(side.max(1))));
    let (picture, image) = (size(view.picture), size(view.image));
    let corners = [DVec2::ZERO, DVec2::new(image.x, 0.0), image, DVec2::new(0.0, image.y)];
    let corners = corners.map(|texel| placed.pixel(texel));
    let low = corners.into_iter().fold(corners[0], DVec2::min).max(DVec2::ZERO);
    let high = corners.into_iter().fold(corners[0], DVec2::max).min(picture);
    let is_seen = |pixel: DVec2| pixel.min_element() >= -1e-6 && (picture - pixel).min_element() >= -1e-6;
    let is_whole = corners.into_iter().all(is_seen);
    (!is_whole && low.cmplt(high).all()).then(|| placed.corners(low, high).map(|texel| texel / image))
}

/// The size of a map of an image, in points: in its shape, but of one that is much longer than wide no line.
fn map_size([width, height]: [u32; 2]) -> Vec2 {
    let sides = vec2(width.max(1) as f32, height.max(1) as f32);
    (sides * (SIDE / sides.max_elem())).max(Vec2::splat(SIDE / 16.0))
}

#[cfg(test)]
mod tests {
    use egui_kittest::Harness;
    use egui_kittest::kittest::Queryable;

    use super::*;
    use crate::Scene;
    use crate::camera::Orientation;

    fn view(centre: [f64; 2], zoom: f64) -> ImageView {
        let pose = Pose::image(centre.into(), zoom);
        ImageView { pose, picture: [800, 400], image: [4000, 2000], left: 0 }
    }

    #[test]
    fn the_part_in_view_is_that_of_the_pose() {
        assert_eq!(seen_part(&view([0.5, 0.5], 1.0)), None, "all of it");
        assert_eq!(
            seen_part(&view([0.5, 0.25], 4.0)),
            Some([[0.375, 0.125], [0.625, 0.125], [0.625, 0.375], [0.375, 0.375]].map(DVec2::from))
        );
        let at_edge = [[0.0, 0.75], [0.25, 0.75], [0.25, 1.0], [0.0, 1.0]].map(DVec2::from);
        assert_eq!(seen_part(&view([0.0, 1.0], 2.0)), Some(at_edge));
        // Turned by a quarter clockwise, what is at its top right is seen first at the bottom right.
        let turned = view([0.5, 0.25], 4.0).pose.with_orientation(Orientation::new(90.0, false), 2.0, 2.0);
        let part = seen_part(&ImageView { pose: turned, ..view([0.5, 0.25], 4.0) }).unwrap();
        let expected = [[0.4375, 0.5], [0.4375, 0.0], [0.5625, 0.0], [0.5625, 0.5]].map(DVec2::from);
        let apart = part.iter().zip(expected).map(|(found, expected)| (*found - expected).length());
        assert!(apart.fold(0.0, f64::max) < 1e-9, "{part:?}");
        assert_eq!(seen_part(&ImageView { pose: Pose::first(Scene::Globe), ..view([0.5, 0.5], 1.0) }), None);
        assert_eq!(map_size([4000, 2000]), vec2(160.0, 80.0));
        assert_eq!(map_size([1, 1 << 31]), vec2(10.0, 160.0));
    }

    #[test]
    fn a_pointer_that_is_held_on_the_map_asks_once() {
        let state = (Minimap::default(), view([0.1, 0.1], 8.0), 0);
        let mut harness = Harness::builder().with_size([800.0, 400.0]).build_ui_state(
            |ui, (map, view, asked): &mut (Minimap, ImageView, u32)| {
                let free = ui.available_rect_before_wrap();
                let take = |size: [usize; 2]| {
                    let pixels = vec![[9, 9, 9, 255]; size[0] * size[1]];
                    Some(Thumbnail { size, pixels, cells: [1, 1], levels: vec![0] })
                };
                if let Some(pose) = map.show(ui.ctx(), free, view, true, take) {
                    view.pose = pose;
                    *asked += 1;
                }
            },
            state,
        );
        harness.run();
        let middle = harness.get_by_label("Map of the image").rect().center();
        harness.drag_at(middle);
        harness.run();
        harness.hover_at(middle + vec2(20.0, 10.0));
        (0..20).for_each(|_| harness.step());
        assert_eq!(harness.state().2, 1);
        harness.hover_at(middle + vec2(21.0, 10.0));
        (0..20).for_each(|_| harness.step());
        assert_eq!(harness.state().2, 2);
    }

    #[test]
    fn a_click_on_the_map_goes_there_and_a_settled_view_takes_no_more_of_them() {
        let state = (Minimap::default(), view([0.1, 0.1], 8.0), None, 0);
        let mut harness = Harness::builder().with_size([800.0, 400.0]).build_ui_state(
            |ui, (map, view, went, takes): &mut (Minimap, ImageView, Option<Pose>, u32)| {
                let free = ui.available_rect_before_wrap();
                let asked = map.show(ui.ctx(), free, view, true, |size| {
                    *takes += 1;
                    let pixels = vec![[9, 9, 9, 255]; size[0] * size[1]];
                    Some(Thumbnail { size, pixels, cells: [2, 1], levels: vec![0, 5] })
                });
                if let Some(pose) = asked {
                    (view.pose, *went) = (pose, Some(pose));
                }
            },
            state,
        );
        harness.run();
        harness.get_by_label("Map of the image").click();
        harness.run();
        let (map, _, went, takes) = harness.state_mut();
        let Some(Pose::Image { centre, zoom, .. }) = *went else { panic!("it goes nowhere") };
        assert!((centre - 0.5).length() < 0.02 && zoom == 8.0, "{centre} {zoom}");
        assert_eq!(*takes, 1);
        map.age();
        harness.run();
        assert_eq!(harness.state().3, 2);
        // Of what is seen as a whole there is no map.
        harness.state_mut().1 = view([0.5, 0.5], 1.0);
        harness.run();
        assert!(harness.query_by_label("Map of the image").is_none());
    }
}
