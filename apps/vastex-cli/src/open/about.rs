//! What a file says beside its texels, for the window: how large they are in the world, and which other images it has.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use vastex_viewer::panels::{Shapes, TexelSize};

/// What a file says beside its texels.
#[derive(Clone, Debug, Default)]
pub(crate) struct FileAbout {
    /// How large its texels are in the world, and how many times they were magnified: of TIFF of maps and slides.
    pub(crate) texel_size: Option<TexelSize>,
    /// The images of a TIFF file, the first one before the others, if there are others; each with its name and the path that opens it.
    pub(crate) images: Vec<(String, PathBuf)>,
    /// Shapes of another file that lie over it.
    pub(crate) shapes: Option<Arc<Shapes>>,
}

impl FileAbout {
    /// What is said of the source that a path names.
    #[cfg(feature = "build")]
    pub(crate) fn of(path: &Path) -> FileAbout {
        let file = vastex_build::image_in_file(path).map_or(path, |(file, _)| file);
        let others = vastex_build::TiffOther::of_file(file);
        let mut images: Vec<(String, PathBuf)> = Vec::new();
        if !others.is_empty() {
            images.push(("first".to_owned(), file.to_owned()));
        }
        images.extend(others.into_iter().map(|other| {
            let mut path = file.as_os_str().to_owned();
            path.push(":");
            path.push(&other.name);
            (other.name, PathBuf::from(path))
        }));
        FileAbout { texel_size: texel_size(path), images, shapes: None }
    }

    /// Without the readers of `vastex build` nothing is known of it.
    #[cfg(not(feature = "build"))]
    pub(crate) fn of(_: &Path) -> FileAbout {
        FileAbout::default()
    }
}

#[cfg(feature = "build")]
fn texel_size(path: &Path) -> Option<TexelSize> {
    let about = vastex_build::TiffAbout::of_file(path)?;
    // A unit that the file does not name says less than texels do.
    let pixel = about.pixel_size.filter(|pixel| pixel.unit != "unit")?;
    let size = TexelSize::new(pixel.size, &pixel.unit)?;
    Some(size.with_magnification(about.magnification))
}
