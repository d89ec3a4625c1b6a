//! Celestia's virtual textures: a `.ctx` file that tells of a directory
//! `level<i>/<prefix><column>_<row>.<type>`.

use std::collections::{BTreeMap, HashMap};
use std::path::Path;

use super::quadtree::Quadtree;
use super::{Source, entries, number};
use crate::image::{InputFault, Notice};

/// Texels per side of a tile: from what Celestia takes to what nobody cuts.
const SIDES: std::ops::RangeInclusive<u32> = 64..=16384;
/// Levels that Celestia looks for.
const LEVELS: u32 = 13;
/// The largest `BaseSplit`: every tile of the coarsest level must be there, and that one has 131,072 already.
const MAX_BASE: u32 = 8;

/// What a `.ctx` file says.
#[derive(Debug, PartialEq, Eq)]
struct Context {
    directory: String,
    base: u32,
    extension: String,
    prefix: String,
}

/// Returns true if a text is a `.ctx` file.
pub(super) fn is_context(text: &str) -> bool {
    tokens(text).next().is_some_and(|first| first == "VirtualTexture")
}

/// Lists the tiles of the directory that `text`, the content of the file `path`, names.
pub(super) fn open(path: &Path, text: &str) -> Result<Source, InputFault> {
    let context = parse(text)?;
    if !["jpg", "jpeg", "png"].contains(&context.extension.as_str()) {
        return Err(InputFault::Unsupported {
            what: format!("tiles of type '{}'", context.extension.escape_debug()),
            remedy: "convert the tiles to PNG or JPEG and say so under TileType",
        });
    }
    let directory = path.parent().unwrap_or(Path::new("")).join(&context.directory);
    let mut levels = BTreeMap::new();
    for level in 0..LEVELS {
        let path = directory.join(format!("level{level}"));
        if !path.is_dir() {
            continue;
        }
        let tiles: HashMap<_, _> =
            entries(&path)?.into_iter().filter_map(|path| Some((context.position(&path)?, path))).collect();
        if !tiles.is_empty() {
            levels.insert(level, tiles);
        }
    }
    let tree = Quadtree::new(&directory, levels, context.base, SIDES)?;
    let texels = tree.texels()?;
    let (grid, notices) = tree.into_grid(ignored_levels(&directory)?);
    Ok(Source { grid, directory, texels, wraps: true, notices })
}

/// Directories that are called like levels, but by names that Celestia does not look for.
fn ignored_levels(directory: &Path) -> Result<Vec<Notice>, InputFault> {
    let is_level = |name: &str| {
        let digits = name.strip_prefix("level").filter(|digits| number(digits).is_some());
        digits.is_some_and(|digits| (0..LEVELS).all(|level| level.to_string() != digits))
    };
    let directories = entries(directory)?.into_iter().filter(|path| path.is_dir());
    let names = directories.filter_map(|path| Some(path.file_name()?.to_str()?.to_owned()));
    Ok(names.filter(|name| is_level(name)).map(Notice::IgnoredLevel).collect())
}

impl Context {
    fn position(&self, path: &Path) -> Option<(u32, u32)> {
        let name = path.file_name()?.to_str()?;
        let stem = name.strip_suffix(&self.extension)?.strip_suffix('.')?;
        let (column, row) = stem.strip_prefix(&self.prefix)?.split_once('_')?;
        Some((number(column)?, number(row)?))
    }
}

fn parse(text: &str) -> Result<Context, InputFault> {
    let wrong = |why: String| InputFault::layout(why, "correct the .ctx file");
    let mut tokens = tokens(text).skip(1);
    if tokens.next() != Some("{") {
        return Err(wrong("has no '{' behind VirtualTexture".into()));
    }
    let mut values = HashMap::new();
    loop {
        match (tokens.next(), tokens.next()) {
            (Some("}"), _) => break,
            (Some(key), Some(value)) => {
                values.insert(key, value.trim_matches('"'));
            }
            _ => return Err(wrong("has no '}' at its end".into())),
        }
    }
    let directory = values.get("ImageDirectory").ok_or_else(|| wrong("names no ImageDirectory".into()))?;
    let base = values.get("BaseSplit").unwrap_or(&"0");
    let parsed = base.parse().ok().filter(|base| *base <= MAX_BASE);
    Ok(Context {
        directory: directory.to_string(),
        base: parsed.ok_or_else(|| {
            let base = base.escape_debug();
            wrong(format!(
                "has the BaseSplit '{base}'; 0 to {MAX_BASE} can be read, so give it coarser levels"
            ))
        })?,
        extension: values.get("TileType").unwrap_or(&"dds").to_string(),
        prefix: values.get("TilePrefix").unwrap_or(&"tx_").to_string(),
    })
}

/// Words, braces and quoted strings, the latter with their quotes; comments are passed over.
fn tokens(text: &str) -> impl Iterator<Item = &str> {
    let mut rest = text.trim_start_matches('\u{feff}');
    std::iter::from_fn(move || {
        rest = rest.trim_start();
        while rest.starts_with('#') {
            rest = rest.find('\n').map_or("", |end| &rest[end..]).trim_start();
        }
        let first = rest.chars().next()?;
        let end = match first {
            '{' | '}' => 1,
            '"' => rest[1..].find('"').map_or(rest.len(), |end| end + 2),
            _ => rest.find(|c: char| c.is_whitespace() || "{}\"#".contains(c)).unwrap_or(rest.len()),
        };
        let (token, after) = rest.split_at(end);
        rest = after;
        Some(token)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_context_with_comments_and_defaults() {
        let text = "# of old\nVirtualTexture\n{\n ImageDirectory \"a b\" # here\n BaseSplit 2\n TileSize 512\n TileType \"jpg\"}\n";
        assert!(is_context(text));
        let context =
            Context { directory: "a b".into(), base: 2, extension: "jpg".into(), prefix: "tx_".into() };
        assert_eq!(parse(text).unwrap(), context);
        assert_eq!(context.position(Path::new("tx_1_20.jpg")), Some((1, 20)));
        assert_eq!(context.position(Path::new("tx_1_20.png")), None);
        let bare = parse("VirtualTexture { ImageDirectory \"x\" TilePrefix \"t\" }").unwrap();
        assert_eq!((bare.base, bare.extension.as_str(), bare.prefix.as_str()), (0, "dds", "t"));
    }

    #[test]
    fn broken_contexts_say_what_is_wrong() {
        for (text, says) in [
            ("VirtualTexture", "no '{'"),
            ("VirtualTexture {", "no '}'"),
            ("VirtualTexture { ImageDirectory \"a", "no '}'"),
            ("VirtualTexture { BaseSplit 1 }", "names no ImageDirectory"),
            ("VirtualTexture { ImageDirectory \"a\" BaseSplit 9 }", "BaseSplit '9'; 0 to 8"),
            ("VirtualTexture { ImageDirectory \"a\" BaseSplit 99 }", "BaseSplit '99'; 0 to 8"),
            ("VirtualTexture { ImageDirectory \"a\" BaseSplit \"é\" }", "BaseSplit"),
        ] {
            let error = parse(text).unwrap_err().to_string();
            assert!(error.contains(says), "{error}");
        }
        assert!(!is_context("dear reader") && !is_context("") && !is_context("#"));
    }
}
