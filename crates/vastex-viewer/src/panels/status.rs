//! What lies below the pointer, as a line at the lower edge of the picture.

use egui::{Align2, Area, Color32, Context, CornerRadius, Frame, Id, Margin, Rect, RichText, Vec2};

use super::map_place::{MapPlace, degrees};
use crate::inspect::InspectedTexel;

/// Points between the line and the edges of the picture.
const MARGIN: f32 = 8.0;
/// What is left to the scale bar beside it; where a line would be shorter than the second of these, it stands
/// above the scale bar, which is as high as the third.
const BESIDE: f32 = 220.0;
const LEAST_BESIDE: f32 = 260.0;
const BAR: f32 = 32.0;
/// The narrowest and lowest part of a picture that has a line.
const LEAST: Vec2 = Vec2::new(160.0, 80.0);
const FONT: f32 = 13.0;

/// In which coordinates a line tells where a texel is, beside its column and row.
#[derive(Clone, Copy, Debug)]
pub enum StatusPlace<'a> {
    /// By longitude and latitude of a globe that an image of so many texels is all of.
    Globe([u32; 2]),
    /// By those of the image's own system.
    Map(&'a MapPlace),
}

/// What is below the pointer in words: the texel, its values, what they were converted from
/// ([`super::FileAbout::converted`]), the level that they are of, and where its middle is, if there are
/// coordinates for that.
pub fn status_text(texel: &InspectedTexel, converted: &str, place: Option<StatusPlace<'_>>) -> String {
    let [x, y] = texel.texel;
    let converted = if converted.is_empty() { String::new() } else { format!(" ({converted})") };
    let text = format!("{x}, {y}   {}{converted}   level {}", texel.values_text(), texel.level);
    let middle = [x, y].map(|texel| f64::from(texel) + 0.5);
    match place {
        Some(StatusPlace::Globe([width, height])) => {
            let share = |axis: usize, size: u32| middle[axis] / f64::from(size.max(1));
            let (longitude, latitude) = (360.0 * share(0, width) - 180.0, 90.0 - 180.0 * share(1, height));
            // As many digits as tell texels apart.
            let digits = (f64::from(width) / 36.0).log10().ceil().clamp(0.0, 8.0) as usize;
            let [north, east] =
                [degrees(latitude, ["N", "S"], digits), degrees(longitude, ["E", "W"], digits)];
            format!("{text}   {north} {east}")
        }
        Some(StatusPlace::Map(map)) => format!("{text}   {}", map.text(middle.into())),
        None => text,
    }
}

/// How far above the foot of `free`, the part of the picture that no panel covers, what is said at the lower
/// left begins, in points: above the scale bar, where there is no room beside it, as where so many panes lie
/// beside each other, each with a scale bar of its own.
pub fn foot_rise(free: Rect, panes: u32) -> f32 {
    if panes > 1 || free.width() < BESIDE + LEAST_BESIDE { BAR } else { 0.0 }
}

/// Shows a line at the lower left of `free`, the part of the picture that no panel covers, and leaves room to
/// the scale bar at the lower right, or to those of so many panes. It takes no pointer from the picture.
/// Gives back how far above the foot it ends, in points, with a margin; where it is left out for want of
/// room, where it would begin.
pub fn status_line(context: &Context, (free, panes): (Rect, u32), text: &str) -> f32 {
    let rise = foot_rise(free, panes);
    if free.width() < LEAST.x || free.height() < LEAST.y + rise {
        return rise;
    }
    let beside = if rise > 0.0 { 2.0 * MARGIN + 12.0 } else { BESIDE };
    let line = Area::new(Id::unique("below the pointer")).pivot(Align2::LEFT_BOTTOM).interactable(false);
    let line = line.fixed_pos(free.left_bottom() + Vec2::new(MARGIN, -MARGIN - rise)).show(context, |ui| {
        let frame = Frame::new()
            .fill(Color32::from_black_alpha(170))
            .corner_radius(CornerRadius::same(4))
            .inner_margin(Margin::symmetric(6, 2));
        frame.show(ui, |ui| {
            ui.set_max_width(free.width() - beside);
            let text = RichText::new(text).size(FONT).color(Color32::WHITE);
            ui.add(egui::Label::new(text).selectable(false).truncate());
        });
    });
    rise + line.response.rect.height() + MARGIN
}

#[cfg(test)]
mod tests {
    use egui_kittest::Harness;
    use egui_kittest::kittest::Queryable;
    use vastex::LayerFormat;

    use super::*;

    #[test]
    fn the_line_says_texel_value_level_and_place() {
        let texel = |format, level| InspectedTexel::new([300, 100], level, format, [0.2, 1.0, 0.0, 1.0]);
        let rgba = texel(LayerFormat::Rgba8, 0);
        assert_eq!(status_text(&rgba, "", None), "300, 100   51 255 0   level 0");
        let converted = status_text(&rgba, "from inks (CMYK)", None);
        assert_eq!(converted, "300, 100   51 255 0 (from inks (CMYK))   level 0");
        let on_globe =
            status_text(&texel(LayerFormat::R32Float, 3), "", Some(StatusPlace::Globe([720, 360])));
        assert_eq!(on_globe, "300, 100   0.2   level 3   39.75° N 29.75° W");
        let south = InspectedTexel::new([719, 359], 0, LayerFormat::R8, [1.0; 4]);
        assert!(
            status_text(&south, "", Some(StatusPlace::Globe([720, 360]))).ends_with("89.75° S 179.75° E")
        );
        let map = MapPlace::new([10.0, 0.0, 5e5, 0.0, -10.0, 4.6e6], "EPSG:32633", false).unwrap();
        let on_map = status_text(&texel(LayerFormat::R32Float, 0), "", Some(StatusPlace::Map(&map)));
        assert_eq!(on_map, "300, 100   0.2   level 0   x 503005 y 4598995 (EPSG:32633)");
    }

    #[test]
    fn the_line_stands_at_the_lower_edge_and_takes_no_clicks() {
        let show = |ui: &mut egui::Ui, (height, panes): &mut (f32, u32)| {
            *height = status_line(ui.ctx(), (ui.max_rect(), *panes), "1, 2   3   level 4");
        };
        let mut harness = Harness::builder().with_size([600.0, 300.0]).build_ui_state(show, (0.0, 1));
        harness.run();
        let line = harness.get_by_label("1, 2   3   level 4").rect();
        assert!(line.left() < 30.0 && line.bottom() > 270.0 && line.bottom() < 300.0, "{line:?}");
        assert!((15.0..50.0).contains(&harness.state().0), "{}", harness.state().0);
        let over = harness.ctx.layer_id_at(line.center());
        assert!(over.is_none_or(|layer| layer.order == egui::Order::Background), "{over:?}");
        // Above the scale bars of panes, of which it lies over the first.
        harness.state_mut().1 = 2;
        harness.run();
        let line = harness.get_by_label("1, 2   3   level 4").rect();
        assert!(line.bottom() < 300.0 - 30.0 && line.bottom() > 240.0, "{line:?}");
        harness.state_mut().1 = 1;
        // Where there is no room beside the scale bar it stands above that.
        harness.set_size([400.0, 300.0].into());
        harness.run();
        let line = harness.get_by_label("1, 2   3   level 4").rect();
        assert!(line.left() < 30.0 && line.bottom() < 300.0 - 30.0 && line.bottom() > 240.0, "{line:?}");
        assert!((40.0..90.0).contains(&harness.state().0), "{}", harness.state().0);
        // Where there is none at all it is left out.
        harness.set_size([150.0, 300.0].into());
        harness.run();
        assert!(harness.query_by_label("1, 2   3   level 4").is_none());
    }
}
