//! Levels that are not stored: each is made of the one before it, from the coarsest stored level down to one
//! voxel, chunk by chunk.
//!
//! A chunk below which nothing is stored is *absent*, where it is known which chunks are stored, and is
//! neither made nor asked for. Another one is *kept* (in memory, or in a file), or *cheap*: made of stored
//! voxels where it is asked for. What is neither is answered by a *preview*, voxels of every n-th stored
//! chunk, and is asked for: a thread of the caller's that [works](Made::work) makes it, the finest first, and
//! then says what has changed. While it makes a coarse one it attends to finer ones that are asked for
//! meanwhile.
//!
//! A stored chunk that cannot be read costs the coarser levels its own voxels and nothing else: those of the
//! next finer stored level stand for it, or it counts as absent.

mod chunks;
mod done;
mod files;
mod lenient;
mod preview;
mod sparse;
mod worker;

use std::collections::BTreeSet;
use std::future::Future;
use std::path::Path;
use std::pin::Pin;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use rustc_hash::FxHashSet;

use crate::chunks::{AxisMap, Chunk, ChunkSource, Grid};
use crate::fault::{SourceFault, VolumeError, VolumeFault};
use crate::reduce::{Reduction, reduce_into, reduced_size};
use crate::stored::StoredChunks;
use crate::volume::{COARSE_MADE_KEPT, ChunkCache, Plane, Volume, VolumeAbout, VoxelBox, filled, paste};
pub(crate) use chunks::MadeChunks;
use done::Done;
use files::Files;
use preview::Preview;
pub(crate) use sparse::count_made;

/// Voxels along each side of a chunk of a made level.
const SIDE: u64 = 64;
/// Bytes of stored voxels that a chunk may be made of where it is asked for, and chunks that these may lie
/// in; larger ones are made by who works. So large may a level be of which all is made at opening.
const CHEAP_BYTES: u64 = 64 << 20;
const CHEAP_CHUNKS: u64 = 1 << 14;
/// Bytes that coarse levels may come to which are kept apart from finer ones, of all channels together: what
/// fits is made again only where many times are open.
const COARSE_BYTES: u64 = COARSE_MADE_KEPT as u64 - (16 << 20);
/// One of how many stored chunks a preview is made of at most where all will not be read anyway.
const LAZY_SHARE: u64 = 8;
/// Channels that are taken to be shown at once.
const MOST_CHANNELS: u64 = 16;
/// Counts what is made.
static NEXT: AtomicU64 = AtomicU64::new(0);
/// Chunks that are asked for at most, and faults that are remembered.
const MOST_ASKED: usize = 4096;
const MOST_FAULTS: usize = 16;
/// Chunks of a source that stand for others, and that others are looked for in turn, at most.
const MOST_SEARCHED: usize = 256;

/// A chunk of a made level: the level, counted from the finest that is made, and its place along x, y and z.
pub(crate) type MadePos = (usize, [u64; 3]);

/// What levels are made of.
pub(crate) struct Base {
    pub(crate) volume: Arc<Volume>,
    /// The coarsest stored level that is shown.
    pub(crate) level: usize,
    pub(crate) channel: u64,
    pub(crate) time: u64,
}

/// The made levels of one channel at one time.
pub(crate) struct Made {
    base: Base,
    rule: Reduction,
    levels: Vec<MadeLevel>,
    /// Which chunks of the base are stored, where that is known.
    stored: Option<Arc<StoredChunks>>,
    /// True if all was made at opening.
    is_whole: bool,
    /// One of how many stored chunks a preview is made of at most.
    share: u64,
    /// Tells its chunks from those of others that the volume keeps.
    number: u64,
    /// The first of the levels that fit whole.
    first_coarse: usize,
    files: Option<Files>,
    /// One array, under one key.
    preview: ChunkCache,
    state: Mutex<State>,
    /// Held by the thread that works.
    working: Mutex<()>,
    /// Chunks of the finest made level that are done, of what the levels come to.
    done: Mutex<Done>,
    total: u64,
}

struct MadeLevel {
    /// Voxels of the level before along one of this one, and of the base.
    factor: [u64; 3],
    scale: [u64; 3],
    grid: Grid,
}

#[derive(Default)]
struct State {
    asked: BTreeSet<MadePos>,
    /// How many of those that were asked for are being made.
    in_hand: usize,
    /// Chunks that a preview was given for.
    previewed: FxHashSet<MadePos>,
    changed: Vec<MadePos>,
    faults: Vec<SourceFault>,
    /// Stored chunks, by level, that stand for others and that others are looked for.
    searched: FxHashSet<(usize, Vec<u64>)>,
}

/// How far made levels are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MadeProgress {
    /// Bricks of the finest made level that are done: made, or found to be kept.
    pub done: u64,
    /// How many there are.
    pub total: u64,
}

impl Made {
    /// Levels whose voxels are so many of the level before each, the first of them of the base. At once where
    /// the base is small; else what is there already is used, and with `makes_all` the coarsest is asked for.
    /// `directory` keeps chunks for other runs, under the name that `identity` gives.
    pub(crate) async fn new(
        base: Base,
        rule: Reduction,
        factors: &[[u32; 3]],
        directory: Option<(&Path, &str)>,
        makes_all: bool,
    ) -> Result<Made, VolumeError> {
        let size = base.volume.about().levels[base.level].size;
        let mut levels: Vec<MadeLevel> = Vec::new();
        for factor in factors {
            let factor = factor.map(u64::from);
            let (before, scale) =
                levels.last().map_or((size, [1; 3]), |level| (level.grid.size(), level.scale));
            let side: [u64; 3] = std::array::from_fn(|axis| before[axis].div_ceil(factor[axis]));
            let axes = AxisMap { x: 2, y: 1, z: Some(0), channel: None, time: None };
            let shape = side.iter().rev().copied().collect();
            levels.push(MadeLevel {
                factor,
                scale: std::array::from_fn(|axis| scale[axis].saturating_mul(factor[axis])),
                grid: Grid { shape, chunk: vec![SIDE; 3], axes },
            });
        }
        let width = base.volume.about().dtype.bytes() as u64;
        let is_small = is_small(base.volume.about(), base.level, None);
        let mut faults = Vec::new();
        let mut files = None;
        if let Some((path, identity)) = directory.filter(|_| !is_small && !levels.is_empty()) {
            match Files::open(path, identity) {
                Ok(opened) => files = Some(opened),
                Err(error) => faults.push(SourceFault::Directory(error)),
            }
        }
        let mut left = COARSE_BYTES / base.volume.about().channels.clamp(1, MOST_CHANNELS);
        let fits = |level: &&MadeLevel| {
            let bytes = bytes_of(level.grid.size(), width).saturating_add(chunks_of(level) * 512);
            left = left.saturating_sub(bytes);
            left > 0
        };
        let first_coarse = levels.len() - levels.iter().rev().take_while(fits).count();
        let stored = base.volume.stored_chunks(base.level).await;
        let plane = (base.channel, base.time);
        let total =
            levels.first().map_or(0, |level| count_made(stored.as_deref(), plane, size, level.factor));
        let made = Made {
            base,
            rule,
            stored,
            is_whole: is_small || levels.is_empty(),
            share: if makes_all { 1 } else { LAZY_SHARE },
            number: NEXT.fetch_add(1, Ordering::Relaxed),
            first_coarse,
            files,
            preview: ChunkCache::new(usize::MAX),
            state: Mutex::new(State { faults, ..State::default() }),
            working: Mutex::new(()),
            done: Mutex::default(),
            total,
            levels,
        };
        match made.levels.len().checked_sub(1) {
            Some(last) if is_small => drop(made.exact(last, [0; 3], false).await?),
            Some(last)
                if makes_all && !made.is_absent(last, [0; 3]) && !made.is_cheap(last, [0; 3], true) =>
            {
                made.lock().asked.insert((last, [0; 3]));
            }
            _ => {}
        }
        Ok(made)
    }

    /// Has chunks made of which a preview was given, all that a box of a level touches: those that are cheap
    /// when they are asked for again. Returns true if there were any that nobody had asked for.
    pub(crate) fn want(&self, level: usize, first: [i64; 3], size: [u32; 3]) -> bool {
        let last = self.levels[level].grid.size().map(|side| side as i64 - 1);
        let chunks = [0, 1, 2].map(|axis| {
            let end = first[axis].saturating_add(i64::from(size[axis]) - 1);
            first[axis].clamp(0, last[axis]) as u64 / SIDE..=end.clamp(0, last[axis]) as u64 / SIDE
        });
        let mut is_new = false;
        for z in chunks[2].clone() {
            for y in chunks[1].clone() {
                for x in chunks[0].clone() {
                    let at = [x, y, z];
                    let mut state = self.lock();
                    if !state.previewed.contains(&(level, at)) {
                        continue;
                    }
                    is_new |= match self.is_cheap(level, at, true) {
                        true => {
                            state.previewed.remove(&(level, at));
                            state.changed.push((level, at));
                            true
                        }
                        false => state.asked.len() < MOST_ASKED && state.asked.insert((level, at)),
                    };
                }
            }
        }
        is_new
    }

    /// Returns true if all of them were made at opening, so that none will have to be.
    pub(crate) fn is_whole(&self) -> bool {
        self.is_whole
    }

    /// The chunks of a made level. Where one of them is not made, a preview of it is given; `asks` has it
    /// made, too.
    pub(crate) fn chunks(&self, level: usize, asks: bool) -> MadeChunks<'_> {
        MadeChunks { made: self, level, asks }
    }

    /// The values of a made level, to be read as those of stored ones are.
    pub(crate) fn plane<'a>(&'a self, chunks: &'a MadeChunks<'a>) -> Plane<'a> {
        Plane {
            chunks,
            grid: &self.levels[chunks.level].grid,
            width: self.width(),
            channel: 0,
            time: 0,
            path: &self.base.volume.about().path,
            spare: None,
        }
    }

    /// How far they are.
    pub(crate) fn progress(&self) -> MadeProgress {
        MadeProgress { done: self.lock_done().count(), total: self.total }
    }

    /// What has changed since this was last asked: chunks that a preview was given for, and that are there
    /// now.
    pub(crate) fn take_changed(&self) -> Vec<MadePos> {
        std::mem::take(&mut self.lock().changed)
    }

    /// What went wrong first.
    pub(crate) fn faults(&self) -> Vec<SourceFault> {
        self.lock().faults.clone()
    }

    /// Voxels of the base along one of a level, along each axis.
    pub(crate) fn scale(&self, level: usize) -> [u64; 3] {
        self.levels[level].scale
    }

    fn width(&self) -> usize {
        self.base.volume.about().dtype.bytes()
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Keeps what went wrong, each once, and a few of them.
    pub(crate) fn fault(&self, fault: SourceFault) {
        let mut state = self.lock();
        if state.faults.len() < MOST_FAULTS && !state.faults.contains(&fault) {
            state.faults.push(fault);
        }
    }

    fn cache(&self, level: usize) -> &ChunkCache {
        let [coarse, fine] = self.base.volume.made();
        if level >= self.first_coarse { coarse } else { fine }
    }

    /// Under which a chunk is kept.
    fn key(&self, level: usize, [x, y, z]: [u64; 3]) -> (usize, Vec<u64>) {
        (level, vec![self.number, x, y, z])
    }

    /// A chunk of a level, or a preview of it; `None` if it is absent.
    async fn chunk(&self, level: usize, at: [u64; 3], asks: bool) -> Result<Option<Chunk>, VolumeError> {
        if let Some(Some(chunk)) = self.cache(level).find(&self.key(level, at)) {
            return Ok(Some(chunk));
        }
        if self.is_absent(level, at) {
            return Ok(None);
        }
        if self.is_whole || self.is_cheap(level, at, asks) {
            return self.exact(level, at, false).await.map(Some);
        }
        if let Some(chunk) = self.filed(level, at) {
            return Ok(Some(chunk));
        }
        let preview = self.preview().await?;
        let mut state = self.lock();
        if asks && state.asked.len() < MOST_ASKED {
            state.asked.insert((level, at));
        }
        state.previewed.insert((level, at));
        drop(state);
        // It may have come between the looks.
        match self.cache(level).find(&self.key(level, at)) {
            Some(Some(chunk)) => Ok(Some(chunk)),
            _ => Ok(Some(preview.chunk(&self.base, &self.levels[level], at))),
        }
    }

    /// A chunk in a file.
    fn filed(&self, level: usize, at: [u64; 3]) -> Option<Chunk> {
        let size = self.chunk_size(level, at);
        let bytes = self.files.as_ref()?.read(level, at, size.iter().product::<usize>() * self.width())?;
        Some(self.chunk_of(bytes, size))
    }

    /// A chunk as it is: kept, or made and kept. `yields` where its maker has other things to attend to.
    fn exact(&self, level: usize, at: [u64; 3], yields: bool) -> Making<'_> {
        Box::pin(async move {
            let make = async move {
                if let Some(chunk) = self.filed(level, at) {
                    self.count_done(level, at);
                    return Ok(Some(chunk));
                }
                let size = self.chunk_size(level, at);
                let values = self.make(level, at, size, yields).await?;
                if let Some(Err(error)) = self.files.as_ref().map(|files| files.write(level, at, &values)) {
                    self.fault(SourceFault::Directory(error));
                }
                if level == 0 {
                    self.count_done(level, at);
                }
                Ok(Some(self.chunk_of(values, size)))
            };
            let (outcome, _) = self.cache(level).get(self.key(level, at), make).await;
            let chunk = outcome?;
            let mut state = self.lock();
            if state.previewed.remove(&(level, at)) {
                state.changed.push((level, at));
            }
            state.asked.remove(&(level, at));
            drop(state);
            chunk.ok_or_else(|| {
                VolumeFault::Read("a level that is made is not there".into()).at(&self
                    .base
                    .volume
                    .about()
                    .path)
            })
        })
    }

    /// Makes a chunk of the level before.
    async fn make(
        &self,
        level: usize,
        at: [u64; 3],
        size: [usize; 3],
        yields: bool,
    ) -> Result<Vec<u8>, VolumeError> {
        let factor = self.levels[level].factor;
        let memory = || {
            VolumeFault::TooLarge("there is no memory for a brick".into()).at(&self.base.volume.about().path)
        };
        let fill = self.base.volume.shared(self.base.level).fill();
        let mut values = filled(&fill[..self.width()], size.iter().product::<usize>()).ok_or_else(memory)?;
        if level == 0 {
            if yields {
                worker::pause().await;
            }
            let base = self.base.volume.about().levels[self.base.level].size;
            let first: [u64; 3] = std::array::from_fn(|axis| at[axis] * SIDE * factor[axis]);
            let of: [u64; 3] =
                std::array::from_fn(|axis| (SIDE * factor[axis]).min(base[axis] - first[axis]));
            let lenient = self.lenient_base();
            let plane = lenient.plane();
            let read = VoxelBox { first: first.map(|at| at as i64), size: of.map(|side| side as u32) };
            let found = plane.read(&read).await?.values;
            self.reduce(&found, of.map(|side| side as usize), factor, &mut values)?;
            return Ok(values);
        }
        for child in self.children(level, at) {
            if self.is_absent(level - 1, child) {
                continue;
            }
            let within: [u64; 3] = std::array::from_fn(|axis| child[axis] - at[axis] * factor[axis]);
            let chunk = self.exact(level - 1, child, yields).await?;
            let of = self.chunk_size(level - 1, child);
            let reduced = reduced_size(of, factor.map(|factor| factor as usize));
            let mut part = vec![0; reduced.iter().product::<usize>() * self.width()];
            self.reduce(&chunk.bytes, of, factor, &mut part)?;
            let place = std::array::from_fn(|axis| (within[axis] * SIDE / factor[axis]) as usize);
            paste(&part, reduced, &mut values, size, place, self.width());
        }
        Ok(values)
    }

    fn reduce(
        &self,
        values: &[u8],
        size: [usize; 3],
        factor: [u64; 3],
        output: &mut [u8],
    ) -> Result<(), VolumeError> {
        let about = self.base.volume.about();
        let factor = factor.map(|factor| factor as usize);
        reduce_into(about.dtype, self.rule, values, size, factor, output).ok_or_else(|| {
            VolumeFault::Damaged("a level cannot be made of the one before".into()).at(&about.path)
        })
    }

    /// Voxels of a chunk that exists.
    fn chunk_size(&self, level: usize, at: [u64; 3]) -> [usize; 3] {
        let size = self.levels[level].grid.size();
        std::array::from_fn(|axis| SIDE.min(size[axis] - at[axis] * SIDE) as usize)
    }

    fn chunk_of(&self, values: Vec<u8>, [width, height, _]: [usize; 3]) -> Chunk {
        let value = self.width();
        let strides = [value * width * height, value * width, value];
        Chunk::new(values, strides, 0)
    }

    /// The chunks of the level before that a chunk of a coarser level is made of.
    fn children(&self, level: usize, at: [u64; 3]) -> Vec<[u64; 3]> {
        let (factor, before) = (self.levels[level].factor, self.levels[level - 1].grid.size());
        let child = |n: u64| {
            let within = [n % factor[0], n / factor[0] % factor[1], n / factor[0] / factor[1]];
            std::array::from_fn(|axis| at[axis] * factor[axis] + within[axis])
        };
        let is_there = |child: &[u64; 3]| (0..3).all(|axis| child[axis] * SIDE < before[axis]);
        (0..factor.iter().product()).map(child).filter(is_there).collect()
    }

    async fn preview(&self) -> Result<Preview, VolumeError> {
        let plan = preview::Plan::of(&self.base, self.share);
        let lenient = self.lenient_base();
        let plane = lenient.plane();
        let key = (0, Vec::new());
        let (outcome, _) = self.preview.get(key, async { plan.read(&plane).await.map(Some) }).await;
        let array = outcome?.map_or_else(Default::default, |chunk| chunk.bytes.clone());
        Ok(Preview { plan, array })
    }
}

/// How many chunks of the finest made level lie in files for a volume of that name, of so many.
pub(crate) fn kept_in_files(directory: &Path, identity: &str, total: u64) -> MadeProgress {
    let found = Files::find(directory, identity).map_or(0, |files| files.count(0, total));
    MadeProgress { done: found, total }
}

/// A chunk on its way.
type Making<'a> = Pin<Box<dyn Future<Output = Result<Chunk, VolumeError>> + Send + 'a>>;

/// Returns true if a box of voxels of a stored level, all of it where no size is named, may be read while
/// somebody waits.
pub(crate) fn is_small(about: &VolumeAbout, level: usize, size: Option<[u64; 3]>) -> bool {
    let level = &about.levels[level];
    let size = size.unwrap_or(level.size);
    let along = |axis: usize| size[axis].div_ceil(level.chunk[axis]);
    let chunks = (0..3).fold(1, |chunks: u64, axis| chunks.saturating_mul(along(axis)));
    bytes_of(size, about.dtype.bytes() as u64) <= CHEAP_BYTES && chunks <= CHEAP_CHUNKS
}

fn bytes_of(size: [u64; 3], width: u64) -> u64 {
    size.iter().fold(width, |bytes, side| bytes.saturating_mul(*side))
}

fn chunks_of(level: &MadeLevel) -> u64 {
    level.grid.size().iter().fold(1, |chunks: u64, side| chunks.saturating_mul(side.div_ceil(SIDE)))
}
