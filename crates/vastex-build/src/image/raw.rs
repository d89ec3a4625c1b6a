//! Raw files: texels and nothing else, with a description beside them.
//!
//! `NAME.raw` is described by `NAME.raw.toml`; either can be named. What it says:
//!
//! | key | is | without it |
//! |---|---|---|
//! | `width`, `height` | texels | must be there |
//! | `sample` | `u8`, `u16`, `f16` or `f32` | must be there |
//! | `channels` | 1 grey, 2 grey and alpha, 3 RGB, 4 RGBA | 1 |
//! | `endian` | `little` or `big` | `little` |
//! | `offset` | bytes before the first texel | 0 |
//! | `order` | `interleaved`, or `planar`: one channel after the other | `interleaved` |
//! | `first_row` | `top` or `bottom` | `top` |
//! | `linear` | whether colours are linear | `false`; `true` for floats |

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

use serde::Deserialize;
use vastex_tiles::raw_description;

use super::file::open_file;
use crate::image::{ImageHeader, InputFault, PixelFormat, RowReader, Sample};

/// Bytes that a description may have.
const MAX_TEXT: u64 = 64 << 10;

#[derive(Clone, Copy, Debug, Deserialize, PartialEq)]
#[serde(rename_all = "lowercase")]
enum SampleName {
    U8,
    U16,
    F16,
    F32,
}

#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq)]
#[serde(rename_all = "lowercase")]
enum Endian {
    #[default]
    Little,
    Big,
}

#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq)]
#[serde(rename_all = "lowercase")]
enum Order {
    #[default]
    Interleaved,
    Planar,
}

#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq)]
#[serde(rename_all = "lowercase")]
enum FirstRow {
    #[default]
    Top,
    Bottom,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Description {
    width: u32,
    height: u32,
    sample: SampleName,
    #[serde(default = "one")]
    channels: u8,
    #[serde(default)]
    endian: Endian,
    #[serde(default)]
    offset: u64,
    #[serde(default)]
    order: Order,
    #[serde(default)]
    first_row: FirstRow,
    linear: Option<bool>,
}

fn one() -> u8 {
    1
}

/// A raw file.
pub(super) struct RawReader {
    header: ImageHeader,
    file: File,
    description: Description,
    /// One row of one plane.
    plane: Vec<u8>,
    next_row: u32,
}

impl RawReader {
    /// Opens the raw file at `path`.
    pub(super) fn new(path: &Path) -> Result<RawReader, InputFault> {
        let description = read_description(path)?;
        let sample = match description.sample {
            SampleName::U8 => Sample::U8,
            SampleName::U16 => Sample::U16,
            SampleName::F16 => Sample::F16,
            SampleName::F32 => Sample::F32,
        };
        let format = PixelFormat::new(description.channels, sample).ok_or_else(|| {
            InputFault::layout(
                format!("is described to have {} channels", description.channels),
                "1 to 4 are possible",
            )
        })?;
        let mut header = ImageHeader::new(description.width.into(), description.height.into(), format)?;
        header.linear = description.linear.unwrap_or(sample.is_float());
        let file = open_file(path)?;
        let (len, expected) =
            (file.metadata()?.len(), description.offset.saturating_add(header.image_bytes()));
        if len != expected {
            let why = format!("has {len} bytes where its description makes {expected}");
            return Err(InputFault::layout(
                why,
                "correct width, height, channels, sample or offset in the .toml file beside it",
            ));
        }
        header.memory = header.row_bytes() as u64;
        Ok(RawReader { header, file, description, plane: Vec::new(), next_row: 0 })
    }

    fn read_row(&mut self, row: &mut [u8]) -> Result<(), InputFault> {
        let y = match self.description.first_row {
            FirstRow::Top => self.next_row,
            FirstRow::Bottom => self.header.height - 1 - self.next_row,
        };
        let (format, offset) = (self.header.format, self.description.offset);
        let sample = format.sample().bytes();
        match self.description.order {
            Order::Interleaved => {
                self.file.seek(SeekFrom::Start(offset + u64::from(y) * row.len() as u64))?;
                self.file.read_exact(row)?;
            }
            Order::Planar => {
                self.plane.resize(self.header.width as usize * sample, 0);
                for channel in 0..format.channels() {
                    let rows = u64::from(channel) * u64::from(self.header.height) + u64::from(y);
                    self.file.seek(SeekFrom::Start(offset + rows * self.plane.len() as u64))?;
                    self.file.read_exact(&mut self.plane)?;
                    let texels = row.chunks_exact_mut(format.texel_bytes());
                    for (texel, from) in texels.zip(self.plane.chunks_exact(sample)) {
                        texel[usize::from(channel) * sample..][..sample].copy_from_slice(from);
                    }
                }
            }
        }
        if self.description.endian == Endian::Big {
            row.chunks_exact_mut(sample).for_each(<[u8]>::reverse);
        }
        self.next_row += 1;
        Ok(())
    }
}

impl RowReader for RawReader {
    fn header(&self) -> &ImageHeader {
        &self.header
    }

    fn read_rows(&mut self, rows: &mut [u8]) -> Result<(), InputFault> {
        rows.chunks_exact_mut(self.header.row_bytes()).try_for_each(|row| self.read_row(row))
    }
}

fn read_description(raw: &Path) -> Result<Description, InputFault> {
    let path = raw_description(raw);
    let in_description = |fault| InputFault::Tile { path: path.clone(), fault: Box::new(fault) };
    if !path.is_file() {
        std::fs::metadata(raw)?;
        let why = format!("is a raw file without a description, {}", path.display());
        return Err(InputFault::layout(why, "write one: width, height, channels, sample"));
    }
    let mut text = String::new();
    let file = open_file(&path).map_err(in_description)?;
    file.take(MAX_TEXT).read_to_string(&mut text).map_err(|error| in_description(error.into()))?;
    toml::from_str(&text).map_err(|error| {
        let why = format!("describes no raw file: {}", error.to_string().trim_end().replace('\n', " "));
        in_description(InputFault::layout(why, "correct it"))
    })
}
