//! Which images of a file are levels of its first one, and what the others are.
//!
//! | file | levels |
//! |---|---|
//! | COG and others of GDAL | directories of the chain that say that they are reduced; masks are none |
//! | OME-TIFF, libvips with `subifd` | directories below the first; images that OME-XML calls label, macro or thumbnail are none |
//! | libvips, maketx | directories of the chain, each half as large as the one before |
//! | Aperio's SVS | directories of the chain that have tiles, often each a quarter as large along a side; the thumbnail, the label and the macro image have strips |
//!
//! Writers round sizes up or down, so a level is known by a side that is that of level 0, halved so many
//! times, give or take less than two texels. An image of the first one's size is no level: stacks have many.

use std::path::Path;
use std::sync::Arc;

use super::TiffFile;
use super::about::{self, Kind, OmeImage, TiffAbout};
use super::bands;
use super::entry::Directory;
use super::image::{HEIGHT, TILE_OFFSETS, TiffImage, WIDTH};
use crate::image::InputFault;
use crate::image::file::open_file;

const SUBFILE_TYPE: u16 = 254;
/// Bits of NewSubfileType.
const IS_MASK: u64 = 4;
const IS_REDUCED: u64 = 1;
/// What Aperio says there of the macro image, and of the label.
const MACRO: u64 = 9;
const LABEL: u64 = 1;

/// The images of a TIFF file.
#[derive(Clone)]
pub(crate) struct TiffPyramid {
    /// By how many times level 0 was halved; `None` if the file has no such level. The first and the last
    /// are there.
    pub(crate) levels: Vec<Option<TiffImage>>,
    pub(crate) others: Vec<TiffOther>,
    /// The directories of `others`: what they say of colours and tables may be much, and is read where one of
    /// them is opened.
    other_directories: Vec<Directory>,
    pub(crate) about: TiffAbout,
}

/// An image of a TIFF file that is no level of its first one.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct TiffOther {
    /// The image's role: `thumbnail`, `label`, `macro`, `mask`, or `image` of which nothing is known.
    pub role: &'static str,
    /// The name that opens the image, after the file's path and a colon: its role, from the second of a role
    /// on with its number, as in `image2`.
    pub name: String,
    /// The image's name in the file, if it has one: OME-TIFF names its images.
    pub title: Option<String>,
    /// The image's columns and rows, as far as the file says them.
    pub size: [u64; 2],
}

impl TiffOther {
    /// The images of a TIFF file that are no levels of its first one; none where a file is none or cannot be
    /// read as one. Reads directories.
    pub fn of_file(path: &Path) -> Vec<TiffOther> {
        let file = TiffFile::open(path).ok().flatten();
        file.and_then(|file| TiffPyramid::of(&file).ok()).map_or_else(Vec::new, |pyramid| pyramid.others)
    }
}

/// The file and the name of one of its images ([`TiffOther::name`]; [`FIRST_IMAGE`] of the first), or
/// `bands=` and bands of it, that a path means, as in `slide.svs:label` and `landsat.tif:bands=5,4,3`: where
/// nothing lies at the path itself, and a file at what stands before its last colon.
pub fn image_in_file(path: &Path) -> Option<(&Path, &str)> {
    let (file, name) = path.to_str()?.rsplit_once(':')?;
    let file = Path::new(file);
    (!name.is_empty() && !path.exists() && file.is_file()).then_some((file, name))
}

/// What stands after a file's path and a colon for its first image, where a file may be taken for something
/// else, too, as a stack is for a volume.
pub const FIRST_IMAGE: &str = "first";

/// Returns true if a name after a file's path and a colon ([`image_in_file`]) means the first image of the
/// file, whole ([`FIRST_IMAGE`]) or some bands of it ([`bands_in_name`]), and not another one.
pub fn means_first_image(name: &str) -> bool {
    name == FIRST_IMAGE || bands::in_name(name).is_some()
}

/// The file of a path that means its first image by that name; any other path as it is.
pub(crate) fn without_first(path: &Path) -> &Path {
    match image_in_file(path) {
        Some((file, FIRST_IMAGE)) => file,
        _ => path,
    }
}

/// How many bands the first image of a TIFF file has, where they are more than a picture shows and so some
/// may be chosen, as in `landsat.tif:bands=5,4,3`; `None` for other files, and where it cannot be read. Reads
/// its first directory.
pub fn bands_to_choose(path: &Path) -> Option<u16> {
    let file = match image_in_file(path) {
        Some((file, name)) => means_first_image(name).then_some(file)?,
        None => path,
    };
    TiffFile::first_image(Arc::new(open_file(file).ok()?), None).ok()?.bands_to_choose()
}

/// The bands that a name after a file's path and a colon means ([`image_in_file`]): `5,4,3` of
/// `bands=5,4,3`; `None` if it is the name of another image.
pub fn bands_in_name(name: &str) -> Option<&str> {
    bands::in_name(name)
}

/// The file and the bands of it that a path means, as in `landsat.tif:bands=5,4,3`.
pub(crate) fn bands_in_path(path: &Path) -> Option<(&Path, &str)> {
    let (file, name) = image_in_file(path)?;
    Some((file, bands::in_name(name)?))
}

impl TiffPyramid {
    /// Opens a file, or another image of one ([`image_in_file`]); `None` if its first bytes are not those of
    /// TIFF. Reads directories, but neither texels nor lists of tiles.
    pub(crate) fn open(path: &Path) -> Result<Option<TiffPyramid>, InputFault> {
        let path = without_first(path);
        match image_in_file(path) {
            Some((file, name)) => TiffPyramid::open_file(file)?.map(|all| all.named(name)).transpose(),
            None => TiffPyramid::open_file(path),
        }
    }

    /// Opens a file with all of its images.
    pub(crate) fn open_file(file: &Path) -> Result<Option<TiffPyramid>, InputFault> {
        TiffFile::open(file)?.map(|file| TiffPyramid::of(&file)).transpose()
    }

    /// What is meant by what a path names in its file ([`image_in_file`]): the same with other bands, or
    /// another image.
    pub(crate) fn named(self, name: &str) -> Result<TiffPyramid, InputFault> {
        match bands::in_name(name) {
            Some(bands) => self.picked(bands),
            None => self.alone(name),
        }
    }

    /// The first image, which is level 0.
    pub(crate) fn first(&self) -> Option<&TiffImage> {
        self.levels.first()?.as_ref()
    }

    /// This pyramid with other bands.
    fn picked(mut self, bands: &str) -> Result<TiffPyramid, InputFault> {
        let pick = |level: Option<TiffImage>| level.map(|image| image.pick(bands)).transpose();
        self.levels = self.levels.into_iter().map(pick).collect::<Result<_, _>>()?;
        Ok(self)
    }

    /// One of the other images, without levels.
    fn alone(self, name: &str) -> Result<TiffPyramid, InputFault> {
        let Some(place) = self.others.iter().position(|other| other.name == name) else {
            let names = self.others.into_iter().map(|other| other.name).collect();
            return Err(InputFault::NoImage { name: name.to_owned(), names });
        };
        let Some(file) = self.first().map(TiffImage::file) else { return Err(InputFault::NoTiles) };
        let image = TiffImage::read(file, &self.other_directories[place])?.cut();
        let words = about::words_of(file, &self.other_directories[place]);
        let about = TiffAbout { nodata: self.about.nodata, words, ..TiffAbout::default() };
        let (others, other_directories) = (Vec::new(), Vec::new());
        Ok(TiffPyramid { levels: vec![Some(image)], others, other_directories, about })
    }

    fn of(file: &Arc<TiffFile>) -> Result<TiffPyramid, InputFault> {
        let mut found = file.directories()?;
        let (kind, about) = about::read(file, &found.chain[0])?;
        let first = TiffImage::read(file, &found.chain[0])?.cut();
        let (others, other_directories) = (Vec::new(), Vec::new());
        let mut pyramid = TiffPyramid { levels: vec![Some(first)], others, other_directories, about };
        for directory in found.below {
            pyramid.add(file, directory, &kind, None)?;
        }
        for (place, directory) in found.chain.drain(..).enumerate().skip(1) {
            pyramid.add(file, directory, &kind, Some(place))?;
        }
        Ok(pyramid)
    }

    /// Takes a directory for a level, or lists it: one below the first, or the one at a place of the chain.
    /// What cannot be read of it is no level; nor is a page of the chain that neither has tiles nor says that
    /// it is reduced: scans have pages of several sizes.
    fn add(
        &mut self,
        file: &Arc<TiffFile>,
        directory: Directory,
        kind: &Kind,
        in_chain: Option<usize>,
    ) -> Result<(), InputFault> {
        file.check_read(&directory)?;
        let number = |tag| Ok::<u64, InputFault>(directory.number(file, tag)?.unwrap_or(0));
        let (subfile, size) = (number(SUBFILE_TYPE)?, [number(WIDTH)?, number(HEIGHT)?]);
        let is_tiled = directory.entry(TILE_OFFSETS).is_some();
        let named = match (kind, in_chain) {
            (Kind::Ome(images), Some(place)) => images.other_of(place),
            _ => None,
        };
        let role = match kind {
            _ if subfile & IS_MASK != 0 => Some("mask"),
            Kind::Aperio if !is_tiled => {
                let words = about::description(file, &directory)?;
                let second = words.lines().nth(1).unwrap_or_default().trim_start();
                Some(match subfile {
                    _ if second.starts_with("label") => "label",
                    _ if second.starts_with("macro") => "macro",
                    MACRO => "macro",
                    LABEL => "label",
                    _ => "thumbnail",
                })
            }
            _ => named.and_then(OmeImage::role),
        };
        let level = match role {
            None if in_chain.is_none() || is_tiled || subfile & IS_REDUCED != 0 => {
                self.level_of(file, &directory, size)
            }
            _ => None,
        };
        match level {
            Some((level, image)) => {
                self.levels.resize_with(self.levels.len().max(level + 1), || None);
                self.levels[level] = Some(image);
            }
            None => {
                let role = role.unwrap_or("image");
                let number = 1 + self.others.iter().filter(|other| other.role == role).count();
                let name = if number == 1 { role.to_owned() } else { format!("{role}{number}") };
                let title = named.and_then(|image| image.name.clone());
                self.others.push(TiffOther { role, name, title, size });
                self.other_directories.push(directory);
            }
        }
        Ok(())
    }

    /// The image of a directory, which says so many columns and rows, and its level, where it is one that is
    /// not there yet. No more is read of a directory of another size.
    fn level_of(
        &self,
        file: &Arc<TiffFile>,
        directory: &Directory,
        size: [u64; 2],
    ) -> Option<(usize, TiffImage)> {
        let first = self.levels.first()?.as_ref()?;
        let [width, height] = size.map(|side| u32::try_from(side).ok().filter(|side| *side > 0));
        let level = halvings(first.size, [width?, height?], self.levels.len())?;
        if self.levels.get(level).is_some_and(Option::is_some) {
            return None;
        }
        let image = TiffImage::read_beside(file, directory, Some(first)).ok()?.cut();
        let is_alike =
            image.samples == first.samples && (image.number, image.bits) == (first.number, first.bits);
        let is_shown_alike = match (image.pixel_format(), first.pixel_format()) {
            (Ok(format), Ok(other)) => format == other,
            (_, Err(_)) => true,
            _ => false,
        };
        (is_alike && is_shown_alike).then_some((level, image))
    }
}

/// How many times a size was halved, at least once: `next` times where that may be, as for the last texels of
/// a chain; `None` if it is no such size.
fn halvings(full: [u32; 2], size: [u32; 2], next: usize) -> Option<usize> {
    let is_level = |level: usize| {
        let is_near = |axis: usize| {
            let expected = (f64::from(full[axis]) / (level as f64).exp2()).max(1.0);
            (f64::from(size[axis]) - expected).abs() < 2.0
        };
        level > 0 && is_near(0) && is_near(1)
    };
    let axis = usize::from(full[1] > full[0]);
    let nearest = (f64::from(full[axis]) / f64::from(size[axis])).log2().round().max(0.0) as usize;
    // Of a size that is not smaller than the last one's, nothing follows.
    let follows = size[axis] < full[axis] && next <= nearest && is_level(next);
    if follows { Some(next) } else { Some(nearest).filter(|level| is_level(*level)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_are_known_by_their_size_however_it_is_rounded() {
        let full = [46_001, 32_913];
        for (size, level) in [
            ([23_000, 16_456], Some(1)),
            ([23_001, 16_457], Some(1)),
            ([11_500, 8228], Some(2)),
            ([2875, 2057], Some(4)),
            ([1, 1], Some(15)),
            ([46_001, 32_913], None),
            ([15_334, 10_971], None),
            ([1024, 768], None),
            ([23_000, 16_400], None),
        ] {
            assert_eq!(halvings(full, size, 1), level, "{size:?}");
        }
        assert_eq!(halvings([1000, 3], [1, 1], 1), Some(10));
        assert_eq!(halvings([1000, 3], [1, 1], 9), Some(9));
        assert_eq!(halvings([1000, 3], [250, 1], 1), Some(2));
        assert_eq!(halvings([1, 1], [1, 1], 1), None);
    }

    /// A page of one texel in a strip, whose colour profile is the first so many bytes of the file.
    fn page(profile: u32, next: u32) -> Vec<u8> {
        page_of((1, 8), 0, profile, next)
    }

    /// The same of so many texels a side, each of so many bits; `subfile` says what it is.
    fn page_of((side, bits): (u32, u32), subfile: u32, profile: u32, next: u32) -> Vec<u8> {
        let entries = [
            (254, 4, 1, subfile),
            (256, 4, 1, side),
            (257, 4, 1, side),
            (258, 3, 1, bits),
            (259, 3, 1, 1),
            (262, 3, 1, 1),
            (273, 4, 1, 0),
            (277, 3, 1, 1),
            (278, 4, 1, side),
            (279, 4, 1, side * side * bits / 8),
            (34675, 7, profile, 0),
        ];
        directory(&entries, next)
    }

    /// Tags with their kinds, counts and values.
    fn directory(entries: &[(u16, u16, u32, u32)], next: u32) -> Vec<u8> {
        let mut bytes = (entries.len() as u16).to_le_bytes().to_vec();
        for &(tag, kind, count, value) in entries {
            bytes.extend([tag.to_le_bytes(), kind.to_le_bytes()].concat());
            bytes.extend([count.to_le_bytes(), value.to_le_bytes()].concat());
        }
        bytes.extend(next.to_le_bytes());
        bytes
    }

    #[test]
    fn of_images_that_are_listed_no_profile_is_read() {
        const PAGES: u32 = 900;
        let of_page = page(0, 0).len() as u32;
        let profile = 8 + PAGES * of_page;
        let mut bytes = b"II\x2a\0\x08\0\0\0".to_vec();
        for n in 1..=PAGES {
            bytes.extend(page(profile, if n < PAGES { 8 + n * of_page } else { 0 }));
        }
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a.tif");
        std::fs::write(&path, bytes).unwrap();
        let file = TiffFile::open(&path).unwrap().unwrap();
        let pyramid = TiffPyramid::of(&file).unwrap();
        assert_eq!(pyramid.others.len() as u32, PAGES - 1);
        // The directories, and the profile of the first image.
        let read = file.reads().bytes;
        assert!(read < 4 * u64::from(profile), "{read} bytes of {profile} were read");
        let one = pyramid.alone("image7").unwrap();
        let image = one.levels[0].as_ref().unwrap();
        assert_eq!(image.profile.as_ref().map(|profile| profile.len()), Some(profile as usize));
    }

    /// What is wrong with a file of these bytes and so many zeros behind them, and how many bytes were read.
    fn refused(bytes: &[u8], zeros: u64) -> (String, u64) {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a.tif");
        std::fs::write(&path, bytes).unwrap();
        let file = std::fs::OpenOptions::new().write(true).open(&path).unwrap();
        file.set_len(bytes.len() as u64 + zeros).unwrap();
        let file = TiffFile::open(&path).unwrap().unwrap();
        let fault = TiffPyramid::of(&file).err().map(|fault| fault.to_string());
        (fault.unwrap_or_default(), file.reads().bytes)
    }

    /// Each of them may be a level, until its samples turn out to be others than those of the first.
    #[test]
    fn directories_that_lead_to_a_profile_each_are_read_up_to_a_bound() {
        const PAGES: u32 = 1000;
        let profile = 16 << 20;
        let of_page = page(0, 0).len() as u32;
        let mut bytes = b"II\x2a\0\x08\0\0\0".to_vec();
        bytes.extend(page_of((2, 8), 0, 0, 8 + of_page));
        for n in 2..=PAGES {
            let next = if n < PAGES { 8 + n * of_page } else { 0 };
            bytes.extend(page_of((1, 16), IS_REDUCED as u32, profile, next));
        }
        let (fault, read) = refused(&bytes, profile.into());
        assert!(fault.contains("lead to more than 256 MiB"), "{fault}");
        assert!(read < (256 << 20) + 2 * u64::from(profile), "{read}");
    }

    #[test]
    fn directories_have_so_many_entries_together() {
        const PAGES: u32 = 300;
        let entries: Vec<_> = (0..4096u16).map(|tag| (40_000 + tag, 4, 1, 0)).collect();
        let of_page = directory(&entries, 0).len() as u32;
        let first = page(0, 0).len() as u32;
        let mut bytes = b"II\x2a\0\x08\0\0\0".to_vec();
        bytes.extend(page(0, 8 + first));
        for n in 1..=PAGES {
            bytes.extend(directory(&entries, if n < PAGES { 8 + first + n * of_page } else { 0 }));
        }
        let (fault, _) = refused(&bytes, 0);
        assert!(fault.contains("have more than 1048576 entries"), "{fault}");
    }
}
