//! One pass over an image of a volume: each voxel is read once (more often only around blocks with borders,
//! and of chunks that several blocks share), and every level is made of the next finer one in memory.

use std::ops::ControlFlow;
use std::path::Path;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

use rayon::ThreadPool;
use vastex_volume::{Reduction, Volume};

use super::block::Block;
use super::error::VolumeBuildError;
use super::levels::Level;
use super::plan::{Round, Shape};
use super::reading::Reading;
use super::scratch::Scratch;
use super::sink::{Place, Sink, Stop};
use crate::progress::Progress;

/// Bytes of a block, where chunks are not larger.
const USUAL_BLOCK: u64 = 192 << 20;
/// Bytes of levels between two rounds that are kept in memory, of all channels.
const MOST_HELD: u64 = 256 << 20;
/// Parts of what may be taken that one is left for blocks: as much again is for levels, copies and what is
/// encoded, and chunks are kept besides.
const PARTS: u64 = 2;

/// How an image is passed over.
pub(super) struct Pass<'a> {
    pub(super) volume: &'a Volume,
    pub(super) levels: &'a [Level],
    pub(super) rule: Reduction,
    pub(super) reading: &'a Reading<'a>,
    /// The threads that read, halve and encode.
    pub(super) pool: &'a ThreadPool,
    /// Where the output will be: files without a name lie beside it.
    pub(super) output: &'a Path,
    /// Bytes of memory that may be taken.
    pub(super) memory: u64,
    /// Ends what the threads do.
    pub(super) stop: &'a Stop,
}

/// How often it is asked, while chunks are read and written, whether to go on.
const EVERY: Duration = Duration::from_millis(100);

/// How far a build is, in rows of voxels of the finest level.
pub(super) struct Track<'a> {
    pub(super) progress: &'a dyn Progress,
    pub(super) rows: f64,
    pub(super) rows_total: u64,
    /// Bytes that are written of images before this one.
    pub(super) bytes: u64,
}

impl Track<'_> {
    fn advance(&mut self, rows: f64, bytes: u64) -> Result<(), VolumeBuildError> {
        self.rows += rows;
        match self.tell(bytes) {
            ControlFlow::Continue(()) => Ok(()),
            ControlFlow::Break(()) => Err(VolumeBuildError::Cancelled),
        }
    }

    /// So many bytes are written of this image.
    fn tell(&self, bytes: u64) -> ControlFlow<()> {
        let done = (self.rows.round() as u64).min(self.rows_total);
        self.progress.advance(done, self.rows_total, self.bytes + bytes)
    }

    /// Has the threads of a pool do something, while it is asked on this one whether to go on; where not,
    /// `stop` is set, and it ends as soon as that is looked at.
    fn attend<T: Send>(
        &self,
        (pool, stop): (&ThreadPool, &Stop),
        bytes: u64,
        work: impl FnOnce() -> Result<T, VolumeBuildError> + Send,
    ) -> Result<T, VolumeBuildError> {
        let mut outcome = Err(VolumeBuildError::Cancelled);
        let to = &mut outcome;
        pool.in_place_scope(|scope| {
            let (ended, end) = channel::<()>();
            scope.spawn(move |_| {
                *to = work();
                drop(ended);
            });
            while end.recv_timeout(EVERY) == Err(RecvTimeoutError::Timeout) {
                if self.tell(bytes).is_break() {
                    stop.set();
                }
            }
        });
        stop.check()?;
        outcome
    }
}

impl Pass<'_> {
    /// Makes all levels of all channels and times, and hands them over.
    pub(super) fn run(&self, sink: &mut dyn Sink, track: &mut Track<'_>) -> Result<(), VolumeBuildError> {
        let about = self.volume.about();
        let quantum = |level: usize| sink.quantum(level);
        let shape = Shape {
            levels: self.levels,
            by_block: sink.by_block(),
            quantum: &quantum,
            border: sink.border(),
            width: about.dtype.bytes() as u64,
            chunk: about.levels[0].chunk,
        };
        let most = (self.memory / PARTS).max(1);
        let rounds = shape.rounds(USUAL_BLOCK.min(most), most).ok_or_else(|| {
            VolumeBuildError::Options(format!(
                "pieces of {:?} voxels do not fit into {} MiB, which is half of the memory that may be taken; make pages or \
                 shards smaller, or raise --memory-mib",
                shape.levels.first().map_or([0; 3], |_| (shape.quantum)(0)),
                most >> 20
            ))
        })?;
        for time in 0..about.times {
            self.run_time(time, &rounds, sink, track)?;
        }
        Ok(())
    }

    fn run_time(
        &self,
        time: u64,
        rounds: &[Round],
        sink: &mut dyn Sink,
        track: &mut Track<'_>,
    ) -> Result<(), VolumeBuildError> {
        let about = self.volume.about();
        let mut left: Option<Vec<Scratch>> = None;
        for round in rounds {
            let mut next = self.scratch_after(round)?;
            let size = self.levels[round.base].size;
            for at in round.blocks(size) {
                for channel in 0..about.channels {
                    let (begin, sides, inner) = around(round, size, at);
                    let block = match &mut left {
                        None => track.attend((self.pool, self.stop), sink.counts().bytes, || {
                            self.reading.read([channel, time], begin, sides, inner)
                        })?,
                        Some(left) => left[channel as usize]
                            .read(begin, sides, inner)
                            .map_err(|error| self.of_scratch(&error))?,
                    };
                    let place = Place { channel, time, level: round.base };
                    let last = track.attend((self.pool, self.stop), sink.counts().bytes, || {
                        self.run_block(place, round, block, sink)
                    })?;
                    if let (Some(next), Some(last)) = (&mut next, last) {
                        next[channel as usize].keep(last).map_err(|error| self.of_scratch(&error))?;
                    }
                    if left.is_none() {
                        let voxels: f64 =
                            (0..3).map(|axis| (inner[1][axis] - inner[0][axis]) as f64).product();
                        track.advance(voxels / size[0] as f64, sink.counts().bytes)?;
                    } else {
                        track.advance(0.0, sink.counts().bytes)?;
                    }
                }
            }
            left = next;
        }
        self.finish_time(time, left, sink, track)
    }

    /// Makes the levels of a block and hands them over; gives its part of the level after the last one.
    fn run_block(
        &self,
        place: Place,
        round: &Round,
        mut block: Block,
        sink: &mut dyn Sink,
    ) -> Result<Option<Block>, VolumeBuildError> {
        let dtype = self.volume.about().dtype;
        for level in round.base..=round.top {
            sink.write(Place { level, ..place }, &block, self.stop)?;
            let Some(coarser) = self.levels.get(level + 1) else { return Ok(None) };
            if level == round.top {
                block = block.into_inner(dtype.bytes());
            }
            block = block.halved(dtype, self.rule, coarser.factor);
        }
        Ok(Some(block))
    }

    /// Hands over the level that comes whole, if there is one.
    fn finish_time(
        &self,
        time: u64,
        mut left: Option<Vec<Scratch>>,
        sink: &mut dyn Sink,
        track: &Track<'_>,
    ) -> Result<(), VolumeBuildError> {
        let level = sink.by_block();
        let Some(last) = self.levels.get(level) else { return Ok(()) };
        for channel in 0..self.volume.about().channels {
            let all = [[0; 3], last.size];
            let block = match &mut left {
                None => track.attend((self.pool, self.stop), sink.counts().bytes, || {
                    self.reading.read([channel, time], [0; 3], last.size, all)
                })?,
                Some(left) => left[channel as usize]
                    .read([0; 3], last.size, all)
                    .map_err(|error| self.of_scratch(&error))?,
            };
            track.attend((self.pool, self.stop), sink.counts().bytes, || {
                sink.write_rest(Place { channel, time, level }, block)
            })?;
        }
        Ok(())
    }

    /// Room for what a round leaves, for each channel.
    fn scratch_after(&self, round: &Round) -> Result<Option<Vec<Scratch>>, VolumeBuildError> {
        let Some(next) = self.levels.get(round.top + 1) else { return Ok(None) };
        let base = &self.levels[round.base];
        let part =
            std::array::from_fn(|axis| (round.block[axis] / (next.scale[axis] / base.scale[axis])).max(1));
        let about = self.volume.about();
        let make =
            |_| Scratch::new(next.size, part, about.dtype.bytes(), MOST_HELD / about.channels, self.output);
        let made: Result<Vec<Scratch>, _> = (0..about.channels).map(make).collect();
        made.map(Some).map_err(|error| self.of_scratch(&error))
    }

    fn of_scratch(&self, error: &std::io::Error) -> VolumeBuildError {
        VolumeBuildError::output(format!("{} (a level on its way, beside it)", self.output.display()), error)
    }
}

/// What is read for a block: where it begins, its sides, and the block in it.
fn around(round: &Round, size: [u64; 3], at: [u64; 3]) -> ([u64; 3], [u64; 3], [[u64; 3]; 2]) {
    let end: [u64; 3] = std::array::from_fn(|axis| (at[axis] + round.block[axis]).min(size[axis]));
    let begin = std::array::from_fn(|axis| at[axis].saturating_sub(round.halo[axis]));
    let sides = std::array::from_fn(|axis| (end[axis] + round.halo[axis]).min(size[axis]) - begin[axis]);
    (begin, sides, [at, end])
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;
    use std::time::Instant;

    use super::*;

    /// Wants no more of what it is asked about for the second time.
    struct Impatient(Cell<usize>);

    impl Progress for Impatient {
        fn advance(&self, _: u64, _: u64, _: u64) -> ControlFlow<()> {
            self.0.set(self.0.get() + 1);
            if self.0.get() < 2 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        }
    }

    #[test]
    fn it_is_asked_whether_to_go_on_while_chunks_are_read() {
        let (pool, stop, progress) =
            (crate::threads::pool(2).unwrap(), Stop::default(), Impatient(Cell::new(0)));
        let track = Track { progress: &progress, rows: 0.0, rows_total: 1, bytes: 0 };
        // Work without an end of its own.
        let begun = Instant::now();
        let ended = track.attend((&pool, &stop), 0, || {
            while begun.elapsed() < Duration::from_secs(300) {
                stop.check()?;
                std::thread::yield_now();
            }
            Ok(())
        });
        assert!(matches!(ended, Err(VolumeBuildError::Cancelled)), "{ended:?}");
        assert!(progress.0.get() >= 2);
        // What the work gives is handed on.
        let stop = Stop::default();
        assert_eq!(track.attend((&pool, &stop), 0, || Ok(7)).unwrap(), 7);
    }
}
