//! What a path turns into: the one door to containers, tile directories of other programs, TIFF pyramids,
//! images and generated planets, behind a disk cache if one is asked for.
//!
//! What becomes of an image that nobody built is in `image`, what can be seen of it meanwhile in `preview`,
//! who is told in `observer`, what was found of a file before in `looked`, what files say beside their texels
//! in `about`, which of their bands are opened in `bands`, what means a stack in `stacks`, what becomes of a
//! cached image that turns out to be damaged in `mended`, and what shapes lie over them in `shapes`.

#[cfg(feature = "view")]
mod about;
#[cfg(any(feature = "build", feature = "view"))]
mod bands;
#[cfg(feature = "build")]
pub(crate) mod image;
mod looked;
#[cfg(feature = "build")]
mod mended;
mod observer;
#[cfg(feature = "build")]
mod preview;
#[cfg(feature = "view")]
mod shapes;
#[cfg(feature = "view")]
mod stacks;

use std::io::Read;
#[cfg(feature = "build")]
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context, Result, bail};
use vastex::TileSource;
use vastex_scenes::{DisplayOptions, SceneImage};
use vastex_tiles::{Container, DirectStore, DiskTier};

use crate::args::{CacheArgs, PLANET, SceneArgs};
use crate::{disk_cache, planet, report};
#[cfg(all(feature = "view", feature = "volumes"))]
pub(crate) use about::images_of_volume;
#[cfg(feature = "view")]
pub(crate) use about::{SaidOfFile, file_about};
#[cfg(feature = "view")]
pub(crate) use bands::{are_of_first_image, is_same_file, path_of as path_of_bands};
pub(crate) use looked::Looked;
pub(crate) use observer::OpenObserver;
use observer::{Measured, WithoutPreview};
#[cfg(all(feature = "view", feature = "build"))]
pub(crate) use observer::{MendObserver, Mending, NoteObserver};
#[cfg(feature = "view")]
pub(crate) use shapes::{check_shapes, shapes_over};
#[cfg(feature = "view")]
pub(crate) use stacks::{file_of_stack, is_file_or_its_stack};

/// What a scene shows.
pub(crate) struct Opened {
    /// Behind the disk cache, where there is one; with the size of its image, of which for want of memory it
    /// may have a share alone.
    pub(crate) image: SceneImage,
    pub(crate) disk: Option<Arc<DiskTier>>,
}

/// How an image is opened that nobody built.
#[derive(Clone, Copy)]
#[cfg_attr(not(feature = "build"), expect(dead_code, reason = "nothing can be built"))]
pub(crate) struct OpenImage<'a> {
    /// Where its container is kept.
    pub(crate) cache: &'a CacheArgs,
    /// True if its left and right edges are neighbours, as on a globe.
    pub(crate) wraps: bool,
    pub(crate) observer: &'a dyn OpenObserver,
}

/// What the words of a source name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Lies {
    /// A planet that is no file.
    Generated,
    /// What is read as a container, sound or not, and a path where nothing lies.
    Container,
    /// A directory, or a file of another program.
    Other,
}

/// Has the bands that layers are told opened, of files that have more than a layer can.
pub(crate) fn pick_bands(scene: &mut SceneArgs) -> Result<()> {
    #[cfg(feature = "build")]
    bands::pick(scene)?;
    let _ = scene;
    Ok(())
}

/// Opens the source of a scene, and its disk cache if there is to be one.
pub(crate) fn open(args: &SceneArgs) -> Result<Opened> {
    open_another(&args.source, args, &())
}

/// Opens what lies over the source of a scene, the lowest first.
pub(crate) fn open_over(args: &SceneArgs) -> Result<Vec<SceneImage>> {
    args.files_over().map(|file| Ok(open_another(file, args, &())?.image)).collect()
}

/// Opens another source as the arguments of a scene say, with an observer.
pub(crate) fn open_another(source: &Path, args: &SceneArgs, observer: &dyn OpenObserver) -> Result<Opened> {
    let measured = Measured::new(observer);
    let image = OpenImage { cache: &args.cache, wraps: args.scene().is_round(), observer: &measured };
    let disk_cache = disk_cache::Later::new(&args.disk_cache);
    let tiles = open_tiles(source, args.direct, Some(image))?;
    let (tiles, disk) = disk_cache::before(tiles, source, disk_cache, &|note| observer.note(note));
    let image = SceneImage::from(tiles);
    let size = measured.image(image.size);
    Ok(Opened { image: SceneImage { size, ..image }, disk })
}

/// Opens whatever the words of a source name; an image, if it may be built.
pub(crate) fn open_tiles(
    source: &Path,
    direct: bool,
    image: Option<OpenImage<'_>>,
) -> Result<Arc<dyn TileSource>> {
    let Some(words) = words_of_planet(source) else { return open_path(source, direct, image) };
    // The image of its continents is no preview of a planet.
    let observer = image.map(|image| WithoutPreview(image.observer));
    let image = image.zip(observer.as_ref()).map(|(image, observer)| OpenImage { observer, ..image });
    planet::open(words, |path| open_path(path, direct, image)).with_context(|| source.display().to_string())
}

/// The image that a planet's continents are of, if one is named.
pub(crate) fn image_of_planet(source: &Path) -> Option<&Path> {
    words_of_planet(source)?.split_once(':').map(|(_, image)| Path::new(image))
}

/// Returns true if the words of a source name a generated planet: no mesh in uv shows where its smallest
/// texels are.
pub(crate) fn is_generated(source: &Path) -> bool {
    words_of_planet(source).is_some()
}

/// Fails where one of the paths names a generated planet, which has no file to be `done` with; `instead` is
/// the remedy. A file of such a name, if there is one, is that file.
pub(crate) fn refuse_generated<'a>(
    paths: impl IntoIterator<Item = &'a Path>,
    (done, instead): (&str, &str),
) -> Result<()> {
    match paths.into_iter().find(|path| is_generated(path) && !path.exists()) {
        None => Ok(()),
        Some(planet) => bail!(
            "{}: a planet is made up while it is looked at and has no file, so it cannot be {done}; {instead}",
            planet.display()
        ),
    }
}

/// What is shown of the sources of a scene.
pub(crate) fn shown(args: &SceneArgs) -> DisplayOptions {
    shown_of(args.shown(), std::iter::once(&*args.source).chain(args.files_over()))
}

/// What is shown of sources that lie over one another: in fixed point, where one of them is generated.
pub(crate) fn shown_of<'a>(
    options: DisplayOptions,
    mut sources: impl Iterator<Item = &'a Path>,
) -> DisplayOptions {
    DisplayOptions { always_fixed: options.always_fixed || sources.any(is_generated), ..options }
}

fn words_of_planet(source: &Path) -> Option<&str> {
    source.to_str()?.strip_prefix(PLANET)
}

/// Decides by the first bytes what the words of a source name.
pub(crate) fn what_lies_at(source: &Path) -> Result<Lies> {
    const CONTAINER: &[u8] = &[0x89, b'V', b'T', b'X'];
    if is_generated(source) {
        return Ok(Lies::Generated);
    }
    if source.is_dir() {
        return Ok(Lies::Other);
    }
    if is_image_in_file(source) {
        return Ok(Lies::Other);
    }
    if !source.is_file() {
        return Ok(Lies::Container);
    }
    let mut start = Vec::new();
    let read = std::fs::File::open(source).and_then(|file| file.take(4).read_to_end(&mut start));
    read.with_context(|| format!("{}: cannot be read", source.display()))?;
    Ok(if start.starts_with(CONTAINER) || start.is_empty() { Lies::Container } else { Lies::Other })
}

/// Returns true if a path means another image of a file, as `slide.svs:label` does.
#[cfg(feature = "build")]
fn is_image_in_file(path: &Path) -> bool {
    vastex_build::image_in_file(path).is_some()
}

/// Without the readers of `vastex build` no file has other images.
#[cfg(not(feature = "build"))]
fn is_image_in_file(_: &Path) -> bool {
    false
}

/// The file that the words of a source mean: another image of one lies in it.
pub(crate) fn file_of(source: &Path) -> &Path {
    #[cfg(feature = "build")]
    let source = vastex_build::image_in_file(source).map_or(source, |(file, _)| file);
    source
}

/// The file that the words of a source mean: that of one of its images, or of a planet's continents.
pub(crate) fn source_file(source: &Path) -> &Path {
    file_of(image_of_planet(source).unwrap_or(source))
}

/// All files that are read of what the words of a source mean, and directories of which all are: first the
/// one that is named ([`source_file`]), then what describes it, lies in it or is beside it.
pub(crate) fn files_of(source: &Path) -> Vec<PathBuf> {
    let named = source_file(source);
    let mut files = vec![named.to_owned()];
    #[cfg(feature = "build")]
    files.extend(vastex_build::files_of_image(named));
    #[cfg(feature = "volumes")]
    files.extend(vastex_volume::files_of_volume(named));
    files.dedup();
    files
}

/// Opens a container or, where Vastex can read them, the tiles of a directory, of the file that describes one
/// or of a TIFF pyramid, or an image that may be built. Of anything else, the error says what to do with it.
///
/// The tiles of a container are read past the system's cache if `direct` and if they can be; what cannot be
/// is said.
fn open_path(path: &Path, direct: bool, image: Option<OpenImage<'_>>) -> Result<Arc<dyn TileSource>> {
    open_drawn(path, direct, image).map_err(|error| if is_volume(path) { of_volume(path) } else { error })
}

/// What is said of a volume where an image is needed.
fn of_volume(path: &Path) -> anyhow::Error {
    anyhow::anyhow!(
        "{}: is a volume, and here an image is needed; `vastex view` shows volumes alone, `vastex render` draws them, and \
         with `--on volume` or `--on slices` stacks in TIFF, too",
        path.display()
    )
}

/// Returns true if a path is a volume that cannot be taken for an image: pages of TIFF can.
#[cfg(feature = "volumes")]
pub(crate) fn is_volume(path: &Path) -> bool {
    let is_tiff = path.extension().is_some_and(|ending| {
        ["tif", "tiff", "btf", "tf8"].iter().any(|tiff| ending.eq_ignore_ascii_case(tiff))
    });
    !is_tiff && vastex_volume::is_volume(path)
}

/// Without their reader there are no volumes.
#[cfg(not(feature = "volumes"))]
pub(crate) fn is_volume(_: &Path) -> bool {
    false
}

/// The same of whatever is drawn.
fn open_drawn(path: &Path, direct: bool, image: Option<OpenImage<'_>>) -> Result<Arc<dyn TileSource>> {
    if what_lies_at(path)? == Lies::Other {
        let mut built = None;
        if let Some(options) = image.filter(|options| is_better_built(path, options.observer)) {
            match open_image(path, options) {
                Ok(Some(tiles)) => return Ok(tiles),
                Err(error) if is_of_image(&error) => return Err(error),
                other => built = Some(other),
            }
        }
        let refused = match in_place(path, image.map(|image| image.observer)) {
            Ok(Some(tiles)) => {
                // Where there is no place to build it, or no memory, its tiles are read where they lie.
                if let (Some(Err(error)), Some(options)) = (&built, image)
                    && !is_unsupported(error)
                {
                    let note = format!("{error:#}");
                    report::say(&format!("note: {note}"));
                    options.observer.note(&note);
                }
                return Ok(tiles);
            }
            Ok(None) => None,
            Err(error) if is_of_image(&error) => return Err(error),
            Err(error) => Some(error),
        };
        // What cannot be shown where it lies may be built.
        let built = built.or_else(|| image.map(|options| open_image(path, options)));
        #[cfg(feature = "build")]
        let built = built.map(|built| image::without_cache(path, image, built));
        match (built, refused) {
            (Some(Ok(Some(tiles))), _) => return Ok(tiles),
            // It is of a kind that is built, and damaged.
            (Some(Err(error)), Some(refusal))
                if !is_image_in_file(path) && is_unsupported(&refusal) && !is_unsupported(&error) =>
            {
                return Err(error);
            }
            (_, Some(error)) | (Some(Err(error)), None) => return Err(error),
            (Some(Ok(None)), None) => check_is_image(path)?,
            (None, None) => {}
        }
    }
    // A container of a volume is one of the project's own all the same.
    if is_volume(path) {
        return Err(of_volume(path));
    }
    Ok(if direct { open_direct(path) } else { vastex::open(path) }?)
}

/// Fails where a file is no image, and not meant as a container by its name: somebody opened a picture. Parts
/// of containers say more themselves.
#[cfg(feature = "build")]
pub(crate) fn check_is_image(path: &Path) -> Result<()> {
    use vastex_build::InputFault;

    if path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("vastex")) {
        return Ok(());
    }
    match vastex_build::open(path).map(drop) {
        Err(fault @ (InputFault::Text | InputFault::UnknownFormat(_))) => {
            Err(fault).with_context(|| path.display().to_string())
        }
        _ => Ok(()),
    }
}

/// Without the readers of `vastex build` nothing is known of images.
#[cfg(not(feature = "build"))]
fn check_is_image(_: &Path) -> Result<()> {
    Ok(())
}

/// Returns true if a file is sound, as far as is known, and of a kind that cannot be read.
#[cfg(feature = "build")]
fn is_unsupported(error: &anyhow::Error) -> bool {
    let is = |fault: &vastex_build::InputFault| matches!(fault, vastex_build::InputFault::Unsupported { .. });
    error.chain().any(|cause| cause.downcast_ref().is_some_and(is))
}

/// Without the readers of `vastex build` nothing is known of files.
#[cfg(not(feature = "build"))]
fn is_unsupported(_: &anyhow::Error) -> bool {
    false
}

/// Returns true if a file can be shown where it lies, but all of it would have to be read first, with nothing
/// to look at meanwhile.
#[cfg(feature = "build")]
fn is_better_built(path: &Path, observer: &dyn OpenObserver) -> bool {
    match observer.looked().filter(|looked| looked.is_of(path)) {
        Some(looked) => looked.is_built_first(path),
        // Another file was looked at, as where this one lies over it.
        None => Looked::at(path).is_built_first(path),
    }
}

/// Without the readers of `vastex build` nothing can be built.
#[cfg(not(feature = "build"))]
fn is_better_built(_: &Path, _: &dyn OpenObserver) -> bool {
    false
}

/// Returns true if an error is about an image itself, or about a build or an opening that was broken off, and
/// not about where it would be kept or the memory that it takes.
#[cfg(feature = "build")]
fn is_of_image(error: &anyhow::Error) -> bool {
    use vastex_build::{BuildError, CacheError, SourceError};

    if matches!(error.downcast_ref(), Some(SourceError::BrokenOff { .. })) {
        return true;
    }
    let is_of_build = |error: &BuildError| matches!(error, BuildError::Input { .. } | BuildError::Cancelled);
    let is_of_cache = |error: &CacheError| match error {
        CacheError::Build(error) => is_of_build(error),
        CacheError::Changed(_) => true,
        _ => false,
    };
    let is_of_either =
        error.downcast_ref().is_some_and(is_of_cache) || error.downcast_ref().is_some_and(is_of_build);
    is_of_either && !is_unsupported(error)
}

/// Without the readers of `vastex build` nothing is known of images.
#[cfg(not(feature = "build"))]
fn is_of_image(_: &anyhow::Error) -> bool {
    false
}

fn open_direct(path: &Path) -> Result<Arc<dyn TileSource>, vastex::Error> {
    let container = Container::open_file_direct(path, DirectStore::DEFAULT_DEPTH)?;
    if !container.is_direct() {
        let why = match container.align() {
            1 => "its tiles are not aligned; `vastex build --align 4K` aligns them",
            _ => "the file system refuses it, or asks for a larger alignment",
        };
        report::say(&format!("note: {}: not read directly: {why}", path.display()));
    }
    Ok(Arc::new(container))
}

/// Returns true if a path is the directory of tiles of another program, or the file that describes one.
#[cfg(feature = "build")]
pub(crate) fn is_directory_of_tiles(path: &Path) -> bool {
    (path.is_dir() || path.is_file()) && vastex_build::DirectorySource::open(path).is_ok()
}

/// Without the readers of `vastex build` no directory is known.
#[cfg(not(feature = "build"))]
pub(crate) fn is_directory_of_tiles(_: &Path) -> bool {
    false
}

/// Returns true if a directory looks like one of tiles, by a few names in it.
#[cfg(feature = "build")]
pub(crate) fn may_be_directory_of_tiles(path: &Path) -> bool {
    vastex_build::DirectorySource::may_be_at(path)
}

/// Without their readers none does.
#[cfg(not(feature = "build"))]
pub(crate) fn may_be_directory_of_tiles(_: &Path) -> bool {
    false
}

/// What others wrote, where it lies: a TIFF pyramid or a directory of tiles; `None` if `path` is something
/// else.
#[cfg(feature = "build")]
fn in_place(path: &Path, observer: Option<&dyn OpenObserver>) -> Result<Option<Arc<dyn TileSource>>> {
    use vastex_build::{DirectorySource, InputFault, SourceError, TiffDirectories};

    let say = |notices: &[vastex_build::Notice]| {
        for note in notices.iter().map(|notice| format!("{}: {notice}", path.display())) {
            report::say(&format!("note: {note}"));
            observer.iter().for_each(|observer| observer.note(&note));
        }
    };
    // What is found while tiles are read, on the threads that read them.
    let tell = {
        let (path, observer) = (path.to_owned(), observer.and_then(OpenObserver::later_notes));
        move |notice: vastex_build::Notice| {
            let note = format!("{}: {notice}", path.display());
            report::say(&format!("note: {note}"));
            observer.iter().for_each(|observer| observer(&note));
        }
    };
    let is_none =
        |error: &SourceError| matches!(error, SourceError::Input { fault: InputFault::NoTiles, .. });
    let read = observer.and_then(|observer| observer.looked()?.tiff(path));
    let watch =
        |share| observer.map_or(ControlFlow::Continue(()), |observer| observer.advance_in_place(share));
    let anew = || TiffDirectories::read(path).and_then(|read| read.open_while(&watch));
    match read.map_or_else(anew, |read| read.open_while(&watch)) {
        Ok(tiles) => {
            say(tiles.notices());
            tiles.tell_losses(tell);
            return Ok(Some(tiles));
        }
        Err(error) if is_none(&error) || path.is_dir() => {}
        Err(error) => return Err(error.into()),
    }
    match DirectorySource::open_while(path, &watch) {
        Ok(tiles) => {
            say(tiles.notices());
            tiles.tell_losses(tell);
            Ok(Some(Arc::new(tiles)))
        }
        Err(error) if is_none(&error) => Ok(None),
        Err(error) => Err(error.into()),
    }
}

/// Without the readers of `vastex build` nothing of others can be read.
#[cfg(not(feature = "build"))]
fn in_place(_: &Path, _: Option<&dyn OpenObserver>) -> Result<Option<Arc<dyn TileSource>>> {
    Ok(None)
}

/// An image, built into the cache or decoded into memory; `None` if `path` is no image.
#[cfg(feature = "build")]
fn open_image(path: &Path, options: OpenImage<'_>) -> Result<Option<Arc<dyn TileSource>>> {
    image::open(path, options)
}

/// Without the readers of `vastex build` no image can be read.
#[cfg(not(feature = "build"))]
fn open_image(_: &Path, _: OpenImage<'_>) -> Result<Option<Arc<dyn TileSource>>> {
    Ok(None)
}

#[cfg(test)]
mod tests;
