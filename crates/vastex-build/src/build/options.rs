//! How a container is made: what the caller asks for besides the images of the layers.

use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

use vastex_core::{AddressMode, NodataValue};
use vastex_tiles::{Compression, PartOf, WriterOptions};

use crate::texels::blocks::Quality;
use crate::texels::filter::{LayerFilter, LevelsFrom};

/// Which texels of an image are without data.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum NodataRule {
    /// Texels of the value that the file names, as GeoTIFF does; all have data where it names none.
    #[default]
    OfFile,
    /// None: all have data.
    Off,
    /// Texels of this value, as the file's samples are numbers; it may be no number (NaN).
    Value(NodataValue),
}

impl NodataRule {
    /// The value that stands for no data in an image whose file names this one.
    pub(crate) fn of(self, of_file: Option<NodataValue>) -> Option<NodataValue> {
        match self {
            NodataRule::OfFile => of_file,
            NodataRule::Off => None,
            NodataRule::Value(value) => Some(value),
        }
    }
}

impl fmt::Display for NodataRule {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            NodataRule::OfFile => f.write_str("file"),
            NodataRule::Off => f.write_str("off"),
            NodataRule::Value(value) => write!(f, "{value}"),
        }
    }
}

/// A text says nothing of texels without data.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("write file, off, or the value that stands for no data, as in -9999 or nan")]
pub struct ParseNodataRuleError;

impl FromStr for NodataRule {
    type Err = ParseNodataRuleError;

    fn from_str(text: &str) -> Result<NodataRule, ParseNodataRuleError> {
        match text {
            "file" => Ok(NodataRule::OfFile),
            "off" => Ok(NodataRule::Off),
            value => value.parse().map(NodataRule::Value).map_err(|_| ParseNodataRuleError),
        }
    }
}

/// How a container is made.
#[derive(Clone, Debug)]
pub struct BuildOptions {
    /// Texels of payload per side of a page, 8 to 4096.
    pub page: u32,
    /// Texels of border on each side, 1 to half a page.
    pub border: u32,
    /// How tiles are compressed.
    pub compression: Compression,
    /// How well block-compressed layers are encoded.
    pub quality: Quality,
    /// True if colour is filtered in linear light and weighted by alpha, where no filter says otherwise; else
    /// every channel as it is stored.
    pub linear: bool,
    /// The filter of layers that name none of their own. `None` picks what suits each layer's name and format
    /// ([`LayerFilter::for_layer`]).
    pub filter: Option<LayerFilter>,
    /// From which level each level is made, where no filter says otherwise.
    pub levels_from: LevelsFrom,
    /// Which texels of the images are without data. Coarser levels leave them out.
    pub nodata: NodataRule,
    /// True if the levels of a pyramid, a TIFF file or a tile directory, are stored as they are shown without
    /// a build; one that is missing is filtered from a finer level up to three away, else interpolated from a
    /// coarser one. Otherwise all levels are made from level 0. For a texture of one layer of colours or
    /// other plain numbers, in a format that holds the pyramid's texels as they are, or in blocks made of
    /// those. Colour profiles are not followed.
    pub keep_levels: bool,
    /// What lies beyond the edges, in x and in y. Planet tile directories always wrap in x, even if this is
    /// [`AddressMode::Clamp`].
    pub address: [AddressMode; 2],
    /// What lies beyond an edge of [`AddressMode::Border`]: red, green, blue, alpha, as a layer stores them.
    pub border_color: [u8; 4],
    /// An image of the texture's shape, of any size. Pages where it is black or transparent get no tile, and
    /// their nearest ancestors stand in for them. `None` gives every page a tile.
    pub mask: Option<PathBuf>,
    /// True if pages that are transparent in all layers with alpha get no tile.
    pub drop_transparent: bool,
    /// True if JPEG images whose compressed data are damaged or end early are read as far as the decoder can,
    /// with a notice. Otherwise they are errors, as damage in every other format always is.
    pub tolerant: bool,
    /// Images that lie over those of the layers, as fine as they or finer. The texture gets as many further
    /// levels as the finest inset needs; pages of these levels have tiles only where an inset lies.
    pub insets: Vec<Inset>,
    /// Threads that filter and encode; when they have nothing else to do, they decode pieces of the images.
    /// One thread for each layer, which reads it, and one that writes are not counted. 0 starts one for each
    /// core.
    pub threads: usize,
    /// True if the build's threads give way to others of the program and of the machine
    /// ([`crate::give_way`]), for a build beside something that a person looks at. It takes as long as any
    /// where nothing else is at work. On systems other than Linux one thread fewer is started instead. It
    /// decides no byte.
    pub gives_way: bool,
    /// True to wait at the end until the disk has everything.
    pub durable: bool,
    /// Every tile begins at a multiple of this many bytes, for direct I/O: a power of two from 4096 to
    /// 65,536, or 1 for no alignment.
    pub align: u32,
    /// Bytes of memory that a build may take. If it could take more, its buffers become smaller; if that is
    /// not enough, the image is refused before anything is allocated.
    pub memory_limit: u64,
    /// The part of the container that is made, or `None` for all of it. [`crate::merge`] joins all parts to
    /// the very bytes of a build of the whole.
    ///
    /// Every part reads the image up to its own last tile, and encodes and writes its own tiles only.
    pub part: Option<PartOf>,
    /// True to go on with what an interrupted build of the same images and options left beside the output,
    /// and to leave what is written there if this build is interrupted or fails. The container gets the bytes
    /// of one build without a break.
    pub resume: bool,
}

impl Default for BuildOptions {
    fn default() -> BuildOptions {
        BuildOptions {
            page: 128,
            border: 4,
            compression: Compression::default(),
            quality: Quality::default(),
            linear: true,
            filter: None,
            levels_from: LevelsFrom::Chain,
            nodata: NodataRule::OfFile,
            keep_levels: false,
            address: [AddressMode::Clamp; 2],
            border_color: [0; 4],
            mask: None,
            drop_transparent: false,
            tolerant: false,
            insets: Vec::new(),
            threads: 0,
            gives_way: false,
            durable: false,
            align: 1,
            memory_limit: 16 << 30,
            part: None,
            resume: false,
        }
    }
}

impl BuildOptions {
    /// A line for each option that decides bytes, by the name that the program's options have too, and its
    /// value. What the paths lead to is part of the input.
    pub(crate) fn named(&self) -> String {
        let filter = self.filter.map_or_else(|| "by each layer".to_owned(), |filter| filter.to_string());
        let lines = [
            ("quality", format!("{:?}", self.quality)),
            ("page", self.page.to_string()),
            ("border", self.border.to_string()),
            ("compress", format!("{:?}", self.compression)),
            ("linear", self.linear.to_string()),
            ("filter", filter),
            ("levels-from", self.levels_from.name().to_owned()),
            ("nodata", self.nodata.to_string()),
            ("address", format!("{:?}", self.address)),
            ("border-color", format!("{:?}", self.border_color)),
            ("mask", self.mask.is_some().to_string()),
            ("drop-transparent", self.drop_transparent.to_string()),
            ("tolerant", self.tolerant.to_string()),
            ("align", self.align.to_string()),
        ];
        lines.map(|(name, value)| format!("{name} {}\n", value.to_lowercase())).concat()
    }

    /// With what is known of the texels.
    pub(crate) fn writer_options(&self, filters: Vec<String>, about: String) -> WriterOptions {
        let (compression, durable, align) = (self.compression, self.durable, self.align);
        WriterOptions { compression, durable, align, filters, volume: None, about }
    }
}

/// An image that lies over a layer of a texture, and is as fine as it or finer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Inset {
    /// The layer's name. `None` stands for the only layer of the texture.
    pub layer: Option<String>,
    /// The image.
    pub image: PathBuf,
    /// Column and row of the image's upper left texel, counted in the image's own texels from the upper left
    /// of the texture. What crosses a wrapping edge goes on at the other side.
    pub at: [u32; 2],
    /// By how many levels the image is finer than the layer's own: 0 if it is as fine, 1 if it is twice as
    /// fine.
    pub finer: u8,
}
