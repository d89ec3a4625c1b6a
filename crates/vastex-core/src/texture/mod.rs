//! What a texture is: its shape and pages, the formats of its layers, which pages it has and which of them
//! are the same.

pub(crate) mod format;
pub(crate) mod geometry;
pub(crate) mod level_rule;
pub(crate) mod nodata;
pub(crate) mod numbering;
pub(crate) mod page;
pub(crate) mod page_contents;
pub(crate) mod page_set;
pub(crate) mod region;
pub(crate) mod space;
pub(crate) mod textures;
pub(crate) mod voxels;
