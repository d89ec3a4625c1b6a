//! Panes beside each other ([`crate::layers::CompareMode::Beside`]): the line between two, what each shows,
//! and where the pointer is in the others.

use egui::{Color32, FontId, Painter, Pos2, Rect, Stroke, pos2, vec2};
use glam::DVec2;

use super::Minimap;

/// Points between the edge of a pane and its title, and of half a cross.
const MARGIN: f32 = 8.0;
const CROSS: f32 = 7.0;

/// Where a picture's panes are: all of one width, from its left edge on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Panes {
    /// How many there are, at least one.
    pub count: u32,
    /// The width of each, in physical pixels.
    pub width: u32,
}

impl Panes {
    /// The pane in which a pixel of the picture lies, the first or the last where it lies in none.
    pub fn at(&self, pixel: DVec2) -> u32 {
        let pane = (pixel.x / f64::from(self.width.max(1))).floor();
        pane.clamp(0.0, f64::from(self.count.max(1) - 1)) as u32
    }

    /// A pixel of the picture as one of a pane, from the pane's own corner.
    pub fn within(&self, pane: u32, pixel: DVec2) -> DVec2 {
        pixel - DVec2::new(f64::from(pane) * f64::from(self.width), 0.0)
    }

    /// A pixel of a pane where feedback has it, which has one pane, as wide as all of the picture.
    pub fn stretched(&self, within: DVec2) -> DVec2 {
        DVec2::new(within.x * f64::from(self.count), within.y)
    }

    /// The part of `free`, in points, that a pane covers.
    pub fn rect(&self, pane: u32, free: Rect, pixels_per_point: f32) -> Rect {
        let edge = |n: u32| n as f32 * self.width as f32 / pixels_per_point;
        let own = Rect::from_min_max(pos2(edge(pane), free.min.y), pos2(edge(pane + 1), free.max.y));
        own.intersect(free)
    }

    /// Paints lines between the panes, the title of each at its top, and, in all panes but the pointer's own,
    /// a cross where the pointer is. A single pane is left as it is.
    pub fn paint(&self, painter: &Painter, free: Rect, titles: &[String], pointer: Option<DVec2>) {
        if self.count < 2 {
            return;
        }
        let scale = painter.pixels_per_point();
        let pointed = pointer.map(|pixel| (self.at(pixel), self.within(self.at(pixel), pixel)));
        for (pane, title) in (0..self.count).zip(titles) {
            let rect = self.rect(pane, free, scale);
            if rect.width() <= 0.0 {
                continue;
            }
            let painter = painter.with_clip_rect(rect);
            if pane > 0 {
                let line = [rect.left_top(), rect.left_bottom()];
                painter.line_segment(line, Stroke::new(3.0, Color32::from_black_alpha(160)));
                painter.line_segment(line, Stroke::new(1.0, Color32::WHITE));
            }
            paint_title(&painter, rect, title);
            if let Some((_, within)) = pointed.filter(|(own, _)| *own != pane) {
                let left = pane as f32 * self.width as f32;
                paint_cross(&painter, pos2((left + within.x as f32) / scale, within.y as f32 / scale));
            }
        }
    }
}

/// A title, in the middle of its pane's top, or as far to the right of the map as it must be.
fn paint_title(painter: &Painter, rect: Rect, title: &str) {
    let [left, right] = room_of_title(rect);
    let text = painter.layout(title.to_owned(), FontId::proportional(14.0), Color32::WHITE, right - left);
    let middle = rect.center().x - text.size().x / 2.0;
    let place = pos2(middle.min(right - text.size().x).max(left), rect.top() + MARGIN);
    let ground = Rect::from_min_size(place, text.size()).expand(4.0);
    painter.rect_filled(ground, 4.0, Color32::from_black_alpha(170));
    painter.galley(place, text, Color32::WHITE);
}

/// From where to where the title of a pane may reach: beside the map in the corner.
fn room_of_title(rect: Rect) -> [f32; 2] {
    let left = rect.left() + Minimap::corner(rect.width());
    [left, (rect.right() - MARGIN).max(left + 1.0)]
}

fn paint_cross(painter: &Painter, at: Pos2) {
    for (width, color) in [(3.0, Color32::from_black_alpha(160)), (1.0, Color32::WHITE)] {
        let stroke = Stroke::new(width, color);
        painter.line_segment([at - vec2(CROSS, 0.0), at + vec2(CROSS, 0.0)], stroke);
        painter.line_segment([at - vec2(0.0, CROSS), at + vec2(0.0, CROSS)], stroke);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_title_leaves_the_map_in_the_corner() {
        let pane = |width| Rect::from_min_max(pos2(100.0, 0.0), pos2(100.0 + width, 80.0));
        for width in [640.0, 480.0, 300.0, 60.0] {
            let [left, right] = room_of_title(pane(width));
            assert_eq!([left, right], [100.0 + Minimap::corner(width), 92.0 + width]);
        }
        let [left, right] = room_of_title(pane(3.0));
        assert!(left < right);
    }

    #[test]
    fn a_pixel_lies_in_one_pane_at_the_place_that_it_has_in_all() {
        let panes = Panes { count: 3, width: 100 };
        for (x, pane, within) in
            [(0.0, 0, 0.0), (99.5, 0, 99.5), (100.0, 1, 0.0), (250.0, 2, 50.0), (301.0, 2, 101.0)]
        {
            let pixel = DVec2::new(x, 7.0);
            assert_eq!(panes.at(pixel), pane);
            assert_eq!(panes.within(pane, pixel), DVec2::new(within, 7.0));
        }
        assert_eq!(panes.at(DVec2::new(-5.0, 0.0)), 0);
        let free = Rect::from_min_max(pos2(0.0, 0.0), pos2(120.0, 80.0));
        assert_eq!(panes.rect(1, free, 1.0), Rect::from_min_max(pos2(100.0, 0.0), pos2(120.0, 80.0)));
        assert_eq!(panes.rect(1, free, 2.0), Rect::from_min_max(pos2(50.0, 0.0), pos2(100.0, 80.0)));
    }
}
