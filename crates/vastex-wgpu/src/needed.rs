//! Leaving out of a shader text what its entry points do not need, before a device has to read it.
//!
//! Vastex's text has every function that an application may call, and most applications call a few. A device
//! parses and checks all of it for each module. What is left out leaves its line breaks behind, so that
//! messages name the lines of the text as it was written.

use std::borrow::Cow;
use std::collections::HashMap;

/// Returns the text without comments and without the functions, variables, constants and types that no entry
/// point reaches through any name. Directives, assertions and `override`s stay: who makes a pipeline gives
/// values to those. A text without an entry point stays as it is, since others will join it; so does one with
/// line breaks or marks beyond ASCII other than in comments, where names are not followed.
///
/// Names are followed as words, so more may stay than is needed, never less. What is declared twice stays
/// twice, for the device to refuse.
pub fn only_needed(text: &str) -> Cow<'_, str> {
    let code = without_comments(text);
    if !code.is_ascii() && code.contains(OTHER_BLANKS) {
        return Cow::Borrowed(text);
    }
    let declarations: Vec<Declaration<'_>> = declarations(&code).collect();
    if !declarations.iter().any(|declaration| declaration.is_entry_point) {
        return Cow::Borrowed(text);
    }
    let is_needed = needed(&declarations);
    let mut rest = String::with_capacity(code.len());
    for (declaration, is_needed) in declarations.iter().zip(is_needed) {
        if is_needed {
            rest.push_str(declaration.text);
        } else {
            rest.extend(declaration.text.chars().filter(|&c| c == '\n'));
        }
    }
    Cow::Owned(rest)
}

/// Blanks of WGSL that are none to [`words`].
const OTHER_BLANKS: [char; 5] = ['\u{85}', '\u{200e}', '\u{200f}', '\u{2028}', '\u{2029}'];
/// What ends a line, and so a comment.
const LINE_BREAKS: [char; 7] = ['\n', '\u{b}', '\u{c}', '\r', '\u{85}', '\u{2028}', '\u{2029}'];

/// A declaration, a directive or an assertion of a module, with the white space before it.
struct Declaration<'a> {
    text: &'a str,
    /// Of a declaration that stays only if it is needed.
    name: Option<&'a str>,
    is_entry_point: bool,
}

/// Which of these are entry points, have no name, or are named by one that is needed.
fn needed(declarations: &[Declaration<'_>]) -> Vec<bool> {
    let mut by_name: HashMap<&str, Vec<usize>> = HashMap::new();
    for (i, name) in
        declarations.iter().enumerate().filter_map(|(i, declaration)| Some((i, declaration.name?)))
    {
        by_name.entry(name).or_default().push(i);
    }
    let mut is_needed: Vec<bool> = declarations
        .iter()
        .map(|declaration| declaration.is_entry_point || declaration.name.is_none())
        .collect();
    let mut open: Vec<usize> = (0..is_needed.len()).filter(|&i| is_needed[i]).collect();
    while let Some(next) = open.pop() {
        for &named in words(declarations[next].text).filter_map(|word| by_name.get(word)).flatten() {
            if !is_needed[named] {
                is_needed[named] = true;
                open.push(named);
            }
        }
    }
    is_needed
}

/// The parts of a module, one after the other; together they are the whole text. A part ends with the
/// semicolon or the closing brace that is in no brackets; the last may be white space.
fn declarations(code: &str) -> impl Iterator<Item = Declaration<'_>> {
    let mut rest = code;
    std::iter::from_fn(move || {
        if rest.is_empty() {
            return None;
        }
        let mut depth = 0_i32;
        let end = rest.bytes().position(|byte| {
            depth += match byte {
                b'(' | b'[' | b'{' => 1,
                b')' | b']' | b'}' => -1,
                _ => 0,
            };
            depth <= 0 && matches!(byte, b';' | b'}')
        });
        let (text, after) = rest.split_at(end.map_or(rest.len(), |end| end + 1));
        rest = after;
        Some(Declaration { text, name: name(text), is_entry_point: is_entry_point(text) })
    })
}

/// The name that a declaration gives; none for what stays whether it is named or not.
fn name(declaration: &str) -> Option<&str> {
    const KEYWORDS: [&str; 5] = ["fn", "var", "const", "struct", "alias"];
    let keyword = words(declaration).find(|word| KEYWORDS.contains(word) || *word == "override")?;
    if keyword == "override" {
        return None;
    }
    let start = keyword.as_ptr() as usize - declaration.as_ptr() as usize + keyword.len();
    let after = declaration[start..].trim_start();
    // `var<storage, read_write> name`
    let after = if after.starts_with('<') { after.split_once('>')?.1 } else { after };
    words(after).next()
}

fn is_entry_point(declaration: &str) -> bool {
    let attributes = declaration.match_indices('@').map(|(at, _)| words(&declaration[at..]).next());
    let stages = [Some("vertex"), Some("fragment"), Some("compute")];
    attributes.into_iter().any(|attribute| stages.contains(&attribute))
}

fn words(code: &str) -> impl Iterator<Item = &str> {
    let is_part = |byte: &u8| byte.is_ascii_alphanumeric() || *byte == b'_' || !byte.is_ascii();
    let mut rest = code;
    std::iter::from_fn(move || {
        let start = rest.bytes().position(|byte| is_part(&byte))?;
        let word = &rest[start..];
        let (word, after) =
            word.split_at(word.bytes().position(|byte| !is_part(&byte)).unwrap_or(word.len()));
        rest = after;
        Some(word)
    })
}

/// The text with each comment replaced by its line breaks, or by a space where it has none.
fn without_comments(text: &str) -> String {
    let mut code = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(start) = rest.find('/') {
        code.push_str(&rest[..start]);
        let length = comment_length(&rest[start..]);
        let (comment, after) = rest[start..].split_at(length.max(1));
        if length == 0 {
            code.push('/');
        } else {
            let before = code.len();
            code.extend(comment.chars().filter(|&c| c == '\n'));
            if code.len() == before {
                code.push(' ');
            }
        }
        rest = after;
    }
    code.push_str(rest);
    code
}

/// Bytes of the comment with which a text begins; 0 where it begins with none. Comments with stars nest.
fn comment_length(text: &str) -> usize {
    if text.starts_with("//") {
        let line = &text[..text.find('\n').unwrap_or(text.len())];
        // Few texts have any of the others.
        let is_plain = line.bytes().all(|byte| (b' '..=b'~').contains(&byte));
        return if is_plain { line.len() } else { line.find(LINE_BREAKS).unwrap_or(line.len()) };
    }
    if !text.starts_with("/*") {
        return 0;
    }
    let (mut at, mut depth) = (2, 1);
    while depth > 0 {
        let (opens, closes) = (text[at..].find("/*"), text[at..].find("*/"));
        match (opens, closes) {
            (Some(opens), Some(closes)) if opens < closes => (at, depth) = (at + opens + 2, depth + 1),
            (_, Some(closes)) => (at, depth) = (at + closes + 2, depth - 1),
            (_, None) => return text.len(),
        }
    }
    at
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "enable f16; // of the device
requires packed_4x8_integer_dot_product;
struct Unused { a: f32 }
@id(7) override LOOK: u32;
/* of /* the */ page
table */ const PAGES: u32 = 1u << 4u;
const OTHERS = array<u32, 2>(1u, 2u);
@group(0) @binding(0) var<storage, read_write> table: array<Entry>;
@group(0) @binding(1) var<storage> spare: array<u32>;
struct Entry { at: u32 }
fn unused() -> u32 { if true { return PAGES; } return 0u; }
fn half(x: f32) -> f32 { return x / 2.0; }
fn used() -> Entry { return table[PAGES]; }
const_assert PAGES > 2u;
@fragment
fn shade() -> @location(0) vec4<f32> {
    return vec4<f32>(half(f32(used().at)));
}
";

    #[test]
    fn what_entry_points_reach_stays_in_its_line() {
        let expected = "enable f16;  
requires packed_4x8_integer_dot_product;

@id(7) override LOOK: u32;

 const PAGES: u32 = 1u << 4u;

@group(0) @binding(0) var<storage, read_write> table: array<Entry>;

struct Entry { at: u32 }

fn half(x: f32) -> f32 { return x / 2.0; }
fn used() -> Entry { return table[PAGES]; }
const_assert PAGES > 2u;
@fragment
fn shade() -> @location(0) vec4<f32> {
    return vec4<f32>(half(f32(used().at)));
}
";
        assert_eq!(only_needed(TEXT), expected);
    }

    #[test]
    fn nothing_more_is_left_out_the_second_time() {
        let once = only_needed(TEXT).into_owned();
        assert_eq!(only_needed(&once), once);
    }

    #[test]
    fn a_text_without_entry_points_is_left_alone() {
        let text = "fn a() {} // vertex\nconst B = 1;";
        assert_eq!(only_needed(text), text);
        assert_eq!(only_needed(""), "");
    }

    #[test]
    fn text_that_is_no_wgsl_is_the_devices_to_refuse() {
        for text in
            ["@vertex fn a( {{", "}}}; @fragment", "/* never /* ends */ @vertex fn a() {}", "@compute"]
        {
            assert!(only_needed(text).len() <= text.len() + 1, "{text}");
        }
    }

    #[test]
    fn what_is_declared_twice_stays_for_the_device_to_refuse() {
        let text = "fn a() {}\nfn a() {}\n@compute @workgroup_size(1) fn b() { a(); }";
        assert_eq!(only_needed(text), text);
    }

    #[test]
    fn every_line_break_of_wgsl_ends_a_comment() {
        for line_break in LINE_BREAKS {
            let text =
                format!("fn a() {{}} // of b{line_break}@compute @workgroup_size(1) fn b() {{ a(); }}");
            assert!(only_needed(&text).contains("fn a"), "{line_break:?}");
            assert!(only_needed(&text).contains("fn b"), "{line_break:?}");
        }
        let marked = "fn a() {}\n@compute @workgroup_size(1) fn b() { return\u{200e}a(); }";
        assert_eq!(only_needed(marked), marked);
    }

    #[test]
    fn comments_are_no_code_and_divisions_are() {
        assert_eq!(without_comments("a/b // c\nd /* e\n/* f */ g */ h//"), "a/b  \nd \n h ");
    }
}
