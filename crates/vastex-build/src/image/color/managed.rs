//! The rows of a picture in sRGB, whatever its profile.
//!
//! Rows are read one after the other, and converted some at a time, on several threads where there is help.

use std::sync::Arc;

use moxcms::{CmsError, ColorProfile, DataColorSpace, Layout, Transform16BitExecutor, TransformOptions};
use vastex_core::{Geometry, PageSet};

use super::meaning::{Meaning, NoMeaning, srgb};
use crate::image::ahead::{Ahead, Helpers, Spare};
use crate::image::fault::near_row;
use crate::image::{Beginning, ImageHeader, InputFault, Notice, PixelFormat, RowReader, Sample};

/// What a profile may change and still count as changing nothing: one and a half steps of 8 bits.
const UNCHANGED: u16 = 385;
/// Bytes that tables of a conversion take, about, besides those of the profile.
const TABLE_BYTES: u64 = 2 << 20;
/// Bytes of the rows that are converted at a time.
const PIECE_BYTES: usize = 256 << 10;
/// What a table of the profile takes once it is floats, for each of its bytes.
const TABLE_SCALE: u64 = 4;

/// The image that `inner` reads, as a picture: in sRGB, or in its light where the image is linear, with no
/// profile left in the header.
///
/// Grey and colours of 8 and 16 bits are converted by rows, alpha is kept. A notice tells what was converted,
/// and why a profile was not followed. Images whose numbers are no colours are better read as they are.
pub fn in_srgb(inner: Box<dyn RowReader>) -> Box<dyn RowReader> {
    let mut header = inner.header().clone();
    let Some(profile) = header.profile.take() else { return inner };
    let found = profile.meaning().and_then(|meaning| match Conversion::new(&meaning, header.format) {
        Ok(conversion) => Ok((conversion, meaning.name)),
        Err(why) => Err(NoMeaning { name: meaning.name, why }),
    });
    let pieces = match found {
        Ok((Conversion { is_linear, converter }, from)) => {
            header.linear = is_linear;
            converter.map(|converter| {
                header.notices.push(Notice::ConvertedToSrgb { from, is_linear });
                // What has the value in the file need not have it afterwards.
                header.nodata = None;
                let pieces = Pieces::new(converter, &header);
                let tables = TABLE_BYTES + TABLE_SCALE * profile.bytes();
                header.memory = header.memory.saturating_add(tables + 2 * pieces.bytes);
                pieces
            })
        }
        Err(NoMeaning { name, why }) => {
            header.notices.push(Notice::ProfileIgnored { name, why });
            None
        }
    };
    let seen = inner.header().notices.len();
    Box::new(Managed { inner, header, pieces, seen })
}

/// Returns true if an image of that kind is in sRGB already, or in its light, by what its profile says.
pub(super) fn changes_nothing(meaning: &Meaning, format: PixelFormat) -> bool {
    Conversion::new(meaning, format).is_ok_and(|conversion| conversion.converter.is_none())
}

struct Managed {
    inner: Box<dyn RowReader>,
    header: ImageHeader,
    /// `None` if the profile changes nothing or cannot be followed.
    pieces: Option<Pieces>,
    /// Notices of `inner` that are among the own ones.
    seen: usize,
}

impl RowReader for Managed {
    fn header(&self) -> &ImageHeader {
        &self.header
    }

    fn present(&self, geometry: &Geometry) -> Option<PageSet> {
        self.inner.present(geometry)
    }

    fn tolerate(&mut self) {
        self.inner.tolerate();
    }

    fn memory_ahead(&self, pieces: usize) -> u64 {
        let own = self.pieces.as_ref().map_or(0, |own| own.ahead.memory(pieces));
        own.saturating_add(self.inner.memory_ahead(pieces))
    }

    fn beginning(&self) -> Option<Arc<Beginning>> {
        self.inner.beginning()
    }

    fn take_help(&mut self, helpers: &Helpers) {
        self.inner.take_help(helpers);
        if let Some(own) = &mut self.pieces {
            own.ahead.take_help(helpers);
        }
    }

    fn read_rows(&mut self, rows: &mut [u8]) -> Result<(), InputFault> {
        match &mut self.pieces {
            Some(pieces) => pieces.read(&mut *self.inner, &self.header, rows)?,
            None => self.inner.read_rows(rows)?,
        }
        self.header.add_notices_of(self.inner.header(), &mut self.seen);
        Ok(())
    }
}

/// Rows that are being converted, some at a time.
struct Pieces {
    converter: Arc<Converter>,
    ahead: Ahead<Result<Vec<u8>, InputFault>>,
    /// Rows that are converted at a time, and the bytes that they take meanwhile.
    rows: u32,
    bytes: u64,
    buffers: Arc<Spare<Vec<u8>>>,
    /// Rows that are read of the image; all where it is damaged.
    read: u32,
    /// Rows that are converted, of which so many bytes are given out.
    now: Vec<u8>,
    given: usize,
}

impl Pieces {
    fn new(converter: Converter, header: &ImageHeader) -> Pieces {
        let rows = (PIECE_BYTES / header.row_bytes()).clamp(1, header.height as usize) as u32;
        // The rows, and one as it is converted.
        let bytes = (u64::from(rows) + 4) * header.row_bytes() as u64;
        let ahead = Ahead::new(header.height.div_ceil(rows).into(), bytes);
        let (converter, buffers) = (Arc::new(converter), Arc::default());
        Pieces { converter, ahead, rows, bytes, buffers, read: 0, now: Vec::new(), given: 0 }
    }

    fn read(
        &mut self,
        inner: &mut dyn RowReader,
        header: &ImageHeader,
        rows: &mut [u8],
    ) -> Result<(), InputFault> {
        let mut rest = rows;
        while !rest.is_empty() {
            if self.given == self.now.len() {
                self.ask(inner, header);
                let ended = || Err(InputFault::Truncated { place: near_row(self.read, header.height) });
                let next = self.ahead.next().unwrap_or_else(ended)?;
                self.buffers.give(std::mem::replace(&mut self.now, next));
                self.given = 0;
            }
            let count = rest.len().min(self.now.len() - self.given);
            let (to, later) = rest.split_at_mut(count);
            to.copy_from_slice(&self.now[self.given..self.given + count]);
            self.given += count;
            rest = later;
        }
        Ok(())
    }

    /// Reads rows, as many as there is room for, and gives them to whoever converts them.
    fn ask(&mut self, inner: &mut dyn RowReader, header: &ImageHeader) {
        while self.ahead.has_room() && self.read < header.height {
            let (first, count) = (self.read, self.rows.min(header.height - self.read));
            let mut rows = self.buffers.take().unwrap_or_default();
            rows.resize(count as usize * header.row_bytes(), 0);
            if let Err(fault) = inner.read_rows(&mut rows) {
                self.read = header.height;
                self.ahead.push(move || Err(fault));
                return;
            }
            self.read += count;
            let (converter, row_bytes, height) = (self.converter.clone(), header.row_bytes(), header.height);
            self.ahead.push(move || match converter.rows(&mut rows, row_bytes) {
                Ok(()) => Ok(rows),
                Err(error) => Err(InputFault::Damaged {
                    place: near_row(first, height),
                    why: format!("its colours cannot be converted: {error}"),
                }),
            });
        }
    }
}

/// What a profile means for the rows of an image.
struct Conversion {
    /// True if the rows are light afterwards.
    is_linear: bool,
    converter: Option<Converter>,
}

impl Conversion {
    /// Why not, where the profile does not suit the image.
    fn new(meaning: &Meaning, format: PixelFormat) -> Result<Conversion, &'static str> {
        let profile = &meaning.profile;
        if format.sample().is_float() {
            return Err("the image holds floats");
        }
        if profile.color_space == DataColorSpace::Gray && format.is_color() {
            return Err("it is for grey images");
        }
        Conversion::of(profile, format).map_err(|_| "it is incomplete")
    }

    fn of(profile: &ColorProfile, format: PixelFormat) -> Result<Conversion, CmsError> {
        let greys: Vec<u16> = (0..=255).map(|v| v * 257).collect();
        let is_linear = is_unchanged(&greys, &convert_greys(profile, &srgb(true), &greys)?);
        let target = srgb(is_linear);
        let changes_nothing = match format.is_color() {
            true => {
                let colors = cube();
                let mut converted = vec![0; colors.len()];
                let transform =
                    profile.create_transform_16bit(Layout::Rgb, &target, Layout::Rgb, options())?;
                transform.transform(&colors, &mut converted)?;
                is_unchanged(&colors, &converted)
            }
            false => is_unchanged(&greys, &convert_greys(profile, &target, &greys)?),
        };
        let converter = if changes_nothing { None } else { Some(Converter::new(profile, &target, format)?) };
        Ok(Conversion { is_linear, converter })
    }
}

/// Colours from all over the cube, and all its corners.
fn cube() -> Vec<u16> {
    let steps = || (0..=u16::MAX).step_by(65_535 / 5);
    steps().flat_map(|r| steps().flat_map(move |g| steps().flat_map(move |b| [r, g, b]))).collect()
}

fn is_unchanged(before: &[u16], after: &[u16]) -> bool {
    before.iter().zip(after).all(|(before, after)| before.abs_diff(*after) <= UNCHANGED)
}

/// The most exact there are, since the same are used for 16 bits.
fn options() -> TransformOptions {
    TransformOptions { prefer_fixed_point: false, ..Default::default() }
}

/// What becomes of greys, by a profile for grey or for colours.
fn convert_greys(profile: &ColorProfile, target: &ColorProfile, greys: &[u16]) -> Result<Vec<u16>, CmsError> {
    let mut converted = vec![0; 3 * greys.len()];
    if profile.color_space == DataColorSpace::Gray {
        let transform = profile.create_transform_16bit(Layout::Gray, target, Layout::Rgb, options())?;
        transform.transform(greys, &mut converted)?;
    } else {
        let colors: Vec<u16> = greys.iter().flat_map(|&v| [v; 3]).collect();
        let transform = profile.create_transform_16bit(Layout::Rgb, target, Layout::Rgb, options())?;
        transform.transform(&colors, &mut converted)?;
    }
    Ok(converted.chunks_exact(3).map(|color| color[1]).collect())
}

/// Converts rows in place.
enum Converter {
    /// What becomes of each value, in so many channels with alpha last or without it.
    Grey8 {
        table: Vec<u8>,
        channels: usize,
    },
    Grey16 {
        table: Vec<u16>,
        channels: usize,
    },
    /// By way of 16 bits for samples of 8 too: tables for 8 are more than a step off where it is dark.
    Color {
        transform: Arc<Transform16BitExecutor>,
        is_8: bool,
    },
}

impl Converter {
    fn new(
        profile: &ColorProfile,
        target: &ColorProfile,
        format: PixelFormat,
    ) -> Result<Converter, CmsError> {
        let channels = usize::from(format.channels());
        let layout = if format.has_alpha() { Layout::Rgba } else { Layout::Rgb };
        Ok(match (format.is_color(), format.sample()) {
            (false, Sample::U8) => {
                let greys: Vec<u16> = (0..=255).map(|v| v * 257).collect();
                let table = convert_greys(profile, target, &greys)?;
                Converter::Grey8 { table: table.into_iter().map(nearest8).collect(), channels }
            }
            (false, _) => {
                let greys: Vec<u16> = (0..=u16::MAX).collect();
                Converter::Grey16 { table: convert_greys(profile, target, &greys)?, channels }
            }
            (true, sample) => Converter::Color {
                transform: profile.create_transform_16bit(layout, target, layout, options())?,
                is_8: sample == Sample::U8,
            },
        })
    }

    fn rows(&self, rows: &mut [u8], row_bytes: usize) -> Result<(), CmsError> {
        match self {
            Converter::Grey8 { table, channels } => {
                rows.iter_mut().step_by(*channels).for_each(|v| *v = table[usize::from(*v)]);
            }
            Converter::Grey16 { table, channels } => {
                for v in rows.as_chunks_mut::<2>().0.iter_mut().step_by(*channels) {
                    *v = table[usize::from(u16::from_le_bytes(*v))].to_le_bytes();
                }
            }
            Converter::Color { transform, is_8 } => {
                let (mut row, mut converted) = (Vec::new(), Vec::new());
                for texels in rows.chunks_exact_mut(row_bytes) {
                    row.clear();
                    match is_8 {
                        true => row.extend(texels.iter().map(|&v| u16::from(v) * 257)),
                        false => row.extend(texels.as_chunks::<2>().0.iter().map(|v| u16::from_le_bytes(*v))),
                    }
                    converted.resize(row.len(), 0);
                    transform.transform(&row, &mut converted)?;
                    if *is_8 {
                        texels.iter_mut().zip(&converted).for_each(|(to, from)| *to = nearest8(*from));
                    } else {
                        let samples = texels.as_chunks_mut::<2>().0.iter_mut();
                        samples.zip(&converted).for_each(|(to, from)| *to = from.to_le_bytes());
                    }
                }
            }
        }
        Ok(())
    }
}

/// The nearest number of 8 bits.
fn nearest8(v: u16) -> u8 {
    ((u32::from(v) + 128) / 257) as u8
}
