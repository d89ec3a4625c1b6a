//! A disk in memory that fills up, stalls, is killed in the middle of a write, becomes read-only or loses its
//! files.

use std::collections::BTreeMap;
use std::io;
use std::sync::{Arc, Condvar, Mutex, MutexGuard};

use crate::caches::disk::medium::{Medium, MediumFile};

pub(super) type Files = BTreeMap<String, Vec<u8>>;

/// Cheap to clone: all clones are one disk.
#[derive(Clone, Default)]
pub(super) struct MemoryDisk(Arc<(Mutex<State>, Stall)>);

/// While it is set, nothing that is to be changed comes to an end; reading goes on.
#[derive(Default)]
struct Stall {
    is_set: Mutex<bool>,
    cleared: Condvar,
    /// Changes that wait, or have waited.
    waited: Mutex<u64>,
}

#[derive(Default)]
struct State {
    /// The contents by number, since what is open outlives its name.
    contents: Vec<Vec<u8>>,
    names: BTreeMap<String, usize>,
    troubles: Troubles,
    changes: u64,
    most_bytes: u64,
}

/// What is wrong with the disk.
#[derive(Clone, Copy, Default)]
pub(super) struct Troubles {
    /// Bytes that all files may have together.
    pub(super) capacity: Option<u64>,
    /// Bytes that a file may have.
    pub(super) longest_file: Option<u64>,
    /// Changes that are still made; of the next, if it is a write, only so many sixteenths are, and nothing
    /// is after it.
    pub(super) killed_after: Option<(u64, u64)>,
    /// Nothing can be made, written, cut off or removed.
    pub(super) read_only: bool,
    /// Nothing that was written can be taken back.
    pub(super) keeps_torn: bool,
}

impl MemoryDisk {
    pub(super) fn of(files: &Files) -> MemoryDisk {
        let disk = MemoryDisk::default();
        for (name, bytes) in files {
            let mut state = disk.state();
            let number = state.contents.len();
            state.names.insert(name.clone(), number);
            state.contents.push(bytes.clone());
        }
        disk
    }

    /// What lies on it.
    pub(super) fn files(&self) -> Files {
        let state = self.state();
        state.names.iter().map(|(name, &number)| (name.clone(), state.contents[number].clone())).collect()
    }

    /// Changes one byte of a file.
    pub(super) fn flip(&self, name: &str, at: usize, bits: u8) {
        let mut state = self.state();
        let number = state.names[name];
        state.contents[number][at] ^= bits;
    }

    pub(super) fn remove_all(&self) {
        self.state().names.clear();
    }

    pub(super) fn set(&self, troubles: Troubles) {
        self.state().troubles = troubles;
    }

    /// Lets every change wait from now on, or no longer.
    pub(super) fn stall(&self, is_set: bool) {
        *self.0.1.is_set.lock().unwrap() = is_set;
        self.0.1.cleared.notify_all();
    }

    /// How many changes have waited since the disk was made.
    pub(super) fn waited(&self) -> u64 {
        *self.0.1.waited.lock().unwrap()
    }

    fn wait_for_stall(&self) {
        let stall = &self.0.1;
        let mut is_set = stall.is_set.lock().unwrap();
        if *is_set {
            *stall.waited.lock().unwrap() += 1;
        }
        while *is_set {
            is_set = stall.cleared.wait(is_set).unwrap();
        }
    }

    /// The most bytes that all files have had together since this was last asked.
    pub(super) fn most_bytes(&self) -> u64 {
        std::mem::take(&mut self.state().most_bytes)
    }

    /// Files made and removed, writes and cuts so far.
    pub(super) fn changes(&self) -> u64 {
        self.state().changes
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.0.0.lock().unwrap()
    }
}

impl State {
    fn bytes(&self) -> u64 {
        self.names.values().map(|&number| self.contents[number].len() as u64).sum()
    }

    /// Whether a change is made; in sixteenths.
    fn begin_change(&mut self) -> io::Result<u64> {
        if self.troubles.read_only {
            return Err(io::ErrorKind::ReadOnlyFilesystem.into());
        }
        self.changes += 1;
        match &mut self.troubles.killed_after {
            None => Ok(16),
            Some((0, sixteenths)) => Ok(std::mem::take(sixteenths)),
            Some((left, _)) => {
                *left -= 1;
                Ok(16)
            }
        }
    }

    fn change(&mut self) -> io::Result<()> {
        if self.begin_change()? == 16 { Ok(()) } else { Err(io::Error::other("killed")) }
    }
}

impl Medium for MemoryDisk {
    fn names(&self) -> io::Result<Vec<String>> {
        Ok(self.state().names.keys().cloned().collect())
    }

    fn open(&self, name: &str, new: bool) -> io::Result<Arc<dyn MediumFile>> {
        let mut state = self.state();
        let number = match (state.names.get(name).copied(), new) {
            (Some(_), true) => return Err(io::ErrorKind::AlreadyExists.into()),
            (None, false) => return Err(io::ErrorKind::NotFound.into()),
            (Some(number), false) => number,
            (None, true) => {
                state.change()?;
                let number = state.contents.len();
                state.names.insert(name.into(), number);
                state.contents.push(Vec::new());
                number
            }
        };
        Ok(Arc::new(OpenFile { disk: self.clone(), number }))
    }

    fn remove(&self, name: &str) -> io::Result<()> {
        self.wait_for_stall();
        let mut state = self.state();
        state.change()?;
        state.names.remove(name).map(drop).ok_or(io::ErrorKind::NotFound.into())
    }
}

struct OpenFile {
    disk: MemoryDisk,
    number: usize,
}

impl MediumFile for OpenFile {
    fn len(&self) -> io::Result<u64> {
        Ok(self.disk.state().contents[self.number].len() as u64)
    }

    fn read_at(&self, bytes: &mut [u8], offset: u64) -> io::Result<usize> {
        let state = self.disk.state();
        let from = state.contents[self.number].get(offset as usize..).unwrap_or_default();
        let count = from.len().min(bytes.len());
        bytes[..count].copy_from_slice(&from[..count]);
        Ok(count)
    }

    fn write_at(&self, bytes: &[u8], offset: u64) -> io::Result<()> {
        self.disk.wait_for_stall();
        let mut state = self.disk.state();
        let sixteenths = state.begin_change()? as usize;
        let mut count = bytes.len() * sixteenths / 16;
        let room = state.troubles.capacity.map(|capacity| capacity.saturating_sub(state.bytes()) as usize);
        if let Some(room) = room {
            let in_place = state.contents[self.number].len().saturating_sub(offset as usize);
            count = count.min(room + in_place);
        }
        if let Some(longest) = state.troubles.longest_file
            && offset + bytes.len() as u64 > longest
        {
            return Err(io::ErrorKind::FileTooLarge.into());
        }
        let (file, at) = (&mut state.contents[self.number], offset as usize);
        file.resize(file.len().max(at + count), 0);
        file[at..at + count].copy_from_slice(&bytes[..count]);
        state.most_bytes = state.most_bytes.max(state.bytes());
        match count == bytes.len() {
            true if sixteenths == 16 => Ok(()),
            _ if sixteenths < 16 => Err(io::Error::other("killed")),
            _ => Err(io::ErrorKind::StorageFull.into()),
        }
    }

    fn truncate(&self, len: u64) -> io::Result<()> {
        let mut state = self.disk.state();
        state.change()?;
        if state.troubles.keeps_torn {
            return Err(io::Error::other("what was written stays"));
        }
        state.contents[self.number].truncate(len as usize);
        Ok(())
    }
}
