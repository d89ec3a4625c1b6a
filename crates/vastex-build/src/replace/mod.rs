//! Putting images into a region of a container, on all levels, without building it again.
//!
//! Level by level, the texels that change are held with a margin of those beside them ([`patch`]); the pages
//! that show any of them ([`spans`]) take their old tile ([`before`]), the changed texels over it
//! ([`slice`]); and the next level's are filtered from them as `build` filters ([`run`]). So every texel is
//! what building the whole changed image would give, and memory follows the region. Of layers compressed in
//! blocks, what does not change is known as it decodes only, and blocks without a changed texel stay as they
//! are. An image may belong to any level, and pages may get their first tile so: that is what an inset is.
//! How the file changes while others read it is `vastex_tiles::ContainerUpdate`'s business.

mod before;
mod error;
mod input;
mod patch;
mod region;
mod rules;
mod run;
mod slice;
mod spans;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use vastex_tiles::{Compression, Container, ContainerUpdate, TileSource, Updated};

pub use error::ReplaceError;
pub use input::LayerImage;

use crate::image::{Helpers, Notice};
use crate::progress::Progress;
use crate::texels::blocks::{self, Quality};
use crate::threads;
use crate::tile::TileEncoder;
use before::Before;
use run::Replacement;

pub(crate) use region::Placed;
pub(crate) use rules::{OpenImage, Rules};

/// Tiles that are made side by side, in bytes of their texels.
const BATCH_BYTES: usize = 8 << 20;

/// How a region is replaced.
#[derive(Clone, Debug)]
pub struct ReplaceOptions {
    /// Threads that filter and encode; 0 for as many as there are cores.
    pub threads: usize,
    /// How well the blocks of compressed layers are encoded; the same as for the container gives the same
    /// blocks.
    pub quality: Quality,
    /// True to wait until the disk has the new version. A loss of power leaves a whole version in any
    /// case.
    pub durable: bool,
    /// Bytes of memory beyond which an image is refused before anything is allocated.
    pub memory_limit: u64,
    /// True if images whose compressed data are damaged or end early are taken for what can be made of them.
    pub tolerant: bool,
}

impl Default for ReplaceOptions {
    fn default() -> ReplaceOptions {
        ReplaceOptions {
            threads: 0,
            quality: Quality::default(),
            durable: false,
            memory_limit: 16 << 30,
            tolerant: false,
        }
    }
}

/// What a replacement did.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Replaced {
    /// What changed in the file.
    pub updated: Updated,
    /// Notes on what was left out of the images and what reading them cost, each with its image.
    pub notices: Vec<(PathBuf, Notice)>,
}

/// Puts the texels of images into a container, at `at` (column and row of level 0), on all levels: a path for
/// the one layer that there is, or a [`LayerImage`] (or [`crate::LayerInput`]) for each layer that changes.
/// Across a wrapping edge they go on at the other side.
///
/// Images of several layers are of one region: those of layers at half or a quarter of the resolution have
/// that share of the texels, and `at` must be a whole texel of each layer. Layers without an image keep every
/// byte.
///
/// Whoever has the container open goes on reading it as it was; whoever opens it from then on reads the new
/// version. Where pages have no tiles, those that the images cover any of get them, and are coarse around
/// them as before. Takes memory for the images' texels, half as much again, and the container's index; writes
/// the tiles that show a changed texel, and about 1 MiB of coarse ones; where no texel changes, nothing.
/// After an error or a cancellation the container is as it was.
pub fn replace<I: Clone + Into<LayerImage>>(
    file: &Path,
    at: [u32; 2],
    images: &[I],
    options: &ReplaceOptions,
    progress: &dyn Progress,
) -> Result<Replaced, ReplaceError> {
    let images: Vec<LayerImage> = images.iter().cloned().map(Into::into).collect();
    let update = ContainerUpdate::open(file, options.durable)?;
    let old = update.container().clone();
    let rules = rules(&old)?;
    let open = |image| {
        let placed = input::place(image, at, old.description(), old.name())?;
        open_image(&rules, placed, old.name(), progress)
    };
    let open = images.iter().map(open).collect::<Result<Vec<_>, ReplaceError>>()?;
    input::check_layers(&images, &open, old.name())?;
    input::check_sizes(&open)?;
    run(update, rules, open, usual_compression(&old), options, progress)
}

/// Puts an image into the container that is open for a change, from its own level on, and commits.
pub(crate) fn put(
    update: ContainerUpdate,
    placed: Placed<'_>,
    compression: Compression,
    options: &ReplaceOptions,
    progress: &dyn Progress,
) -> Result<Replaced, ReplaceError> {
    let rules = rules(update.container())?;
    let image = open_image(&rules, placed, update.container().name(), progress)?;
    run(update, rules, vec![image], compression, options, progress)
}

fn rules(container: &Container) -> Result<Rules, ReplaceError> {
    let refuse = |what| ReplaceError::Unsupported { name: container.name().into(), what };
    Rules::new(container.description(), container.filters()).map_err(refuse)
}

fn open_image<'a>(
    rules: &Rules,
    placed: Placed<'a>,
    name: &str,
    progress: &dyn Progress,
) -> Result<OpenImage<'a>, ReplaceError> {
    let refuse = |what| ReplaceError::Unsupported { name: name.into(), what };
    OpenImage::open(rules.of_layer(placed.layer).map_err(refuse)?, placed, progress)
}

/// Replaces what the images cover, which are all of one level, and commits.
fn run(
    mut update: ContainerUpdate,
    rules: Rules,
    mut images: Vec<OpenImage<'_>>,
    compression: Compression,
    options: &ReplaceOptions,
    progress: &dyn Progress,
) -> Result<Replaced, ReplaceError> {
    if options.tolerant {
        images.iter_mut().for_each(|image| image.reader.tolerate());
    }
    let old = update.container().clone();
    let is_sparse = old.present().is_some();
    // Pages that get their first tile get all layers.
    let is_encoded = |number: usize| is_sparse || images.iter().any(|image| image.rules.number == number);
    let encoded = rules.shapes.iter().enumerate().filter(|(number, _)| is_encoded(*number));
    let mut formats = encoded.map(|(_, shape)| shape.layer.format);
    if let Some(format) = formats.find(|format| format.is_compressed() && !blocks::AVAILABLE) {
        return Err(ReplaceError::NoEncoders { name: old.name().into(), format: format.name() });
    }
    let (_, pieces) = rules.check_memory(&images, is_sparse, options)?;
    let pool = Arc::new(threads::pool(options.threads)?);
    let helpers = Helpers::new(pool.clone(), pieces);
    images.iter_mut().for_each(|image| image.reader.take_help(&helpers));
    let encoder = TileEncoder::new(rules.description.clone(), compression, options.quality);
    let replacement = Replacement { pool: &pool, before: Before::new(old), rules, encoder };
    replacement.run(&mut update, &mut images, progress)?;
    let of_image = |image: &OpenImage<'_>| {
        let path = image.placed.image.to_path_buf();
        image
            .notices(replacement.encoder.findings())
            .into_iter()
            .map(move |notice| (path.clone(), notice))
            .collect::<Vec<_>>()
    };
    let notices = images.iter().flat_map(of_image).collect();
    Ok(Replaced { updated: update.commit()?, notices })
}

/// How most tiles of a container are compressed.
fn usual_compression(container: &Container) -> Compression {
    let [raw, lz4, zstd] = container.info().stored_by_codec;
    match raw.max(lz4).max(zstd) {
        0 => Compression::default(),
        most if most == lz4 => Compression::Lz4,
        most if most == zstd => Compression::Zstd(0),
        _ => Compression::None,
    }
}
