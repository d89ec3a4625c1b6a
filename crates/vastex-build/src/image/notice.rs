//! What a build tells besides its result: what it left out of an image, and what it costs.

use std::fmt;

use vastex_core::{LayerFormat, NodataValue};

/// Something that whoever asked for the build should know. Its `Display` is one sentence without the file's
/// name.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Notice {
    /// The file cannot be read by rows, so the whole image is held in memory.
    WholeImage {
        /// Bytes held.
        bytes: u64,
        /// The kind of file.
        why: &'static str,
    },
    /// Colours that the file holds sRGB-encoded became light, in a layer of 16 bits.
    StoredAsLight,
    /// The format keeps no transparency, and some texels are not opaque.
    NotOpaque(LayerFormat),
    /// The format keeps no negative numbers, and there were some.
    NegativesClamped(LayerFormat),
    /// The format is of 16-bit floats, and numbers were rounded to what those hold: 11 significant bits.
    HalfsRounded(LayerFormat),
    /// The format is made of 16-bit floats, and numbers beyond their largest, 65504, became infinite.
    HalfsInfinite(LayerFormat),
    /// Signed numbers of this range became 0 to 1, since the layer's format holds whole numbers only.
    RangeScaled([i64; 2]),
    /// Texels of this value, as the layer stores it, are without data, so coarser levels leave them out.
    NodataLeftOut(NodataValue),
    /// Floats of 64 bits became ones of 32.
    DoublesNarrowed,
    /// Whole numbers beyond 2^24 were rounded to what a 32-bit float can hold.
    IntegersRounded,
    /// Of so many bands the first three are taken, as red, green and blue.
    FirstBands {
        /// How many there are.
        of: u16,
    },
    /// These channels of the file are no part of the picture.
    ChannelsIgnored(String),
    /// The picture is the file's data window, which is another than its display window.
    DataWindow {
        /// First texel of the data window, counted from that of the display window.
        at: [i64; 2],
        /// Size of the display window in texels.
        of: [u64; 2],
    },
    /// So many rows of a mosaic have places where no piece lies; they are transparent, or black without
    /// alpha.
    Gaps(u64),
    /// The picture was turned or mirrored as the file asks; the value is EXIF's, 2 to 8.
    Turned(u16),
    /// Colours were converted.
    ConvertedToSrgb {
        /// Name of the file's colours: its profile's, or what stands in its place.
        from: String,
        /// True if the colours are light, before and after.
        is_linear: bool,
    },
    /// The file says what its colours are, and that was not followed.
    ProfileIgnored {
        /// Name of the profile, or what stands in its place.
        name: String,
        /// Why, as in "since it is for CMYK".
        why: &'static str,
    },
    /// The file holds inks (CMYK), of which red, green and blue are made by a plain formula, whatever its
    /// profile.
    InksConverted,
    /// Colours are multiplied by alpha in the file, and were divided by it, both as they are stored.
    PremultipliedAlpha,
    /// The compressed data are damaged in so many places, and the decoder went on with what it could make of
    /// them.
    DamagedInPlaces(u32),
    /// So few bytes before the end of the file belong to nothing. The decoder skipped them: the picture is
    /// whole if somebody put them there, and damaged if its data are.
    StrayBytes(u32),
    /// The file holds further images or frames.
    FurtherImagesIgnored,
    /// A level's directory has a name that a tool wrote by mistake.
    MisnamedLevel {
        /// The name.
        name: String,
        /// The level that it is taken for.
        level: u32,
    },
    /// A directory has a name as of a level, but none that is looked for, so its tiles are left out.
    IgnoredLevel(String),
    /// The tiles repeat a texel of their neighbours on each side; it is not part of the picture.
    BorderedTiles,
    /// Tiles of the finest level are missing; the texels of their ancestors stand in.
    TilesFromAncestors {
        /// How many.
        missing: u64,
        /// How many the level has when it is whole.
        of: u64,
    },
    /// The texture does not have a size that the grid of the layout can hold, so each level was resampled to
    /// it.
    ResampledToGrid {
        /// Size of the texture.
        from: [u32; 2],
        /// Size of the grid's finest level.
        to: [u32; 2],
    },
    /// The image of a layer has a size that no layer of the texture can have, so it was resampled to the
    /// nearest that one can.
    LayerResampled {
        /// Size of the image.
        from: [u32; 2],
        /// Size of the layer.
        to: [u32; 2],
        /// Texels of the texture along one of the layer.
        scale: u32,
    },
    /// The image format of the tiles has no transparency, and some texels are not opaque.
    AlphaDropped,
    /// The part of a planet fills no whole tile of the levels coarser than this one.
    PartEndsAtLevel(u32),
    /// The tiles have borders, and those at the edge of a part of a planet repeat texels of the part.
    PartBorders,
}

impl fmt::Display for Notice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Notice::WholeImage { bytes, why } => {
                let mib = bytes.div_ceil(1 << 20);
                write!(f, "{why} cannot be read by rows: the whole image is held in memory, {mib} MiB")
            }
            Notice::StoredAsLight => {
                write!(f, "sRGB-encoded colours are stored as light, which keeps them in 16 bits")
            }
            Notice::NotOpaque(LayerFormat::Bc6h) => {
                write!(f, "transparency is left out, which bc6h cannot keep; rgba16f can")
            }
            Notice::NotOpaque(format) => {
                let name = format.name();
                write!(f, "transparency is left out, which {name} does not keep; bc3 and bc7 do")
            }
            Notice::NegativesClamped(format) => {
                write!(f, "negative numbers became 0, since {} holds none; rgba16f does", format.name())
            }
            Notice::HalfsRounded(format) => {
                write!(
                    f,
                    "numbers are rounded by up to a part in 2048, to what {} holds; r32f, of one channel, holds them as they are",
                    format.name()
                )
            }
            Notice::HalfsInfinite(format) => {
                write!(
                    f,
                    "numbers beyond 65504 became infinite, since {} holds no larger ones; r32f, of one channel, does",
                    format.name()
                )
            }
            Notice::IntegersRounded => {
                write!(f, "whole numbers beyond 16777216 are rounded to what 32-bit floats can hold")
            }
            Notice::FirstBands { of } => {
                write!(
                    f,
                    "the first three of {of} bands are red, green and blue; FILE:bands=5,4,3 takes others, FILE:bands=5 one"
                )
            }
            Notice::ChannelsIgnored(names) => write!(f, "the channels {names} are left out"),
            Notice::DataWindow { at: [x, y], of: [w, h] } => {
                write!(f, "the data window is read, which begins at {x},{y} of a display window of {w}x{h}")
            }
            Notice::Gaps(rows) => {
                write!(f, "{rows} rows have places where no piece lies: transparent, or black without alpha")
            }
            Notice::RangeScaled([least, most]) => {
                write!(f, "numbers from {least} to {most} are stored as 0 to 1; r32f holds them as they are")
            }
            Notice::NodataLeftOut(value) => {
                write!(
                    f,
                    "{value} (as it is stored) stands for no data: coarser levels leave such texels out"
                )
            }
            Notice::DoublesNarrowed => write!(f, "64-bit floats are stored with 32 bits"),
            Notice::Turned(o) => {
                let how = match o {
                    2 => "mirrored left to right",
                    3 => "turned by 180 degrees",
                    4 => "mirrored top to bottom",
                    5 => "mirrored along its diagonal",
                    6 => "turned by 90 degrees to the right",
                    7 => "mirrored along its other diagonal",
                    _ => "turned by 90 degrees to the left",
                };
                write!(f, "the picture is {how}, as the file asks (EXIF orientation {o})")
            }
            Notice::ConvertedToSrgb { from, is_linear } => {
                let to = if *is_linear { "linear sRGB" } else { "sRGB" };
                write!(f, "colours are converted from {from} to {to}")
            }
            Notice::ProfileIgnored { name, why } => {
                write!(
                    f,
                    "the colour profile ({name}) is not followed, since {why}: numbers are taken as they are"
                )
            }
            Notice::InksConverted => {
                write!(
                    f,
                    "inks (CMYK) become red, green and blue by (1 - ink) x (1 - black), and no profile of them is followed: \
                     colours are near those in print"
                )
            }
            Notice::PremultipliedAlpha => {
                write!(
                    f,
                    "the file holds colours multiplied by alpha; they are divided by it, as they are stored"
                )
            }
            Notice::DamagedInPlaces(n) => {
                write!(f, "the compressed data are damaged in {n} places; the picture there is a guess")
            }
            Notice::StrayBytes(n) => {
                write!(f, "{n} bytes before the file's end belong to nothing; the picture may be damaged")
            }
            Notice::FurtherImagesIgnored => write!(f, "only the first image of the file is read"),
            Notice::MisnamedLevel { name, level } => {
                write!(f, "the directory '{name}' is misnamed and taken for level {level}")
            }
            Notice::IgnoredLevel(name) => {
                write!(
                    f,
                    "the directory '{name}' is called like a level, but none that is looked for; it is left out"
                )
            }
            Notice::BorderedTiles => write!(f, "the tiles have borders of one texel, which are cut off"),
            Notice::TilesFromAncestors { missing, of } => {
                write!(
                    f,
                    "{missing} of the {of} tiles of the finest level are missing; their ancestors' texels stand in, magnified, so \
                     that the texture is as large as if all were there"
                )
            }
            Notice::ResampledToGrid { from: [w, h], to: [x, y] } => {
                write!(f, "the layout's grid cannot hold {w}x{h} texels: resampled to {x}x{y}")
            }
            Notice::LayerResampled { from: [w, h], to: [x, y], scale } => {
                let share = ["all", "half", "a quarter"][scale.ilog2().min(2) as usize];
                write!(
                    f,
                    "its {w}x{h} texels are no half or quarter of the largest image's: resampled to {x}x{y}, {share} of them \
                     along each side"
                )
            }
            Notice::AlphaDropped => write!(f, "transparency is left out, which JPEG cannot keep"),
            Notice::PartEndsAtLevel(level) => {
                write!(
                    f,
                    "the part fills no whole tile of the levels coarser than {level}; add those of the whole planet"
                )
            }
            Notice::PartBorders => {
                write!(
                    f,
                    "at the edge of the part, the tiles' borders repeat its last texels; the whole planet's tiles have \
                     their neighbours' there"
                )
            }
        }
    }
}
