//! JPEG, TIFF and PNG files, made in memory.

use mozjpeg::{ColorSpace, Compress};

/// A PNG file with one more chunk, right after its header.
pub fn png_with_chunk(file: &[u8], kind: &[u8; 4], body: &[u8]) -> Vec<u8> {
    let (header, rest) = file.split_at(33);
    let named = [kind, body].concat();
    let len = (body.len() as u32).to_be_bytes();
    [header, &len, &named, &crc32(&named).to_be_bytes(), rest].concat()
}

/// The checksum of PNG's chunks.
pub fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0, |crc, &b| {
        (0..8).fold(crc ^ u32::from(b), |c, _| if c & 1 == 1 { 0xedb8_8320 ^ c >> 1 } else { c >> 1 })
    })
}

/// A JPEG file with one more segment, right after its start.
pub fn jpeg_with_segment(file: &[u8], marker: u8, body: &[u8]) -> Vec<u8> {
    let len = (body.len() as u16 + 2).to_be_bytes();
    [&file[..2], &[0xff, marker], &len, body, &file[2..]].concat()
}

/// EXIF data with one entry: an orientation.
pub fn exif(orientation: u8) -> Vec<u8> {
    let mut exif = b"MM\0\x2a\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0".to_vec();
    exif.extend([orientation, 0, 0, 0, 0, 0, 0]);
    exif
}

/// A JPEG of three or one channels.
pub fn jpeg(size: [u32; 2], channels: usize, progressive: bool, data: &[u8]) -> Vec<u8> {
    let color = if channels == 1 { ColorSpace::JCS_GRAYSCALE } else { ColorSpace::JCS_RGB };
    let mut compress = Compress::new(color);
    compress.set_size(size[0] as usize, size[1] as usize);
    compress.set_quality(98.0);
    compress.set_chroma_sampling_pixel_sizes((1, 1), (1, 1));
    if progressive {
        compress.set_progressive_mode();
    } else {
        compress.set_fastest_defaults();
        compress.set_optimize_scans(false);
    }
    let mut started = compress.start_compress(Vec::new()).unwrap();
    started.write_scanlines(data).unwrap();
    started.finish().unwrap()
}

/// A smooth picture, which JPEG keeps nearly as it is.
pub fn smooth(size: [u32; 2], channels: u32) -> Vec<u8> {
    let texel = |x: u32, y: u32, c: u32| (40 + (x * 150 / size[0] + y * (20 + 10 * c) / size[1]) % 200) as u8;
    (0..size[1])
        .flat_map(|y| (0..size[0]).flat_map(move |x| (0..channels).map(move |c| texel(x, y, c))))
        .collect()
}

/// A classic TIFF of one image, laid out by hand: what the encoder at hand cannot write.
pub struct HandmadeTiff {
    pub big_endian: bool,
    /// Tags whose values are short or long, but for the offsets and lengths of the strips or tiles.
    pub tags: Vec<(u16, Vec<u32>)>,
    /// An ICC profile.
    pub profile: Option<Vec<u8>>,
    pub tiled: bool,
    pub chunks: Vec<Vec<u8>>,
}

impl HandmadeTiff {
    /// The tags that every image needs; chunks are `chunk` texels.
    pub fn new(size: [u32; 2], bits: &[u32], photometric: u32, chunk: [u32; 2], tiled: bool) -> HandmadeTiff {
        let mut tags = vec![
            (256, vec![size[0]]),
            (257, vec![size[1]]),
            (258, bits.to_vec()),
            (259, vec![1]),
            (262, vec![photometric]),
            (277, vec![bits.len() as u32]),
        ];
        match tiled {
            true => tags.extend([(322, vec![chunk[0]]), (323, vec![chunk[1]])]),
            false => tags.push((278, vec![chunk[1]])),
        }
        HandmadeTiff { big_endian: false, tags, profile: None, tiled, chunks: Vec::new() }
    }

    pub fn set(&mut self, tag: u16, value: u32) {
        self.tags.retain(|(t, _)| *t != tag);
        self.tags.push((tag, vec![value]));
    }

    /// Cuts rows into tiles, padded with zeros, or strips.
    pub fn cut(&mut self, size: [u32; 2], texel: usize, chunk: [u32; 2], data: &[u8]) {
        let [w, h] = size.map(|n| n as usize);
        let [cw, ch] = chunk.map(|n| n as usize);
        for top in (0..h).step_by(ch) {
            for left in (0..w).step_by(cw) {
                let rows = if self.tiled { ch } else { ch.min(h - top) };
                let mut bytes = vec![0; rows * cw * texel];
                for y in 0..rows.min(h - top) {
                    let count = cw.min(w - left) * texel;
                    let from = ((top + y) * w + left) * texel;
                    bytes[y * cw * texel..][..count].copy_from_slice(&data[from..from + count]);
                }
                self.chunks.push(bytes);
            }
        }
    }

    pub fn bytes(&self) -> Vec<u8> {
        let u16b = |v: u16| if self.big_endian { v.to_be_bytes() } else { v.to_le_bytes() };
        let u32b = |v: u32| if self.big_endian { v.to_be_bytes() } else { v.to_le_bytes() };
        let mut out = if self.big_endian { b"MM\0\x2a".to_vec() } else { b"II\x2a\0".to_vec() };
        out.extend([0; 4]);
        let mut tags = self.tags.clone();
        let mut offsets = Vec::new();
        for chunk in &self.chunks {
            offsets.push(out.len() as u32);
            out.extend(chunk);
        }
        let (offset_tag, length_tag) = if self.tiled { (324, 325) } else { (273, 279) };
        tags.push((offset_tag, offsets));
        tags.push((length_tag, self.chunks.iter().map(|c| c.len() as u32).collect()));
        tags.sort();
        let mut entries = u16b((tags.len() + self.profile.iter().len()) as u16).to_vec();
        for (tag, values) in &tags {
            let is_short = !matches!(tag, 256 | 257 | 273 | 278 | 279 | 322..=325);
            // Tables of JPEG are bytes.
            let kind = match tag {
                347 => 7,
                // A fraction of two values.
                282 | 283 => 5,
                _ => 4 - u16::from(is_short),
            };
            let count = if kind == 5 { values.len() / 2 } else { values.len() };
            let mut value: Vec<u8> = match kind {
                7 => values.iter().map(|&v| v as u8).collect(),
                3 => values.iter().flat_map(|&v| u16b(v as u16)).collect(),
                _ => values.iter().flat_map(|&v| u32b(v)).collect(),
            };
            if value.len() > 4 {
                let at = out.len() as u32;
                out.extend(std::mem::replace(&mut value, u32b(at).to_vec()));
            }
            value.resize(4, 0);
            entries.extend([u16b(*tag), u16b(kind)].concat());
            entries.extend(u32b(count as u32));
            entries.extend(value);
        }
        if let Some(profile) = &self.profile {
            // No other tag here has a larger number; the kind is "undefined".
            entries.extend([u16b(34675), u16b(7)].concat());
            entries.extend([u32b(profile.len() as u32), u32b(out.len() as u32)].concat());
            out.extend(profile);
        }
        let directory = u32b(out.len() as u32);
        out[4..8].copy_from_slice(&directory);
        out.extend(entries);
        out.extend([0; 4]);
        out
    }
}

/// PackBits: runs of equal bytes, and of others; with bytes between them that mean nothing.
pub(crate) fn pack_bits(mut bytes: &[u8]) -> Vec<u8> {
    let mut packed = Vec::new();
    while let [first, ..] = bytes {
        let equal = bytes.iter().take(128).take_while(|byte| *byte == first).count();
        let taken = match equal {
            1 => {
                let others = bytes.windows(2).take(127).take_while(|pair| pair[0] != pair[1]).count().max(1);
                packed.push((others - 1) as u8);
                packed.extend(&bytes[..others]);
                others
            }
            equal => {
                packed.extend([(257 - equal) as u8, *first, 0x80]);
                equal
            }
        };
        bytes = &bytes[taken..];
    }
    packed
}

/// A PNG of red, green and blue in the seven passes of Adam7, by the definition of PNG: seven reduced images,
/// each row unfiltered and nothing compressed.
pub fn interlaced_png(size: [u32; 2], data: &[u8]) -> Vec<u8> {
    let passes =
        [(0, 0, 8, 8), (4, 0, 8, 8), (0, 4, 4, 8), (2, 0, 4, 4), (0, 2, 2, 4), (1, 0, 2, 2), (0, 1, 1, 2)];
    let mut raw = Vec::new();
    for (x0, y0, dx, dy) in passes {
        for y in (y0..size[1]).step_by(dy) {
            raw.push(0);
            (x0..size[0])
                .step_by(dx)
                .for_each(|x| raw.extend(&data[((y * size[0] + x) * 3) as usize..][..3]));
        }
    }
    let mut zlib = vec![0x78, 0x01];
    for (i, block) in raw.chunks(60_000).enumerate() {
        let (len, last) = (block.len() as u16, (i + 1) * 60_000 >= raw.len());
        zlib.extend([&[u8::from(last)][..], &len.to_le_bytes(), &(!len).to_le_bytes(), block].concat());
    }
    let (mut a, mut b) = (1u32, 0u32);
    raw.iter().for_each(|&v| (a, b) = ((a + u32::from(v)) % 65521, (b + a + u32::from(v)) % 65521));
    zlib.extend((b << 16 | a).to_be_bytes());
    let mut file = b"\x89PNG\r\n\x1a\n".to_vec();
    let mut chunk = |kind: &[u8; 4], body: &[u8]| {
        file.extend((body.len() as u32).to_be_bytes());
        file.extend([&kind[..], body].concat());
        file.extend(crc32(&[&kind[..], body].concat()).to_be_bytes());
    };
    let header = [&size[0].to_be_bytes()[..], &size[1].to_be_bytes(), &[8, 2, 0, 0, 1]].concat();
    chunk(b"IHDR", &header);
    chunk(b"IDAT", &zlib);
    chunk(b"IEND", &[]);
    file
}
