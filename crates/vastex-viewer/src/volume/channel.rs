//! A channel of a volume, as it is shown.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use vastex::{LayerId, TableChoice};

use crate::layers::Palette;

/// Channels that one picture shows at most.
pub const MOST_CHANNELS: usize = 16;

/// Channels that are shown where nobody says which.
pub const FIRST_CHANNELS: usize = 4;

/// Colours of channels that have none: green, magenta, cyan, yellow, red, blue, as lenses are told apart.
const COLORS: [[u8; 3]; 6] =
    [[0, 255, 0], [255, 0, 255], [0, 255, 255], [255, 255, 0], [255, 64, 64], [64, 96, 255]];

/// The colour of a channel for which nobody chose one, of a volume of `count`, as sRGB codes: the file's, if
/// it names one; white of the only channel; else one of six, by its number.
pub fn usual_channel_color(channel: usize, count: usize, of_file: Option<[u8; 3]>) -> [u8; 3] {
    let own = if count == 1 { [255; 3] } else { COLORS[channel % COLORS.len()] };
    of_file.unwrap_or(own)
}

/// A range of sampled values as it can be drawn: with finite ends that single precision tells apart. A range
/// of one value shows everything above it.
pub fn drawable_range(range: [f64; 2]) -> [f32; 2] {
    let within = |end: f64| if end.is_nan() { 0.0 } else { end.clamp(-MOST_END, MOST_END) };
    let [low, high] = range.map(within);
    let apart = least_apart([low, high]);
    match (high - low).abs() < apart {
        true if high < low => [low as f32, (low - apart) as f32],
        true => [low as f32, (low + apart) as f32],
        false => [low as f32, high as f32],
    }
}

/// How far from 0 an end of a range is at most, so that the difference of two is finite in single precision.
pub(crate) const MOST_END: f64 = f32::MAX as f64 / 4.0;

/// How far apart ends are at least, so that single precision tells them apart.
pub(crate) fn least_apart(range: [f64; 2]) -> f64 {
    let most = range[0].abs().max(range[1].abs());
    (most * 4.0 * f64::from(f32::EPSILON)).max(1e-30)
}

/// Entries of direct page tables of a volume, over all of its channels, at most.
const MOST_ENTRIES: u64 = 4 << 20;

/// The page tables that all channels of a volume are to have, so that they lie in one pool, of a volume of so
/// many bricks and so many channels: [`vastex::TextureSettings::page_table`].
pub fn volume_tables(bricks: u64, channels: usize) -> TableChoice {
    match bricks.saturating_mul(channels as u64) <= MOST_ENTRIES {
        true => TableChoice::Direct,
        false => TableChoice::Hashed,
    }
}

/// A channel of a volume, as it is shown. All channels of a picture have textures of one geometry and one
/// format.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VolumeChannel {
    /// The layer that holds the channel's values.
    pub layer: LayerId,
    /// The channel's colour at the upper end of the range, as display values (sRGB codes over 255).
    pub color: Vec3,
    /// The values, as shaders sample them (0 to 1 of whole numbers, floats as they are), that are shown
    /// black and in full. The first may be the larger one.
    pub range: [f32; 2],
    /// The exponent of the place of a value in the range.
    pub gamma: f32,
    /// 0 to 1: how much light it adds, and in emission how much it hides.
    pub opacity: f32,
    /// A colour map in the place of the one colour, for the place of a value in the range.
    pub map: Option<Palette>,
}

impl VolumeChannel {
    /// A channel in white, whose range is 0 to 1.
    pub fn new(layer: impl Into<LayerId>) -> VolumeChannel {
        let (color, range) = (Vec3::ONE, [0.0, 1.0]);
        VolumeChannel { layer: layer.into(), color, range, gamma: 1.0, opacity: 1.0, map: None }
    }

    /// This channel in another colour: red, green and blue as sRGB codes.
    #[must_use]
    pub fn in_color(self, codes: [u8; 3]) -> VolumeChannel {
        VolumeChannel { color: Vec3::from_array(codes.map(|code| f32::from(code) / 255.0)), ..self }
    }

    /// What a value becomes: 0 to 1.
    pub fn shown(&self, value: f64) -> f64 {
        let [low, high] = self.range.map(f64::from);
        let x = ((value - low) / (high - low)).clamp(0.0, 1.0);
        x.powf(f64::from(self.gamma))
    }

    pub(super) fn uniform(&self, id: u32) -> ChannelUniform {
        let [low, high] = self.range;
        ChannelUniform {
            color: self.color.to_array(),
            opacity: self.opacity,
            low,
            inverse_range: 1.0 / (high - low),
            gamma: self.gamma,
            id,
            map: self.map.is_some().into(),
            shown: 1,
            unused: [0; 2],
        }
    }
}

/// `VolumeChannel` of volume.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub(super) struct ChannelUniform {
    color: [f32; 3],
    opacity: f32,
    low: f32,
    inverse_range: f32,
    gamma: f32,
    pub(super) id: u32,
    map: u32,
    shown: u32,
    unused: [u32; 2],
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_drawn_whatever_their_ends_are() {
        assert_eq!(drawable_range([0.25, 0.75]), [0.25, 0.75]);
        assert_eq!(drawable_range([0.75, 0.25]), [0.75, 0.25]);
        for end in [0.0, 5.0, -5.0, 1e7, -65535.0, 3e38, f64::INFINITY, f64::NEG_INFINITY, f64::NAN] {
            let [low, high] = drawable_range([end, end]);
            let scale = 1.0 / (high - low);
            assert!(high > low && scale.is_finite() && scale > 0.0, "{end}: {low} to {high}");
        }
        let [low, high] = drawable_range([1e9 + 1.0, 1e9]);
        assert!(low > high, "turned round");
        let [low, high] = drawable_range([f64::NEG_INFINITY, f64::INFINITY]);
        assert!((high - low).is_finite());
    }

    #[test]
    fn channels_have_the_colour_of_the_file_else_one_of_their_own() {
        assert_eq!(usual_channel_color(1, 3, Some([1, 2, 3])), [1, 2, 3]);
        assert_eq!(
            (usual_channel_color(0, 1, None), usual_channel_color(7, 9, None)),
            ([255; 3], [255, 0, 255])
        );
    }
}
