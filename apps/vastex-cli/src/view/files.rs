//! Which files there are to step through: those that a person named or dropped, or, for a single one, those
//! beside it.

use std::cmp::Ordering;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::time::Duration;

use vastex_tiles::raw_description;

use crate::args::NO_FILE;
use crate::open;

/// Endings of the files of a folder that are stepped through. Any file can be named.
const ENDINGS: [&str; 11] = ["vastex", "jpg", "jpeg", "png", "tif", "tiff", "svs", "tx", "exr", "dzi", "ctx"];
/// Endings of files that are volumes.
const VOLUMES: [&str; 2] = [".nii", ".nii.gz"];
/// The ending of directories that are volumes.
const VOLUME_DIRECTORY: &str = ".zarr";
/// Directories and archives of a folder that are looked into at most, to see whether they can be shown. A
/// person waits meanwhile, so of each a few names are read and no more.
const MOST_LOOKED_INTO: usize = 256;
/// What the files of Zarr are called that say what its arrays are.
const OF_ZARR: [&str; 5] = ["zarr.json", ".zattrs", ".zgroup", ".zarray", ".zmetadata"];
/// Bytes of an archive that are read.
const BEGINNING: u64 = 4096;
/// What the header of a file in an archive begins with, and its bytes before the file's name.
const ZIP_HEADER: [u8; 4] = *b"PK\x03\x04";
const ZIP_HEADER_BYTES: usize = 30;
/// Files that are dropped within this time are dropped together.
const TOGETHER: Duration = Duration::from_millis(200);

/// A list of files and the one that is shown.
pub(super) struct Files {
    files: Vec<PathBuf>,
    current: usize,
    dropped_at: Option<Duration>,
    /// The steps that were asked for while the folder of a single file is being listed.
    waiting: Option<i32>,
}

/// What becomes of a step to another file.
#[derive(Debug, PartialEq)]
pub(super) enum Step {
    /// Another file is to be shown.
    Other,
    /// There is no other.
    Nowhere,
    /// What lies beside this file is to be listed first, by [`list_beside`]; [`Files::take`] goes on.
    List(PathBuf),
    /// The folder is being listed, or the step is not wanted any more.
    Waiting,
}

/// What lies beside a file, and which of that the file is; `None` if there is no such folder.
pub(super) struct Folder {
    file: PathBuf,
    found: Option<(Vec<PathBuf>, usize)>,
}

/// Lists what lies beside a file. Reads names of the folder and a few of directories and archives in it,
/// which may take long where the folder is far away: no work for the thread of a window.
pub(super) fn list_beside(file: PathBuf) -> Folder {
    let found = folder_of(&file);
    Folder { file, found }
}

impl Folder {
    /// Nothing beside a file, where nothing can be listed.
    pub(super) fn none(file: PathBuf) -> Folder {
        Folder { file, found: None }
    }
}

impl Files {
    pub(super) fn new(first: &Path, others: &[PathBuf]) -> Files {
        let files = std::iter::once(first.to_owned()).chain(others.iter().cloned()).collect();
        Files { files, current: 0, dropped_at: None, waiting: None }
    }

    /// Files of which one is to be shown.
    pub(super) fn among(files: Vec<PathBuf>, current: usize) -> Files {
        Files { files, current, dropped_at: None, waiting: None }
    }

    /// The file to show.
    pub(super) fn current(&self) -> &Path {
        &self.files[self.current]
    }

    /// Returns true if the window waits for a first file.
    pub(super) fn are_none(&self) -> bool {
        self.current() == Path::new(NO_FILE)
    }

    /// A file was dropped at a time. The first one dropped is shown, and those that come with it are stepped
    /// through.
    pub(super) fn drop_in(&mut self, path: &Path, now: Duration) -> bool {
        let is_first = self.dropped_at.is_none_or(|before| now.saturating_sub(before) > TOGETHER);
        self.dropped_at = Some(now);
        self.waiting = None;
        if is_first {
            (self.files, self.current) = (vec![path.to_owned()], 0);
        } else {
            self.files.push(path.to_owned());
        }
        is_first
    }

    /// Goes so many files on, round from the last to the first.
    pub(super) fn step(&mut self, step: i32) -> Step {
        let [single] = &self.files[..] else { return self.go(step) };
        match &mut self.waiting {
            Some(waiting) => {
                *waiting = waiting.saturating_add(step);
                Step::Waiting
            }
            None => {
                self.waiting = Some(step);
                // Beside an image in a file is what lies beside the file.
                Step::List(open::file_of(single).to_owned())
            }
        }
    }

    /// Hears what lies beside a file, and goes the steps that wait for that.
    pub(super) fn take(&mut self, folder: Folder) -> Step {
        let is_of = matches!(&self.files[..], [single] if open::file_of(single) == folder.file);
        let Some(step) = self.waiting.take_if(|_| is_of) else { return Step::Waiting };
        let Some((files, current)) = folder.found else { return Step::Nowhere };
        (self.files, self.current) = (files, current);
        self.go(step)
    }

    /// These files are shown again after others: what was waited for has gone to those.
    pub(super) fn wait_no_more(&mut self) {
        self.waiting = None;
    }

    fn go(&mut self, step: i32) -> Step {
        let before = self.current;
        let count = self.files.len() as i64;
        self.current = (before as i64 + i64::from(step)).rem_euclid(count) as usize;
        match self.current == before {
            true if count == 1 => Step::Nowhere,
            // There and back again.
            true => Step::Waiting,
            false => Step::Other,
        }
    }
}

/// What of a folder may be shown, directories of tiles and of volumes too, in the order of their names, and
/// which of them `file` is. Numbers in names are ordered by how large they are.
fn folder_of(file: &Path) -> Option<(Vec<PathBuf>, usize)> {
    let folder = match file.parent()? {
        folder if folder.as_os_str().is_empty() => Path::new("."),
        folder => folder,
    };
    let mut looked_into = 0;
    let entries = std::fs::read_dir(folder).ok()?.filter_map(Result::ok).map(|entry| entry.path());
    let mut files: Vec<(String, PathBuf)> = entries
        .filter(|path| path.file_name() == file.file_name() || may_be_shown(path, &mut looked_into))
        .map(|path| (path.file_name().unwrap_or_default().to_string_lossy().to_lowercase(), path))
        .collect();
    files.sort_by(|(name, path), (other, other_path)| by_numbers(name, other).then(path.cmp(other_path)));
    let files: Vec<PathBuf> = files.into_iter().map(|(_, path)| path).collect();
    let current = files.iter().position(|path| path.file_name() == file.file_name())?;
    Some((files, current))
}

/// Returns true if something of a folder looks as if it can be shown, by its name and, of directories and
/// archives, by names in it. No file but the beginning of an archive is read.
fn may_be_shown(path: &Path, looked_into: &mut usize) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
    let ending = name.rsplit_once('.').map_or("", |(_, ending)| ending);
    let has_volumes = cfg!(feature = "volumes");
    let mut may_look = || {
        *looked_into += 1;
        *looked_into <= MOST_LOOKED_INTO
    };
    if path.is_dir() {
        // Those of a .dzi file are stepped to by that.
        let is_of_description = name.ends_with("_files");
        return has_volumes && name.ends_with(VOLUME_DIRECTORY)
            || !is_of_description && may_look() && open::may_be_directory_of_tiles(path);
    }
    let is_volume = || VOLUMES.iter().any(|ending| name.ends_with(ending));
    match ending {
        ending if ENDINGS.contains(&ending) => path.is_file(),
        // What others are beside images.
        "raw" => path.is_file() && raw_description(path).is_file(),
        "zip" => has_volumes && path.is_file() && may_look() && is_archive_of_volume(path, &name),
        _ => has_volumes && is_volume() && path.is_file(),
    }
}

/// Returns true if an archive looks like one of Zarr: by its own name, or by the names of the first files in
/// it.
fn is_archive_of_volume(path: &Path, name: &str) -> bool {
    let mut bytes = Vec::new();
    let read = File::open(path).and_then(|file| file.take(BEGINNING).read_to_end(&mut bytes));
    let is_archive = read.is_ok() && bytes.starts_with(&ZIP_HEADER);
    is_archive && (name.ends_with(".zarr.zip") || names_in_archive(&bytes).any(is_of_zarr))
}

/// The names in the beginning of an archive, as far as each file says where the next one begins.
fn names_in_archive(mut bytes: &[u8]) -> impl Iterator<Item = &[u8]> {
    std::iter::from_fn(move || {
        let header = bytes.get(..ZIP_HEADER_BYTES).filter(|header| header.starts_with(&ZIP_HEADER))?;
        let number = |at: usize| usize::from(u16::from_le_bytes([header[at], header[at + 1]]));
        let (name, more) = (number(26), number(28));
        let found = bytes.get(ZIP_HEADER_BYTES..)?.get(..name)?;
        // A file whose size stands behind it says nothing of where it ends.
        let is_sized = number(6) & 8 == 0;
        let size = number(18) | number(20) << 16;
        let next = ZIP_HEADER_BYTES.saturating_add(name + more).saturating_add(size);
        bytes = bytes.get(next..).filter(|_| is_sized).unwrap_or_default();
        Some(found)
    })
}

/// Returns true if a file in an archive is one of Zarr.
fn is_of_zarr(name: &[u8]) -> bool {
    let name = String::from_utf8_lossy(name);
    let mut parts = name.split('/');
    parts.any(|part| part.ends_with(VOLUME_DIRECTORY) || OF_ZARR.contains(&part))
}

/// The order of two names, runs of digits being numbers: 2 comes before 10.
fn by_numbers(a: &str, b: &str) -> Ordering {
    let (mut a, mut b) = (a, b);
    loop {
        let digits = [a, b].map(|rest| rest.bytes().take_while(u8::is_ascii_digit).count());
        let order = match digits {
            [0, _] | [_, 0] => match (a.chars().next(), b.chars().next()) {
                (Some(first), Some(other)) => {
                    (a, b) = (&a[first.len_utf8()..], &b[other.len_utf8()..]);
                    first.cmp(&other)
                }
                (first, other) => return first.cmp(&other),
            },
            [first, other] => {
                let numbers = [&a[..first], &b[..other]].map(|number| number.trim_start_matches('0'));
                (a, b) = (&a[first..], &b[other..]);
                // Of numbers of any size, the longer one is the larger.
                numbers[0].len().cmp(&numbers[1].len()).then(numbers[0].cmp(numbers[1]))
            }
        };
        if order != Ordering::Equal {
            return order;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Goes a step, and lists the folder where that is needed. Returns true if that is another file.
    fn goes(files: &mut Files, step: i32) -> bool {
        match files.step(step) {
            Step::List(file) => files.take(list_beside(file)) == Step::Other,
            step => step == Step::Other,
        }
    }

    fn name(files: &Files) -> String {
        files.current().file_name().unwrap().to_string_lossy().into_owned()
    }

    #[test]
    fn several_files_are_stepped_through_and_a_single_one_with_its_folder() {
        let mut files = Files::new(Path::new("b"), &["a".into(), "c".into()]);
        assert!(goes(&mut files, 1) && name(&files) == "a");
        assert!(goes(&mut files, -2) && name(&files) == "c", "round the end");
        let folder = tempfile::tempdir().unwrap();
        for name in ["a.txt", "b.PNG", "c.vastex", "d.tif"] {
            std::fs::write(folder.path().join(name), "").unwrap();
        }
        std::fs::create_dir(folder.path().join("e.png")).unwrap();
        let mut files = Files::new(&folder.path().join("c.vastex"), &[]);
        let steps: Vec<String> = (0..3).map(|_| (goes(&mut files, 1), name(&files)).1).collect();
        assert_eq!(steps, ["d.tif", "b.PNG", "c.vastex"]);
        let mut alone = Files::new(&folder.path().join("a.txt"), &[]);
        assert!(
            goes(&mut alone, 1) && name(&alone) == "b.PNG",
            "it is in the list though its ending is none"
        );
        assert!(!goes(&mut Files::new(&folder.path().join("gone/x.png"), &[]), 1));
    }

    /// A person who is faster than a slow folder gets where the keys lead.
    #[test]
    fn steps_are_counted_while_a_folder_is_listed_and_forgotten_with_the_file() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["a.png", "b.png", "c.png", "d.png"] {
            std::fs::write(folder.path().join(name), "").unwrap();
        }
        let first = folder.path().join("a.png");
        let mut files = Files::new(&first, &[]);
        assert_eq!(files.step(1), Step::List(first.clone()));
        assert_eq!([1, 1, -1].map(|step| files.step(step)), [const { Step::Waiting }; 3]);
        assert_eq!(name(&files), "a.png", "nothing waits for the folder");
        assert!(files.take(list_beside(first.clone())) == Step::Other && name(&files) == "c.png");
        assert_eq!(files.take(list_beside(first.clone())), Step::Waiting, "it was asked for once");
        let mut files = Files::new(&first, &[]);
        assert_eq!(files.step(1), Step::List(first.clone()));
        assert!(files.drop_in(Path::new("other.png"), Duration::ZERO));
        assert_eq!(files.take(list_beside(first.clone())), Step::Waiting, "another file was dropped");
        assert_eq!(name(&files), "other.png");
        let mut files = Files::new(&first, &[]);
        assert_eq!([1, -1].map(|step| files.step(step)), [Step::List(first.clone()), Step::Waiting]);
        assert_eq!(files.take(list_beside(first.clone())), Step::Waiting, "there and back again");
        let mut files = Files::new(&first, &[]);
        assert_eq!(files.step(1), Step::List(first.clone()));
        files.wait_no_more();
        assert_eq!(files.step(1), Step::List(first.clone()), "it is asked for once more");
        let mut files = Files::new(&first, &[]);
        assert_eq!(files.step(1), Step::List(first.clone()));
        assert_eq!(files.take(Folder::none(first)), Step::Nowhere);
    }

    #[test]
    fn a_folder_is_stepped_through_by_the_numbers_in_its_names_with_volumes_and_directories() {
        let mut names = ["img10.png", "img9.png", "img010b.png", "img", "img2.png", "b1", "imgé2", "img-1"];
        names.sort_by(|a, b| by_numbers(a, b));
        assert_eq!(
            names,
            ["b1", "img", "img-1", "img2.png", "img9.png", "img10.png", "img010b.png", "imgé2"]
        );
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str| std::fs::write(folder.path().join(name), "").unwrap();
        for name in ["a10.png", "a2.png", "b.raw", "c.raw", "c.raw.toml", "d.nii.gz", "e.gz", "f.zip"] {
            write(name);
        }
        for name in ["g.zarr", "h", "i_files"] {
            std::fs::create_dir(folder.path().join(name)).unwrap();
        }
        let (found, _) = folder_of(&folder.path().join("a2.png")).unwrap();
        let found: Vec<_> = found.iter().map(|path| path.file_name().unwrap().to_str().unwrap()).collect();
        let mut expected = vec!["a2.png", "a10.png", "c.raw"];
        if cfg!(feature = "volumes") {
            expected.extend(["d.nii.gz", "g.zarr"]);
        }
        assert_eq!(found, expected);
    }

    /// An archive of empty files, whose sizes stand behind them if that is said.
    fn archive(names: &[&str], is_sized: bool) -> Vec<u8> {
        let of = |name: &&str| {
            let mut header = [0; ZIP_HEADER_BYTES];
            header[..4].copy_from_slice(&ZIP_HEADER);
            header[6] = if is_sized { 0 } else { 8 };
            header[26] = name.len() as u8;
            [&header[..], name.as_bytes()].concat()
        };
        names.iter().flat_map(of).collect()
    }

    #[test]
    #[cfg(all(feature = "volumes", feature = "build"))]
    fn archives_and_directories_are_known_by_names_in_them_and_nothing_of_them_is_opened() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, bytes: &[u8]| {
            let path = folder.path().join(name);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, bytes).unwrap();
        };
        // No archive is whole, and no file in a directory is an image.
        write("a.zip", &archive(&["plate/", "plate/.zgroup"], true));
        write("b.zip", &archive(&["zarr.json"], false));
        write("c.zarr.zip", &archive(&["0/0"], false));
        write("d.zip", &archive(&["cells.zarr/"], true));
        write("e.zip", &archive(&["letter.txt", "photo.jpg"], true));
        write("f.zip", &archive(&["letter.txt", "zarr.json"], false));
        write("g.zarr.zip", b"zarr.json");
        write("h.zip", &[&archive(&["x"], true)[..], &ZIP_HEADER].concat());
        write("i/0_0_0.png", b"");
        write("j/photo.jpg", b"");
        write("k.png", b"");
        let (found, _) = folder_of(&folder.path().join("k.png")).unwrap();
        let found: Vec<_> = found.iter().map(|path| path.file_name().unwrap().to_str().unwrap()).collect();
        assert_eq!(found, ["a.zip", "b.zip", "c.zarr.zip", "d.zip", "i", "k.png"]);
        // The most that a header can say.
        let full = [&ZIP_HEADER[..], &[0; 14], &[0xff; 12]].concat();
        assert_eq!(names_in_archive(&full).count(), 0);
    }

    #[test]
    fn without_a_file_there_is_none_to_step_to() {
        let mut files = Files::new(Path::new(NO_FILE), &[]);
        assert!(files.are_none());
        assert!(files.drop_in(Path::new("a"), Duration::ZERO) && !files.are_none());
    }

    #[test]
    fn what_is_dropped_together_is_stepped_through() {
        let (mut files, ms) = (Files::new(Path::new("first"), &[]), Duration::from_millis);
        assert!(files.drop_in(Path::new("a"), ms(1000)) && name(&files) == "a");
        assert!(!files.drop_in(Path::new("b"), ms(1010)) && name(&files) == "a");
        assert!(goes(&mut files, 1) && name(&files) == "b");
        assert!(files.drop_in(Path::new("c"), ms(5000)) && name(&files) == "c");
    }
}
