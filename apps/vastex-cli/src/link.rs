//! Sources as links name them: wherever a link is opened, it is the same file; and other windows, in which
//! links are opened.

use std::io::IsTerminal;
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

/// Opens another window: with what a link names, or with nothing. The flag beside the link says that it is of
/// the source of these arguments, whose shapes and origins then are its own, too.
pub(crate) fn open_window(link: Option<(&str, bool)>, args: &ViewArgs) -> Result<()> {
    let program = std::env::current_exe().context("the program does not know where it lies")?;
    let started = another(&program, link, args).spawn();
    let mut window = started.with_context(|| program.display().to_string())?;
    // Nothing of it stays when it has ended.
    drop(thread::Builder::new().name("vastex-window".into()).spawn(move || window.wait()));
    Ok(())
}

/// What starts the program with another window. It keeps files where this one does, and has the settings and
/// the memory for tiles that this one was given; of the same source it is told what this one was.
fn another(program: &Path, link: Option<(&str, bool)>, args: &ViewArgs) -> Command {
    let mut command = Command::new(program);
    command.arg("view").args(link.map(|(link, _)| link));
    // A script that reads what this one prints does not wait for the other.
    command.stdin(Stdio::null()).stdout(Stdio::null());
    if !std::io::stderr().is_terminal() {
        command.stderr(Stdio::null());
    }
    // What ends this one at its terminal leaves the other alone.
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(&mut command, 0);
    if let (Some((_, true)), Some(shapes)) = (link, &args.shapes) {
        command.arg("--shapes").arg(shapes);
    }
    for settings in &args.scene.settings {
        command.arg("--settings").arg(settings);
    }
    if let Some(mib) = args.scene.pool_mib {
        command.arg("--pool-mib").arg(mib.to_string());
    }
    let (cache, disk) = (&args.scene.cache, &args.scene.disk_cache);
    command.arg("--cache-gib").arg(cache.cache_gib.to_string());
    if let Some(place) = &cache.cache {
        command.arg("--cache").arg(place);
    }
    if let Some(place) = &disk.disk_cache {
        command.arg("--disk-cache").arg(place).arg("--disk-cache-mib").arg(disk.disk_cache_mib.to_string());
    }
    #[cfg(feature = "volumes")]
    if let (Some((_, true)), Some(name)) = (link, args.volume.origins.name()) {
        command.arg("--origins").arg(name);
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
    fn another_window_opens_the_link_and_is_set_as_this_one_is() {
        let cache = ["--cache", "off", "--disk-cache", "tiles", "--disk-cache-mib", "7"];
        let set =
            ["--settings", "a.toml", "--settings", "b.toml", "--pool-mib", "90", "--shapes", "a.geojson"];
        let args = asked(&[&["vastex", "view", "a.tif"][..], &cache, &set].concat());
        let words = |link| {
            let command = another(Path::new("/bin/vastex"), link, &args);
            let words = command.get_args().map(|word| word.to_string_lossy().into_owned());
            std::iter::once("vastex".to_owned()).chain(words).collect::<Vec<_>>()
        };
        let link = "vastex:/data/a b.tif?view=image:x=1,y=2,zoom=3";
        let opened = |has_shapes| {
            let words = words(Some((link, has_shapes)));
            asked(&words.iter().map(String::as_str).collect::<Vec<_>>())
        };
        let same = opened(true);
        assert_eq!(same.scene.source, Path::new(link));
        assert_eq!(same.scene.cache.cache.as_deref(), Some(Path::new("off")));
        assert_eq!(same.scene.disk_cache.disk_cache.as_deref(), Some(Path::new("tiles")));
        assert_eq!(same.scene.disk_cache.disk_cache_mib, 7);
        assert_eq!((&same.scene.settings, same.scene.pool_mib), (&args.scene.settings, Some(90)));
        assert_eq!(same.shapes.as_deref(), Some(Path::new("a.geojson")));
        assert_eq!(opened(false).shapes, None, "they are of another file");
        assert_eq!(words(None)[..2], ["vastex", "view"]);
        assert!(words(None)[2].starts_with("--") && !words(None).contains(&"--shapes".into()), "no file");
    }

    /// A shell that is told `view` reads a script of this name, which says of itself where it writes and
    /// which group it belongs to.
    #[cfg(target_os = "linux")]
    #[test]
    fn another_window_keeps_no_pipe_and_does_not_end_with_this_one() {
        let directory = tempfile::tempdir().unwrap();
        let says =
            "readlink /proc/$$/fd/1 /proc/$$/fd/2 | cat > said; echo $$ >> said; cat /proc/$$/stat >> said";
        std::fs::write(directory.path().join("view"), says).unwrap();
        let mut window = another(Path::new("/bin/sh"), None, &asked(&["vastex", "view", "a.tif"]));
        assert!(window.current_dir(&directory).status().unwrap().success());
        let said = std::fs::read_to_string(directory.path().join("said")).unwrap();
        let said: Vec<&str> = said.lines().collect();
        assert_eq!(said[0], "/dev/null");
        assert!(said[1] == "/dev/null" || std::io::stderr().is_terminal(), "{said:?}");
        let stat: Vec<&str> = said[3].split(' ').collect();
        assert_eq!((stat[0], stat[4]), (said[2], said[2]), "it leads a group of its own");
    }

    /// Of the source alone: of another volume nobody has said it.
    #[cfg(feature = "volumes")]
    #[test]
    fn another_window_of_the_source_is_told_what_its_translations_are_of() {
        let args = asked(&["vastex", "view", "/data/a.zarr", "--origins", "corner"]);
        for (link, is_told) in [
            (Some(("vastex:/data/a.zarr?view=volume:x=1,y=2,z=3,zoom=1", true)), true),
            (Some(("vastex:/data/b.zarr", false)), false),
            (None, false),
        ] {
            let command = another(Path::new("/bin/vastex"), link, &args);
            let words: Vec<_> = command.get_args().collect();
            assert_eq!(words.ends_with(&["--origins".as_ref(), "corner".as_ref()]), is_told, "{words:?}");
        }
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
