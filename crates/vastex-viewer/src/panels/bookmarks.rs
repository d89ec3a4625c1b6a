//! Views that a person keeps, and takes out of the window as texts: the same of images and of volumes.

use egui::{Button, CollapsingHeader, TextEdit, Ui};

/// A view that a person keeps.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Bookmark {
    /// What the person calls it; it may be nothing.
    pub name: String,
    /// The text of the view ([`crate::ViewText`], of a volume [`crate::VolumeViewText`]).
    pub view: String,
}

impl Bookmark {
    /// What it is known by: its name, or where its camera is if it has none.
    fn title(&self) -> String {
        let pose = self.view.split(';').next().unwrap_or_default();
        if self.name.is_empty() { readable(pose) } else { self.name.clone() }
    }
}

/// What a person wants of views; the host does it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum BookmarksChange {
    /// What is shown becomes a bookmark of this name, which may be empty.
    Keep(String),
    /// What is shown is copied as a text.
    Copy,
    /// What is shown and its files are copied as a link.
    CopyLink,
    /// What this text says is shown.
    Show(String),
    /// The bookmark of this index goes.
    Forget(usize),
}

/// The part of a panel that keeps views. The same goes on from frame to frame.
#[derive(Clone, Debug, Default)]
pub struct BookmarksPanel {
    /// What the next bookmark is to be called.
    name: String,
}

impl BookmarksPanel {
    /// Shows what can be done with the view, and the bookmarks. Gives back what a person wants.
    pub fn show(&mut self, ui: &mut Ui, bookmarks: &[Bookmark]) -> Option<BookmarksChange> {
        let mut change = None;
        ui.horizontal(|ui| {
            let keep = ui.button("Keep view").on_hover_text("as a bookmark of this file");
            let label = ui.label("named");
            let field = TextEdit::singleline(&mut self.name).desired_width(ui.available_width());
            let field = ui.add(field.hint_text("name")).labelled_by(label.id);
            let is_entered = field.lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Enter));
            if keep.clicked() || is_entered {
                let name = std::mem::take(&mut self.name).trim().to_owned();
                change = Some(BookmarksChange::Keep(name));
            }
        });
        ui.horizontal_wrapped(|ui| {
            let view = "as a text, with all that is shown, for this window and for --view: Ctrl + C";
            let link =
                "as a text with its files, for the field of the path and for `vastex view`: Ctrl + Shift + C";
            for (name, what, copies) in
                [("Copy view", view, BookmarksChange::Copy), ("Copy link", link, BookmarksChange::CopyLink)]
            {
                if ui.button(name).on_hover_text(what).clicked() {
                    change = Some(copies);
                }
            }
        });
        if !bookmarks.is_empty() {
            CollapsingHeader::new("Bookmarks").default_open(true).show(ui, |ui| {
                for (index, bookmark) in bookmarks.iter().enumerate() {
                    ui.horizontal(|ui| {
                        let (title, view) = (bookmark.title(), &bookmark.view);
                        let forget = ui.button("×").on_hover_text(format!("forget {title}"));
                        if forget.clicked() {
                            change = Some(BookmarksChange::Forget(index));
                        }
                        let go =
                            ui.add(Button::new(title).frame(false).truncate()).on_hover_text(readable(view));
                        if go.clicked() {
                            change = Some(BookmarksChange::Show(view.clone()));
                        }
                    });
                }
            });
        }
        change
    }
}

/// The text of a view with no more digits of its pose than a person reads.
pub(super) fn readable(text: &str) -> String {
    if let Some((pose, rest)) = text.split_once(';') {
        return format!("{};{rest}", readable(pose));
    }
    let rounded = |word: &str| {
        let (name, number) = word.split_once('=')?;
        let (number, unit) = number.strip_suffix('m').map_or((number, ""), |number| (number, "m"));
        let number: f64 = number.parse().ok()?;
        let digits = if number.abs() < 1000.0 { 4 } else { 2 };
        let text = format!("{number:.digits$}");
        let text = text.trim_end_matches('0').trim_end_matches('.');
        // Of what is too small for them, all digits.
        let is_lost = number != 0.0 && matches!(text, "0" | "-0");
        Some(if is_lost { word.to_owned() } else { format!("{name}={text}{unit}") })
    };
    let words: Vec<String> =
        text.split(',').map(|word| rounded(word).unwrap_or_else(|| word.to_owned())).collect();
    words.join(",")
}
