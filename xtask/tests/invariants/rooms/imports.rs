//! Which file of a crate imports from which, read from its sources; and the circles of such arrows.
//!
//! A name is followed through re-exports to the file that defines it, so that neither `lib.rs` nor a folder's
//! `mod.rs` hides an arrow. What only tests compile is left out.

use std::collections::{BTreeMap, BTreeSet};

use anyhow::Result;

use crate::sources::{Source, files_under, production};

/// The files whose modules have no name before theirs: of a library, and of a program.
const ROOTS: [&str; 2] = ["lib", "main"];

/// A path in the code: the names between its `::`.
type Path = Vec<String>;

/// The files of a crate that are compiled into it. A file is named by its module: `pager/pool`; a root is
/// `lib` or `main`.
pub(super) struct Crate {
    files: BTreeMap<String, File>,
}

struct File {
    /// What its code names in this crate: absolute paths without `crate`.
    named: Vec<Path>,
    /// What `use` declarations bring into it, by the name that it has there; `*` for globs.
    brought: Vec<(String, Path)>,
    /// Its code, without what tests alone compile.
    code: String,
}

impl Crate {
    /// Reads `src` of the crate in a folder of the clone.
    pub(super) fn read(directory: &str) -> Result<Crate> {
        Ok(Crate::of(Crate::texts(directory)?))
    }

    /// The texts of the files in `src` of the crate in a folder of the clone, by their modules.
    pub(super) fn texts(directory: &str) -> Result<BTreeMap<String, String>> {
        let prefix = format!("{directory}/src/");
        let sources = files_under(&prefix, &["rs"])?;
        let text = |source: Source| {
            let module = source.path.strip_prefix(&prefix)?.strip_suffix(".rs")?;
            Some((module.strip_suffix("/mod").unwrap_or(module).to_owned(), source.text))
        };
        Ok(sources.into_iter().filter_map(text).collect())
    }

    /// A crate of these modules with their texts.
    pub(super) fn of(texts: impl IntoIterator<Item = (String, String)>) -> Crate {
        let texts: BTreeMap<String, String> =
            texts.into_iter().map(|(module, text)| (module, production(&text))).collect();
        let is_compiled = |module: &String| {
            let mut path = path_of(module);
            std::iter::from_fn(|| {
                let name = path.pop()?;
                Some((module_of(&path), name))
            })
            .all(|(parent, name)| {
                let parents: &[&str] = if parent == ROOTS[0] { &ROOTS } else { &[&parent] };
                parents
                    .iter()
                    .any(|&parent| texts.get(parent).is_some_and(|text| declares(text, "mod", &name)))
            })
        };
        let modules: Vec<&String> = texts.keys().filter(|module| is_compiled(module)).collect();
        let files = modules.iter().map(|module| ((*module).clone(), file(module, &texts[*module]))).collect();
        Crate { files }
    }

    pub(super) fn files(&self) -> impl Iterator<Item = &String> {
        self.files.keys()
    }

    /// From which file to which file imports go.
    pub(super) fn arrows(&self) -> BTreeSet<(String, String)> {
        let arrows = self.files.iter().flat_map(|(from, file)| {
            let targets = file.named.iter().filter_map(|path| self.defined_in(path, 8));
            targets.map(|to| (from.clone(), to))
        });
        // Where a package has both, the library is another crate to the program, which names it as others do.
        arrows
            .filter(|(from, to)| from != to && (from.as_str(), to.as_str()) != (ROOTS[1], ROOTS[0]))
            .collect()
    }

    /// The file of a module: the root's is the library's, or the program's where there is none.
    fn file_of(&self, path: &[String]) -> Option<String> {
        let roots = ROOTS.iter().filter(|_| path.is_empty()).map(|root| (*root).to_owned());
        roots.chain([module_of(path)]).find(|module| self.files.contains_key(module))
    }

    /// The file that defines what a path names; re-exports are followed at most `depth` times.
    fn defined_in(&self, path: &[String], depth: usize) -> Option<String> {
        let (known, module) =
            (0..=path.len()).rev().find_map(|len| Some((len, self.file_of(&path[..len])?)))?;
        let (file, Some(name)) = (&self.files[&module], path.get(known)) else { return Some(module) };
        if depth == 0 || KINDS.iter().any(|kind| declares(&file.code, kind, name)) {
            return Some(module);
        }
        let follow = |target: &Path, rest: &[String]| {
            let whole = [&target[..], rest].concat();
            self.defined_in(&whole, depth - 1)
        };
        if let Some((_, target)) = file.brought.iter().find(|(known_as, _)| known_as == name) {
            return follow(target, &path[known + 1..]);
        }
        let globs = file.brought.iter().filter(|(known_as, _)| known_as == "*");
        let through = globs.filter_map(|(_, target)| follow(target, &path[known..]));
        through.into_iter().find(|found| self.mentions(found, name)).or(Some(module))
    }

    fn mentions(&self, module: &str, name: &str) -> bool {
        self.files.get(module).is_some_and(|file| KINDS.iter().any(|kind| declares(&file.code, kind, name)))
    }
}

/// What a name may be declared as.
const KINDS: &[&str] =
    &["struct", "enum", "fn", "trait", "const", "static", "type", "mod", "macro_rules!", "union"];

/// Returns true if code declares `name` as a `kind`.
fn declares(code: &str, kind: &str, name: &str) -> bool {
    code.match_indices(kind).any(|(at, _)| {
        let starts = !code[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_');
        let rest = code[at + kind.len()..].trim_start();
        let separated = code[at + kind.len()..].starts_with(char::is_whitespace);
        let ends = |rest: &str| !rest.starts_with(|c: char| c.is_alphanumeric() || c == '_');
        starts && separated && rest.strip_prefix(name).is_some_and(ends)
    })
}

/// The module of a path, as files are named here.
fn module_of(path: &[String]) -> String {
    if path.is_empty() { "lib".to_owned() } else { path.join("/") }
}

fn path_of(module: &str) -> Path {
    if ROOTS.contains(&module) { Vec::new() } else { module.split('/').map(str::to_owned).collect() }
}

/// Reads a file's code.
fn file(module: &str, code: &str) -> File {
    let words = words(code);
    let here = path_of(module);
    let children: BTreeSet<&str> =
        words.windows(3).filter(|words| (words[0], words[2]) == ("mod", ";")).map(|words| words[1]).collect();
    let from_here = |path: &Path| absolute(&here, path).unwrap_or_else(|| [&here[..], &path[..]].concat());
    let (mut named, mut brought) = (Vec::new(), Vec::new());
    let mut at = 0;
    while at < words.len() {
        let is_use = words[at] == "use";
        // `pub(crate)`, `pub(super)` and `pub(in path)` say who may see a thing; they import nothing.
        let is_visibility =
            at > 0 && (words[at - 1] == "(" && at > 1 && words[at - 2] == "pub" || words[at - 1] == "in");
        let starts = (["crate", "super", "self"].contains(&words[at]) || children.contains(words[at]))
            && words.get(at + 1) == Some(&"::");
        let continues = at > 0 && words[at - 1] == "::";
        if is_use {
            let mut leaves = Vec::new();
            at = tree(&words, at + 1, &[], &mut leaves);
            for (path, known_as) in leaves {
                // A `use` path without `crate` begins with a child module or another crate.
                let path = from_here(&path);
                brought.push((known_as, path.clone()));
                named.push(path);
            }
        } else if starts && !continues && !is_visibility {
            let mut leaves = Vec::new();
            at = tree(&words, at, &[], &mut leaves).max(at + 1);
            named.extend(leaves.iter().map(|(path, _)| from_here(path)));
        } else {
            at += 1;
        }
    }
    File { named, brought, code: code.to_owned() }
}

/// A path from the root of the crate, where it begins with `crate`, `self` or `super`.
fn absolute(here: &[String], path: &[String]) -> Option<Path> {
    let supers = path.iter().take_while(|name| *name == "super").count();
    match path.first()?.as_str() {
        "crate" => Some(path[1..].to_vec()),
        "self" => Some([here, &path[1..]].concat()),
        "super" => Some([&here[..here.len().saturating_sub(supers)], &path[supers..]].concat()),
        _ => None,
    }
}

/// Reads a tree of paths from `at` on, adds its leaves with the names that they get, and returns where it
/// ends.
fn tree(words: &[&str], mut at: usize, before: &[String], leaves: &mut Vec<(Path, String)>) -> usize {
    let mut path = before.to_vec();
    loop {
        match words.get(at) {
            Some(&"{") => {
                at += 1;
                while words.get(at).is_some_and(|word| *word != "}") {
                    at = if words[at] == "," { at + 1 } else { tree(words, at, &path, leaves).max(at + 1) };
                }
                return at + 1;
            }
            Some(&"*") => {
                leaves.push((path, "*".to_owned()));
                return at + 1;
            }
            Some(word) if is_name(word) => {
                // `use a::{self, b}` names `a` itself.
                if *word != "self" || path.is_empty() {
                    path.push((*word).to_owned());
                }
                at += 1;
            }
            _ => break,
        }
        if words.get(at) != Some(&"::") {
            break;
        }
        at += 1;
    }
    let mut known_as = path.last().cloned().unwrap_or_default();
    if words.get(at) == Some(&"as") {
        known_as = words.get(at + 1).map_or(known_as, |word| (*word).to_owned());
        at += 2;
    }
    leaves.push((path, known_as));
    at
}

fn is_name(word: &str) -> bool {
    word.starts_with(|c: char| c.is_alphanumeric() || c == '_')
}

/// Names, `::` and single other characters.
fn words(code: &str) -> Vec<&str> {
    let mut words = Vec::new();
    let mut rest = code.trim_start();
    while let Some(first) = rest.chars().next() {
        let is_part = |c: char| c.is_alphanumeric() || c == '_';
        let len = if is_part(first) {
            rest.find(|c: char| !is_part(c)).unwrap_or(rest.len())
        } else if rest.starts_with("::") {
            2
        } else {
            first.len_utf8()
        };
        words.push(&rest[..len]);
        rest = rest[len..].trim_start();
    }
    words
}

/// Returns true if one module lies in the other.
pub(super) fn parent_and_child(a: &str, b: &str) -> bool {
    let within = |inner: &str, outer: &str| {
        ROOTS.contains(&outer) || inner.strip_prefix(outer).is_some_and(|rest| rest.starts_with('/'))
    };
    within(a, b) || within(b, a)
}

/// The sets of two or more that reach each other by arrows, those between parent and child left out.
pub(super) fn circles(arrows: &BTreeSet<(String, String)>) -> Vec<Vec<String>> {
    let mut next: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for (from, to) in arrows.iter().filter(|(from, to)| !parent_and_child(from, to)) {
        next.entry(from).or_default().push(to);
    }
    let reached: BTreeMap<&str, BTreeSet<&str>> =
        next.keys().map(|from| (*from, reachable(&next, from))).collect();
    let in_circle = |a: &str, b: &str| {
        reached.get(a).is_some_and(|to| to.contains(b)) && reached.get(b).is_some_and(|to| to.contains(a))
    };
    let mut found: Vec<Vec<String>> = Vec::new();
    for &from in next.keys().filter(|from| in_circle(from, from)) {
        match found.iter_mut().find(|circle| in_circle(&circle[0], from)) {
            Some(circle) => circle.push(from.to_owned()),
            None => found.push(vec![from.to_owned()]),
        }
    }
    found
}

fn reachable<'a>(next: &BTreeMap<&'a str, Vec<&'a str>>, from: &str) -> BTreeSet<&'a str> {
    let mut reached = BTreeSet::new();
    let mut open: Vec<&str> = next.get(from).cloned().unwrap_or_default();
    while let Some(at) = open.pop() {
        if reached.insert(at) {
            open.extend(next.get(at).into_iter().flatten());
        }
    }
    reached
}

#[test]
fn imports_are_followed_to_the_file_that_defines_a_name() {
    let code = [
        ("lib", "mod a; mod b; mod c; pub use a::{A as Renamed, deep::*}; #[cfg(test)] mod tests;"),
        ("a", "pub mod deep; pub struct A;"),
        ("a/deep", "pub struct Deep; pub(in crate::a) struct Hidden; impl super::A {}"),
        ("b", "use crate::Renamed; use super::c::{self, C}; fn f() { crate::Deep::new(); }"),
        ("main", "mod command; fn main() { command::run(); }"),
        ("command", "use std::fs; pub fn run() {}"),
        ("c", "pub struct C; pub(super) fn g() {}"),
        ("tests", "use crate::a::A;"),
        ("left_over", "use crate::a::A;"),
    ];
    let arrows = Crate::of(code.map(|(file, text)| (file.to_owned(), text.to_owned()))).arrows();
    let arrows: Vec<(&str, &str)> = arrows.iter().map(|(from, to)| (from.as_str(), to.as_str())).collect();
    let expected = [
        ("a/deep", "a"),
        ("b", "a"),
        ("b", "a/deep"),
        ("b", "c"),
        ("lib", "a"),
        ("lib", "a/deep"),
        ("main", "command"),
    ];
    assert_eq!(arrows, expected);
}

#[test]
fn circles_are_found_but_between_parent_and_child() {
    let arrows = |pairs: &[(&str, &str)]| {
        circles(&pairs.iter().map(|(from, to)| ((*from).to_owned(), (*to).to_owned())).collect())
    };
    assert!(arrows(&[("a", "b"), ("b", "c"), ("a/x", "a"), ("a", "a/x")]).is_empty());
    assert_eq!(arrows(&[("a", "b"), ("b", "c"), ("c", "a"), ("d", "a")]), [["a", "b", "c"]]);
    assert_eq!(arrows(&[("a/x", "a/y"), ("a/y", "a/x")]), [["a/x", "a/y"]]);
}
