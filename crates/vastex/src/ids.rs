//! What an application calls by name: textures and groups, their layers, and what shaders sample of them.
//!
//! The pager and shaders know textures by numbers, which are given again when nothing can mean the old owner
//! any more. An id also says which of the owners is meant, so that one that is kept too long names nothing,
//! never something else.

use vastex_core::{GroupNumber, TextureNumber};

/// The id of a texture of a [`Textures`](crate::Textures). It names this one texture for ever: after the
/// texture is removed it names none, whatever is added later.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TextureId {
    number: TextureNumber,
    generation: u32,
}

impl TextureId {
    pub(crate) const fn new(number: TextureNumber, generation: u32) -> TextureId {
        TextureId { number, generation }
    }

    /// The number by which pages, events, statistics and traces name the texture while it exists. A texture
    /// added later may get the same number; [`Inspect::id_of`](crate::Inspect::id_of) gives the id that has
    /// it now.
    pub const fn number(self) -> TextureNumber {
        self.number
    }

    pub(crate) const fn generation(self) -> u32 {
        self.generation
    }
}

/// The id of a group of a [`Textures`](crate::Textures). It names this one group for ever: after the group,
/// or a texture in it, is removed it names none.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct GroupId {
    number: GroupNumber,
    generation: u32,
}

impl GroupId {
    pub(crate) const fn new(number: GroupNumber, generation: u32) -> GroupId {
        GroupId { number, generation }
    }

    /// The number by which events name the group while it is there.
    pub const fn number(self) -> GroupNumber {
        self.number
    }

    pub(crate) const fn generation(self) -> u32 {
        self.generation
    }
}

/// One layer of a texture, as a pipeline samples it; [`TextureRef::layer`](crate::TextureRef::layer) finds it
/// by its name.
///
/// Wherever one is asked for, a [`TextureId`] stands for the texture's first layer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct LayerId {
    texture: TextureId,
    index: usize,
}

impl LayerId {
    pub(crate) const fn new(texture: TextureId, index: usize) -> LayerId {
        LayerId { texture, index }
    }

    /// The texture.
    pub const fn texture(self) -> TextureId {
        self.texture
    }

    pub(crate) const fn number(self) -> TextureNumber {
        self.texture.number
    }

    /// The layer's number in [`Description::layers`](crate::Description::layers).
    pub const fn index(self) -> usize {
        self.index
    }
}

impl From<TextureId> for LayerId {
    fn from(texture: TextureId) -> LayerId {
        LayerId::new(texture, 0)
    }
}

/// A member of a group: a layer, and the name that shaders know it by.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Member {
    pub(crate) name: String,
    pub(crate) layer: LayerId,
    pub(crate) is_apart: bool,
}

impl Member {
    /// A layer that is sampled at the same coordinates as the others. A pair of a name and a layer is such a
    /// member, too.
    pub fn new(name: impl Into<String>, layer: impl Into<LayerId>) -> Member {
        Member { name: name.into(), layer: layer.into(), is_apart: false }
    }

    /// A layer that is sampled at coordinates of its own, such as a repeating detail: `vastex_feedback` does
    /// not ask for its pages, `vastex_feedback_NAME` does.
    pub fn apart(name: impl Into<String>, layer: impl Into<LayerId>) -> Member {
        Member { is_apart: true, ..Member::new(name, layer) }
    }
}

impl<S: Into<String>, L: Into<LayerId>> From<(S, L)> for Member {
    fn from((name, layer): (S, L)) -> Member {
        Member::new(name, layer)
    }
}

/// What a pipeline samples: one layer, or a group.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Sampled {
    /// One layer of a texture.
    Layer(LayerId),
    /// A group.
    Group(GroupId),
}

impl From<LayerId> for Sampled {
    fn from(layer: LayerId) -> Sampled {
        Sampled::Layer(layer)
    }
}

impl From<TextureId> for Sampled {
    fn from(texture: TextureId) -> Sampled {
        Sampled::Layer(texture.into())
    }
}

impl From<GroupId> for Sampled {
    fn from(group: GroupId) -> Sampled {
        Sampled::Group(group)
    }
}
