//! OpenEXR: scan lines from the top by blocks of rows; any other order, and tiles, through the whole image.
//!
//! Blocks are read one after the other, and decompressed several at once where there is help. Channels R, G
//! and B with A, or Y with A, or one of any name, are read of the first part; its data window is the picture.
//! 16-bit floats stay so where all channels have them; else, and for whole numbers, there are 32 bits.

mod blocks;

use std::fs::File;
use std::io::{BufReader, ErrorKind};
use std::sync::Arc;

use exr::block::UncompressedBlock;
use exr::block::chunk::Chunk;
use exr::block::reader::{AllChunksReader, Reader};
use exr::error::Error;
use exr::math::Vec2;
use exr::meta::attribute::{LineOrder, SampleType};
use exr::meta::header::Header;
use exr::meta::{BlockDescription, MetaData};

use crate::image::ahead::{Ahead, Helpers};
use crate::image::alpha::unpremultiply;
use crate::image::fault::near_row;
use crate::image::file::buffered;
use crate::image::{Beginning, Converted, ImageHeader, InputFault, Notice, PixelFormat, RowReader, Sample};
use blocks::{Places, decompress};

/// Bytes that a decoded block of rows, or a tile, may have.
const MAX_BLOCK_BYTES: usize = 1 << 30;
/// Whole numbers up to this one are exact in a 32-bit float.
const MAX_EXACT: u32 = 1 << 24;

/// An OpenEXR file.
pub(super) struct ExrReader {
    header: ImageHeader,
    chunks: AllChunksReader<BufReader<File>>,
    decoding: Arc<Decoding>,
    ahead: Ahead<Result<Option<Block>, BlockFault>>,
    /// True if there are no more chunks, or none that can be read.
    has_ended: bool,
    /// Where all blocks are read before the first row is given out, how many of them.
    beginning: Option<Arc<Beginning>>,
    /// Rows from `first_row` on, as they are given out.
    band: Vec<u8>,
    first_row: u32,
    next_row: u32,
    /// True if a number was too large to stay exact.
    rounded: bool,
}

/// What makes blocks of what the file holds.
struct Decoding {
    meta: MetaData,
    layout: Layout,
    size: [usize; 2],
}

/// A block of the picture, its texels as they are given out.
struct Block {
    at: [usize; 2],
    size: [usize; 2],
    texels: Vec<u8>,
    rounded: bool,
}

/// Why there is no block. Its place is known to who asks for it.
enum BlockFault {
    Ended,
    DoesNotFit,
    Exr(Error),
}

/// Where the channels of the picture lie in a block.
struct Layout {
    channels: Vec<Channel>,
    /// Bytes of all channels of the file, for one texel.
    stored_texel: usize,
    format: PixelFormat,
}

struct Channel {
    /// Bytes of the channels before it, for one texel.
    before: usize,
    stored: SampleType,
}

impl ExrReader {
    pub(super) fn new(file: File) -> Result<ExrReader, InputFault> {
        let in_header = |error| fault(error, "in the header".into());
        let reader = Reader::read_from_buffered(buffered(file), false).map_err(in_header)?;
        let meta = reader.meta_data().clone();
        let first = meta.headers.first().ok_or_else(|| unsupported("no image", "save it anew"))?;
        if meta.headers.iter().any(|part| part.deep) {
            return Err(unsupported("deep data", "flatten it"));
        }
        let (layout, ignored) = Layout::new(first)?;
        let (width, height) = (first.layer_size.width() as u64, first.layer_size.height() as u64);
        let mut header = ImageHeader::new(width, height, layout.format)?;
        header.linear = true;
        let is_whole = |channel: &Channel| channel.stored == SampleType::U32;
        header.converted.extend(layout.channels.iter().any(is_whole).then_some(Converted::Integers));
        note(&mut header, &meta, first, &ignored);
        let block = first.max_block_byte_size();
        if block > MAX_BLOCK_BYTES {
            return Err(unsupported("blocks of more than 1 GiB", "save it with smaller tiles"));
        }
        // A block as it is stored, decoded, and as it is given out.
        header.memory = 3 * block as u64;
        let in_order =
            first.blocks == BlockDescription::ScanLines && first.line_order == LineOrder::Increasing;
        if !in_order {
            let why = match first.blocks {
                BlockDescription::ScanLines => "an OpenEXR file whose rows are not stored from the top",
                BlockDescription::Tiles(_) => "an OpenEXR file of tiles",
            };
            header.hold_whole_image(header.image_bytes(), why);
            header.memory += Places::of(first).bytes();
        }
        let count = first.chunk_count as u64;
        let chunks = reader.all_chunks(false).map_err(in_header)?;
        let size = [header.width as usize, header.height as usize];
        Ok(ExrReader {
            header,
            chunks,
            decoding: Arc::new(Decoding { meta, layout, size }),
            ahead: Ahead::new(count, 3 * block as u64),
            has_ended: false,
            beginning: (!in_order).then(Arc::default),
            band: Vec::new(),
            first_row: 0,
            next_row: 0,
            rounded: false,
        })
    }

    /// Reads chunks of the picture, as many as there is room for, and gives them to whoever decompresses
    /// them.
    fn ask(&mut self) {
        while self.ahead.has_room() && !self.has_ended {
            match self.chunks.next() {
                Some(Ok(chunk)) if chunk.layer_index != 0 => {}
                Some(Ok(chunk)) => {
                    let decoding = self.decoding.clone();
                    self.ahead.push(move || decoding.block(chunk));
                }
                ended => {
                    let error = ended.and_then(Result::err);
                    self.ahead.push(move || Err(error.map_or(BlockFault::Ended, BlockFault::Exr)));
                    self.has_ended = true;
                }
            }
        }
    }

    /// The next block of the picture, whatever its place.
    fn next_block(&mut self) -> Result<Block, InputFault> {
        loop {
            self.ask();
            let place = near_row(self.next_row, self.header.height);
            match self.ahead.next().unwrap_or(Err(BlockFault::Ended)) {
                Ok(Some(block)) => {
                    self.rounded |= block.rounded;
                    return Ok(block);
                }
                Ok(None) => {}
                Err(BlockFault::Ended) => return Err(InputFault::Truncated { place }),
                Err(BlockFault::DoesNotFit) => {
                    return Err(damaged(place, "a block does not fit the picture"));
                }
                Err(BlockFault::Exr(error)) => return Err(fault(error, place)),
            }
        }
    }

    /// Reads the rows from the next one on that lie in one block, or all.
    fn load(&mut self) -> Result<(), InputFault> {
        self.first_row = self.next_row;
        if let Some(beginning) = self.beginning.clone() {
            let len = usize::try_from(self.header.image_bytes())
                .map_err(|_| unsupported("an image of a size that no memory holds", "split it"))?;
            self.band = vec![0; len];
            let all = u64::from(self.header.width) * u64::from(self.header.height);
            let mut missing = all;
            let mut places = Places::of(&self.decoding.meta.headers[0]);
            while missing > 0 {
                beginning.go_on(all - missing, all)?;
                let block = self.next_block()?;
                let [x, y] = block.at;
                let rest = missing.checked_sub((block.size[0] * block.size[1]) as u64);
                missing = rest.filter(|rest| *rest < missing && places.insert([x, y])).ok_or_else(|| {
                    damaged(near_row(y as u32, self.header.height), "a block is stored twice")
                })?;
                let texel = self.header.format.texel_bytes();
                let rows = self.band.chunks_exact_mut(self.header.width as usize * texel).skip(y);
                for (row, texels) in rows.zip(block.texels.chunks_exact(block.size[0] * texel)) {
                    row[x * texel..][..texels.len()].copy_from_slice(texels);
                }
            }
            beginning.note(1, 1);
            return Ok(());
        }
        let Block { at: [x, y], size: [width, height], texels, .. } = self.next_block()?;
        if x != 0 || y != self.next_row as usize || width != self.header.width as usize || height == 0 {
            return Err(damaged(near_row(self.next_row, self.header.height), "its rows are out of order"));
        }
        self.band = texels;
        Ok(())
    }
}

impl RowReader for ExrReader {
    fn header(&self) -> &ImageHeader {
        &self.header
    }

    fn memory_ahead(&self, pieces: usize) -> u64 {
        self.ahead.memory(pieces)
    }

    fn beginning(&self) -> Option<Arc<Beginning>> {
        self.beginning.clone()
    }

    fn take_help(&mut self, helpers: &Helpers) {
        self.ahead.take_help(helpers);
    }

    fn read_rows(&mut self, rows: &mut [u8]) -> Result<(), InputFault> {
        let row_bytes = self.header.row_bytes();
        for row in rows.chunks_exact_mut(row_bytes) {
            let mut start = (self.next_row - self.first_row) as usize * row_bytes;
            if start == self.band.len() {
                self.load()?;
                start = 0;
            }
            row.copy_from_slice(&self.band[start..start + row_bytes]);
            if self.header.format.has_alpha() {
                unpremultiply(self.header.format, row);
            }
            self.next_row += 1;
        }
        if self.next_row == self.header.height {
            self.band = Vec::new();
            self.first_row = self.next_row;
            if std::mem::take(&mut self.rounded) {
                self.header.notices.push(Notice::IntegersRounded);
            }
        }
        Ok(())
    }
}

impl Layout {
    /// The channels that make the picture, and the names of those that do not.
    fn new(part: &Header) -> Result<(Layout, Vec<String>), InputFault> {
        let list = &part.channels.list;
        let find = |name: &str| list.iter().position(|channel| channel.name.eq(name));
        let colors = ["R", "G", "B"].map(find);
        let mut chosen: Vec<usize> = match (colors, find("Y")) {
            ([Some(r), Some(g), Some(b)], _) => vec![r, g, b],
            ([None, None, None], Some(y)) => vec![y],
            _ if list.len() == 1 => vec![0],
            _ => {
                let names: Vec<_> = list.iter().take(8).map(|channel| channel.name.to_string()).collect();
                return Err(InputFault::Unsupported {
                    what: format!("the channels {}", names.join(", ")),
                    remedy: "name them R, G, B and A, or Y, or keep a single one",
                });
            }
        };
        chosen.extend(find("A").filter(|alpha| !chosen.contains(alpha)));
        if list.iter().any(|channel| channel.sampling != Vec2(1, 1)) {
            return Err(unsupported("channels of a lower resolution", "save it as R, G and B"));
        }
        let bytes = |stored| if stored == SampleType::F16 { 2 } else { 4 };
        let halves = chosen.iter().all(|&n| list[n].sample_type == SampleType::F16);
        let sample = if halves { Sample::F16 } else { Sample::F32 };
        let channels: Vec<_> = chosen
            .iter()
            .map(|&n| Channel {
                before: list[..n].iter().map(|channel| bytes(channel.sample_type)).sum(),
                stored: list[n].sample_type,
            })
            .collect();
        let format = PixelFormat::new(channels.len() as u8, sample)
            .ok_or_else(|| unsupported("more than four channels", "keep R, G, B and A"))?;
        let stored_texel = list.iter().map(|channel| bytes(channel.sample_type)).sum();
        let ignored = (0..list.len()).filter(|n| !chosen.contains(n)).map(|n| list[n].name.to_string());
        Ok((Layout { channels, stored_texel, format }, ignored.collect()))
    }

    /// The texels of a block, row by row, and whether a number was too large to stay exact.
    fn texels(&self, block: &UncompressedBlock) -> (Vec<u8>, bool) {
        let Vec2(columns, rows) = block.index.pixel_size;
        let (texel, sample) = (self.format.texel_bytes(), self.format.sample());
        let (mut texels, mut rounded) = (vec![0; rows * columns * texel], false);
        let stored_rows = block.data.chunks_exact((columns * self.stored_texel).max(1));
        for (row, stored) in texels.chunks_exact_mut((columns * texel).max(1)).zip(stored_rows) {
            for (c, channel) in self.channels.iter().enumerate() {
                let stored = &stored[channel.before * columns..];
                let targets =
                    row.chunks_exact_mut(texel).map(|t| &mut t[c * sample.bytes()..][..sample.bytes()]);
                match channel.stored {
                    SampleType::F16 => {
                        for (to, from) in targets.zip(stored.as_chunks::<2>().0) {
                            let half = half::f16::from_ne_bytes(*from);
                            match sample {
                                Sample::F16 => to.copy_from_slice(&half.to_le_bytes()),
                                _ => to.copy_from_slice(&half.to_f32().to_le_bytes()),
                            }
                        }
                    }
                    SampleType::F32 => {
                        for (to, from) in targets.zip(stored.as_chunks::<4>().0) {
                            to.copy_from_slice(&f32::from_ne_bytes(*from).to_le_bytes());
                        }
                    }
                    SampleType::U32 => {
                        for (to, from) in targets.zip(stored.as_chunks::<4>().0) {
                            let whole = u32::from_ne_bytes(*from);
                            rounded |= whole > MAX_EXACT;
                            to.copy_from_slice(&(whole as f32).to_le_bytes());
                        }
                    }
                }
            }
        }
        (texels, rounded)
    }
}

impl Decoding {
    /// The block that a chunk of the picture holds; `None` if it is one of a coarser level.
    fn block(&self, chunk: Chunk) -> Result<Option<Block>, BlockFault> {
        let block = decompress(chunk, &self.meta).map_err(BlockFault::Exr)?;
        if block.index.level != Vec2(0, 0) {
            return Ok(None);
        }
        let (Vec2(x, y), Vec2(width, height)) = (block.index.pixel_position, block.index.pixel_size);
        let fits = x.checked_add(width).is_some_and(|end| end <= self.size[0])
            && y.checked_add(height).is_some_and(|end| end <= self.size[1])
            && block.data.len() == width * height * self.layout.stored_texel;
        if !fits {
            return Err(BlockFault::DoesNotFit);
        }
        let (texels, rounded) = self.layout.texels(&block);
        Ok(Some(Block { at: [x, y], size: [width, height], texels, rounded }))
    }
}

/// Says what of the file is not followed.
fn note(header: &mut ImageHeader, meta: &MetaData, part: &Header, ignored: &[String]) {
    let (data, display) = (part.own_attributes.layer_position, part.shared_attributes.display_window);
    let at = [data.x(), data.y()].map(i64::from);
    let origin = [display.position.x(), display.position.y()].map(i64::from);
    if at != origin || display.size != part.layer_size {
        let of = [display.size.width(), display.size.height()].map(|n| n as u64);
        header.notices.push(Notice::DataWindow { at: [at[0] - origin[0], at[1] - origin[1]], of });
    }
    if !ignored.is_empty() {
        header.notices.push(Notice::ChannelsIgnored(ignored.join(", ")));
    }
    if header.format.has_alpha() {
        header.converted.push(Converted::Premultiplied);
        header.notices.push(Notice::PremultipliedAlpha);
    }
    header.notices.extend((meta.headers.len() > 1).then_some(Notice::FurtherImagesIgnored));
}

fn unsupported(what: &str, remedy: &'static str) -> InputFault {
    InputFault::Unsupported { what: what.into(), remedy }
}

fn damaged(place: String, why: &str) -> InputFault {
    InputFault::Damaged { place, why: why.into() }
}

fn fault(error: Error, place: String) -> InputFault {
    match error {
        Error::Io(error) if error.kind() == ErrorKind::UnexpectedEof => InputFault::Truncated { place },
        Error::Io(error) => InputFault::Io(error),
        // What the crate makes of the end of a file.
        Error::Invalid(why) if why.contains("missing bytes") => InputFault::Truncated { place },
        Error::NotSupported(why) => InputFault::Unsupported {
            what: format!("a kind of OpenEXR that is not known ({why})"),
            remedy: "save it with ZIP compression",
        },
        other => InputFault::Damaged { place, why: other.to_string() },
    }
}
