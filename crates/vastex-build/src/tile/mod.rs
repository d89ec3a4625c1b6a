//! Tiles: what is between the texels of a page and the bytes that a container stores.

pub(crate) mod tail;
