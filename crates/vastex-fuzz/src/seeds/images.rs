//! PNG, JPEG and OpenEXR images of every kind that is read, and those of [`super::tiffs`].

use std::io::Cursor;

use anyhow::{Context, Result};
use exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, Image, IntegerBounds, Layer,
    LayerAttributes, LineOrder, SmallVec, Vec2, WritableImage, f16,
};

use super::jpeg::jpeg;
use super::{SIZE, grainy, tiffs};

/// Of every kind, but none whose colours must be converted.
pub(crate) fn images() -> Result<Vec<Vec<u8>>> {
    let mut all = tiffs::all()?;
    all.extend(pngs());
    all.extend(jpegs()?);
    all.extend(exrs()?);
    Ok(all)
}

/// Of every kind that can say what its colours are. They are apart since converting colours takes a hundred
/// times as long as all else that is done with so small an image.
pub(crate) fn profiles() -> Result<Vec<Vec<u8>>> {
    let (profile, rgb) = (profile()?, jpeg(SIZE, 3, false)?);
    let icc = [&b"p3\0\0"[..], &zlib(&profile)].concat();
    Ok(vec![
        png(PngKind { depth: 8, ..RGBA }, &[(b"iCCP", &icc)]),
        png(RGB, &[(b"gAMA", &60_000u32.to_be_bytes()), (b"cHRM", &[0, 0, 122, 38].repeat(8))]),
        png(PngKind { depth: 16, ..RGB }, &[(b"cICP", &[12, 13, 0, 1])]),
        with_segment(&rgb, 0xe2, &[b"ICC_PROFILE\0\x01\x01", &profile[..]].concat()),
        tiffs::with_profile(profile),
    ])
}

/// A colour profile that is not sRGB.
fn profile() -> Result<Vec<u8>> {
    moxcms::ColorProfile::new_display_p3().encode().ok().context("no profile")
}

/// EXIF data with one entry: the orientation.
const TURNED: &[u8] = b"MM\0\x2a\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\0";

/// What an `IHDR` chunk says of the texels.
#[derive(Clone, Copy)]
struct PngKind {
    depth: u8,
    color: u8,
    channels: u32,
    is_interlaced: bool,
}

/// Its type and what it holds.
type Chunk<'a> = (&'a [u8; 4], &'a [u8]);

const GREY: PngKind = PngKind { depth: 8, color: 0, channels: 1, is_interlaced: false };
const PALETTE: PngKind = PngKind { depth: 4, color: 3, channels: 1, is_interlaced: false };
const RGB: PngKind = PngKind { depth: 8, color: 2, channels: 3, is_interlaced: false };
const GREY_ALPHA: PngKind = PngKind { depth: 8, color: 4, channels: 2, is_interlaced: false };
const RGBA: PngKind = PngKind { depth: 16, color: 6, channels: 4, is_interlaced: false };

fn pngs() -> Vec<Vec<u8>> {
    let kinds: [(PngKind, &[Chunk<'_>]); 9] = [
        (GREY, &[]),
        (PngKind { depth: 1, ..GREY }, &[]),
        (PALETTE, &[(b"PLTE", &[7; 48]), (b"tRNS", &[0, 99])]),
        (RGB, &[(b"gAMA", &100_000u32.to_be_bytes())]),
        (GREY_ALPHA, &[(b"eXIf", TURNED)]),
        (RGBA, &[(b"sRGB", &[0])]),
        (PngKind { depth: 16, ..RGB }, &[]),
        (PngKind { is_interlaced: true, ..RGB }, &[]),
        (PngKind { is_interlaced: true, ..PALETTE }, &[(b"PLTE", &[99; 48])]),
    ];
    kinds.iter().map(|(kind, chunks)| png(*kind, chunks)).collect()
}

/// A PNG image of [`SIZE`], whose rows have all filters in turn.
pub(super) fn png_of(size: [u32; 2], channels: u32) -> Vec<u8> {
    png_sized(size, if channels == 1 { GREY } else { RGB }, &[])
}

fn png(kind: PngKind, chunks: &[Chunk<'_>]) -> Vec<u8> {
    png_sized(SIZE, kind, chunks)
}

fn png_sized(size: [u32; 2], kind: PngKind, chunks: &[Chunk<'_>]) -> Vec<u8> {
    const ADAM7: [[u32; 4]; 7] =
        [[0, 0, 8, 8], [4, 0, 8, 8], [0, 4, 4, 8], [2, 0, 4, 4], [0, 2, 2, 4], [1, 0, 2, 2], [0, 1, 1, 2]];
    let passes = if kind.is_interlaced { &ADAM7[..] } else { &[[0, 0, 1, 1]] };
    let mut rows = Vec::new();
    for [x, y, dx, dy] in passes {
        let [width, height] = [(size[0] - x).div_ceil(*dx), (size[1] - y).div_ceil(*dy)];
        let row_bytes = (width * kind.channels * u32::from(kind.depth)).div_ceil(8) as usize;
        let texels = grainy(row_bytes, row_bytes * height as usize);
        for (n, row) in (0..).zip(texels.chunks(row_bytes)) {
            rows.push(n % 5);
            rows.extend(row);
        }
    }
    let says = [kind.depth, kind.color, 0, 0, u8::from(kind.is_interlaced)];
    let header = [&size[0].to_be_bytes()[..], &size[1].to_be_bytes(), &says].concat();
    let mut file = b"\x89PNG\r\n\x1a\n".to_vec();
    let mut put = |name: &[u8; 4], body: &[u8]| {
        let named = [&name[..], body].concat();
        file.extend((body.len() as u32).to_be_bytes());
        file.extend(&named);
        file.extend(crc32fast::hash(&named).to_be_bytes());
    };
    put(b"IHDR", &header);
    chunks.iter().for_each(|(name, body)| put(name, body));
    put(b"IDAT", &zlib(&rows));
    put(b"IEND", &[]);
    file
}

/// Bytes as zlib holds them where it compresses nothing: what is damaged is then the data themselves.
fn zlib(bytes: &[u8]) -> Vec<u8> {
    const MOST: usize = 0xffff;
    let mut out = vec![0x78, 0x01];
    for (n, block) in bytes.chunks(MOST).enumerate() {
        let (len, is_last) = (block.len() as u16, (n + 1) * MOST >= bytes.len());
        out.extend([&[u8::from(is_last)][..], &len.to_le_bytes(), &(!len).to_le_bytes(), block].concat());
    }
    let (mut a, mut b) = (1u32, 0u32);
    for &byte in bytes {
        a = (a + u32::from(byte)) % 65521;
        b = (b + a) % 65521;
    }
    out.extend((b << 16 | a).to_be_bytes());
    out
}

fn jpegs() -> Result<Vec<Vec<u8>>> {
    let (rgb, progressive) = (jpeg(SIZE, 3, false)?, jpeg(SIZE, 3, true)?);
    let exif = with_segment(&rgb, 0xe1, &[b"Exif\0\0", TURNED].concat());
    Ok(vec![jpeg(SIZE, 1, false)?, rgb, progressive, jpeg(SIZE, 1, true)?, exif])
}

/// A JPEG file with one more segment, right after its start.
fn with_segment(file: &[u8], marker: u8, body: &[u8]) -> Vec<u8> {
    let len = (body.len() as u16 + 2).to_be_bytes();
    [&file[..2], &[0xff, marker], &len, body, &file[2..]].concat()
}

fn exrs() -> Result<Vec<Vec<u8>>> {
    let n = (SIZE[0] * SIZE[1]) as usize;
    let numbers: Vec<f32> = grainy(20, n).into_iter().map(|v| f32::from(v) / 50.0).collect();
    let halves = || FlatSamples::F16(numbers.iter().map(|&v| f16::from_f32(v)).collect());
    let floats = || FlatSamples::F32(numbers.clone());
    let whole = || FlatSamples::U32(numbers.iter().map(|&v| (v * 1e7) as u32).collect());
    let rows =
        |compression| Encoding { compression, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing };
    let rgb = |samples: &dyn Fn() -> FlatSamples| Vec::from(["R", "G", "B"].map(|name| (name, samples())));
    let tiles = Blocks::Tiles(Vec2(8, 8));
    [
        (rows(Compression::Uncompressed), rgb(&halves)),
        (rows(Compression::ZIP16), vec![("Y", floats()), ("A", halves()), ("Z", floats())]),
        (rows(Compression::PIZ), rgb(&halves)),
        (rows(Compression::PXR24), rgb(&floats)),
        (rows(Compression::B44), rgb(&halves)),
        (Encoding { line_order: LineOrder::Decreasing, ..rows(Compression::RLE) }, rgb(&halves)),
        (Encoding { blocks: tiles, ..rows(Compression::ZIP1) }, vec![("depth", whole())]),
    ]
    .into_iter()
    .map(|(encoding, channels)| exr(encoding, channels))
    .collect()
}

/// An OpenEXR image whose data window lies elsewhere than its display window.
fn exr(encoding: Encoding, channels: Vec<(&str, FlatSamples)>) -> Result<Vec<u8>> {
    let channels: SmallVec<[AnyChannel<FlatSamples>; 4]> =
        channels.into_iter().map(|(name, samples)| AnyChannel::new(name, samples)).collect();
    let mut attributes = LayerAttributes::named("");
    attributes.layer_name = None;
    attributes.layer_position = Vec2(2, -1);
    let size = (SIZE[0] as usize, SIZE[1] as usize);
    let mut image = Image::from_layer(Layer::new(size, attributes, encoding, AnyChannels::sort(channels)));
    image.attributes.display_window = IntegerBounds::new((0, 0), (30, 20));
    let mut out = Cursor::new(Vec::new());
    image.write().to_buffered(&mut out)?;
    Ok(out.into_inner())
}
