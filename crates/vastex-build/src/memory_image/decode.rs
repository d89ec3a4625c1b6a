//! An image file, decoded into memory.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::MemoryImage;
use crate::build::error::BuildError;
use crate::image::{Helpers, RowReader, in_srgb, open_while};
use crate::progress::{Progress, read_first_rows, read_further_rows};
use crate::threads;

/// Bytes of the rows that are decoded at once.
const ROWS_BYTES: usize = 1 << 20;
/// Pieces of an image that each thread decodes ahead.
const PIECES: usize = 2;

/// How an image is decoded into memory.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DecodeOptions {
    /// Bytes of the decoded image with all levels. A larger image is halved until it fits; a texel is then
    /// the mean of four of those that it stands for.
    pub image_bytes: u64,
    /// Bytes that the image's reader may take besides, as those of progressive JPEGs and of pictures that are
    /// stored turned do. What takes more is refused.
    pub reader_bytes: u64,
    /// True if the left and right edges are neighbours.
    pub wraps: bool,
    /// Threads that help to decode what is stored in pieces; 0 for one for each core.
    pub threads: usize,
    /// True if the decoding threads give way to others, as in [`crate::BuildOptions::gives_way`].
    pub gives_way: bool,
}

impl Default for DecodeOptions {
    /// 1 GiB for the image, 1 GiB for its reader, edges that are no neighbours, a thread for each core.
    fn default() -> DecodeOptions {
        let (image_bytes, reader_bytes) = (1 << 30, 1 << 30);
        DecodeOptions { image_bytes, reader_bytes, wraps: false, threads: 0, gives_way: false }
    }
}

/// An image that is open, to be decoded into memory.
pub struct Decoding {
    path: PathBuf,
    reader: Box<dyn RowReader>,
    image: Arc<MemoryImage>,
    threads: usize,
    gives_way: bool,
}

impl Decoding {
    /// Opens an image. Reads its header, and takes no memory for its texels yet.
    ///
    /// Fails where [`crate::build()`] would, and with [`BuildError::Memory`] where the image's reader takes
    /// more than [`DecodeOptions::reader_bytes`].
    pub fn open(path: &Path, options: &DecodeOptions) -> Result<Decoding, BuildError> {
        Decoding::open_while(path, options, &())
    }

    /// Opens an image as [`Decoding::open`] does, unless `progress` breaks it off ([`Progress::opening`]).
    pub fn open_while(
        path: &Path,
        options: &DecodeOptions,
        progress: &dyn Progress,
    ) -> Result<Decoding, BuildError> {
        let opened = open_while(path, &|| progress.opening());
        let opened = opened.map_err(|fault| BuildError::input(path, fault))?;
        let reader = in_srgb(opened);
        let header = reader.header();
        if header.memory > options.reader_bytes {
            return Err(BuildError::Memory {
                path: path.into(),
                needed: header.memory,
                limit: options.reader_bytes,
                remedy: "convert it to a TIFF of many strips or of tiles, stored upright",
            });
        }
        let halvings = MemoryImage::halvings_to_fit(header, options.image_bytes);
        let image = Arc::new(MemoryImage::new(header, halvings, options.wraps)?);
        let &DecodeOptions { threads, gives_way, .. } = options;
        Ok(Decoding { path: path.into(), reader, image, threads, gives_way })
    }

    /// The image, which can be read from before it is decoded, as far as its rows are there.
    pub fn image(&self) -> &Arc<MemoryImage> {
        &self.image
    }

    /// Decodes the whole image. `progress` is told its notices and its rows, with 0 for what is written, and
    /// may stop it.
    pub fn run(mut self, progress: &dyn Progress) -> Result<Arc<MemoryImage>, BuildError> {
        let header = self.reader.header().clone();
        header.notices.iter().for_each(|notice| progress.note(&self.path, notice));
        let pool = if self.gives_way { threads::pool_that_gives_way } else { threads::pool };
        let pool = Arc::new(pool(self.threads)?);
        let pieces = PIECES * pool.current_num_threads();
        self.reader.take_help(&Helpers::new(pool, pieces));
        let row = header.row_bytes();
        let together = (ROWS_BYTES / row).clamp(1, header.height as usize);
        let mut rows = vec![0; together * row];
        let mut done = 0;
        loop {
            if progress.advance(done.into(), header.height.into(), 0) == ControlFlow::Break(()) {
                return Err(BuildError::Cancelled);
            }
            if done == header.height {
                return Ok(self.image);
            }
            let count = (header.height - done).min(together as u32);
            let rows = &mut rows[..count as usize * row];
            let read = match done {
                0 => read_first_rows(&mut *self.reader, rows, progress),
                _ => read_further_rows(&mut *self.reader, rows, &|| {
                    progress.advance(done.into(), header.height.into(), 0)
                }),
            };
            read.ok_or(BuildError::Cancelled)?
                .map_err(|fault| BuildError::Input { path: self.path.clone(), fault })?;
            self.image.push(rows);
            progress.rows(&header, done, rows);
            done += count;
        }
    }
}
