//! How the values of a layer become colours.
//!
//! The shaders' part of it is `scene_colour` in surface.wgsl; its twin for pictures that the CPU makes is
//! here.

mod compare;
mod ground;
mod list;
mod palette;
mod panes;
mod placement;
mod stored;
mod text;
mod tone;
mod values;

use glam::Vec4;
use vastex::Layer;

pub use compare::{CompareMode, ParseCompareModeError};
pub use ground::Ground;
pub use list::{Layers, LayersError, PlanetLayers, ShownLayer};
pub(crate) use palette::PaletteUniform;
pub use palette::{Palette, ParsePaletteError};
pub use panes::Panes;
pub use placement::{ImageSizes, ParsePlacementError, Placement};
pub use stored::StoredScale;
pub use text::{LayersText, MOST_LAYERS, PlanetText};
pub use tone::{Curve, Tone};
pub use values::{Bands, Nodata, ParseBandsError, ParseNodataError};

/// The light that is seen beside the texture: red, green, blue and an alpha of 1.
pub const BACKGROUND: Vec4 = Vec4::new(0.008, 0.01, 0.014, 1.0);

/// There is no layer of that name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("there is no layer {name:?}; the layers are {}", .layers.join(", "))]
pub struct UnknownLayer {
    /// The name asked for.
    pub name: String,
    /// Names of the layers that there are.
    pub layers: Vec<String>,
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
pub struct ColorMap {
    channels: Channels,
    /// The channels that are red, green and blue; of a single one, that one.
    bands: [u8; 3],
    nodata: Nodata,
    /// The colour of what is without data, sRGB-encoded; where there is none it is not drawn.
    nodata_color: Option<[u8; 3]>,
    scale: StoredScale,
    is_srgb: bool,
    tone: Tone,
    palette: Palette,
}

/// What layered.wgsl is told of a layer; laid out as `Layered` there.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
pub(crate) struct LayerUniform {
    tone: [f32; 4],
    opacity: f32,
    /// What they mean ([`ColorMap::look`]), and [`DISPLAY`] and [`GROWS`].
    channels: u32,
    /// 1 where the palette makes colours of a single channel.
    map: u32,
    id: u32,
    /// The share of the picture's width to the left of which it is not drawn, and by how much its difference
    /// from what lies beneath is magnified; below 0 where nothing beneath it is seen where it has no texel.
    pub(crate) begins: f32,
    pub(crate) difference: f32,
    nodata: f32,
    /// In such shares the place from which on it is not drawn.
    pub(crate) ends: f32,
    nodata_color: [f32; 4],
    palette: PaletteUniform,
}

impl LayerUniform {
    /// Rows of the texture may be missing.
    pub(crate) fn grow(&mut self) {
        self.channels |= GROWS;
    }
}

/// Beyond the right edge of any picture.
pub(crate) const NO_END: f32 = 1e6;

/// What is added to what channels mean where values are display values.
const DISPLAY: u32 = 4096;
/// What is added where the value is one of each scale of stored values, times the number of the scale.
const NODATA_SCALE: u32 = 1024;
/// What is added where what is no finite number stands for no data, and where a value does, too.
const NODATA: u32 = 256;
const NODATA_VALUE: u32 = 512;
/// What is added where shades follow a logarithm, where the result has an exponent, where values that are
/// none are taken for light, and where that is rolled off by one curve or the other.
const LOG: u32 = 8192;
const GAMMA: u32 = 16384;
const LIGHT: u32 = 32768;
const REINHARD: u32 = 65536;
const ACES: u32 = 131_072;
/// All of these: what a pixel pays for, and only where it is asked for.
const SHADES: u32 = LOG | GAMMA | LIGHT | REINHARD | ACES;

/// What is added where rows of the texture may be missing.
const GROWS: u32 = 262_144;

/// The fourth channel.
const ALPHA: u8 = 3;

impl ColorMap {
    /// One channel is grey, three or four are a colour. Two are red and green, but grey with alpha in the
    /// layer that an image without layers has, called `color`.
    pub fn new(layer: &Layer, range: Option<[f32; 2]>) -> ColorMap {
        let channels = match layer.format.channels() {
            1 => Channels::Grey,
            2 if layer.name == "color" => Channels::GreyAlpha,
            2 => Channels::RedGreen,
            _ => Channels::Colour,
        };
        let tone = Tone { range: range.unwrap_or([0.0, 1.0]), ..Tone::default() };
        let bands = match channels {
            Channels::Grey | Channels::GreyAlpha => [0; 3],
            Channels::RedGreen => [0, 1, 1],
            Channels::Colour => [0, 1, 2],
        };
        let (is_srgb, palette, nodata) = (layer.format.is_srgb(), Palette::GREY, Nodata::None);
        let (scale, nodata_color) = (StoredScale::new(layer.format), None);
        ColorMap { channels, bands, nodata, nodata_color, scale, is_srgb, tone, palette }
    }

    /// With other channels. Those that the layer does not have are 0.
    pub fn with_bands(self, bands: Bands) -> ColorMap {
        // Two bits tell which one it is.
        let band = |band: u8| band.min(3);
        match bands {
            Bands::AsStored => self,
            Bands::One(one) => ColorMap { channels: Channels::Grey, bands: [band(one); 3], ..self },
            Bands::Color(three) => ColorMap { channels: Channels::Colour, bands: three.map(band), ..self },
        }
    }

    /// With a value that stands for none, in what shaders sample. What the layer says of it is not followed:
    /// [`Nodata::of`] does that.
    pub fn with_nodata(self, nodata: Nodata) -> ColorMap {
        ColorMap { nodata, ..self }
    }

    /// This colour map with a colour, sRGB-encoded, for texels without data; `None` does not draw them.
    pub fn with_nodata_color(self, nodata_color: Option<[u8; 3]>) -> ColorMap {
        ColorMap { nodata_color, ..self }
    }

    /// The values that are shown of what is sampled, those of one channel three times; `None` if there is no
    /// data.
    pub fn values_of(&self, sampled: [f32; 4]) -> Option<[f32; 3]> {
        let values = self.bands.map(|band| sampled[usize::from(band)]);
        let within = self.scale().within(self.nodata());
        (!values.iter().all(|value| self.nodata.is(*value, within))).then_some(values)
    }

    /// How the values that are shown are stored: alpha where that is all that is.
    fn scale(&self) -> StoredScale {
        match self.bands {
            [ALPHA, ALPHA, ALPHA] => self.scale.of_alpha(),
            _ => self.scale,
        }
    }

    /// What channels mean, which they are, whether a value stands for none, and how values become shades; see
    /// surface.wgsl.
    fn look(&self) -> u32 {
        let bands = self.bands.map(u32::from);
        let nodata = match self.nodata {
            Nodata::OfLayer | Nodata::None => 0,
            Nodata::NotANumber => NODATA,
            Nodata::Value(_) => NODATA | NODATA_VALUE | (NODATA_SCALE * self.scale().kind()),
        };
        let curve = match self.tone.curve {
            Curve::Linear | Curve::Light => 0,
            Curve::Log => LOG,
            Curve::Reinhard => REINHARD,
            Curve::Aces => ACES,
        };
        let light = if self.tone.curve.is_of_light() && !self.is_srgb { LIGHT } else { 0 };
        let gamma = if self.tone.gamma == 1.0 { 0 } else { GAMMA };
        let shades = curve | light | gamma;
        self.channels as u32 | (bands[0] << 2) | (bands[1] << 4) | (bands[2] << 6) | nodata | shades
    }

    /// What of [`SHADES`] any of several is drawn by.
    pub(crate) fn shades<'a>(maps: impl Iterator<Item = &'a ColorMap>) -> u32 {
        maps.fold(0, |all, map| all | (map.look() & SHADES))
    }

    /// Returns true if pipelines made for one colour map draw the other, too: both are of the same channels
    /// in the same meaning, of both or of neither a value stands for no data, and shades of both
    /// follow the same curve, and of both or of neither have an exponent.
    pub fn shares_pipelines(&self, other: &ColorMap) -> bool {
        self.constants(true) == other.constants(true)
    }

    /// The value that stands for no data, for shaders; 0 where there is none.
    pub(crate) fn nodata(&self) -> f32 {
        self.nodata.number()
    }

    /// The colour of what is without data in the layer's values, and an alpha of 1; all 0 where it is not
    /// drawn.
    pub(crate) fn nodata_color(&self) -> Vec4 {
        let encoded = |color: [u8; 3]| color.map(|value| f32::from(value) / 255.0);
        let color = self.nodata_color.map(encoded);
        let told = |color: [f32; 3]| if self.is_srgb { color.map(linear_from_srgb) } else { color };
        color.map_or(Vec4::ZERO, |color| glam::Vec3::from(told(color)).extend(1.0))
    }

    /// With another way from values to shades.
    pub fn with_tone(self, tone: Tone) -> ColorMap {
        ColorMap { tone, ..self }
    }

    /// With a colour map of a single channel; other layers have colours of their own.
    pub fn with_palette(self, palette: Palette) -> ColorMap {
        ColorMap { palette, ..self }
    }

    /// This colour map where values have become light already.
    pub(crate) fn of_light(self) -> ColorMap {
        ColorMap { is_srgb: true, ..self }
    }

    /// `id` is that by which shaders know the layer's texture.
    pub(crate) fn uniform(&self, opacity: f32, id: u32) -> LayerUniform {
        LayerUniform {
            tone: self.tone.told(),
            opacity,
            channels: self.look() + if self.is_srgb { 0 } else { DISPLAY },
            map: self.map(),
            palette: self.palette.uniform(),
            id,
            nodata: self.nodata(),
            nodata_color: self.nodata_color().into(),
            ends: NO_END,
            ..LayerUniform::default()
        }
    }

    /// Whether shaders look up the colours of a single channel, as a number.
    pub(crate) fn map(&self) -> u32 {
        u32::from(!self.palette.is_plain())
    }

    /// The format of pictures: colours encoded as the texture's own, so that nothing is lost between them.
    pub fn picture_format(&self) -> wgpu::TextureFormat {
        match self.is_srgb {
            true => wgpu::TextureFormat::Rgba8UnormSrgb,
            false => wgpu::TextureFormat::Rgba8Unorm,
        }
    }

    /// The numbers that surface.wgsl has for what channels mean, and what it has of colour maps.
    pub(crate) fn wgsl() -> String {
        [("GREY", Channels::Grey), ("GREY_ALPHA", Channels::GreyAlpha), ("RED_GREEN", Channels::RedGreen)]
            .map(|(name, channels)| format!("const SCENE_{name}: u32 = {}u;\n", channels as u32))
            .concat()
            + &format!(
                "const SCENE_NODATA: u32 = {NODATA}u;\nconst SCENE_NODATA_VALUE: u32 = {NODATA_VALUE}u;\n\
                 const SCENE_NODATA_SCALE: u32 = {NODATA_SCALE}u;\nconst SCENE_LOG: u32 = {LOG}u;\n\
                 const SCENE_GAMMA: u32 = {GAMMA}u;\nconst SCENE_LIGHT: u32 = {LIGHT}u;\n\
                 const SCENE_REINHARD: u32 = {REINHARD}u;\nconst SCENE_ACES: u32 = {ACES}u;\n\
                 const SCENE_SHADES: u32 = {SHADES}u;\n"
            )
            + &Curve::wgsl()
            + &Palette::wgsl()
    }

    /// What pipelines with surface.wgsl are made with, for a target that is given light or else display
    /// values.
    pub(crate) fn constants(&self, takes_light: bool) -> [(&'static str, f64); 3] {
        [
            ("SCENE_LOOK", f64::from(self.look())),
            ("SCENE_DECODES", f64::from(u8::from(takes_light && !self.is_srgb))),
            ("SCENE_ENCODES", f64::from(u8::from(!takes_light && self.is_srgb))),
        ]
    }

    /// What is behind the surface, in the values of the layer: it looks the same behind every layer.
    fn background(&self) -> Vec4 {
        background(self.is_srgb)
    }

    /// The same of a ground, and what is seen of it through the surface ([`Ground::told`]).
    pub(crate) fn ground(&self, ground: Ground) -> [Vec4; 2] {
        ground.told(self.is_srgb)
    }

    /// How values become shades.
    pub fn tone(&self) -> Tone {
        self.tone
    }

    /// Returns true if the layer has one value that a colour map makes a colour of.
    pub fn takes_palette(&self) -> bool {
        matches!(self.channels, Channels::Grey | Channels::GreyAlpha)
    }

    /// How many channels are values, the first ones; another one is alpha.
    pub fn value_channels(&self) -> usize {
        match self.channels {
            Channels::Grey | Channels::GreyAlpha => 1,
            Channels::RedGreen => 2,
            Channels::Colour => 3,
        }
    }

    /// What is sampled where every channel has this value, and nothing is seen through it.
    #[cfg(feature = "egui")]
    pub(crate) fn opaque(&self, value: f32) -> [f32; 4] {
        match self.channels {
            Channels::GreyAlpha => [value, 1.0, value, 1.0],
            _ => [value, value, value, 1.0],
        }
    }

    /// The colour map of a single channel.
    pub fn palette(&self) -> Palette {
        self.palette
    }

    /// Twin of `scene_colour` in surface.wgsl on ground that is so light, and of what the picture's format
    /// then does.
    pub fn pixel_from_value(&self, value: [f32; 4], light: f32) -> [u8; 4] {
        let is_nodata = self.values_of(value).is_none();
        let shown = self.bands.map(|band| self.tone.shade(value[usize::from(band)], self.is_srgb));
        let grey = if self.palette.is_plain() { [shown[0]; 3] } else { self.palette.color(shown[0]) };
        let background = self.background();
        let over = |colour: [f32; 3], alpha: f32| {
            std::array::from_fn(|channel| background[channel] * (1.0 - alpha) + colour[channel] * alpha)
        };
        let nodata_color = self.nodata_color();
        let colour: [f32; 3] = match self.channels {
            _ if is_nodata => over(nodata_color.truncate().into(), nodata_color.w),
            Channels::Grey => grey,
            Channels::GreyAlpha => over(grey, value[1]),
            Channels::RedGreen => [shown[0], shown[1], 0.0],
            Channels::Colour => over(shown, value[3]),
        };
        let stored = |value: f32| if self.is_srgb { srgb_from_linear(value) } else { value };
        let [r, g, b] = colour.map(|value| (stored((value * light).clamp(0.0, 1.0)) * 255.0).round() as u8);
        [r, g, b, 255]
    }
}

/// [`BACKGROUND`] as light or else as a display value.
pub(crate) fn background(is_light: bool) -> Vec4 {
    match is_light {
        true => BACKGROUND,
        false => BACKGROUND.truncate().map(srgb_from_linear).extend(BACKGROUND.w),
    }
}

/// The sRGB-encoded value of an amount of light.
pub(crate) fn srgb_from_linear(linear: f32) -> f32 {
    if linear > 0.003_130_8 { 1.055 * linear.powf(1.0 / 2.4) - 0.055 } else { linear * 12.92 }
}

/// The amount of light of an sRGB-encoded value.
pub(crate) fn linear_from_srgb(encoded: f32) -> f32 {
    if encoded > 0.040_45 { ((encoded + 0.055) / 1.055).powf(2.4) } else { encoded / 12.92 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vastex::LayerFormat;

    #[test]
    fn a_range_stretches_every_channel_but_alpha() {
        let grey = ColorMap::new(&Layer::new("height", LayerFormat::R16), Some([0.25, 0.75]));
        assert_eq!(grey.pixel_from_value([0.5, 0.0, 0.0, 1.0], 1.0), [128, 128, 128, 255]);
        assert_eq!(grey.pixel_from_value([0.0, 0.0, 0.0, 1.0], 1.0), [0, 0, 0, 255]);
        let colour = ColorMap::new(&Layer::new("a", LayerFormat::Rgba16Float), Some([0.0, 2.0]));
        assert_eq!(colour.pixel_from_value([1.0, 2.0, 3.0, 1.0], 1.0), [128, 255, 255, 255]);
    }

    #[test]
    fn channels_are_exchanged_and_what_is_no_data_is_the_background() {
        let colour = ColorMap::new(&Layer::new("a", LayerFormat::Rgba16), None);
        let pixel = |map: ColorMap| map.pixel_from_value([1.0, 0.5, 0.0, 1.0], 1.0);
        assert_eq!(pixel(colour.with_bands(Bands::Color([2, 1, 0]))), [0, 128, 255, 255]);
        assert_eq!(pixel(colour.with_bands(Bands::One(1))), [128, 128, 128, 255]);
        assert!(!colour.shares_pipelines(&colour.with_bands(Bands::One(1))));
        let of_value = |value| colour.with_nodata(Nodata::Value(value));
        assert!(of_value(1.0).shares_pipelines(&of_value(2.0)) && !of_value(1.0).shares_pipelines(&colour));
        // All channels that are shown have the value, or it is one.
        assert_eq!(pixel(colour.with_nodata(Nodata::Value(0.5))), [255, 128, 0, 255]);
        let background = pixel(colour.with_bands(Bands::One(1)).with_nodata(Nodata::Value(0.5)));
        let expected = super::background(false);
        let expected = [0, 1, 2].map(|channel: usize| (expected[channel] * 255.0).round() as u8);
        assert_eq!(background[..3], expected);
        // Or it has a colour, whatever the values are, no map and no range changing it.
        let red = Some([200, 10, 99]);
        for format in [LayerFormat::Rgba16, LayerFormat::Rgba8Srgb] {
            let layer = Layer::new("a", format);
            let map = ColorMap::new(&layer, Some([0.2, 0.3])).with_bands(Bands::One(1));
            let map = map.with_palette(Palette::VIRIDIS).with_nodata(Nodata::Value(0.5));
            assert_eq!(pixel(map.with_nodata_color(red)), [200, 10, 99, 255], "{format:?}");
            assert_eq!(pixel(map.with_nodata_color(None)), pixel(map));
            assert!(map.shares_pipelines(&map.with_nodata_color(red)), "nothing is compiled for it");
        }
    }

    /// Each number of a format stands for none by itself, however a device rounds what it decodes.
    #[test]
    fn no_data_is_one_stored_value_and_no_other() {
        use LayerFormat::{R8, R16, R32Float, Rgba8, Rgba8Srgb};
        let is = |format, bands: Bands, nodata: f32, value: f32| {
            let map = ColorMap::new(&Layer::new("a", format), None).with_bands(bands);
            map.with_nodata(Nodata::Value(nodata.into())).values_of([value; 4]).is_none()
        };
        for (format, band) in [(R8, 0), (Rgba8, 1), (Rgba8Srgb, 0), (Rgba8Srgb, 3), (R16, 0)] {
            let scale = StoredScale::new(format);
            let scale = if band == 3 { scale.of_alpha() } else { scale };
            for stored in (0..256).map(f64::from) {
                let is =
                    |value: f64| is(format, Bands::One(band), scale.sampled(stored), scale.sampled(value));
                assert!(
                    is(stored) && is(stored + 0.3) && (stored == 0.0 || is(stored - 0.3)),
                    "{format:?} {stored}"
                );
                assert!(!is(stored + 1.0) && !is(stored - 1.0), "{format:?} {stored}");
            }
        }
        let floats = |nodata: f32, value: f32| is(R32Float, Bands::AsStored, nodata, value);
        assert!(floats(0.0, -0.0) && !floats(0.0, 1e-7) && !floats(0.0, -1e-30), "small values are data");
        assert!(floats(1e-8, 1e-8) && !floats(1e-8, 1.1e-8) && !floats(1e-8, 0.0));
        assert!(floats(-9999.0, -9999.0) && !floats(-9999.0, -9998.9));
    }

    #[test]
    fn two_channels_are_grey_with_alpha_in_an_image_and_red_and_green_elsewhere() {
        let pixel = |name| {
            ColorMap::new(&Layer::new(name, LayerFormat::Rg8), None)
                .pixel_from_value([1.0, 0.5, 0.0, 1.0], 1.0)
        };
        assert_eq!(pixel("normal"), [255, 128, 0, 255]);
        assert_eq!(pixel("color")[..2], [138, 140]);
    }
}
