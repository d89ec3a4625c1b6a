//! Putting an image into a region of a container, on all levels, without building it again.
//!
//! Level by level, the texels that change are held with a margin of those beside them ([`patch`]); the pages that
//! show any of them ([`spans`]) take their old tile ([`before`]), the changed texels over it; and the next level's are
//! filtered from them as `build` filters. So every texel is what building the whole changed image would give, and
//! memory follows the region. The image may belong to any level, and pages may get their first tile so: that is what an
//! inset is. How the file changes while others read it is `vastex_tiles::ContainerUpdate`'s business.

mod before;
mod error;
mod patch;
mod region;
mod rules;
mod spans;

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::Path;

use rayon::ThreadPool;
use rayon::prelude::*;
use vastex_core::{Box3, Geometry, PagePos};
use vastex_tiles::{Compression, Container, ContainerUpdate, EncodedTile, TileSource, Updated};

pub use error::ReplaceError;

use crate::convert::Conversion;
use crate::readers::{RowReader, open};
use crate::{InputFault, Progress, thread_pool};
use before::Before;
use patch::Patch;
use region::{PageBox, Region};
use spans::{Axis, Piece, Spans};

pub(crate) use region::Placed;
pub(crate) use rules::Rules;

/// Tiles that are made side by side, in bytes of their texels.
const BATCH_BYTES: usize = 8 << 20;

/// How a region is replaced.
#[derive(Clone, Debug)]
pub struct ReplaceOptions {
    /// Threads that filter and encode; 0 for as many as there are cores.
    pub threads: usize,
    /// Whether to wait for the disk, so that a loss of power leaves a whole version too.
    pub durable: bool,
    /// Bytes of memory beyond which an image is refused before anything is allocated.
    pub memory_limit: u64,
}

impl Default for ReplaceOptions {
    fn default() -> ReplaceOptions {
        ReplaceOptions { threads: 0, durable: false, memory_limit: 16 << 30 }
    }
}

impl ReplaceOptions {
    /// Threads that are there.
    fn threads_used(&self) -> usize {
        match self.threads {
            0 => std::thread::available_parallelism().map_or(1, usize::from),
            n => n,
        }
    }
}

/// Puts the texels of an image into a container, at `at` (column and row of level 0), on all levels.
///
/// Whoever has the container open goes on reading it as it was; whoever opens it from then on reads the new version.
/// Where pages have no tiles, those that the image covers any of get them, and are coarse around it as before. Takes
/// memory for the image's texels, half as much again, and the container's index; writes the tiles that show a changed
/// texel, and about 1 MiB of coarse ones; where no texel changes, nothing. After an error or a cancellation the container
/// is as it was.
pub fn replace(
    file: &Path,
    at: [u32; 2],
    image: &Path,
    options: &ReplaceOptions,
    progress: &dyn Progress,
) -> Result<Updated, ReplaceError> {
    let update = ContainerUpdate::open(file, options.durable)?;
    let compression = usual_compression(update.container());
    put(update, Placed { image, level: 0, at }, compression, options, progress)
}

/// Puts an image into the container that is open for a change, from its own level on, and commits.
pub(crate) fn put(
    mut update: ContainerUpdate,
    placed: Placed<'_>,
    compression: Compression,
    options: &ReplaceOptions,
    progress: &dyn Progress,
) -> Result<Updated, ReplaceError> {
    let in_image = |fault| ReplaceError::Image { path: placed.image.into(), fault };
    let reader = open(placed.image).map_err(in_image)?;
    let pool = thread_pool(options.threads).map_err(ReplaceError::Threads)?;
    let old = update.container().clone();
    let refuse = |what| ReplaceError::Unsupported { name: old.name().into(), what };
    let rules = Rules::new(old.description(), old.filters()).map_err(refuse)?;
    let mut reader = rules.colors_of(reader);
    let (conversion, region) = rules.suits(&placed, reader.header())?;
    let is_sparse = old.present().is_some();
    rules.check_memory(&placed, reader.header(), &region, is_sparse, options)?;
    let replacement = Replacement { pool: &pool, before: Before::new(old, &rules), rules, compression };
    let mut finest = replacement.patch(placed.level, &region.changed)?;
    read_image(&mut *reader, &region.changed, &mut finest, &conversion, progress).map_err(|s| match s {
        Some(fault) => in_image(fault),
        None => ReplaceError::Cancelled,
    })?;
    replacement.run(&mut update, placed.level, finest, region, reader.header().height.into(), progress)?;
    Ok(update.commit()?)
}

/// One replacement under way.
struct Replacement<'a> {
    pool: &'a ThreadPool,
    /// The version before.
    before: Before,
    rules: Rules,
    compression: Compression,
}

impl Replacement<'_> {
    fn geometry(&self) -> &Geometry {
        &self.rules.description.geometry
    }

    /// Replaces the pages of all levels from `finest_level` on; `finest` and `region` are those of that level.
    fn run(
        &self,
        update: &mut ContainerUpdate,
        finest_level: u8,
        finest: Patch,
        mut region: Region,
        rows: u64,
        progress: &dyn Progress,
    ) -> Result<(), ReplaceError> {
        let (mut patch, mut written) = (finest, 0);
        let tail_pos = self.geometry().tail_pos();
        let mut tail = self.before.tile(tail_pos)?;
        let before = tail.clone();
        for level in finest_level..=self.geometry().coarsest() {
            if level < tail_pos.level {
                self.replace_pages(update, level, &patch, &region, |bytes| {
                    written += bytes;
                    progress.advance(rows, rows, written)
                })?;
            } else {
                let offset = self.geometry().tail().offset(level);
                let shown = self.geometry().level_box_of_tail(level);
                self.paste(&mut tail, offset, shown, level, &patch, &region.changed);
            }
            if level == self.geometry().coarsest() {
                break;
            }
            let axes = self.rules.axes(level);
            region = region.coarser(axes);
            let mut next = self.patch(level + 1, &region.changed)?;
            let (changed, filter, color) = (&region.changed, &self.rules.filter, &self.rules.color);
            self.pool.install(|| next.filter_from(&patch, axes, changed, filter, color));
            patch = next;
        }
        if tail != before {
            update.replace(tail_pos, self.encoded(tail))?;
        }
        Ok(())
    }

    /// The texels of a level that are held; those that change are still black.
    fn patch(&self, level: u8, changed: &[Spans; 2]) -> Result<Patch, ReplaceError> {
        let axes = self.rules.axes(level);
        let mut patch = Patch::new(self.rules.held(level, changed), self.rules.texel);
        let columns = pieces_of_pages(axes[0], &patch.columns, &changed[0]);
        let rows = pieces_of_pages(axes[1], &patch.rows, &changed[1]);
        for (&y, rows) in &rows {
            for (&x, columns) in &columns {
                if !rows.iter().chain(columns).all(|piece| piece.changes) {
                    self.fill_unchanged(&mut patch, PagePos::new_2d(level, x, y), columns, rows)?;
                }
            }
        }
        Ok(patch)
    }

    /// Fills what does not change within one page from what it shows before. All of a level of the tail counts as one page.
    fn fill_unchanged(
        &self,
        patch: &mut Patch,
        page: PagePos,
        columns: &[Piece],
        rows: &[Piece],
    ) -> Result<(), ReplaceError> {
        let geometry = self.geometry();
        let (pos, tile_from_level) = match geometry.is_tail(page) {
            true => {
                let first = geometry.tile_texel_from_tail_texel(page.level, [0; 3]);
                (geometry.tail_pos(), first.map(i64::from))
            }
            false => (page, geometry.level_box_of_tile(page).origin.map(|texel| -texel)),
        };
        let (tile, side) = (self.before.shown(pos)?, geometry.tile()[0] as usize);
        for rows in rows {
            for columns in columns.iter().filter(|columns| !(rows.changes && columns.changes)) {
                let tile_x = (i64::from(columns.range.start) + tile_from_level[0]) as usize;
                for y in rows.range.clone() {
                    let tile_y = (i64::from(y) + tile_from_level[1]) as usize;
                    let target = patch.row_mut(y, &columns.range);
                    let source = &tile[(tile_y * side + tile_x) * self.rules.texel..][..target.len()];
                    target.copy_from_slice(source);
                }
            }
        }
        Ok(())
    }

    /// Writes the new tiles of a level finer than the tail; `advance` is told bytes written, and whether to go on.
    fn replace_pages(
        &self,
        update: &mut ContainerUpdate,
        level: u8,
        patch: &Patch,
        region: &Region,
        mut advance: impl FnMut(u64) -> ControlFlow<()>,
    ) -> Result<(), ReplaceError> {
        let made = self.before.missing(region.pages(self.geometry(), level));
        let positions = self.pages(level, region, made.as_ref());
        let batch = (BATCH_BYTES / self.rules.description.tile_bytes()).max(1);
        for positions in positions.chunks(batch) {
            let make = |&pos: &PagePos| {
                Ok(self.new_tile(pos, patch, &region.changed, made.as_ref())?.map(|tile| (pos, tile)))
            };
            let tiles = self
                .pool
                .install(|| positions.par_iter().map(make).collect::<Result<Vec<_>, ReplaceError>>())?;
            let mut bytes = 0;
            for (pos, tile) in tiles.into_iter().flatten() {
                bytes += tile.tile().bytes.len() as u64;
                update.replace(pos, tile)?;
            }
            if advance(bytes).is_break() {
                return Err(ReplaceError::Cancelled);
            }
        }
        Ok(())
    }

    /// The pages that get a new tile if it differs from theirs: of those that have one or get their first (in `made`), all
    /// that show a texel that changes, or one of a page in `made`.
    fn pages(&self, level: u8, region: &Region, made: Option<&PageBox>) -> Vec<PagePos> {
        let axes = self.rules.axes(level);
        let pages = [0, 1].map(|a| match made {
            Some(made) => {
                axes[a].pages(&region.changed[a].and(axes[a].texels_of([&made.columns, &made.rows][a])))
            }
            None => axes[a].pages(&region.changed[a]),
        });
        let positions =
            pages[1].iter().flat_map(|&y| pages[0].iter().map(move |&x| PagePos::new_2d(level, x, y)));
        positions.filter(|&pos| self.before.has(pos) || made.is_some_and(|made| made.contains(pos))).collect()
    }

    /// A page's tile with the new texels; nothing where they are those that it has. `made` are pages of the level, of which
    /// some get their first tile.
    fn new_tile(
        &self,
        pos: PagePos,
        patch: &Patch,
        changed: &[Spans; 2],
        made: Option<&PageBox>,
    ) -> Result<Option<EncodedTile>, ReplaceError> {
        let before = self.before.has(pos).then(|| self.before.tile(pos)).transpose()?;
        let shown = self.geometry().level_box_of_tile(pos);
        let axes = self.rules.axes(pos.level);
        let all_changes = || (0..2).all(|a| axes[a].all_change(&changed[a], shown.origin[a], shown.size[a]));
        let mut texels = match (&before, made) {
            (Some(before), None) => before.clone(),
            (_, Some(_)) if all_changes() => vec![0; self.rules.description.tile_bytes()],
            (_, made) => self.before.joined(pos, axes, |of| made.is_some_and(|made| made.contains(of)))?,
        };
        self.paste(&mut texels, [0; 3], shown, pos.level, patch, changed);
        Ok((before.as_ref() != Some(&texels)).then(|| self.encoded(texels)))
    }

    /// Puts the texels that change into a tile, which holds the box `shown` of the level from `offset` on.
    fn paste(
        &self,
        tile: &mut [u8],
        offset: [u32; 3],
        shown: Box3,
        level: u8,
        patch: &Patch,
        changed: &[Spans; 2],
    ) {
        let axes = self.rules.axes(level);
        let runs = [0, 1].map(|a| {
            let held = [&patch.columns, &patch.rows][a];
            axes[a].runs(&changed[a], held, shown.origin[a], shown.size[a])
        });
        let side = self.geometry().tile()[0] as usize;
        patch.paste(tile, side, [offset[0] as usize, offset[1] as usize], &runs);
    }

    fn encoded(&self, texels: Vec<u8>) -> EncodedTile {
        EncodedTile::new(texels.into(), &self.rules.description, self.compression)
    }
}

/// Fills what changes of the finest level from the image. Fails with nothing where `progress` asks to stop.
fn read_image(
    reader: &mut dyn RowReader,
    changed: &[Spans; 2],
    patch: &mut Patch,
    conversion: &Conversion,
    progress: &dyn Progress,
) -> Result<(), Option<InputFault>> {
    let height = reader.header().height;
    let mut image_row = vec![0; reader.header().row_bytes()];
    for (done, y) in (0..).zip(changed[1].texels()) {
        if progress.advance(done, height.into(), 0).is_break() {
            return Err(None);
        }
        reader.read_rows(&mut image_row).map_err(Some)?;
        for columns in changed[0].ranges() {
            conversion.row(patch.row_mut(y, columns), &image_row);
        }
    }
    Ok(())
}

/// The pieces of `held` texels by the page in which they lie.
fn pieces_of_pages(axis: Axis, held: &Spans, changed: &Spans) -> BTreeMap<u32, Vec<Piece>> {
    let mut of_page: BTreeMap<u32, Vec<Piece>> = BTreeMap::new();
    for piece in axis.pieces(held, changed) {
        of_page.entry(piece.page).or_default().push(piece);
    }
    of_page
}

/// How most tiles of a container are compressed.
fn usual_compression(container: &Container) -> Compression {
    let [raw, lz4, zstd] = container.info().stored_by_codec;
    match raw.max(lz4).max(zstd) {
        0 => Compression::default(),
        most if most == lz4 => Compression::Lz4,
        most if most == zstd => Compression::Zstd(0),
        _ => Compression::None,
    }
}
