//! Camera paths of the window in files: written into a new one beside others, and read.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use crate::output::Output;

/// Writes the text of a path into a new file of a directory, named after what it leads over. Says which.
pub(super) fn write_path(text: &str, directory: &Path, of: &Path) -> Result<PathBuf> {
    let file = free_name(directory, of, "path");
    Output::at(&file)?.write(text.as_bytes())?;
    Ok(file)
}

/// Reads a path, which `parse` makes of the file's text.
pub(super) fn read_path<P, E>(file: &Path, parse: impl FnOnce(&str) -> Result<P, E>) -> Result<P>
where
    E: std::error::Error + Send + Sync + 'static,
{
    let read = || -> Result<P> {
        let text = String::from_utf8(crate::commands::replay::read_bytes(file)?);
        Ok(parse(&text.context("this is no text, and so no camera path")?)?)
    };
    read().with_context(|| file.display().to_string())
}

/// The name of a file that is not there yet in a directory, or, where nothing can be written there, in the
/// one for temporary files: `earth-1.png` of an `earth.jpg`.
pub(super) fn free_name(directory: &Path, of: &Path, ending: &str) -> PathBuf {
    let stem = of.file_stem().map(|stem| stem.to_string_lossy()).unwrap_or_default();
    // Sources that are no files have names that files may not have.
    let stem = if stem.is_empty() { "vastex".to_owned() } else { stem.replace([':', '/', '\\'], "-") };
    let in_directory = |directory: &Path| {
        let named = |number: u32| directory.join(format!("{stem}-{number}.{ending}"));
        (1..u32::MAX).map(named).find(|file| !file.exists())
    };
    let there = in_directory(directory).filter(|file| Output::at(file).is_ok());
    there.or_else(|| in_directory(&std::env::temp_dir())).unwrap_or_else(|| format!("{stem}.{ending}").into())
}

#[cfg(test)]
mod tests {
    use vastex_viewer::CameraPath;

    use super::*;

    #[test]
    fn paths_are_written_beside_each_other_and_read() {
        let directory = tempfile::tempdir().unwrap();
        let text = "vastex path 1\n0 image:x=1,y=2,zoom=3\n";
        for nth in 1..=2 {
            let file = write_path(text, directory.path(), Path::new("a/moon.tif")).unwrap();
            assert_eq!(file, directory.path().join(format!("moon-{nth}.path")));
            let read = read_path(&file, |text| CameraPath::from_text(text, [1000, 500])).unwrap();
            assert_eq!(read.keys().len(), 1);
        }
        let bad = directory.path().join("bad.path");
        std::fs::write(&bad, "vastex path 1\nsoon").unwrap();
        let error = read_path(&bad, CameraPath::of_volume).unwrap_err();
        assert!(format!("{error:#}").contains("bad.path: line 2: 'soon' is no time"), "{error:#}");
        std::fs::write(&bad, [0xff, 0xfe]).unwrap();
        let error = read_path(&bad, CameraPath::of_volume).unwrap_err();
        assert!(format!("{error:#}").contains("bad.path: this is no text"), "{error:#}");
    }
}
