//! The public names of a crate, by what rustdoc writes for people: every item, with its methods, fields,
//! variants and their signatures.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result, ensure};

use super::write;

/// Ids of parts of an item, by what they begin with.
const PARTS: [&str; 7] =
    ["method.", "tymethod.", "structfield.", "variant.", "associatedconstant.", "associatedtype.", "impl-"];

/// Writes `names.txt` from the pages of a crate, `documentation`.
pub fn record(documentation: &Path, directory: &Path) -> Result<()> {
    let all = read(&documentation.join("all.html"))?;
    let mut lines = Vec::new();
    for item in between(&all, "<li><a href=\"", "\"").filter(|item| item.ends_with(".html")) {
        let page = read(&documentation.join(item))?;
        let kind = item.rsplit('/').next().and_then(|file| file.split('.').next()).unwrap_or_default();
        let folder =
            item.rsplit_once('/').map_or(String::new(), |(folder, _)| folder.replace('/', "::") + "::");
        let name = item.trim_end_matches(".html").rsplit('.').next().unwrap_or_default();
        let name = format!("{kind} {folder}{name}");
        let declared = between(&page, "<pre class=\"rust item-decl\">", "</pre>").next();
        lines.push(format!("{name}: {}\n", plain(declared.unwrap_or_default())));
        // What the language gives to every type is nobody's promise here.
        let own = page.split("id=\"blanket-implementations\"").next().unwrap_or_default();
        let own = own.split("id=\"synthetic-implementations\"").next().unwrap_or_default();
        lines.extend(parts(own).map(|(id, signature)| format!("{name} {id}: {signature}\n")));
    }
    ensure!(!lines.is_empty(), "{} lists no items", documentation.display());
    lines.sort();
    lines.dedup();
    write(&directory.join("names.txt"), lines.concat())
}

fn read(path: &Path) -> Result<String> {
    fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))
}

/// Ids and signatures of the parts of an item's page.
fn parts(page: &str) -> impl Iterator<Item = (&str, String)> {
    page.split(" id=\"").skip(1).filter_map(|rest| {
        let (id, rest) = rest.split_once('"')?;
        let is_part = PARTS.iter().any(|part| id.starts_with(part)) && !id.ends_with(".fields");
        let (head, end) = match id.starts_with("structfield.") || id.contains(".field.") {
            true => ("<code>", "</code>"),
            false => ("class=\"code-header\">", "</h"),
        };
        is_part.then(|| (id, plain(between(rest, head, end).next().unwrap_or_default())))
    })
}

/// What stands between a head and an end, each time.
fn between<'a>(text: &'a str, head: &'a str, end: &'a str) -> impl Iterator<Item = &'a str> {
    text.split(head).skip(1).map(move |rest| rest.split(end).next().unwrap_or_default())
}

/// The text of HTML on one line.
fn plain(html: &str) -> String {
    let mut text = String::new();
    for (nth, part) in html.split('<').enumerate() {
        text.push_str(if nth == 0 { part } else { part.split_once('>').map_or("", |(_, text)| text) });
    }
    let signs =
        [("&lt;", "<"), ("&gt;", ">"), ("&#39;", "'"), ("&quot;", "\""), ("&nbsp;", " "), ("&amp;", "&")];
    let text = signs.iter().fold(text, |text, (code, sign)| text.replace(code, sign));
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_items_page_gives_its_parts_with_their_signatures() {
        let page = "<section id=\"method.add\" class=\"method\"><h4 class=\"code-header\">pub fn <a>add</a>(&amp;self) -&gt; \
                    Option&lt;u8&gt;</h4></section><span id=\"structfield.x\"><code>x: <a>u8</a></code></span> id=\"other\"";
        let parts: Vec<_> = parts(page).collect();
        let expected = [("method.add", "pub fn add(&self) -> Option<u8>"), ("structfield.x", "x: u8")];
        assert_eq!(parts, expected.map(|(id, signature)| (id, signature.to_owned())));
    }
}
