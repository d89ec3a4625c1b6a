//! What of a record is other than in an earlier one.
//!
//! Texts are compared line by line, pictures texel by texel and traces by what the newer program reads in
//! them, so that a new form of a file is no difference. Tests are known by crate and name: one that moved is
//! none either.

use std::collections::{BTreeMap, BTreeSet};
use std::ffi::OsStr;
use std::fs;
use std::path::Path;

use anyhow::{Context, Result};

use crate::limited::within;

use super::diff::{Change, changes};
use super::{LIMIT, Program, files_under};

/// Places of a file that are shown; of more, only how many there are.
const SHOWN: usize = 12;
/// Lines of a place that are shown.
const SHOWN_LINES: usize = 6;

/// What was found.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Found {
    /// Every difference, with the file, the place, what was and what is.
    pub differences: Vec<String>,
    /// Of each part: files compared, files that differ, places in them that do.
    pub parts: BTreeMap<String, [usize; 3]>,
    /// What is worth knowing and no difference.
    pub notes: Vec<String>,
}

impl Found {
    /// A line for each part.
    pub fn summary(&self) -> String {
        let line = |(part, [files, differ, places]): (&String, &[usize; 3])| match differ {
            0 => format!("{part:<10} {files:>5} files, none differs\n"),
            _ => format!("{part:<10} {files:>5} files, {differ} differ in {places} places\n"),
        };
        self.parts.iter().map(line).collect()
    }

    fn note(&mut self, part: &str, told: Vec<String>) {
        let counts = self.parts.entry(part.to_owned()).or_default();
        counts[0] += 1;
        counts[1] += usize::from(!told.is_empty());
        counts[2] += told.len();
        let more = told.len().saturating_sub(SHOWN);
        let file = told.first().and_then(|first| first.split(':').next()).unwrap_or_default().to_owned();
        self.differences.extend(told.into_iter().take(SHOWN));
        if more > 0 {
            self.differences.push(format!("{file}: and in {more} more places"));
        }
    }
}

/// Compares what `is` has of the parts named with what was in `was`; all parts where none is named. `program`
/// is the newer one.
pub fn compare(program: &Program, was: &Path, is: &Path, parts: &[&str]) -> Result<Found> {
    let mut found = Found::default();
    let [old, new] = [was, is].map(files_under);
    let names: BTreeSet<String> = old?.into_iter().chain(new?).collect();
    for name in names {
        let part = part_of(&name);
        if parts.is_empty() || parts.contains(&part) {
            let told = of_file(program, was, is, &name, &mut found.notes)?;
            found.note(part, told);
        }
    }
    Ok(found)
}

/// The part that a file of a record belongs to.
fn part_of(name: &str) -> &str {
    let part = name.split(['/', '.']).next().unwrap_or_default();
    if part == "json" { "help" } else { part }
}

fn of_file(
    program: &Program,
    was: &Path,
    is: &Path,
    name: &str,
    notes: &mut Vec<String>,
) -> Result<Vec<String>> {
    let [old, new] = [was, is].map(|directory| directory.join(name));
    match (old.exists(), new.exists()) {
        (true, false) => return Ok(vec![format!("{name}: was there, and is not any more")]),
        (false, true) => return Ok(vec![format!("{name}: is new")]),
        _ => {}
    }
    if name.ends_with(".vxtrace") {
        return of_trace(program, &old, name);
    }
    let [was, is] =
        [&old, &new].map(|path| fs::read(path).with_context(|| format!("cannot read {}", path.display())));
    let (was, is) = (was?, is?);
    if was == is {
        return Ok(Vec::new());
    }
    if name.ends_with(".png") {
        let words = [OsStr::new("record"), OsStr::new("difference"), old.as_os_str(), new.as_os_str()];
        let output = within(program.command(Path::new(".")).args(words), LIMIT)?;
        let status = output.status;
        let told = String::from_utf8_lossy(&[output.stdout, output.stderr].concat()).trim().to_owned();
        if told.is_empty() && !status.success() {
            return Ok(vec![format!("{name}: cannot be compared ({status})")]);
        }
        return Ok(if told.is_empty() { Vec::new() } else { vec![format!("{name}: {told}")] });
    }
    let [was, is] = [was, is].map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
    Ok(match name {
        "tests.txt" => of_tests(name, &was, &is, notes),
        "files.txt" | "names.txt" | "json.txt" => of_keys(name, &was, &is),
        _ => of_lines(name, &was, &is),
    })
}

/// A trace of the earlier record must say to the newer program what it said to the earlier one.
fn of_trace(program: &Program, old: &Path, name: &str) -> Result<Vec<String>> {
    let said = fs::read_to_string(old.with_extension("txt")).unwrap_or_default();
    let words = [OsStr::new("record"), OsStr::new("trace"), old.as_os_str()];
    let output = within(program.command(Path::new(".")).args(words), LIMIT)?;
    if !output.status.success() {
        return Ok(vec![format!("{name}: cannot be read any more: {}", super::said(&output))]);
    }
    Ok(of_lines(name, said.trim_end(), String::from_utf8_lossy(&output.stdout).trim_end()))
}

/// What lines of a world or a help text belong to.
fn is_head(line: &str) -> bool {
    line.starts_with("frame ") || line.starts_with("== ")
}

fn of_lines(name: &str, was: &str, is: &str) -> Vec<String> {
    changes(was, is, is_head).iter().map(|change| told(name, change)).collect()
}

fn told(name: &str, change: &Change<'_>) -> String {
    let head = if change.head.is_empty() { String::new() } else { format!(" ({})", change.head) };
    let mut text = format!("{name}:{}{head}", change.line);
    for (sign, lines) in [('-', &change.was), ('+', &change.is)] {
        for line in lines.iter().take(SHOWN_LINES) {
            text.push_str(&format!("\n    {sign} {line}"));
        }
        if lines.len() > SHOWN_LINES {
            text.push_str(&format!("\n    {sign} and {} lines more", lines.len() - SHOWN_LINES));
        }
    }
    text
}

/// Of lines `KEY: VALUE`, each key with what was and what is.
fn of_keys(name: &str, was: &str, is: &str) -> Vec<String> {
    let split = |text: &str| -> BTreeMap<String, String> {
        let pairs = text.lines().map(|line| line.split_once(": ").unwrap_or((line, "")));
        pairs.map(|(key, value)| (key.to_owned(), value.to_owned())).collect()
    };
    let (was, is) = (split(was), split(is));
    let keys: BTreeSet<&String> = was.keys().chain(is.keys()).collect();
    let told = |key: &&String| match (was.get(*key), is.get(*key)) {
        (Some(was), Some(is)) if was == is => None,
        (Some(was), Some(is)) => Some(format!("{name}: {key}\n    - {was}\n    + {is}")),
        (Some(was), None) => Some(format!("{name}: {key} is gone; it was {was}")),
        (None, is) => Some(format!("{name}: {key} is new: {}", is.map_or("", String::as_str))),
    };
    keys.iter().filter_map(told).collect()
}

/// Of lines `CRATE PROGRAM PATH`, those whose crate and last name are not there as often as they were.
fn of_tests(file: &str, was: &str, is: &str, notes: &mut Vec<String>) -> Vec<String> {
    let count = |text: &str| {
        let mut names: BTreeMap<String, usize> = BTreeMap::new();
        for line in text.lines() {
            let of_crate = line.split(' ').next().unwrap_or_default();
            let name = line.rsplit([':', ' ']).next().unwrap_or_default();
            *names.entry(format!("{of_crate} {name}")).or_default() += 1;
        }
        names
    };
    let moved = is.lines().filter(|line| !was.lines().any(|old| old == *line)).count();
    let (was, is) = (count(was), count(is));
    let keys: BTreeSet<&String> = was.keys().chain(is.keys()).collect();
    let told = |key: &&String| {
        let [was, is] = [&was, &is].map(|names| names.get(*key).copied().unwrap_or(0));
        match was.cmp(&is) {
            std::cmp::Ordering::Less => Some(format!("{file}: {key} is new")),
            std::cmp::Ordering::Equal => None,
            std::cmp::Ordering::Greater => Some(format!("{file}: {key} is gone")),
        }
    };
    let told: Vec<String> = keys.iter().filter_map(told).collect();
    notes.push(format!(
        "{moved} lines of {file} were not there before; tests that only moved are no difference"
    ));
    told
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_is_named_with_what_was_and_what_is() {
        let told = of_keys("files.txt", "a: 1\nb: 2\nc: 3\n", "a: 1\nb: 4\nd: 5\n");
        let expected =
            ["files.txt: b\n    - 2\n    + 4", "files.txt: c is gone; it was 3", "files.txt: d is new: 5"];
        assert_eq!(told, expected);
    }

    #[test]
    fn a_changed_line_is_named_with_its_frame() {
        let told = of_lines("worlds/a.txt", "frame 3\nupload x\nframe 4\n", "frame 3\nupload y\nframe 4\n");
        assert_eq!(told, ["worlds/a.txt:2 (frame 3)\n    - upload x\n    + upload y"]);
    }

    #[test]
    fn a_test_that_moved_is_no_difference_and_one_that_is_gone_is() {
        let was = "core lib a::tests::one\ncore lib a::tests::two\ncore suite b::one\n";
        let is = "core lib z::tests::one\ncore suite c::one\ncore suite c::three\n";
        let mut notes = Vec::new();
        let told = of_tests("tests.txt", was, is, &mut notes);
        assert_eq!(told, ["tests.txt: core three is new", "tests.txt: core two is gone"]);
        assert_eq!(notes.len(), 1);
    }

    #[test]
    fn files_belong_to_parts() {
        let names = ["worlds/a.b.txt", "files.txt", "json.txt", "help.txt"];
        assert_eq!(names.map(part_of), ["worlds", "files", "help", "help"]);
    }
}
