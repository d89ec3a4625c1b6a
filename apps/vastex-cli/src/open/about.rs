//! What a file says beside its texels, for the window: how large they are in the world, and which other
//! images it has.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use vastex_viewer::panels::{MapPlace, TexelSize};

use super::looked::Looked;

/// The bands of a file that has more than a picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct FileBands {
    /// The file alone.
    pub(crate) file: PathBuf,
    /// What each is called, its number first.
    pub(crate) names: Vec<String>,
    /// Those that are shown, counted from 1: one, or three.
    pub(crate) shown: Vec<u16>,
}

impl FileBands {
    /// The path that opens others of them.
    #[cfg(feature = "build")]
    pub(crate) fn path_of(&self, bands: &[u16]) -> PathBuf {
        super::bands::path_of(&self.file, bands)
    }

    /// Nothing is read that has bands.
    #[cfg(not(feature = "build"))]
    pub(crate) fn path_of(&self, _: &[u16]) -> PathBuf {
        self.file.clone()
    }

    /// Those of the source that a path names; `None` if there is nothing to choose.
    #[cfg(feature = "build")]
    fn of(path: &Path, tiff: &vastex_build::TiffDirectories) -> Option<FileBands> {
        let (file, name) =
            vastex_build::image_in_file(path).map_or((path, None), |(file, name)| (file, Some(name)));
        let shown = match name.map(|name| name.strip_prefix("bands=")) {
            None => Some(vec![1, 2, 3]),
            Some(words) => words?.split(',').map(|word| word.parse().ok()).collect(),
        };
        let (count, named) = (tiff.bands_to_choose()?, &tiff.about().bands);
        let name = |n: u16| match named.get(usize::from(n) - 1) {
            Some(Some(name)) => format!("{n} {name}"),
            _ => n.to_string(),
        };
        Some(FileBands { file: file.to_owned(), names: (1..=count).map(name).collect(), shown: shown? })
    }
}

/// What a file says beside its texels.
#[derive(Clone, Debug, Default)]
pub(crate) struct FileAbout {
    /// How large its texels are in the world, and how many times they were magnified: of TIFF of maps and
    /// slides.
    pub(crate) texel_size: Option<TexelSize>,
    /// Where it lies in its own coordinate system: of GeoTIFF.
    pub(crate) map: Option<MapPlace>,
    /// The images of a TIFF file, the first one before the others, if there are others; each with its name
    /// and the path that opens it.
    pub(crate) images: Vec<(String, PathBuf)>,
    /// Its bands, if it has more than a picture.
    pub(crate) bands: Option<FileBands>,
    /// What `vastex info` says of it: a name and a value each.
    pub(crate) rows: Arc<[(String, String)]>,
    /// True if it is a generated planet.
    pub(crate) is_generated: bool,
}

impl FileAbout {
    /// What is said of the source that a path names, which was looked at, beside what `vastex info` says of
    /// it.
    #[cfg(feature = "build")]
    pub(crate) fn of(path: &Path, looked: &Looked, rows: Vec<(String, String)>) -> FileAbout {
        let about =
            FileAbout { rows: rows.into(), is_generated: super::is_generated(path), ..FileAbout::default() };
        let Some(tiff) = looked.tiff(path) else { return about };
        let named = vastex_build::image_in_file(path);
        let file = named.map_or(path, |(file, _)| file);
        let mut images: Vec<(String, PathBuf)> = Vec::new();
        if !tiff.others().is_empty() {
            images.push(("first".to_owned(), file.to_owned()));
        }
        images.extend(tiff.others().iter().map(|other| {
            let mut path = file.as_os_str().to_owned();
            path.push(":");
            path.push(&other.name);
            (other.name.clone(), PathBuf::from(path))
        }));
        // What is said of the first image is not said of others.
        let is_first = named.is_none_or(|(_, name)| name.starts_with("bands="));
        let of_first = Some(tiff.about()).filter(|_| is_first);
        let map = of_first.and_then(map_place);
        let texel_size = of_first.and_then(texel_size);
        let texel_size = match &map {
            Some(map) => texel_size.map(|size| size.on_globe(map)),
            None => texel_size,
        };
        FileAbout { texel_size, map, images, bands: FileBands::of(path, tiff), ..about }
    }

    /// Without the readers of `vastex build` nothing is known of it but what `vastex info` says.
    #[cfg(not(feature = "build"))]
    pub(crate) fn of(path: &Path, _: &Looked, rows: Vec<(String, String)>) -> FileAbout {
        let is_generated = super::is_generated(path);
        FileAbout { rows: rows.into(), is_generated, ..FileAbout::default() }
    }
}

#[cfg(feature = "build")]
fn texel_size(about: &vastex_build::TiffAbout) -> Option<TexelSize> {
    // A unit that the file does not name says less than texels do.
    let pixel = about.pixel_size.as_ref().filter(|pixel| pixel.unit != "unit")?;
    let size = TexelSize::new(pixel.size, &pixel.unit)?;
    Some(size.with_magnification(about.magnification))
}

#[cfg(feature = "build")]
fn map_place(about: &vastex_build::TiffAbout) -> Option<MapPlace> {
    let place = about.place.as_ref()?;
    let is_geographic = about.pixel_size.as_ref().is_some_and(|pixel| pixel.unit == "degree");
    let number = place.epsg.map(|code| format!("EPSG:{code}"));
    let system = number.or_else(|| place.name.clone()).unwrap_or_else(|| "the file's own system".to_owned());
    let map = MapPlace::new(place.from_texels, &system, is_geographic)?;
    Some(map.with_radius(place.radius))
}
