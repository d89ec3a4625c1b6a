//! What writes regions, and which format can hold what.

use std::io::Write;

use super::shape::{Shape, Sink};
use super::{CropError, CropFormat, npy, png, tiff};
use crate::image::Number;
use crate::image::stored_as::StoredAs;

/// Refuses what a format cannot hold.
pub(super) fn check(format: CropFormat, shape: &Shape) -> Result<(), CropError> {
    if format != CropFormat::Png {
        return Ok(());
    }
    let Shape { channels, number, of, .. } = shape;
    let is_whole = matches!(number, Number::U8 | Number::U16);
    let refuse = |what: String, remedy| Err(CropError::Format { format, what, remedy });
    match of {
        StoredAs::Inks { .. } | StoredAs::InvertedInks => refuse(
            "inks (cyan, magenta, yellow and black), which it would show as red, green, blue and alpha"
                .into(),
            "write a .tif or a .npy; a container of the image (`vastex build`) has colours to cut out",
        ),
        StoredAs::Palette(palette) if *number != Number::U8 => refuse(
            format!("numbers of a palette of {} colours", palette.colors.len()),
            "write a .tif or a .npy",
        ),
        _ if is_whole && (1..=4).contains(channels) => Ok(()),
        _ => {
            let kind = match number {
                Number::F16 | Number::F32 | Number::F64 => "floats",
                Number::U8 | Number::U16 | Number::U32 => "whole numbers",
                Number::I8 | Number::I16 | Number::I32 => "numbers with a sign",
            };
            let what = format!("{channels} channels of {kind} of {} bits", 8 * number.bytes());
            refuse(what, "write a .npy or a .tif")
        }
    }
}

/// Writes what `rows` hands over, which is given where to.
pub(super) fn write(
    format: CropFormat,
    shape: &Shape,
    output: &mut dyn Write,
    rows: &mut dyn FnMut(Sink<'_>) -> Result<(), CropError>,
) -> Result<(), CropError> {
    let header = match format {
        CropFormat::Npy => npy::header(shape),
        CropFormat::Tiff => tiff::header(shape),
        CropFormat::Png => return png::write(shape, output, rows),
    };
    output.write_all(&header).map_err(CropError::Output)?;
    match format {
        CropFormat::Npy => rows(&mut |rows| output.write_all(rows))?,
        _ => rows(&mut |rows| output.write_all(&shape.packed(rows)))?,
    }
    output.flush().map_err(CropError::Output)
}
