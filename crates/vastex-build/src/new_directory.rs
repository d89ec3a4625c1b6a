//! A directory that appears whole or not at all: filled under a temporary name beside its place, renamed when
//! done. What killed processes left beside a place goes with the next one that is made there.

use std::ffi::OsString;
use std::fs::{self, File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

use vastex_tiles::{remove_abandoned, resolved, write_advice};

/// Why a directory cannot be made or filled.
#[derive(Debug)]
pub(crate) enum DirectoryFault {
    /// The directory cannot be made, or cannot be put in its place: its path, what is wrong, and what to do.
    Target(PathBuf, String),
    /// A file of it cannot be written.
    Output(PathBuf, String),
}

/// A directory being filled. Removed with all that is in it when dropped, unless it was put in its place.
#[derive(Debug)]
pub(crate) struct NewDirectory {
    temp: PathBuf,
    target: PathBuf,
    in_place: bool,
    /// Which directories that have something in them make way.
    may_replace: fn(&Path) -> bool,
    /// Locked, which says that somebody is at work here; `None` if the system has no handles or no locks
    /// of directories.
    _lock: Option<File>,
}

impl NewDirectory {
    /// Makes the temporary directory; fails where there is something at `target` already, unless it is an
    /// empty directory, or one of which `may_replace` says that it may go.
    pub(crate) fn create(
        target: &Path,
        may_replace: fn(&Path) -> bool,
    ) -> Result<NewDirectory, DirectoryFault> {
        let refused = |why: String| DirectoryFault::Target(target.into(), why);
        check_free(target, may_replace).map_err(&refused)?;
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
                            may_replace,
                            _lock: handle,
                        });
                    }
                }
                // Left behind by a process of the same number that was killed, or another one of this
                // process.
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                Err(error) => return Err(refused(format!("cannot be made: {}", write_advice(&error)))),
            }
        }
        Err(refused(
            "cannot be made: every temporary name is taken; remove the .partial directories beside it".into(),
        ))
    }

    /// Where a file of the directory will be, for messages.
    pub(crate) fn path(&self, inside: &Path) -> PathBuf {
        self.target.join(inside)
    }

    /// Makes a directory in it, with those above.
    pub(crate) fn make(&self, inside: &Path) -> Result<(), DirectoryFault> {
        fs::create_dir_all(self.temp.join(inside)).map_err(|error| self.fault(inside, &error))
    }

    /// Writes a file in it.
    pub(crate) fn write(&self, inside: &Path, bytes: &[u8]) -> Result<(), DirectoryFault> {
        fs::write(self.temp.join(inside), bytes).map_err(|error| self.fault(inside, &error))
    }

    /// Gives it its name. An empty directory makes way, and one that may be replaced: that is renamed first,
    /// and removed once the new one stands.
    pub(crate) fn put_in_place(mut self) -> Result<(), DirectoryFault> {
        let refused = |why: String| DirectoryFault::Target(self.target.clone(), why);
        check_free(&self.target, self.may_replace).map_err(&refused)?;
        let renamed = match self.target.exists() {
            true if is_empty(&self.target) => {
                fs::remove_dir(&self.target).and_then(|()| fs::rename(&self.temp, &self.target))
            }
            true => self.exchange(),
            false => fs::rename(&self.temp, &self.target),
        };
        renamed.map_err(|error| refused(format!("cannot be put in place: {}", write_advice(&error))))?;
        self.in_place = true;
        Ok(())
    }

    /// Puts the directory in the place of the one that is there.
    fn exchange(&self) -> io::Result<()> {
        // Beside the new one, whose name is nobody else's; if this process is killed, it goes like that.
        let mut old = self.temp.with_extension("").into_os_string();
        old.push("00.partial");
        let old = PathBuf::from(old);
        fs::rename(&self.target, &old)?;
        if let Err(error) = fs::rename(&self.temp, &self.target) {
            fs::rename(&old, &self.target)?;
            return Err(error);
        }
        fs::remove_dir_all(&old)
    }

    /// Writes a file in it, and makes the directories that it lies in where they are not there.
    #[cfg(feature = "volumes")]
    pub(crate) fn write_deep(&self, inside: &Path, bytes: &[u8]) -> Result<(), DirectoryFault> {
        let written = fs::write(self.temp.join(inside), bytes);
        if written.as_ref().is_err_and(|error| error.kind() == io::ErrorKind::NotFound)
            && let Some(parent) = inside.parent()
        {
            self.make(parent)?;
            return self.write(inside, bytes);
        }
        written.map_err(|error| self.fault(inside, &error))
    }

    fn fault(&self, inside: &Path, error: &io::Error) -> DirectoryFault {
        DirectoryFault::Output(self.path(inside), write_advice(error))
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
fn check_free(target: &Path, may_replace: fn(&Path) -> bool) -> Result<(), String> {
    match fs::metadata(target) {
        Err(_) => Ok(()),
        Ok(found) if !found.is_dir() => Err("there is a file of this name; choose another".into()),
        Ok(_) => match fs::read_dir(target).map(|mut entries| entries.next().is_none()) {
            Ok(true) => Ok(()),
            Ok(false) if may_replace(target) => Ok(()),
            Ok(false) => Err("this directory is not empty; empty it, or choose another".into()),
            Err(error) => Err(format!("cannot be read: {error}; choose another place")),
        },
    }
}

/// Returns true if a directory has nothing in it, as far as that can be told.
fn is_empty(directory: &Path) -> bool {
    fs::read_dir(directory).is_ok_and(|mut entries| entries.next().is_none())
}
