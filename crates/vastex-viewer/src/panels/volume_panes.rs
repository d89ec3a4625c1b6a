//! The pictures of a volume in a window, and what lies over them: the crosshair, the box with its sizes, a
//! scale, and which way axes go.

use egui::{Align2, Color32, FontId, Painter, Pos2, Rect, Stroke, StrokeKind, Vec2, pos2, vec2};
use glam::{DVec2, DVec3};

use super::volume_words::{Lengths, place_text};
use crate::volume_scene::{PaneRect, PaneSight, VolumeFacts, VolumeLook, VolumePane, cut_of};

/// What axes are drawn in: x, y, z.
const AXES: [Color32; 3] =
    [Color32::from_rgb(240, 96, 84), Color32::from_rgb(112, 208, 96), Color32::from_rgb(96, 156, 255)];
const NAMES: [&str; 3] = ["x", "y", "z"];
/// What is between pictures.
const BETWEEN: Color32 = Color32::from_gray(52);
/// Points between what lies over a picture and its edges.
const MARGIN: f32 = 10.0;
/// The longest scale, in points.
const LONGEST_BAR: f32 = 150.0;
const FONT: f32 = 12.5;
/// Points about the middle of the crosshair that are left free.
const FREE: f32 = 7.0;
/// Points below which a picture is too small for anything to lie over it.
const LEAST: f32 = 90.0;
/// And for which way axes go.
const SMALL: f32 = 170.0;

/// Pictures of a volume, and what they show.
#[derive(Clone, Copy, Debug)]
pub struct VolumePanes<'a> {
    /// What is known of the volume.
    pub facts: &'a VolumeFacts,
    /// How the volume is shown.
    pub look: &'a VolumeLook,
    /// Where the pictures lie, in pixels of the area.
    pub panes: &'a [PaneRect],
    /// The pictures, each with its texture in the painter.
    pub pictures: &'a [(VolumePane, egui::TextureId)],
    /// True if anything lies over the pictures but their names.
    pub has_guides: bool,
    /// The time that is seen, from 0.
    pub seen_time: u64,
}

impl VolumePanes<'_> {
    /// Paints the pictures into an area, a pixel of theirs on a pixel of the window.
    pub fn paint(&self, painter: &Painter, area: Rect, pixels_per_point: f32) {
        painter.rect_filled(area, 0.0, if self.panes.len() > 1 { BETWEEN } else { Color32::BLACK });
        for pane in self.panes {
            let at = |pixels: [u32; 2]| vec2(pixels[0] as f32, pixels[1] as f32) / pixels_per_point;
            let rect = Rect::from_min_size(area.min + at(pane.at), at(pane.size));
            // What is not drawn yet lets it through.
            painter.rect_filled(rect, 0.0, Color32::BLACK);
            if let Some((_, picture)) = self.pictures.iter().find(|(of, _)| *of == pane.pane) {
                let all = Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0));
                painter.image(*picture, rect, all, Color32::WHITE);
            }
            if rect.width() < LEAST || rect.height() < LEAST {
                continue;
            }
            let sight = PaneSight::of(self.look, &self.facts.of, self.panes, pane);
            let over =
                Over { painter: painter.with_clip_rect(rect.intersect(area)), rect, sight, pixels_per_point };
            self.paint_over(&over, pane.pane);
        }
    }

    fn paint_over(&self, over: &Over, pane: VolumePane) {
        let of = &self.facts.of;
        match pane.axis() {
            Some(axis) => {
                if self.has_guides {
                    self.outline(over, pane);
                    over.crosshair(self.look, pane);
                }
                let (voxel, count) = (self.look.voxel(of)[axis], of.size[axis]);
                let mut said = format!("{} {} / {count}", NAMES[axis], voxel + 1);
                let tilt = self.look.tilt(pane);
                if !tilt.is_upright() {
                    said += &format!(", tilted {:.0}°, {:.0}°", tilt.yaw, tilt.pitch);
                }
                over.text(over.rect.left_top() + Vec2::splat(MARGIN), Align2::LEFT_TOP, &said, AXES[axis]);
            }
            None => {
                if self.has_guides {
                    over.cross_in_space(self.look.cross, of.extent());
                    let slices = [VolumePane::X, VolumePane::Y, VolumePane::Z].into_iter().enumerate();
                    for (axis, slice) in slices.filter(|(_, slice)| !self.look.tilt(*slice).is_upright()) {
                        self.cut(over, slice, AXES[axis].gamma_multiply(0.8));
                    }
                    self.box_in_space(over);
                }
                let at = over.rect.left_top() + Vec2::splat(MARGIN);
                over.text(at, Align2::LEFT_TOP, self.look.mode.name(), Color32::from_gray(220));
            }
        }
        if !self.has_guides {
            return;
        }
        if over.rect.width().min(over.rect.height()) > SMALL {
            over.triad(pane, self.look);
        }
        self.scale_bar(over, pane);
        let is_first = self.panes.first().is_some_and(|first| first.pane == pane);
        if is_first && self.facts.times > 1 {
            let said = format!("time {} / {}", self.seen_time + 1, self.facts.times);
            let at = over.rect.right_top() + vec2(-MARGIN, MARGIN);
            over.text(at, Align2::RIGHT_TOP, &said, Color32::from_gray(220));
        }
        if is_first && self.panes.len() == 1 && pane.axis().is_some() {
            let at = over.rect.left_top() + vec2(MARGIN, MARGIN + 18.0);
            let place = place_text(self.facts, self.look.cross);
            over.text(at, Align2::LEFT_TOP, &place, Color32::from_gray(190));
        }
    }

    /// The box of the volume in a slice.
    fn outline(&self, over: &Over, pane: VolumePane) {
        let faint = Color32::from_white_alpha(46);
        if !self.look.tilt(pane).is_upright() {
            return self.cut(over, pane, faint);
        }
        let corners = [DVec3::ZERO, self.facts.of.extent()].map(|corner| over.point(corner));
        if let [Some(first), Some(last)] = corners {
            let rect = Rect::from_two_pos(first, last);
            over.painter.rect_stroke(rect, 0.0, Stroke::new(1.0, faint), StrokeKind::Outside);
        }
    }

    /// The edge of what a slice cuts of the volume, wherever it is seen.
    fn cut(&self, over: &Over, slice: VolumePane, color: Color32) {
        let of = &self.facts.of;
        let corners = cut_of(of, self.look.met_by(slice, of), self.look.slice_axes(slice));
        let points: Vec<Pos2> = corners.iter().filter_map(|corner| over.point(*corner)).collect();
        if points.len() > 2 && points.len() == corners.len() {
            over.painter.add(egui::Shape::closed_line(points, Stroke::new(1.0, color)));
        }
    }

    /// The box of the volume with the sizes of its sides; edges behind it are fainter.
    fn box_in_space(&self, over: &Over) {
        let extent = self.facts.of.extent();
        let corner = |bits: usize| {
            DVec3::from_array([0, 1, 2].map(|axis| if bits >> axis & 1 == 1 { extent[axis] } else { 0.0 }))
        };
        // A face is seen from outside where one looks against its normal.
        let is_seen = |axis: usize, is_end: bool| {
            let middle = extent / 2.0;
            let mut place = middle;
            place[axis] = if is_end { extent[axis] } else { 0.0 };
            let normal = DVec3::AXES[axis] * if is_end { 1.0 } else { -1.0 };
            over.sight.toward(place).dot(normal) < 0.0
        };
        let middle = over.point(extent / 2.0);
        let lengths = Lengths::of(self.facts);
        for axis in 0..3 {
            let others = [(axis + 1) % 3, (axis + 2) % 3];
            let mut sized: Option<(f32, Pos2)> = None;
            for nth in 0..4usize {
                let ends = [nth & 1, nth >> 1];
                let first = ends[0] << others[0] | ends[1] << others[1];
                let (from, to) = (corner(first), corner(first | 1 << axis));
                let (Some(a), Some(b)) = (over.point(from), over.point(to)) else { continue };
                let seen = [0, 1].map(|of| is_seen(others[of], ends[of] == 1));
                let is_front = seen[0] || seen[1];
                let alpha = if is_front { 110 } else { 40 };
                over.painter.line_segment([a, b], Stroke::new(1.0, Color32::from_white_alpha(alpha)));
                // The size stands at the edge of what is seen that is the lowest.
                let is_outer = seen[0] != seen[1];
                let at = a + (b - a) / 2.0;
                let low = at.y;
                if is_outer && sized.is_none_or(|(before, _)| low > before) {
                    sized = Some((low, at));
                }
            }
            if let (Some((_, at)), Some(middle)) = (sized, middle) {
                let out = (at - middle).normalized() * 16.0;
                over.text(at + out, Align2::CENTER_CENTER, &lengths.told(extent[axis]), AXES[axis]);
            }
        }
    }

    fn scale_bar(&self, over: &Over, pane: VolumePane) {
        // All slices have one scale; it stands in the first of them.
        let first_slice = self.panes.iter().find(|pane| pane.pane.axis().is_some());
        if pane.axis().is_some() && first_slice.is_some_and(|first| first.pane != pane) {
            return;
        }
        let world_a_point = over.sight.pixel() * f64::from(over.pixels_per_point);
        let longest = f64::from(LONGEST_BAR.min(over.rect.width() / 3.0));
        let Some((length, text)) = Lengths::of(self.facts).round(longest * world_a_point) else { return };
        let length = (length / world_a_point) as f32;
        let end = over.rect.right_bottom() - Vec2::splat(MARGIN + 2.0);
        let start = end - vec2(length, 0.0);
        for (width, color) in [(4.0, Color32::from_black_alpha(200)), (2.0, Color32::WHITE)] {
            let stroke = Stroke::new(width, color);
            over.painter.line_segment([start, end], stroke);
            for tick in [start, end] {
                over.painter.line_segment([tick - vec2(0.0, 4.0), tick + vec2(0.0, 1.0)], stroke);
            }
        }
        let middle = start + vec2(length / 2.0, -6.0);
        over.text(middle, Align2::CENTER_BOTTOM, &text, Color32::WHITE);
    }
}

/// What is painted over one picture.
struct Over {
    painter: Painter,
    rect: Rect,
    sight: PaneSight,
    pixels_per_point: f32,
}

impl Over {
    /// Where a place is seen.
    fn point(&self, place: DVec3) -> Option<Pos2> {
        let pixel = self.sight.pixel_of(place)?;
        let at = pixel / f64::from(self.pixels_per_point);
        // What is far away is not where floats end.
        let at = at.clamp(DVec2::splat(-1e5), DVec2::splat(1e5));
        Some(self.rect.min + vec2(at.x as f32, at.y as f32))
    }

    /// A text that is read on every colour.
    fn text(&self, at: Pos2, anchor: Align2, text: &str, color: Color32) {
        let font = FontId::proportional(FONT);
        for shift in [vec2(1.0, 1.0), vec2(-1.0, 1.0), vec2(1.0, -1.0), vec2(-1.0, -1.0)] {
            let shade = Color32::from_black_alpha(150);
            self.painter.text(at + shift, anchor, text, font.clone(), shade);
        }
        self.painter.text(at, anchor, text, font, color);
    }

    /// Where the other slices are.
    fn crosshair(&self, look: &VolumeLook, pane: VolumePane) {
        let Some(at) = self.point(look.cross) else { return };
        let ([ahead, ..], [right, down]) = (look.slice_axes(pane), self.sight.across());
        let longest = self.rect.width() + self.rect.height();
        for other in [VolumePane::X, VolumePane::Y, VolumePane::Z] {
            let Some(axis) = other.axis().filter(|_| other != pane) else { continue };
            let along = ahead.cross(look.slice_axes(other)[0]);
            let way = vec2(along.dot(right) as f32, along.dot(down) as f32);
            // Where both lie alike they meet in no line.
            if way.length() < 1e-3 {
                continue;
            }
            // The line of a slice has the colour of the axis that it is across.
            let stroke = Stroke::new(1.0, AXES[axis].gamma_multiply(0.75));
            let way = way.normalized();
            for way in [way, -way] {
                self.painter.line_segment([at + way * FREE, at + way * longest], stroke);
            }
        }
    }

    /// The lines in which slices meet, within the box.
    fn cross_in_space(&self, cross: DVec3, extent: DVec3) {
        for axis in 0..3 {
            let (mut from, mut to) = (cross, cross);
            (from[axis], to[axis]) = (0.0, extent[axis]);
            if let (Some(from), Some(to)) = (self.point(from), self.point(to)) {
                self.painter.line_segment([from, to], Stroke::new(1.0, AXES[axis].gamma_multiply(0.6)));
            }
        }
    }

    /// Which way axes go.
    fn triad(&self, pane: VolumePane, look: &VolumeLook) {
        const LENGTH: f64 = 26.0;
        let is_upright = pane.axis().is_some() && look.tilt(pane).is_upright();
        let (axes, at) = match is_upright {
            true => {
                let [right, down] = pane.axes();
                let at = self.rect.left_bottom() + vec2(MARGIN + 4.0, -MARGIN - 62.0);
                (vec![(right, DVec2::X), (down, DVec2::Y)], at)
            }
            false => {
                let [right, down] = self.sight.across();
                let way = |axis: usize| DVec2::new(DVec3::AXES[axis].dot(right), DVec3::AXES[axis].dot(down));
                let at = self.rect.left_bottom() + vec2(MARGIN + 34.0, -MARGIN - 56.0);
                ((0..3).map(|axis| (axis, way(axis))).collect(), at)
            }
        };
        for (axis, way) in axes {
            let way = way * LENGTH;
            let to = at + vec2(way.x as f32, way.y as f32);
            self.painter.line_segment([at, to], Stroke::new(3.5, Color32::from_black_alpha(150)));
            self.painter.line_segment([at, to], Stroke::new(1.8, AXES[axis]));
            if way.length() > 6.0 {
                let out = way.normalize() * 9.0;
                let name = to + vec2(out.x as f32, out.y as f32);
                self.text(name, Align2::CENTER_CENTER, NAMES[axis], AXES[axis]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use egui_kittest::Harness;

    use super::*;
    use crate::volume_scene::{facts_for_tests, pane_rects};

    /// The texts that are painted, each with where it stands.
    fn painted(look: &VolumeLook, facts: &VolumeFacts, has_guides: bool) -> Vec<(String, Pos2)> {
        let panes = pane_rects(look.layout, [600, 500]);
        let (look, facts) = (look.clone(), facts.clone());
        let show = move |ui: &mut egui::Ui| {
            let shown = VolumePanes {
                facts: &facts,
                look: &look,
                panes: &panes,
                pictures: &[],
                has_guides,
                seen_time: 2,
            };
            let area = Rect::from_min_size(Pos2::ZERO, vec2(600.0, 500.0));
            shown.paint(ui.painter(), area, 1.0);
        };
        let mut harness = Harness::builder().with_size([600.0, 500.0]).build_ui(show);
        harness.run();
        let shapes = &harness.output().shapes;
        let texts = shapes.iter().filter_map(|shape| match &shape.shape {
            egui::Shape::Text(text) => Some((text.galley.text().to_owned(), text.pos)),
            _ => None,
        });
        texts.collect()
    }

    #[test]
    fn slices_say_where_they_are_and_the_box_how_large_it_is() {
        let facts = facts_for_tests();
        let look = VolumeLook::first(&facts);
        let texts = painted(&look, &facts, true);
        let is_said = |said: &str| texts.iter().any(|(text, _)| text == said);
        // 40 x 30 x 20 voxels of 0.5, 0.5 and 2 micrometres.
        for said in ["x 21 / 40", "y 16 / 30", "z 11 / 20", "20 µm", "15 µm", "40 µm", "time 3 / 5", "mip"]
        {
            assert!(is_said(said), "{said}: {texts:?}");
        }
        let texts = painted(&look, &facts, false);
        assert!(texts.iter().any(|(text, _)| text == "z 11 / 20"));
        assert!(texts.iter().all(|(text, _)| text != "15 µm"), "{texts:?}");
    }

    #[test]
    fn a_tilted_slice_says_so_and_the_others_show_where_it_is() {
        let facts = facts_for_tests();
        let mut look = VolumeLook::first(&facts);
        let lines = |look: &VolumeLook| {
            let panes = pane_rects(look.layout, [600, 500]);
            let (look, facts) = (look.clone(), facts.clone());
            let show = move |ui: &mut egui::Ui| {
                let (facts, look, panes) = (&facts, &look, &panes);
                let shown = VolumePanes { facts, look, panes, pictures: &[], has_guides: true, seen_time: 0 };
                shown.paint(ui.painter(), Rect::from_min_size(Pos2::ZERO, vec2(600.0, 500.0)), 1.0);
            };
            let mut harness = Harness::builder().with_size([600.0, 500.0]).build_ui(show);
            harness.run();
            let shapes = &harness.output().shapes;
            let askew = shapes.iter().filter(|shape| match &shape.shape {
                egui::Shape::LineSegment { points: [a, b], .. } => {
                    let way = *b - *a;
                    way.length() > 500.0 && way.x.abs() > 1.0 && way.y.abs() > 1.0
                }
                _ => false,
            });
            let outlines = shapes.iter().filter(|shape| matches!(&shape.shape, egui::Shape::Path(_))).count();
            (askew.count(), outlines)
        };
        assert_eq!(lines(&look), (0, 0));
        // About what is downward, so that it stays upright on what is across y.
        look.tilt_by(VolumePane::Z, 30.0, 0.0);
        let (askew, outlines) = lines(&look);
        assert_eq!(askew, 2, "both halves of a line in the slice across y");
        assert_eq!(outlines, 2, "what it cuts of the box, in its own picture and in 3-D");
        let texts = painted(&look, &facts, true);
        assert!(texts.iter().any(|(text, _)| text == "z 11 / 20, tilted 30°, 0°"), "{texts:?}");
    }
}
