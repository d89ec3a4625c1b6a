//! Arrays of Zarr, versions 2 and 3: their metadata, read tolerantly, and their chunks, read one by one.

mod array;
mod keys_of;
mod metadata;
mod shards;
mod v2;
mod v3;

pub(crate) use array::{ZarrArray, open_array};
pub(crate) use metadata::shortened;
