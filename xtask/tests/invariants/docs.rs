//! What documentation says: every public item of the crates can be read alone.

use anyhow::{Result, ensure};

use crate::sources::files_under;

/// Beginnings that name no subject, so that the comment says nothing without what stands beside it, or that
/// are half a sentence.
const BEGINNINGS: &[&str] = &[
    "All of it",
    "All of them",
    "How it",
    "How its",
    "How many it",
    "How much they",
    "It",
    "Its",
    "Of it",
    "Of its",
    "Of them",
    "The other",
    "The others",
    "The same",
    "Their",
    "They",
    "Those",
    "What is known of it",
    "What is wrong with it",
    "What is wrong with them",
    "What it",
    "What its",
    "What they",
    "Where it",
    "Where its",
    "Where their",
    "Where they",
    "Whether",
    "Which it",
    "Which of them",
    "Which they",
];

#[test]
fn public_items_can_be_read_alone() -> Result<()> {
    let mut documented = 0;
    for source in files_under("crates", &["rs"])? {
        let is_test = source.path.contains("/tests/") || source.path.ends_with("tests.rs");
        if is_test || !source.path.contains("/src/") {
            continue;
        }
        for (line, text) in public_docs(&source.text) {
            documented += 1;
            let found = BEGINNINGS.iter().find(|beginning| begins_with(text, beginning));
            ensure!(
                found.is_none(),
                "{}:{line}: the comment of a public item begins with '{}': name what it is about ('Returns true \
                 if' and 'True if' in the place of 'Whether')",
                source.path,
                found.unwrap_or(&"")
            );
        }
    }
    ensure!(documented > 0, "no public item has a comment: what is tested has moved");
    Ok(())
}

/// Returns true if a text begins with these whole words.
fn begins_with(text: &str, words: &str) -> bool {
    text.strip_prefix(words).is_some_and(|rest| !rest.starts_with(|c: char| c.is_alphanumeric()))
}

/// The first lines of the comments of public items, fields and variants, with their numbers, counted from 1.
///
/// Goes by the indentation that rustfmt gives. A public item of a private module counts too.
fn public_docs(text: &str) -> Vec<(usize, &str)> {
    let mut docs = Vec::new();
    // The lines around, from the outermost: how far each is indented, and true if all in it is public.
    let mut around: Vec<(usize, bool)> = Vec::new();
    let mut doc = None;
    let mut lines = (1..).zip(text.lines());
    while let Some((number, line)) = lines.next() {
        let code = line.trim_start();
        let indent = line.len() - code.len();
        if let Some(comment) = code.strip_prefix("/// ") {
            doc.get_or_insert((number, comment));
        } else if code.starts_with("#[") {
            // An attribute of several lines ends where it began.
            let closes = |line: &str| line.len() - line.trim_start().len() == indent;
            if !code.contains(']') {
                lines.by_ref().find(|(_, line)| closes(line));
            }
        } else if !code.is_empty() && !code.starts_with("//") {
            around.retain(|(outer, _)| *outer < indent);
            let is_public = around.last().is_some_and(|(_, exposes)| *exposes);
            if let Some(doc) = doc.take()
                && (is_public || code.starts_with("pub "))
            {
                docs.push(doc);
            }
            let exposes = code.starts_with("pub enum ") || code.starts_with("pub trait ");
            around.push((indent, exposes || is_public && !code.contains("fn ")));
        }
    }
    docs
}

#[test]
fn comments_of_public_items_are_found() {
    let text = [
        "/// It is private.",
        "struct A {",
        "    /// Its field.",
        "    a: u8,",
        "}",
        "",
        "/// They.",
        "#[derive(Debug)]",
        "pub enum B {",
        "    /// Those of",
        "    /// two lines.",
        "    #[error(",
        "        \"a\"",
        "    )]",
        "    C {",
        "        /// Whether a field.",
        "        c: bool,",
        "    },",
        "}",
        "",
        "impl B {",
        "    /// The same.",
        "    pub fn d() {",
        "        /// It, of a body.",
        "        const D: u8 = 0;",
        "    }",
        "",
        "    /// Its private function.",
        "    fn e() {}",
        "}",
        "",
        "pub trait F {",
        "    /// Its method.",
        "    fn g();",
        "}",
        "",
        "pub(crate) struct H;",
    ]
    .join("\n");
    let found: Vec<&str> = public_docs(&text).into_iter().map(|(_, text)| text).collect();
    assert_eq!(found, ["They.", "Those of", "Whether a field.", "The same.", "Its method."]);
    assert_eq!(public_docs(&text)[0].0, 7);
}

#[test]
fn beginnings_without_a_subject_are_refused() {
    let is_refused = |text: &str| BEGINNINGS.iter().any(|beginning| begins_with(text, beginning));
    let refused = ["It ends.", "Its name.", "Whether, for a cycle, none is.", "The same by level.", "Those:"];
    for text in
        refused.into_iter().chain(["What it is called.", "Where its tail lies.", "What is wrong with it."])
    {
        assert!(is_refused(text), "{text}");
    }
    for text in
        ["Items.", "The sameness of two.", "Itself", "True if a page is there.", "A page, and its tile."]
    {
        assert!(!is_refused(text), "{text}");
    }
}
