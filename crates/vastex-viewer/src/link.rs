//! What is shown, with the files that it is shown of, as one line that can be sent and opened: a link.
//!
//! `vastex:/data/earth.jpg?file=/data/height.png&view=globe:lon=9,lat=36,alt=9000000m;on=planet;height=:file=2`
//!
//! After `vastex:` stands the source, a path or whatever else a source may be called; after a question mark
//! the query, as a browser has it: `file=` for each further file, in the order in which views count them (the
//! source is 1, the first of these 2), and `view=` with the text of a view. What is no plain letter, digit or
//! one of a few signs is written by the codes of its UTF-8, `%20`. In the query a plus sign is a space.

use std::fmt;
use std::str::FromStr;

use crate::view_text::{ViewText, ViewTextError, VolumeViewError, VolumeViewText};

/// What a link begins with.
pub const SCHEME: &str = "vastex:";

/// Files beside the source that a link names at most: eight layers, and heights.
pub const MOST_FILES: usize = 8;
/// Bytes of a link at most.
const MOST_BYTES: usize = 1 << 16;

/// A source, the files beside it, and the view in which they are shown.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Link {
    /// The source, as a command line has it.
    pub source: String,
    /// Further files, in the order in which a view counts them after the source.
    pub files: Vec<String>,
    /// The text of the view ([`ViewText`], of a volume [`VolumeViewText`]).
    pub view: Option<String>,
}

/// A text is no link.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LinkError {
    /// The text does not begin as a link.
    #[error("a link begins with {SCHEME}, as in vastex:earth.tif?view=image:x=1,y=2,zoom=3")]
    Scheme,
    /// The text is longer than any link that is written.
    #[error("a link has 65,536 bytes at most, this one {0}")]
    TooLong(usize),
    /// The link names no source.
    #[error("the link names no file; write one after {SCHEME}, as in vastex:earth.tif")]
    NoSource,
    /// A percent sign begins no code.
    #[error("'{0}' is no code of a character; a percent sign itself is written %25")]
    Code(String),
    /// The codes are of no text, or of a character that no name has.
    #[error("'{0}' is no text by its codes, which are those of UTF-8 without the zero")]
    NoText(String),
    /// There is a fragment.
    #[error("'{0}' means nothing in a link; a # in a name is written %23")]
    Fragment(String),
    /// The query has a key that there is not.
    #[error(
        "'{0}' is no part of a link; there are file=FILE, once for each file beside the first, and view=VIEW, each after a ? or &"
    )]
    Key(String),
    /// There are two views.
    #[error("view is told twice in the link")]
    TwoViews,
    /// There are too many files.
    #[error("the link names more than {MOST_FILES} files beside its first")]
    Files,
    /// The view cannot be read.
    #[error(transparent)]
    View(#[from] ViewTextError),
    /// The view of a volume cannot be read.
    #[error(transparent)]
    VolumeView(#[from] VolumeViewError),
    /// The view is of a file that the link does not name.
    #[error("the view is of file {number}, and the link names {count}; file=FILE names another")]
    FileOfView {
        /// Which one, counted from 1.
        number: usize,
        /// Files of the link.
        count: usize,
    },
}

impl Link {
    /// Returns true if a text is meant as a link, sound or not.
    pub fn is_link(text: &str) -> bool {
        let begin = text.trim_start().as_bytes().get(..SCHEME.len());
        begin.is_some_and(|begin| begin.eq_ignore_ascii_case(SCHEME.as_bytes()))
    }
}

impl fmt::Display for Link {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{SCHEME}{}", coded(&self.source))?;
        let files = self.files.iter().map(|file| ("file", file));
        let parts = files.chain(self.view.as_ref().map(|view| ("view", view)));
        for (n, (key, value)) in parts.enumerate() {
            write!(f, "{}{key}={}", if n == 0 { '?' } else { '&' }, coded(value))?;
        }
        Ok(())
    }
}

impl FromStr for Link {
    type Err = LinkError;

    fn from_str(text: &str) -> Result<Link, LinkError> {
        let text = text.trim();
        if !Link::is_link(text) {
            return Err(LinkError::Scheme);
        }
        if text.len() > MOST_BYTES {
            return Err(LinkError::TooLong(text.len()));
        }
        if let Some((_, fragment)) = text.split_once('#') {
            return Err(LinkError::Fragment(shortened(&format!("#{fragment}"))));
        }
        let (source, query) = text[SCHEME.len()..].split_once('?').unwrap_or((&text[SCHEME.len()..], ""));
        let mut link = Link { source: decoded(source, false)?, ..Link::default() };
        if link.source.is_empty() {
            return Err(LinkError::NoSource);
        }
        for part in query.split('&').filter(|part| !part.is_empty()) {
            let (key, value) = part.split_once('=').unwrap_or((part, ""));
            let value = decoded(value, true)?;
            match key {
                "file" if value.is_empty() => return Err(LinkError::NoSource),
                "file" if link.files.len() == MOST_FILES => return Err(LinkError::Files),
                "file" => link.files.push(value),
                "view" if link.view.is_some() => return Err(LinkError::TwoViews),
                "view" => link.view = Some(value),
                _ => return Err(LinkError::Key(shortened(part))),
            }
        }
        if let Some(view) = link.view.as_deref().filter(|view| VolumeViewText::is_meant(view)) {
            view.parse::<VolumeViewText>()?;
        } else if let Some(view) = &link.view {
            // An image's size does not decide whether a view can be read.
            let view = ViewText::from_text(view, [1; 2])?;
            let count = 1 + link.files.len();
            if let Some(texture) = view.textures().find(|texture| *texture >= count) {
                return Err(LinkError::FileOfView { number: texture + 1, count });
            }
        }
        Ok(link)
    }
}

/// A text by letters, digits and signs that mean nothing in a link, and codes.
fn coded(text: &str) -> String {
    let mut coded = String::with_capacity(text.len());
    for byte in text.bytes() {
        if byte.is_ascii_alphanumeric() || b"-._~/:,;=@".contains(&byte) {
            coded.push(byte.into());
        } else {
            coded += &format!("%{byte:02X}");
        }
    }
    coded
}

/// The text of a part of a link.
fn decoded(part: &str, plus_is_space: bool) -> Result<String, LinkError> {
    let mut bytes = Vec::with_capacity(part.len());
    let mut rest = part.as_bytes();
    while let [first, after @ ..] = rest {
        rest = after;
        match first {
            b'%' => {
                let code = after.get(..2).and_then(|digits| std::str::from_utf8(digits).ok());
                let code = code.filter(|code| code.bytes().all(|digit| digit.is_ascii_hexdigit()));
                let code = code.and_then(|code| u8::from_str_radix(code, 16).ok());
                let wrong = || {
                    let begin = String::from_utf8_lossy(&after[..after.len().min(2)]);
                    LinkError::Code(format!("%{begin}"))
                };
                bytes.push(code.ok_or_else(wrong)?);
                rest = &after[2..];
            }
            b'+' if plus_is_space => bytes.push(b' '),
            byte => bytes.push(*byte),
        }
    }
    let text = String::from_utf8(bytes).ok().filter(|text| !text.contains('\0'));
    text.ok_or_else(|| LinkError::NoText(shortened(part)))
}

/// The beginning of a text, so that no message is as long as a link may be.
fn shortened(text: &str) -> String {
    const MOST: usize = 80;
    match text.char_indices().nth(MOST) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers by chance, the same each time.
    struct Chance(u64);

    impl Chance {
        fn below(&mut self, n: usize) -> usize {
            self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            ((mixed >> 11) % n as u64) as usize
        }

        fn text(&mut self, of: &[char], most: usize) -> String {
            (0..self.below(most)).map(|_| of[self.below(of.len())]).collect()
        }
    }

    const SIGNS: [char; 24] = [
        'a', 'Z', '7', '/', '\\', ':', '?', '&', '=', '#', '%', '+', ' ', ';', ',', '\'', '"', 'ä', '世',
        '🌍', '\n', '.', '~', '\u{1}',
    ];

    #[test]
    fn links_by_chance_are_what_their_texts_say() {
        let mut chance = Chance(23);
        let views = [
            "image:x=1,y=2,zoom=3;layer=H%C3%B6he%20%3A:file=2",
            "globe:lon=9,lat=36,alt=1000m,heading=20;on=planet;layer=;sun=-52,14;clouds=:file=2:opacity=0.5",
            "plane:x=0,y=0,z=1,yaw=0,pitch=0;on=terrain",
            "volume:x=1,y=2,z=3,zoom=1,yaw=0,pitch=0;mode=mip;channel=0:map=viridis_r;labels=a%3Ab",
        ];
        for _ in 0..2000 {
            let file = |chance: &mut Chance| format!("f{}", chance.text(&SIGNS, 30));
            let link = Link {
                source: file(&mut chance),
                files: (0..1 + chance.below(MOST_FILES)).map(|_| file(&mut chance)).collect(),
                view: views.get(chance.below(5)).map(|view| (*view).to_owned()),
            };
            let text = link.to_string();
            assert!(text.bytes().all(|byte| byte.is_ascii_graphic()), "{text}");
            assert_eq!(text.parse::<Link>().as_ref(), Ok(&link), "{text}");
            assert_eq!(format!(" {text}\n").parse(), Ok(link), "what is copied may have an end of line");
        }
    }

    #[test]
    fn a_link_is_as_it_is_documented() {
        let link = Link {
            source: "/data/my earth.jpg".into(),
            files: vec!["https://example.org/a?b&c".into(), "C:\\x+1.png".into()],
            view: Some("globe:lon=9,lat=36,alt=9m;on=planet;height=:file=2".into()),
        };
        assert_eq!(
            link.to_string(),
            "vastex:/data/my%20earth.jpg?file=https://example.org/a%3Fb%26c&file=C:%5Cx%2B1.png\
             &view=globe:lon=9,lat=36,alt=9m;on=planet;height=:file=2"
        );
        let written = "VASTEX:a+b.tif?file=c+d.tif&view=image%3Ax%3D1%2Cy%3D2%2Czoom%3D3";
        let read: Link = written.parse().unwrap();
        assert_eq!((&*read.source, &*read.files[0]), ("a+b.tif", "c d.tif"), "as browsers read a query");
        assert_eq!(read.view.as_deref(), Some("image:x=1,y=2,zoom=3"));
    }

    #[test]
    fn what_is_no_link_is_told_why() {
        for (text, why) in [
            ("", "begins with vastex:"),
            ("https://example.org", "begins with vastex:"),
            ("vastex:", "names no file"),
            ("vastex:?view=a", "names no file"),
            ("vastex:a?file=", "names no file"),
            ("vastex:a%2", "'%2' is no code"),
            ("vastex:a%zz.tif", "'%zz' is no code"),
            ("vastex:a%+1", "'%+1' is no code"),
            ("vastex:a%ff", "no text by its codes"),
            ("vastex:a%00", "no text by its codes"),
            ("vastex:a?view=image:x=1,y=2,zoom=3#b", "%23"),
            ("vastex:a?veiw=b", "'veiw=b' is no part of a link; there are file=FILE"),
            ("vastex:a?view=image:x=1,y=2,zoom=3&view=b", "told twice"),
            ("vastex:a?view=moon", "'moon' is no view"),
            ("vastex:a?view=volume:x=1", "no part of a view of a volume"),
            ("vastex:a?view=image:x=1,y=2,zoom=3;layer=:file=2", "of file 2, and the link names 1"),
            (&*format!("vastex:a?{}", "file=b&".repeat(9)), "more than 8 files"),
            (&*format!("vastex:{}", "a".repeat(70_000)), "65,536 bytes at most"),
        ] {
            let error = text.parse::<Link>().unwrap_err().to_string();
            assert!(error.contains(why), "{text}: {error}");
            assert!(error.len() < 2000, "{error}");
        }
    }

    #[test]
    fn nothing_that_is_written_ends_the_program() {
        let mut chance = Chance(5);
        let words = [
            "vastex:",
            "?",
            "&",
            "file=",
            "view=",
            "image:",
            "globe:lon=",
            "x=1,",
            "zoom=",
            "%",
            "%4",
            "%C3",
            "%00",
            ";",
            "layer=",
            ":file=",
            "99999999999999999999",
            "nan",
            "inf",
            "-",
            "=",
            "on=planet",
            "sun=",
            "compare=swipe:",
            "night=",
            "height=",
            "1e400",
            "ä",
            "\0",
            "\u{feff}",
            "#",
            "+",
            ",",
            "m",
        ];
        let (mut sound, mut hostile) = (0, 0);
        for _ in 0..20_000 {
            let mut text = String::from("vastex:");
            (0..chance.below(24)).for_each(|_| text += words[chance.below(words.len())]);
            match text.parse::<Link>() {
                Ok(link) => {
                    sound += 1;
                    assert_eq!(link.to_string().parse(), Ok(link), "{text}");
                }
                Err(error) => {
                    hostile += 1;
                    assert!(!error.to_string().is_empty());
                }
            }
        }
        assert!(sound > 100 && hostile > 1000, "{sound} {hostile}");
    }
}
