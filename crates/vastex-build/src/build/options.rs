//! How a container is made: what the caller asks for besides the images of the layers.

use std::path::PathBuf;

use vastex_core::AddressMode;
use vastex_tiles::{Compression, PartOf, WriterOptions};

use crate::texels::blocks::Quality;
use crate::texels::filter::{LayerFilter, LevelsFrom};

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
    /// Whether colour is filtered in linear light and weighted by alpha, where no filter says otherwise; else every channel
    /// as it is stored.
    pub linear: bool,
    /// How levels are made, of layers that do not say so themselves; nothing for what suits each layer's name and format
    /// ([`LayerFilter::for_layer`]).
    pub filter: Option<LayerFilter>,
    /// From which level each level is made, where no filter says otherwise.
    pub levels_from: LevelsFrom,
    /// What lies beyond the edges, in x and in y. Where this says clamp, the tiles of a planet wrap in x all the same.
    pub address: [AddressMode; 2],
    /// What lies beyond an edge of [`AddressMode::Border`]: red, green, blue, alpha, as a layer stores them.
    pub border_color: [u8; 4],
    /// An image of the texture's shape, of any size: where it is black or transparent, pages get no tile, and their nearest
    /// ancestors stand in for them. Nothing for tiles everywhere.
    pub mask: Option<PathBuf>,
    /// Whether pages that are transparent in all layers with alpha get no tile.
    pub drop_transparent: bool,
    /// Whether images whose compressed data are damaged or end early are taken for what can be made of them, with a notice;
    /// else they are errors. Only JPEG can be gone on with.
    pub tolerant: bool,
    /// Images that lie over those of the texture, as fine as they or finer. The texture has as many levels more as the finest of
    /// them needs; where no inset lies, pages of those have no tiles.
    pub insets: Vec<Inset>,
    /// Threads that filter and encode, and decode pieces of the images where they have nothing else to do, besides one that reads each
    /// layer and one that writes; 0 for as many as there are cores.
    pub threads: usize,
    /// Whether to wait at the end until the disk has everything.
    pub durable: bool,
    /// Every tile begins at a multiple of so many bytes, for direct I/O: 1 for no alignment, or a power of two from
    /// 4096 to 65,536.
    pub align: u32,
    /// Bytes of memory that a build may take: where it could take more its buffers become smaller, and where that is not
    /// enough the image is refused before anything is allocated.
    pub memory_limit: u64,
    /// Whether only a part of the container is made, which [`crate::merge`] joins with the others to the very bytes of the whole.
    ///
    /// Every part reads the image up to its own last tile, and encodes and writes its own tiles only.
    pub part: Option<PartOf>,
    /// Whether to go on with what an interrupted build of the same image and options left beside the output, and to leave
    /// what is written there if this one is interrupted or fails. The bytes are those of one build.
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
            address: [AddressMode::Clamp; 2],
            border_color: [0; 4],
            mask: None,
            drop_transparent: false,
            tolerant: false,
            insets: Vec::new(),
            threads: 0,
            durable: false,
            align: 1,
            memory_limit: 16 << 30,
            part: None,
            resume: false,
        }
    }
}

impl BuildOptions {
    pub(crate) fn writer_options(&self, filters: Vec<String>) -> WriterOptions {
        WriterOptions { compression: self.compression, durable: self.durable, align: self.align, filters }
    }
}

/// An image that lies over a layer of a texture, and is as fine as it or finer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Inset {
    /// The layer's name; nothing for the only one that there is.
    pub layer: Option<String>,
    /// The image.
    pub image: PathBuf,
    /// Column and row of its upper left texel, counted in its own texels from the upper left of the texture. What crosses a
    /// wrapping edge goes on at the other side.
    pub at: [u32; 2],
    /// How many levels it is finer than the layer's own image: 0 for as fine as that, 1 for twice as fine.
    pub finer: u8,
}
