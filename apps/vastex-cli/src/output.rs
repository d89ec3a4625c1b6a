//! The files that `render` and `crop` write, pictures, traces, statistics and regions: whole or not at all.

use std::collections::BTreeSet;
use std::fs::{self, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use anyhow::{Context, Result, anyhow, bail};
use vastex_scenes::Picture;

/// What is written of outputs, and is in no place yet.
static BEGUN: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

fn begun() -> MutexGuard<'static, BTreeSet<PathBuf>> {
    BEGUN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes what is written of outputs and is in no place yet, as the program ends. From then on no output
/// can be begun.
#[cfg(feature = "build")]
pub(crate) fn remove_begun() {
    let begun = begun();
    begun.iter().for_each(|file| drop(fs::remove_file(file)));
    // Nobody begins another one before the end.
    std::mem::forget(begun);
}

/// A place for a file, found writable.
#[derive(Clone, Debug)]
pub(crate) struct Output {
    target: PathBuf,
    /// Beside the target, so that it can be renamed to it.
    temp: PathBuf,
}

impl Output {
    /// Makes sure that there can be a file at `target`, so that nobody draws for an hour in vain.
    pub(crate) fn at(target: &Path) -> Result<Output> {
        let shown = target.display();
        let Some(name) = target.file_name() else { bail!("{shown}: this names no file; add a file name") };
        match fs::metadata(target) {
            Ok(found) if found.is_dir() => bail!("{shown}: this is a directory; add a file name"),
            Ok(found) if !found.is_file() => {
                bail!("{shown}: this is a device or a pipe; choose the name of a file")
            }
            _ => {}
        }
        let mut temp_name = std::ffi::OsString::from(".");
        temp_name.push(name);
        temp_name.push(format!(".{}.partial", std::process::id()));
        let output = Output { target: target.into(), temp: target.with_file_name(temp_name) };
        let tried = output.write_temp(&[]).and_then(|()| fs::remove_file(&output.temp));
        tried.map_err(|error| output.refusal(&error))?;
        Ok(output)
    }

    /// Writes the colours of a picture as PNG; what the texture does not cover shows the background.
    pub(crate) fn write_picture(&self, picture: &Picture) -> Result<()> {
        self.write(&encode(picture).with_context(|| self.target.display().to_string())?)
    }

    /// Writes the whole file.
    pub(crate) fn write(&self, bytes: &[u8]) -> Result<()> {
        let done = self.write_temp(bytes).and_then(|()| fs::rename(&self.temp, &self.target));
        done.map_err(|error| {
            // Where it cannot be removed either, the first error says more.
            let _ = fs::remove_file(&self.temp);
            self.refusal(&error)
        })
    }

    /// Removes what was begun of the file, and a file without bytes in its place; one that has any stays.
    #[cfg(feature = "view")]
    pub(crate) fn discard(&self) {
        // What cannot be removed is not there, or is somebody else's.
        let _ = fs::remove_file(&self.temp);
        if fs::metadata(&self.target).is_ok_and(|found| found.len() == 0) {
            let _ = fs::remove_file(&self.target);
        }
    }

    /// Lets somebody write the whole file, bit by bit, and puts it in its place where that goes well; says
    /// how many bytes it has. An error of the one who writes is the inner one.
    #[cfg(feature = "build")]
    pub(crate) fn write_by<E>(
        &self,
        write: impl FnOnce(&mut dyn Write) -> Result<(), E>,
    ) -> Result<Result<u64, E>> {
        let file = self.begin().map_err(|error| self.refusal(&error))?;
        let mut buffered = io::BufWriter::with_capacity(1 << 20, file);
        let written = write(&mut buffered);
        let failed = |error: &io::Error| {
            let _ = fs::remove_file(&self.temp);
            self.refusal(error)
        };
        if let Err(error) = written {
            // What is left in the buffer is of no use.
            drop(buffered.into_parts());
            let _ = fs::remove_file(&self.temp);
            return Ok(Err(error));
        }
        let done = buffered.into_inner().map_err(io::IntoInnerError::into_error);
        let bytes = done.and_then(|file| Ok(file.metadata()?.len())).map_err(|error| failed(&error))?;
        fs::rename(&self.temp, &self.target).map_err(|error| failed(&error))?;
        Ok(Ok(bytes))
    }

    /// Begins the picture of so many pixels as PNG, whose rows are written as they come.
    pub(crate) fn png_rows(&self, size: [u32; 2]) -> Result<PngRows> {
        let file = self.begin().map_err(|error| self.refusal(&error))?;
        let buffered = io::BufWriter::with_capacity(1 << 20, file);
        let writer = encoder(buffered, size).write_header().and_then(png::Writer::into_stream_writer);
        Ok(PngRows {
            writer: Some(writer.map_err(|error| self.refusal_of_png(error))?),
            output: self.clone(),
        })
    }

    /// What to say where a picture cannot be written.
    fn refusal_of_png(&self, error: png::EncodingError) -> anyhow::Error {
        match error {
            png::EncodingError::IoError(error) => self.refusal(&error),
            error => anyhow!("{}: cannot be written: {error}", self.target.display()),
        }
    }

    fn write_temp(&self, bytes: &[u8]) -> io::Result<()> {
        self.begin()?.write_all(bytes)
    }

    /// Opens the file beside the target, which an interrupt removes.
    fn begin(&self) -> io::Result<fs::File> {
        let mut begun = begun();
        begun.insert(self.temp.clone());
        OpenOptions::new().write(true).create(true).truncate(true).open(&self.temp)
    }

    /// What to say where the system said so of a write.
    pub(crate) fn refusal(&self, error: &io::Error) -> anyhow::Error {
        let target = self.target.display();
        anyhow!("{target}: cannot be written: {error}; {}", remedy(error))
    }
}

/// The name of a file that is not there yet in a directory, or, where nothing can be written there, in the
/// one for temporary files: `earth-1.png` of an `earth.jpg`.
#[cfg(feature = "view")]
pub(crate) fn free_name(directory: &Path, of: &Path, ending: &str) -> PathBuf {
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

/// What to do where the system said so of a write.
fn remedy(error: &io::Error) -> &'static str {
    match error.kind() {
        io::ErrorKind::NotFound => "its directory does not exist: make it, or choose another place",
        io::ErrorKind::PermissionDenied => {
            "you may not write there: change the permissions, or choose another place"
        }
        io::ErrorKind::ReadOnlyFilesystem => "the file system is read-only; choose another place",
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => "free space or choose another place",
        _ => "choose another place",
    }
}

/// The colours of a picture as PNG.
pub(crate) fn encode(picture: &Picture) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let mut writer = encoder(&mut bytes, picture.size).write_header()?;
    writer.write_image_data(&colours(&picture.rgba))?;
    writer.finish()?;
    Ok(bytes)
}

/// A picture that is written row by row. What is not finished is removed.
pub(crate) struct PngRows {
    output: Output,
    writer: Option<png::StreamWriter<'static, io::BufWriter<fs::File>>>,
}

impl PngRows {
    /// Writes the colours of the next rows; what the texture does not cover shows the background.
    pub(crate) fn add(&mut self, rows: &Picture) -> Result<()> {
        let Some(writer) = &mut self.writer else { return Ok(()) };
        for row in rows.rgba.chunks_exact(rows.size[0] as usize * 4) {
            let written = writer.write_all(&colours(row));
            written.map_err(|error| self.output.refusal(&error))?;
        }
        Ok(())
    }

    /// Puts the file in its place, once all rows are written.
    pub(crate) fn finish(mut self) -> Result<()> {
        let Some(mut writer) = self.writer.take() else { return Ok(()) };
        let flushed = writer.flush();
        let finished = writer.finish().map_err(|error| self.output.refusal_of_png(error));
        let done = flushed.and_then(|()| fs::rename(&self.output.temp, &self.output.target));
        let done = finished.and_then(|()| done.map_err(|error| self.output.refusal(&error)));
        if done.is_err() {
            // Where it cannot be removed either, the first error says more.
            let _ = fs::remove_file(&self.output.temp);
        }
        done
    }
}

impl Drop for PngRows {
    fn drop(&mut self) {
        if let Some(writer) = self.writer.take() {
            drop(writer);
            let _ = fs::remove_file(&self.output.temp);
        }
    }
}

fn encoder<W: Write>(writer: W, [width, height]: [u32; 2]) -> png::Encoder<'static, W> {
    let mut encoder = png::Encoder::new(writer, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Fast);
    encoder
}

/// Red, green and blue of each pixel.
fn colours(rgba: &[u8]) -> Vec<u8> {
    let mut colours = vec![0; rgba.len() / 4 * 3];
    for (colour, texel) in colours.chunks_exact_mut(3).zip(rgba.chunks_exact(4)) {
        colour.copy_from_slice(&texel[..3]);
    }
    colours
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(feature = "view")]
    #[test]
    fn a_free_name_is_of_no_file_and_has_no_signs_of_a_path() {
        let directory = tempfile::tempdir().unwrap();
        let named = |of: &str| free_name(directory.path(), Path::new(of), "png");
        assert_eq!(named("a/moon.tif"), directory.path().join("moon-1.png"));
        fs::write(directory.path().join("moon-1.png"), []).unwrap();
        assert_eq!(named("a/moon.tif"), directory.path().join("moon-2.png"));
        assert_eq!(named("planet:31"), directory.path().join("planet-31-1.png"));
        assert_eq!(named(""), directory.path().join("vastex-1.png"));
        // Where nothing can be written, the name is of the directory for temporary files.
        let nowhere = directory.path().join("none");
        assert!(free_name(&nowhere, Path::new("moon.tif"), "png").starts_with(std::env::temp_dir()));
    }

    #[test]
    fn only_a_full_disk_asks_for_space() {
        let says = |kind: io::ErrorKind| remedy(&kind.into());
        assert!(says(io::ErrorKind::StorageFull).contains("free space"));
        for kind in [io::ErrorKind::ReadOnlyFilesystem, io::ErrorKind::PermissionDenied, io::ErrorKind::Other]
        {
            assert!(!says(kind).contains("space") && says(kind).contains("choose another place"));
        }
    }
}
