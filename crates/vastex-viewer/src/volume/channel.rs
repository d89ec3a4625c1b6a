//! A channel of a volume, as it is shown.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use vastex::{LayerId, TableChoice};

use crate::layers::Palette;

/// Channels that one picture shows at most.
pub const MOST_CHANNELS: usize = 16;

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
    /// Where its values are.
    pub layer: LayerId,
    /// Its colour at the upper end of the range, as display values (sRGB codes over 255).
    pub color: Vec3,
    /// The values, as shaders sample them (0 to 1 of whole numbers, floats as they are), that are shown
    /// black and in full. The first may be the larger one.
    pub range: [f32; 2],
    /// The exponent of the place of a value in the range.
    pub gamma: f32,
    /// 0 to 1: how much light it adds, and in emission how much it hides.
    pub opacity: f32,
    /// What makes its colours in the place of the one colour: what a place in the range becomes.
    pub map: Option<Palette>,
}

impl VolumeChannel {
    /// A channel in white, whose range is 0 to 1.
    pub fn new(layer: impl Into<LayerId>) -> VolumeChannel {
        let (color, range) = (Vec3::ONE, [0.0, 1.0]);
        VolumeChannel { layer: layer.into(), color, range, gamma: 1.0, opacity: 1.0, map: None }
    }

    /// The same in another colour: red, green and blue as sRGB codes.
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
            unused: [0; 3],
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
    unused: [u32; 3],
}
