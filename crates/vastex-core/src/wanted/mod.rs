//! What views want: feedback as it comes from a GPU, from groups of textures, or from geometry alone.

pub(crate) mod compact;
pub(crate) mod feedback;
pub(crate) mod groups;
pub(crate) mod motion;
pub(crate) mod survey;
pub(crate) mod vector;
pub(crate) mod view;
