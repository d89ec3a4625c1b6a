//! TIFF images: by the encoder at hand, and laid out by hand where that writes no such kind.

use std::io::Cursor;

use anyhow::Result;
use tiff::encoder::colortype::{self as color, ColorType};
use tiff::encoder::{Compression, DeflateLevel, TiffEncoder, TiffValue};

use super::{SIZE, grainy, jpeg};

/// Tags.
const COMPRESSION: u16 = 259;
const PHOTOMETRIC: u16 = 262;
const ORIENTATION: u16 = 274;
const PLANAR: u16 = 284;
const EXTRA_SAMPLES: u16 = 338;
const SAMPLE_FORMAT: u16 = 339;
const ICC_PROFILE: u16 = 34675;

/// Of other programs: chains and directories below others, masks, tables of JPEG, JPEG 2000, places.
const PYRAMIDS: [&[u8]; 4] = [
    include_bytes!("../../../../assets/tiff/cog-jpeg.tif"),
    include_bytes!("../../../../assets/tiff/cog-zstd-f32.tif"),
    include_bytes!("../../../../assets/tiff/ome-subifds.ome.tif"),
    include_bytes!("../../../../assets/tiff/slide-jpeg2000.svs"),
];

/// A smooth grey image, plain.
pub(super) fn grey(size: [u32; 2]) -> Result<Vec<u8>> {
    let texels = grainy(size[0] as usize, (size[0] * size[1]) as usize);
    encoded::<color::Gray8>(size, Compression::Uncompressed, &texels)
}

fn encoded<C: ColorType>(size: [u32; 2], compression: Compression, texels: &[C::Inner]) -> Result<Vec<u8>>
where
    [C::Inner]: TiffValue,
{
    let mut out = Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new(&mut out)?.with_compression(compression);
    encoder.write_image::<C>(size[0], size[1], texels)?;
    Ok(out.into_inner())
}

/// Of every sample, compression and layout: strips and tiles, planes, both byte orders, BigTIFF.
pub(super) fn all() -> Result<Vec<Vec<u8>>> {
    let n = (SIZE[0] * SIZE[1]) as usize;
    let bytes = grainy(SIZE[0] as usize * 4, 4 * n);
    let words: Vec<u16> = bytes.iter().map(|&v| u16::from(v) * 257).collect();
    let signed: Vec<i16> = words.iter().map(|&v| v.wrapping_sub(1 << 15) as i16).collect();
    let floats: Vec<f32> = bytes.iter().map(|&v| f32::from(v) / 99.0 - 1.0).collect();
    let doubles: Vec<f64> = floats.iter().map(|&v| v.into()).collect();
    let (plain, deflate) = (Compression::Uncompressed, Compression::Deflate(DeflateLevel::Fast));
    let mut all = vec![
        grey(SIZE)?,
        encoded::<color::Gray8>(SIZE, deflate, &bytes[..n])?,
        encoded::<color::RGB8>(SIZE, Compression::Lzw, &bytes[..3 * n])?,
        encoded::<color::RGBA16>(SIZE, Compression::Packbits, &words)?,
        encoded::<color::GrayI16>(SIZE, plain, &signed[..n])?,
        encoded::<color::Gray32Float>(SIZE, deflate, &floats[..n])?,
        encoded::<color::Gray64Float>(SIZE, plain, &doubles[..n])?,
    ];
    let mut big = Cursor::new(Vec::new());
    TiffEncoder::new_big(&mut big)?.write_image::<color::RGB16>(SIZE[0], SIZE[1], &words[..3 * n])?;
    all.push(big.into_inner());
    all.extend(handmade()?.iter().map(Handmade::bytes));
    all.extend(PYRAMIDS.map(<[u8]>::to_vec));
    Ok(all)
}

/// In strips, with a colour profile.
pub(super) fn with_profile(profile: Vec<u8>) -> Vec<u8> {
    let mut image = Handmade { profile, ..Handmade::new(&[16; 3], 2, None, false) };
    image.cut(image.strip_bytes(6), 2);
    image.bytes()
}

fn handmade() -> Result<Vec<Handmade>> {
    let mut tiles = Handmade::new(&[8; 3], 2, Some(16), true);
    tiles.cut(16 * 16 * 3, 2);
    let mut jpeg_tiles = Handmade::new(&[8; 3], 6, Some(16), false);
    jpeg_tiles.set(COMPRESSION, 7);
    jpeg_tiles.chunks = vec![jpeg::jpeg([16, 16], 3, false)?; 2];
    let mut planes = Handmade::new(&[16; 3], 2, None, false);
    planes.set(PLANAR, 2);
    planes.cut(planes.strip_bytes(2), 3 * 2);
    let mut signed = Handmade::new(&[8], 1, Some(16), false);
    signed.set(SAMPLE_FORMAT, 2);
    signed.cut(16 * 16, 2);
    let mut premultiplied = Handmade::new(&[8; 4], 2, None, true);
    premultiplied.set(EXTRA_SAMPLES, 1);
    premultiplied.set(ORIENTATION, 6);
    premultiplied.cut(premultiplied.strip_bytes(4), 2);
    let mut white = Handmade::new(&[16], 0, None, false);
    white.set(PHOTOMETRIC, 0);
    white.cut(white.strip_bytes(2), 2);
    Ok(vec![tiles, jpeg_tiles, planes, signed, premultiplied, white])
}

/// A classic TIFF of [`SIZE`], in two strips, or in tiles.
struct Handmade {
    big_endian: bool,
    tags: Vec<(u16, Vec<u32>)>,
    profile: Vec<u8>,
    is_tiled: bool,
    chunks: Vec<Vec<u8>>,
}

impl Handmade {
    const STRIP_ROWS: u32 = SIZE[1] / 2;

    fn new(bits: &[u32], photometric: u32, tile: Option<u32>, big_endian: bool) -> Handmade {
        let mut tags = vec![
            (256, vec![SIZE[0]]),
            (257, vec![SIZE[1]]),
            (258, bits.to_vec()),
            (COMPRESSION, vec![1]),
            (PHOTOMETRIC, vec![photometric]),
            (277, vec![bits.len() as u32]),
        ];
        match tile {
            Some(side) => tags.extend([(322, vec![side]), (323, vec![side])]),
            None => tags.push((278, vec![Handmade::STRIP_ROWS])),
        }
        Handmade { big_endian, tags, profile: Vec::new(), is_tiled: tile.is_some(), chunks: Vec::new() }
    }

    fn set(&mut self, tag: u16, value: u32) {
        self.tags.retain(|(other, _)| *other != tag);
        self.tags.push((tag, vec![value]));
    }

    /// Bytes of a strip whose texels have so many.
    fn strip_bytes(&self, texel: u32) -> usize {
        (SIZE[0] * Handmade::STRIP_ROWS * texel) as usize
    }

    /// Makes `count` strips or tiles of `len` bytes.
    fn cut(&mut self, len: usize, count: usize) {
        self.chunks = grainy(60, len * count).chunks(len).map(<[u8]>::to_vec).collect();
    }

    fn long(&self, value: u32) -> [u8; 4] {
        if self.big_endian { value.to_be_bytes() } else { value.to_le_bytes() }
    }

    fn short(&self, value: u16) -> [u8; 2] {
        if self.big_endian { value.to_be_bytes() } else { value.to_le_bytes() }
    }

    /// An entry of the directory. Its value is put at the end of `out` where it does not fit into the entry.
    fn entry(&self, out: &mut Vec<u8>, tag: u16, kind: u16, count: usize, mut value: Vec<u8>) -> Vec<u8> {
        if value.len() > 4 {
            let at = self.long(out.len() as u32);
            out.extend(std::mem::replace(&mut value, at.to_vec()));
        }
        value.resize(4, 0);
        [&self.short(tag)[..], &self.short(kind), &self.long(count as u32), &value].concat()
    }

    fn bytes(&self) -> Vec<u8> {
        let magic = if self.big_endian { *b"MM\0\x2a" } else { *b"II\x2a\0" };
        let mut out = [magic, [0; 4]].concat();
        let mut offsets = Vec::new();
        for chunk in &self.chunks {
            offsets.push(out.len() as u32);
            out.extend(chunk);
        }
        let lengths = self.chunks.iter().map(|chunk| chunk.len() as u32).collect();
        let (offset_tag, length_tag) = if self.is_tiled { (324, 325) } else { (273, 279) };
        let mut tags = self.tags.clone();
        tags.extend([(offset_tag, offsets), (length_tag, lengths)]);
        tags.sort();
        let mut entries = Vec::new();
        for (tag, values) in &tags {
            // Sizes, offsets and lengths are long, all else is short.
            let is_long = matches!(tag, 256 | 257 | 273 | 278 | 279 | 322..=325);
            let value = match is_long {
                true => values.iter().flat_map(|&value| self.long(value)).collect(),
                false => values.iter().flat_map(|&value| self.short(value as u16)).collect(),
            };
            entries.push(self.entry(&mut out, *tag, if is_long { 4 } else { 3 }, values.len(), value));
        }
        if !self.profile.is_empty() {
            // No other tag here has a larger number; the kind is "undefined".
            let profile = self.profile.clone();
            entries.push(self.entry(&mut out, ICC_PROFILE, 7, profile.len(), profile));
        }
        let directory = self.long(out.len() as u32);
        out[4..8].copy_from_slice(&directory);
        out.extend(self.short(entries.len() as u16));
        out.extend(entries.concat());
        out.extend([0; 4]);
        out
    }
}
