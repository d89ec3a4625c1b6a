//! Block compression: the texels of a tile as the blocks that GPUs read.
//!
//! A block's bytes depend on its 16 texels alone, so neighbouring tiles, whose borders are the same texels on
//! whole blocks, decode there to the same texels. The encoders are other crates' and are linked with the
//! feature `bc` only; decoding is `vastex-tiles`' business.
//!
//! | format | encoder | what [`Quality`] changes |
//! |---|---|---|
//! | BC1, BC3 | ISPC texture compressor; for the best colours texpresso's cluster fit | which of them |
//! | BC4, BC5 | ISPC texture compressor | nothing: it is the best of those tried |
//! | BC6H | the same | how many partitions are tried |
//! | BC7 | bc7f | how many modes are tried |

use std::ops::Range;

use vastex_core::LayerFormat;

/// How much time block compression may take. Figures are those of `examples/block_speed.rs` on colour of the
/// Earth, for one core of a server; BC1 and BC3 come to 300 megatexels a second there, with the best preset
/// to 1 and 1.1 dB better.
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

impl Lost {
    /// What either lost.
    pub(crate) fn or(self, other: Lost) -> Lost {
        Lost { negatives: self.negatives || other.negatives }
    }
}

/// True if this build has the encoders.
pub(crate) const AVAILABLE: bool = cfg!(feature = "bc");

/// Texels along each side of a block.
pub(crate) const SIDE: usize = 4;

/// The four rows of texels from which a row of blocks is made, equally long.
#[derive(Clone, Copy)]
pub(crate) struct Strip<'a> {
    rows: [&'a [u8]; SIDE],
    /// Where they lie at equal distances: the memory from the first of them on, and the distance. Some
    /// encoders read them there, without a copy.
    spaced: Option<(&'a [u8], usize)>,
}

impl<'a> Strip<'a> {
    /// Bytes of each of its rows.
    pub(crate) fn row_bytes(&self) -> usize {
        self.rows[0].len()
    }

    /// `spaced` is the memory from the beginning of the first row to the end of the last, where they lie in
    /// one.
    pub(crate) fn new(rows: [&'a [u8]; SIDE], spaced: Option<&'a [u8]>) -> Strip<'a> {
        let distance = |memory: &[u8]| (memory.len() - rows[0].len()) / (SIDE - 1);
        Strip { rows, spaced: spaced.map(|memory| (memory, distance(memory))) }
    }

    /// Some of the bytes of each row.
    pub(crate) fn cut(&self, bytes: Range<usize>) -> Strip<'a> {
        let cut_memory = |(memory, distance): (&'a [u8], usize)| {
            (&memory[bytes.start..(SIDE - 1) * distance + bytes.end], distance)
        };
        Strip { rows: self.rows.map(|row| &row[bytes.clone()]), spaced: self.spaced.map(cut_memory) }
    }
}

/// What appends a row of blocks in a compressed format to others, of the strip of texels above which it lies.
pub(crate) type StripEncoder = fn(LayerFormat, Quality, &Strip<'_>, &mut Vec<u8>) -> Lost;

/// The encoder of builds: [`encode_strip`], but where one is being measured.
pub(crate) fn encoder() -> StripEncoder {
    #[cfg(all(feature = "bc", any(test, feature = "measure")))]
    if let Some(encoder) = OTHER_ENCODER.get() {
        return encoder;
    }
    encode_strip
}

#[cfg(all(feature = "bc", any(test, feature = "measure")))]
thread_local! {
    static OTHER_ENCODER: std::cell::Cell<Option<StripEncoder>> = const { std::cell::Cell::new(None) };
}

/// Runs something with another encoder in place of the formats' own, in builds that this thread asks for.
#[cfg(all(feature = "bc", any(test, feature = "measure")))]
pub(crate) fn with_encoder<R>(encoder: StripEncoder, run: impl FnOnce() -> R) -> R {
    OTHER_ENCODER.set(Some(encoder));
    let result = run();
    OTHER_ENCODER.set(None);
    result
}

/// Appends the blocks of rows of texels in the decoded format of `format`, which is compressed. All rows are
/// equally long; their number and that of their texels are multiples of 4, and not 0.
pub(crate) fn encode(
    encode_strip: StripEncoder,
    format: LayerFormat,
    quality: Quality,
    rows: &[&[u8]],
    blocks: &mut Vec<u8>,
) -> Lost {
    let mut strips = rows.as_chunks::<SIDE>().0.iter().map(|&rows| Strip::new(rows, None));
    let texel = format.texel_bytes();
    if !is_constant(rows, texel) {
        let of_strip = |strip| encode_strip(format, quality, &strip, blocks);
        return strips.map(of_strip).fold(Lost::default(), Lost::or);
    }
    let Some(first) = strips.next() else { return Lost::default() };
    let mut block = Vec::new();
    let lost = encode_strip(format, quality, &first.cut(0..SIDE * texel), &mut block);
    blocks.extend(block.repeat(rows[0].len() / texel / SIDE * (rows.len() / SIDE)));
    lost
}

/// Returns true if all texels, of so many bytes, are the same.
pub(crate) fn is_constant(rows: &[&[u8]], texel: usize) -> bool {
    // Each texel equals the next exactly if the row equals itself shifted by one.
    let is_one = |row: &[u8]| row[texel..] == row[..row.len() - texel];
    rows.iter().all(|row| row[..texel] == rows[0][..texel] && is_one(row))
}

#[cfg(feature = "bc")]
pub(crate) use encode::encode_strip;

#[cfg(not(feature = "bc"))]
pub(crate) fn encode_strip(_: LayerFormat, _: Quality, _: &Strip<'_>, _: &mut Vec<u8>) -> Lost {
    Lost::default()
}

#[cfg(feature = "bc")]
mod encode {
    use std::borrow::Cow;

    use ctt_bc7f::bindings as bc7f;
    use half::f16;
    use intel_tex_2::{RSurface, RgSurface, RgbaSurface, bc1, bc3, bc4, bc5, bc6h};
    use texpresso::{Algorithm, COLOUR_WEIGHTS_UNIFORM, Format, Params};
    use vastex_core::LayerFormat;

    use super::{Lost, Quality, SIDE, Strip};

    /// Tries every way to sort the texels of a block along a line.
    const CLUSTER_FIT: Params = Params {
        algorithm: Algorithm::ClusterFit,
        weights: COLOUR_WEIGHTS_UNIFORM,
        weigh_colour_by_alpha: false,
    };

    /// Appends a row of blocks; see [`super::encode`].
    pub(crate) fn encode_strip(
        format: LayerFormat,
        quality: Quality,
        strip: &Strip<'_>,
        blocks: &mut Vec<u8>,
    ) -> Lost {
        use LayerFormat::*;
        let (width, height) = (strip.rows[0].len() / format.texel_bytes(), SIDE as u32);
        let start = blocks.len();
        blocks.resize(start + width / SIDE * format.block_bytes(), 0);
        let out = &mut blocks[start..];
        let fit_clusters = |format: Format, texels: &[u8], out: &mut [u8]| {
            format.compress(texels, width, SIDE, CLUSTER_FIT, out);
        };
        let mut lost = Lost::default();
        let best = quality == Quality::Best;
        match format {
            Bc1 | Bc1Srgb if best => fit_clusters(Format::Bc1, &opaque(&strip.rows.concat()), out),
            Bc3 | Bc3Srgb if best => fit_clusters(Format::Bc3, &strip.rows.concat(), out),
            Bc1 | Bc1Srgb | Bc3 | Bc3Srgb | Bc4 | Bc5 => {
                let (data, stride) = strip.spaced();
                let (data, width, stride) = (&*data, width as u32, stride as u32);
                let rgba = RgbaSurface { data, width, height, stride };
                match format {
                    Bc1 | Bc1Srgb => bc1::compress_blocks_into(&rgba, out),
                    Bc3 | Bc3Srgb => bc3::compress_blocks_into(&rgba, out),
                    Bc4 => bc4::compress_blocks_into(&RSurface { data, width, height, stride }, out),
                    _ => bc5::compress_blocks_into(&RgSurface { data, width, height, stride }, out),
                }
            }
            Bc6h => {
                let (finite, what) = not_negative(&strip.rows.concat());
                lost = what;
                let settings = match quality {
                    Quality::Fast => bc6h::very_fast_settings(),
                    Quality::Normal => bc6h::basic_settings(),
                    Quality::Best => bc6h::very_slow_settings(),
                };
                let (width, stride) = (width as u32, (finite.len() / SIDE) as u32);
                let surface = RgbaSurface { data: &finite, width, height, stride };
                bc6h::compress_blocks_into(&settings, &surface, out);
            }
            Bc7 | Bc7Srgb => {
                let flags = match quality {
                    Quality::Fast => bc7f::cPackBC7FlagDefaultFaster,
                    Quality::Normal => bc7f::cPackBC7FlagDefault,
                    Quality::Best => bc7f::cPackBC7FlagDefaultNonAnalytical,
                };
                let texels = block_by_block(strip);
                ctt_bc7f::compress_blocks_into(texels.as_flattened().as_flattened(), out, flags);
            }
            R8 | Rg8 | Rgba8 | Rgba8Srgb | R16 | Rgba16 | R16Float | Rgba16Float | R32Float | R32Uint
            | Rg32Uint => {}
        }
        lost
    }

    impl Strip<'_> {
        /// The rows at equal distances, and the distance.
        fn spaced(&self) -> (Cow<'_, [u8]>, usize) {
            let copied = || (Cow::Owned(self.rows.concat()), self.rows[0].len());
            self.spaced.map_or_else(copied, |(memory, distance)| (Cow::Borrowed(memory), distance))
        }
    }

    /// The texels of each block, of four bytes each, one block after the other.
    fn block_by_block(strip: &Strip<'_>) -> Vec<[[u8; SIDE * 4]; SIDE]> {
        let [a, b, c, d] = strip.rows.map(|row| row.as_chunks::<{ SIDE * 4 }>().0);
        a.iter().zip(b).zip(c).zip(d).map(|(((a, b), c), d)| [*a, *b, *c, *d]).collect()
    }

    /// Four channels with an alpha of 255: a block with alpha has fewer colours.
    fn opaque(texels: &[u8]) -> Vec<u8> {
        texels.as_chunks::<4>().0.iter().flat_map(|&[r, g, b, _]| [r, g, b, 255]).collect()
    }

    /// Four channels of 16-bit floats as the format can hold them: 0 for what is negative or no number, the
    /// greatest finite one for what is greater.
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
