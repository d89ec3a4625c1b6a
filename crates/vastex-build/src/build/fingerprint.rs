//! What tells one input from another without reading all of it: parts that are made on different machines,
//! and a build that goes on later, must come from the same image.
//!
//! An input is every file that is read for it: of a raw file the description too, of a mosaic the text and
//! all pieces. Between machines names, lengths and a sample of the bytes count; times and places do not,
//! since copies are the same image. A change that keeps all lengths and falls between the samples goes unseen
//! there. On one machine the times of the last change count as well. `docs/format.md` says the same for other
//! writers.

use std::fs::{self, File, Metadata};
use std::hash::Hasher;
use std::io::{self, Read, Seek, SeekFrom};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::UNIX_EPOCH;

use twox_hash::XxHash3_64;

/// Blocks of a file that are read, and their bytes; of a file that has no more, all are.
const BLOCKS: u64 = 64;
const BLOCK_BYTES: u64 = 4096;
/// Blocks of all files of an input together, and those that are read of each file all the same.
const ALL_BLOCKS: u64 = 4096;
const FEWEST_BLOCKS: u64 = 4;
/// Files of a directory that are looked into.
const FILES: usize = 16;
/// Directories within one another; tile directories have fewer, and links may lead round in a circle.
const MAX_DEPTH: u32 = 4;

/// What two inputs share if they are the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Fingerprint {
    /// Of lengths, of a sample of the bytes and, in directories, of names: equal for copies.
    pub(crate) contents: u64,
    /// Of the times at which the files were last changed.
    pub(crate) times: u64,
}

/// Of an input that is made of these files, and of directories with all that is in them.
///
/// Does not depend on where the input lies, or on the order in which a file system lists files. Files in
/// directories whose names begin with a dot do not count. Reads at most 256 KiB of a single file, 16 KiB or
/// more of each of many, and of a directory the lengths and times of all files and 16 of them so. `go_on` is
/// asked before each of the files; `None` where it says that nobody waits any more.
pub(crate) fn input_fingerprint(
    files: &[PathBuf],
    go_on: &dyn Fn() -> ControlFlow<()>,
) -> io::Result<Option<Fingerprint>> {
    let [mut contents, mut times] = [XxHash3_64::new(), XxHash3_64::new()];
    let blocks = (ALL_BLOCKS / (files.len() as u64).max(1)).clamp(FEWEST_BLOCKS, BLOCKS);
    for path in files {
        if go_on().is_break() {
            return Ok(None);
        }
        let found = fs::metadata(path)?;
        if !found.is_dir() {
            add_file(&mut contents, path, blocks)?;
            add_time(&mut times, &found);
            continue;
        }
        let mut listed = Vec::new();
        list(path, "", 0, &mut listed)?;
        listed.sort_by(|a, b| a.0.cmp(&b.0));
        for (name, found, _) in &listed {
            add_number(&mut contents, name.len() as u64);
            contents.write(name.as_bytes());
            add_number(&mut contents, found.len());
            add_time(&mut times, found);
        }
        for n in spaced(listed.len() as u64, FILES as u64) {
            add_file(&mut contents, &listed[n as usize].2, BLOCKS)?;
        }
    }
    Ok(Some(Fingerprint { contents: contents.finish(), times: times.finish() }))
}

/// When a file was last changed, where the system says so, and its length.
fn add_time(hash: &mut XxHash3_64, found: &Metadata) {
    let modified = found.modified().unwrap_or(UNIX_EPOCH);
    let since = modified.duration_since(UNIX_EPOCH).unwrap_or_else(|before| before.duration());
    add_number(hash, found.len());
    add_number(hash, since.as_secs());
    add_number(hash, since.subsec_nanos().into());
}

/// The files in a directory and those below: what to call each from the first directory on, what is known of
/// it, and its path.
fn list(
    directory: &Path,
    name: &str,
    depth: u32,
    files: &mut Vec<(String, Metadata, PathBuf)>,
) -> io::Result<()> {
    for entry in fs::read_dir(directory)? {
        let entry = entry?;
        let file_name = entry.file_name().to_string_lossy().into_owned();
        if file_name.starts_with('.') {
            continue;
        }
        let (path, name) = (entry.path(), format!("{name}/{file_name}"));
        match fs::metadata(&path) {
            Ok(found) if found.is_dir() && depth < MAX_DEPTH => list(&path, &name, depth + 1, files)?,
            Ok(found) if found.is_file() => files.push((name, found, path)),
            // A pipe, or a link to nothing: no image's bytes.
            _ => {}
        }
    }
    Ok(())
}

/// Length and bytes of a file, of so many blocks at most.
fn add_file(hash: &mut XxHash3_64, path: &Path, blocks: u64) -> io::Result<()> {
    let mut file = File::open(path)?;
    let len = file.metadata()?.len();
    add_number(hash, len);
    let mut block = Vec::with_capacity(BLOCK_BYTES as usize);
    if len <= blocks * BLOCK_BYTES {
        file.take(len).read_to_end(&mut block)?;
        hash.write(&block);
        return Ok(());
    }
    for offset in spaced(len - BLOCK_BYTES + 1, blocks) {
        file.seek(SeekFrom::Start(offset))?;
        block.clear();
        (&mut file).take(BLOCK_BYTES).read_to_end(&mut block)?;
        hash.write(&block);
    }
    Ok(())
}

/// At most `count` of the numbers below `end`, evenly spaced, the first and the last among them.
fn spaced(end: u64, count: u64) -> impl Iterator<Item = u64> {
    let count = count.min(end);
    let last = u128::from(end.saturating_sub(1));
    (0..count).map(move |n| (last * u128::from(n) / u128::from(count.max(2) - 1)) as u64)
}

fn add_number(hash: &mut XxHash3_64, number: u64) {
    hash.write(&number.to_le_bytes());
}

#[cfg(test)]
mod tests {
    use super::*;

    fn input_fingerprint(files: &[PathBuf]) -> io::Result<Fingerprint> {
        super::input_fingerprint(files, &|| ControlFlow::Continue(())).map(Option::unwrap)
    }

    fn with(bytes: &[u8], files: &[(&str, &[u8])]) -> u64 {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("it");
        if files.is_empty() {
            fs::write(&path, bytes).unwrap();
        }
        for (name, bytes) in files {
            fs::create_dir_all(path.join(name).parent().unwrap()).unwrap();
            fs::write(path.join(name), bytes).unwrap();
        }
        input_fingerprint(&[path]).unwrap().contents
    }

    #[test]
    fn samples_reach_from_the_first_to_the_last() {
        assert_eq!(spaced(5, 3).collect::<Vec<_>>(), [0, 2, 4]);
        assert_eq!(spaced(3, 16).collect::<Vec<_>>(), [0, 1, 2]);
        assert_eq!((spaced(0, 16).count(), spaced(1, 16).count()), (0, 1));
        assert_eq!(spaced(u64::MAX, 64).last(), Some(u64::MAX - 1));
    }

    #[test]
    fn files_differ_by_length_and_by_sampled_bytes() {
        let bytes = vec![7; 1 << 20];
        let same = with(&bytes, &[]);
        assert_eq!(same, with(&bytes, &[]));
        assert_ne!(same, with(&bytes[1..], &[]));
        for at in [0, 4095, bytes.len() - 4096, bytes.len() - 1] {
            let mut other = bytes.clone();
            other[at] = 8;
            assert_ne!(same, with(&other, &[]), "byte {at}");
        }
        // Small files are read whole.
        assert_ne!(with(b"image", &[]), with(b"imagE", &[]));
    }

    #[test]
    fn directories_differ_by_names_lengths_and_contents() {
        let [a, b]: [(&str, &[u8]); 2] = [("1/a.png", b"aa"), ("1/b.png", b"bbb")];
        let same = with(b"", &[a, b]);
        assert_eq!(same, with(b"", &[b, a]));
        assert_eq!(same, with(b"", &[a, b, ("1/.hidden", b"x")]));
        for other in [&[a][..], &[a, ("1/c.png", b"bbb")], &[a, ("1/b.png", b"bbc")], &[a, b, ("c", b"")]] {
            assert_ne!(same, with(b"", other), "{other:?}");
        }
    }

    #[test]
    fn every_file_of_many_counts_and_so_do_times() {
        let dir = tempfile::tempdir().unwrap();
        let files: Vec<PathBuf> = (0..300).map(|n| dir.path().join(format!("{n:03}"))).collect();
        for path in &files {
            fs::write(path, vec![7; 100_000]).unwrap();
        }
        let same = input_fingerprint(&files).unwrap();
        assert_eq!(same, input_fingerprint(&files).unwrap());
        let file = File::options().write(true).open(&files[170]).unwrap();
        let before = file.metadata().unwrap().modified().unwrap();
        file.set_modified(before + std::time::Duration::from_secs(1)).unwrap();
        let touched = input_fingerprint(&files).unwrap();
        assert!(touched.contents == same.contents && touched.times != same.times);
        let mut bytes = vec![7; 100_000];
        bytes[99_999] = 8;
        fs::write(&files[170], bytes).unwrap();
        file.set_modified(before).unwrap();
        let changed = input_fingerprint(&files).unwrap();
        assert!(changed.contents != same.contents && changed.times == same.times);
    }
}
