//! Storing tiles after they were delivered: a queue of bounded memory, and the thread that writes what waits
//! in it.
//!
//! Only this thread writes files, so that making room never holds up a reader.

use std::collections::VecDeque;
use std::fs::File;
use std::sync::{Arc, Condvar, Mutex, MutexGuard};
use std::time::{Duration, Instant};
use std::{io, thread};

use vastex_core::{Description, Region};

use super::entry::EntryKey;
use super::index::Index;
use super::shelf::Shelf;
use crate::ground::sync::{lock, wait, wait_at_most};
use crate::tile::Tile;

/// Tiles that are left out after a first failure to write; after each further failure in a row twice as many.
pub(super) const FIRST_PAUSE: u32 = 64;
const LONGEST_PAUSE: u32 = 1 << 16;
/// Bytes of tiles that may wait to be stored; tiles beyond that are not stored.
pub(super) const MOST_WAITING: u64 = 16 << 20;

/// A tile that was delivered and is to be stored.
pub(super) struct Delivered {
    pub(super) key: EntryKey,
    pub(super) tile: Tile,
    /// The description of the tile's source: a tile that does not decode by it is not stored.
    pub(super) description: Arc<Description>,
    /// The regions of the source that have changed: a tile that was read before the change is not stored.
    pub(super) changed: Arc<Mutex<Vec<Region>>>,
}

impl Delivered {
    fn is_to_be_kept(&self) -> bool {
        let geometry = &self.description.geometry;
        let has_changed = lock(&self.changed).iter().any(|region| region.concerns(geometry, self.key.pos));
        !has_changed && self.tile.decode(&self.description).is_ok()
    }
}

/// The queue of tiles to be stored, shared by those who deliver and by the thread.
pub(super) struct WriteQueue {
    name: String,
    index: Arc<Mutex<Index>>,
    state: Mutex<State>,
    /// Signalled at every change of the state.
    changed: Condvar,
}

#[derive(Default)]
struct State {
    waiting: VecDeque<Delivered>,
    bytes: u64,
    most_bytes: u64,
    is_writing: bool,
    stopping: bool,
    /// Set when the files are closed.
    has_ended: bool,
}

/// What the thread owns: the files, and how writing them has gone.
pub(super) struct Writer {
    shelf: Shelf,
    /// How many further tiles are left out.
    pause: u32,
    next_pause: u32,
    /// Set once a failure was logged.
    has_logged: bool,
    /// The lock on the directory, held as long as the file is open.
    _lock: Option<File>,
}

impl WriteQueue {
    /// Starts to store what is handed over in `shelf`, with at most `most_bytes` waiting. Fails if the system
    /// gives no thread.
    pub(super) fn start(
        name: String,
        index: Arc<Mutex<Index>>,
        shelf: Shelf,
        lock: Option<File>,
        most_bytes: u64,
    ) -> io::Result<Arc<WriteQueue>> {
        let state = Mutex::new(State { most_bytes, ..State::default() });
        let queue = Arc::new(WriteQueue { name, index, state, changed: Condvar::new() });
        let writer = Writer { shelf, pause: 0, next_pause: FIRST_PAUSE, has_logged: false, _lock: lock };
        let own = queue.clone();
        thread::Builder::new().name("vastex keep".into()).spawn(move || own.run(writer))?;
        Ok(queue)
    }

    fn wait_while<'a>(
        &self,
        state: MutexGuard<'a, State>,
        most: Duration,
        busy: impl Fn(&State) -> bool,
    ) -> MutexGuard<'a, State> {
        let end = Instant::now().checked_add(most);
        let mut state = state;
        while busy(&state) {
            let left = end.map_or(most, |end| end.saturating_duration_since(Instant::now()));
            if left.is_zero() {
                break;
            }
            state = wait_at_most(&self.changed, state, left).0;
        }
        state
    }

    /// Queues a tile to be stored. Never waits: if too many bytes are waiting, the tile is not stored and
    /// counted as skipped.
    pub(super) fn hand_over(&self, delivered: Delivered) {
        let len = delivered.tile.bytes.len() as u64;
        let mut state = lock(&self.state);
        if !state.waiting.is_empty() && state.bytes + len > state.most_bytes {
            drop(state);
            return lock(&self.index).count(&delivered.key, |stats| stats.skipped += 1);
        }
        state.bytes += len;
        state.waiting.push_back(delivered);
        self.changed.notify_all();
    }

    /// Waits until no tile waits to be stored, at most for `most`. Returns true if none waits.
    pub(super) fn flush(&self, most: Duration) -> bool {
        let is_busy = |state: &State| !state.has_ended && (state.is_writing || !state.waiting.is_empty());
        !is_busy(&self.wait_while(lock(&self.state), most, is_busy))
    }

    /// Stores what waits, at most for `most`, and closes the files. A disk that does not answer in time is
    /// left to the thread.
    pub(super) fn stop(&self, most: Duration) {
        let mut state = lock(&self.state);
        state.stopping = true;
        self.changed.notify_all();
        let mut state = self.wait_while(state, most, |state| !state.has_ended);
        state.waiting.clear();
        state.bytes = 0;
    }

    /// The loop of the thread.
    fn run(&self, mut writer: Writer) {
        while let Some(delivered) = self.next() {
            writer.keep(&self.name, &self.index, &delivered);
        }
        drop(writer);
        lock(&self.state).has_ended = true;
        self.changed.notify_all();
    }

    fn next(&self) -> Option<Delivered> {
        let mut state = lock(&self.state);
        state.is_writing = false;
        self.changed.notify_all();
        loop {
            if let Some(delivered) = state.waiting.pop_front() {
                state.bytes -= delivered.tile.bytes.len() as u64;
                state.is_writing = true;
                return Some(delivered);
            }
            if state.stopping {
                return None;
            }
            state = wait(&self.changed, state);
        }
    }
}

impl Writer {
    /// Stores a tile, unless writing has failed of late.
    fn keep(&mut self, name: &str, index: &Mutex<Index>, delivered: &Delivered) {
        let Delivered { key, tile, .. } = delivered;
        // It may have been read twice at the same time.
        if lock(index).contains(key) {
            return;
        }
        if self.pause > 0 {
            self.pause -= 1;
            return;
        }
        if !delivered.is_to_be_kept() {
            return;
        }
        let Err(error) = self.shelf.keep(index, *key, tile) else {
            self.next_pause = FIRST_PAUSE;
            return;
        };
        lock(index).count(key, |stats| stats.failures += 1);
        self.pause = self.next_pause;
        self.next_pause = (2 * self.next_pause).min(LONGEST_PAUSE);
        if !std::mem::replace(&mut self.has_logged, true) {
            tracing::warn!(
                "{name}: the disk cache cannot keep tiles: {error}; they are read from their source"
            );
        }
    }
}
