//! Which directories a file has: the chain that begins in its header, and those below the first one.

use std::collections::HashSet;

use super::TiffFile;
use super::entry::Directory;
use crate::image::InputFault;

/// Directories that are looked at, of a chain and below its first one each. A stack of more planes than that
/// is known by its first ones.
const MOST: usize = 1024;
/// Entries of all of them. Sound ones have some dozens each.
const MOST_ENTRIES: usize = 1 << 20;
/// Bytes of directories, and of what they lead to, that are read to find out what a file's images are.
const MOST_BYTES: u64 = 256 << 20;
const SUB_IFDS: u16 = 330;

/// The directories of a file, in the order in which it names them.
#[derive(Debug)]
pub(crate) struct Directories {
    /// The chain, which has at least one.
    pub(super) chain: Vec<Directory>,
    /// Directories below the first of the chain.
    pub(super) below: Vec<Directory>,
}

/// What was read of a file so far.
#[derive(Default)]
struct Seen {
    /// Where the directories lie.
    places: HashSet<u64>,
    /// How many entries they have.
    entries: usize,
}

impl TiffFile {
    /// Follows the chain, and what its first directory names below it. What leads back to where it was is an
    /// error.
    pub(crate) fn directories(&self) -> Result<Directories, InputFault> {
        let mut seen = Seen::default();
        seen.places.insert(self.first);
        let mut chain = vec![self.next_directory(self.first, &mut seen)?];
        self.follow(&mut chain, &mut seen)?;
        let mut below = Vec::new();
        let first = &chain[0];
        let count = first.entry(SUB_IFDS).map_or(0, |entry| entry.count.min(MOST as u64));
        for index in 0..count {
            let Some(entry) = first.entry(SUB_IFDS) else { break };
            let at = self.value(entry, index, &first.place)?;
            if at == 0 || below.len() >= MOST {
                break;
            }
            // Some writers chain what they list.
            if !seen.places.insert(at) {
                continue;
            }
            let mut some = vec![self.next_directory(at, &mut seen)?];
            self.follow(&mut some, &mut seen)?;
            below.append(&mut some);
        }
        Ok(Directories { chain, below })
    }

    /// Adds those that follow the last of `chain`, as far as they are looked at.
    fn follow(&self, chain: &mut Vec<Directory>, seen: &mut Seen) -> Result<(), InputFault> {
        while let Some(last) = chain.last().filter(|last| last.next != 0) {
            if chain.len() >= MOST {
                break;
            }
            let next = last.next;
            if !seen.places.insert(next) {
                return Err(loops(&last.place));
            }
            chain.push(self.next_directory(next, seen)?);
        }
        Ok(())
    }

    fn next_directory(&self, at: u64, seen: &mut Seen) -> Result<Directory, InputFault> {
        let directory = self.directory(at)?;
        seen.entries += directory.len();
        if seen.entries > MOST_ENTRIES {
            let why = format!("its directories have more than {MOST_ENTRIES} entries");
            return Err(super::damaged(&directory.place, why));
        }
        self.check_read(&directory)?;
        Ok(directory)
    }

    /// Fails where more was read of the file, up to a directory and what it leads to, than sound files have.
    pub(super) fn check_read(&self, directory: &Directory) -> Result<(), InputFault> {
        if self.reads().bytes > MOST_BYTES {
            let why = format!("its directories lead to more than {} MiB", MOST_BYTES >> 20);
            return Err(super::damaged(&directory.place, why));
        }
        Ok(())
    }
}

fn loops(place: &str) -> InputFault {
    super::damaged(place, "it leads back to a directory that was read already")
}
