//! Reading the project's own files: finding them, and looking at their code without comments, strings and
//! tests.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

/// A text file of the project.
pub(crate) struct Source {
    /// From the root, with forward slashes.
    pub(crate) path: String,
    pub(crate) text: String,
}

/// The root of the clone.
pub(crate) fn root() -> PathBuf {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR"));
    manifest.parent().unwrap_or(manifest).to_owned()
}

/// Every file of the project with one of these extensions.
pub(crate) fn files(extensions: &[&str]) -> Result<Vec<Source>> {
    files_under("", extensions)
}

/// The same below a directory of the root.
pub(crate) fn files_under(directory: &str, extensions: &[&str]) -> Result<Vec<Source>> {
    let is_wanted = |path: &Path| {
        path.extension().is_some_and(|own| extensions.iter().any(|extension| own == *extension))
    };
    let sources = read(&root().join(directory), &is_wanted)?;
    anyhow::ensure!(
        !sources.is_empty() || extensions == ["wgsl"],
        "no {extensions:?} under '{directory}': what is tested has moved"
    );
    Ok(sources)
}

/// Every text of the project: all that is UTF-8, but for the list of locked dependencies.
pub(crate) fn all_texts() -> Result<Vec<Source>> {
    read(&root(), &|path| {
        path.extension().is_none_or(|own| !["lock", "jpg", "png", "tif"].iter().any(|other| own == *other))
    })
}

fn read(directory: &Path, is_wanted: &dyn Fn(&Path) -> bool) -> Result<Vec<Source>> {
    let mut sources = Vec::new();
    let entries =
        std::fs::read_dir(directory).with_context(|| format!("cannot read {}", directory.display()))?;
    for entry in entries {
        let path = entry?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        // Where several work trees share one clone, it is a file.
        if name == ".git" {
            continue;
        }
        if path.is_dir() {
            if !name.starts_with("target") {
                sources.extend(read(&path, is_wanted)?);
            }
        } else if is_wanted(&path)
            && let Ok(text) = std::fs::read_to_string(&path)
        {
            let path = path.strip_prefix(root())?.to_string_lossy().replace('\\', "/");
            sources.push(Source { path, text });
        }
    }
    Ok(sources)
}

/// The names under `[features]` in a manifest.
pub(crate) fn features_of(manifest: &str) -> impl Iterator<Item = &str> {
    let lines = manifest.lines().skip_while(|line| line.trim() != "[features]").skip(1);
    let lines = lines.take_while(|line| !line.starts_with('['));
    lines
        .filter_map(|line| line.split_once('='))
        .map(|(name, _)| name.trim())
        .filter(|name| !name.starts_with('#'))
}

/// The words of a text that can be names.
pub(crate) fn identifiers(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| !c.is_alphanumeric() && c != '_').filter(|word| !word.is_empty())
}

/// The modules of the standard library that a text names, also those in a group: `std::{fs, io::Read}`.
pub(crate) fn std_modules(code: &str) -> Vec<&str> {
    let mut modules = Vec::new();
    for (start, _) in code.match_indices("std::") {
        let rest = &code[start + "std::".len()..];
        if let Some(group) = rest.strip_prefix('{') {
            let mut depth = 0;
            for part in group.split_inclusive([',', '{', '}']) {
                if depth == 0 {
                    modules.extend(identifiers(part).next());
                }
                match part.chars().last() {
                    Some('{') => depth += 1,
                    Some('}') => depth -= 1,
                    _ => {}
                }
                if depth < 0 {
                    break;
                }
            }
        } else {
            modules.extend(identifiers(rest).next());
        }
    }
    modules
}

/// The code without what only tests compile.
pub(crate) fn production(text: &str) -> String {
    let mut code = code(text);
    let of_tests = ["#[cfg(test)]", "#[cfg(all(test,"];
    while let Some(start) = of_tests.iter().filter_map(|attribute| code.find(attribute)).min() {
        let rest = &code[start..];
        // The item ends with its braces or, where it has none, with its semicolon.
        let end = match (rest.find('{'), rest.find(';')) {
            (Some(brace), Some(semicolon)) if semicolon < brace => semicolon,
            (Some(brace), _) => brace + matching_brace(&rest[brace..]),
            (None, semicolon) => semicolon.unwrap_or(rest.len() - 1),
        };
        code.replace_range(start..=start + end, "");
    }
    code
}

/// The offset of the brace that closes the one with which `text` begins.
fn matching_brace(text: &str) -> usize {
    let mut depth = 0;
    for (offset, character) in text.char_indices() {
        match character {
            '{' => depth += 1,
            '}' if depth == 1 => return offset,
            '}' => depth -= 1,
            _ => {}
        }
    }
    text.len() - 1
}

/// Rust or WGSL without its comments and without what stands in its strings; line breaks stay.
pub(crate) fn code(text: &str) -> String {
    let mut code = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let skipped = skipped_length(rest, code.chars().last());
        if skipped > 0 {
            code.extend(rest[..skipped].chars().filter(|c| *c == '\n'));
            rest = &rest[skipped..];
        } else {
            code.push(first);
            rest = &rest[first.len_utf8()..];
        }
    }
    code
}

/// The length of the comment, string or character with which `rest` begins, or 0.
fn skipped_length(rest: &str, before: Option<char>) -> usize {
    let until = |from: usize, end: &str| {
        rest[from..].find(end).map_or(rest.len(), |offset| from + offset + end.len())
    };
    if rest.starts_with("//") {
        return rest.find('\n').unwrap_or(rest.len());
    }
    if rest.starts_with("/*") {
        return until(2, "*/");
    }
    let in_name = before.is_some_and(|c| c.is_alphanumeric() || c == '_');
    if rest.starts_with("r\"") || rest.starts_with("r#") && !in_name {
        let hashes = rest[1..].chars().take_while(|c| *c == '#').count();
        let raw = rest[1 + hashes..].starts_with('"');
        return if raw { until(2 + hashes, &format!("\"{}", "#".repeat(hashes))) } else { 0 };
    }
    match rest.as_bytes() {
        [b'"', ..] => quoted_length(rest, '"'),
        [b'\'', b'\\', ..] => quoted_length(rest, '\''),
        // A lifetime has no closing quote behind its first character.
        [b'\'', ..] if rest.chars().nth(2) == Some('\'') => {
            rest.char_indices().nth(3).map_or(rest.len(), |(at, _)| at)
        }
        _ => 0,
    }
}

fn quoted_length(rest: &str, quote: char) -> usize {
    let mut escaped = false;
    for (offset, character) in rest.char_indices().skip(1) {
        match character {
            _ if escaped => escaped = false,
            '\\' => escaped = true,
            _ if character == quote => return offset + 1,
            _ => {}
        }
    }
    rest.len()
}

#[test]
fn comments_strings_and_characters_are_no_code() {
    let text =
        "a // std::fs\nb /* { */ c \"std::net \\\" {\" d '{' e '\\'' f r#\"std::io \" {\"# g 'a: 'static h";
    let words: Vec<String> = identifiers(&code(text)).map(str::to_owned).collect();
    assert_eq!(words, ["a", "b", "c", "d", "e", "f", "g", "a", "static", "h"]);
    assert_eq!(code(text).lines().count(), text.lines().count());
}

#[test]
fn tests_are_no_production() {
    let text = "fn a() {}\n#[cfg(test)]\nmod tests {\n fn b() { if c {} }\n}\nfn d() {}\n#[cfg(test)]\nuse e;\n#[cfg(all(test, not(unix)))]\nmod g { fn h() {} }\nfn f() {}";
    let production = production(text);
    let words: Vec<&str> = identifiers(&production).filter(|word| *word != "fn").collect();
    assert_eq!(words, ["a", "d", "f"]);
}

#[test]
fn std_modules_are_seen_in_groups() {
    let code =
        "use std::{collections::{BTreeMap, fs}, net, sync::Arc};\nstd::time::Instant::now(); use std::io;";
    assert_eq!(std_modules(code), ["collections", "net", "sync", "time", "io"]);
}

#[test]
fn features_are_read_from_a_manifest() {
    let manifest = "[package]\nname = \"a\"\n\n[features]\n# why = not\ndefault = [\"b\"]\nb = []\n\n[dependencies]\nc = \"1\"\n";
    assert_eq!(features_of(manifest).collect::<Vec<_>>(), ["default", "b"]);
}
