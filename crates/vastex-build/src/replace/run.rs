//! One replacement under way: from level to level, and on each from page to page.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::ControlFlow;

use bytes::Bytes;
use rayon::ThreadPool;
use vastex_core::{Box3, Geometry, PagePos};
use vastex_tiles::{ContainerUpdate, EncodedTile};

use super::BATCH_BYTES;
use super::before::Before;
use super::error::ReplaceError;
use super::patch::Patch;
use super::region::{PageBox, Region};
use super::rules::{LayerRules, OpenImage, Rules};
use super::slice::{LayerShape, Slice};
use super::spans::{Axis, Piece, Run, Spans};
use crate::progress::{Progress, read_watched, rows_at_once};
use crate::texels::filter::Reach;
use crate::threads;
use crate::tile::TileEncoder;

/// Layers that do not change have no next level to be made.
const NO_REACH: Reach = Reach { factor: 2, first: 0, count: 2 };

/// One replacement.
pub(super) struct Replacement<'a> {
    pub(super) pool: &'a ThreadPool,
    /// The version before.
    pub(super) before: Before,
    pub(super) rules: Rules,
    pub(super) encoder: TileEncoder,
}

/// What changes of one layer on one level.
struct Change<'a> {
    rules: &'a LayerRules,
    patch: Patch,
    region: Region,
}

impl Change<'_> {
    /// Where the box `shown` of a level shows what changes.
    fn runs(&self, level: u8, shown: Box3) -> [Vec<Run>; 2] {
        let axes = self.rules.axes(level);
        [0, 1].map(|a| {
            let held = [&self.patch.columns, &self.patch.rows][a];
            axes[a].runs(&self.region.changed[a], held, shown.origin[a], shown.size[a])
        })
    }
}

impl Replacement<'_> {
    fn geometry(&self) -> &Geometry {
        &self.rules.description.geometry
    }

    /// Replaces the pages of all levels from that of the images on, which all belong to one level. At least
    /// one image.
    pub(super) fn run(
        &self,
        update: &mut ContainerUpdate,
        images: &mut [OpenImage<'_>],
        progress: &dyn Progress,
    ) -> Result<(), ReplaceError> {
        let Some(finest) = images.first().map(|image| image.placed.level) else { return Ok(()) };
        let rows = images.iter().map(|image| u64::from(image.header().height)).sum();
        let (mut done, mut written) = (0, 0);
        let mut changes = Vec::with_capacity(images.len());
        for image in images {
            let advance = |row: u64| progress.advance(done + row, rows, 0);
            let tell = |row: u64, share: Option<f64>| match share {
                Some(share) => progress.beginning(share),
                None => advance(row),
            };
            let patch = self.read_image(image, tell)?;
            done += u64::from(image.header().height);
            changes.push(Change { rules: &image.rules, patch, region: image.region() });
        }
        let tail_pos = self.geometry().tail_pos();
        let before = self.before.tile(tail_pos)?;
        let mut tail = before.to_vec();
        for level in finest..=self.geometry().coarsest() {
            if level < tail_pos.level {
                self.replace_pages(update, level, &changes, |bytes| {
                    written += bytes;
                    progress.advance(rows, rows, written)
                })?;
            } else {
                changes.iter().for_each(|change| self.replace_in_tail(&mut tail, level, change));
            }
            if level < self.geometry().coarsest() {
                changes =
                    changes.iter().map(|change| self.coarser(change, level)).collect::<Result<_, _>>()?;
            }
        }
        if tail != before {
            update.replace(tail_pos, self.encoder.tile(tail))?;
        }
        Ok(())
    }

    /// The texels of an image and those around; `tell` is told of rows, and where that takes its time of the
    /// share that is done of the work before the first one, and says whether to go on.
    fn read_image(
        &self,
        image: &mut OpenImage<'_>,
        tell: impl Fn(u64, Option<f64>) -> ControlFlow<()>,
    ) -> Result<Patch, ReplaceError> {
        let mut patch = self.patch(&image.rules, image.placed.level, &image.region().changed)?;
        let in_image = |fault| ReplaceError::Image { path: image.placed.image.into(), fault };
        let texel = image.conversion.image_texel_bytes();
        let (row_bytes, together) = (image.header().row_bytes(), rows_at_once(&*image.reader));
        let mut read = vec![0; together * row_bytes];
        let rows: Vec<_> = image.strips[1].iter().flat_map(|strip| strip.to.clone()).collect();
        for (done, rows) in (0..).step_by(together).zip(rows.chunks(together)) {
            if tell(done, None).is_break() {
                return Err(ReplaceError::Cancelled);
            }
            let read = &mut read[..rows.len() * row_bytes];
            let told = |share| tell(done, share);
            let outcome = read_watched(&mut *image.reader, read, done == 0, &told);
            outcome.ok_or(ReplaceError::Cancelled)?.map_err(in_image)?;
            for (&y, row) in rows.iter().zip(read.chunks_exact(row_bytes)) {
                self.encoder.findings().look_at(image.rules.number, &image.conversion, row);
                for columns in &image.strips[0] {
                    let from = &row[columns.from as usize * texel..][..columns.to.len() * texel];
                    image.conversion.row(patch.row_mut(y, &columns.to), from);
                }
            }
        }
        Ok(patch)
    }

    /// What changes of the next level.
    fn coarser<'c>(&self, finer: &Change<'c>, level: u8) -> Result<Change<'c>, ReplaceError> {
        let (rules, axes) = (finer.rules, finer.rules.axes(level));
        let region = finer.region.coarser(axes);
        let mut patch = self.patch(rules, level + 1, &region.changed)?;
        let (changed, color) = (&region.changed, &rules.shape.color);
        self.pool.install(|| patch.filter_from(&finer.patch, axes, changed, &rules.filter, color));
        Ok(Change { rules, patch, region })
    }

    /// The texels of a level that are held; those that change are still black.
    fn patch(&self, rules: &LayerRules, level: u8, changed: &[Spans; 2]) -> Result<Patch, ReplaceError> {
        let axes = rules.axes(level);
        let mut patch = Patch::new(rules.held(level, changed), rules.shape.texel());
        let columns = pieces_of_pages(axes[0], &patch.columns, &changed[0]);
        let rows = pieces_of_pages(axes[1], &patch.rows, &changed[1]);
        for (&y, rows) in &rows {
            for (&x, columns) in &columns {
                if !rows.iter().chain(columns).all(|piece| piece.changes) {
                    let page = PagePos::new_2d(level, x, y);
                    self.fill_unchanged(&mut patch, &rules.shape, page, columns, rows)?;
                }
            }
        }
        Ok(patch)
    }

    /// Fills what does not change within one page from what it shows before. All of a level of the tail
    /// counts as one page.
    fn fill_unchanged(
        &self,
        patch: &mut Patch,
        shape: &LayerShape,
        page: PagePos,
        columns: &[Piece],
        rows: &[Piece],
    ) -> Result<(), ReplaceError> {
        let geometry = &shape.geometry;
        let (pos, tile_from_level) = match geometry.is_tail(page) {
            true => {
                let first = geometry.tile_texel_from_tail_texel(page.level, [0; 3]);
                (geometry.tail_pos(), first.map(i64::from))
            }
            false => (page, geometry.level_box_of_tile(page).origin.map(|texel| -texel)),
        };
        let texels = self.before.shown(shape, pos)?;
        for rows in rows {
            for columns in columns.iter().filter(|columns| !(rows.changes && columns.changes)) {
                let tile_x = (i64::from(columns.range.start) + tile_from_level[0]) as usize;
                for y in rows.range.clone() {
                    let tile_y = (i64::from(y) + tile_from_level[1]) as usize;
                    let target = patch.row_mut(y, &columns.range);
                    let first = (tile_y * shape.side() + tile_x) * shape.texel();
                    let len = target.len();
                    target.copy_from_slice(&texels[first..first + len]);
                }
            }
        }
        Ok(())
    }

    /// Puts what changes of a level of the tail into the tail's tile.
    fn replace_in_tail(&self, tail: &mut [u8], level: u8, change: &Change<'_>) {
        let shape = &change.rules.shape;
        let (offset, shown) = (shape.geometry.tail().offset(level), shape.geometry.level_box_of_tail(level));
        let part = &mut tail[shape.bytes.clone()];
        let mut slice = Slice::stored(shape, part);
        slice.paste(&change.patch, &change.runs(level, shown), offset);
        slice.extend_levels();
        slice.finish(&self.encoder, change.rules.number, part);
    }

    /// Writes the new tiles of a level finer than the tail; `advance` is told bytes written, and whether to
    /// go on.
    fn replace_pages(
        &self,
        update: &mut ContainerUpdate,
        level: u8,
        changes: &[Change<'_>],
        mut advance: impl FnMut(u64) -> ControlFlow<()>,
    ) -> Result<(), ReplaceError> {
        // The images are of one region, so these are the pages of all layers.
        let covered = changes.first().map(|change| change.region.pages(&change.rules.shape.geometry, level));
        let made = covered.and_then(|pages| self.before.missing(pages));
        let positions: Vec<PagePos> = self.pages(level, changes, made.as_ref()).into_iter().collect();
        let batch = (BATCH_BYTES / self.rules.tile_texel_bytes()).max(1);
        for positions in positions.chunks(batch) {
            let make =
                |&pos: &PagePos| Ok(self.new_tile(pos, changes, made.as_ref())?.map(|tile| (pos, tile)));
            let tiles: Result<_, ReplaceError> = self.pool.install(|| threads::try_map(positions, make));
            let mut bytes = 0;
            for (pos, tile) in tiles?.into_iter().flatten() {
                bytes += tile.tile().bytes.len() as u64;
                update.replace(pos, tile)?;
            }
            if advance(bytes).is_break() {
                return Err(ReplaceError::Cancelled);
            }
        }
        Ok(())
    }

    /// The pages that get a new tile if it differs from theirs: of those that have one or get their first (in
    /// `made`), all that show a texel that changes, or one of a page in `made`.
    fn pages(&self, level: u8, changes: &[Change<'_>], made: Option<&PageBox>) -> Vec<PagePos> {
        let mut found = BTreeSet::new();
        let mut add = |[columns, rows]: [Vec<u32>; 2]| {
            found.extend(rows.iter().flat_map(|&y| columns.iter().map(move |&x| (y, x))));
        };
        for Change { rules, region, .. } in changes {
            let axes = rules.axes(level);
            add([0, 1].map(|a| match made {
                Some(made) => {
                    let of_made = axes[a].texels_of([&made.columns, &made.rows][a]);
                    axes[a].pages(&region.changed[a].and(&of_made))
                }
                None => axes[a].pages(&region.changed[a]),
            }));
        }
        let positions = found.into_iter().map(|(y, x)| PagePos::new_2d(level, x, y));
        positions.filter(|&pos| self.before.has(pos) || made.is_some_and(|made| made.contains(pos))).collect()
    }

    /// A page's tile with the new texels; `None` if it is the one that it has. `made` are pages of the
    /// level, of which some get their first tile.
    fn new_tile(
        &self,
        pos: PagePos,
        changes: &[Change<'_>],
        made: Option<&PageBox>,
    ) -> Result<Option<EncodedTile>, ReplaceError> {
        let before = self.before.has(pos).then(|| self.before.tile(pos)).transpose()?;
        let mut tile = match &before {
            Some(before) => before.to_vec(),
            None => vec![0; self.rules.description.tile_bytes()],
        };
        for (number, shape) in self.rules.shapes.iter().enumerate() {
            let change = changes.iter().find(|change| change.rules.number == number);
            if let Some(slice) = self.new_slice(pos, shape, change, before.as_ref(), made)? {
                slice.finish(&self.encoder, number, &mut tile[shape.bytes.clone()]);
            }
        }
        Ok((before.as_deref() != Some(&tile[..])).then(|| self.encoder.tile(tile)))
    }

    /// A layer's part of a page's tile with the new texels; `None` if it stays as it is.
    fn new_slice<'s>(
        &self,
        pos: PagePos,
        shape: &'s LayerShape,
        change: Option<&Change<'_>>,
        before: Option<&Bytes>,
        made: Option<&PageBox>,
    ) -> Result<Option<Slice<'s>>, ReplaceError> {
        let shown = shape.geometry.level_box_of_tile(pos);
        let runs = change.map(|change| (change, change.runs(pos.level, shown)));
        let runs = runs.filter(|(_, runs)| runs.iter().all(|runs| !runs.is_empty()));
        let all_changes = runs.as_ref().is_some_and(|(change, _)| {
            let axes = change.rules.axes(pos.level);
            (0..2).all(|a| axes[a].all_change(&change.region.changed[a], shown.origin[a], shown.size[a]))
        });
        let mut slice = match (before, made) {
            _ if all_changes => Slice::black(shape),
            (Some(_), None) if runs.is_none() => return Ok(None),
            (Some(before), None) => Slice::stored(shape, &before[shape.bytes.clone()]),
            (None, None) => Slice::black(shape),
            (_, Some(made)) => self.before.joined(shape, pos, shape.axes(pos.level, NO_REACH), made)?,
        };
        if let Some((change, runs)) = runs {
            slice.paste(&change.patch, &runs, [0; 3]);
        }
        Ok(Some(slice))
    }
}

/// The pieces of `held` texels by the page in which they lie.
fn pieces_of_pages(axis: Axis, held: &Spans, changed: &Spans) -> BTreeMap<u32, Vec<Piece>> {
    let mut of_page: BTreeMap<u32, Vec<Piece>> = BTreeMap::new();
    for piece in axis.pieces(held, changed) {
        of_page.entry(piece.page).or_default().push(piece);
    }
    of_page
}
