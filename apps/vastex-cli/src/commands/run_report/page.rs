//! The page of a run as HTML: one file with its pictures in it, which opens from a disk and asks for nothing
//! else.

/// What stands on the page.
pub(super) struct Page {
    /// What was drawn.
    pub(super) title: String,
    /// In a few words, each with what it is about.
    pub(super) chips: Vec<(String, String)>,
    /// What went wrong, and what to do.
    pub(super) warnings: Vec<String>,
    /// The last picture, as PNG.
    pub(super) picture: Vec<u8>,
    /// Graphs as HTML.
    pub(super) graphs: String,
    /// Overlays with their names and what they tell, as PNG.
    pub(super) overlays: Vec<(String, String, Vec<u8>)>,
    /// Tables: their names, and rows of names and values.
    pub(super) tables: Vec<(String, Vec<(String, String)>)>,
    /// What the program said at the end.
    pub(super) said: String,
}

const STYLE: &str = include_str!("page.css");

/// What tells a report from another page.
pub(super) const MARK: &str = "<meta name=\"generator\" content=\"vastex render --report\">";

impl Page {
    pub(super) fn html(&self) -> String {
        let mut html = String::with_capacity(self.picture.len() * 8);
        let title = escaped(&self.title);
        html += &format!(
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" content=\"width=device-width\">\n\
             {MARK}\n<title>{title} - vastex</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n<header>\n<h1>{title}</h1>\n<div class=\"chips\">"
        );
        for (name, value) in &self.chips {
            html += &format!("<span><small>{}</small>{}</span>", escaped(name), escaped(value));
        }
        html += "</div>\n</header>\n<main>\n";
        for warning in &self.warnings {
            html += &format!("<p class=\"warning\" role=\"alert\">{}</p>\n", escaped(warning));
        }
        if self.warnings.is_empty() {
            html += "<p class=\"fine\">No warnings: nothing failed, and no pool was too small.</p>\n";
        }
        html += &format!(
            "<figure class=\"picture\">{}<figcaption>The last picture.</figcaption></figure>\n",
            image(&self.picture, "the last picture")
        );
        html += &format!("<h2>Frame by frame</h2>\n<div class=\"graphs\">\n{}</div>\n", self.graphs);
        if !self.overlays.is_empty() {
            html += "<h2>What the picture is made of</h2>\n";
        }
        html += "<div class=\"overlays\">\n";
        for (name, about, picture) in &self.overlays {
            html += &format!(
                "<figure>{}<figcaption><b>{}</b> {}</figcaption></figure>\n",
                image(picture, name),
                escaped(name),
                escaped(about)
            );
        }
        html += "</div>\n<div class=\"tables\">\n";
        for (name, rows) in &self.tables {
            html += &format!("<section>\n<h2>{}</h2>\n<table>\n", escaped(name));
            for (name, value) in rows {
                html += &format!("<tr><th>{}</th><td>{}</td></tr>\n", escaped(name), escaped(value));
            }
            html += "</table>\n</section>\n";
        }
        html += &format!(
            "</div>\n<h2>In the program's words</h2>\n<pre>{}</pre>\n</main>\n</body>\n</html>\n",
            escaped(&self.said)
        );
        html
    }
}

fn image(png: &[u8], about: &str) -> String {
    format!("<img alt=\"{}\" src=\"data:image/png;base64,{}\">", escaped(about), base64(png))
}

/// A text as it stands in HTML.
pub(super) fn escaped(text: &str) -> String {
    let mut html = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => html += "&amp;",
            '<' => html += "&lt;",
            '>' => html += "&gt;",
            '"' => html += "&quot;",
            character => html.push(character),
        }
    }
    html
}

/// Bytes as text, six bits a letter (RFC 4648).
fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for three in bytes.chunks(3) {
        let [a, b, c] = std::array::from_fn(|n| three.get(n).copied().unwrap_or(0));
        let word = u32::from_be_bytes([0, a, b, c]);
        for n in 0..4 {
            let letter = LETTERS[(word >> (18 - 6 * n) & 63) as usize];
            text.push(if n > three.len() { '=' } else { char::from(letter) });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_the_letters_of_the_standard() {
        let words = ["", "f", "fo", "foo", "foob", "fooba", "foobar"];
        let texts = words.map(|word| base64(word.as_bytes()));
        assert_eq!(texts, ["", "Zg==", "Zm8=", "Zm9v", "Zm9vYg==", "Zm9vYmE=", "Zm9vYmFy"]);
        assert_eq!(base64(&[0xfb, 0xff, 0xbf]), "+/+/");
    }

    #[test]
    fn a_page_is_whole_and_asks_for_nothing() {
        let page = Page {
            title: "<script>".into(),
            chips: vec![("frames".into(), "7".into())],
            warnings: vec!["too small & coarse".into()],
            picture: vec![1, 2, 3],
            graphs: "<svg></svg>".into(),
            overlays: vec![("levels".into(), "about".into(), vec![4])],
            tables: vec![("Source".into(), vec![("size".into(), "1x1".into())])],
            said: "a < b".into(),
        };
        let html = page.html();
        assert!(!html.contains("<script>") && html.contains("&lt;script&gt;"), "{html}");
        assert!(html.contains("too small &amp; coarse") && !html.contains("No warnings"));
        assert!(html.contains("data:image/png;base64,AQID") && html.contains("a &lt; b"));
        for outside in ["http://", "https://", "src=\"/", "@import", "url("] {
            assert!(!html.contains(outside), "{outside}");
        }
        for tag in ["html", "head", "body", "main", "header", "figure", "section", "table", "style", "pre"] {
            let (begins, ends) =
                (html.matches(&format!("<{tag}")).count(), html.matches(&format!("</{tag}>")).count());
            let begins = if tag == "head" { begins - html.matches("<header").count() } else { begins };
            assert_eq!(begins, ends, "{tag}");
        }
    }
}
