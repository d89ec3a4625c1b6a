//! What writes regions, and which format can hold what.

use std::io::Write;

use super::shape::{Shape, Sink};
use super::{CropError, CropFormat, npy, png, tiff};
use crate::image::Number;

/// Refuses what a format cannot hold.
pub(super) fn check(format: CropFormat, number: Number, channels: u16) -> Result<(), CropError> {
    let is_whole = matches!(number, Number::U8 | Number::U16);
    if format != CropFormat::Png || (is_whole && (1..=4).contains(&channels)) {
        return Ok(());
    }
    let kind = match number {
        Number::F16 | Number::F32 | Number::F64 => "floats",
        Number::U8 | Number::U16 | Number::U32 => "whole numbers",
        Number::I8 | Number::I16 | Number::I32 => "numbers with a sign",
    };
    let what = format!("{channels} channels of {kind} of {} bits", 8 * number.bytes());
    Err(CropError::Format { format, what, remedy: "write a .npy or a .tif" })
}

/// Writes what `rows` hands over, which is given where to.
pub(super) fn write(
    format: CropFormat,
    shape: Shape,
    output: &mut dyn Write,
    rows: &mut dyn FnMut(Sink<'_>) -> Result<(), CropError>,
) -> Result<(), CropError> {
    let header = match format {
        CropFormat::Npy => npy::header(&shape),
        CropFormat::Tiff => tiff::header(&shape),
        CropFormat::Png => return png::write(shape, output, rows),
    };
    output.write_all(&header).map_err(CropError::Output)?;
    rows(&mut |rows| output.write_all(rows))?;
    output.flush().map_err(CropError::Output)
}
