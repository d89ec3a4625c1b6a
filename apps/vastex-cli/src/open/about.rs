//! What a file says beside its texels, for the window: how large they are in the world, and which other
//! images it has.

#[cfg(feature = "build")]
use std::ffi::OsString;
use std::path::Path;

#[cfg(feature = "build")]
use vastex_build::{FIRST_IMAGE, means_first_image};
use vastex_viewer::panels::FileAbout;
#[cfg(feature = "build")]
use vastex_viewer::panels::{FileBands, MapPlace, TexelSize};

use super::looked::Looked;
#[cfg(feature = "build")]
use super::stacks::AS_VOLUME;

/// What `vastex info` says of a file.
#[derive(Default)]
pub(crate) struct SaidOfFile {
    /// All of it, by names; a row without a name goes on with the one before it.
    pub(crate) rows: Vec<(String, String)>,
    /// What values that are shown were converted from, which the rows say as well.
    #[cfg_attr(not(feature = "build"), expect(dead_code, reason = "containers hold what they say"))]
    pub(crate) converted: Vec<String>,
}

impl SaidOfFile {
    /// Of a file of which nothing is converted.
    pub(crate) fn of_rows<N: AsRef<str>>(rows: impl IntoIterator<Item = (N, String)>) -> SaidOfFile {
        let rows = rows.into_iter().map(|(name, value)| (name.as_ref().trim().to_owned(), value));
        SaidOfFile { rows: rows.collect(), converted: Vec::new() }
    }
}

/// What is said of the source that a path names, which was looked at, beside what `vastex info` says of
/// it.
#[cfg(feature = "build")]
pub(crate) fn file_about(path: &Path, looked: &Looked, said: SaidOfFile) -> FileAbout {
    let about = FileAbout {
        converted: said.converted.join(", "),
        rows: said.rows.into(),
        is_generated: super::is_generated(path),
        ..FileAbout::default()
    };
    let Some(tiff) = looked.tiff(path) else {
        return match container_about(path) {
            Some(kept) => placed(about, &kept),
            None => about,
        };
    };
    let named = vastex_build::image_in_file(path);
    let file = named.map_or(path, |(file, _)| file);
    let image = |name: &str| (name.to_owned(), in_file(file, name));
    let mut images: Vec<(String, OsString)> = Vec::new();
    match is_stack(file) {
        // The file alone may be opened as a volume.
        true => images.extend([("as a volume".to_owned(), in_file(file, AS_VOLUME)), image(FIRST_IMAGE)]),
        false if !tiff.others().is_empty() => images.push((FIRST_IMAGE.to_owned(), file.into())),
        false => {}
    }
    images.extend(tiff.others().iter().map(|other| image(&other.name)));
    // What is said of the first image is not said of others.
    let is_first = named.is_none_or(|(_, name)| means_first_image(name));
    let of_first = Some(tiff.about()).filter(|_| is_first);
    let about = FileAbout { images, bands: bands_of(path, tiff), ..about };
    match of_first {
        Some(of_first) => placed(about, of_first),
        None => about,
    }
}

/// The path of an image of a file, or of all of its pages as a volume.
#[cfg(feature = "build")]
fn in_file(file: &Path, name: &str) -> OsString {
    let mut path = file.as_os_str().to_owned();
    path.push(":");
    path.push(name);
    path
}

/// Returns true if a TIFF file is a stack of slices as well as images: pages of one size, unless they are
/// pictures of which nothing says that.
#[cfg(all(feature = "build", feature = "volumes"))]
fn is_stack(file: &Path) -> bool {
    vastex_volume::is_volume(file) && !vastex_volume::are_pictures(file)
}

/// Without their reader there are no volumes.
#[cfg(all(feature = "build", not(feature = "volumes")))]
fn is_stack(_: &Path) -> bool {
    false
}

/// What a TIFF file that a path means as a volume is as well: its pages, one by one.
#[cfg(all(feature = "build", feature = "volumes"))]
pub(crate) fn images_of_volume(path: &Path) -> Vec<(String, OsString)> {
    let file = vastex_build::image_in_file(path).map_or(path, |(file, _)| file);
    let is_tiff = vastex_build::TiffDirectories::read(file).is_ok();
    is_tiff.then(|| ("page by page".to_owned(), in_file(file, FIRST_IMAGE))).into_iter().collect()
}

/// Without the readers of `vastex build` no page is shown alone.
#[cfg(all(not(feature = "build"), feature = "volumes"))]
pub(crate) fn images_of_volume(_: &Path) -> Vec<(String, std::ffi::OsString)> {
    Vec::new()
}

/// What the source that a path names says of itself: a TIFF file, also where bands of it are shown, of its
/// first image; a container what it keeps of the file that it was built of.
#[cfg(feature = "build")]
pub(super) fn tiff_about(path: &Path) -> Option<vastex_build::TiffAbout> {
    let file = super::bands::file_of_first_image(path);
    if file == path && vastex_build::image_in_file(path).is_some() {
        return None;
    }
    vastex_build::TiffAbout::of_file(file).or_else(|| container_about(path))
}

/// What a container keeps of the file that it was built of; `None` if a path is none that can be opened.
#[cfg(feature = "build")]
fn container_about(path: &Path) -> Option<vastex_build::TiffAbout> {
    let is_container = path.is_file() && super::what_lies_at(path).ok()? == super::Lies::Container;
    let container = is_container.then(|| vastex_tiles::Container::open_file(path).ok())??;
    Some(vastex_build::TiffAbout::of_container(&container))
}

/// With how large texels are, and where they lie.
#[cfg(feature = "build")]
fn placed(about: FileAbout, said: &vastex_build::TiffAbout) -> FileAbout {
    let map = map_place(said);
    let texel_size = texel_size(said);
    let texel_size = match &map {
        Some(map) => texel_size.map(|size| size.on_globe(map)),
        None => texel_size,
    };
    FileAbout { texel_size, map, ..about }
}

/// Without the readers of `vastex build` nothing is known of it but what `vastex info` says.
#[cfg(not(feature = "build"))]
pub(crate) fn file_about(path: &Path, _: &Looked, said: SaidOfFile) -> FileAbout {
    let is_generated = super::is_generated(path);
    FileAbout { rows: said.rows.into(), is_generated, ..FileAbout::default() }
}

/// The bands of the source that a path names; `None` if there is nothing to choose.
#[cfg(feature = "build")]
fn bands_of(path: &Path, tiff: &vastex_build::TiffDirectories) -> Option<FileBands> {
    let (file, name) = match vastex_build::image_in_file(path) {
        Some((file, name)) => means_first_image(name).then_some((file, Some(name)))?,
        None => (path, None),
    };
    let shown = match name.and_then(vastex_build::bands_in_name) {
        None => Some(vec![1, 2, 3]),
        Some(words) => words.split(',').map(|word| word.parse::<u16>().ok()).collect(),
    };
    let (count, named) = (tiff.bands_to_choose()?, &tiff.about().bands);
    let name = |n: u16| match named.get(usize::from(n) - 1) {
        Some(Some(name)) => format!("{n} {name}"),
        _ => n.to_string(),
    };
    Some(FileBands { file: file.into(), names: (1..=count).map(name).collect(), shown: shown? })
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
