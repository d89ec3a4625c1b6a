//! From a path to what lies there: the one door to volumes of every kind.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use pollster::block_on;
use vastex_tiles::{raw_description, raw_file, read_advice};

use crate::chunks::Grid;
use crate::fault::{Oddities, VolumeError, VolumeFault};
use crate::flat::{has_name_of_values, header_of, image_of, is_nifti, is_raw_volume, open_nifti, open_raw};
use crate::keys::{Directory, KeyStore, Zip, is_zip, shown};
use crate::ome::{Root, assign, axes_of_names, no_image, open_image, open_root};
use crate::stack::{self, is_stack, open_stack};
use crate::tiled::{is_container, open_container};
use crate::volume::{Convention, LevelArray, Volume, VolumeAbout, VolumeLevel};
use crate::zarr::open_array;

/// What lies at a path.
#[derive(Debug)]
pub enum Opened {
    /// A volume.
    Volume(Box<Volume>),
    /// Something that lists volumes below it: a plate, a well, a file of several images, a group of labels.
    Images(ImageList),
}

/// Volumes below a path.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ImageList {
    /// What lists the images, for messages: what was opened, or the only thing below it.
    pub path: String,
    /// What lists the images, as a path exactly: they lie below it.
    pub root: PathBuf,
    /// What lists them: `a plate`, for one.
    pub what: &'static str,
    /// Where each lies below the path.
    pub images: Vec<String>,
    /// What was wrong with the metadata, and how it was read.
    pub oddities: Vec<String>,
}

/// Returns true if a path looks like a volume: by the names in a directory, or by the first bytes of a file.
/// Of a TIFF file, up to four directories are looked at; where it may be taken for an image, too,
/// `cells.tif:volume` says which is meant.
pub fn is_volume(path: &Path) -> bool {
    if path.is_dir() {
        return is_of_zarr(path);
    }
    match path.is_file() {
        true => {
            is_zip(path)
                || is_nifti(path)
                || header_of(path).is_some()
                || is_raw_volume(path)
                || is_stack(path)
                || is_container(path)
        }
        false => in_archive(path).is_some() || named_stack(path).is_some(),
    }
}

/// The TIFF stack that a path means as a volume, as `cells.tif:volume` does: where nothing lies at the path
/// itself, and a stack at what stands before the colon.
fn named_stack(path: &Path) -> Option<&Path> {
    let file = Path::new(path.to_str()?.strip_suffix(":volume")?);
    (!path.exists() && file.is_file() && is_stack(file)).then_some(file)
}

/// Returns true if a directory has metadata of Zarr.
fn is_of_zarr(directory: &Path) -> bool {
    const NAMES: [&str; 4] = ["zarr.json", ".zattrs", ".zgroup", ".zarray"];
    NAMES.iter().any(|name| directory.join(name).is_file())
}

/// Returns all that is read of the volume at a path, so that nothing is written there: a file, with the one
/// that describes its values or has them (`a.raw` and `a.raw.toml`, `a.hdr` and `a.img`); an archive, if the
/// path leads into one; or a directory, of which all files are meant, the outermost one of the Zarr that the
/// path leads into. The path itself where nothing lies there. Looks at names, and at the first bytes of what
/// may be an archive.
pub fn files_of_volume(path: &Path) -> Vec<PathBuf> {
    if path.is_dir() {
        // What lies above `.` or `..` its name does not say.
        let whole = path.canonicalize().unwrap_or_else(|_| path.to_owned());
        let above = |directory: &&Path| is_of_zarr(directory);
        let outermost = whole.ancestors().skip(1).take_while(above).last();
        return vec![outermost.unwrap_or(path).to_owned()];
    }
    if let Some((archive, _)) = in_archive(path) {
        return vec![archive];
    }
    if let Some(stack) = named_stack(path) {
        return vec![stack.to_owned()];
    }
    let header = header_of(path);
    let path = header.as_deref().unwrap_or(path);
    match (raw_file(path), image_of(path)) {
        (Some(raw), _) => vec![raw_description(&raw), raw],
        (None, Ok((image, _))) => vec![path.to_owned(), image],
        (None, Err(_)) => vec![path.to_owned()],
    }
}

/// Returns true if a path that looks like a volume is a TIFF file of pages in red, green and blue that
/// neither OME-XML nor ImageJ's description calls a stack: pictures one after the other, as scanners and
/// editors write them. As a volume its channels are these colours.
pub fn are_pictures(path: &Path) -> bool {
    path.is_file() && stack::are_pictures(path)
}

/// Opens what lies at a path: a directory or an archive of Zarr, or a part of one (`plate.zip/A/1/0`), NIfTI,
/// a raw file with its description, a TIFF stack, a container of a volume. Reads metadata alone. The error
/// says what is wrong, where, and what to do.
pub fn open(path: &Path) -> Result<Opened, VolumeError> {
    let volume = |volume: Volume| Opened::Volume(Box::new(volume.lying_at(path)));
    if path.is_dir() {
        return open_zarr(&(Arc::new(Directory::new(path)) as Arc<dyn KeyStore>), path, "");
    }
    if let Some((archive, below)) = in_archive(path) {
        return open_zarr(&(Arc::new(Zip::open(&archive)?) as Arc<dyn KeyStore>), &archive, &below);
    }
    if let Some(stack) = named_stack(path) {
        return open_stack(stack).map(volume);
    }
    // What is no file, such as a pipe, may never give a byte.
    let is_file = path.is_file();
    if is_file && is_raw_volume(path) {
        return open_raw(path).map(volume);
    }
    if is_file && is_nifti(path) {
        return open_nifti(path).map(volume);
    }
    if let Some(header) = header_of(path).filter(|_| is_file) {
        return open_nifti(&header).map(volume);
    }
    if is_file && is_stack(path) {
        return open_stack(path).map(volume);
    }
    if is_file && is_container(path) {
        return open_container(path).map(volume);
    }
    let found = std::fs::metadata(path);
    Err(match found {
        Err(error) => VolumeFault::Read(read_advice(&error)),
        Ok(_) if has_name_of_values(path) => VolumeFault::NoVolume(
            "is no volume by itself: the values of NIfTI in a file .img are read by its header, a file .hdr of the same name beside \
             it, which is not there, or has its values in another file"
                .into(),
        ),
        Ok(_) => VolumeFault::NoVolume(
            "is no volume: no Zarr, no NIfTI, no raw file with a depth, no TIFF stack, no container of a volume".into(),
        ),
    }
    .at(path.display().to_string()))
}

/// As [`open`], with the translations of levels taken to be of corners, or of middles, of first voxels where
/// somebody says so, whatever the metadata look like. That is said of OME-Zarr alone; of other volumes it is
/// refused.
pub fn open_placed(path: &Path, convention: Option<Convention>) -> Result<Opened, VolumeError> {
    let mut opened = open(path)?;
    if let (Opened::Volume(volume), Some(convention)) = (&mut opened, convention) {
        volume.set_convention(convention)?;
    }
    Ok(opened)
}

/// The archive that a path lies in, and where in it.
fn in_archive(path: &Path) -> Option<(PathBuf, String)> {
    let archive = path.ancestors().find(|path| path.is_file())?;
    if !is_zip(archive) {
        return None;
    }
    let below = path.strip_prefix(archive).ok()?.to_str()?.replace(std::path::MAIN_SEPARATOR, "/");
    Some((archive.to_owned(), below))
}

/// Opens what lies somewhere below a directory or an archive, whose path `store` is.
fn open_zarr(keys: &Arc<dyn KeyStore>, store: &Path, below: &str) -> Result<Opened, VolumeError> {
    block_on(async {
        let mut below = below.to_owned();
        let mut root = open_root(keys, &below).await?;
        // Archives are often of the directory rather than of what is in it.
        if below.is_empty() && matches!(root, Root::Nothing) {
            let mut groups = keys.groups("", 1024).await?;
            // What macOS adds to an archive is none of it.
            groups.retain(|name| name != "__MACOSX" && !name.starts_with('.'));
            if let [only] = &groups[..] {
                below.clone_from(only);
                root = open_root(keys, &below).await?;
            }
        }
        if let Root::Images { what: "a file of several images", paths, .. } = &root
            && let [only] = &paths[..]
        {
            below = crate::keys::join(&below, only);
            root = open_root(keys, &below).await?;
        }
        let path = shown(&**keys, &below);
        let mut place = store.as_os_str().to_owned();
        if !below.is_empty() {
            place.push("/");
            place.push(&below);
        }
        let place = PathBuf::from(place);
        let volume = |volume: Volume| Opened::Volume(Box::new(volume.lying_at(&place)));
        match root {
            Root::Image(image) => open_image(keys, &below, image).await.map(volume),
            Root::Array => open_plain(keys, &below).await.map(volume),
            Root::Images { what, paths, oddities } => {
                Ok(Opened::Images(ImageList { path, root: place, what, images: paths, oddities }))
            }
            Root::Group => Err(no_image(&path)),
            Root::Nothing => {
                Err(VolumeFault::NoVolume("is no volume: no metadata of Zarr lie there".into()).at(path))
            }
        }
    })
}

/// An array without metadata of an image: its axes by their names, else the last of t, c, z, y and x.
async fn open_plain(keys: &Arc<dyn KeyStore>, below: &str) -> Result<Volume, VolumeError> {
    let path = shown(&**keys, below);
    let missing = || VolumeFault::NoVolume("is no array of Zarr".into()).at(&path);
    let array = open_array(keys, below).await?.ok_or_else(missing)?;
    let meta = array.meta().clone();
    let mut oddities = Oddities::default();
    oddities.extend(meta.oddities.iter().cloned());
    oddities.push("is an array without metadata of an image; scales are taken to be 1".into());
    let mut names = meta.names.clone();
    if names.iter().all(Option::is_none) {
        let old = ["t", "c", "z", "y", "x"];
        names =
            old.iter().skip(old.len().saturating_sub(names.len())).map(|name| Some((*name).into())).collect();
        names.splice(0..0, std::iter::repeat_n(None, meta.shape.len() - names.len()));
    }
    let axes = assign(&axes_of_names(&names), &meta.shape, &mut oddities).map_err(|fault| fault.at(&path))?;
    let grid = Grid { shape: meta.shape.clone(), chunk: meta.chunk.clone(), axes };
    let level = VolumeLevel {
        path: String::new(),
        size: grid.size(),
        scale: [1.0; 3],
        origin: [0.0; 3],
        chunk: grid.chunk_size(),
    };
    let about = VolumeAbout {
        kind: "zarr",
        version: None,
        name: None,
        dtype: meta.dtype,
        levels: vec![level],
        channels: grid.channels(),
        channel_info: Vec::new(),
        times: grid.times(),
        unit: None,
        convention: Convention::Corner,
        labels: Vec::new(),
        root: PathBuf::new(),
        is_label: false,
        label_colors: Vec::new(),
        value_scale: None,
        downsample: None,
        left_out: Vec::new(),
        time_step: None,
        time_unit: None,
        oddities: oddities.into_vec(),
        path,
    };
    Ok(Volume::new(about, vec![LevelArray { dtype: meta.dtype, grid, source: Arc::new(array) }]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::keys::{Packing, archive};

    #[test]
    fn what_macos_adds_to_an_archive_is_none_of_it() {
        let meta = br#"{"zarr_format": 2, "shape": [2, 2, 2], "chunks": [2, 2, 2], "dtype": "|u1", "compressor": null,
            "fill_value": 7, "order": "C", "filters": null}"#;
        let entries = [
            ("z.zarr/.DS_Store", &b"x"[..]),
            ("z.zarr/.zarray", meta),
            ("__MACOSX/z.zarr/._.zarray", b"x"),
            (".Trashes/z", b"x"),
        ];
        let entries = entries.map(|(name, content)| (name, content, Packing::DEFLATED));
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("z.zip");
        std::fs::write(&path, archive(&entries)).unwrap();
        let Opened::Volume(volume) = open(&path).unwrap() else { panic!("no volume") };
        assert_eq!((volume.about().size(), volume.fill()), ([2; 3], vec![7]));
    }
}
