//! Images to be opened in the place of what is displayed: those of a file, and those that something lists, as
//! a plate does, of which there may be many thousands.

use std::ffi::{OsStr, OsString};
use std::sync::Arc;

use egui::{
    Align2, Area, Button, Frame, Id, Margin, RichText, ScrollArea, TextEdit, TextStyle, TextWrapMode, Ui,
};

use super::WindowAsked;

/// Images of a file that stand beside one another; more of them are a list.
const MOST_BESIDE: usize = 12;
/// Points that a list is high in the panel, and in the middle of the window at most.
const HEIGHT: f32 = 220.0;
const MOST_HEIGHT: f32 = 480.0;
/// Points of the window that are not the list's where it stands in the middle.
const AROUND: f32 = 220.0;

/// Images that something lists, for a person to choose from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OfferedImages {
    /// Name of what lists them.
    pub name: String,
    /// What kind of thing lists them: `a plate`, for one.
    pub what: String,
    /// The images: of each its name below what lists it, and the path that opens it.
    pub images: Arc<[(String, OsString)]>,
}

impl OfferedImages {
    /// Which of the images a path opens; `None` if it opens none of them.
    pub fn position(&self, path: &OsStr) -> Option<usize> {
        self.images.iter().position(|(_, of_image)| of_image == path)
    }
}

/// The images that are offered, and how a person looks for some of them.
#[derive(Default)]
pub(super) struct ImagesPanel {
    offered: Option<OfferedImages>,
    search: String,
    /// Those in whose names that stands.
    found: Vec<usize>,
    /// The one that is displayed.
    shown: Option<usize>,
}

impl ImagesPanel {
    /// Offers images in the place of those before.
    pub(super) fn offer(&mut self, offered: OfferedImages) {
        let found = (0..offered.images.len()).collect();
        *self = ImagesPanel { offered: Some(offered), found, ..ImagesPanel::default() };
    }

    /// The images that are offered, if any are.
    pub(super) fn offered(&self) -> Option<&OfferedImages> {
        self.offered.as_ref()
    }

    /// What a path opens is displayed: unless that is one of the images, they are offered no more.
    pub(super) fn turn_to(&mut self, path: &OsStr) {
        self.shown = self.offered.as_ref().and_then(|offered| offered.position(path));
        if self.shown.is_none() {
            *self = ImagesPanel::default();
        }
    }

    /// Lists them in the panel, beside what is displayed.
    pub(super) fn show(&mut self, ui: &mut Ui, asked: &mut Vec<WindowAsked>) {
        let Some(offered) = self.offered.clone() else { return };
        ui.add(egui::Label::new(said_of(&offered)).truncate());
        self.list(ui, HEIGHT, &offered.images, asked);
    }

    /// Lists them in the middle of what no panel covers, where nothing else is displayed.
    pub(super) fn show_alone(&mut self, ui: &Ui, asked: &mut Vec<WindowAsked>) {
        let Some(offered) = self.offered.clone() else { return };
        let free = ui.available_rect_before_wrap();
        let area = Area::new(Id::unique("offered")).pivot(Align2::CENTER_CENTER).fixed_pos(free.center());
        area.show(ui.ctx(), |ui| {
            Frame::window(ui.style()).inner_margin(Margin::same(24)).show(ui, |ui| {
                ui.set_width((free.width() - 80.0).clamp(160.0, 360.0));
                ui.add(egui::Label::new(RichText::new(&offered.name).size(20.0).strong()).truncate());
                ui.label(said_of(&offered));
                ui.add_space(6.0);
                let height = (free.height() - AROUND).clamp(60.0, MOST_HEIGHT);
                self.list(ui, height, &offered.images, asked);
                ui.add_space(8.0);
                if ui.button("Open a file…").on_hover_text("Ctrl + O").clicked() {
                    asked.push(WindowAsked::Choose);
                }
            });
        });
    }

    fn list(
        &mut self,
        ui: &mut Ui,
        height: f32,
        images: &[(String, OsString)],
        asked: &mut Vec<WindowAsked>,
    ) {
        ui.horizontal(|ui| {
            let label = ui.label("Find");
            let field = TextEdit::singleline(&mut self.search).desired_width(ui.available_width());
            let field =
                ui.add(field).labelled_by(label.id).on_hover_text("images in whose names this stands");
            if field.changed() {
                self.found = found(images, &self.search);
            }
        });
        match self.found.is_empty() {
            true => drop(ui.label(RichText::new("no image has that").weak())),
            false => {
                let of = List { name: "offered", images, found: &self.found, shown: self.shown };
                list(ui, height, &of, asked);
            }
        }
    }
}

/// What lists the images, and how many there are.
fn said_of(offered: &OfferedImages) -> RichText {
    let (what, count) = (&offered.what, offered.images.len());
    RichText::new(match count {
        1 => format!("{what} with 1 image"),
        _ => format!("{what} with {count} images"),
    })
}

/// The images in whose names a text stands, in large letters or small ones.
fn found(images: &[(String, OsString)], search: &str) -> Vec<usize> {
    let wanted = search.trim().to_lowercase();
    let has =
        |(nth, (name, _)): (usize, &(String, OsString))| name.to_lowercase().contains(&wanted).then_some(nth);
    images.iter().enumerate().filter_map(has).collect()
}

/// A list of images to choose from.
struct List<'a> {
    /// Name of the list: each one of a panel is scrolled by itself.
    name: &'a str,
    images: &'a [(String, OsString)],
    /// The images that are listed.
    found: &'a [usize],
    /// The one that is displayed.
    shown: Option<usize>,
}

/// Shows a list, of which only the rows that are seen are laid out.
fn list(ui: &mut Ui, height: f32, list: &List<'_>, asked: &mut Vec<WindowAsked>) {
    let List { name, images, found, shown } = *list;
    let row = ui.text_style_height(&TextStyle::Button) + 2.0 * ui.spacing().button_padding.y;
    let area = ScrollArea::vertical().id_salt(("images", name)).max_height(height).auto_shrink([false, true]);
    area.show_rows(ui, row.max(ui.spacing().interact_size.y), found.len(), |ui, rows| {
        ui.style_mut().wrap_mode = Some(TextWrapMode::Truncate);
        for nth in found.get(rows).unwrap_or_default() {
            let Some((name, path)) = images.get(*nth) else { continue };
            let chosen = ui.selectable_label(shown == Some(*nth), name);
            if chosen.on_hover_text(path.to_string_lossy()).clicked() {
                asked.push(WindowAsked::Open(path.clone()));
            }
        }
    });
}

/// The images of the file that is displayed, to be opened in its place: the labels of slides, and other
/// pages.
pub(super) fn images_of_file(ui: &mut Ui, images: &[(String, OsString)], asked: &mut Vec<WindowAsked>) {
    if images.is_empty() {
        return;
    }
    if images.len() > MOST_BESIDE {
        ui.label(format!("{} images", images.len()));
        let all: Vec<usize> = (0..images.len()).collect();
        let of = List { name: "of the file", images, found: &all, shown: None };
        return list(ui, HEIGHT, &of, asked);
    }
    ui.horizontal_wrapped(|ui| {
        ui.label("Images");
        for (name, path) in images {
            if ui.add(Button::new(name)).on_hover_text(path.to_string_lossy()).clicked() {
                asked.push(WindowAsked::Open(path.clone()));
            }
        }
    });
}

#[cfg(test)]
mod tests {
    use egui_kittest::Harness;
    use egui_kittest::kittest::Queryable;

    use super::super::super::unnamed;
    use super::*;

    /// A plate of many wells, each with an image.
    fn plate(wells: usize) -> OfferedImages {
        let image = |well: usize| {
            let name = format!("{}/{}/0", char::from(b'A' + (well / 100) as u8), well % 100 + 1);
            let path = format!("/scans/plate.zarr/{name}").into();
            (name, path)
        };
        let images = (0..wells).map(image).collect();
        OfferedImages { name: "plate.zarr".to_owned(), what: "a plate".to_owned(), images }
    }

    type Asked = (ImagesPanel, Vec<WindowAsked>);

    fn click(harness: &mut Harness<'_, Asked>, label: &str) {
        harness.get_by_label(label).click();
        harness.run();
    }

    #[test]
    fn of_thousands_of_images_some_are_found_and_one_is_opened() {
        let mut panel = ImagesPanel::default();
        panel.offer(plate(2500));
        let show = |ui: &mut Ui, (panel, asked): &mut Asked| panel.show_alone(ui, asked);
        let mut harness =
            Harness::builder().with_size([600.0, 500.0]).build_ui_state(show, (panel, Vec::new()));
        harness.run();
        assert!(harness.query_by_label("plate.zarr").is_some());
        assert!(harness.query_by_label("a plate with 2500 images").is_some());
        assert_eq!(unnamed(&harness.root()), Vec::<String>::new());
        // Only those are laid out that are seen.
        let rows = harness.query_all_by_label_contains("/0").count();
        assert!((5..100).contains(&rows), "{rows} rows");
        click(&mut harness, "A/2/0");
        harness.get_by_label("Find").focus();
        harness.run();
        harness.get_by_label("Find").type_text("y/77");
        harness.run();
        assert_eq!(harness.query_all_by_label_contains("/0").count(), 1);
        click(&mut harness, "Y/77/0");
        click(&mut harness, "Open a file…");
        let open = |path: &str| WindowAsked::Open(path.into());
        let asked = [open("/scans/plate.zarr/A/2/0"), open("/scans/plate.zarr/Y/77/0"), WindowAsked::Choose];
        assert_eq!(harness.state().1, asked);
        harness.get_by_label("Find").focus();
        harness.run();
        harness.get_by_label("Find").type_text("?");
        harness.run();
        assert!(harness.query_by_label("no image has that").is_some());
    }

    #[test]
    fn images_are_offered_until_something_else_is_displayed() {
        let mut panel = ImagesPanel::default();
        panel.offer(plate(3));
        panel.turn_to("/scans/plate.zarr/A/3/0".as_ref());
        assert_eq!((panel.shown, panel.found.len()), (Some(2), 3));
        panel.turn_to("/scans/plate.zarr/A/1/0".as_ref());
        assert_eq!(panel.shown, Some(0));
        panel.turn_to("/scans/other.zarr".as_ref());
        assert!(panel.offered().is_none() && panel.found.is_empty());
    }

    #[test]
    fn many_images_of_a_file_are_a_list() {
        for (count, seen) in [(3, 3), (400, 0)] {
            let offered = plate(count);
            let show = |ui: &mut Ui, asked: &mut Vec<WindowAsked>| images_of_file(ui, &offered.images, asked);
            let mut harness = Harness::builder().with_size([320.0, 300.0]).build_ui_state(show, Vec::new());
            harness.run();
            let rows = harness.query_all_by_label_contains("/0").count();
            assert!(if seen > 0 { rows == seen } else { (3..40).contains(&rows) }, "{rows} of {count}");
            harness.get_by_label("A/2/0").click();
            harness.run();
            assert_eq!(*harness.state(), [WindowAsked::Open("/scans/plate.zarr/A/2/0".into())]);
        }
    }
}
