//! Which layer of a texture is meant.

use vastex_core::TextureId;

/// One layer of a texture, as a pipeline samples it; [`crate::Textures::layer`] finds it by its name.
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

    /// The layer's number in [`crate::Description::layers`].
    pub const fn index(self) -> usize {
        self.index
    }
}

impl From<TextureId> for LayerId {
    fn from(texture: TextureId) -> LayerId {
        LayerId::new(texture, 0)
    }
}
