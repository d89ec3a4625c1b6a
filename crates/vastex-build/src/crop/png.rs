//! A region as PNG.

use std::io::{self, Write};

use png::{BitDepth, ColorType, Compression, Encoder, EncodingError};

use super::CropError;
use super::shape::{Shape, Sink};
use crate::image::stored_as::{Palette, StoredAs};

/// Writes what `rows` hands over: of 1 to 4 channels of 8 or 16 bits, of grey of fewer, or of a palette.
pub(super) fn write(
    shape: &Shape,
    output: &mut dyn Write,
    rows: &mut dyn FnMut(Sink<'_>) -> Result<(), CropError>,
) -> Result<(), CropError> {
    let mut encoder = Encoder::new(output, shape.size[0], shape.size[1]);
    encoder.set_color(match shape.channels {
        1 => ColorType::Grayscale,
        2 => ColorType::GrayscaleAlpha,
        3 => ColorType::Rgb,
        _ => ColorType::Rgba,
    });
    encoder.set_depth(match shape.bits() {
        1 => BitDepth::One,
        2 => BitDepth::Two,
        4 => BitDepth::Four,
        16 => BitDepth::Sixteen,
        _ => BitDepth::Eight,
    });
    if let StoredAs::Palette(Palette { colors, alphas }) = &shape.of {
        encoder.set_color(ColorType::Indexed);
        encoder.set_palette(colors.as_flattened());
        if !alphas.is_empty() {
            encoder.set_trns(&**alphas);
        }
    }
    let is_wide = shape.number.bytes() == 2;
    encoder.set_compression(Compression::Fast);
    let mut writer = encoder.write_header().map_err(failed)?;
    let mut stream = writer.stream_writer().map_err(failed)?;
    let mut turned = Vec::new();
    rows(&mut |rows| {
        if !is_wide {
            return stream.write_all(&shape.packed(rows));
        }
        turned.clear();
        turned.extend_from_slice(rows);
        turned.as_chunks_mut::<2>().0.iter_mut().for_each(|sample| sample.reverse());
        stream.write_all(&turned)
    })?;
    stream.finish().map_err(failed)?;
    writer.finish().map_err(failed)
}

fn failed(error: EncodingError) -> CropError {
    CropError::Output(match error {
        EncodingError::IoError(error) => error,
        other => io::Error::other(other.to_string()),
    })
}
