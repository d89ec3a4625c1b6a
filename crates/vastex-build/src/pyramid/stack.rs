//! All layers of a texture at once: a pyramid for each, whose rows of pages are cut together into tiles.
//!
//! A layer at a fraction of the resolution has that fraction of the rows, and the same rows of pages. A
//! tile's bytes are its layers one after the other, those of compressed ones encoded here, borders included.

use std::ops::Range;
use std::sync::Arc;

use vastex_core::{Geometry, Layer, PagePos};

use super::shared::{self, Seams, Waiting};
use super::tail::tail_texels;
use super::{Band, Pyramid, Shape};
use crate::texels::blocks::{self, Strip};
use crate::texels::convert::Conversion;
use crate::texels::filter::LayerFilter;
use crate::tile::TileEncoder;

/// What becomes of one image.
pub(crate) struct LayerPlan {
    pub(crate) layer: Layer,
    /// The texture's, as the layer sees it.
    pub(crate) geometry: Geometry,
    pub(crate) conversion: Conversion,
    pub(crate) filter: LayerFilter,
    pub(crate) border_color: [u8; 4],
}

impl LayerPlan {
    /// What its pyramid is made for.
    fn shape(&self) -> Shape<'_> {
        Shape {
            geometry: &self.geometry,
            format: self.layer.format.decoded(),
            filter: self.filter,
            border_color: self.border_color,
        }
    }

    /// Rows of the layer along some of the texture's, which begin at a whole row of it.
    pub(crate) fn rows(&self, texture: &Range<u32>) -> u32 {
        texture.end.div_ceil(self.layer.scale) - texture.start / self.layer.scale
    }

    /// Bytes of a row of the image.
    pub(crate) fn image_row_bytes(&self) -> usize {
        self.geometry.size()[0] as usize * self.conversion.image_texel_bytes()
    }

    /// Returns true if the last of the layer's channels is alpha.
    pub(crate) fn has_alpha(&self) -> bool {
        self.layer.format.decoded().channels() == 4
    }
}

/// Rows of the texture that are best pushed at once: a whole, even number of rows of each layer, and a
/// function of the texture's shape and layers alone.
pub(crate) fn block_rows(plans: &[LayerPlan]) -> u32 {
    let unit = 2 * plans.iter().map(|plan| plan.layer.scale).max().unwrap_or(1);
    let of_layer = |plan: &LayerPlan| plan.layer.scale * plan.shape().block_rows();
    let rows = plans.iter().map(of_layer).min().unwrap_or(unit);
    (rows / unit * unit).max(unit)
}

/// Bytes that all pyramids hold at most, where so many times [`block_rows`] rows are pushed while bands that
/// were cut before are held.
pub(crate) fn memory(plans: &[LayerPlan], encoder: &TileEncoder, ahead: u32) -> u64 {
    let block = block_rows(plans);
    let late = late_bands(plans);
    let of_layer = |(number, plan): (usize, &LayerPlan)| {
        plan.shape().memory(block / plan.layer.scale, late, ahead)
            + shared::memory(&plan.geometry, encoder.format(number))
    };
    plans.iter().enumerate().map(of_layer).sum()
}

/// Rows of pages at the top of each level that are cut last, in all layers alike.
fn late_bands(plans: &[LayerPlan]) -> u32 {
    plans.iter().map(|plan| plan.shape().late_bands()).max().unwrap_or(0)
}

/// The pyramids of all layers.
pub(crate) struct Stack<'a> {
    plans: &'a [LayerPlan],
    encoder: &'a TileEncoder,
    pyramids: Vec<Pyramid<'a>>,
    /// One for each layer.
    seams: Arc<Vec<Seams>>,
}

impl<'a> Stack<'a> {
    pub(crate) fn new(plans: &'a [LayerPlan], encoder: &'a TileEncoder) -> Stack<'a> {
        let (block, late) = (block_rows(plans), late_bands(plans));
        let pyramid = |plan: &'a LayerPlan| {
            let rows = block / plan.layer.scale;
            Pyramid::new(plan.shape(), rows, late)
        };
        let seams = plans.iter().map(|plan| Seams::new(&plan.geometry)).collect();
        Stack { plans, encoder, pyramids: plans.iter().map(pyramid).collect(), seams: Arc::new(seams) }
    }

    /// Takes the next rows of every image, those of [`block_rows`] rows of the texture except at its end.
    pub(crate) fn push(&mut self, rows: &[Vec<u8>]) {
        let layers = self.pyramids.iter_mut().zip(self.plans).zip(rows);
        for (number, ((pyramid, plan), rows)) in layers.enumerate() {
            self.encoder.findings().look_at(number, &plan.conversion, rows);
            pyramid.push(rows, &plan.conversion);
        }
    }

    /// Hands every row of pages that is ready in all layers to `cut`, the finest level first. Stops at the
    /// first error.
    pub(crate) fn cut_ready<E>(
        &mut self,
        mut cut: impl FnMut(LayerBands<'a>) -> Result<(), E>,
    ) -> Result<(), E> {
        let Some(geometry) = self.plans.first().map(|plan| &plan.geometry) else { return Ok(()) };
        for level in 0..geometry.tail().first_level() {
            let mut any = false;
            while self.pyramids.iter().all(|pyramid| pyramid.has_band(level)) {
                let layers = self.pyramids.iter_mut().filter_map(|pyramid| pyramid.cut_band(level));
                let (seams, layers) = (self.seams.clone(), layers.collect());
                cut(LayerBands { plans: self.plans, encoder: self.encoder, seams, layers })?;
                any = true;
            }
            if any {
                self.pyramids.iter_mut().for_each(|pyramid| pyramid.forget(level));
            }
        }
        Ok(())
    }

    /// Returns true if every row has been pushed.
    pub(crate) fn is_complete(&self) -> bool {
        self.pyramids.iter().all(Pyramid::is_complete)
    }

    /// Bytes of rows held; never falls.
    pub(crate) fn allocated(&self) -> u64 {
        self.pyramids.iter().map(Pyramid::allocated).sum()
    }

    /// The bytes of the tail's tile. Every row must have been pushed.
    pub(crate) fn tail(&self) -> Vec<u8> {
        let mut bytes = self.encoder.buffer();
        for (number, (plan, pyramid)) in self.plans.iter().zip(&self.pyramids).enumerate() {
            let texels = tail_texels(&plan.geometry, plan.layer.format, pyramid);
            let row_bytes = plan.geometry.tile()[0] as usize * plan.layer.format.texel_bytes();
            self.encoder.append(number, &texels.chunks_exact(row_bytes).collect::<Vec<_>>(), &mut bytes);
        }
        bytes
    }
}

/// A row of pages, all of whose rows are there in every layer, and stay as they are for as long as this is
/// held.
pub(crate) struct LayerBands<'a> {
    plans: &'a [LayerPlan],
    encoder: &'a TileEncoder,
    seams: Arc<Vec<Seams>>,
    /// At least one.
    layers: Vec<Band<'a>>,
}

impl LayerBands<'_> {
    /// The shape of the first layer, whose pages are those of all.
    pub(crate) fn geometry(&self) -> &Geometry {
        &self.plans[0].geometry
    }

    /// Pages in the band.
    pub(crate) fn pages(&self) -> u32 {
        self.layers[0].pages()
    }

    /// The band's page in column `x`.
    pub(crate) fn pos(&self, x: u32) -> PagePos {
        self.layers[0].pos(x)
    }

    /// Returns true if its tile is transparent, border included, in every layer that has an alpha channel. At
    /// least one has.
    pub(crate) fn is_transparent(&self, x: u32) -> bool {
        let with_alpha = self.plans.iter().zip(&self.layers).filter(|(plan, _)| plan.has_alpha());
        with_alpha.into_iter().all(|(_, band)| band.is_transparent(x))
    }

    /// The row of pages in each of the layers.
    #[cfg(test)]
    pub(crate) fn layers(&self) -> &[Band<'_>] {
        &self.layers
    }

    /// The rows of its tile in one of the layers.
    #[cfg(test)]
    pub(crate) fn rows_of(&self, layer: usize, x: u32) -> Vec<&[u8]> {
        self.layers[layer].tile_rows(x)
    }

    /// The bytes of the tiles of these columns, of those that `kept` has. Other threads help to encode them
    /// while nothing else is `waiting` for them.
    pub(crate) fn tiles(
        &self,
        columns: Range<u32>,
        kept: &[bool],
        waiting: &Waiting,
    ) -> Vec<Option<Vec<u8>>> {
        let buffer = |x| kept[x as usize].then(|| self.encoder.buffer());
        let mut tiles: Vec<_> = columns.clone().map(buffer).collect();
        for number in 0..self.layers.len() {
            self.append_layer(number, columns.start, &mut tiles, waiting);
        }
        tiles
    }

    /// Appends a layer's share to each tile that there is, of neighbours from column `first` on.
    fn append_layer(&self, number: usize, first: u32, tiles: &mut [Option<Vec<u8>>], waiting: &Waiting) {
        let (band, seams, format) = (&self.layers[number], &self.seams[number], self.encoder.format(number));
        let shares_blocks = format.is_compressed() && shared::shares_blocks(band.geometry());
        let joins = |(x, tile): (u32, &Option<Vec<u8>>)| {
            // One block does for the whole of a constant tile.
            shares_blocks && tile.is_some() && !blocks::is_constant(&band.tile_rows(x), format.texel_bytes())
        };
        let joined: Vec<bool> = (first..).zip(tiles.iter()).map(joins).collect();
        let (mut column, mut rest) = (first, tiles);
        for run in joined.chunk_by(|one, next| one == next) {
            let (tiles, others) = rest.split_at_mut(run.len());
            if run[0] {
                let encode = |strip: &Strip<'_>, blocks: &mut Vec<u8>| {
                    self.encoder.append_strip(number, strip, blocks);
                };
                seams.encode(format, encode, band, column, tiles, waiting);
            } else {
                let each =
                    (column..).zip(tiles).filter_map(|(x, tile)| tile.as_mut().map(|bytes| (x, bytes)));
                each.for_each(|(x, bytes)| self.encoder.append(number, &band.tile_rows(x), bytes));
            }
            (column, rest) = (column + run.len() as u32, others);
        }
    }
}
