//! The rows of a picture in sRGB, whatever its profile.

use std::sync::Arc;

use moxcms::{CmsError, ColorProfile, DataColorSpace, Layout, Transform16BitExecutor, TransformOptions};
use vastex_core::{Geometry, PageSet};

use super::meaning::{Meaning, NoMeaning, srgb};
use crate::error::{InputFault, near_row};
use crate::notice::Notice;
use crate::readers::{ImageHeader, PixelFormat, RowReader, Sample};

/// What a profile may change and still count as changing nothing: one and a half steps of 8 bits.
const UNCHANGED: u16 = 385;
/// Bytes that tables of a conversion take, about, besides those of the profile.
const TABLE_BYTES: u64 = 2 << 20;
/// What a table of the profile takes once it is floats, for each of its bytes.
const TABLE_SCALE: u64 = 4;

/// The same image as a picture: in sRGB, or in its light where the image is linear, with no profile left in the header.
///
/// Grey and colours of 8 and 16 bits are converted by rows, alpha is kept. A notice tells what was converted, and why a
/// profile was not followed. Images whose numbers are no colours are better read as they are.
pub fn in_srgb(inner: Box<dyn RowReader>) -> Box<dyn RowReader> {
    let mut header = inner.header().clone();
    let Some(profile) = header.profile.take() else { return inner };
    let found = profile.meaning().and_then(|meaning| match Conversion::new(&meaning, header.format) {
        Ok(conversion) => Ok((conversion, meaning.name)),
        Err(why) => Err(NoMeaning { name: meaning.name, why }),
    });
    let converter = match found {
        Ok((Conversion { is_linear, converter }, from)) => {
            header.linear = is_linear;
            if converter.is_some() {
                header.notices.push(Notice::ConvertedToSrgb { from, is_linear });
                let tables = TABLE_BYTES + TABLE_SCALE * profile.bytes();
                header.memory = header.memory.saturating_add(tables + 4 * header.row_bytes() as u64);
            }
            converter
        }
        Err(NoMeaning { name, why }) => {
            header.notices.push(Notice::ProfileIgnored { name, why });
            None
        }
    };
    let seen = inner.header().notices.len();
    Box::new(Managed { inner, header, converter, next_row: 0, seen })
}

/// Whether an image of that kind is in sRGB already, or in its light, by what its profile says.
pub(super) fn changes_nothing(meaning: &Meaning, format: PixelFormat) -> bool {
    Conversion::new(meaning, format).is_ok_and(|conversion| conversion.converter.is_none())
}

struct Managed {
    inner: Box<dyn RowReader>,
    header: ImageHeader,
    /// Nothing where the profile changes nothing or cannot be followed.
    converter: Option<Converter>,
    next_row: u32,
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

    fn read_rows(&mut self, rows: &mut [u8]) -> Result<(), InputFault> {
        self.inner.read_rows(rows)?;
        self.header.add_notices_of(self.inner.header(), &mut self.seen);
        let row_bytes = self.header.row_bytes();
        if let Some(converter) = &mut self.converter {
            rows.chunks_exact_mut(row_bytes).try_for_each(|row| converter.row(row)).map_err(|error| {
                let place = near_row(self.next_row, self.header.height);
                InputFault::Damaged { place, why: format!("its colours cannot be converted: {error}") }
            })?;
        }
        self.next_row += (rows.len() / row_bytes) as u32;
        Ok(())
    }
}

/// What a profile means for the rows of an image.
struct Conversion {
    /// Whether the rows are light afterwards.
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
        row: Vec<u16>,
        converted: Vec<u16>,
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
                row: Vec::new(),
                converted: Vec::new(),
            },
        })
    }

    fn row(&mut self, texels: &mut [u8]) -> Result<(), CmsError> {
        match self {
            Converter::Grey8 { table, channels } => {
                texels.iter_mut().step_by(*channels).for_each(|v| *v = table[usize::from(*v)]);
            }
            Converter::Grey16 { table, channels } => {
                for v in texels.as_chunks_mut::<2>().0.iter_mut().step_by(*channels) {
                    *v = table[usize::from(u16::from_le_bytes(*v))].to_le_bytes();
                }
            }
            Converter::Color { transform, is_8, row, converted } => {
                row.clear();
                match is_8 {
                    true => row.extend(texels.iter().map(|&v| u16::from(v) * 257)),
                    false => row.extend(texels.as_chunks::<2>().0.iter().map(|v| u16::from_le_bytes(*v))),
                }
                converted.resize(row.len(), 0);
                transform.transform(row, converted)?;
                if *is_8 {
                    texels.iter_mut().zip(converted).for_each(|(to, from)| *to = nearest8(*from));
                } else {
                    let samples = texels.as_chunks_mut::<2>().0.iter_mut();
                    samples.zip(converted).for_each(|(to, from)| *to = from.to_le_bytes());
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
