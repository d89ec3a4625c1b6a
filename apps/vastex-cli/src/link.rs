//! Sources as links name them: wherever a link is opened, it is the same file.

use std::path::Path;

use anyhow::{Result, anyhow};
use vastex_viewer::Link;

use crate::args::PLANET;

/// A link to a source, the files beside it, and what is shown of them. Relative paths are made absolute.
pub(crate) fn link_of<'a>(
    source: &Path,
    files: impl IntoIterator<Item = &'a Path>,
    view: Option<String>,
) -> Result<Link> {
    let files = files.into_iter().map(named).collect::<Result<_>>()?;
    Ok(Link { source: named(source)?, files, view })
}

/// How a link names a source.
fn named(source: &Path) -> Result<String> {
    let text = source.to_str().ok_or_else(|| {
        anyhow!("{}: a link names files by text, and this name is none; rename the file", source.display())
    })?;
    if let Some(words) = text.strip_prefix(PLANET) {
        let (bits, image) = words.split_once(':').map_or((words, None), |(bits, image)| (bits, Some(image)));
        let image = image.map(|image| named(Path::new(image))).transpose()?;
        return Ok(format!("{PLANET}{bits}{}", image.map(|image| format!(":{image}")).unwrap_or_default()));
    }
    // The address of something is no path.
    if text.split_once("://").is_some_and(|(scheme, _)| is_scheme(scheme)) {
        return Ok(text.to_owned());
    }
    let absolute = std::path::absolute(source)?;
    Ok(absolute.to_str().unwrap_or(text).to_owned())
}

fn is_scheme(text: &str) -> bool {
    text.len() > 1 && text.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"+-.".contains(&byte))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_made_absolute_and_nothing_else_is() {
        let here = std::env::current_dir().unwrap().to_str().unwrap().to_owned();
        let files = ["b.svs:label", "planet:20", "planet:20:e.jpg"].map(Path::new);
        let link = link_of(Path::new("a b.tif"), files, None).unwrap();
        assert_eq!(link.source, format!("{here}/a b.tif"));
        assert_eq!(
            link.files,
            [format!("{here}/b.svs:label"), "planet:20".into(), format!("planet:20:{here}/e.jpg")]
        );
        for same in ["/data/a.tif", "https://example.org/a.vastex"] {
            assert_eq!(named(Path::new(same)).unwrap(), same);
        }
    }
}
