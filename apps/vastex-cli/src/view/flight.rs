//! Camera paths of the window in files: written into a new one beside others, and read.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use vastex_viewer::camera::LeftOut;

use crate::output::{Output, free_name};
use crate::report;

/// What the window records of: a file, and columns and rows of its image. Another may be shown when it ends.
#[derive(Debug, Default)]
pub(super) struct RecordedOf {
    pub(super) file: PathBuf,
    pub(super) image: [u32; 2],
}

/// Writes the text of a path into a new file of a directory, named after what it leads over; where that
/// cannot be, as on a full disk, into one of the directory for temporary files. Says which.
pub(super) fn write_path(text: &str, directory: &Path, of: &Path) -> Result<PathBuf> {
    let write = |directory: &Path| -> Result<PathBuf> {
        let file = free_name(directory, of, "path");
        Output::at(&file)?.write(text.as_bytes())?;
        Ok(file)
    };
    // The first error says more.
    write(directory).or_else(|error| write(&std::env::temp_dir()).map_err(|_| error))
}

/// What is said of a path that was written into a file, or not.
pub(super) fn said_of(written: Result<PathBuf>, left_out: Option<LeftOut>) -> Result<String, String> {
    let left_out = left_out.map(|left_out| format!("; {left_out}")).unwrap_or_default();
    match written {
        Ok(file) => Ok(format!("the camera path is {}; F9 plays it{left_out}", file.display())),
        Err(error) => {
            let why = report::message(&error);
            Err(format!("{why}; F9 plays the path until another one is recorded or read{left_out}"))
        }
    }
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

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use glam::DVec2;
    use vastex_scenes::Pose;
    use vastex_viewer::CameraPath;
    use vastex_viewer::camera::{Flight, Recorded};

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

    /// Of a path that cannot be written nothing is lost, and what a file lacks is said.
    #[test]
    fn a_path_that_cannot_be_written_is_played_all_the_same() {
        let directory = tempfile::tempdir().unwrap();
        let seconds = Duration::from_secs;
        let at = |x: f64| Pose::image(DVec2::new(x, 0.5), 2.0);
        let mut flight = Flight::default();
        flight.begin_recording(seconds(1), at(0.1));
        flight.note(seconds(2), at(0.4));
        flight.note(seconds(3), Pose::globe(0.0, 0.0, 2.0));
        let Recorded { path, left_out } = flight.end_recording(seconds(4), at(0.4)).unwrap();
        let text = path.to_text([1000, 500]);
        // No file system has such names.
        let of = PathBuf::from(format!("{}.tif", "x".repeat(5000)));
        let said = said_of(write_path(&text, directory.path(), &of), left_out).unwrap_err();
        assert!(said.contains("F9 plays the path") && said.contains("what came after"), "{said}");
        assert_eq!(flight.play(seconds(9)), Some(at(0.1)));
        let said = said_of(write_path(&text, directory.path(), Path::new("moon.tif")), left_out).unwrap();
        let file = directory.path().join("moon-1.path");
        assert!(said.contains(&*file.to_string_lossy()) && said.contains("is left out"), "{said}");
        assert_eq!(std::fs::read_to_string(&file).unwrap(), text);
    }
}
