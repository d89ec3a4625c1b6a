//! Sources as links name them: wherever a link is opened, it is the same file; and other windows, in which
//! links are opened.

use std::path::Path;
use std::process::{Command, Stdio};
use std::thread;

use anyhow::{Context, Result, anyhow};
use vastex_viewer::Link;

use crate::args::{PLANET, ViewArgs};

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

/// Opens another window, with what a link names or with nothing. It is a program of its own, and goes on when
/// this one ends.
pub(crate) fn open_window(link: Option<&str>, args: &ViewArgs) -> Result<()> {
    let program = std::env::current_exe().context("the program does not know where it lies")?;
    let started = another(&program, link, args).spawn();
    let mut window = started.with_context(|| program.display().to_string())?;
    // Nothing of it stays when it has ended.
    drop(thread::Builder::new().name("vastex-window".into()).spawn(move || window.wait()));
    Ok(())
}

/// What starts the program with another window, in which a link is opened, or nothing. It keeps files where
/// this one does.
fn another(program: &Path, link: Option<&str>, args: &ViewArgs) -> Command {
    let mut command = Command::new(program);
    // A script that reads what this one prints does not wait for the other.
    command.arg("view").args(link).stdin(Stdio::null()).stdout(Stdio::null());
    let (cache, disk) = (&args.scene.cache, &args.scene.disk_cache);
    command.arg("--cache-gib").arg(cache.cache_gib.to_string());
    if let Some(place) = &cache.cache {
        command.arg("--cache").arg(place);
    }
    if let Some(place) = &disk.disk_cache {
        command.arg("--disk-cache").arg(place).arg("--disk-cache-mib").arg(disk.disk_cache_mib.to_string());
    }
    command
}

#[cfg(test)]
mod tests {
    use clap::Parser as _;

    use super::*;
    use crate::args::{Args, Command as Asked};

    fn asked(words: &[&str]) -> ViewArgs {
        let Asked::View(args) = Args::parse_from(words).command else { panic!("{words:?}") };
        *args
    }

    #[test]
    fn another_window_opens_the_link_and_keeps_files_where_this_one_does() {
        let cache = ["--cache", "off", "--disk-cache", "tiles", "--disk-cache-mib", "7"];
        let args = asked(&[&["vastex", "view", "a.tif"][..], &cache].concat());
        let words = |link| {
            let command = another(Path::new("/bin/vastex"), link, &args);
            let words = command.get_args().map(|word| word.to_string_lossy().into_owned());
            std::iter::once("vastex".to_owned()).chain(words).collect::<Vec<_>>()
        };
        let link = "vastex:/data/a b.tif?view=image:x=1,y=2,zoom=3";
        let same = words(Some(link));
        let same = asked(&same.iter().map(String::as_str).collect::<Vec<_>>());
        assert_eq!(same.scene.source, Path::new(link));
        assert_eq!(same.scene.cache.cache.as_deref(), Some(Path::new("off")));
        assert_eq!(same.scene.disk_cache.disk_cache.as_deref(), Some(Path::new("tiles")));
        assert_eq!(same.scene.disk_cache.disk_cache_mib, 7);
        assert_eq!(words(None)[..2], ["vastex", "view"]);
        assert!(words(None)[2].starts_with("--"), "no file");
    }

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
