//! Rewriting a container along a space-filling curve, so that tiles near each other in the image lie near
//! each other in the file.
//!
//! A build makes one pass over an image and so writes bands of pages from left to right; a view that is as
//! tall as wide then reads from places far apart. Here the tiles of each level are appended along the Z-order
//! curve instead. Encoded bytes are copied as they are ([`reorder`]) or encoded anew on the way
//! ([`rewrite`]), and what belongs to earlier versions of the file is left out.

use std::ops::ControlFlow;
use std::path::Path;

use pollster::block_on;
use vastex_core::PagePos;

use super::error::WriteError;
use super::output::TempFile;
use super::writer::{ContainerWriter, WriterOptions, Written};
use crate::container::format::error::ContainerError;
use crate::container::read::Container;
use crate::ground::hash::{checksum, content_hash};
use crate::sources::{ReadError, TileSource};
use crate::tile::Tile;
use crate::tile::{Compression, EncodedTile};

/// Why a container was not rewritten. What was at the output's place is still there.
#[derive(Debug, thiserror::Error)]
pub enum ReorderError {
    /// The container cannot be opened.
    #[error(transparent)]
    Open(#[from] ContainerError),
    /// A tile cannot be read.
    #[error("{name}: {error}; copy the file anew, or build it again")]
    Read {
        /// The file.
        name: String,
        /// Which tile, and why.
        error: ReadError,
    },
    /// The output cannot be written.
    #[error(transparent)]
    Output(#[from] WriteError),
    /// The function that is told of progress asked to stop.
    #[error("cancelled")]
    Cancelled,
}

/// Writes the container at `input` anew to `output`, which may be the same path: the tiles of each level
/// along the Z-order curve.
///
/// `progress` gets the number of tiles that are written, and of all tiles; `Break` cancels. Reads every tile
/// once and decodes none. Takes the memory of a [`ContainerWriter`], and 48 bytes a tile of the finest level.
pub fn reorder(
    input: &Path,
    output: &Path,
    durable: bool,
    progress: impl FnMut(u64, u64) -> ControlFlow<()>,
) -> Result<Written, ReorderError> {
    let container = Container::open_file(input)?;
    container.refuse_volume("is of a volume, which is not reordered")?;
    let description = (**container.description()).clone();
    let options = WriterOptions {
        compression: Compression::None,
        durable,
        filters: container.filters().to_vec(),
        align: container.align(),
        volume: None,
        about: container.about().to_owned(),
    };
    let writer = ContainerWriter::create(output, description, options)?;
    let raw_len = container.description().tile_bytes();
    let as_it_is = |tiles: Vec<(PagePos, Tile)>| {
        let encoded = |(pos, tile): (PagePos, Tile)| {
            // Tiles are encoded alike in one file, so equal tiles have equal bytes.
            let key = [&[tile.codec.number()], tile.bytes.as_ref()].concat();
            let (hash, checksum) = (content_hash(&key), checksum(&tile.bytes));
            (pos, EncodedTile::encoded_before(tile, hash, checksum, raw_len))
        };
        Ok(tiles.into_iter().map(encoded).collect())
    };
    rewrite(container, writer, 64, as_it_is, progress)
}

/// Tiles and the pages to which they belong.
type Encoded = Vec<(PagePos, EncodedTile)>;

/// Writes the tiles of a container, those of each level along the Z-order curve, to a container of the same
/// pages. `make` turns tiles, up to `at_once` at a time, into those that are written.
///
/// `progress` gets the number of tiles that are written, and of all tiles; `Break` cancels. Takes the memory
/// of a [`ContainerWriter`], and 48 bytes a tile of the finest level.
pub fn rewrite(
    container: Container,
    mut writer: ContainerWriter<TempFile>,
    at_once: usize,
    mut make: impl FnMut(Vec<(PagePos, Tile)>) -> Result<Encoded, ReadError>,
    mut progress: impl FnMut(u64, u64) -> ControlFlow<()>,
) -> Result<Written, ReorderError> {
    let description = container.description().clone();
    let geometry = &description.geometry;
    let failed = |error| ReorderError::Read { name: container.name().into(), error };
    let present = container.present();
    let has_tile = |pos: &PagePos| present.is_none_or(|present| present.contains(*pos));
    let (mut done, total) = (0, container.info().tiles);
    for level in 0..=geometry.tail().first_level() {
        let mut pages: Vec<PagePos> = match level < geometry.tail().first_level() {
            true => geometry.pages_of_level(level).filter(has_tile).collect(),
            false => vec![geometry.tail_pos()],
        };
        pages.sort_by_cached_key(|pos| z_order(pos.coords()));
        for pages in pages.chunks(at_once.max(1)) {
            if progress(done, total).is_break() {
                return Err(ReorderError::Cancelled);
            }
            let read = |&pos: &PagePos| block_on(container.read(pos)).map(|tile| (pos, tile));
            let tiles: Result<Vec<_>, ReadError> = pages.iter().map(read).collect();
            for (pos, tile) in tiles.and_then(&mut make).map_err(failed)? {
                writer.append(pos, tile)?;
            }
            done += pages.len() as u64;
        }
    }
    // Some systems replace no file that is open.
    drop(container);
    Ok(writer.finish()?)
}

/// The position of a page along the curve: the bits of its coordinates in turn, x lowest.
fn z_order(coords: [u32; 3]) -> u128 {
    let bit = |axis: usize, n: u32| u128::from(coords[axis] >> n & 1) << (3 * n + axis as u32);
    (0..32).flat_map(|n| (0..3).map(move |axis| (axis, n))).map(|(axis, n)| bit(axis, n)).sum()
}
