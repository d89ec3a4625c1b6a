//! A file that appears whole or not at all: written under a temporary name beside its place, renamed when
//! done.
//!
//! There are two kinds of temporary names. A name of its own for each file leaves something behind only if
//! the process is killed, and that is removed by the next writer to the same place. The name that all builds
//! into one place share keeps what an interrupted build had written, so that a later build finds it.

use std::ffi::OsString;
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, BufReader, BufWriter, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

/// Bytes collected before they are handed to the system. What is larger is handed over as it is, without a
/// copy.
const BUFFER_BYTES: usize = 64 << 10;

/// A file being written under a temporary name. Removed when dropped, unless it was put in its place or is to
/// be kept.
#[derive(Debug)]
pub struct TempFile {
    file: BufWriter<File>,
    temp: PathBuf,
    target: PathBuf,
    keep: bool,
}

impl TempFile {
    /// Creates a temporary file with a name of its own, in the directory of `target`. Fails if `target` could
    /// not be written at the end.
    pub(super) fn create(target: &Path) -> io::Result<TempFile> {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let target = checked_target(target)?;
        remove_abandoned(&target);
        loop {
            let count = COUNT.fetch_add(1, Ordering::Relaxed);
            let temp = beside(&target, &format!("{}-{count}.partial", std::process::id()));
            match OpenOptions::new().write(true).create_new(true).open(&temp) {
                Ok(file) => {
                    // Says that it is at work. Where the file system has no locks, nobody removes what others
                    // left.
                    let lock = file.try_lock();
                    // Before it was locked, another process may have taken it for left behind.
                    let is_lost = matches!(lock, Err(TryLockError::WouldBlock))
                        || (lock.is_ok() && !is_still_at(&file, &temp)?);
                    if !is_lost {
                        return Ok(TempFile::new(file, temp, target, false));
                    }
                }
                // Left behind by a process of the same number that was killed.
                Err(e) if e.kind() == io::ErrorKind::AlreadyExists => {}
                Err(e) => return Err(e),
            }
        }
    }

    /// Opens the temporary file that all builds into `target` share, with what an interrupted build left in
    /// it. `None` if another process has it; a file system without locks keeps nobody out.
    ///
    /// A file that has bytes is kept when dropped, until [`TempFile::set_keep`] says otherwise.
    pub(super) fn claim(target: &Path) -> io::Result<Option<TempFile>> {
        let target = checked_target(target)?;
        let temp = beside(&target, "partial");
        loop {
            if fs::symlink_metadata(&temp).is_ok_and(|found| !found.is_file()) {
                let name = temp.display();
                return Err(io::Error::other(format!("{name} is in the way and no file; remove it")));
            }
            let file = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(&temp)?;
            if matches!(file.try_lock(), Err(TryLockError::WouldBlock)) {
                return Ok(None);
            }
            // Between opening and locking it, its last owner may have put it in its place or removed it.
            if is_still_at(&file, &temp)? {
                let keep = file.metadata()?.len() > 0;
                return Ok(Some(TempFile::new(file, temp, target, keep)));
            }
        }
    }

    fn new(file: File, temp: PathBuf, target: PathBuf, keep: bool) -> TempFile {
        TempFile { file: BufWriter::with_capacity(BUFFER_BYTES, file), temp, target, keep }
    }

    /// The temporary name, which a program removes when it is interrupted.
    pub fn temp_path(&self) -> &Path {
        &self.temp
    }

    /// The name of the journal that belongs to a claimed file.
    pub(super) fn journal_path(&self) -> PathBuf {
        beside(&self.target, "journal")
    }

    /// Sets that the file stays when it is dropped.
    pub(super) fn set_keep(&mut self, keep: bool) {
        self.keep = keep;
    }

    /// Leaves `len` bytes and goes on behind them.
    pub(super) fn go_on_at(&mut self, len: u64) -> io::Result<()> {
        self.file.flush()?;
        // Only where there is something to cut: ext4 writes a file that was ever cut to nothing to the disk
        // when it is closed.
        if self.file.get_ref().metadata()?.len() != len {
            self.file.get_ref().set_len(len)?;
        }
        self.file.seek(SeekFrom::Start(len)).map(drop)
    }

    /// Reads a claimed file from byte `offset` on. Writing continues only after [`TempFile::go_on_at`].
    pub(super) fn reader_at(&mut self, offset: u64) -> io::Result<impl Read + use<>> {
        self.file.seek(SeekFrom::Start(offset))?;
        Ok(BufReader::with_capacity(BUFFER_BYTES, self.file.get_ref().try_clone()?))
    }

    /// Puts the file in its place, replacing what was there; `durable` waits until the disk has it.
    pub(super) fn put_in_place(mut self, durable: bool) -> io::Result<()> {
        self.file.flush()?;
        if durable {
            self.file.get_ref().sync_all()?;
        }
        fs::rename(&self.temp, &self.target)?;
        self.keep = true;
        if durable {
            sync_directory_of(&self.target)?;
        }
        Ok(())
    }
}

/// Removes the files and directories that killed processes left beside `target` under names of their own,
/// `.NAME.PROCESS-COUNT.partial`. Processes at work hold locks on theirs; on a file system without locks, all
/// are left alone.
pub fn remove_abandoned(target: &Path) {
    let (Some(name), Some(directory)) = (target.file_name(), target.parent()) else { return };
    let directory = if directory.as_os_str().is_empty() { Path::new(".") } else { directory };
    // Where the directory cannot be read, nothing is found; what cannot be removed is in nobody's way.
    let Ok(entries) = fs::read_dir(directory) else { return };
    let left = entries
        .flatten()
        .filter(|entry| is_own_name(&entry.file_name().to_string_lossy(), &name.to_string_lossy()));
    for entry in left {
        let Ok(kind) = entry.file_type() else { continue };
        // A pipe would be waited for.
        if !(kind.is_file() || kind.is_dir()) {
            continue;
        }
        let path = entry.path();
        let Ok(file) = File::open(&path) else { continue };
        if file.try_lock().is_ok() && matches!(is_still_at(&file, &path), Ok(true)) {
            let _ = if kind.is_dir() { fs::remove_dir_all(&path) } else { fs::remove_file(&path) };
        }
    }
}

/// Returns true if a name is `.OF.PROCESS-COUNT.partial`.
fn is_own_name(name: &str, of: &str) -> bool {
    let rest = name
        .strip_prefix('.')
        .and_then(|rest| rest.strip_prefix(of)?.strip_prefix('.')?.strip_suffix(".partial"));
    let is_number = |digits: &str| !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit());
    rest.and_then(|rest| rest.split_once('-'))
        .is_some_and(|(process, count)| is_number(process) && is_number(count))
}

/// Where a file or directory that replaces `target` belongs: at what a link leads to, since replacing that
/// keeps the link, else at `target` itself. Fails if a link leads nowhere.
pub fn resolved(target: &Path) -> io::Result<PathBuf> {
    if target.is_symlink() { fs::canonicalize(target) } else { Ok(target.to_path_buf()) }
}

/// The path at which the file will stand. If `target` is a link, what it leads to is replaced, not the link.
fn checked_target(target: &Path) -> io::Result<PathBuf> {
    if target.file_name().is_none() {
        return Err(io::Error::other("this names no file; add a file name"));
    }
    let target = resolved(target)?;
    if target.is_dir() {
        return Err(io::Error::other("this is a directory; add a file name"));
    }
    if target.exists() && !target.is_file() {
        return Err(io::Error::other("this is a device or a pipe, which would be replaced by a file"));
    }
    Ok(target)
}

/// `.NAME.suffix`, beside the target.
fn beside(target: &Path, suffix: &str) -> PathBuf {
    let mut name = OsString::from(".");
    name.push(target.file_name().unwrap_or_default());
    name.push(".");
    name.push(suffix);
    target.with_file_name(name)
}

/// Returns true if the open file is the one to which the path leads.
#[cfg(unix)]
fn is_still_at(file: &File, path: &Path) -> io::Result<bool> {
    use std::os::unix::fs::MetadataExt;
    let own = file.metadata()?;
    match fs::symlink_metadata(path) {
        Ok(found) => Ok((found.dev(), found.ino()) == (own.dev(), own.ino())),
        Err(e) if e.kind() == io::ErrorKind::NotFound => Ok(false),
        Err(e) => Err(e),
    }
}

/// Other systems do not rename or remove a file that is open and locked.
#[cfg(not(unix))]
fn is_still_at(_: &File, _: &Path) -> io::Result<bool> {
    Ok(true)
}

/// The message of a failed write, and what to do about it.
pub fn write_advice(error: &io::Error) -> String {
    let remedy = match error.kind() {
        // Said here, remedy included.
        io::ErrorKind::Other if error.raw_os_error().is_none() => return error.to_string(),
        io::ErrorKind::NotFound => "its directory does not exist: make it, or choose another place",
        io::ErrorKind::NotADirectory => "its path leads through a file; choose another place",
        io::ErrorKind::PermissionDenied => {
            "you may not write there: change the permissions, or choose another place"
        }
        io::ErrorKind::ReadOnlyFilesystem => "the file system is read-only; choose another place",
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => "free space or choose another place",
        io::ErrorKind::FileTooLarge => {
            "no file may become so large there: raise the limit (`ulimit -f`), or choose another place"
        }
        _ => "choose another place",
    };
    format!("{error}; {remedy}")
}

/// Waits until the disk has the new name.
fn sync_directory_of(path: &Path) -> io::Result<()> {
    if !cfg!(unix) {
        return Ok(());
    }
    let parent = path.parent().filter(|parent| !parent.as_os_str().is_empty());
    File::open(parent.unwrap_or(Path::new(".")))?.sync_all()
}

impl Drop for TempFile {
    fn drop(&mut self) {
        if !self.keep
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_their_own_are_told() {
        assert!(is_own_name(".a.vastex.12-0.partial", "a.vastex"));
        for other in [
            ".a.vastex.partial",
            ".a.vastex.12.partial",
            ".a.vastex.-0.partial",
            ".a.vastex.x-0.partial",
            ".b.a.vastex.12-0.partial",
            "a.vastex.12-0.partial",
            ".a.vastex.12-0.partial.b",
        ] {
            assert!(!is_own_name(other, "a.vastex"), "{other}");
        }
    }

    #[test]
    fn what_cannot_be_written_says_what_to_do() {
        use io::ErrorKind as Kind;

        use crate::container::write::error::WriteError;
        use crate::container::write::merge::MergeError;

        for (kind, says) in [
            (Kind::ReadOnlyFilesystem, "the file system is read-only; choose another place"),
            (Kind::PermissionDenied, "you may not write there: change the permissions"),
            (Kind::NotFound, "its directory does not exist: make it"),
            (Kind::NotADirectory, "its path leads through a file"),
            (Kind::StorageFull, "free space or choose another place"),
            (Kind::QuotaExceeded, "free space or choose another place"),
            (Kind::FileTooLarge, "`ulimit -f`"),
            (Kind::TimedOut, "; choose another place"),
        ] {
            // Said alike of a build and of a merge, with the name of the file.
            let error = || WriteError::Io { name: "out.vastex".into(), error: kind.into() };
            for said in [error().to_string(), MergeError::from(error()).to_string()] {
                assert!(said.starts_with("out.vastex: cannot be written: ") && said.contains(says), "{said}");
            }
        }
    }

    #[cfg(unix)]
    #[test]
    fn what_killed_processes_left_goes_and_what_others_write_stays() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        for name in [".out.1-0.partial", ".out.4000000-17.partial", ".out.partial", ".other.1-0.partial"] {
            fs::write(at(name), b"left").unwrap();
        }
        fs::create_dir(at(".out.2-0.partial")).unwrap();
        fs::write(at(".out.2-0.partial/tile"), b"left").unwrap();
        let first = TempFile::create(&at("out")).unwrap();
        let second = TempFile::create(&at("out")).unwrap();
        let mut names: Vec<_> = fs::read_dir(dir.path()).unwrap().map(|e| e.unwrap().path()).collect();
        names.sort();
        let mut expected = vec![
            at(".other.1-0.partial"),
            at(".out.partial"),
            first.temp_path().into(),
            second.temp_path().into(),
        ];
        expected.sort();
        assert_eq!(names, expected);
    }
}
