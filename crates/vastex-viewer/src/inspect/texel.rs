//! What lies below the pointer: which texel of an image, and its value as it is stored.

use std::fmt;

use glam::DVec2;
use vastex::{CpuSample, LayerFormat, LayerId, Textures};

use crate::camera::Pose;
use crate::layers::StoredScale;
use crate::surface::{SceneRenderer, SeenPlace};

/// A texel of an image, as it is stored.
#[derive(Clone, Debug, PartialEq)]
pub struct InspectedTexel {
    /// Column and row of the texel of level 0.
    pub texel: [u32; 2],
    /// The level of the value: the one that is drawn, or a coarser one where that is not in memory.
    pub level: u8,
    /// The channels as they are stored: whole numbers of 8 or 16 bits, or floats. Without an alpha that hides
    /// nothing.
    pub values: Vec<f64>,
    /// True if they are floats.
    is_float: bool,
}

/// The texel of a layer below a pixel of a scene's picture, in pixels from the top left; `None` beside the
/// image, on every surface ([`SceneRenderer::sight`]), where a layer that lies texel upon texel on the
/// lowest one has none, and where a texture that grows has none yet. `image` is the image's size, of which
/// the texture may have fewer texels.
pub fn texel_at(
    textures: &Textures,
    (renderer, layer): (&SceneRenderer, LayerId),
    pose: &Pose,
    (picture, image): ([u32; 2], [u32; 2]),
    pixel: DVec2,
) -> Option<InspectedTexel> {
    let seen = renderer.sight(textures, pose, (picture, image)).at(pixel)?;
    texel_of(textures, (renderer, layer), image, seen)
}

/// The texel of a layer at a place of an image.
fn texel_of(
    textures: &Textures,
    (renderer, layer): (&SceneRenderer, LayerId),
    image: [u32; 2],
    SeenPlace { texel: place, texels_a_pixel }: SeenPlace,
) -> Option<InspectedTexel> {
    let size = |sides: [u32; 2]| DVec2::new(sides[0].into(), sides[1].into());
    let texel = inside(place, image)?;
    let description = textures.texture(layer.texture()).ok()?.description();
    let [width, height, _] = description.geometry.size();
    let spread = renderer.layers().spread_over(layer, [width, height]);
    let held = inside(place * spread / size(image), [width, height])?;
    if f64::from(held[1]) >= renderer.layers().rows_there(layer.texture()) * f64::from(height) {
        return None;
    }
    // What is drawn is at least as fine as its pixels, where there are such levels.
    let share = spread.x / f64::from(image[0]);
    let level = (share * texels_a_pixel).log2().floor().clamp(0.0, 31.0) as u8;
    let CpuSample { value, level } = textures.cpu().sampler(layer)?.texel(held, level);
    let format = description.layers.get(layer.index())?.format;
    // Of an image that is held at a share of its size, nothing is of level 0.
    let level = level as u8 + (-share.log2()).round().max(0.0) as u8;
    Some(InspectedTexel::new(texel, level, format, value))
}

/// The texel in which a place lies, if it lies in the image.
fn inside(place: DVec2, size: [u32; 2]) -> Option<[u32; 2]> {
    let within = |axis: usize| (0.0..f64::from(size[axis])).contains(&place[axis]);
    (within(0) && within(1)).then_some([place.x as u32, place.y as u32])
}

impl InspectedTexel {
    /// `value` is what shaders sample: light, and 0 to 1 of whole numbers.
    pub(crate) fn new(texel: [u32; 2], level: u8, format: LayerFormat, value: [f32; 4]) -> InspectedTexel {
        let scale = StoredScale::new(format);
        let stored = |channel: usize| match channel {
            3 => scale.stored_alpha(value[channel]),
            _ => scale.stored(value[channel]),
        };
        let is_opaque = format.channels() == 4 && value[3] == 1.0;
        let channels = if is_opaque { 3 } else { format.channels() };
        InspectedTexel {
            texel,
            level,
            values: (0..channels).map(stored).collect(),
            is_float: scale.most().is_none(),
        }
    }

    /// The channels in words, one after the other.
    pub fn values_text(&self) -> String {
        let text = |value: &f64| if self.is_float { float_text(*value) } else { value.to_string() };
        self.values.iter().map(text).collect::<Vec<_>>().join(" ")
    }

    /// The channels in words, each short enough for a line.
    pub fn lines(&self) -> Vec<String> {
        self.values
            .iter()
            .map(|&value| if self.is_float { short(value) } else { value.to_string() })
            .collect()
    }
}

/// A float of 32 bits in as few digits as tell it from any other.
pub(crate) fn float_text(value: f64) -> String {
    let value = value as f32;
    match value.abs() {
        0.0 => "0".to_owned(),
        1e-5..1e9 => value.to_string(),
        // NaN and the infinite ones have no exponent.
        _ => format!("{value:e}"),
    }
}

/// A float in five digits or fewer, where that does not hide how large it is.
fn short(value: f64) -> String {
    match value.abs() {
        0.0 => "0".to_owned(),
        0.001..1e5 => {
            let before_point = value.abs().log10().floor().max(0.0) as usize + 1;
            format!("{value:.*}", 5usize.saturating_sub(before_point).min(4))
        }
        _ => format!("{value:.2e}"),
    }
}

impl fmt::Display for InspectedTexel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y] = self.texel;
        write!(f, "{x},{y}: {}", self.values_text())?;
        match self.level {
            0 => Ok(()),
            level => write!(f, " (level {level})"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layers::linear_from_srgb;

    #[test]
    fn values_are_those_that_are_stored() {
        let values = |format, value| InspectedTexel::new([0, 0], 0, format, value).values;
        let light = |code: u8| linear_from_srgb(f32::from(code) / 255.0);
        for code in 0..=255 {
            let value = [light(code), light(255 - code), 0.0, 1.0];
            let code = f64::from(code);
            assert_eq!(values(LayerFormat::Rgba8Srgb, value), [code, 255.0 - code, 0.0]);
        }
        for code in [0u16, 1, 1000, 32768, 65535] {
            let value = [f32::from(code) / 65535.0, 0.0, 0.0, 1.0];
            assert_eq!(values(LayerFormat::R16, value), [f64::from(code)]);
        }
        assert_eq!(values(LayerFormat::Rgba8, [1.0, 0.0, 0.2, 0.4]), [255.0, 0.0, 51.0, 102.0]);
        assert_eq!(values(LayerFormat::R32Float, [-11000.5, 0.0, 0.0, 1.0]), [-11000.5]);
    }

    #[test]
    fn a_texel_reads_as_a_line() {
        let texel = InspectedTexel::new([1234, 567], 0, LayerFormat::Rg8, [1.0, 0.0, 0.0, 1.0]);
        assert_eq!(texel.to_string(), "1234,567: 255 0");
        let texel = InspectedTexel::new([12, 5], 2, LayerFormat::R32Float, [0.25, 0.0, 0.0, 1.0]);
        assert_eq!(texel.to_string(), "12,5: 0.25 (level 2)");
        for (value, exact) in [
            (0.123_456_79, "0.12345679"),
            (4.000_000_5, "4.0000005"),
            (-11000.5, "-11000.5"),
            (8_388_607.5, "8388607.5"),
            (3.0, "3"),
            (-0.0, "0"),
            (1.25e-7, "1.25e-7"),
            (f32::MAX, "3.4028235e38"),
            (f32::NAN, "NaN"),
            (f32::NEG_INFINITY, "-inf"),
        ] {
            let texel = InspectedTexel::new([0, 0], 0, LayerFormat::R32Float, [value, 0.0, 0.0, 1.0]);
            assert_eq!(texel.values_text(), exact);
            assert!(value.is_nan() || exact.parse() == Ok(value));
        }
        for (value, line) in
            [(0.0, "0"), (0.25, "0.2500"), (-1234.56, "-1234.6"), (1e-7, "1.00e-7"), (f32::NAN, "NaN")]
        {
            let texel = InspectedTexel::new([0, 0], 0, LayerFormat::R32Float, [value, 0.0, 0.0, 1.0]);
            assert_eq!(texel.lines(), [line]);
        }
    }
}
