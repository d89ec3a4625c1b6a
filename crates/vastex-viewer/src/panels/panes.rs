//! Panes beside each other ([`crate::layers::CompareMode::Beside`]): the line between two, what each shows,
//! and where the pointer is in the others.

use egui::{Color32, FontId, Painter, Pos2, Rect, Stroke, pos2, vec2};
use glam::DVec2;

use super::Minimap;
use crate::layers::Panes;

/// Points between the edge of a pane and its title, and of half a cross.
const MARGIN: f32 = 8.0;
const CROSS: f32 = 7.0;

impl Panes {
    /// The part of `free`, in points, that a pane covers.
    pub fn rect(&self, pane: u32, free: Rect, pixels_per_point: f32) -> Rect {
        let edge = |n: u32| self.first(n) as f32 / pixels_per_point;
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
                let left = self.first(pane) as f32;
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
    fn a_pane_covers_its_part_of_what_is_free() {
        let panes = Panes { count: 3, left: 0, width: 100, whole: 300 };
        let free = Rect::from_min_max(pos2(0.0, 0.0), pos2(120.0, 80.0));
        assert_eq!(panes.rect(1, free, 1.0), Rect::from_min_max(pos2(100.0, 0.0), pos2(120.0, 80.0)));
        assert_eq!(panes.rect(1, free, 2.0), Rect::from_min_max(pos2(50.0, 0.0), pos2(100.0, 80.0)));
        let beside = Panes { left: 30, width: 40, ..panes };
        assert_eq!(beside.rect(1, free, 1.0), Rect::from_min_max(pos2(70.0, 0.0), pos2(110.0, 80.0)));
    }
}
