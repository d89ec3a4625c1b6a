//! What is asked to be shown of textures: which layers, which range of their values, and how they lie on a surface.

use vastex::{Filter, LayerId, TextureId, Textures};

use super::relief::{Heights, HeightsError, Relief};
use super::tiling::Tiling;
use crate::layers::{ColorMap, CompareMode, Curve, Palette, ShownLayer, Tone, UnknownLayer};
use crate::scene::Scene;
use crate::stage::TargetKind;

/// How one layer is asked to be shown: by default the first of the first texture, opaque, with values as its format has them.
#[derive(Clone, Debug, PartialEq)]
pub struct LayerOptions {
    /// Which of the textures that are shown together it is of, counted from 0.
    pub texture: usize,
    /// Its name; the first where none is named.
    pub name: Option<String>,
    /// The values that are black and white, in what shaders sample: 0 and 1 where nothing is said. For all channels but
    /// alpha; colours that are sRGB-encoded count as the light that they stand for.
    pub range: Option<[f32; 2]>,
    /// The curve within the range.
    pub curve: Curve,
    /// The exponent of what lies in the range, after the curve.
    pub gamma: f32,
    /// The colour map of a single channel.
    pub palette: Palette,
    /// How much of what lies beneath it hides, 0 to 1.
    pub opacity: f32,
    /// Whether it is drawn.
    pub is_visible: bool,
    /// How its texels are blended, where that is another way than the textures' own.
    pub filter: Option<Filter>,
}

impl Default for LayerOptions {
    fn default() -> LayerOptions {
        LayerOptions {
            texture: 0,
            name: None,
            range: None,
            curve: Curve::default(),
            gamma: 1.0,
            palette: Palette::default(),
            opacity: 1.0,
            is_visible: true,
            filter: None,
        }
    }
}

impl LayerOptions {
    /// Finds the layer in the textures that are shown together.
    pub fn shown_of(&self, textures: &Textures, shown: &[TextureId]) -> Result<ShownLayer, UnknownLayer> {
        let gone = || UnknownLayer { name: self.name.clone().unwrap_or_default(), layers: Vec::new() };
        let texture = *shown.get(self.texture).ok_or_else(gone)?;
        let shown = textures.texture(texture).map_err(|_| gone())?;
        let layers = &shown.description().layers;
        let layer = match &self.name {
            None => LayerId::from(texture),
            Some(name) => shown.layer(name).ok_or_else(|| UnknownLayer {
                name: name.clone(),
                layers: layers.iter().map(|layer| layer.name.clone()).collect(),
            })?,
        };
        let color_map = ColorMap::new(&layers[layer.index()], self.range);
        let tone = Tone { curve: self.curve, gamma: self.gamma, ..color_map.tone() };
        Ok(ShownLayer {
            layer,
            color_map: color_map.with_tone(tone).with_palette(self.palette),
            opacity: self.opacity,
            is_visible: self.is_visible,
            filter: self.filter,
        })
    }
}

/// What is shown of a texture, or of several that lie over one another, each stretched over the same place.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DisplayOptions {
    /// The layers, the lowest first; where none is asked for, the first one of each texture, the first texture's lowest.
    pub layers: Vec<LayerOptions>,
    /// How the uppermost layer that is seen is compared with those beneath it.
    pub compare_mode: CompareMode,
    /// How scenes with heights are displaced: the terrain always, the globe where anything is said of them.
    pub heights: Heights,
    /// How it lies on scenes without heights.
    pub tiling: Tiling,
    /// Whether it is drawn in fixed point however small and far it is; else where a mesh would not be exact.
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

    /// Finds the layers in the textures that are shown together, of which there is one at least; so there is a layer at least.
    pub fn layers_of(
        &self,
        textures: &Textures,
        shown: &[TextureId],
    ) -> Result<Vec<ShownLayer>, UnknownLayer> {
        if self.layers.is_empty() {
            let first = |texture| LayerOptions { texture, ..LayerOptions::default() };
            return (0..shown.len()).map(|n| first(n).shown_of(textures, shown)).collect();
        }
        self.layers.iter().map(|layer| layer.shown_of(textures, shown)).collect()
    }
}
