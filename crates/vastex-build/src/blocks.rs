//! Block compression: the texels of a tile as the blocks that GPUs read.
//!
//! A block's bytes depend on its 16 texels alone, so neighbouring tiles, whose borders are the same texels on whole blocks,
//! decode there to the same texels. The encoders are other crates' and are linked with the feature `bc` only; decoding
//! is `vastex-tiles`' business.
//!
//! | format | encoder | what [`Quality`] changes |
//! |---|---|---|
//! | BC1, BC3 | ISPC texture compressor; for the best colours texpresso's cluster fit | which of them |
//! | BC4, BC5 | ISPC texture compressor | nothing: it is the best of those tried |
//! | BC6H | the same | how many partitions are tried |
//! | BC7 | bc7f | how many modes are tried |

/// How much time block compression may take. Figures are those of `examples/block_speed.rs` on colour of the Earth, for one
/// core of a server; BC1 and BC3 come to 300 megatexels a second there, with the best preset to 1 and 1.1 dB better.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Quality {
    /// BC7 at 140 megatexels a second.
    Fast,
    /// BC7 at 70, and 0.9 dB better.
    #[default]
    Normal,
    /// BC7 at 7, and another 0.8 dB better.
    Best,
}

/// What the format cannot hold and the texels had.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Lost {
    /// Some numbers were negative.
    pub(crate) negatives: bool,
}

/// Whether this build has the encoders.
pub(crate) const AVAILABLE: bool = cfg!(feature = "bc");

#[cfg(feature = "bc")]
pub(crate) use encode::encode;

#[cfg(not(feature = "bc"))]
pub(crate) fn encode(_: vastex_core::LayerFormat, _: Quality, _: &[&[u8]], _: &mut Vec<u8>) -> Lost {
    Lost::default()
}

#[cfg(feature = "bc")]
mod encode {
    use ctt_bc7f::bindings as bc7f;
    use half::f16;
    use intel_tex_2::{RSurface, RgSurface, RgbaSurface, bc1, bc3, bc4, bc5, bc6h};
    use texpresso::{Algorithm, COLOUR_WEIGHTS_UNIFORM, Format, Params};
    use vastex_core::LayerFormat;

    use super::{Lost, Quality};

    const SIDE: usize = 4;
    /// Tries every way to sort the texels of a block along a line.
    const CLUSTER_FIT: Params = Params {
        algorithm: Algorithm::ClusterFit,
        weights: COLOUR_WEIGHTS_UNIFORM,
        weigh_colour_by_alpha: false,
    };

    /// Appends the blocks of rows of texels in the decoded format of `format`, which is compressed. All rows are equally
    /// long; their number and that of their texels are multiples of 4, and not 0.
    pub(crate) fn encode(
        format: LayerFormat,
        quality: Quality,
        rows: &[&[u8]],
        blocks: &mut Vec<u8>,
    ) -> Lost {
        let (texel, block) = (format.texel_bytes(), format.block_bytes());
        let width = rows[0].len() / texel;
        let start = blocks.len();
        blocks.resize(start + width / SIDE * (rows.len() / SIDE) * block, 0);
        let out = &mut blocks[start..];
        let mut texels = Vec::new();
        if is_constant(rows, texel) {
            let (first, rest) = out.split_at_mut(block);
            let corner: Vec<&[u8]> = rows[..SIDE].iter().map(|row| &row[..SIDE * texel]).collect();
            gather(format, &corner, &mut texels);
            let lost = encode_row(format, quality, &texels, first);
            rest.chunks_exact_mut(block).for_each(|block| block.copy_from_slice(first));
            return lost;
        }
        let mut lost = Lost::default();
        // One row of blocks at a time, so that what is copied stays near the processor.
        for (rows, out) in rows.chunks_exact(SIDE).zip(out.chunks_exact_mut(width / SIDE * block)) {
            gather(format, rows, &mut texels);
            lost.negatives |= encode_row(format, quality, &texels, out).negatives;
        }
        lost
    }

    /// Whether all texels, of so many bytes, are the same.
    fn is_constant(rows: &[&[u8]], texel: usize) -> bool {
        // Each texel equals the next exactly if the row equals itself shifted by one.
        let is_one = |row: &[u8]| row[texel..] == row[..row.len() - texel];
        rows.iter().all(|row| row[..texel] == rows[0][..texel] && is_one(row))
    }

    /// The texels of a row of blocks as its encoder wants them: row by row, or for BC7 block by block.
    fn gather(format: LayerFormat, rows: &[&[u8]], texels: &mut Vec<u8>) {
        const BLOCK_ROW: usize = SIDE * 4;
        if !matches!(format, LayerFormat::Bc7 | LayerFormat::Bc7Srgb) {
            texels.clear();
            rows.iter().for_each(|row| texels.extend_from_slice(row));
            return;
        }
        texels.resize(SIDE * rows[0].len(), 0);
        for (y, row) in rows.iter().enumerate() {
            let blocks = texels.as_chunks_mut::<{ SIDE * BLOCK_ROW }>().0;
            for (block, from) in blocks.iter_mut().zip(row.as_chunks::<BLOCK_ROW>().0) {
                block[y * BLOCK_ROW..][..BLOCK_ROW].copy_from_slice(from);
            }
        }
    }

    /// Encodes a row of blocks, of which [`gather`] made the texels.
    fn encode_row(format: LayerFormat, quality: Quality, texels: &[u8], out: &mut [u8]) -> Lost {
        use LayerFormat::*;
        let (stride, height) = ((texels.len() / SIDE) as u32, SIDE as u32);
        let width = stride / format.texel_bytes() as u32;
        let rgba = |data| RgbaSurface { data, width, height, stride };
        let fit_clusters = |format: Format, texels: &[u8], out: &mut [u8]| {
            format.compress(texels, width as usize, SIDE, CLUSTER_FIT, out);
        };
        let mut lost = Lost::default();
        match format {
            Bc1 | Bc1Srgb if quality == Quality::Best => fit_clusters(Format::Bc1, &opaque(texels), out),
            Bc3 | Bc3Srgb if quality == Quality::Best => fit_clusters(Format::Bc3, texels, out),
            Bc1 | Bc1Srgb => bc1::compress_blocks_into(&rgba(texels), out),
            Bc3 | Bc3Srgb => bc3::compress_blocks_into(&rgba(texels), out),
            Bc4 => bc4::compress_blocks_into(&RSurface { data: texels, width, height, stride }, out),
            Bc5 => bc5::compress_blocks_into(&RgSurface { data: texels, width, height, stride }, out),
            Bc6h => {
                let (finite, what) = not_negative(texels);
                lost = what;
                let settings = match quality {
                    Quality::Fast => bc6h::very_fast_settings(),
                    Quality::Normal => bc6h::basic_settings(),
                    Quality::Best => bc6h::very_slow_settings(),
                };
                bc6h::compress_blocks_into(&settings, &rgba(&finite), out);
            }
            Bc7 | Bc7Srgb => {
                let flags = match quality {
                    Quality::Fast => bc7f::cPackBC7FlagDefaultFaster,
                    Quality::Normal => bc7f::cPackBC7FlagDefault,
                    Quality::Best => bc7f::cPackBC7FlagDefaultNonAnalytical,
                };
                ctt_bc7f::compress_blocks_into(texels, out, flags);
            }
            R8 | Rg8 | Rgba8 | Rgba8Srgb | R16 | Rgba16 | R16Float | Rgba16Float | R32Float => {}
        }
        lost
    }

    /// Four channels with an alpha of 255: a block with alpha has fewer colours.
    fn opaque(texels: &[u8]) -> Vec<u8> {
        texels.as_chunks::<4>().0.iter().flat_map(|&[r, g, b, _]| [r, g, b, 255]).collect()
    }

    /// Four channels of 16-bit floats as the format can hold them: 0 for what is negative or no number, the greatest finite
    /// one for what is greater.
    fn not_negative(texels: &[u8]) -> (Vec<u8>, Lost) {
        let mut lost = Lost::default();
        let mut finite = Vec::with_capacity(texels.len());
        for texel in texels.as_chunks::<8>().0 {
            let rgb = [0, 2, 4].map(|at| f16::from_le_bytes([texel[at], texel[at + 1]]));
            for value in rgb {
                lost.negatives |= value < f16::ZERO;
                let value = if value > f16::ZERO { value.min(f16::MAX) } else { f16::ZERO };
                finite.extend_from_slice(&value.to_le_bytes());
            }
            finite.extend_from_slice(&f16::ONE.to_le_bytes());
        }
        (finite, lost)
    }
}
