//! A directory that appears whole or not at all: filled under a temporary name beside its place, renamed when
//! done. What killed processes left beside a place goes with the next export into it.

use std::ffi::OsString;
use std::fs::{self, File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

use vastex_tiles::{remove_abandoned, resolved, write_advice};

use super::ExportError;

/// A directory being filled. Removed with all that is in it when dropped, unless it was put in its place.
#[derive(Debug)]
pub(super) struct NewDirectory {
    temp: PathBuf,
    target: PathBuf,
    in_place: bool,
    /// Locked, which says that somebody is at work here; `None` if the system has no handles or no locks
    /// of directories.
    _lock: Option<File>,
}

impl NewDirectory {
    /// Makes the temporary directory; fails where there is something at `target` already.
    pub(super) fn create(target: &Path) -> Result<NewDirectory, ExportError> {
        let refused = |why: String| ExportError::Target { path: target.into(), why };
        check_free(target).map_err(&refused)?;
        // Without a slash at the end, behind which the system looks through a link.
        let target = resolved(&target.components().collect::<PathBuf>()).map_err(|error| {
            refused(format!(
                "is a link that leads to no directory: {error}; make that directory, or remove the link"
            ))
        })?;
        let target = target.as_path();
        let name = target.file_name().ok_or_else(|| refused("this names no directory; add a name".into()))?;
        remove_abandoned(target);
        for count in 0u32.. {
            let mut temp_name = OsString::from(".");
            temp_name.push(name);
            temp_name.push(format!(".{}-{count}.partial", std::process::id()));
            let temp = target.with_file_name(temp_name);
            match fs::create_dir(&temp) {
                Ok(()) => {
                    let handle = File::open(&temp).ok();
                    let lock = handle.as_ref().map(File::try_lock);
                    // Before it was locked, another process may have taken it for left behind.
                    let is_lost = match lock {
                        Some(Ok(())) => !temp.is_dir(),
                        Some(Err(TryLockError::WouldBlock)) => true,
                        Some(Err(TryLockError::Error(_))) | None => false,
                    };
                    if !is_lost {
                        return Ok(NewDirectory {
                            temp,
                            target: target.into(),
                            in_place: false,
                            _lock: handle,
                        });
                    }
                }
                // Left behind by a process of the same number that was killed, or another export of this one.
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                Err(error) => return Err(refused(format!("cannot be made: {}", write_advice(&error)))),
            }
        }
        Err(refused(
            "cannot be made: every temporary name is taken; remove the .partial directories beside it".into(),
        ))
    }

    /// Where a file of the directory will be, for messages.
    pub(super) fn path(&self, inside: &Path) -> PathBuf {
        self.target.join(inside)
    }

    /// Makes a directory in it, with those above.
    pub(super) fn make(&self, inside: &Path) -> Result<(), ExportError> {
        fs::create_dir_all(self.temp.join(inside)).map_err(|error| self.fault(inside, &error))
    }

    /// Writes a file in it.
    pub(super) fn write(&self, inside: &Path, bytes: &[u8]) -> Result<(), ExportError> {
        fs::write(self.temp.join(inside), bytes).map_err(|error| self.fault(inside, &error))
    }

    /// Gives it its name. Only an empty directory makes way.
    pub(super) fn put_in_place(mut self) -> Result<(), ExportError> {
        let refused = |why: String| ExportError::Target { path: self.target.clone(), why };
        check_free(&self.target).map_err(&refused)?;
        let renamed = match self.target.exists() {
            true => fs::remove_dir(&self.target).and_then(|()| fs::rename(&self.temp, &self.target)),
            false => fs::rename(&self.temp, &self.target),
        };
        renamed.map_err(|error| refused(format!("cannot be put in place: {}", write_advice(&error))))?;
        self.in_place = true;
        Ok(())
    }

    fn fault(&self, inside: &Path, error: &io::Error) -> ExportError {
        ExportError::Output { path: self.path(inside), why: write_advice(error) }
    }
}

impl Drop for NewDirectory {
    fn drop(&mut self) {
        if !self.in_place {
            // Nobody is left to tell where it cannot be removed.
            let _ = fs::remove_dir_all(&self.temp);
        }
    }
}

/// Says why there cannot be a new directory at `target`.
fn check_free(target: &Path) -> Result<(), String> {
    match fs::metadata(target) {
        Err(_) => Ok(()),
        Ok(found) if !found.is_dir() => Err("there is a file of this name; choose another".into()),
        Ok(_) => match fs::read_dir(target).map(|mut entries| entries.next().is_none()) {
            Ok(true) => Ok(()),
            Ok(false) => Err("this directory is not empty; empty it, or choose another".into()),
            Err(error) => Err(format!("cannot be read: {error}; choose another place")),
        },
    }
}
