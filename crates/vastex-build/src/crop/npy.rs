//! The shape of a region as an array of NumPy has it.

use super::shape::Shape;

/// What stands before the numbers: a multiple of 64 bytes.
pub(super) fn header(shape: &Shape) -> Vec<u8> {
    let [width, height] = shape.size.map(u64::from);
    let axes = [height, width, shape.channels.into()];
    let axes = if shape.channels == 1 { &axes[..2] } else { &axes[..] };
    vastex_tiles::npy_header(shape.number.name(), axes)
}
