//! What the values of a volume are: kinds of numbers, by all of their names, and arrays of NumPy.

mod dtype;
mod fill;
mod npy;

pub use dtype::DType;
pub(crate) use dtype::swap_bytes;
pub(crate) use fill::fill_of;
pub use npy::npy_header;
