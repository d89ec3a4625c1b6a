//! Images of something that lists them, as a plate does: they are offered in the window, a person chooses
//! one, and the others are stepped through from there.

use std::path::{Path, PathBuf};
use std::sync::Arc;

#[cfg(feature = "volumes")]
use anyhow::Result;
use vastex_viewer::panels::OfferedImages;

use super::files::Files;
#[cfg(feature = "volumes")]
use super::viewer::OF_FILE;
use super::{App, name_of};
#[cfg(feature = "volumes")]
use crate::volumes::Listed;

/// The name of a file for people. Images of plates are called 0, 1 and so on, so that of one that is offered
/// says where it lies.
pub(super) fn name_among(offered: Option<&OfferedImages>, path: &Path) -> String {
    let of_image = offered.and_then(|offered| {
        let (image, _) = offered.images.get(offered.position(path.as_os_str())?)?;
        Some(format!("{}/{image}", offered.name))
    });
    of_image.unwrap_or_else(|| name_of(path))
}

/// The files that are stepped through from one that a person chose: the images that are offered, if it is one
/// of them, else those beside it.
pub(super) fn files_among(offered: Option<&OfferedImages>, path: &Path) -> Files {
    let among = offered.and_then(|offered| {
        let nth = offered.position(path.as_os_str())?;
        let images = offered.images.iter().map(|(_, path)| PathBuf::from(path));
        Some(Files::among(images.collect(), nth))
    });
    among.unwrap_or_else(|| Files::new(path, &[]))
}

impl App {
    /// The images that are offered in the window, if any are.
    pub(super) fn offered(&self) -> Option<&OfferedImages> {
        self.open.as_ref()?.viewer.scene.beside.panel().offered()
    }

    /// The file of an opening lists images: they are offered beside what is displayed. Where nobody is there
    /// to choose one, or there is none, the file cannot be shown.
    #[cfg(feature = "volumes")]
    pub(super) fn offer(&mut self, opening: u64, path: &Path, listed: Listed) -> Result<()> {
        let is_measured = self.is_measured();
        let offered = listed.offered().filter(|_| !is_measured);
        let (Some(open), Some(offered)) = (&mut self.open, offered) else {
            return self.refuse(opening, listed.into());
        };
        let scene = &mut open.viewer.scene;
        let is_empty = scene.is_empty();
        scene.beside.offer_images(offered, is_empty);
        listed.0.oddities.iter().for_each(|oddity| scene.beside.show_note(OF_FILE, oddity));
        open.viewer.recent.add(path);
        // What the command line says of what lists images is of each of them.
        self.offered_with = (opening == self.args_of).then(|| self.args.clone());
        // What is displayed stays, with what lies over it.
        self.files_before = None;
        self.over.take_back();
        self.take_back_link();
        self.open_next_over()
    }

    /// A file is being opened: where it is an image that is offered, the arguments of what lists it are its
    /// own.
    pub(super) fn follow_offer(&mut self, path: &Path, opening: u64) {
        let is_of_args = self.offered_with.as_ref().is_some_and(|args| Arc::ptr_eq(args, &self.args));
        let is_offered = |offered: &OfferedImages| offered.position(path.as_os_str()).is_some();
        if is_of_args && self.linked.is_none() && self.offered().is_some_and(is_offered) {
            self.args_of = opening;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::files::Step;
    use super::*;

    #[test]
    fn images_of_a_plate_are_stepped_through_and_named_by_where_they_lie() {
        let image = |name: &str| (name.to_owned(), format!("/scans/plate.zarr/{name}").into());
        let images = ["A/1/0", "A/1/1", "B/2/0"].map(image).into();
        let offered = OfferedImages { name: "plate.zarr".into(), what: "a plate".into(), images };
        let path = Path::new("/scans/plate.zarr/A/1/1");
        assert_eq!(name_among(Some(&offered), path), "plate.zarr/A/1/1");
        assert_eq!(name_among(None, path), "1");
        let mut files = files_among(Some(&offered), path);
        assert_eq!(files.current(), path);
        for expected in ["B/2/0", "A/1/0", "A/1/1"] {
            assert_eq!(files.step(1), Step::Other);
            assert_eq!(name_among(Some(&offered), files.current()), format!("plate.zarr/{expected}"));
        }
        // Of another file what lies beside it is.
        let other = Path::new("/scans/other.zarr");
        assert_eq!(files_among(Some(&offered), other).step(1), Step::List(other.to_owned()));
    }
}
