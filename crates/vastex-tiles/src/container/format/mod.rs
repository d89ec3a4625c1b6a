//! The bytes of a container, both ways: what a file says is encoded and decoded here and nowhere else.
//!
//! `layout` has the numbers and ranges that all parts of a file share, `header` the two header copies,
//! `description` the texture, `index` the tiles, `error` what can be wrong with a whole file. Where bytes
//! come from and go to is the business of `read` and `write`; the files beside a container, parts and
//! journals, are that of `write`.

pub(crate) mod description;
pub(crate) mod error;
pub(crate) mod header;
pub(crate) mod index;
pub(crate) mod layout;
