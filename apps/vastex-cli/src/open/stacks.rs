//! Stacks in files of images, which are shown as volumes or page by page: `FILE:volume` means the one, and
//! `FILE:first` the other. Lists of recent files and bookmarks take both for the one file.

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

/// Returns true if a path is that of a file, or means it as a volume or as its first image. The file system,
/// which may be far away, is asked only for paths that mean that by their words: such a file may be there.
pub(crate) fn is_file_or_its_stack(path: &Path, file: &Path) -> bool {
    #[cfg(feature = "build")]
    {
        let [words, of_file] = [path, file].map(|path| path.as_os_str().as_encoded_bytes());
        let name = words.strip_prefix(of_file).and_then(|rest| rest.strip_prefix(b":"));
        if name.is_some_and(|name| OF_STACK.iter().any(|of| of.as_bytes() == name)) {
            return !path.exists();
        }
    }
    path == file
}

#[cfg(all(test, feature = "build"))]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_is_called_as_a_stack_is_one_of_its_own() {
        let directory = tempfile::tempdir().unwrap();
        let [file, stack] = ["a.tif", "a.tif:first"].map(|name| directory.path().join(name));
        std::fs::write(&file, "").unwrap();
        assert!(is_file_or_its_stack(&file, &file) && is_file_or_its_stack(&stack, &file));
        assert_eq!(file_of_stack(&stack), file);
        // Windows has no such names.
        if cfg!(unix) {
            std::fs::write(&stack, "").unwrap();
            assert!(!is_file_or_its_stack(&stack, &file) && file_of_stack(&stack) == stack);
        }
    }
}
