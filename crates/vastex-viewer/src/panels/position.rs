//! Where the camera is, in words: to be read, written, kept and gone back to.

use egui::{Button, DragValue, RichText, TextEdit, Ui};
use glam::DVec2;

use super::bookmarks::{Bookmark, BookmarksChange, BookmarksPanel, readable};
use super::map_place::MapPlace;
use crate::camera::{Move, Pose};
use crate::view_text::ViewText;

/// What a person wants of a position; the host does it.
#[derive(Clone, Debug, PartialEq)]
pub enum PositionChange {
    /// The camera goes there. The pose may be one of another scene.
    Go(Pose),
    /// The camera is moved.
    Move(Move),
    /// The camera goes there, and what is shown becomes what the text says.
    Show(Box<ViewText>),
    /// What is shown is copied as a text.
    Copy,
    /// What is shown and its files are copied as a link.
    CopyLink,
    /// What is shown becomes a bookmark of this name, which may be empty.
    Keep(String),
    /// The bookmark of this index goes.
    Forget(usize),
}

/// Where the camera is, and bookmarks. The same panel goes on from frame to frame.
#[derive(Clone, Debug, Default)]
pub struct PositionPanel {
    /// What is being written, while somebody writes.
    text: Option<String>,
    /// What was wrong with what was written last.
    error: Option<String>,
    /// Bookmarks, and what becomes of the view as a text.
    bookmarks: BookmarksPanel,
    /// True if two numbers are coordinates of the file's own system, where it has one.
    is_by_map: bool,
}

impl PositionPanel {
    /// Shows where the camera is over an image of `size` texels that has coordinates of its own by `map`, and
    /// the bookmarks. Gives back what a person wants.
    pub fn show(
        &mut self,
        ui: &mut Ui,
        pose: &Pose,
        (size, map): ([u32; 2], Option<&MapPlace>),
        bookmarks: &[Bookmark],
    ) -> Option<PositionChange> {
        let mut change = None;
        let by_map = map.filter(|_| self.is_by_map);
        let at = pose.to_text(size);
        ui.horizontal(|ui| {
            let label = ui.label("View");
            let mut text = self.text.clone().unwrap_or_else(|| readable(&at));
            let field = TextEdit::singleline(&mut text).desired_width(ui.available_width() - 56.0);
            let field = ui.add(field).labelled_by(label.id).on_hover_text(
                "where the camera is; write another place and press Enter: column,row of an image, latitude,longitude of a globe, \
                 coordinates of the file's own system where it has one and they are chosen below, or the whole as it stands here or was copied",
            );
            let is_entered = field.lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Enter));
            if field.changed() {
                (self.text, self.error) = (Some(text.clone()), None);
            }
            if field.lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Escape)) {
                (self.text, self.error) = (None, None);
            }
            let go = ui.add_enabled(self.text.is_some(), Button::new("Go"));
            let is_wanted = self.text.is_some() && (is_entered || go.clicked());
            if is_wanted {
                let wanted = match text.contains(';') {
                    true => ViewText::from_text(&text, size).map(shown).map_err(|error| error.to_string()),
                    false => pose_of(&text, pose, size, by_map).map(PositionChange::Go),
                };
                match wanted {
                    Ok(wanted) => {
                        (self.text, self.error) = (None, None);
                        change = Some(wanted);
                    }
                    Err(error) => self.error = Some(error),
                }
            } else if field.lost_focus() && self.error.is_none() && !go.hovered() {
                // What was not entered is no place to go; what is wrong stays to be mended.
                self.text = None;
            }
        });
        if let Some(error) = &self.error {
            ui.label(RichText::new(error).color(ui.visuals().error_fg_color));
        }
        if let Some(map) = map {
            self.units(ui, pose, size, map);
        }
        if let Pose::Image { orientation, .. } = pose {
            change = turn_controls(ui, orientation.degrees()).map(PositionChange::Move).or(change);
        }
        match self.bookmarks.show(ui, bookmarks) {
            Some(BookmarksChange::Keep(name)) => change = Some(PositionChange::Keep(name)),
            Some(BookmarksChange::Copy) => change = Some(PositionChange::Copy),
            Some(BookmarksChange::CopyLink) => change = Some(PositionChange::CopyLink),
            Some(BookmarksChange::Forget(index)) => change = Some(PositionChange::Forget(index)),
            Some(BookmarksChange::Show(view)) => match ViewText::from_text(&view, size) {
                Ok(view) => change = Some(shown(view)),
                Err(error) => self.error = Some(error.to_string()),
            },
            None => {}
        }
        change
    }

    /// What two numbers in the field mean.
    fn units(&mut self, ui: &mut Ui, pose: &Pose, size: [u32; 2], map: &MapPlace) {
        let plain = match pose {
            Pose::Image { .. } | Pose::Plane { .. } => "column, row",
            Pose::Globe { .. } => "latitude, longitude of the globe",
        };
        ui.horizontal_wrapped(|ui| {
            ui.label("Two numbers are");
            let of_map = format!("{} ({})", map.axes(), map.system());
            for (is_by_map, name) in [(false, plain), (true, &*of_map)] {
                let choice = ui.selectable_label(self.is_by_map == is_by_map, name);
                if choice.clicked() {
                    (self.is_by_map, self.error) = (is_by_map, None);
                }
            }
        });
        if let Pose::Image { centre, .. } = pose {
            let middle = *centre * DVec2::from(size.map(f64::from));
            ui.label(RichText::new(format!("In the middle: {}", map.text(middle))).weak());
        }
    }
}

fn shown(view: ViewText) -> PositionChange {
    PositionChange::Show(Box::new(view))
}

/// How an image is turned, for a person to change.
fn turn_controls(ui: &mut Ui, degrees: f64) -> Option<Move> {
    let mut moved = None;
    ui.horizontal(|ui| {
        let label = ui.label("Turned");
        let mut turned = degrees;
        let drag = DragValue::new(&mut turned).speed(0.5).suffix("°").max_decimals(1);
        if ui.add(drag).labelled_by(label.id).changed() && turned.is_finite() {
            moved = Some(Move::Turn(turned - degrees));
        }
        for (name, what, to) in [
            ("Turn", "by a quarter, clockwise: T", Move::Turn(90.0)),
            ("Mirror", "left and right exchanged: X", Move::Flip { is_vertical: false }),
            ("Flip", "top and bottom exchanged: Y", Move::Flip { is_vertical: true }),
        ] {
            if ui.button(name).on_hover_text(what).clicked() {
                moved = Some(to);
            }
        }
    });
    moved
}

/// The pose that a text means to a camera at `from`: that of its two numbers, as near as the camera is, which
/// are coordinates by `map` where there is one; or the one that it spells out.
fn pose_of(text: &str, from: &Pose, size: [u32; 2], map: Option<&MapPlace>) -> Result<Pose, String> {
    let numbers: Option<Vec<f64>> = text
        .split([',', ' '])
        .filter(|word| !word.is_empty())
        .map(|word| word.parse().ok().filter(|number: &f64| number.is_finite()))
        .collect();
    let [width, height] = size.map(f64::from);
    let past_ground = || "the camera looks past the ground; tilt it down (Ctrl + drag) first".to_owned();
    let is_within = |x: f64, y: f64| (0.0..=width).contains(&x) && (0.0..=height).contains(&y);
    match (numbers.as_deref(), from) {
        (Some(&[first, second]), _) if let Some(map) = map => {
            let texel = map.texel([first, second]);
            if !is_within(texel.x, texel.y) {
                let (extent, axes) = (map.extent(size), map.axes());
                return Err(format!(
                    "{first},{second} lies beside the image, which reaches from {extent} ({axes})"
                ));
            }
            from.over_uv(texel / DVec2::new(width, height), width / height).ok_or_else(past_ground)
        }
        (Some(&[x, y]), Pose::Image { .. } | Pose::Plane { .. }) => {
            if !is_within(x, y) {
                return Err(format!("{x},{y} lies beside the image, which has {width}×{height} texels"));
            }
            // The middle of a texel that is named by whole numbers.
            let middle =
                DVec2::new(x, y).map(|number| if number.fract() == 0.0 { number + 0.5 } else { number });
            let centre = (middle / DVec2::new(width, height)).min(DVec2::ONE);
            from.over_uv(centre, width / height).ok_or_else(past_ground)
        }
        (Some(&[latitude, longitude]), Pose::Globe { .. }) => {
            if latitude.abs() > 90.0 || longitude.abs() > 360.0 {
                return Err(format!(
                    "{latitude},{longitude} is no place: latitudes end at 90 degrees, longitudes at 360"
                ));
            }
            let over = DVec2::new(longitude.to_radians(), latitude.to_radians());
            // Never quite at a pole, where no side is up.
            Ok(from.at(over))
        }
        _ => Pose::from_text(text.trim(), size).map_err(|error| error.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use egui_kittest::kittest::Queryable;

    use super::*;
    use crate::Scene;

    const SIZE: [u32; 2] = [1000, 500];

    #[test]
    fn two_numbers_are_a_place_as_near_as_before() {
        let from = Pose::image(DVec2::splat(0.5), 7.0);
        for (text, centre) in [
            ("100,200", [0.1005, 0.401]),
            ("100.5 200.5", [0.1005, 0.401]),
            ("0, 0", [0.0005, 0.001]),
            ("1000,500", [1.0, 1.0]),
        ] {
            let wanted = Pose::image(centre.into(), 7.0);
            assert_eq!(pose_of(text, &from, SIZE, None), Ok(wanted), "{text}");
        }
        let error = pose_of("1001,5", &from, SIZE, None).unwrap_err();
        assert!(error.contains("1000×500"), "{error}");
        let Ok(Pose::Globe { longitude, latitude, altitude, .. }) =
            pose_of("46.4, 11.5", &Pose::first(Scene::Globe), SIZE, None)
        else {
            panic!("it is a place")
        };
        assert_eq!((latitude.to_degrees(), longitude.to_degrees(), altitude), (46.4, 11.5, 1.3));
        assert!(pose_of("91,0", &Pose::first(Scene::Globe), SIZE, None).is_err());
        // Over a plane a camera that sees no ground in the middle goes nowhere.
        let plane = Pose::first(Scene::Plane);
        assert!(matches!(pose_of("1,2", &plane, SIZE, None), Ok(Pose::Plane { .. })));
        let upwards = plane.dragged(DVec2::new(0.0, 1.0), 1.0, 2.0);
        assert!(pose_of("1,2", &upwards, SIZE, None).unwrap_err().contains("past the ground"));
    }

    #[test]
    fn a_text_has_no_more_digits_than_are_read() {
        for (text, read) in [
            ("image:x=427.0701924412416,y=2100000.123456,zoom=12", "image:x=427.0702,y=2100000.12,zoom=12"),
            ("globe:lon=-0.50000000001,lat=0,alt=0.00001m", "globe:lon=-0.5,lat=0,alt=0.00001m"),
            (
                "globe:lon=0.50000000001,lat=0,alt=1m;on=planet;sun=0.123456789,1",
                "globe:lon=0.5,lat=0,alt=1m;on=planet;sun=0.123456789,1",
            ),
        ] {
            assert_eq!(readable(text), read);
            assert!(ViewText::from_text(read, [1 << 31; 2]).is_ok(), "{read}");
        }
    }

    #[test]
    fn every_pose_can_be_written_out() {
        let from = Pose::first(Scene::Plane);
        let globe = pose_of(" globe:lon=11.5,lat=46.4,alt=1200m", &from, SIZE, None);
        assert!(matches!(globe, Ok(Pose::Globe { .. })), "{globe:?}");
        for text in ["", "1", "1,2,3", "nan,1", "moon"] {
            assert!(pose_of(text, &Pose::first(Scene::Image), SIZE, None).is_err(), "{text}");
        }
    }

    #[test]
    fn an_image_is_turned_and_mirrored_and_a_globe_is_not() {
        let show = |ui: &mut Ui, (panel, pose, asked): &mut (PositionPanel, Pose, Vec<Move>)| {
            if let Some(PositionChange::Move(moved)) = panel.show(ui, pose, (SIZE, None), &[]) {
                asked.push(moved);
            }
        };
        let mut harness = egui_kittest::Harness::new_ui_state(
            show,
            (PositionPanel::default(), Pose::first(Scene::Image), Vec::new()),
        );
        for (label, moved) in [
            ("Turn", Move::Turn(90.0)),
            ("Mirror", Move::Flip { is_vertical: false }),
            ("Flip", Move::Flip { is_vertical: true }),
        ] {
            harness.get_by_label(label).click();
            harness.run();
            assert_eq!(harness.state().2.last(), Some(&moved), "{label}");
        }
        harness.state_mut().1 = Pose::first(Scene::Globe);
        harness.run();
        assert!(harness.query_by_label("Turn").is_none());
    }

    #[test]
    fn coordinates_of_the_file_lead_to_its_texels_in_every_scene() {
        let map = MapPlace::new([10.0, 0.0, 5e5, 0.0, -10.0, 4.6e6], "EPSG:32633", false).unwrap();
        let from = Pose::image(DVec2::splat(0.5), 7.0);
        let there = pose_of("502500, 4598750", &from, SIZE, Some(&map));
        assert_eq!(there, Ok(Pose::image(DVec2::new(0.25, 0.25), 7.0)));
        let error = pose_of("100,200", &from, SIZE, Some(&map)).unwrap_err();
        assert!(error.contains("from 500000,4595000 to 510000,4600000 (x, y)"), "{error}");
        let globe = pose_of("502500 4598750", &Pose::first(Scene::Globe), SIZE, Some(&map)).unwrap();
        assert!(globe.over().distance(DVec2::new(-90.0, 45.0).map(f64::to_radians)) < 1e-12, "{globe:?}");
        let plane = pose_of("502500 4598750", &Pose::first(Scene::Plane), SIZE, Some(&map)).unwrap();
        let ray = plane.ray(DVec2::ZERO).unwrap();
        let ground = plane.ground(2.0).unwrap();
        let uv = ground.uv(ray.at(ground.beneath(&ray, 0.0).unwrap()[0]));
        assert!(uv.distance(DVec2::splat(0.25)) < 1e-9, "{uv}");
        // What is spelt out means the same whatever is chosen.
        let text = from.to_text(SIZE);
        assert_eq!(pose_of(&text, &from, SIZE, Some(&map)), pose_of(&text, &from, SIZE, None));
    }

    #[test]
    fn a_person_chooses_what_numbers_mean() {
        let map = MapPlace::new([10.0, 0.0, 5e5, 0.0, -10.0, 4.6e6], "EPSG:32633", false).unwrap();
        let show = move |ui: &mut Ui, (panel, asked): &mut (PositionPanel, Vec<Pose>)| {
            let pose = Pose::image(DVec2::splat(0.5), 7.0);
            if let Some(PositionChange::Go(pose)) = panel.show(ui, &pose, (SIZE, Some(&map)), &[]) {
                asked.push(pose);
            }
        };
        let mut harness = egui_kittest::Harness::new_ui_state(show, (PositionPanel::default(), Vec::new()));
        let mut go = |text: &str, units: &str| {
            harness.get_by_label(units).click();
            harness.run();
            harness.get_by_label("View").focus();
            harness.run();
            harness.key_press_modifiers(egui::Modifiers::COMMAND, egui::Key::A);
            harness.run();
            harness.get_by_label("View").type_text(text);
            harness.run();
            harness.key_press(egui::Key::Enter);
            harness.run();
            harness.state().1.last().copied()
        };
        let at = |u: f64, v: f64| Some(Pose::image(DVec2::new(u, v), 7.0));
        assert_eq!(go("502500,4598750", "x, y (EPSG:32633)"), at(0.25, 0.25));
        assert_eq!(go("100.5,400.5", "column, row"), at(0.1005, 0.801));
        assert!(harness.query_by_label("In the middle: x 505000 y 4597500 (EPSG:32633)").is_some());
    }
}
