//! Which paths the window shows as volumes, and what of one is more than it shows.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Result, bail};
use vastex_tiles::DiskTier;
use vastex_volume::{Convention, VolumeAbout, VolumeOptions};

use super::kept;
use crate::args::ViewArgs;
use crate::commands::volume;
use crate::{disk_cache, open};

/// How a volume is opened that is shown.
#[derive(Clone, Default)]
pub(crate) struct OpenHow {
    /// Where levels are kept that are made in the background; in memory where there is none.
    pub(crate) cache: Option<PathBuf>,
    /// MiB for bricks, where somebody said how many.
    pub(super) pool_mib: Option<u64>,
    /// Whether what has come is seen at once and looked at again, as in a window.
    is_live: bool,
    /// Where bricks are kept.
    pub(super) disk: Option<Arc<DiskTier>>,
    /// What translations are of, where somebody says so.
    pub(super) origins: Option<Convention>,
}

impl OpenHow {
    /// As arguments say.
    pub(crate) fn of(args: &ViewArgs) -> OpenHow {
        let (origins, args) = (args.volume.origins.convention(), &args.scene);
        let cache = match &args.cache.cache {
            Some(cache) => Some(cache.clone()).filter(|cache| cache.as_os_str() != "off"),
            None => usual_cache(),
        };
        cache.iter().for_each(|cache| kept::make_room(cache, args.cache.cache_gib << 30));
        let disk = disk_cache::asked(&args.disk_cache);
        OpenHow { cache, pool_mib: args.pool_mib, is_live: false, disk, origins }
    }

    /// The same for who shows what has come at once, and looks in every frame what has changed.
    pub(crate) fn live(self) -> OpenHow {
        OpenHow { is_live: true, ..self }
    }

    /// What the command line says of translations is said of the volumes that it names, and of no others.
    #[cfg(feature = "view")]
    pub(crate) fn of_named(self, is_named: bool) -> OpenHow {
        OpenHow { origins: self.origins.filter(|_| is_named), ..self }
    }

    /// A source of bricks of so many voxels along a side.
    pub(super) fn options(&self, brick: u32) -> VolumeOptions {
        // What is kept serves other runs, whatever they look at; else only what is seen is made.
        let makes_all = self.cache.is_some();
        // What is kept on disk is kept as it came.
        let borders_later = self.is_live && self.disk.is_none();
        VolumeOptions {
            brick,
            cache: self.cache.clone(),
            makes_all,
            borders_later,
            ..VolumeOptions::default()
        }
    }
}

/// Where built images are kept, too.
#[cfg(feature = "build")]
fn usual_cache() -> Option<PathBuf> {
    vastex_build::BuildCache::default_directory()
}

/// None where no images are built.
#[cfg(not(feature = "build"))]
fn usual_cache() -> Option<PathBuf> {
    None
}

/// Channels of a volume that is shown, at most.
const MOST_CHANNELS: u64 = 4096;

/// Returns true if the window shows a path as a volume: what cannot be an image, and of TIFF files the stacks
/// that `vastex info` tells of as volumes, unless something is asked for that images alone have. Pages in
/// red, green and blue of which nothing says that they are a stack are images.
pub(crate) fn opens_as_volume(path: &Path, args: &ViewArgs) -> bool {
    let is_stack = || volume::is_described_as_volume(path) && !vastex_volume::are_pictures(path);
    open::is_volume(path) || (is_stack() && args.check_of_volume().is_ok())
}

/// What is set of each channel takes memory, and metadata may name any number of them.
pub(super) fn check_channels(about: &VolumeAbout) -> Result<()> {
    if about.channels > MOST_CHANNELS && !about.is_label {
        bail!(
            "{}: has {} channels, and the window shows a volume of up to {MOST_CHANNELS}; write it with fewer",
            about.path,
            about.channels
        );
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;
    use crate::args::{Args, Command};

    /// TIFF with two pages of 4x4 texels in red, green and blue.
    fn colored_pages(says: &str) -> Vec<u8> {
        let text = format!("{says}\0");
        let mut file = b"II\x2a\0\x08\0\0\0".to_vec();
        for page in 0..2 {
            // The directory, bits of each sample, the values, the text.
            let begin = file.len() as u32;
            let (bits, texels, words) = (begin + 126, begin + 132, begin + 180);
            let next = if page == 0 { words + text.len() as u32 } else { 0 };
            let entries = [
                (256, 3, 1, 4),
                (257, 3, 1, 4),
                (258, 3, 3, bits),
                (259, 3, 1, 1),
                (262, 3, 1, 2),
                (270, 2, text.len() as u32, words),
                (273, 4, 1, texels),
                (277, 3, 1, 3),
                (278, 3, 1, 4),
                (279, 4, 1, 48),
            ];
            file.extend(10_u16.to_le_bytes());
            for (tag, kind, count, value) in entries {
                file.extend([tag, kind].map(u16::to_le_bytes).concat());
                file.extend([count, value].map(u32::to_le_bytes).concat());
            }
            file.extend(next.to_le_bytes());
            file.extend([8_u16; 3].map(u16::to_le_bytes).concat());
            file.extend([page * 90; 48]);
            file.extend(text.bytes());
        }
        file
    }

    #[test]
    fn pages_of_colours_are_an_image_in_the_window_unless_they_are_called_a_stack() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("pages.tif");
        let words = ["vastex", "view", path.to_str().unwrap()];
        let Command::View(args) = Args::try_parse_from(words).unwrap().command else { panic!("no view") };
        for (says, is_volume) in [("two photographs", false), ("ImageJ=1.54f\nimages=2\nslices=2\n", true)] {
            std::fs::write(&path, colored_pages(says)).unwrap();
            assert!(volume::is_described_as_volume(&path), "{says}");
            assert_eq!(opens_as_volume(&path, &args), is_volume, "{says}");
        }
        let opened = super::super::open_volume(&path, OpenHow::default()).unwrap();
        let colors: Vec<_> = opened.facts.channels.iter().map(|channel| channel.color).collect();
        assert_eq!(colors, [[255, 0, 0], [0, 255, 0], [0, 0, 255]].map(Some));
    }

    /// A stack is a volume, and each of its pages an image; either way leads to the other.
    #[cfg(feature = "build")]
    #[test]
    fn a_stack_is_opened_either_way() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("stack.tif");
        let named = |name: &str| PathBuf::from(format!("{}:{name}", path.display()));
        let args = |path: &Path| {
            let words = ["vastex", "view", path.to_str().unwrap()];
            let Command::View(args) = Args::try_parse_from(words).unwrap().command else { panic!("no view") };
            args
        };
        std::fs::write(&path, colored_pages("ImageJ=1.54f\nimages=2\nslices=2\n")).unwrap();
        for (path, is_volume) in
            [(path.clone(), true), (named("volume"), true), (named("first"), false), (named("image"), false)]
        {
            assert_eq!(opens_as_volume(&path, &args(&path)), is_volume, "{}", path.display());
        }
        assert!(super::super::open_volume(&named("volume"), OpenHow::default()).is_ok());
        let image = vastex_build::TiffDirectories::read(&named("first")).unwrap().open().unwrap();
        assert_eq!(vastex::TileSource::description(&*image).geometry.size(), [4, 4, 1]);
        let looked = open::Looked::at(&named("first"));
        let offered = |images: Vec<(String, std::ffi::OsString)>| {
            images.into_iter().map(|(name, path)| (name, PathBuf::from(path))).collect::<Vec<_>>()
        };
        assert_eq!(
            offered(open::file_about(&named("first"), &looked, Default::default()).images),
            [("as a volume", "volume"), ("first", "first"), ("image", "image")]
                .map(|(name, of)| (name.to_owned(), named(of)))
        );
        for path in [path.clone(), named("volume")] {
            let images = offered(open::images_of_volume(&path));
            assert_eq!(images, [("page by page".to_owned(), named("first"))]);
        }
        // Pages of colours of which nothing says that are images alone.
        std::fs::write(&path, colored_pages("two photographs")).unwrap();
        let about = open::file_about(&path, &open::Looked::at(&path), Default::default());
        assert_eq!(
            offered(about.images),
            [("first".to_owned(), path.clone()), ("image".to_owned(), named("image"))]
        );
    }

    #[test]
    fn more_channels_than_can_be_set_are_refused() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/volumes/head.zip");
        let vastex_volume::Opened::Volume(volume) = vastex_volume::open(&path).unwrap() else {
            panic!("no volume")
        };
        let mut about = volume.about().clone();
        about.channels = MOST_CHANNELS;
        check_channels(&about).unwrap();
        about.channels = 1 << 31;
        let error = check_channels(&about).unwrap_err().to_string();
        assert!(error.contains("head.zip") && error.contains("2147483648 channels"), "{error}");
    }
}
