//! Something that lists volumes where one is to be shown: an error for scripts, and for the window images to
//! choose from.

use std::fmt;
use std::path::PathBuf;

use vastex_viewer::panels::OfferedImages;
use vastex_volume::ImageList;

use crate::commands::volume::no_volume;

/// One volume is to be shown, and something lists several, or none.
#[derive(Debug)]
pub(crate) struct Listed(pub(crate) ImageList);

impl Listed {
    /// The images for the window; `None` if there is none to choose.
    pub(crate) fn offered(&self) -> Option<OfferedImages> {
        let ImageList { root, what, images, .. } = &self.0;
        let name = root.file_name().unwrap_or(root.as_ref()).to_string_lossy().into_owned();
        // Not by `Path::join`, for which a name of metadata may be another disk's.
        let below = |image: &String| {
            let mut path = root.components().collect::<PathBuf>().into_os_string();
            path.push("/");
            path.push(image.trim_start_matches('/'));
            path
        };
        let images = images.iter().map(|image| (image.clone(), below(image)));
        let offered = OfferedImages { name, what: (*what).to_owned(), images: images.collect() };
        (!offered.images.is_empty()).then_some(offered)
    }
}

impl fmt::Display for Listed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&no_volume(&self.0))
    }
}

impl std::error::Error for Listed {}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::volumes::{OpenHow, open_volume};

    fn fixture(name: &str) -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../crates/vastex-volume/fixtures").join(name)
    }

    fn listed(path: &Path) -> Listed {
        let Err(error) = open_volume(path, OpenHow::default()) else {
            panic!("{} is one volume", path.display())
        };
        error.downcast().unwrap()
    }

    #[test]
    fn images_of_a_list_are_offered_by_paths_that_open_them() {
        for (name, what, images) in [
            ("plate.zip", "a plate", ["A/1/0", "A/1/1"]),
            ("plate.zip/A/1", "a well", ["0", "1"]),
            ("bioformats2raw.zip", "a file of several images", ["0", "1"]),
        ] {
            let listed = listed(&fixture(name));
            let offered = listed.offered().unwrap();
            let names: Vec<_> = offered.images.iter().map(|(name, _)| &**name).collect();
            assert_eq!((&*offered.what, &*names), (what, &images[..]), "{name}");
            assert_eq!(offered.name, Path::new(name).file_name().unwrap().to_str().unwrap());
            for (nth, (_, path)) in offered.images.iter().enumerate() {
                let opened = open_volume(Path::new(path), OpenHow::default()).unwrap();
                assert_eq!(opened.facts.of.size, [8, 6, 2], "{path:?}");
                assert_eq!(offered.position(path), Some(nth));
            }
            assert!(listed.to_string().contains("name one of its images"), "{listed}");
        }
        // Labels beside an image are images, too.
        let nuclei = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/volumes/nuclei.zip");
        let offered = listed(&nuclei.join("labels")).offered().unwrap();
        assert_eq!((&*offered.what, &*offered.images[0].0), ("a group of labels", "nuclei"));
        assert_eq!(
            open_volume(Path::new(&offered.images[0].1), OpenHow::default()).unwrap().facts.labels,
            ["nuclei"]
        );
    }

    #[cfg(unix)]
    #[test]
    fn images_below_a_path_that_is_no_text_open() {
        use std::os::unix::ffi::OsStrExt;

        let directory = tempfile::tempdir().unwrap();
        let plate = directory.path().join(std::ffi::OsStr::from_bytes(b"pl\xff.zip"));
        std::fs::copy(fixture("plate.zip"), &plate).unwrap();
        let offered = listed(&plate).offered().unwrap();
        for (name, path) in offered.images.iter() {
            assert!(open_volume(Path::new(path), OpenHow::default()).is_ok(), "{name}");
        }
    }

    #[test]
    fn where_nothing_is_listed_nothing_is_offered() {
        let empty = ImageList {
            path: "p".into(),
            root: "p".into(),
            what: "a plate",
            images: Vec::new(),
            oddities: Vec::new(),
        };
        assert_eq!(Listed(empty).offered(), None);
    }
}
