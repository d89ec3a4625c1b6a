//! What the texels of an image file are, before they become a layer's.

use std::fmt;

/// How one channel of a texel is stored. Whatever has more than one byte is little-endian.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Sample {
    /// 8 bits, 0 to 1.
    U8,
    /// 16 bits, 0 to 1.
    U16,
    /// A 16-bit float.
    F16,
    /// A 32-bit float.
    F32,
}

impl Sample {
    /// Bytes of one sample.
    pub const fn bytes(self) -> usize {
        match self {
            Sample::U8 => 1,
            Sample::U16 | Sample::F16 => 2,
            Sample::F32 => 4,
        }
    }

    /// Returns true if the sample is a float.
    pub const fn is_float(self) -> bool {
        matches!(self, Sample::F16 | Sample::F32)
    }

    /// The most that the sample stores, as its bytes: what alpha is where nothing is transparent.
    pub(crate) const fn one(self) -> &'static [u8] {
        match self {
            Sample::U8 => &[255],
            Sample::U16 => &[255, 255],
            Sample::F16 => &[0x00, 0x3c],
            Sample::F32 => &[0x00, 0x00, 0x80, 0x3f],
        }
    }
}

/// What the texels of an image are, as a reader hands them out: rows without padding, channels side by side.
///
/// One channel is grey, two are grey and alpha, three red, green, blue, four the same with alpha.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct PixelFormat {
    channels: u8,
    sample: Sample,
}

impl PixelFormat {
    /// Grey, 8 bits.
    pub const GREY8: PixelFormat = PixelFormat { channels: 1, sample: Sample::U8 };
    /// Grey and alpha, 8 bits each.
    pub const GREY_ALPHA8: PixelFormat = PixelFormat { channels: 2, sample: Sample::U8 };
    /// Red, green, blue, 8 bits each.
    pub const RGB8: PixelFormat = PixelFormat { channels: 3, sample: Sample::U8 };
    /// Red, green, blue, alpha, 8 bits each.
    pub const RGBA8: PixelFormat = PixelFormat { channels: 4, sample: Sample::U8 };
    /// Grey, 16 bits.
    pub const GREY16: PixelFormat = PixelFormat { channels: 1, sample: Sample::U16 };
    /// Grey and alpha, 16 bits each.
    pub const GREY_ALPHA16: PixelFormat = PixelFormat { channels: 2, sample: Sample::U16 };
    /// Red, green, blue, 16 bits each.
    pub const RGB16: PixelFormat = PixelFormat { channels: 3, sample: Sample::U16 };
    /// Red, green, blue, alpha, 16 bits each.
    pub const RGBA16: PixelFormat = PixelFormat { channels: 4, sample: Sample::U16 };

    /// The format with so many channels, 1 to 4.
    pub const fn new(channels: u8, sample: Sample) -> Option<PixelFormat> {
        match channels {
            1..=4 => Some(PixelFormat { channels, sample }),
            _ => None,
        }
    }

    /// These channels, each stored as `sample`.
    pub const fn with_sample(self, sample: Sample) -> PixelFormat {
        PixelFormat { sample, ..self }
    }

    /// Channels, 1 to 4.
    pub const fn channels(self) -> u8 {
        self.channels
    }

    /// How each channel is stored.
    pub const fn sample(self) -> Sample {
        self.sample
    }

    /// Returns true if the last channel is alpha.
    pub const fn has_alpha(self) -> bool {
        self.channels.is_multiple_of(2)
    }

    /// Returns true if there are red, green and blue.
    pub const fn is_color(self) -> bool {
        self.channels > 2
    }

    /// Bytes of one texel.
    pub const fn texel_bytes(self) -> usize {
        self.channels as usize * self.sample.bytes()
    }
}

impl fmt::Display for PixelFormat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let channels = ["grey", "grey-alpha", "RGB", "RGBA"][usize::from(self.channels) - 1];
        let sample = match self.sample {
            Sample::U8 => "8-bit",
            Sample::U16 => "16-bit",
            Sample::F16 => "16-bit float",
            Sample::F32 => "32-bit float",
        };
        write!(f, "{sample} {channels}")
    }
}
