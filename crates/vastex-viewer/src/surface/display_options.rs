//! What is asked to be shown of textures: which layers, which range of their values, and how they lie on a surface.

use vastex::{Filter, Layer, LayerId, TextureId, Textures};

use super::relief::{Heights, HeightsError, Relief};
use super::tiling::Tiling;
use crate::layers::{
    Bands, ColorMap, CompareMode, Curve, Nodata, Palette, ShownLayer, StoredScale, Tone, UnknownLayer,
};
use crate::scene::Scene;
use crate::stage::TargetKind;

/// How one layer is asked to be shown: by default the first of the first texture, opaque, with values as its format has them.
#[derive(Clone, Debug, PartialEq)]
pub struct LayerOptions {
    /// Which of the textures that are shown together it is of, counted from 0.
    pub texture: usize,
    /// Its name; the first where none is named.
    pub name: Option<String>,
    /// The channels of it that are shown.
    pub bands: Bands,
    /// The value that stands for no data, as it is stored: 0 to 255 or 65,535 of whole numbers; by default the layer's own. What has it is
    /// not drawn.
    pub nodata: Nodata,
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
    /// How its texels are blended. Where nothing is said, as the textures' own are; but not at all where a value stands for no data, which
    /// would be mixed with what is known.
    pub filter: Option<Filter>,
}

impl Default for LayerOptions {
    fn default() -> LayerOptions {
        LayerOptions {
            texture: 0,
            name: None,
            bands: Bands::default(),
            nodata: Nodata::default(),
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
    /// How values of a layer become colours.
    pub fn color_map(&self, layer: &Layer) -> ColorMap {
        let scale = StoredScale::new(layer.format);
        let color_map = ColorMap::new(layer, self.range);
        let tone = Tone { curve: self.curve, gamma: self.gamma, ..color_map.tone() };
        // Alpha is stored as it is sampled, whatever colours are.
        let scale = if self.bands == Bands::One(3) { scale.of_alpha() } else { scale };
        let nodata = self.nodata.of(layer).map(|stored| scale.sampled(stored).into());
        color_map.with_tone(tone).with_palette(self.palette).with_bands(self.bands).with_nodata(nodata)
    }

    /// Finds the layer in the textures that are shown together.
    pub fn shown_of(
        &self,
        textures: &Textures,
        shown: &[TextureId],
    ) -> Result<ShownLayer, LayerOptionsError> {
        let gone = LayerOptionsError::UnknownTexture { number: self.texture + 1, count: shown.len() };
        let Some(&texture) = shown.get(self.texture) else { return Err(gone) };
        let shown = textures.texture(texture).map_err(|_| gone)?;
        let layers = &shown.description().layers;
        let layer = match &self.name {
            None => LayerId::from(texture),
            Some(name) => shown.layer(name).ok_or_else(|| UnknownLayer {
                name: name.clone(),
                layers: layers.iter().map(|layer| layer.name.clone()).collect(),
            })?,
        };
        let described = &layers[layer.index()];
        let channels = described.format.channels();
        if !self.bands.are_within(channels) {
            let layer = described.name.clone();
            return Err(LayerOptionsError::UnknownBands { bands: self.bands, layer, channels });
        }
        let unmixed = (self.nodata.of(described) != Nodata::None).then_some(Filter::Nearest);
        Ok(ShownLayer {
            layer,
            color_map: self.color_map(described),
            opacity: self.opacity,
            is_visible: self.is_visible,
            filter: self.filter.or(unmixed),
        })
    }
}

/// A layer cannot be shown as it is asked for.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LayerOptionsError {
    /// No layer has the name.
    #[error(transparent)]
    UnknownLayer(#[from] UnknownLayer),
    /// Fewer textures are shown, or the texture was removed.
    #[error("there is no texture {number}; {count} are shown")]
    UnknownTexture {
        /// Which one, counted from 1.
        number: usize,
        /// How many there are.
        count: usize,
    },
    /// The layer has fewer channels.
    #[error("there are no bands {bands} in layer {layer:?}, which has {channels} of them")]
    UnknownBands {
        /// Those asked for.
        bands: Bands,
        /// The layer's name.
        layer: String,
        /// How many it has.
        channels: usize,
    },
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
    ) -> Result<Vec<ShownLayer>, LayerOptionsError> {
        if self.layers.is_empty() {
            let first = |texture| LayerOptions { texture, ..LayerOptions::default() };
            return (0..shown.len()).map(|n| first(n).shown_of(textures, shown)).collect();
        }
        self.layers.iter().map(|layer| layer.shown_of(textures, shown)).collect()
    }
}
