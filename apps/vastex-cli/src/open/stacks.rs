//! Stacks in files of images, which are shown as volumes or page by page: `FILE:volume` and `FILE:first` mean
//! one and the other, and both are of one file, as recent files and bookmarks are kept.

use std::path::Path;

/// What stands after a file's path and a colon where a stack is meant as a volume.
#[cfg(feature = "build")]
pub(super) const AS_VOLUME: &str = "volume";
/// What stands after a file's path and a colon where a stack is meant as a volume, and as its first image.
#[cfg(feature = "build")]
const OF_STACK: [&str; 2] = [AS_VOLUME, vastex_build::FIRST_IMAGE];

/// The file of a path that means it as a volume or as its first image, whole, by a name: a stack is either.
/// Any other path is given back.
pub(crate) fn file_of_stack(path: &Path) -> &Path {
    #[cfg(feature = "build")]
    if let Some((file, name)) = vastex_build::image_in_file(path)
        && OF_STACK.contains(&name)
    {
        return file;
    }
    path
}

/// Returns true if a path is that of a file, or means it as a volume or as its first image, as far as the
/// words say: the file system, which may be far away, is not asked.
pub(crate) fn is_file_or_its_stack(path: &Path, file: &Path) -> bool {
    #[cfg(feature = "build")]
    {
        let [path, file] = [path, file].map(|path| path.as_os_str().as_encoded_bytes());
        let name = path.strip_prefix(file).and_then(|rest| rest.strip_prefix(b":"));
        if name.is_some_and(|name| OF_STACK.iter().any(|of| of.as_bytes() == name)) {
            return true;
        }
    }
    path == file
}
