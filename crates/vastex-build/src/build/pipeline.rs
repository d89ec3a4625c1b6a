//! Reading, filtering and writing at the same time.
//!
//! The caller's thread reads rows, those of further layers on a thread for each; a pool of threads turns them
//! into levels and tiles and encodes those, and decodes pieces of the images ahead where it has nothing else
//! to do; one thread appends tiles to the container. Bounded queues between them keep memory bounded, and
//! every stage keeps the order, so the bytes do not depend on the number of threads.
//!
//! One thread of the pool, the cutter, drives it. It hands tiles out in portions, which the others encode,
//! and goes on making levels meanwhile; where it would have to wait it encodes too ([`attend`]). What is
//! appended next is a promise: the queue to the writer holds them in the order of writing, whichever is kept
//! first.

use std::collections::VecDeque;
use std::convert::Infallible;
use std::ops::{ControlFlow, Range};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender, SyncSender, TryRecvError, channel, sync_channel};
use std::thread;

use rayon::{ScopeFifo, ThreadPool};
use vastex_core::{Description, PagePos};
use vastex_tiles::{EncodedTile, PartWriter, ResumableWriter, WriteError, Written};

use super::attend;
use super::layer_rows::LayerReaders;
use super::layers::OpenLayer;
use super::sparse::Selection;
use crate::image::{Helpers, InputFault};
use crate::progress::{Progress, watched};
use crate::pyramid::shared::{NEIGHBOURS, Waiting};
use crate::pyramid::stack::{self, LayerBands, LayerPlan, Stack};
use crate::tile::TileEncoder;

/// How much waits between the stages. It decides speed and memory, never bytes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Buffers {
    /// Buffers of rows between reading and filtering.
    rows: usize,
    /// How many buffers of rows are filtered while tiles of the rows before them are still being encoded, at
    /// least; none where one buffer makes several rows of pages, which are enough for two threads to share.
    ahead: u32,
    /// Portions that lie ready for each thread while a row of pages is being filtered, where there are two
    /// threads or more.
    ready: usize,
    /// Bytes of the tiles between cutting and writing, before they are compressed.
    tile_bytes: usize,
    /// Bytes of the tiles that one thread cuts and encodes at a time, before they are compressed.
    portion_bytes: usize,
    /// Pieces of each image that are decoded ahead, for each thread.
    pieces: usize,
}

impl Default for Buffers {
    fn default() -> Buffers {
        Buffers::ALL[0]
    }
}

impl Buffers {
    /// From what suits most to what takes least.
    const ALL: [Buffers; 6] = [
        Buffers { rows: 8, ahead: 4, ready: 1, tile_bytes: 8 << 20, portion_bytes: 256 << 10, pieces: 2 },
        Buffers { rows: 8, ahead: 4, ready: 0, tile_bytes: 8 << 20, portion_bytes: 256 << 10, pieces: 2 },
        Buffers { rows: 3, ahead: 2, ready: 0, tile_bytes: 8 << 20, portion_bytes: 256 << 10, pieces: 1 },
        Buffers { rows: 2, ahead: 1, ready: 0, tile_bytes: 4 << 20, portion_bytes: 256 << 10, pieces: 0 },
        Buffers { rows: 2, ahead: 0, ready: 0, tile_bytes: 1 << 20, portion_bytes: 64 << 10, pieces: 0 },
        Buffers { rows: 1, ahead: 0, ready: 0, tile_bytes: 1, portion_bytes: 1, pieces: 0 },
    ];
}

/// What [`Buffers`] have of pieces at most.
pub(crate) const MOST_PIECES: usize = 2;

/// Pages in the order of writing, with their tiles if they have any.
type Portion = Vec<(PagePos, Option<EncodedTile>)>;
/// A portion that is being made, or that nobody will make since another stage failed.
type Promise = Receiver<Portion>;
/// Rows of every layer's image, as many as lie along the same rows of the texture.
type LayerRows = Vec<Vec<u8>>;

/// What a build does to the rows.
pub(crate) struct Job<'a> {
    /// One for each layer.
    pub(crate) plans: &'a [LayerPlan],
    pub(crate) encoder: &'a TileEncoder,
    pub(crate) pool: &'a Arc<ThreadPool>,
    pub(crate) buffers: Buffers,
    /// Bytes that the readers hold besides, where so many pieces are decoded ahead for each thread.
    pub(crate) ahead_bytes: [u64; MOST_PIECES + 1],
}

/// Where tiles go, one after the other.
pub(crate) trait Sink: Send {
    /// Takes the next tile.
    fn append(&mut self, pos: PagePos, tile: EncodedTile) -> Result<(), WriteError>;
    /// The next page has no tile.
    fn skip(&mut self, pos: PagePos) -> Result<(), WriteError>;
    /// Puts the file in its place.
    fn finish(self) -> Result<Written, WriteError>;
}

impl Sink for ResumableWriter {
    fn append(&mut self, pos: PagePos, tile: EncodedTile) -> Result<(), WriteError> {
        ResumableWriter::append(self, pos, tile)
    }

    fn skip(&mut self, pos: PagePos) -> Result<(), WriteError> {
        ResumableWriter::skip(self, pos)
    }

    fn finish(self) -> Result<Written, WriteError> {
        ResumableWriter::finish(self)
    }
}

impl Sink for PartWriter {
    fn append(&mut self, pos: PagePos, tile: EncodedTile) -> Result<(), WriteError> {
        PartWriter::append(self, pos, &tile)
    }

    fn skip(&mut self, pos: PagePos) -> Result<(), WriteError> {
        PartWriter::skip(self, pos)
    }

    fn finish(self) -> Result<Written, WriteError> {
        PartWriter::finish(self)
    }
}

/// Why the pipeline ended early.
pub(crate) enum Stopped {
    /// An image cannot be read.
    Input {
        path: PathBuf,
        fault: InputFault,
    },
    Output(WriteError),
    Cancelled,
}

/// A build that only needs its file finished.
pub(crate) struct Done<S> {
    pub(crate) sink: S,
    /// Bytes of the tiles in it.
    pub(crate) bytes: u64,
    /// Bytes of rows that were held at once.
    pub(crate) row_bytes_held: u64,
}

/// Another stage failed and knows why.
struct OtherStage;

/// That one promise more may be in the queue to the writer.
struct Room;

/// The cutter's end of the queue to the writer, which is bounded by the rooms that come back: so the cutter
/// waits for room as it waits for everything else.
struct ToWriter {
    promises: Sender<Promise>,
    room: Receiver<Room>,
}

impl Job<'_> {
    fn description(&self) -> &Description {
        self.encoder.description()
    }

    /// Tiles that one thread cuts and encodes at a time.
    fn portion_tiles(&self) -> usize {
        (self.buffers.portion_bytes / self.description().tile_bytes()).clamp(1, NEIGHBOURS)
    }

    /// Portions that lie ready while rows are filtered, beside those that are being made: none where one
    /// thread, the cutter, does all, and where memory is scarce.
    fn ready(&self) -> usize {
        let threads = self.pool.current_num_threads();
        if threads > 1 { self.buffers.ready * threads } else { 0 }
    }

    /// Portions between cutting and writing: at least two for each thread, one that it makes and one that it
    /// makes next.
    fn portions(&self) -> usize {
        let bytes = self.portion_tiles() * self.description().tile_bytes();
        (self.buffers.tile_bytes / bytes).max(2 * self.pool.current_num_threads() + self.ready())
    }

    /// Buffers of rows that are filtered while tiles of the rows before them are encoded. Nothing of a row of
    /// pages can be encoded before all of it is there, so that is the whole row which comes next, and as
    /// much of those after it as lies ready besides.
    fn ahead(&self) -> u32 {
        let (geometry, block) = (&self.description().geometry, stack::block_rows(self.plans));
        let [_, page, _] = geometry.page();
        let least = if block < 2 * page { self.buffers.ahead } else { 0 };
        if self.ready() == 0 {
            return least;
        }
        let in_a_row = geometry.level(0).pages[0].div_ceil(self.portion_tiles() as u32).max(1);
        let rows = u64::from(page) * (u64::from(in_a_row) + self.ready() as u64);
        least.max(rows.div_ceil(u64::from(in_a_row) * u64::from(block)) as u32)
    }

    /// Takes the largest buffers with which all that the pipeline holds comes to at most `limit` bytes, or
    /// the smallest.
    pub(crate) fn fit(&mut self, limit: u64) {
        for buffers in Buffers::ALL {
            self.buffers = buffers;
            if self.memory() <= limit {
                return;
            }
        }
    }

    /// Bytes that the pipeline holds at most, what the readers hold without help and the index of the
    /// container not counted.
    pub(crate) fn memory(&self) -> u64 {
        let block = stack::block_rows(self.plans);
        let row_bytes =
            |plan: &LayerPlan| u64::from(block / plan.layer.scale) * plan.image_row_bytes() as u64;
        let rows = self.buffers.rows as u64 * self.plans.iter().map(row_bytes).sum::<u64>();
        // Besides those in the queue, one portion waits to enter it and one is being written; what each
        // thread makes is there twice while it is being made.
        let portions = (self.portions() + 2 + self.pool.current_num_threads()) as u64;
        let tiles = portions * self.portion_tiles() as u64 * self.description().tile_bytes() as u64;
        let ahead = self.ahead_bytes[self.buffers.pieces];
        (stack::memory(self.plans, self.encoder, self.ahead()) + rows + tiles).saturating_add(ahead)
    }

    /// Runs a whole build, up to the last of `tiles`: those that are made, by their index in the order of
    /// writing.
    pub(crate) fn run<S: Sink>(
        &self,
        layers: &mut [OpenLayer],
        tiles: Range<u64>,
        selection: Selection,
        sink: S,
        progress: &dyn Progress,
    ) -> Result<Done<S>, Stopped> {
        let (rows_tx, rows_rx) = sync_channel(self.buffers.rows);
        let (spare_tx, spare_rx) = channel();
        let (tiles_tx, tiles_rx) = channel();
        let (room_tx, room_rx) = channel();
        let written = AtomicU64::new(0);
        for _ in 0..self.buffers.rows {
            // The other end is in this function, so nothing can fail.
            let _ = spare_tx.send(vec![Vec::new(); self.plans.len()]);
        }
        (0..self.portions()).for_each(|_| drop(room_tx.send(Room)));
        thread::scope(|scope| {
            // Each stage owns its ends of the queues, so that the others see it end.
            let written = &written;
            let writing = scope.spawn(move || append_tiles(sink, &tiles_rx, &room_tx, written));
            let cutting = scope.spawn(move || {
                let to_writer = ToWriter { promises: tiles_tx, room: room_rx };
                self.pool.install(move || self.cut_tiles(tiles, selection, rows_rx, &spare_tx, to_writer))
            });
            let read = self.read(layers, &rows_tx, &spare_rx, progress, written);
            drop(rows_tx);
            let cut = cutting.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
            let writer = writing.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
            read?;
            let sink = writer.map_err(Stopped::Output)?;
            // Cutting fails only because one of the others did.
            let bytes = written.load(Ordering::Relaxed);
            cut.map(|row_bytes_held| Done { sink, bytes, row_bytes_held })
                .map_err(|OtherStage| Stopped::Cancelled)
        })
    }

    /// Reads all images, each as far as the same rows of the texture.
    fn read(
        &self,
        layers: &mut [OpenLayer],
        rows_tx: &SyncSender<LayerRows>,
        spare_rx: &Receiver<LayerRows>,
        progress: &dyn Progress,
        written: &AtomicU64,
    ) -> Result<(), Stopped> {
        let pieces = self.buffers.pieces * self.pool.current_num_threads();
        let helpers = Helpers::new(self.pool.clone(), pieces);
        layers.iter_mut().for_each(|layer| layer.reader.take_help(&helpers));
        let height = self.description().geometry.size()[1];
        let block = stack::block_rows(self.plans);
        let first = layers.first().map(|layer| layer.reader.header().clone());
        let mut beginnings: Vec<_> = layers.iter().filter_map(|layer| layer.reader.beginning()).collect();
        // How much is done is told of the first layer alone.
        let mut told = layers.first().and_then(|layer| layer.reader.beginning());
        told.take_if(|beginning| beginning.is_of_all_rows());
        let (mut spare, mut done) = (Vec::new(), 0);
        thread::scope(|scope| {
            let readers = layers.iter_mut().map(|layer| (layer.path.as_path(), &mut *layer.reader));
            let mut readers = LayerReaders::new(readers, scope);
            while done < height {
                let now = progress.advance(done.into(), height.into(), written.load(Ordering::Relaxed));
                if now == ControlFlow::Break(()) {
                    return Err(Stopped::Cancelled);
                }
                // What came back last is filled first: it is still near the processor.
                spare.extend(spare_rx.try_iter());
                let Some(mut rows) = spare.pop().or_else(|| spare_rx.recv().ok()) else { return Ok(()) };
                let block = done..done + block.min(height - done);
                for (plan, rows) in self.plans.iter().zip(&mut rows) {
                    rows.resize(plan.rows(&block) as usize * plan.image_row_bytes(), 0);
                }
                let failed = |(path, fault): (&Path, _)| Stopped::Input { path: path.into(), fault };
                let tell = || match &told {
                    Some(beginning) => progress.beginning(beginning.share()),
                    None => progress.advance(done.into(), height.into(), written.load(Ordering::Relaxed)),
                };
                let read = watched(&beginnings, &tell, || readers.read(&mut rows));
                read.ok_or(Stopped::Cancelled)?.map_err(failed)?;
                beginnings.retain(|beginning| beginning.is_of_all_rows());
                told = None;
                if let (Some(header), Some(rows)) = (&first, rows.first()) {
                    progress.rows(header, done / self.plans[0].layer.scale, rows);
                }
                if rows_tx.send(rows).is_err() {
                    return Ok(());
                }
                done = block.end;
            }
            Ok(())
        })
    }

    /// Filters rows and cuts tiles until the rows end or the last tile that is wanted is made; says how many
    /// bytes of rows it held. Is called in the pool, and returns when every tile is made.
    fn cut_tiles(
        &self,
        tiles: Range<u64>,
        selection: Selection,
        rows_rx: Receiver<LayerRows>,
        spare_tx: &Sender<LayerRows>,
        to_writer: ToWriter,
    ) -> Result<u64, OtherStage> {
        let waiting = &Waiting::default();
        rayon::scope_fifo(move |scope| {
            let (held, first_tile) = (VecDeque::new(), 0);
            let mut cutter = Cutter {
                job: self,
                scope,
                waiting,
                tiles,
                selection,
                to_writer,
                held,
                pushed: 0,
                first_tile,
            };
            cutter.cut(&rows_rx, spare_tx)
        })
    }
}

/// The thread of the pool that makes levels and hands out tiles.
struct Cutter<'a, 'scope> {
    job: &'scope Job<'scope>,
    scope: &'a ScopeFifo<'scope>,
    /// Portions that were handed out.
    waiting: &'scope Waiting,
    /// The tiles that are made, by their index in the order of writing.
    tiles: Range<u64>,
    selection: Selection,
    to_writer: ToWriter,
    /// After how many pushes rows of pages were cut whose tiles are still being made, the oldest first.
    /// Nothing is ever sent: the other end is dropped with the rows.
    held: VecDeque<(u64, Receiver<Infallible>)>,
    /// Buffers of rows that were filtered.
    pushed: u64,
    /// Number of the next row's first tile, in the order of writing.
    first_tile: u64,
}

impl<'scope> Cutter<'_, 'scope> {
    fn cut(
        &mut self,
        rows_rx: &Receiver<LayerRows>,
        spare_tx: &Sender<LayerRows>,
    ) -> Result<u64, OtherStage> {
        let mut stack = Stack::new(self.job.plans, self.job.encoder);
        while let Some(rows) = attend::next(rows_rx) {
            self.wait_for_held_rows();
            stack.push(&rows);
            self.pushed += 1;
            // Nobody waits for it once everything is read.
            let _ = spare_tx.send(rows);
            stack.cut_ready(|bands| self.hand_out(bands))?;
            if self.first_tile >= self.tiles.end {
                return Ok(stack.allocated());
            }
        }
        if !stack.is_complete() {
            return Err(OtherStage);
        }
        if self.tiles.contains(&self.first_tile) {
            let (made_tx, made_rx) = channel();
            self.promise(made_rx)?;
            let pos = self.job.description().geometry.tail_pos();
            // The writer may have failed.
            let _ = made_tx.send(vec![(pos, Some(self.job.encoder.tile_of_buffer(stack.tail())))]);
        }
        Ok(stack.allocated())
    }

    /// Hands out what is wanted of a row of pages.
    fn hand_out(&mut self, bands: LayerBands<'scope>) -> Result<(), OtherStage> {
        let (job, waiting, first_tile, pages) = (self.job, self.waiting, self.first_tile, bands.pages());
        self.first_tile += u64::from(pages);
        let kept = self.selection.kept(&bands);
        let column_of = |tile: u64| tile.saturating_sub(first_tile).min(pages.into()) as u32;
        let wanted = column_of(self.tiles.start)..column_of(self.tiles.end);
        let portion = job.portion_tiles();
        let (held_tx, held_rx) = channel();
        let shared = Arc::new((bands, kept, held_tx));
        self.held.push_back((self.pushed, held_rx));
        for first in wanted.clone().step_by(portion) {
            let columns = first..wanted.end.min(first + portion as u32);
            let ((made_tx, made_rx), shared) = (channel(), shared.clone());
            self.promise(made_rx)?;
            waiting.add();
            self.scope.spawn_fifo(move |_| {
                waiting.begin();
                let (bands, kept, _) = &*shared;
                let tiles = bands.tiles(columns.clone(), kept, waiting).into_iter();
                let encoded = tiles.map(|tile| tile.map(|tile| job.encoder.tile_of_buffer(tile)));
                // The writer may have failed.
                let _ = made_tx.send(columns.map(|x| bands.pos(x)).zip(encoded).collect());
            });
        }
        Ok(())
    }

    /// Tells the writer what comes next; works while there is no room for it.
    fn promise(&self, made: Promise) -> Result<(), OtherStage> {
        let Room = attend::next(&self.to_writer.room).ok_or(OtherStage)?;
        self.to_writer.promises.send(made).map_err(|_| OtherStage)
    }

    /// Works until the rows that are being encoded are as few as there is memory for.
    fn wait_for_held_rows(&mut self) {
        while let Some((pushed, held)) = self.held.front() {
            if self.pushed - pushed >= self.job.ahead().into() {
                attend::next(held);
            } else if matches!(held.try_recv(), Err(TryRecvError::Empty)) {
                return;
            }
            self.held.pop_front();
        }
    }
}

fn append_tiles<S: Sink>(
    mut sink: S,
    tiles_rx: &Receiver<Promise>,
    room_tx: &Sender<Room>,
    written: &AtomicU64,
) -> Result<S, WriteError> {
    for promise in tiles_rx {
        // The cutter may be done.
        let _ = room_tx.send(Room);
        // Who made it has panicked; the cutter tells.
        let Ok(portion) = promise.recv() else { break };
        for (pos, tile) in portion {
            match tile {
                Some(tile) => {
                    written.fetch_add(tile.tile().bytes.len() as u64, Ordering::Relaxed);
                    sink.append(pos, tile)?;
                }
                None => sink.skip(pos)?,
            }
        }
    }
    Ok(sink)
}
