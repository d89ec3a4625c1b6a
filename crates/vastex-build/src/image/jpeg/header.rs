//! The markers of a JPEG file up to its first scan: size, components, how it must be read, orientation,
//! profile.
//!
//! The decoder would tell some of this too, but only by setting itself up; and whether a file can be read by
//! rows it does not tell at all.

use std::collections::BTreeMap;
use std::io::{self, BufRead};

use crate::image::{InputFault, Profile, exif};

/// What the markers say.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct JpegHeader {
    pub(super) width: u16,
    pub(super) height: u16,
    /// Horizontal and vertical sampling factors, 1 to 4 each, of 1 to 4 components.
    pub(super) sampling: Vec<(u8, u8)>,
    pub(super) progressive: bool,
    /// True if the first scan holds every component, as it must for reading by rows.
    pub(super) interleaved: bool,
    pub(super) orientation: Option<u16>,
    pub(super) profile: Option<Profile>,
    /// True if it has a marker of Adobe's, whose programs store inks with 0 for all of an ink.
    pub(super) is_of_adobe: bool,
}

impl JpegHeader {
    /// Bytes of coefficients that the decoder holds for a file that it cannot read by rows.
    pub(super) fn coefficient_bytes(&self) -> u64 {
        let max = |f: fn(&(u8, u8)) -> u8| u64::from(self.sampling.iter().map(f).max().unwrap_or(1));
        let (h_max, v_max) = (max(|s| s.0), max(|s| s.1));
        let (mcu_columns, mcu_rows) =
            (u64::from(self.width).div_ceil(8 * h_max), u64::from(self.height).div_ceil(8 * v_max));
        let blocks: u64 = self.sampling.iter().map(|&(h, v)| u64::from(h) * u64::from(v)).sum();
        mcu_columns * mcu_rows * blocks * 64 * 2
    }
}

/// Reads markers up to the start of the first scan.
pub(super) fn read(file: &mut impl BufRead) -> Result<JpegHeader, InputFault> {
    read_markers(file).map_err(|fault| match fault {
        InputFault::Io(e) if e.kind() == io::ErrorKind::UnexpectedEof => {
            InputFault::Truncated { place: "in the header".into() }
        }
        other => other,
    })
}

fn read_markers(file: &mut impl BufRead) -> Result<JpegHeader, InputFault> {
    let (mut header, mut orientation, mut profile) = (None, None, ProfileParts::default());
    let mut is_of_adobe = false;
    let mut soi = [0; 2];
    file.read_exact(&mut soi)?;
    loop {
        let marker = next_marker(file)?;
        if marker == 0x01 || (0xd0..=0xd8).contains(&marker) {
            continue;
        }
        if marker == 0xd9 {
            return Err(damaged("it ends before any picture"));
        }
        let segment = read_segment(file)?;
        match marker {
            0xc0..=0xc2 => header = Some(read_frame(&segment, marker == 0xc2)?),
            0xc3 | 0xc5..=0xc7 | 0xc9..=0xcb | 0xcd..=0xcf => {
                return Err(InputFault::Unsupported {
                    what: "a lossless, hierarchical or arithmetic-coded JPEG".into(),
                    remedy: "convert it to a baseline or progressive JPEG, to PNG or to TIFF",
                });
            }
            0xda => {
                let mut header: JpegHeader = header.ok_or_else(|| damaged("it has no frame header"))?;
                header.interleaved =
                    segment.first().is_some_and(|&n| usize::from(n) == header.sampling.len());
                return Ok(JpegHeader { orientation, profile: profile.joined(), is_of_adobe, ..header });
            }
            0xe1 => {
                orientation = orientation.or(segment.strip_prefix(b"Exif\0\0").and_then(exif::orientation));
            }
            0xe2 => profile.add(&segment),
            // libjpeg sees one that is as long as it should be.
            0xee => is_of_adobe |= segment.len() >= 12 && segment.starts_with(b"Adobe"),
            _ => {}
        }
    }
}

/// The segments of an ICC profile: each has its number, from 1 on, and how many there are.
#[derive(Default)]
struct ProfileParts(BTreeMap<u8, (u8, Vec<u8>)>);

impl ProfileParts {
    fn add(&mut self, segment: &[u8]) {
        if let Some([number, count, bytes @ ..]) = segment.strip_prefix(b"ICC_PROFILE\0") {
            self.0.insert(*number, (*count, bytes.to_vec()));
        }
    }

    /// `None` if there are none; without any bytes where some are missing.
    fn joined(self) -> Option<Profile> {
        let is_whole = (1..)
            .zip(&self.0)
            .all(|(place, (&number, (count, _)))| number == place && usize::from(*count) == self.0.len());
        let bytes = self.0.values().filter(|_| is_whole).flat_map(|(_, bytes)| bytes);
        (!self.0.is_empty()).then(|| Profile::icc(bytes.copied().collect::<Vec<_>>()))
    }
}

/// The next marker's code; other bytes before it and fill bytes are passed over, as decoders do.
pub(super) fn next_marker(file: &mut impl BufRead) -> io::Result<u8> {
    let mut byte = [0];
    loop {
        file.read_exact(&mut byte)?;
        while byte[0] == 0xff {
            file.read_exact(&mut byte)?;
            if byte[0] != 0xff && byte[0] != 0 {
                return Ok(byte[0]);
            }
        }
    }
}

/// The bytes of a segment, whose marker was read.
pub(super) fn read_segment(file: &mut impl BufRead) -> Result<Vec<u8>, InputFault> {
    let mut len = [0; 2];
    file.read_exact(&mut len)?;
    let len = usize::from(u16::from_be_bytes(len))
        .checked_sub(2)
        .ok_or_else(|| damaged("a segment has no length"))?;
    let mut segment = vec![0; len];
    file.read_exact(&mut segment)?;
    Ok(segment)
}

fn read_frame(segment: &[u8], progressive: bool) -> Result<JpegHeader, InputFault> {
    let &[bits, h1, h0, w1, w0, components, ref rest @ ..] = segment else {
        return Err(damaged("its frame header is too short"));
    };
    if bits != 8 {
        return Err(InputFault::Unsupported {
            what: format!("a JPEG of {bits} bits per sample"),
            remedy: "convert it to a TIFF or PNG of 16 bits",
        });
    }
    let sampling: Vec<_> =
        rest.chunks_exact(3).take(usize::from(components)).map(|c| (c[1] >> 4, c[1] & 15)).collect();
    let sound = sampling.iter().all(|(h, v)| (1..=4).contains(h) && (1..=4).contains(v));
    if sampling.len() != usize::from(components) || !(1..=4).contains(&components) || !sound {
        return Err(damaged("its frame header makes no sense"));
    }
    let (width, height) = (u16::from_be_bytes([w1, w0]), u16::from_be_bytes([h1, h0]));
    Ok(JpegHeader {
        width,
        height,
        sampling,
        progressive,
        interleaved: false,
        orientation: None,
        profile: None,
        is_of_adobe: false,
    })
}

fn damaged(why: &str) -> InputFault {
    InputFault::Damaged { place: "in the header".into(), why: why.into() }
}
