//! What is asked to be shown of textures: which layers, which range of their values, and how they lie on a
//! surface.

use vastex::{Filter, Layer, LayerId, TextureId, Textures};

use super::planet::PlanetLight;
use super::relief::{Heights, HeightsError, Relief};
use super::renderer::SceneDesc;
use super::tiling::Tiling;
use crate::layers::{
    Bands, ColorMap, CompareMode, Curve, ImageSizes, Layers, LayersError, Nodata, Palette, Placement,
    PlanetLayers, ShownLayer, StoredScale, Tone, UnknownLayer,
};
use crate::scene::Scene;
use crate::stage::TargetKind;

/// How one layer is asked to be shown: by default the first of the first texture, opaque, with values as its
/// format has them.
#[derive(Clone, Debug, PartialEq)]
pub struct LayerOptions {
    /// Which of the textures that are shown together it is of, counted from 0.
    pub texture: usize,
    /// The layer's name; the first layer where none is named.
    pub name: Option<String>,
    /// The channels of it that are shown.
    pub bands: Bands,
    /// The value that stands for no data, as it is stored: 0 to 255 or 65,535 of whole numbers; by default
    /// the layer's own.
    pub nodata: Nodata,
    /// The colour of what is without data, sRGB-encoded red, green and blue; where there is none it is not
    /// drawn, so that the background or the layer beneath is seen.
    pub nodata_color: Option<[u8; 3]>,
    /// The values that are black and white, in what shaders sample: 0 and 1 where nothing is said. For all
    /// channels but alpha; colours that are sRGB-encoded count as the light that they stand for.
    pub range: Option<[f32; 2]>,
    /// How much lighter all is than the range says, in stops: one doubles what lies above black.
    pub exposure: f32,
    /// The curve within the range.
    pub curve: Curve,
    /// The exponent of what lies in the range, after the curve.
    pub gamma: f32,
    /// The colour map of a single channel.
    pub palette: Palette,
    /// How much of what lies beneath it hides, 0 to 1.
    pub opacity: f32,
    /// True if the layer is drawn.
    pub is_visible: bool,
    /// How the layer's texels are blended. Where nothing is said, as the textures' own are; but not at all
    /// where a value stands for no data, which would be mixed with what is known.
    pub filter: Option<Filter>,
}

impl Default for LayerOptions {
    fn default() -> LayerOptions {
        LayerOptions {
            texture: 0,
            name: None,
            bands: Bands::default(),
            nodata: Nodata::default(),
            nodata_color: None,
            range: None,
            exposure: 0.0,
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
    /// The first layer of a texture, as it is. Textures that are shown together are counted from 0.
    pub fn first_of(texture: usize) -> LayerOptions {
        LayerOptions { texture, ..LayerOptions::default() }
    }

    /// How values of a layer become colours.
    pub fn color_map(&self, layer: &Layer) -> ColorMap {
        let scale = StoredScale::new(layer.format);
        let color_map = ColorMap::new(layer, self.range);
        let tone = Tone {
            range: color_map.tone().range,
            exposure: self.exposure,
            curve: self.curve,
            gamma: self.gamma,
        };
        // Alpha is stored as it is sampled, whatever colours are.
        let scale = if self.bands == Bands::One(3) { scale.of_alpha() } else { scale };
        let nodata = self.nodata.of(layer).map(|stored| scale.sampled(stored).into());
        color_map
            .with_tone(tone)
            .with_palette(self.palette)
            .with_bands(self.bands)
            .with_nodata(nodata)
            .with_nodata_color(self.nodata_color)
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
        /// The bands asked for.
        bands: Bands,
        /// The layer's name.
        layer: String,
        /// How many channels the layer has.
        channels: usize,
    },
}

/// The layers of a planet beside its ground and its heights, and its light.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PlanetOptions {
    /// The layer that shines where it is night on the planet, if any does.
    pub night: Option<LayerOptions>,
    /// The planet's clouds, if it has any.
    pub clouds: Option<LayerOptions>,
    /// How the planet is lit.
    pub light: PlanetLight,
}

impl PlanetOptions {
    /// Returns true if a texture, counted from 0 among those that are shown together, is of a planet's lights
    /// or its clouds, and so of no other scene.
    pub fn is_of(&self, texture: usize) -> bool {
        [&self.night, &self.clouds].into_iter().flatten().any(|layer| layer.texture == texture)
    }
}

/// What is shown of a texture, or of several that lie over one another.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DisplayOptions {
    /// The layers, the lowest first; where none is asked for, the first one of each texture, the first
    /// texture's lowest.
    pub layers: Vec<LayerOptions>,
    /// How the uppermost layer that is seen is compared with those beneath it.
    pub compare_mode: CompareMode,
    /// Where layers lie whose texture is of another size than the lowest one's.
    pub placement: Placement,
    /// How scenes with heights are displaced: the terrain always, the planet where there are any, the globe
    /// where anything is said of them.
    pub heights: Heights,
    /// What the planet has beside that.
    pub planet: PlanetOptions,
    /// How the texture lies on scenes without heights.
    pub tiling: Tiling,
    /// True to draw the image in fixed point at any size and distance; false to do so only where a mesh would
    /// not be exact.
    pub always_fixed: bool,
    /// The target that the scene is drawn into; `None` for the faster one.
    pub target: Option<TargetKind>,
}

/// A scene cannot be made of what is asked to be shown.
#[derive(Debug, thiserror::Error)]
pub enum DescribeError {
    /// A layer cannot be shown so.
    #[error(transparent)]
    Options(#[from] LayerOptionsError),
    /// The list of them cannot be drawn.
    #[error(transparent)]
    Layers(#[from] LayersError),
    /// There are no heights for it.
    #[error(transparent)]
    Heights(#[from] HeightsError),
}

impl DisplayOptions {
    /// Returns true if heights displace a scene.
    pub fn displaces(&self, scene: Scene) -> bool {
        matches!(scene, Scene::Terrain | Scene::Planet) || scene == Scene::Globe && self.heights.are_wanted()
    }

    /// The heights of a scene that has any, beside the layer that is shown of `open` textures that are shown
    /// together. A planet without heights is level, and so is every scene whose heights are of a texture that
    /// is yet to come.
    pub fn relief_of(
        &self,
        scene: Scene,
        textures: &mut Textures,
        (open, shown): (&[TextureId], LayerId),
    ) -> Result<Option<Relief>, HeightsError> {
        if !self.displaces(scene) {
            return Ok(None);
        }
        match Relief::new(textures, open, shown, &self.heights) {
            Err(HeightsError::None(_)) if scene == Scene::Planet && !self.heights.are_wanted() => {
                Relief::level(textures, shown).map(Some)
            }
            Err(HeightsError::UnknownTexture { .. }) => Relief::level(textures, shown).map(Some),
            found => found.map(Some),
        }
    }

    /// Finds the layers in the textures that are shown together, of which there is one at least; so there is
    /// a layer at least. Those of a planet's lights, clouds and heights are not among them.
    pub fn layers_of(
        &self,
        textures: &Textures,
        shown: &[TextureId],
    ) -> Result<Vec<ShownLayer>, LayerOptionsError> {
        if self.layers.is_empty() {
            let is_shown = |texture: &usize| !self.is_of_planet(*texture);
            return (0..shown.len())
                .filter(is_shown)
                .map(|n| LayerOptions::first_of(n).shown_of(textures, shown))
                .collect();
        }
        self.layers.iter().map(|layer| layer.shown_of(textures, shown)).collect()
    }

    /// Forgets the lights, clouds and heights of textures beside the first: what is shown next has none of
    /// these textures. What is said of heights goes with the texture that they were of.
    pub fn forget_textures_beside(&mut self) {
        let is_beside = |layer: &mut LayerOptions| layer.texture > 0;
        self.planet.night.take_if(is_beside);
        self.planet.clouds.take_if(is_beside);
        if self.heights.texture.is_some_and(|texture| texture > 0) {
            self.heights = Heights::default();
        }
    }

    /// Returns true if a texture, counted from 0, is of a planet's lights, clouds or heights alone.
    pub fn is_of_planet(&self, texture: usize) -> bool {
        texture > 0 && (self.planet.is_of(texture) || self.heights.texture == Some(texture))
    }

    /// The lights and clouds of a scene that is a planet, of textures that are there already.
    pub fn planet_layers(
        &self,
        scene: Scene,
        textures: &Textures,
        shown: &[TextureId],
    ) -> Result<PlanetLayers, LayerOptionsError> {
        let of = |options: &Option<LayerOptions>| {
            let is_there = |options: &&LayerOptions| scene == Scene::Planet && options.texture < shown.len();
            let there = options.as_ref().filter(is_there);
            there.map(|options| options.shown_of(textures, shown)).transpose()
        };
        Ok(PlanetLayers { night: of(&self.planet.night)?, clouds: of(&self.planet.clouds)? })
    }

    /// Returns true if layers lie texel upon texel in a scene.
    pub fn lie_by_texel(
        &self,
        scene: Scene,
        textures: &Textures,
        layers: (&[ShownLayer], &ImageSizes),
    ) -> bool {
        self.placement == Placement::ByTexel && self.can_place(scene, textures, layers)
    }

    /// Returns true if it matters for layers in a scene how they are placed: on an image that is seen once,
    /// where their images are of unlike sizes.
    pub fn can_place(
        &self,
        scene: Scene,
        textures: &Textures,
        (layers, images): (&[ShownLayer], &ImageSizes),
    ) -> bool {
        let is_flat = scene == Scene::Image && self.tiling == Tiling::default();
        is_flat && Layers::are_unlike(textures, layers, images)
    }

    /// A scene with what is asked to be shown of textures that are shown together, which are of images of
    /// these sizes. `layers` are those of [`DisplayOptions::layers_of`], `known` heights that were found
    /// before, which are looked for once.
    pub fn describe(
        &self,
        scene: Scene,
        textures: &mut Textures,
        (shown, images): (&[TextureId], &ImageSizes),
        layers: Vec<ShownLayer>,
        known: Option<Relief>,
    ) -> Result<SceneDesc, DescribeError> {
        let first = layers.first().ok_or(LayersError::Count(0))?.layer;
        let relief = match known.filter(|_| self.displaces(scene)) {
            Some(known) => Some(known),
            None => self.relief_of(scene, textures, (shown, first))?,
        };
        let mut layers = match &relief {
            Some(relief) if scene == Scene::Planet => {
                let parts = self.planet_layers(scene, textures, shown)?;
                Layers::on_planet(textures, layers, parts, relief.layer())?
            }
            None if self.lie_by_texel(scene, textures, (&layers, images)) => {
                Layers::by_texel(textures, layers, images)?
            }
            relief => Layers::new(textures, layers, relief.as_ref().map(Relief::layer))?,
        };
        layers.compare(self.compare_mode);
        let (tiling, always_fixed, light) = (self.tiling, self.always_fixed, self.planet.light);
        Ok(SceneDesc { scene, layers, relief, tiling, always_fixed, light })
    }
}
