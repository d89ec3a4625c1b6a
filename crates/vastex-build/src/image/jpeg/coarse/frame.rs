//! What stands between the scans of a JPEG: its components, tables, and what each scan holds.

use std::io::BufRead;

use super::bits::Bits;
use super::huffman::Codes;
use super::stop::Stop;
use crate::image::InputFault;
use crate::image::jpeg::header::{next_marker, read_segment};

/// Bytes of other scans that are passed over, at most, until every component had its first one.
const MOST_PASSED_OVER: u64 = 64 << 20;
/// Blocks that an MCU has at most.
const MOST_BLOCKS: usize = 10;
/// Bits that coefficients may be without at first.
const MOST_MISSING_BITS: u8 = 13;

/// A channel of the picture, before colours are converted.
#[derive(Clone, Debug)]
pub(super) struct Component {
    id: u8,
    /// Blocks of an MCU, across and down.
    pub(super) blocks: [usize; 2],
    quant_table: u8,
}

/// The picture as a whole.
#[derive(Clone, Debug)]
pub(super) struct Frame {
    /// Texels across and down.
    pub(super) size: [usize; 2],
    pub(super) components: Vec<Component>,
    /// The most blocks that any component has of an MCU, across and down.
    pub(super) most: [usize; 2],
    /// True if a scan has all coefficients of its components.
    is_sequential: bool,
}

impl Frame {
    /// MCUs of scans with several components, across and down.
    pub(super) fn mcus(&self) -> [usize; 2] {
        [0, 1].map(|axis| self.size[axis].div_ceil(8 * self.most[axis]))
    }

    /// Blocks of a component in a scan of its own, across and down: those that hold any of the picture.
    pub(super) fn blocks(&self, component: usize) -> [usize; 2] {
        let blocks = self.components[component].blocks;
        [0, 1].map(|axis| (self.size[axis] * blocks[axis]).div_ceil(8 * self.most[axis]))
    }

    /// Texels of the small picture, across and down, for one block of a component.
    pub(super) fn texels_of_block(&self, component: usize) -> [usize; 2] {
        let blocks = self.components[component].blocks;
        [0, 1].map(|axis| self.most[axis] / blocks[axis])
    }

    fn read(segment: &[u8], is_sequential: bool) -> Result<Frame, Stop> {
        let &[8, h1, h0, w1, w0, count @ 1..=4, ref rest @ ..] = segment else {
            return Err(Stop::Damaged("its frame header makes no sense"));
        };
        let size = [[w1, w0], [h1, h0]].map(|side| usize::from(u16::from_be_bytes(side)));
        let mut components: Vec<Component> = rest
            .as_chunks::<3>()
            .0
            .iter()
            .take(count.into())
            .map(|&[id, blocks, quant_table]| {
                let blocks = [blocks >> 4, blocks & 15].map(usize::from);
                Component { id, blocks, quant_table }
            })
            .collect();
        // Of a single one all blocks stand side by side, whatever it says.
        if let [single] = &mut components[..] {
            single.blocks = [1, 1];
        }
        let most = [0, 1].map(|axis| components.iter().map(|c| c.blocks[axis]).max().unwrap_or(1));
        let is_whole_share =
            |c: &Component| [0, 1].iter().all(|&axis| c.blocks[axis] > 0 && most[axis] % c.blocks[axis] == 0);
        let is_sound = components.len() == usize::from(count)
            && components.iter().all(|c| is_whole_share(c) && c.quant_table < 4)
            && most.iter().all(|&blocks| blocks <= 4)
            && size.iter().all(|&side| side > 0);
        match is_sound {
            true => Ok(Frame { size, components, most, is_sequential }),
            false => Err(Stop::Damaged("its components have shares of its size that are not known")),
        }
    }
}

/// A component in the scan that gives its coefficients for the first time.
pub(super) struct FirstOf {
    pub(super) component: usize,
    pub(super) table: Codes,
    /// The AC coefficients that follow in each block, where they are in the same scan.
    pub(super) ac: Option<Codes>,
    /// What coefficients are multiplied by.
    pub(super) quant: i64,
}

/// A scan of coefficients for the first time.
pub(super) struct FirstScan {
    pub(super) components: Vec<FirstOf>,
    /// Lowest bits of the coefficients that come in later scans.
    pub(super) missing_bits: u8,
    /// MCUs between two markers at which decoding begins anew; 0 for none.
    pub(super) restart_interval: u16,
}

/// How many codes a table has of each length, and what they stand for.
type StoredCodes = ([u8; 16], Vec<u8>);

/// What the segments said so far.
#[derive(Default)]
pub(super) struct Segments {
    frame: Option<Frame>,
    /// The first value of each table: that of DC coefficients.
    quants: [Option<u16>; 4],
    /// The tables of DC coefficients, then those of AC.
    codes: [[Option<StoredCodes>; 4]; 2],
    restart_interval: u16,
    has_jfif: bool,
    /// What Adobe's marker says of colours.
    adobe: Option<u8>,
}

impl Segments {
    /// Reads up to the next scan that holds the first of DC coefficients, and into it. Other scans are passed
    /// over.
    pub(super) fn next_first_scan<R: BufRead>(&mut self, bits: &mut Bits<R>) -> Result<FirstScan, Stop> {
        const START: u8 = 0xd8;
        const END: u8 = 0xd9;
        const TEM: u8 = 0x01;
        let mut left = MOST_PASSED_OVER;
        loop {
            let marker = match bits.take_marker() {
                Some(marker) => marker,
                None => next_marker(bits.file())?,
            };
            match marker {
                TEM | 0xd0..=START => continue,
                END => return Err(Stop::Damaged("it ends before every component had a scan")),
                _ => {}
            }
            let segment = read_segment(bits.file()).map_err(|fault| match fault {
                InputFault::Io(error) => error.into(),
                _ => Stop::Damaged("a segment has no length"),
            })?;
            match marker {
                0xc0..=0xc2 if self.frame.is_none() => {
                    self.frame = Some(Frame::read(&segment, marker != 0xc2)?);
                }
                0xc0..=0xc3 | 0xc5..=0xcb | 0xcd..=0xcf => {
                    return Err(Stop::Damaged("it is no JPEG of one frame in the usual codes"));
                }
                0xc4 => self.read_codes(&segment)?,
                0xdb => self.read_quants(&segment)?,
                0xdd => {
                    let &[high, low, ..] = &segment[..] else {
                        return Err(Stop::Damaged("a restart interval is too short"));
                    };
                    self.restart_interval = u16::from_be_bytes([high, low]);
                }
                0xe0 => self.has_jfif |= segment.len() >= 14 && segment.starts_with(b"JFIF\0"),
                0xee if segment.len() >= 12 && segment.starts_with(b"Adobe") => {
                    self.adobe = segment.get(11).copied();
                }
                0xda => {
                    if let Some(scan) = self.read_scan(&segment)? {
                        bits.begin();
                        return Ok(scan);
                    }
                    bits.pass_over(&mut left)?;
                }
                _ => {}
            }
        }
    }

    /// The picture as a whole; it is known once there was a scan.
    pub(super) fn frame(&self) -> Option<&Frame> {
        self.frame.as_ref()
    }

    /// Returns true if three components are YCbCr, or else RGB: what libjpeg makes of the markers, and of the
    /// names of the components where there are none.
    pub(super) fn is_ycbcr(&self) -> bool {
        let ids = self.frame.iter().flat_map(|frame| &frame.components).map(|component| component.id);
        self.has_jfif || self.adobe.map_or_else(|| !ids.eq(*b"RGB"), |transform| transform != 0)
    }

    fn read_quants(&mut self, mut segment: &[u8]) -> Result<(), Stop> {
        while let [head, rest @ ..] = segment {
            let bytes = if head >> 4 == 0 { 1 } else { 2 };
            let (values, after) = rest
                .split_at_checked(64 * bytes)
                .filter(|_| head >> 4 < 2 && head & 15 < 4)
                .ok_or(Stop::Damaged("a table of what coefficients are multiplied by makes no sense"))?;
            let first = match bytes {
                1 => u16::from(values[0]),
                _ => u16::from_be_bytes([values[0], values[1]]),
            };
            self.quants[usize::from(head & 15)] = Some(first);
            segment = after;
        }
        Ok(())
    }

    fn read_codes(&mut self, mut segment: &[u8]) -> Result<(), Stop> {
        const NONSENSE: Stop = Stop::Damaged("a table of codes is too short");
        while let [head, rest @ ..] = segment {
            let (counts, rest) = rest.split_first_chunk::<16>().ok_or(NONSENSE)?;
            let symbols = counts.iter().map(|&count| usize::from(count)).sum();
            let (symbols, rest) = rest.split_at_checked(symbols).ok_or(NONSENSE)?;
            let of_kind = self.codes.get_mut(usize::from(head >> 4));
            if let Some(codes) = of_kind.and_then(|codes| codes.get_mut(usize::from(head & 15))) {
                *codes = Some((*counts, symbols.to_vec()));
            }
            segment = rest;
        }
        Ok(())
    }

    /// A scan, if it holds the first of DC coefficients.
    fn read_scan(&self, segment: &[u8]) -> Result<Option<FirstScan>, Stop> {
        const NONSENSE: Stop = Stop::Damaged("a scan's header makes no sense");
        let frame = self.frame.as_ref().ok_or(Stop::Damaged("it has a scan before its frame header"))?;
        let (&count, rest) = segment.split_first().ok_or(NONSENSE)?;
        let (listed, rest) = rest.split_at_checked(2 * usize::from(count)).ok_or(NONSENSE)?;
        let &[start, end, bits, ..] = rest else { return Err(NONSENSE) };
        if start != 0 || bits >> 4 != 0 {
            return Ok(None);
        }
        let missing_bits = bits & 15;
        let last = if frame.is_sequential { 63 } else { 0 };
        if end != last || missing_bits > MOST_MISSING_BITS || !(1..=4).contains(&count) {
            return Err(NONSENSE);
        }
        let mut components: Vec<FirstOf> = Vec::new();
        for &[id, tables] in listed.as_chunks().0 {
            let component = frame.components.iter().position(|c| c.id == id).ok_or(NONSENSE)?;
            if components.iter().any(|other| other.component == component) {
                return Err(NONSENSE);
            }
            let codes = |kind: usize, number: u8| {
                let codes = self.codes[kind].get(usize::from(number)).and_then(Option::as_ref);
                codes.ok_or(Stop::Damaged("a table of codes is missing"))
            };
            let (counts, symbols) = codes(0, tables >> 4)?;
            let quant = self.quants[usize::from(frame.components[component].quant_table)];
            let quant = quant.ok_or(Stop::Damaged("what coefficients are multiplied by is missing"))?;
            let table = Codes::of_dc(counts, symbols)?;
            let ac = match frame.is_sequential {
                true => codes(1, tables & 15)
                    .and_then(|(counts, symbols)| Codes::of_ac(counts, symbols))
                    .map(Some)?,
                false => None,
            };
            components.push(FirstOf { component, table, ac, quant: quant.into() });
        }
        let blocks: usize =
            components.iter().map(|c| frame.components[c.component].blocks.iter().product::<usize>()).sum();
        if components.len() > 1 && blocks > MOST_BLOCKS {
            return Err(Stop::Damaged("a scan has too many blocks"));
        }
        Ok(Some(FirstScan { components, missing_bits, restart_interval: self.restart_interval }))
    }
}
