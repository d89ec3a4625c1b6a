//! Putting an image into a region of a container, on all levels, without building it again.
//!
//! Level by level, the texels that change are held with a margin of those beside them ([`patch`]); the pages that
//! show any of them ([`spans`]) take their old tile, the changed texels over it; and the next level's are filtered
//! from them as `build` filters. So every texel is what building the whole changed image would give, and
//! memory follows the region. How the file changes while others read it is `vastex_tiles::ContainerUpdate`'s business.

mod error;
mod patch;
mod spans;

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;

use rayon::ThreadPool;
use rayon::prelude::*;
use vastex_core::{Box3, Description, Dims, Geometry, PagePos};
use vastex_tiles::{Compression, Container, ContainerUpdate, EncodedTile, TileSource, Updated};

pub use error::ReplaceError;

use crate::convert::Conversion;
use crate::filter::{Filter, LayerFilter, LevelsFrom};
use crate::readers::{ImageHeader, RowReader, open};
use crate::texel::texel_of_color;
use crate::{InputFault, Progress, thread_pool};
use patch::Patch;
use spans::{Axis, Piece, Spans};

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

/// Puts the texels of an image into a container, at `at` (column and row of level 0), on all levels.
///
/// Whoever has the container open goes on reading it as it was; whoever opens it from then on reads the new version.
/// Takes memory for the image's texels, half as much again, and the container's index; writes the tiles that show a
/// changed texel, and about 1 MiB of coarse ones; where no texel changes, nothing. After an error or a cancellation the container is as it was.
pub fn replace(
    file: &Path,
    at: [u32; 2],
    image: &Path,
    options: &ReplaceOptions,
    progress: &dyn Progress,
) -> Result<Updated, ReplaceError> {
    let in_image = |fault| ReplaceError::Image { path: image.into(), fault };
    let mut reader = open(image).map_err(in_image)?;
    let mut update = ContainerUpdate::open(file, options.durable)?;
    let pool = thread_pool(options.threads).map_err(ReplaceError::Threads)?;
    let replacement = Replacement::new(update.container(), &pool)?;
    let conversion = replacement.conversion(image, reader.header())?;
    let changed = replacement.region(image, reader.header(), at)?;
    replacement.check_memory(image, reader.header(), &changed, options.memory_limit)?;
    let mut finest = replacement.patch(0, &changed)?;
    read_image(&mut *reader, &changed, &mut finest, &conversion, progress).map_err(|s| match s {
        Some(fault) => in_image(fault),
        None => ReplaceError::Cancelled,
    })?;
    replacement.run(&mut update, finest, changed, reader.header().height.into(), progress)?;
    Ok(update.commit()?)
}

/// One replacement under way.
struct Replacement<'a> {
    pool: &'a ThreadPool,
    /// The version before.
    old: Arc<Container>,
    description: Arc<Description>,
    filter: Filter,
    /// A texel of the border colour.
    color: Vec<u8>,
    compression: Compression,
    /// Bytes of a texel.
    texel: usize,
}

impl<'a> Replacement<'a> {
    fn new(old: &Arc<Container>, pool: &'a ThreadPool) -> Result<Replacement<'a>, ReplaceError> {
        let description = old.description().clone();
        let refuse = |what: String| ReplaceError::Unsupported { name: old.name().into(), what };
        let geometry = &description.geometry;
        let [layer] = description.layers.as_slice() else {
            return Err(refuse(format!("it has {} layers", description.layers.len())));
        };
        if layer.format.is_compressed() {
            let what =
                "its layer is compressed in blocks, and the coarser levels need the texels from before that";
            return Err(refuse(what.into()));
        }
        if geometry.dims() != Dims::D2 {
            return Err(refuse("it holds a volume".into()));
        }
        if geometry.levels()[1..].iter().any(|level| level.factor != [2, 2, 1]) {
            return Err(refuse("its levels do not halve".into()));
        }
        let [name] = old.filters() else {
            return Err(refuse("it does not say how its levels were filtered".into()));
        };
        let filter = name.parse::<LayerFilter>().ok().and_then(|filter| filter.for_format(layer.format).ok());
        let filter = filter.ok_or_else(|| {
            refuse(format!("its levels were made by the filter {name:?}, which is not known"))
        })?;
        if filter.from != LevelsFrom::Chain {
            let what = "and only levels made from the next finer one can be made again in one place";
            return Err(refuse(format!("its levels were made by the filter {name:?}, {what}")));
        }
        let color = texel_of_color(layer.format, description.border_color);
        let filter = Filter::new(filter, layer.format, 2);
        let (compression, texel) = (usual_compression(old), layer.format.texel_bytes());
        Ok(Replacement { pool, old: old.clone(), description, filter, color, compression, texel })
    }

    fn geometry(&self) -> &Geometry {
        &self.description.geometry
    }

    fn axes(&self, level: u8) -> [Axis; 2] {
        [0, 1].map(|axis| Axis::new(self.geometry(), level, axis, self.filter.reach))
    }

    /// How the image becomes the container's texels.
    fn conversion(&self, path: &Path, image: &ImageHeader) -> Result<Conversion, ReplaceError> {
        let held = self.description.layers[0].format;
        let (image_holds, container) = (image.format.to_string(), held.name());
        Conversion::new(image, held, true).ok_or_else(|| ReplaceError::Format {
            path: path.into(),
            image: image_holds,
            container,
        })
    }

    /// The texels of level 0 that change, if the image suits the container.
    fn region(&self, path: &Path, image: &ImageHeader, at: [u32; 2]) -> Result<[Spans; 2], ReplaceError> {
        let size = [image.width, image.height];
        let texture = [self.geometry().size()[0], self.geometry().size()[1]];
        let end = [0, 1].map(|a| at[a].checked_add(size[a]).filter(|&end| end <= texture[a]));
        match end {
            [Some(right), Some(bottom)] => Ok([Spans::one(at[0]..right), Spans::one(at[1]..bottom)]),
            _ => Err(ReplaceError::Outside { path: path.into(), at, size, texture }),
        }
    }

    fn check_memory(
        &self,
        image: &Path,
        header: &ImageHeader,
        changed: &[Spans; 2],
        limit: u64,
    ) -> Result<(), ReplaceError> {
        /// What the index of the container takes for each page.
        const INDEX_BYTES: u64 = 64;
        let index = self.geometry().page_count().saturating_mul(INDEX_BYTES);
        let tiles = 2 * (BATCH_BYTES.max(self.description.tile_bytes()) as u64);
        // The level above it has about a quarter.
        let patch = Patch::bytes_of(&self.held(0, changed), self.texel);
        let needed =
            [patch, patch / 2, index, tiles, header.memory].iter().fold(0u64, |a, &b| a.saturating_add(b));
        match needed <= limit {
            true => Ok(()),
            false => Err(ReplaceError::Memory { path: image.into(), needed, limit }),
        }
    }

    /// The texels of a level that are held where `changed` ones change: those of which the next level is made.
    fn held(&self, level: u8, changed: &[Spans; 2]) -> [Spans; 2] {
        let axes = self.axes(level);
        match level == self.geometry().coarsest() {
            true => changed.clone(),
            false => [0, 1].map(|a| axes[a].finer(&axes[a].coarser(&changed[a]))),
        }
    }

    /// Replaces the pages of all levels; `finest` and `changed` are those of level 0.
    fn run(
        &self,
        update: &mut ContainerUpdate,
        finest: Patch,
        mut changed: [Spans; 2],
        rows: u64,
        progress: &dyn Progress,
    ) -> Result<(), ReplaceError> {
        let (mut patch, mut written) = (finest, 0);
        let tail_pos = self.geometry().tail_pos();
        let mut tail = self.old_tile(tail_pos)?;
        let before = tail.clone();
        for level in 0..=self.geometry().coarsest() {
            if level < tail_pos.level {
                self.replace_pages(update, level, &patch, &changed, |bytes| {
                    written += bytes;
                    progress.advance(rows, rows, written)
                })?;
            } else {
                let offset = self.geometry().tail().offset(level);
                self.paste(
                    &mut tail,
                    offset,
                    self.geometry().level_box_of_tail(level),
                    level,
                    &patch,
                    &changed,
                );
            }
            if level == self.geometry().coarsest() {
                break;
            }
            let axes = self.axes(level);
            changed = [0, 1].map(|a| axes[a].coarser(&changed[a]));
            let mut next = self.patch(level + 1, &changed)?;
            self.pool.install(|| next.filter_from(&patch, axes, &changed, &self.filter, &self.color));
            patch = next;
        }
        if tail != before {
            update.replace(tail_pos, self.encoded(tail))?;
        }
        Ok(())
    }

    /// The texels of a level that are held; those that change are still black.
    fn patch(&self, level: u8, changed: &[Spans; 2]) -> Result<Patch, ReplaceError> {
        let axes = self.axes(level);
        let mut patch = Patch::new(self.held(level, changed), self.texel);
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

    /// Fills what does not change within one page from its old tile. All of a level of the tail counts as one page.
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
        let (tile, side) = (self.old_tile(pos)?, geometry.tile()[0] as usize);
        for rows in rows {
            for columns in columns.iter().filter(|columns| !(rows.changes && columns.changes)) {
                let tile_x = (i64::from(columns.range.start) + tile_from_level[0]) as usize;
                for y in rows.range.clone() {
                    let tile_y = (i64::from(y) + tile_from_level[1]) as usize;
                    let target = patch.row_mut(y, &columns.range);
                    let source = &tile[(tile_y * side + tile_x) * self.texel..][..target.len()];
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
        changed: &[Spans; 2],
        mut advance: impl FnMut(u64) -> ControlFlow<()>,
    ) -> Result<(), ReplaceError> {
        let axes = self.axes(level);
        let columns = axes[0].pages(&changed[0]);
        let positions = axes[1].pages(&changed[1]).into_iter();
        let positions: Vec<PagePos> =
            positions.flat_map(|y| columns.iter().map(move |&x| PagePos::new_2d(level, x, y))).collect();
        let batch = (BATCH_BYTES / self.description.tile_bytes()).max(1);
        for positions in positions.chunks(batch) {
            let make = |&pos: &PagePos| Ok(self.new_tile(pos, patch, changed)?.map(|tile| (pos, tile)));
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

    /// A page's tile with the new texels; nothing where they are those that it has.
    fn new_tile(
        &self,
        pos: PagePos,
        patch: &Patch,
        changed: &[Spans; 2],
    ) -> Result<Option<EncodedTile>, ReplaceError> {
        let before = self.old_tile(pos)?;
        let mut texels = before.clone();
        self.paste(&mut texels, [0; 3], self.geometry().level_box_of_tile(pos), pos.level, patch, changed);
        Ok((texels != before).then(|| self.encoded(texels)))
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
        let axes = self.axes(level);
        let runs = [0, 1].map(|a| {
            let held = [&patch.columns, &patch.rows][a];
            axes[a].runs(&changed[a], held, shown.origin[a], shown.size[a])
        });
        let side = self.geometry().tile()[0] as usize;
        patch.paste(tile, side, [offset[0] as usize, offset[1] as usize], &runs);
    }

    fn encoded(&self, texels: Vec<u8>) -> EncodedTile {
        EncodedTile::new(texels.into(), &self.description, self.compression)
    }

    /// The texels of a tile of the version before.
    fn old_tile(&self, pos: PagePos) -> Result<Vec<u8>, ReplaceError> {
        let failed = |error| ReplaceError::Decode { name: self.old.name().into(), pos, error };
        let tile = pollster::block_on(self.old.read(pos))?;
        let texels = tile.decode(&self.description).map_err(failed)?;
        Ok(texels.into())
    }
}

/// Fills what changes of level 0 from the image. Fails with nothing where `progress` asks to stop.
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
