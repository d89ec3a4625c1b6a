//! Reading, filtering and writing at the same time.
//!
//! The caller's thread reads rows; a pool of threads turns them into levels and tiles and encodes those; one
//! thread appends them to the container. Bounded queues between them keep memory bounded, and every stage keeps the
//! order, so the bytes do not depend on the number of threads.

use std::ops::{ControlFlow, Range};
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender, SyncSender, channel, sync_channel};
use std::thread;

use rayon::ThreadPool;
use rayon::prelude::*;
use vastex_core::{Description, PagePos};
use vastex_tiles::{Compression, EncodedTile, PartWriter, ResumableWriter, WriteError, Written};

use crate::Progress;
use crate::error::InputFault;
use crate::layers::OpenLayer;
use crate::shared::NEIGHBOURS;
use crate::sparse::Selection;
use crate::stack::{self, Bands, LayerPlan, Stack};

/// How much waits between the stages. It decides speed and memory, never bytes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Buffers {
    /// Buffers of rows between reading and filtering.
    rows: usize,
    /// Batches of tiles between encoding and writing.
    batches: usize,
    /// Bytes of the tiles that are encoded side by side, before they are compressed.
    batch_bytes: usize,
}

impl Default for Buffers {
    fn default() -> Buffers {
        Buffers::ALL[0]
    }
}

impl Buffers {
    /// From what suits most to what takes least.
    ///
    /// Cutting a row of pages takes long, and the rows in between do not: so many buffers as its rows fill keep the reader
    /// busy meanwhile.
    const ALL: [Buffers; 5] = [
        Buffers { rows: 16, batches: 4, batch_bytes: 2 << 20 },
        Buffers { rows: 3, batches: 4, batch_bytes: 2 << 20 },
        Buffers { rows: 2, batches: 2, batch_bytes: 1 << 20 },
        Buffers { rows: 2, batches: 1, batch_bytes: 256 << 10 },
        Buffers { rows: 1, batches: 1, batch_bytes: 1 },
    ];
}

/// Pages in the order of writing, with their tiles if they have any.
type Batch = Vec<(PagePos, Option<EncodedTile>)>;
/// Rows of every layer's image, as many as lie along the same rows of the texture.
type LayerRows = Vec<Vec<u8>>;

/// What a build does to the rows.
pub(crate) struct Job<'a> {
    pub(crate) description: &'a Description,
    /// One for each layer.
    pub(crate) plans: &'a [LayerPlan],
    pub(crate) compression: Compression,
    /// Which tiles are made, by their place in the order of writing: all of them or those of one part, without those
    /// that an interrupted build had made.
    pub(crate) tiles: Range<u64>,
    pub(crate) pool: &'a ThreadPool,
    pub(crate) buffers: Buffers,
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

impl Job<'_> {
    fn batch_tiles(&self) -> usize {
        (self.buffers.batch_bytes / self.description.tile_bytes()).max(self.pool.current_num_threads())
    }

    /// Takes the largest buffers with which all that the pipeline holds comes to at most `limit` bytes, or the smallest.
    pub(crate) fn fit(&mut self, limit: u64) {
        for buffers in Buffers::ALL {
            self.buffers = buffers;
            if self.memory() <= limit {
                return;
            }
        }
    }

    /// Bytes that the pipeline holds at most, the readers' own and the index of the container not counted.
    pub(crate) fn memory(&self) -> u64 {
        let block = stack::block_rows(self.plans);
        let row_bytes =
            |plan: &LayerPlan| u64::from(block / plan.layer.scale) * plan.image_row_bytes() as u64;
        let rows = self.buffers.rows as u64 * self.plans.iter().map(row_bytes).sum::<u64>();
        // One batch is being made, its tiles cut as well as compressed, and one is being written.
        let batches = (self.buffers.batches + 3) as u64
            * self.batch_tiles() as u64
            * self.description.tile_bytes() as u64;
        stack::memory(self.plans) + rows + batches
    }

    /// Runs a whole build, up to the last tile.
    pub(crate) fn run<S: Sink>(
        &self,
        layers: &mut [OpenLayer],
        selection: Selection,
        sink: S,
        progress: &dyn Progress,
    ) -> Result<Done<S>, Stopped> {
        let (rows_tx, rows_rx) = sync_channel(self.buffers.rows);
        let (spare_tx, spare_rx) = channel();
        let (tiles_tx, tiles_rx) = sync_channel(self.buffers.batches);
        let written = AtomicU64::new(0);
        for _ in 0..self.buffers.rows {
            // The other end is in this function, so nothing can fail.
            let _ = spare_tx.send(vec![Vec::new(); self.plans.len()]);
        }
        thread::scope(|scope| {
            // Each stage owns its ends of the queues, so that the others see it end.
            let written = &written;
            let writing = scope.spawn(move || append_tiles(sink, &tiles_rx, written));
            let cutting = scope.spawn(move || {
                self.pool.install(move || self.cut_tiles(selection, &rows_rx, &spare_tx, &tiles_tx))
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

    /// Reads all images, each in turn as far as the same rows of the texture.
    fn read(
        &self,
        layers: &mut [OpenLayer],
        rows_tx: &SyncSender<LayerRows>,
        spare_rx: &Receiver<LayerRows>,
        progress: &dyn Progress,
        written: &AtomicU64,
    ) -> Result<(), Stopped> {
        let height = self.description.geometry.size()[1];
        let block = stack::block_rows(self.plans);
        let (mut spare, mut done) = (Vec::new(), 0);
        while done < height {
            let now = progress.advance(done.into(), height.into(), written.load(Ordering::Relaxed));
            if now == ControlFlow::Break(()) {
                return Err(Stopped::Cancelled);
            }
            // What came back last is filled first: it is still near the processor.
            spare.extend(spare_rx.try_iter());
            let Some(mut rows) = spare.pop().or_else(|| spare_rx.recv().ok()) else { return Ok(()) };
            let block = done..done + block.min(height - done);
            for ((layer, plan), rows) in layers.iter_mut().zip(self.plans).zip(&mut rows) {
                rows.resize(plan.rows(&block) as usize * plan.image_row_bytes(), 0);
                let failed = |fault| Stopped::Input { path: layer.path.clone(), fault };
                layer.reader.read_rows(rows).map_err(failed)?;
            }
            if rows_tx.send(rows).is_err() {
                return Ok(());
            }
            done = block.end;
        }
        Ok(())
    }

    /// Filters rows and cuts tiles until the rows end or the last tile that is wanted is made; says how many bytes of
    /// rows it held.
    fn cut_tiles(
        &self,
        mut selection: Selection,
        rows_rx: &Receiver<LayerRows>,
        spare_tx: &Sender<LayerRows>,
        tiles_tx: &SyncSender<Batch>,
    ) -> Result<u64, OtherStage> {
        let mut stack = Stack::new(self.plans);
        let mut first_tile = 0;
        for rows in rows_rx {
            stack.push(&rows);
            // Nobody waits for it once everything is read.
            let _ = spare_tx.send(rows);
            stack.cut_ready(|bands| {
                let kept = selection.kept(bands);
                self.encode(bands, &kept, first_tile, tiles_tx)?;
                first_tile += u64::from(bands.pages());
                Ok(())
            })?;
            if first_tile >= self.tiles.end {
                return Ok(stack.allocated());
            }
        }
        if !stack.is_complete() {
            return Err(OtherStage);
        }
        if self.tiles.contains(&first_tile) {
            let (pos, tail) = (self.description.geometry.tail_pos(), self.encoded(stack.tail()));
            tiles_tx.send(vec![(pos, Some(tail))]).map_err(|_| OtherStage)?;
        }
        Ok(stack.allocated())
    }

    /// Encodes what is wanted of a row of pages whose first tile is number `first_tile` in the order of writing; `kept` says
    /// which of them have one.
    fn encode(
        &self,
        bands: &Bands<'_>,
        kept: &[bool],
        first_tile: u64,
        tiles_tx: &SyncSender<Batch>,
    ) -> Result<(), OtherStage> {
        let batch = self.batch_tiles();
        let column_of = |tile: u64| tile.saturating_sub(first_tile).min(bands.pages().into()) as u32;
        let wanted = column_of(self.tiles.start)..column_of(self.tiles.end);
        for first in wanted.clone().step_by(batch) {
            let columns = first..wanted.end.min(first.saturating_add(batch as u32));
            let neighbours = (batch / self.pool.current_num_threads()).clamp(1, NEIGHBOURS);
            let encode = |first: u32| {
                let columns = first..columns.end.min(first + neighbours as u32);
                let tiles = bands.tiles(columns.clone(), kept).into_iter();
                columns.zip(tiles).map(|(x, tile)| (bands.pos(x), tile.map(|tile| self.encoded(tile))))
            };
            let starts: Vec<u32> = columns.clone().step_by(neighbours).collect();
            let tiles = starts.into_par_iter().flat_map_iter(encode).collect();
            tiles_tx.send(tiles).map_err(|_| OtherStage)?;
        }
        Ok(())
    }

    fn encoded(&self, tile: Vec<u8>) -> EncodedTile {
        EncodedTile::new(tile.into(), self.description, self.compression)
    }
}

fn append_tiles<S: Sink>(
    mut sink: S,
    tiles_rx: &Receiver<Batch>,
    written: &AtomicU64,
) -> Result<S, WriteError> {
    for batch in tiles_rx {
        for (pos, tile) in batch {
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
