//! Which layer of a texture is meant.

use vastex_core::TextureId;

use crate::pools::Seen;
use crate::settings::{Filter, Sampling};
use crate::textures::Textures;

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

impl Textures {
    /// The layer of that name, if the texture has one.
    pub fn layer(&self, texture: TextureId, name: &str) -> Option<LayerId> {
        let index = self.description(texture).layers.iter().position(|layer| layer.name == name)?;
        Some(LayerId::new(texture, index))
    }

    /// How the texels of a layer are blended: as was asked for when its texture was added, by [`crate::Settings::filter`], or, where its values
    /// may not be mixed, not at all.
    pub fn filter(&self, layer: impl Into<LayerId>) -> Filter {
        self.sampling_of(layer.into()).filter
    }

    /// How a layer is sampled, which is the same for all textures of its pool.
    pub(crate) fn sampling_of(&self, layer: LayerId) -> Sampling {
        self.pool_of_layer(layer).shape.sampling(layer.index())
    }

    /// How shaders see pools.
    pub(crate) fn seen(&self) -> Seen {
        Seen { way: self.way, fade: !self.settings.fade.is_zero() }
    }
}
