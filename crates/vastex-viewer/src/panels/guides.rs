//! Guides over the picture of an image: lines between its texels and their values where they are large, and
//! how long a texel is.

use egui::{Align2, Color32, FontId, Painter, Pos2, Rect, Stroke, Vec2, pos2, vec2};
use glam::DVec2;

use super::lengths::TexelSize;
use crate::camera::{ImagePlacement, Pose};
use crate::figures::round_down;
use crate::inspect::InspectedTexel;

/// Physical pixels of a texel from which on texels are told apart by lines.
const LEAST_OF_GRID: f64 = 16.0;
/// Sides of a texel in points from which on its values are written into it, a line for each.
const LEAST_OF_VALUES: [f32; 2] = [44.0, 13.0];
/// The longest scale bar, in points, and the share of it over which lengths are measured: on a globe much
/// less than from one side of it to the other.
const LONGEST_BAR: f64 = 160.0;
const SHARE_OF_BAR: f64 = 1.0 / 64.0;
const VALUE_FONT: f32 = 11.0;
const MARGIN: f32 = 12.0;

/// An image as it lies in a picture.
#[derive(Clone, Copy, Debug)]
pub struct ImageView {
    /// Where the camera is. No other pose than that of an image has guides.
    pub pose: Pose,
    /// Width and height of the picture in physical pixels.
    pub picture: [u32; 2],
    /// Columns and rows of the image.
    pub image: [u32; 2],
    /// Physical pixels of the window to the left of the picture, which may be one of several panes.
    pub left: u32,
}

impl ImageView {
    /// How the image lies in the pixels of the window; `None` in scenes that have no guides.
    pub(super) fn placement(&self) -> Option<ImagePlacement> {
        let placed = self.pose.placement(self.picture, self.image)?;
        Some(placed.within(DVec2::new(self.left.into(), 0.0)))
    }
}

/// Paints the guides of an image within `free`, the part of the picture that no panel covers. The scale bar
/// is a length in the world where `texel_size` says how large texels are there, else so many texels.
///
/// `value` answers what is stored below a physical pixel of the picture. It is asked once for each texel in
/// view, and only where texels are at least 44 points wide: at most some thousand times.
pub fn paint_guides(
    painter: &Painter,
    free: Rect,
    view: &ImageView,
    texel_size: Option<&TexelSize>,
    mut value: impl FnMut(DVec2) -> Option<InspectedTexel>,
) {
    let Some(placed) = Placed::new(view, painter.pixels_per_point()) else { return };
    let painter = painter.with_clip_rect(free);
    let seen = placed.seen(free);
    if placed.image_placement.scale >= LEAST_OF_GRID {
        paint_grid(&painter, &placed, seen);
    }
    if placed.side() >= LEAST_OF_VALUES[0] {
        for (row, column) in
            (seen[1][0]..seen[1][1]).flat_map(|row| (seen[0][0]..seen[0][1]).map(move |column| (row, column)))
        {
            let middle = DVec2::new(f64::from(column) + 0.5, f64::from(row) + 0.5);
            // Of an image that is turned, corners of the bounds are not seen.
            if !free.expand(placed.side()).contains(placed.point(middle)) {
                continue;
            }
            if let Some(texel) = value(placed.pixel(middle) - placed.corner()) {
                paint_values(&painter, placed.point(middle), placed.side(), &texel);
            }
        }
    }
    paint_scale_bar(&painter, free, &placed, texel_size);
}

/// Where the texels of an image lie.
struct Placed {
    /// In physical pixels.
    image_placement: ImagePlacement,
    picture: [u32; 2],
    image: [u32; 2],
    /// Of the picture in the window, in physical pixels.
    left: u32,
    pixels_per_point: f64,
}

impl Placed {
    fn new(view: &ImageView, pixels_per_point: f32) -> Option<Placed> {
        let image_placement = view.placement()?;
        let ImageView { picture, image, left, .. } = *view;
        Some(Placed { image_placement, picture, image, left, pixels_per_point: pixels_per_point.into() })
    }

    /// The first corner of the picture in the window, in physical pixels.
    fn corner(&self) -> DVec2 {
        DVec2::new(self.left.into(), 0.0)
    }

    /// Side of a texel in points.
    fn side(&self) -> f32 {
        (self.image_placement.scale / self.pixels_per_point) as f32
    }

    /// The physical pixel of a place of the image, in texels.
    fn pixel(&self, texels: DVec2) -> DVec2 {
        self.image_placement.pixel(texels)
    }

    /// The place of the image in the middle of a part of the window, or its nearest.
    fn middle(&self, part: Rect) -> DVec2 {
        let (corner, picture) = (self.corner(), DVec2::from(self.picture.map(f64::from)));
        let Pos2 { x, y } = part.center();
        let pixel = (DVec2::new(x.into(), y.into()) * self.pixels_per_point).clamp(corner, corner + picture);
        self.image_placement.texel(pixel).clamp(DVec2::ZERO, DVec2::from(self.image.map(f64::from)))
    }

    fn point(&self, texels: DVec2) -> Pos2 {
        let DVec2 { x, y } = self.pixel(texels) / self.pixels_per_point;
        pos2(x as f32, y as f32)
    }

    /// The columns and the rows of the image that are in a part of the window: the first one, and one past
    /// the last.
    fn seen(&self, part: Rect) -> [[u32; 2]; 2] {
        let (corner, picture) = (self.corner(), DVec2::from(self.picture.map(f64::from)));
        let pixel = |point: Pos2| {
            let pixel = DVec2::new(point.x.into(), point.y.into()) * self.pixels_per_point;
            pixel.clamp(corner, corner + picture)
        };
        let [low, high] = self.image_placement.bounds(pixel(part.min), pixel(part.max));
        [0, 1].map(|axis| {
            let within = |texel: f64| texel.clamp(0.0, self.image[axis].into()) as u32;
            [within(low[axis].floor()), within(high[axis].ceil())]
        })
    }
}

fn paint_grid(painter: &Painter, placed: &Placed, seen: [[u32; 2]; 2]) {
    // Dark beside light: one of the two is seen on every colour.
    let pixel = (1.0 / placed.pixels_per_point) as f32;
    let strokes = [
        (0.5, Stroke::new(pixel, Color32::from_black_alpha(70))),
        (-0.5, Stroke::new(pixel, Color32::from_white_alpha(50))),
    ];
    let [[left, right], [top, bottom]] = seen.map(|ends| ends.map(f64::from));
    let line = |from: DVec2, to: DVec2| {
        let along = placed.point(to) - placed.point(from);
        let across = along.rot90().normalized();
        for (side, stroke) in strokes {
            let shift = side * pixel * across;
            painter.line_segment([placed.point(from) + shift, placed.point(to) + shift], stroke);
        }
    };
    for column in seen[0][0]..=seen[0][1] {
        line(DVec2::new(column.into(), top), DVec2::new(column.into(), bottom));
    }
    for row in seen[1][0]..=seen[1][1] {
        line(DVec2::new(left, row.into()), DVec2::new(right, row.into()));
    }
}

/// Writes what is stored of a texel into it, a channel in a line, where there is room; of another level than
/// 0 nothing is written, for its values are not the texel's.
fn paint_values(painter: &Painter, middle: Pos2, side: f32, texel: &InspectedTexel) {
    let lines = texel.lines();
    if texel.level > 0 || side < LEAST_OF_VALUES[1] * lines.len() as f32 + 2.0 {
        return;
    }
    let font = FontId::monospace(VALUE_FONT);
    let text = lines.join("\n");
    let galley = painter.layout_no_wrap(text, font, Color32::PLACEHOLDER);
    if galley.size().x + 4.0 > side {
        return;
    }
    let place = Align2::CENTER_CENTER.anchor_size(middle, galley.size()).min;
    painter.galley(place + Vec2::splat(1.0), galley.clone(), Color32::BLACK);
    painter.galley(place, galley, Color32::WHITE);
}

/// How long a level bar is: in the world where the size of a texel is known, else in texels; and how many
/// times all is magnified.
fn paint_scale_bar(painter: &Painter, free: Rect, placed: &Placed, texel_size: Option<&TexelSize>) {
    let texels_a_point = placed.pixels_per_point / placed.image_placement.scale;
    // Texels need not be as high as they are wide.
    let step = placed.image_placement.step_to_the_right() * texels_a_point;
    let bar = match texel_size {
        Some(size) => {
            // As in the middle of what is seen of the image: on a globe a texel is not the same everywhere.
            let middle = placed.middle(free);
            let some = step * SHARE_OF_BAR * LONGEST_BAR;
            let longest = size.between(middle - some / 2.0, middle + some / 2.0) / SHARE_OF_BAR;
            size.round(longest).map(|(length, text)| (LONGEST_BAR * length / longest, text))
        }
        None => {
            let texels = round_down(LONGEST_BAR * texels_a_point).filter(|(texels, _)| *texels >= 1.0);
            texels.map(|(texels, _)| {
                let unit = if texels == 1.0 { "texel" } else { "texels" };
                (texels / texels_a_point, format!("{texels} {unit}"))
            })
        }
    };
    let Some((length, mut text)) = bar else { return };
    let length = length as f32;
    let magnified = texel_size.and_then(|size| size.magnified(placed.image_placement.scale));
    if let Some(magnified) = magnified {
        text += &format!("   {magnified}");
    }
    // No room for it beside anything else.
    if free.width() < length + 2.0 * MARGIN || free.height() < 80.0 {
        return;
    }
    let end = free.max - Vec2::splat(MARGIN);
    let start = end - vec2(length, 0.0);
    for (width, color) in [(4.0, Color32::BLACK), (2.0, Color32::WHITE)] {
        let grown = (width - 2.0) / 2.0;
        let stroke = Stroke::new(width, color);
        painter.line_segment([start - vec2(grown, 0.0), end + vec2(grown, 0.0)], stroke);
        for tick in [start, end] {
            painter.line_segment([tick - vec2(0.0, 5.0 + grown), tick + vec2(0.0, grown)], stroke);
        }
    }
    let place = (start + end.to_vec2()).to_vec2() / 2.0 - vec2(0.0, 6.0);
    let font = FontId::proportional(12.0);
    for (shift, color) in [(1.0, Color32::BLACK), (0.0, Color32::WHITE)] {
        let place = place.to_pos2() + Vec2::splat(shift);
        painter.text(place, Align2::CENTER_BOTTOM, &text, font.clone(), color);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Orientation;

    #[test]
    fn texels_lie_where_the_camera_shows_them() {
        // 20 pixels a texel, the middle of the view on the corner between the texels (9, 4) and (10, 5).
        let pose = Pose::image(DVec2::new(0.1, 0.1), 20.0);
        let view = ImageView { pose, picture: [100, 60], image: [100, 50], left: 0 };
        let placed = Placed::new(&view, 2.0).unwrap();
        assert_eq!(placed.image_placement.scale, 20.0);
        assert_eq!(placed.point(DVec2::new(10.0, 5.0)), pos2(25.0, 15.0));
        assert_eq!(placed.pixel(DVec2::new(9.5, 5.5)), DVec2::new(40.0, 40.0));
        let seen = placed.seen(Rect::from_min_max(pos2(0.0, 0.0), pos2(50.0, 30.0)));
        assert_eq!(seen, [[7, 13], [3, 7]]);
        // The same in the second of two panes.
        let second = Placed::new(&ImageView { left: 100, ..view }, 2.0).unwrap();
        assert_eq!(second.point(DVec2::new(10.0, 5.0)), pos2(75.0, 15.0));
        assert_eq!(second.seen(Rect::from_min_max(pos2(50.0, 0.0), pos2(100.0, 30.0))), seen);
        assert_eq!(second.seen(Rect::EVERYTHING), seen, "what another pane shows is not its own");
        // No more than there is of the image.
        let placed = Placed::new(&ImageView { pose: Pose::first(crate::Scene::Image), ..view }, 1.0).unwrap();
        assert_eq!(placed.seen(Rect::EVERYTHING), [[0, 100], [0, 50]]);
        // Turned by a quarter, columns of the picture are rows of the image: 60 pixels of it are 3 columns,
        // 100 are 5 rows.
        let turned = view.pose.with_orientation(Orientation::new(90.0, false), 100.0 / 60.0, 2.0);
        let placed = Placed::new(&ImageView { pose: turned, ..view }, 2.0).unwrap();
        assert!((placed.image_placement.scale - 20.0).abs() < 1e-9);
        assert_eq!(placed.seen(Rect::EVERYTHING), [[8, 12], [2, 8]]);
        let globe = Pose::first(crate::Scene::Globe);
        assert!(Placed::new(&ImageView { pose: globe, ..view }, 1.0).is_none());
    }
}
