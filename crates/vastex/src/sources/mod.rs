//! What stands between an application's source and the loader: tiles decoded for the device, small textures
//! read whole, and what is read of a texture before it is added.

mod decoded;
mod preparer;
mod tail;
mod whole;

pub(crate) use decoded::{DecodedSource, held_description};
pub(crate) use preparer::PreparedParts;
pub use preparer::{Prepared, Preparer};
pub(crate) use whole::{WholeSource, whole_description};
