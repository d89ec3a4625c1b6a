//! Block-compressed layers as texels, for whoever has no GPU to read them: export, comparison on the CPU,
//! adapters without these formats.
//!
//! Another crate decodes the blocks; this file says which decoder a format takes and where its texels go.
//! Encoding blocks is the business of `vastex-build`.

use bytes::Bytes;
use vastex_core::{Description, LayerFormat};

/// Texels per side of a block.
const SIDE: usize = 4;
/// 1 as a 16-bit float.
const ONE_HALF_FLOAT: u16 = 0x3c00;

/// The texels of layer number `index` of a tile: row by row, in the layer's [decoded
/// format](LayerFormat::decoded), as large as [`Description::layer_tile`] says.
///
/// `tile` has the texture's [`Description::tile_bytes`] bytes. A layer that is not compressed shares the
/// tile's bytes and costs nothing; a compressed layer takes 5 to 30 ns a texel.
///
/// # Panics
/// If there is no such layer, or the tile is too short for it.
pub fn decode_layer(description: &Description, index: usize, tile: &Bytes) -> Bytes {
    let (layer, range) = (&description.layers[index], description.layer_range(index));
    if !layer.format.is_compressed() {
        return tile.slice(range);
    }
    let [width, height, _] = description.layer_tile(layer);
    decode_blocks(layer.format, &tile[range], [width, height]).into()
}

/// Decodes the blocks of an image of `size` texels, a multiple of 4 along both axes: row by row, in the
/// [decoded format](LayerFormat::decoded). Blocks that are missing at the end leave zeros. If the format is
/// not compressed, returns the bytes as they are.
pub fn decode_blocks(format: LayerFormat, blocks: &[u8], size: [u32; 2]) -> Vec<u8> {
    let Some(decode) = decoder(format) else { return blocks.to_vec() };
    let texel = format.texel_bytes();
    let pitch = size[0] as usize * texel;
    let mut texels = vec![0; pitch * size[1] as usize];
    let across = (size[0] as usize / SIDE).max(1);
    let rows = texels.chunks_exact_mut(SIDE * pitch);
    for (row, blocks) in rows.zip(blocks.chunks(across * format.block_bytes())) {
        for (x, block) in blocks.chunks_exact(format.block_bytes()).enumerate() {
            decode(block, &mut row[x * SIDE * texel..], pitch);
        }
    }
    texels
}

/// Writes the 4x4 texels of one block, rows `pitch` bytes apart.
type Decoder = fn(block: &[u8], texels: &mut [u8], pitch: usize);

fn decoder(format: LayerFormat) -> Option<Decoder> {
    use LayerFormat::*;
    let decoder: Decoder = match format {
        Bc1 | Bc1Srgb => bcdec_rs::bc1,
        Bc3 | Bc3Srgb => bcdec_rs::bc3,
        Bc4 => |block, texels, pitch| bcdec_rs::bc4(block, texels, pitch, false),
        Bc5 => |block, texels, pitch| bcdec_rs::bc5(block, texels, pitch, false),
        Bc6h => bc6h,
        Bc7 | Bc7Srgb => bcdec_rs::bc7,
        R8 | Rg8 | Rgba8 | Rgba8Srgb | R16 | Rgba16 | R16Float | Rgba16Float | R32Float | R32Uint
        | Rg32Uint => {
            return None;
        }
    };
    Some(decoder)
}

/// Three channels of 16-bit floats, to which an alpha of 1 is added.
fn bc6h(block: &[u8], texels: &mut [u8], pitch: usize) {
    let mut colors = [0u16; SIDE * SIDE * 3];
    bcdec_rs::bc6h_half(block, &mut colors, SIDE * 3, false);
    for (row, colors) in texels.chunks_mut(pitch).zip(colors.chunks_exact(SIDE * 3)) {
        for (texel, &[r, g, b]) in row.as_chunks_mut::<8>().0.iter_mut().zip(colors.as_chunks::<3>().0) {
            let channels = [r, g, b, ONE_HALF_FLOAT].map(u16::to_le_bytes);
            texel.as_chunks_mut::<2>().0.copy_from_slice(&channels);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vastex_core::{Geometry, GeometrySpec, Layer};

    /// A BC1 block of one colour, given as 5, 6 and 5 bits.
    fn bc1(color: u16) -> Vec<u8> {
        [color.to_le_bytes(), color.to_le_bytes(), [0; 2], [0; 2]].concat()
    }

    #[test]
    fn blocks_lie_row_by_row() {
        let blocks = [bc1(0xf800), bc1(0x07e0), bc1(0x001f), bc1(0xffff)].concat();
        let texels = decode_blocks(LayerFormat::Bc1, &blocks, [8, 8]);
        let at = |x: usize, y: usize| &texels[(y * 8 + x) * 4..][..4];
        assert_eq!([at(0, 0), at(3, 3)], [[255, 0, 0, 255]; 2]);
        assert_eq!([at(4, 0), at(7, 3)], [[0, 255, 0, 255]; 2]);
        assert_eq!([at(0, 4), at(3, 7)], [[0, 0, 255, 255]; 2]);
        assert_eq!([at(4, 4), at(7, 7)], [[255; 4]; 2]);
    }

    #[test]
    fn one_and_two_channels_are_not_widened() {
        let half = [128, 128, 0, 0, 0, 0, 0, 0];
        assert_eq!(decode_blocks(LayerFormat::Bc4, &half, [4, 4]), [128; 16]);
        let both = [half, [255, 255, 0, 0, 0, 0, 0, 0]].concat();
        assert_eq!(decode_blocks(LayerFormat::Bc5, &both, [4, 4]), [128, 255].repeat(16));
    }

    #[test]
    fn floats_are_opaque() {
        // Mode 11: two end points of 10 bits for each channel, all of them 0, and index 0 everywhere.
        let mut block = [0; 16];
        block[0] = 3;
        let texels = decode_blocks(LayerFormat::Bc6h, &block, [4, 4]);
        assert_eq!(texels, [0, 0, 0, 0, 0, 0, 0x00, 0x3c].repeat(16));
    }

    #[test]
    fn a_layer_is_cut_out_of_its_tile() {
        let spec = GeometrySpec { page: 8, border: 4, ..GeometrySpec::image(20, 20) };
        let layers = vec![Layer::new("color", LayerFormat::Bc1), Layer::new("height", LayerFormat::R16)];
        let description = Description::new(Geometry::new(spec).unwrap(), layers);
        let height: Vec<u8> = (0..16 * 16 * 2).map(|i| i as u8).collect();
        let tile = Bytes::from([bc1(0xffff).repeat(16), height.clone()].concat());
        assert_eq!(decode_layer(&description, 0, &tile), vec![255; 16 * 16 * 4]);
        assert_eq!(decode_layer(&description, 1, &tile), height);
    }

    #[test]
    fn any_bytes_decode_to_something() {
        let mut state = 1u32;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 24) as u8
        };
        for format in LayerFormat::ALL.into_iter().filter(|format| format.is_compressed()) {
            let blocks: Vec<u8> = (0..1000 * format.block_bytes()).map(|_| next()).collect();
            let texels = decode_blocks(format, &blocks, [4000, 4]);
            assert_eq!(texels.len(), 16_000 * format.texel_bytes());
            assert!(texels.iter().any(|&b| b != 0), "{}", format.name());
        }
    }
}
