//! A directory on a disk: a key is a path below it.

use std::fs::{self, File};
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use bytes::Bytes;
use vastex_tiles::read_advice;

use super::{KeyFuture, KeyStore, Span, bounds, parts};
use crate::fault::{VolumeError, VolumeFault, damaged};
use crate::spare::Spare;

/// Directories within directories that a listing goes down: chunks of arrays lie at most a dozen deep.
const MOST_DEEP: usize = 32;

/// Directories that a listing looks into beside those that hold a file each.
const MOST_EMPTY: usize = 1 << 16;

/// What is said of a directory, a pipe or a device where a file should lie.
const NO_FILE: &str = "it is no file, but a directory, a pipe or a device; put the file in its place";

/// Files below a directory.
pub(crate) struct Directory {
    root: PathBuf,
    name: String,
    spare: Arc<Spare>,
}

impl Directory {
    pub(crate) fn new(root: &Path) -> Directory {
        Directory { root: root.into(), name: root.display().to_string(), spare: Arc::default() }
    }

    fn path(&self, key: &str) -> Result<PathBuf, VolumeError> {
        let parts = parts(key).ok_or_else(|| {
            damaged(format!("'{key}' leads out of the directory, and is not followed")).at(&self.name)
        })?;
        Ok(parts.iter().fold(self.root.clone(), |path, part| path.join(part)))
    }

    fn read_now(&self, key: &str, span: Span) -> Result<Option<Bytes>, VolumeError> {
        let path = self.path(key)?;
        let refused =
            |error: io::Error| VolumeFault::Read(read_advice(&error)).at(path.display().to_string());
        // What is no file is not opened: opening a pipe waits for somebody who writes to it. Nor is it
        // absent: the fill value would pass for what is stored.
        let mut file = match fs::metadata(&path)
            .and_then(|found| found.is_file().then(|| File::open(&path)).transpose())
        {
            Ok(Some(file)) => file,
            Ok(None) => return Err(VolumeFault::Read(NO_FILE.into()).at(path.display().to_string())),
            Err(error) if is_absent(&error) => return Ok(None),
            Err(error) => return Err(refused(error)),
        };
        let found = file.metadata().map_err(refused)?;
        let (offset, len) =
            bounds(span, found.len()).map_err(|fault| fault.at(path.display().to_string()))?;
        let shorter = || damaged("became shorter while it was read").at(path.display().to_string());
        if offset > 0 {
            file.seek(SeekFrom::Start(offset)).map_err(refused)?;
        }
        let mut bytes = self.spare.take(len);
        if bytes.len() == len {
            return match file.read_exact(&mut bytes) {
                Ok(()) => Ok(Some(self.spare.lend(bytes))),
                Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => Err(shorter()),
                Err(error) => Err(refused(error)),
            };
        }
        bytes.try_reserve_exact(len).map_err(|_| {
            VolumeFault::TooLarge(format!("{len} bytes do not fit into memory"))
                .at(path.display().to_string())
        })?;
        file.take(len as u64).read_to_end(&mut bytes).map_err(refused)?;
        if bytes.len() != len {
            return Err(shorter());
        }
        Ok(Some(self.spare.lend(bytes)))
    }

    fn list_now(&self, prefix: &str, most: usize, found: &mut dyn FnMut(&str)) -> Result<bool, VolumeError> {
        let mut count = 0;
        let root = self.path(prefix)?;
        let mut open = vec![(root, String::new(), 0)];
        let mut opened = 0;
        while let Some((directory, before, depth)) = open.pop() {
            opened += 1;
            let (names, is_cut) = entries(&directory, most.saturating_add(MOST_EMPTY))?;
            // Links can lead round in circles.
            if is_cut || open.len().saturating_add(opened) > most.saturating_add(MOST_EMPTY) {
                return Ok(true);
            }
            for (name, is_directory) in names {
                let key = format!("{before}{name}");
                if is_directory {
                    // Where a chunk should lie it is no file, which reading it says.
                    found(&key);
                }
                if is_directory && depth < MOST_DEEP {
                    open.push((directory.join(&name), format!("{key}/"), depth + 1));
                } else if !is_directory && count == most {
                    return Ok(true);
                } else if !is_directory {
                    count += 1;
                    found(&key);
                }
            }
        }
        Ok(false)
    }
}

/// Returns true if there is no file of that name.
fn is_absent(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        io::ErrorKind::NotFound
            | io::ErrorKind::NotADirectory
            | io::ErrorKind::IsADirectory
            | io::ErrorKind::InvalidFilename
    )
}

/// The names in a directory in order, and which of them are directories; none where there is no such
/// directory. After `most` of them no more are looked at; the last is whether there are more.
fn entries(directory: &Path, most: usize) -> Result<(Vec<(String, bool)>, bool), VolumeError> {
    let refused =
        |error: io::Error| VolumeFault::Read(read_advice(&error)).at(directory.display().to_string());
    let found = match fs::read_dir(directory) {
        Ok(found) => found,
        Err(error) if is_absent(&error) => return Ok((Vec::new(), false)),
        Err(error) => return Err(refused(error)),
    };
    let mut entries = Vec::new();
    let mut is_cut = false;
    for entry in found {
        is_cut = entries.len() == most;
        if is_cut {
            break;
        }
        let entry = entry.map_err(refused)?;
        // A name that is no text is no key.
        let Ok(name) = entry.file_name().into_string() else { continue };
        let kind = entry.file_type().map_err(refused)?;
        let is_directory = kind.is_dir() || (kind.is_symlink() && entry.path().is_dir());
        entries.push((name, is_directory));
    }
    entries.sort_unstable();
    Ok((entries, is_cut))
}

impl KeyStore for Directory {
    fn name(&self) -> &str {
        &self.name
    }

    fn spare(&self) -> &Arc<Spare> {
        &self.spare
    }

    fn read<'a>(&'a self, key: &'a str, span: Span) -> KeyFuture<'a, Option<Bytes>> {
        Box::pin(async move { self.read_now(key, span) })
    }

    fn list<'a>(
        &'a self,
        prefix: &'a str,
        most: usize,
        found: &'a mut (dyn FnMut(&str) + Send),
    ) -> KeyFuture<'a, bool> {
        Box::pin(async move { self.list_now(prefix, most, found) })
    }

    fn is_listed(&self) -> bool {
        false
    }

    fn groups<'a>(&'a self, prefix: &'a str, most: usize) -> KeyFuture<'a, Vec<String>> {
        Box::pin(async move {
            let (found, _) = entries(&self.path(prefix)?, most)?;
            Ok(found.into_iter().filter(|(_, is_directory)| *is_directory).map(|(name, _)| name).collect())
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_beyond_those_asked_for_are_not_looked_at() {
        let directory = tempfile::tempdir().unwrap();
        for n in 0..30 {
            fs::write(directory.path().join(n.to_string()), b"").unwrap();
        }
        let found = |most| entries(directory.path(), most).map(|(names, is_cut)| (names.len(), is_cut));
        assert_eq!([found(10), found(30), found(31)], [Ok((10, true)), Ok((30, false)), Ok((30, false))]);
        let listed = |most| {
            let mut count = 0;
            let is_cut = Directory::new(directory.path()).list_now("", most, &mut |_| count += 1).unwrap();
            (count, is_cut)
        };
        assert_eq!([listed(29), listed(30)], [(29, true), (30, false)]);
    }
}
