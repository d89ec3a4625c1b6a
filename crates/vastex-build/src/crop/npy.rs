//! The header of an array of NumPy, version 1.0 of its format.

use super::shape::Shape;

/// What stands before the numbers: a multiple of 64 bytes.
pub(super) fn header(shape: &Shape) -> Vec<u8> {
    let order = if shape.number.bytes() == 1 { '|' } else { '<' };
    let [width, height] = shape.size;
    let axes = match shape.channels {
        1 => format!("({height}, {width})"),
        channels => format!("({height}, {width}, {channels})"),
    };
    let name = shape.number.name();
    let mut words = format!("{{'descr': '{order}{name}', 'fortran_order': False, 'shape': {axes}, }}");
    const MAGIC: &[u8] = b"\x93NUMPY\x01\x00";
    let before = MAGIC.len() + 2;
    while !(before + words.len() + 1).is_multiple_of(64) {
        words.push(' ');
    }
    words.push('\n');
    [MAGIC, &(words.len() as u16).to_le_bytes(), words.as_bytes()].concat()
}
