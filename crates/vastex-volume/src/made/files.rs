//! Made levels in files, for other runs: one file a chunk, compressed and with a checksum, in a directory of
//! the volume's own.
//!
//! The directory is found by a checksum of what the volume is, and has that in a file, so that two volumes
//! never share one. A file is written beside its place and renamed, so that nobody reads half of one; what is
//! damaged is made again.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use flate2::Crc;

use crate::fault::{VolumeError, VolumeFault};

/// Directories that are tried for volumes whose checksums are the same.
const MOST_TRIED: u32 = 16;
/// What begins a file, with its version.
const MAGIC: &[u8; 8] = b"vxmade\0\x01";
const HEAD: usize = MAGIC.len() + 4;
const IDENTITY: &str = "volume.txt";

pub(super) struct Files {
    directory: PathBuf,
    /// Set once a file could not be written: said once, and no more are tried.
    is_full: AtomicBool,
    written: AtomicU64,
}

impl Files {
    /// The directory of a volume, made if it is not there.
    pub(super) fn open(path: &Path, identity: &str) -> Result<Files, VolumeError> {
        let refused =
            |at: &Path, error: io::Error| VolumeFault::Write(error.to_string()).at(at.display().to_string());
        let sum = checksum(identity.as_bytes());
        for n in 0..MOST_TRIED {
            let directory = path.join("volumes").join(format!("{sum:08x}-{n}"));
            std::fs::create_dir_all(&directory).map_err(|error| refused(&directory, error))?;
            let file = directory.join(IDENTITY);
            match std::fs::read(&file) {
                Ok(found) if found == identity.as_bytes() => {}
                Ok(_) => continue,
                Err(error) if error.kind() == io::ErrorKind::NotFound => {
                    let files = Files::at(directory.clone());
                    files.put(&file, identity.as_bytes()).map_err(|error| refused(&file, error))?;
                }
                Err(error) => {
                    return Err(VolumeFault::Read(error.to_string()).at(file.display().to_string()));
                }
            }
            return Ok(Files::at(directory));
        }
        let why = "there is no place left for the levels of a volume; empty the directory";
        Err(refused(path, io::Error::other(why)))
    }

    /// The directory of a volume, if there is one.
    pub(super) fn find(path: &Path, identity: &str) -> Option<Files> {
        let sum = checksum(identity.as_bytes());
        let directories = (0..MOST_TRIED).map(|n| path.join("volumes").join(format!("{sum:08x}-{n}")));
        let is_of = |directory: &PathBuf| {
            std::fs::read(directory.join(IDENTITY)).is_ok_and(|found| found == identity.as_bytes())
        };
        directories.into_iter().find(is_of).map(Files::at)
    }

    /// How many chunks of a level lie there, `most` at most; whether they are whole shows when they are read.
    pub(super) fn count(&self, level: usize, most: u64) -> u64 {
        let Ok(entries) = std::fs::read_dir(self.directory.join(format!("{level}"))) else { return 0 };
        let mut count = 0;
        for _ in entries.filter_map(Result::ok) {
            count += 1;
            if count == most {
                break;
            }
        }
        count
    }

    fn at(directory: PathBuf) -> Files {
        Files { directory, is_full: AtomicBool::new(false), written: AtomicU64::new(0) }
    }

    fn file(&self, level: usize, [x, y, z]: [u64; 3]) -> PathBuf {
        self.directory.join(format!("{level}")).join(format!("{z}.{y}.{x}"))
    }

    /// A chunk of so many bytes; `None` if it is not there, or damaged.
    pub(super) fn read(&self, level: usize, at: [u64; 3], bytes: usize) -> Option<Vec<u8>> {
        let file = self.file(level, at);
        let most = bytes as u64 + bytes as u64 / 8 + 1024;
        if std::fs::metadata(&file).ok()?.len() > most {
            return None;
        }
        let found = std::fs::read(&file).ok()?;
        let packed = found.get(HEAD..)?;
        let sum = u32::from_le_bytes(found.get(MAGIC.len()..HEAD)?.try_into().ok()?);
        if found[..MAGIC.len()] != *MAGIC || checksum(packed) != sum {
            return None;
        }
        let mut values = vec![0; bytes];
        (lz4_flex::block::decompress_into(packed, &mut values).ok()? == bytes).then_some(values)
    }

    /// Keeps a chunk. The first file that cannot be written is an error, and the last that is tried.
    pub(super) fn write(&self, level: usize, at: [u64; 3], values: &[u8]) -> Result<(), VolumeError> {
        if self.is_full.load(Ordering::Relaxed) {
            return Ok(());
        }
        let packed = lz4_flex::block::compress(values);
        let mut bytes = MAGIC.to_vec();
        bytes.extend(checksum(&packed).to_le_bytes());
        bytes.extend(packed);
        let file = self.file(level, at);
        let kept =
            file.parent().map_or(Ok(()), std::fs::create_dir_all).and_then(|()| self.put(&file, &bytes));
        kept.map_err(|error| {
            self.is_full.store(true, Ordering::Relaxed);
            VolumeFault::Write(error.to_string()).at(file.display().to_string())
        })
    }

    fn put(&self, file: &Path, bytes: &[u8]) -> io::Result<()> {
        let nth = self.written.fetch_add(1, Ordering::Relaxed);
        let beside = self.directory.join(format!("unfinished-{}-{nth}", std::process::id()));
        let put = std::fs::write(&beside, bytes).and_then(|()| std::fs::rename(&beside, file));
        if put.is_err() {
            // It may be that nothing was written.
            drop(std::fs::remove_file(&beside));
        }
        put
    }
}

fn checksum(bytes: &[u8]) -> u32 {
    let mut crc = Crc::new();
    crc.update(bytes);
    crc.sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fault::SourceFault;

    #[test]
    fn what_is_damaged_is_not_there() {
        let directory = tempfile::tempdir().unwrap();
        let files = Files::open(directory.path(), "a volume").unwrap();
        let values: Vec<u8> = (0..5000_u32).map(|n| (n / 7) as u8).collect();
        files.write(2, [1, 2, 3], &values).unwrap();
        let again = Files::open(directory.path(), "a volume").unwrap();
        assert_eq!(again.read(2, [1, 2, 3], 5000), Some(values.clone()));
        assert_eq!((again.read(2, [1, 2, 4], 5000), again.read(2, [1, 2, 3], 4999)), (None, None));
        let file = again.file(2, [1, 2, 3]);
        let sound = std::fs::read(&file).unwrap();
        for at in 0..sound.len() {
            let mut damaged = sound.clone();
            damaged[at] ^= 0x10;
            std::fs::write(&file, &damaged).unwrap();
            assert_eq!(again.read(2, [1, 2, 3], 5000), None, "{at}");
        }
        std::fs::write(&file, &sound[..sound.len() / 2]).unwrap();
        assert_eq!(again.read(2, [1, 2, 3], 5000), None);
    }

    #[test]
    fn volumes_with_one_checksum_have_two_directories() {
        let directory = tempfile::tempdir().unwrap();
        let first = Files::open(directory.path(), "a volume").unwrap();
        std::fs::write(first.directory.join(IDENTITY), "another volume").unwrap();
        let second = Files::open(directory.path(), "a volume").unwrap();
        assert_ne!(first.directory, second.directory);
    }

    #[test]
    fn what_cannot_be_read_is_not_said_to_be_written() {
        let directory = tempfile::tempdir().unwrap();
        let files = Files::open(directory.path(), "a volume").unwrap();
        // A directory in the place of the file that says whose the directory is.
        let file = files.directory.join(IDENTITY);
        std::fs::remove_file(&file).unwrap();
        std::fs::create_dir(&file).unwrap();
        let error = Files::open(directory.path(), "a volume").err().unwrap();
        assert_eq!(error.path, file.display().to_string());
        assert!(matches!(error.fault, VolumeFault::Read(_)), "{error}");
    }

    #[test]
    fn a_full_disk_is_said_once() {
        let directory = tempfile::tempdir().unwrap();
        let files = Files::open(directory.path(), "a volume").unwrap();
        // A file in the place of a level's directory.
        std::fs::write(files.directory.join("0"), b"").unwrap();
        let error = SourceFault::Directory(files.write(0, [0; 3], b"values").unwrap_err()).to_string();
        assert!(error.contains("0.0.0: cannot be written") && error.contains("in memory"), "{error}");
        assert!(files.write(0, [0; 3], b"values").is_ok());
    }
}
