//! Which directories a file has: the chain that begins in its header, and those below the first one.

use std::collections::HashSet;

use super::TiffFile;
use super::entry::Directory;
use crate::image::InputFault;

/// Directories that are looked at, of a chain and below its first one each. A stack of more planes than that
/// is known by its first ones.
const MOST: usize = 1024;
const SUB_IFDS: u16 = 330;

/// The directories of a file, in the order in which it names them.
#[derive(Debug)]
pub(crate) struct Directories {
    /// The chain, which has at least one.
    pub(super) chain: Vec<Directory>,
    /// Those below the first of the chain.
    pub(super) below: Vec<Directory>,
}

impl TiffFile {
    /// Follows the chain, and what its first directory names below it. What leads back to where it was is an
    /// error.
    pub(crate) fn directories(&self) -> Result<Directories, InputFault> {
        let mut seen = HashSet::new();
        let mut chain = vec![self.directory(self.first)?];
        seen.insert(self.first);
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
            if !seen.insert(at) {
                continue;
            }
            let mut some = vec![self.directory(at)?];
            self.follow(&mut some, &mut seen)?;
            below.append(&mut some);
        }
        Ok(Directories { chain, below })
    }

    /// Adds those that follow the last of `chain`, as far as they are looked at.
    fn follow(&self, chain: &mut Vec<Directory>, seen: &mut HashSet<u64>) -> Result<(), InputFault> {
        while let Some(last) = chain.last().filter(|last| last.next != 0) {
            if chain.len() >= MOST {
                break;
            }
            let next = last.next;
            if !seen.insert(next) {
                return Err(loops(&last.place));
            }
            chain.push(self.directory(next)?);
        }
        Ok(())
    }
}

fn loops(place: &str) -> InputFault {
    super::damaged(place, "it leads back to a directory that was read already")
}
