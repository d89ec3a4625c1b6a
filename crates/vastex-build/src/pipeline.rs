//! Reading, filtering and writing at the same time.
//!
//! The caller's thread reads rows; a pool of threads turns them into levels and tiles and encodes those; one
//! thread appends them to the container. Bounded queues between them keep memory bounded, and every stage keeps the
//! order, so the bytes do not depend on the number of threads.

use std::ops::{ControlFlow, Range};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender, SyncSender, channel, sync_channel};
use std::thread;

use rayon::ThreadPool;
use rayon::prelude::*;
use vastex_core::{Description, PagePos};
use vastex_tiles::{Compression, EncodedTile, PartWriter, ResumableWriter, WriteError, Written};

use crate::Progress;
use crate::error::InputFault;
use crate::pyramid::{Band, Pyramid, block_rows, memory};
use crate::readers::{PixelFormat, RowReader};
use crate::tail::tail_texels;

/// Buffers of rows between reading and filtering.
const ROW_BUFFERS: usize = 3;
/// Batches of tiles between encoding and writing.
const BATCHES: usize = 4;
/// Texel bytes of the tiles that are encoded side by side.
const BATCH_BYTES: usize = 2 << 20;

type Batch = Vec<(PagePos, EncodedTile)>;

/// What a build does to the rows.
pub(crate) struct Job<'a> {
    pub(crate) description: &'a Description,
    pub(crate) linear_light: bool,
    pub(crate) compression: Compression,
    /// Which tiles are made, by their place in the order of writing: all of them or those of one part, without those
    /// that an interrupted build had made.
    pub(crate) tiles: Range<u64>,
    pub(crate) pool: &'a ThreadPool,
}

/// Where tiles go, one after the other.
pub(crate) trait Sink: Send {
    /// Takes the next tile.
    fn append(&mut self, pos: PagePos, tile: EncodedTile) -> Result<(), WriteError>;
    /// Puts the file in its place.
    fn finish(self) -> Result<Written, WriteError>;
}

impl Sink for ResumableWriter {
    fn append(&mut self, pos: PagePos, tile: EncodedTile) -> Result<(), WriteError> {
        ResumableWriter::append(self, pos, tile)
    }

    fn finish(self) -> Result<Written, WriteError> {
        ResumableWriter::finish(self)
    }
}

impl Sink for PartWriter {
    fn append(&mut self, pos: PagePos, tile: EncodedTile) -> Result<(), WriteError> {
        PartWriter::append(self, pos, &tile)
    }

    fn finish(self) -> Result<Written, WriteError> {
        PartWriter::finish(self)
    }
}

/// Why the pipeline ended early.
pub(crate) enum Stopped {
    Input(InputFault),
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
        (BATCH_BYTES / self.description.tile_bytes()).max(self.pool.current_num_threads())
    }

    /// Bytes that the pipeline holds at most, for an image whose rows have `image_row_bytes`, the reader's own and the
    /// index of the container not counted.
    pub(crate) fn memory(&self, image_row_bytes: usize) -> u64 {
        let (geometry, format) = (&self.description.geometry, self.description.layers[0].format);
        let rows = ROW_BUFFERS as u64 * u64::from(block_rows(geometry, format)) * image_row_bytes as u64;
        let batches = (BATCHES + 2) as u64 * self.batch_tiles() as u64 * self.description.tile_bytes() as u64;
        memory(geometry, format) + rows + batches
    }

    /// Runs a whole build, up to the last tile.
    pub(crate) fn run<S: Sink>(
        &self,
        reader: &mut dyn RowReader,
        sink: S,
        progress: &dyn Progress,
    ) -> Result<Done<S>, Stopped> {
        let (rows_tx, rows_rx) = sync_channel(ROW_BUFFERS);
        let (spare_tx, spare_rx) = channel();
        let (tiles_tx, tiles_rx) = sync_channel(BATCHES);
        let format = reader.header().format;
        let written = AtomicU64::new(0);
        for _ in 0..ROW_BUFFERS {
            // The other end is in this function, so nothing can fail.
            let _ = spare_tx.send(Vec::new());
        }
        thread::scope(|scope| {
            // Each stage owns its ends of the queues, so that the others see it end.
            let written = &written;
            let writing = scope.spawn(move || append_tiles(sink, &tiles_rx, written));
            let cutting = scope.spawn(move || {
                self.pool.install(move || self.cut_tiles(format, &rows_rx, &spare_tx, &tiles_tx))
            });
            let read = self.read(reader, &rows_tx, &spare_rx, progress, written);
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

    fn read(
        &self,
        reader: &mut dyn RowReader,
        rows_tx: &SyncSender<Vec<u8>>,
        spare_rx: &Receiver<Vec<u8>>,
        progress: &dyn Progress,
        written: &AtomicU64,
    ) -> Result<(), Stopped> {
        let (height, row_bytes) = (reader.header().height, reader.header().row_bytes());
        let block = block_rows(&self.description.geometry, self.description.layers[0].format);
        let mut done = 0;
        while done < height {
            let now = progress.advance(done.into(), height.into(), written.load(Ordering::Relaxed));
            if now == ControlFlow::Break(()) {
                return Err(Stopped::Cancelled);
            }
            let Ok(mut rows) = spare_rx.recv() else { return Ok(()) };
            let count = block.min(height - done);
            rows.resize(count as usize * row_bytes, 0);
            reader.read_rows(&mut rows).map_err(Stopped::Input)?;
            if rows_tx.send(rows).is_err() {
                return Ok(());
            }
            done += count;
        }
        Ok(())
    }

    /// Filters rows and cuts tiles until the rows end or the last tile that is wanted is made; says how many bytes of
    /// rows it held.
    fn cut_tiles(
        &self,
        image_format: PixelFormat,
        rows_rx: &Receiver<Vec<u8>>,
        spare_tx: &Sender<Vec<u8>>,
        tiles_tx: &SyncSender<Batch>,
    ) -> Result<u64, OtherStage> {
        let (geometry, format) = (&self.description.geometry, self.description.layers[0].format);
        let mut pyramid = Pyramid::new(geometry, format, self.linear_light);
        let mut first_tile = 0;
        for rows in rows_rx {
            pyramid.push(&rows, image_format);
            // Nobody waits for it once everything is read.
            let _ = spare_tx.send(rows);
            pyramid.cut_ready(|band| {
                self.encode(band, first_tile, tiles_tx)?;
                first_tile += u64::from(band.pages());
                Ok(())
            })?;
            if first_tile >= self.tiles.end {
                return Ok(pyramid.allocated());
            }
        }
        if !pyramid.is_complete() {
            return Err(OtherStage);
        }
        if self.tiles.contains(&first_tile) {
            let tail = self.encoded(tail_texels(geometry, format, &pyramid));
            tiles_tx.send(vec![(geometry.tail_pos(), tail)]).map_err(|_| OtherStage)?;
        }
        Ok(pyramid.allocated())
    }

    /// Encodes what is wanted of a band whose first tile is number `first_tile` in the order of writing.
    fn encode(
        &self,
        band: &Band<'_>,
        first_tile: u64,
        tiles_tx: &SyncSender<Batch>,
    ) -> Result<(), OtherStage> {
        let batch = self.batch_tiles();
        let column_of = |tile: u64| tile.saturating_sub(first_tile).min(band.pages().into()) as u32;
        let wanted = column_of(self.tiles.start)..column_of(self.tiles.end);
        for first in wanted.clone().step_by(batch) {
            let columns = first..wanted.end.min(first.saturating_add(batch as u32));
            let encode = |x| (band.pos(x), self.encoded(band.tile_texels(x)));
            let tiles = columns.into_par_iter().map(encode).collect();
            tiles_tx.send(tiles).map_err(|_| OtherStage)?;
        }
        Ok(())
    }

    fn encoded(&self, texels: Vec<u8>) -> EncodedTile {
        EncodedTile::new(texels.into(), self.description, self.compression)
    }
}

fn append_tiles<S: Sink>(
    mut sink: S,
    tiles_rx: &Receiver<Batch>,
    written: &AtomicU64,
) -> Result<S, WriteError> {
    for batch in tiles_rx {
        for (pos, tile) in batch {
            written.fetch_add(tile.tile().bytes.len() as u64, Ordering::Relaxed);
            sink.append(pos, tile)?;
        }
    }
    Ok(sink)
}
