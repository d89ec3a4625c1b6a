//! Block compression: the texels of a tile as the blocks that GPUs read.
//!
//! A block's bytes depend on its 16 texels alone, so neighbouring tiles, whose borders are the same texels on whole blocks,
//! decode there to the same texels. The encoders are other crates' and are linked with the feature `bc` only; decoding
//! is `vastex-tiles`' business.
//!
//! | format | encoder | what [`Quality`] changes |
//! |---|---|---|
//! | BC1, BC3, BC4, BC5 | ISPC texture compressor | nothing |
//! | BC6H | the same | how many partitions are tried |
//! | BC7 | bc7f | how many modes are tried |

/// How much time block compression may take.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Quality {
    /// As fast as filtering: BC7 at about 50 megatexels a second and thread.
    Fast,
    /// BC7 at about 10, and 1 to 2 dB better.
    #[default]
    Normal,
    /// Another few tenths of a dB, at a tenth of the speed.
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
pub(crate) fn encode(
    _: vastex_core::LayerFormat,
    _: Quality,
    _: &[u8],
    _: [u32; 2],
    _: &mut Vec<u8>,
) -> Lost {
    Lost::default()
}

#[cfg(feature = "bc")]
mod encode {
    use ctt_bc7f::bindings as bc7f;
    use half::f16;
    use intel_tex_2::{RSurface, RgSurface, RgbaSurface, bc1, bc3, bc4, bc5, bc6h};
    use vastex_core::LayerFormat;

    use super::{Lost, Quality};

    const SIDE: usize = 4;

    /// Appends the blocks of `size` texels in the decoded format of `format`, which is compressed; multiples of 4 along both
    /// axes.
    pub(crate) fn encode(
        format: LayerFormat,
        quality: Quality,
        texels: &[u8],
        size: [u32; 2],
        blocks: &mut Vec<u8>,
    ) -> Lost {
        let texel = format.texel_bytes();
        let count = size[0] as usize / SIDE * (size[1] as usize / SIDE);
        let start = blocks.len();
        blocks.resize(start + count * format.block_bytes(), 0);
        let out = &mut blocks[start..];
        // Each texel equals the next exactly if the texels equal themselves shifted by one.
        if texels[texel..] == texels[..texels.len() - texel] {
            let (first, rest) = out.split_at_mut(format.block_bytes());
            let lost = encode_all(format, quality, &texels[..SIDE * SIDE * texel], [SIDE as u32; 2], first);
            rest.chunks_exact_mut(first.len()).for_each(|block| block.copy_from_slice(first));
            return lost;
        }
        encode_all(format, quality, texels, size, out)
    }

    fn encode_all(
        format: LayerFormat,
        quality: Quality,
        texels: &[u8],
        size: [u32; 2],
        out: &mut [u8],
    ) -> Lost {
        use LayerFormat::*;
        let [width, height] = size;
        let stride = width * format.texel_bytes() as u32;
        let rgba = |data| RgbaSurface { data, width, height, stride };
        let mut lost = Lost::default();
        match format {
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
                ctt_bc7f::compress_blocks_into(&block_by_block(texels, width as usize), out, flags);
            }
            R8 | Rg8 | Rgba8 | Rgba8Srgb | R16 | Rgba16 | R16Float | Rgba16Float | R32Float => {}
        }
        lost
    }

    /// Texels of 4 bytes, those of each block side by side.
    fn block_by_block(texels: &[u8], width: usize) -> Vec<u8> {
        let mut blocks = Vec::with_capacity(texels.len());
        for rows in texels.chunks_exact(SIDE * 4 * width) {
            for x in (0..width).step_by(SIDE) {
                for row in rows.chunks_exact(4 * width) {
                    blocks.extend_from_slice(&row[4 * x..4 * (x + SIDE)]);
                }
            }
        }
        blocks
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
