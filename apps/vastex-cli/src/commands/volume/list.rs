//! What is said of something that lists volumes, as a plate does, and texts from metadata for a terminal.

use serde::Serialize;
use vastex_volume::ImageList;

/// Images of a list that are named to people.
pub(super) const MOST_NAMED: usize = 20;

/// What `--json` prints of something that lists volumes.
#[derive(Serialize)]
pub(super) struct ListSummary<'a> {
    /// Always `images`.
    kind: &'static str,
    /// What lists them.
    what: &'static str,
    /// Their paths below this one.
    images: &'a [String],
    oddities: &'a [String],
}

impl ListSummary<'_> {
    pub(super) fn new(list: &ImageList) -> ListSummary<'_> {
        ListSummary { kind: "images", what: list.what, images: &list.images, oddities: &list.oddities }
    }
}

pub(super) fn list_text(list: &ImageList) -> String {
    let mut lines = vec![
        list.path.clone(),
        format!("  {} with {} images; open one by its path:", list.what, list.images.len()),
    ];
    lines.extend(list.images.iter().take(MOST_NAMED).map(|image| format!("  {}/{image}", list.path)));
    if let Some(more) = list.images.len().checked_sub(MOST_NAMED).filter(|more| *more > 0) {
        lines.push(format!("  and {more} more (--json has all)"));
    }
    lines.extend(list.oddities.iter().map(|oddity| format!("  odd: {oddity}")));
    lines.iter().map(|line| printable(line)).collect::<Vec<_>>().join("\n")
}

/// What is said where one volume is needed and several are there: which they are, the first ones by name.
pub(crate) fn no_volume(list: &ImageList) -> String {
    let ImageList { path, what, images, .. } = list;
    let named = images.iter().take(MOST_NAMED).map(String::as_str).collect::<Vec<_>>().join(", ");
    let more = match images.len().saturating_sub(MOST_NAMED) {
        0 => String::new(),
        more => format!(" and {more} more, which `vastex info --json` names"),
    };
    printable(&format!("{path}: is {what}; name one of its images below this path: {named}{more}"))
}

/// A text from metadata as a terminal may have it: control characters, which it would obey, are replaced.
pub(in crate::commands) fn printable(text: &str) -> String {
    text.chars().map(|one| if one.is_control() { char::REPLACEMENT_CHARACTER } else { one }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_from_metadata_cannot_steer_a_terminal() {
        let list = ImageList {
            path: "plate".into(),
            root: "plate".into(),
            what: "a plate",
            images: vec!["A/1\x1b[2J".into()],
            oddities: vec!["odd\r\nlines".into()],
        };
        let text = list_text(&list);
        assert_eq!(text.lines().count(), 4);
        assert!(!text.chars().any(|one| one.is_control() && one != '\n'), "{text:?}");
    }

    #[test]
    fn the_first_images_are_named_and_the_others_counted() {
        let list = |count: usize| ImageList {
            path: "plate".into(),
            root: "plate".into(),
            what: "a plate",
            images: (0..count).map(|nth| format!("A/{nth}")).collect(),
            oddities: Vec::new(),
        };
        assert_eq!(
            no_volume(&list(2)),
            "plate: is a plate; name one of its images below this path: A/0, A/1"
        );
        let many = no_volume(&list(MOST_NAMED + 3));
        assert!(many.contains("A/19 and 3 more") && !many.contains("A/20"), "{many}");
    }
}
