//! What is asked to be shown of a texture: which layer, which range of its values, and how it lies on a surface.

use vastex::{LayerId, TextureId, Textures};

use super::relief::{Heights, HeightsError, Relief};
use super::tiling::Tiling;
use crate::layers::UnknownLayer;
use crate::scene::Scene;
use crate::stage::TargetKind;

/// What is shown of a texture.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DisplayOptions {
    /// Name of the layer; the first where none is named.
    pub layer: Option<String>,
    /// The values that are black and white, in what shaders sample: 0 and 1 where nothing is said. For all channels but
    /// alpha; colours that are sRGB-encoded count as the light that they stand for.
    pub range: Option<[f32; 2]>,
    /// How scenes with heights are displaced: the terrain always, the globe where anything is said of them.
    pub heights: Heights,
    /// How it lies on scenes without heights.
    pub tiling: Tiling,
    /// Whether an image or a globe is drawn in fixed point however small and far it is; else where a mesh would not be exact.
    pub always_fixed: bool,
    /// What it is drawn into; else what is faster.
    pub target: Option<TargetKind>,
}

impl DisplayOptions {
    /// Whether heights displace a scene.
    pub fn displaces(&self, scene: Scene) -> bool {
        scene == Scene::Terrain || scene == Scene::Globe && self.heights.are_wanted()
    }

    /// The heights of a scene that has any, beside the layer that is shown.
    pub fn relief_of(
        &self,
        scene: Scene,
        textures: &mut Textures,
        layer: LayerId,
    ) -> Result<Option<Relief>, HeightsError> {
        self.displaces(scene).then(|| Relief::new(textures, layer, &self.heights)).transpose()
    }

    /// Finds the layer in a texture.
    pub fn layer_of(&self, textures: &Textures, texture: TextureId) -> Result<LayerId, UnknownLayer> {
        let Some(name) = &self.layer else { return Ok(texture.into()) };
        let found = textures.texture(texture).ok();
        found.and_then(|texture| texture.layer(name)).ok_or_else(|| UnknownLayer {
            name: name.clone(),
            layers: found.map_or_else(Vec::new, |texture| {
                texture.description().layers.iter().map(|layer| layer.name.clone()).collect()
            }),
        })
    }
}
