//! Writing containers. A file is made by one writer, whole (`writer`), with resumption (`journal`, `resume`)
//! or in parts that are joined (`part`, `merge`), under a temporary name until it is complete (`output`). A
//! file that exists is changed in place (`update`) or rewritten in another order (`reorder`).
//!
//! What the bytes mean is the business of `format`; which tiles there are, and in what order, that of the
//! builder.

mod error;
mod journal;
mod merge;
mod output;
mod part;
#[cfg(not(target_family = "wasm"))]
mod reorder;
mod resume;
mod tile_head;
#[cfg(not(target_family = "wasm"))]
pub(in crate::container) mod update;
mod writer;

pub use error::WriteError;
pub use merge::{MergeError, merge};
pub use output::{TempFile, remove_abandoned, resolved, write_advice};
pub use part::{PartOf, PartWriter};
#[cfg(not(target_family = "wasm"))]
pub use reorder::{ReorderError, reorder, rewrite};
pub use resume::{Left, Origin, ResumableWriter};
#[cfg(not(target_family = "wasm"))]
pub use update::{ContainerUpdate, UpdateError, Updated};
pub use writer::{ContainerWriter, WriterOptions, Written};
