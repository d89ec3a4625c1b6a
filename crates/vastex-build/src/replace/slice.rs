//! One layer's part of a tile while texels of it change.
//!
//! What is not touched keeps the bytes that it has. Of a layer compressed in blocks, only those blocks are
//! encoded again that hold a texel that changed: what the others lost when they were made is all that they
//! ever lose.

use std::ops::Range;
use std::sync::Arc;

use vastex_core::{Description, Geometry, Layer, LayerFormat};
use vastex_tiles::decode_blocks;

use super::patch::Patch;
use super::spans::{Axis, Run};
use crate::texels::filter::Reach;
use crate::texels::texel::{Light, decode, texel_of_color};
use crate::tile::TileEncoder;
use crate::tile::tail::extend_levels;

/// What a layer's texels are, and where they lie.
#[derive(Clone, Debug)]
pub(super) struct LayerShape {
    pub(super) layer: Layer,
    /// The texture's, as the layer sees it.
    pub(super) geometry: Arc<Geometry>,
    /// Which of a tile's bytes are the layer's.
    pub(super) bytes: Range<usize>,
    /// A texel of the border colour, decoded as all texels here are.
    pub(super) color: Vec<u8>,
}

impl LayerShape {
    /// The shapes of all layers of a texture.
    pub(super) fn all(description: &Description) -> Vec<LayerShape> {
        let shape = |(number, layer): (usize, &Layer)| LayerShape {
            geometry: Arc::new(description.geometry.of_layer(layer.scale)),
            bytes: description.layer_range(number),
            color: texel_of_color(layer.format.decoded(), description.border_color),
            layer: layer.clone(),
        };
        description.layers.iter().enumerate().map(shape).collect()
    }

    /// Bytes of a texel.
    pub(super) fn texel(&self) -> usize {
        self.layer.format.texel_bytes()
    }

    /// Texels per side of its part of a tile.
    pub(super) fn side(&self) -> usize {
        self.geometry.tile()[0] as usize
    }

    /// Bytes of its part of a tile as texels.
    pub(super) fn texel_bytes(&self) -> usize {
        self.side() * self.side() * self.texel()
    }

    /// Texels per side of what is stored as one: a block, or a texel.
    pub(super) fn block_side(&self) -> usize {
        self.layer.format.block_side() as usize
    }

    /// Blocks of its part of a tile.
    fn blocks(&self) -> usize {
        self.bytes.len() / self.layer.format.block_bytes()
    }

    /// Both axes of a level whose next one is made with `reach`.
    pub(super) fn axes(&self, level: u8, reach: Reach) -> [Axis; 2] {
        [0, 1].map(|axis| Axis::new(&self.geometry, level, axis, reach))
    }

    /// The texels of its part of a tile.
    pub(super) fn decoded(&self, part: &[u8]) -> Vec<u8> {
        let side = self.geometry.tile()[0];
        decode_blocks(self.layer.format, part, [side, side])
    }
}

/// How much nearer to what it should be a block of which only some texels are new must become to be encoded
/// again: the others lose a little each time, and the same change again and again shall soon change nothing.
const GAIN: f64 = 2.0;

/// What has happened to a block.
#[derive(Clone, Copy, Debug, Default)]
struct Block {
    /// True if the block's bytes are there as they were stored.
    is_stored: bool,
    /// One bit for each texel, row by row: whether it is new.
    new: u16,
}

/// The part of one layer.
pub(super) struct Slice<'a> {
    shape: &'a LayerShape,
    /// Decoded, row by row.
    pub(super) texels: Vec<u8>,
    /// As they are stored; empty where the layer is not compressed.
    blocks: Vec<u8>,
    /// What has happened to each.
    states: Vec<Block>,
}

impl<'a> Slice<'a> {
    /// The layer's `part` of a tile.
    pub(super) fn stored(shape: &'a LayerShape, part: &[u8]) -> Slice<'a> {
        let (blocks, states) = match shape.layer.format.is_compressed() {
            true => (part.to_vec(), vec![Block { is_stored: true, ..Block::default() }; shape.blocks()]),
            false => Default::default(),
        };
        Slice { shape, texels: shape.decoded(part), blocks, states }
    }

    /// Black texels, of a page that has no tile or none of whose tile stays.
    pub(super) fn black(shape: &'a LayerShape) -> Slice<'a> {
        let (blocks, states) = match shape.layer.format.is_compressed() {
            true => (vec![0; shape.bytes.len()], vec![Block::default(); shape.blocks()]),
            false => Default::default(),
        };
        Slice { shape, texels: vec![0; shape.texel_bytes()], blocks, states }
    }

    /// Says that texels of a box have changed: columns and rows from the beginning of the part.
    pub(super) fn touch(&mut self, columns: Range<usize>, rows: Range<usize>) {
        let side = self.shape.block_side();
        if self.states.is_empty() {
            return;
        }
        let across = self.shape.side() / side;
        let blocks = |texels: &Range<usize>| texels.start / side..texels.end.div_ceil(side);
        let within = |texels: &Range<usize>, block: usize| {
            let bits = (0..side).filter(|i| texels.contains(&(block * side + i))).map(|i| 1u16 << i);
            bits.sum::<u16>()
        };
        for row in blocks(&rows) {
            let rows = within(&rows, row);
            for column in blocks(&columns) {
                let columns = within(&columns, column);
                let of_row = |i: usize| if rows >> i & 1 == 1 { columns << (side * i) } else { 0 };
                self.states[row * across + column].new |= (0..side).map(of_row).sum::<u16>();
            }
        }
    }

    /// Takes the blocks that hold any texel of a box from another tile's `part`, where the box begins at
    /// `from`. The texels are left to the caller.
    pub(super) fn take_blocks(
        &mut self,
        part: &[u8],
        from: [usize; 2],
        columns: &Range<usize>,
        rows: &Range<usize>,
    ) {
        if self.states.is_empty() {
            return;
        }
        let (side, bytes) = (self.shape.block_side(), self.shape.layer.format.block_bytes());
        let across = self.shape.side() / side;
        let (first, last) = (columns.start / side, columns.end.div_ceil(side));
        for (i, row) in (rows.start / side..rows.end.div_ceil(side)).enumerate() {
            let to = row * across + first;
            let from = (from[1] / side + i) * across + from[0] / side;
            let count = last - first;
            self.blocks[to * bytes..][..count * bytes]
                .copy_from_slice(&part[from * bytes..][..count * bytes]);
            self.states[to..to + count].iter_mut().for_each(|state| state.is_stored = true);
        }
    }

    /// Puts what changes of a level into the box `shown` of it, which the part holds from `offset` on.
    pub(super) fn paste(&mut self, patch: &Patch, runs: &[Vec<Run>; 2], offset: [u32; 3]) {
        let at = [offset[0] as usize, offset[1] as usize];
        patch.paste(&mut self.texels, self.shape.side(), at, runs);
        for rows in &runs[1] {
            for columns in &runs[0] {
                let of = |at: usize, run: &Run| at + run.to..at + run.to + run.len;
                self.touch(of(at[0], columns), of(at[1], rows));
            }
        }
    }

    /// Makes what lies beside the levels of a tail of their edges, as a build does.
    pub(super) fn extend_levels(&mut self) {
        extend_levels(&self.shape.geometry, self.shape.layer.format, &mut self.texels);
    }

    /// Writes the part, which is the layer's of that number, into its place in a tile.
    pub(super) fn finish(mut self, encoder: &TileEncoder, layer: usize, part: &mut [u8]) {
        if self.states.is_empty() {
            return part.copy_from_slice(&self.texels);
        }
        let across = self.shape.side() / self.shape.block_side();
        for row in 0..self.states.len() / across {
            self.encode_row(row, encoder, layer);
        }
        part.copy_from_slice(&self.blocks);
    }

    /// Encodes the blocks of a row that are new. One of which only some texels are stays as it was where
    /// [`GAIN`] says so.
    fn encode_row(&mut self, row: usize, encoder: &TileEncoder, layer: usize) {
        let (side, texel) = (self.shape.block_side(), self.shape.texel());
        let (format, bytes) = (self.shape.layer.format, self.shape.layer.format.block_bytes());
        let (across, pitch) = (self.shape.side() / side, self.shape.side() * texel);
        let states = &self.states[row * across..][..across];
        let columns = (0..across).filter(|&column| states[column].new != 0 || !states[column].is_stored);
        let columns: Vec<usize> = columns.collect();
        if columns.is_empty() {
            return;
        }
        // The texels of these blocks alone, side by side.
        let texels = self.texels[row * side * pitch..][..side * pitch].chunks_exact(pitch);
        let width = side * texel;
        let gathered: Vec<Vec<u8>> = texels
            .map(|row| columns.iter().flat_map(|column| &row[column * width..][..width]).copied().collect())
            .collect();
        let rows: Vec<&[u8]> = gathered.iter().map(Vec::as_slice).collect();
        let mut encoded = Vec::new();
        encoder.append(layer, &rows, &mut encoded);
        for (n, (column, encoded)) in columns.iter().zip(encoded.chunks_exact(bytes)).enumerate() {
            let stored = &mut self.blocks[(row * across + column) * bytes..][..bytes];
            let error = |block: &[u8]| {
                let of_block = rows.iter().map(|row| &row[n * width..][..width]);
                squared_error(format, block, of_block)
            };
            let state = states[*column];
            let is_kept = state.is_stored && state.new != u16::MAX && error(stored) <= GAIN * error(encoded);
            if !is_kept {
                stored.copy_from_slice(encoded);
            }
        }
    }
}

/// How far the texels of a block are from those of four rows, summed over all channels.
fn squared_error<'r>(format: LayerFormat, block: &[u8], rows: impl Iterator<Item = &'r [u8]>) -> f64 {
    let side = format.block_side();
    let decoded = decode_blocks(format, block, [side, side]);
    let values = |row: &[u8]| {
        let mut values = vec![0.0; row.len() / format.texel_bytes() * format.decoded().channels()];
        decode(format.decoded(), Light::Stored, row, &mut values);
        values
    };
    let of_rows = decoded.chunks_exact(decoded.len() / side as usize).zip(rows);
    let square = |(a, b): (f32, f32)| f64::from(a - b).powi(2);
    of_rows.flat_map(|(a, b)| values(a).into_iter().zip(values(b))).map(square).sum()
}
