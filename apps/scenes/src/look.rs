//! Which layer of a texture a scene shows, and how its values become colours.
//!
//! The shaders' part of it is `scene_colour` in surface.wgsl; its twin for pictures that the CPU makes is here.

use glam::Vec4;
use vastex::{Layer, LayerId, TextureId, Textures};

use crate::draw::BACKGROUND;
use crate::relief::{Heights, HeightsError, Relief};
use crate::scene::Scene;
use crate::tiling::Tiling;

/// What is shown of a texture.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Shown {
    /// Name of the layer; the first where none is named.
    pub layer: Option<String>,
    /// The values that are black and white, in what shaders sample: 0 and 1 where nothing is said. For all channels but
    /// alpha; colours that are sRGB-encoded count as the light that they stand for.
    pub range: Option<[f32; 2]>,
    /// How scenes with heights are displaced: the terrain always, the globe where anything is said of them.
    pub heights: Heights,
    /// How it lies on scenes without heights.
    pub tiling: Tiling,
}

/// There is no layer of that name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("there is no layer {name:?}; the layers are {}", .layers.join(", "))]
pub struct UnknownLayer {
    /// The name asked for.
    pub name: String,
    /// Those that there are.
    pub layers: Vec<String>,
}

impl Shown {
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
        textures.layer(texture, name).ok_or_else(|| UnknownLayer {
            name: name.clone(),
            layers: textures.description(texture).layers.iter().map(|layer| layer.name.clone()).collect(),
        })
    }
}

/// How many channels mean what.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Channels {
    Grey,
    GreyAlpha,
    RedGreen,
    Colour,
}

/// How the values of a layer become colours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    channels: Channels,
    is_srgb: bool,
    range: [f32; 2],
}

impl Look {
    /// One channel is grey, three or four are a colour. Two are red and green, but grey with alpha in the layer that an image
    /// without layers has, called `color`.
    pub fn new(layer: &Layer, range: Option<[f32; 2]>) -> Look {
        let channels = match layer.format.channels() {
            1 => Channels::Grey,
            2 if layer.name == "color" => Channels::GreyAlpha,
            2 => Channels::RedGreen,
            _ => Channels::Colour,
        };
        Look { channels, is_srgb: layer.format.is_srgb(), range: range.unwrap_or([0.0, 1.0]) }
    }

    /// The format of pictures: colours encoded as the texture's own, so that nothing is lost between them.
    pub fn picture_format(&self) -> wgpu::TextureFormat {
        match self.is_srgb {
            true => wgpu::TextureFormat::Rgba8UnormSrgb,
            false => wgpu::TextureFormat::Rgba8Unorm,
        }
    }

    /// The numbers that surface.wgsl has for what channels mean.
    pub(crate) fn wgsl() -> String {
        [("GREY", Channels::Grey), ("GREY_ALPHA", Channels::GreyAlpha), ("RED_GREEN", Channels::RedGreen)]
            .map(|(name, channels)| format!("const SCENE_{name}: u32 = {}u;\n", channels as u32))
            .concat()
    }

    /// What pipelines with surface.wgsl are made with.
    pub(crate) fn constants(&self) -> [(&'static str, f64); 1] {
        [("SCENE_LOOK", f64::from(self.channels as u32))]
    }

    /// What is behind the surface, as pictures of [`Look::picture_format`] are given it: it looks the same behind every layer.
    pub(crate) fn background(&self) -> Vec4 {
        match self.is_srgb {
            true => BACKGROUND, // light, which the format encodes
            false => BACKGROUND.truncate().map(srgb_from_linear).extend(BACKGROUND.w),
        }
    }

    /// Offset and factor of the range, as `scene.range` has them.
    pub(crate) fn range(&self) -> [f32; 2] {
        let [low, high] = self.range;
        [low, 1.0 / (high - low)]
    }

    /// Twin of `scene_colour` in surface.wgsl on ground that is so light, and of what the picture's format then does.
    pub(crate) fn pixel_from_value(&self, value: [f32; 4], light: f32) -> [u8; 4] {
        let [low, factor] = self.range();
        let shown = [0, 1, 2].map(|channel: usize| (value[channel] - low) * factor);
        let background = self.background();
        let over = |colour: [f32; 3], alpha: f32| {
            std::array::from_fn(|channel| background[channel] * (1.0 - alpha) + colour[channel] * alpha)
        };
        let colour: [f32; 3] = match self.channels {
            Channels::Grey => [shown[0]; 3],
            Channels::GreyAlpha => over([shown[0]; 3], value[1]),
            Channels::RedGreen => [shown[0], shown[1], 0.0],
            Channels::Colour => over(shown, value[3]),
        };
        let stored = |value: f32| if self.is_srgb { srgb_from_linear(value) } else { value };
        let [r, g, b] = colour.map(|value| (stored((value * light).clamp(0.0, 1.0)) * 255.0).round() as u8);
        [r, g, b, 255]
    }
}

/// The sRGB-encoded value of an amount of light.
fn srgb_from_linear(linear: f32) -> f32 {
    if linear > 0.003_130_8 { 1.055 * linear.powf(1.0 / 2.4) - 0.055 } else { linear * 12.92 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vastex::LayerFormat;

    #[test]
    fn a_range_stretches_every_channel_but_alpha() {
        let grey = Look::new(&Layer::new("height", LayerFormat::R16), Some([0.25, 0.75]));
        assert_eq!(grey.pixel_from_value([0.5, 0.0, 0.0, 1.0], 1.0), [128, 128, 128, 255]);
        assert_eq!(grey.pixel_from_value([0.0, 0.0, 0.0, 1.0], 1.0), [0, 0, 0, 255]);
        let colour = Look::new(&Layer::new("a", LayerFormat::Rgba16Float), Some([0.0, 2.0]));
        assert_eq!(colour.pixel_from_value([1.0, 2.0, 3.0, 1.0], 1.0), [128, 255, 255, 255]);
    }

    #[test]
    fn two_channels_are_grey_with_alpha_in_an_image_and_red_and_green_elsewhere() {
        let pixel = |name| {
            Look::new(&Layer::new(name, LayerFormat::Rg8), None).pixel_from_value([1.0, 0.5, 0.0, 1.0], 1.0)
        };
        assert_eq!(pixel("normal"), [255, 128, 0, 255]);
        assert_eq!(pixel("color")[..2], [138, 140]);
    }
}
