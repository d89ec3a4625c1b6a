//! Bands of TIFF files that have more than a picture: what `--layer NAME:bands=5,4,3` asks of such a file is
//! opened as `FILE:bands=5,4,3`, since a layer has four channels at most.

use std::path::{Path, PathBuf};

#[cfg(feature = "build")]
use anyhow::{Result, bail};
#[cfg(feature = "build")]
use vastex_viewer::{Bands, LayerOptions};

#[cfg(feature = "build")]
use crate::args::SceneArgs;

/// The path by which bands of a file are opened, counted from 1.
pub(crate) fn path_of(file: &Path, bands: &[u16]) -> PathBuf {
    let words: Vec<String> = bands.iter().map(ToString::to_string).collect();
    let mut path = file.as_os_str().to_owned();
    path.push(":bands=");
    path.push(words.join(","));
    path.into()
}

/// The file of which a path names the first image, or bands of it as [`path_of`] writes it; any other path is
/// given back.
pub(crate) fn file_of_first_image(path: &Path) -> &Path {
    #[cfg(feature = "build")]
    if let Some((file, name)) = vastex_build::image_in_file(path)
        && vastex_build::means_first_image(name)
    {
        return file;
    }
    path
}

/// Returns true if two paths mean the first image of one file, and one of them names it, or bands of it: they
/// are seen where the other is.
#[cfg(feature = "view")]
pub(crate) fn are_of_first_image(path: &Path, shown: &Path) -> bool {
    [path, shown].into_iter().any(|path| file_of_first_image(path) != path) && is_same_file(path, shown)
}

/// Returns true if both paths are one, however they are written, and whichever bands of the file they name.
#[cfg(feature = "view")]
pub(crate) fn is_same_file(path: &Path, other: &Path) -> bool {
    let [path, other] = [path, other].map(|path| std::path::absolute(file_of_first_image(path)));
    matches!((path, other), (Ok(path), Ok(other)) if path == other)
}

/// Has the bands that layers are told opened, of files that have more than a layer can.
#[cfg(feature = "build")]
pub(crate) fn pick(scene: &mut SceneArgs) -> Result<()> {
    let files = std::iter::once(&mut scene.source).chain(&mut scene.layers.over);
    for (texture, file) in files.enumerate() {
        let asked = scene.layers.layers.iter_mut().filter(|layer| layer.texture == texture);
        let asked: Vec<_> = asked.filter(|layer| layer.bands != Bands::AsStored).collect();
        let Some(first) = asked.first().map(|layer| layer.bands) else { continue };
        let are_chosen = vastex_build::image_in_file(file)
            .is_some_and(|(_, name)| vastex_build::bands_in_name(name).is_some());
        if are_chosen || vastex_build::bands_to_choose(file).is_none() {
            if !are_chosen && let Some(has) = bands_of(file) {
                check_within(file, &asked, has)?;
            }
            continue;
        }
        let image = file_of_first_image(file).to_owned();
        if asked.iter().any(|layer| layer.bands != first) {
            bail!(
                "{}: two layers ask for different bands of it; lay the file over itself for the others: --over {0}:bands=5,4,3",
                image.display()
            );
        }
        *file = match first {
            Bands::AsStored => continue,
            Bands::One(band) => path_of(&image, &[u16::from(band) + 1]),
            Bands::Color(bands) => path_of(&image, &bands.map(|band| u16::from(band) + 1)),
        };
        asked.into_iter().for_each(|layer| layer.bands = Bands::AsStored);
    }
    Ok(())
}

/// How many bands an image has, if it is one; an alpha that is made for it is none.
#[cfg(feature = "build")]
fn bands_of(file: &Path) -> Option<usize> {
    if super::what_lies_at(file).ok()? != super::Lies::Other || !super::file_of(file).is_file() {
        return None;
    }
    vastex_build::open(file).ok().map(|image| image.header().format.channels().into())
}

/// Fails where a layer asks for a band that the file has not.
#[cfg(feature = "build")]
fn check_within(file: &Path, asked: &[&mut LayerOptions], has: usize) -> Result<()> {
    match asked.iter().find(|layer| !layer.bands.are_within(has)) {
        Some(layer) => {
            bail!("{}: has no bands '{}'; it has {has}, counted from 1", file.display(), layer.bands)
        }
        None => Ok(()),
    }
}

#[cfg(all(test, feature = "view"))]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_the_same_however_its_path_is_written() {
        let here = std::env::current_dir().unwrap();
        assert!(is_same_file(Path::new("a.tif"), Path::new("./a.tif")));
        assert!(is_same_file(&here.join("a.tif"), Path::new("a.tif")));
        assert!(!is_same_file(Path::new("a.tif"), Path::new("b/a.tif")));
    }

    /// Shapes lie over a file whichever bands of it a person chooses.
    #[cfg(feature = "build")]
    #[test]
    fn bands_of_a_file_are_the_same_file() {
        let directory = tempfile::tempdir().unwrap();
        let file = directory.path().join("a.tif");
        std::fs::write(&file, "").unwrap();
        let named = |name: &str| PathBuf::from(format!("{}:{name}", file.display()));
        assert!(is_same_file(&named("bands=5,4,3"), &file));
        assert!(is_same_file(&named("bands=1"), &named("bands=2")));
        assert!(!is_same_file(&named("label"), &file));
        // The camera stays where the image is the same.
        for (path, shown, stays) in [
            ("bands=5,4,3", "bands=1", true),
            ("bands=1", "first", true),
            ("first", "bands=1", true),
            ("first", "label", false),
            ("bands=1", "label", false),
            ("label", "first", false),
            ("label", "label", false),
        ] {
            assert_eq!(are_of_first_image(&named(path), &named(shown)), stays, "{path} after {shown}");
        }
        assert!(are_of_first_image(&named("first"), &file) && are_of_first_image(&file, &named("bands=1")));
        assert!(!are_of_first_image(&file, &named("label")) && !are_of_first_image(&file, &file));
        assert!(!are_of_first_image(&directory.path().join("b.tif:first"), &file));
    }
}
