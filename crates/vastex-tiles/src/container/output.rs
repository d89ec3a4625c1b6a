//! A file that appears whole or not at all: written under a temporary name beside its place, renamed when done.

use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

/// Bytes collected before they are handed to the system.
const BUFFER_BYTES: usize = 1 << 20;

/// A file being written under a temporary name. Removed when dropped, unless it was put in its place.
#[derive(Debug)]
pub struct TempFile {
    file: BufWriter<File>,
    temp: PathBuf,
    target: PathBuf,
    in_place: bool,
}

impl TempFile {
    /// Creates the temporary file in the directory of `target`; fails where that could not be written at the end.
    pub(super) fn create(target: &Path) -> io::Result<TempFile> {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let Some(name) = target.file_name() else {
            return Err(io::Error::other("this names no file; add a file name"));
        };
        // What a link leads to is replaced, not the link.
        let resolved =
            if target.is_symlink() { std::fs::canonicalize(target)? } else { target.to_path_buf() };
        let target = resolved.as_path();
        let name = target.file_name().unwrap_or(name);
        if target.is_dir() {
            return Err(io::Error::other("this is a directory; add a file name"));
        }
        if target.exists() && !target.is_file() {
            return Err(io::Error::other("this is a device or a pipe, which would be replaced by a file"));
        }
        loop {
            let count = COUNT.fetch_add(1, Ordering::Relaxed);
            let mut temp_name = std::ffi::OsString::from(".");
            temp_name.push(name);
            temp_name.push(format!(".{}-{count}.partial", std::process::id()));
            let temp = target.with_file_name(temp_name);
            match OpenOptions::new().write(true).create_new(true).open(&temp) {
                Ok(file) => {
                    let file = BufWriter::with_capacity(BUFFER_BYTES, file);
                    return Ok(TempFile { file, temp, target: target.into(), in_place: false });
                }
                // Left behind by a process of the same number that was killed.
                Err(e) if e.kind() == io::ErrorKind::AlreadyExists => {}
                Err(e) => return Err(e),
            }
        }
    }

    /// The temporary name: what a program removes when it is interrupted.
    pub fn temp_path(&self) -> &Path {
        &self.temp
    }

    /// Puts the file in its place, over what was there; `durable` waits until the disk has it.
    pub(super) fn put_in_place(mut self, durable: bool) -> io::Result<()> {
        self.file.flush()?;
        if durable {
            self.file.get_ref().sync_all()?;
        }
        fs::rename(&self.temp, &self.target)?;
        self.in_place = true;
        if durable {
            sync_directory_of(&self.target)?;
        }
        Ok(())
    }
}

/// Makes the new name durable too.
fn sync_directory_of(path: &Path) -> io::Result<()> {
    if !cfg!(unix) {
        return Ok(());
    }
    let parent = path.parent().filter(|parent| !parent.as_os_str().is_empty());
    File::open(parent.unwrap_or(Path::new(".")))?.sync_all()
}

impl Drop for TempFile {
    fn drop(&mut self) {
        if !self.in_place
            && let Err(error) = fs::remove_file(&self.temp)
        {
            tracing::warn!(path = %self.temp.display(), %error, "a temporary file could not be removed");
        }
    }
}

impl Write for TempFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl Seek for TempFile {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.file.seek(to)
    }
}
