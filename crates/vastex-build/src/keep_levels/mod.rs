//! Containers that keep the levels of a pyramid: its tiles, cut anew, rather than levels made of level 0.
//!
//! Pages come from the pyramid as they are shown where it lies ([`crate::source`]), batch after batch, read
//! and encoded by the threads of a pool. So a build takes as much memory as a batch and what the source
//! keeps, whatever the size.

use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;

use vastex_core::{AddressMode, Description, Layer, LayerFormat, PagePos};
use vastex_tiles::{ContainerWriter, EncodedTile, TileSource, Written};

use crate::build::error::BuildError;
use crate::build::{BuildOptions, BuildReport, LayerReport, NodataRule, leftovers, place};
use crate::image::{InputFault, Notice, TiffAbout, open_with_files_while};
use crate::progress::Progress;
use crate::source::{DirectorySource, Shape, SourceError, TiffSource};
use crate::texels::blocks;
use crate::texels::{LayerFilter, LayerInput};
use crate::threads;
use crate::tile::{INDEX_BYTES, Recoder, TileEncoder};

/// Bytes of texels that are read and encoded side by side.
const BATCH_BYTES: usize = 16 << 20;
/// What a source keeps of decoded tiles at most, and of the levels that it makes at opening.
const SOURCE_BYTES: u64 = 512 << 20;

/// Makes a container of one pyramid with the levels that it has.
pub(crate) fn build(
    inputs: &[LayerInput],
    output: &Path,
    options: &BuildOptions,
    progress: &dyn Progress,
) -> Result<BuildReport, BuildError> {
    let input = match inputs {
        [] => return Err(BuildError::NoInput),
        [input] => input,
        _ => return Err(BuildError::KeptLevels("several layers")),
    };
    check(input, options)?;
    leftovers::refuse(output, false)?;
    let opened = open_with_files_while(&input.path, &|| progress.opening());
    let opened = opened.map_err(|fault| BuildError::input(&input.path, fault))?;
    place::check(&opened.files, output)?;
    drop(opened);
    let pyramid = Pyramid::open(input, options)?;
    let described = pyramid.tiles().description();
    let texture = Arc::new(texture(input, options, described)?);
    pyramid.notices().iter().for_each(|notice| progress.note(&input.path, notice));
    let filter = LayerFilter {
        nodata: texture.layers[0].nodata,
        ..LayerFilter::for_layer(&input.name, described.layers[0].format, options.linear)
    };
    let [width, height, _] = texture.geometry.size();
    let about = TiffAbout::kept_of_file(&input.path, [width, height]);
    let writer_options = options.writer_options(vec![filter.to_string()], about);
    let writer = ContainerWriter::claim(output, (*texture).clone(), writer_options, options.resume)?;
    leftovers::remove(output);
    let encoder = TileEncoder::new(texture.clone(), options.compression, options.quality);
    let written = write(&pyramid, &input.path, &encoder, writer, options, progress)?;
    let [width, height, _] = texture.geometry.size();
    let mut notices = pyramid.notices().to_vec();
    notices.extend(pyramid.losses(texture.layers[0].format));
    notices.extend(encoder.findings().notices(0, texture.layers[0].format));
    Ok(BuildReport {
        size: [width, height],
        levels: texture.geometry.levels().len() as u32,
        layers: vec![LayerReport {
            path: input.path.clone(),
            layer: texture.layers[0].clone(),
            filter,
            notices,
        }],
        texels: u64::from(width) * u64::from(height),
        tiles: written.tiles,
        constant_tiles: written.constant_tiles,
        shared_tiles: written.shared_tiles,
        bytes: written.bytes,
        memory: texture.geometry.page_count() * INDEX_BYTES
            + SOURCE_BYTES
            + 3 * BATCH_BYTES.max(described.tile_bytes()) as u64,
        ..BuildReport::default()
    })
}

/// What goes without saying where levels are made anew, and cannot be had where they are not.
fn check(input: &LayerInput, options: &BuildOptions) -> Result<(), BuildError> {
    let usual = BuildOptions::default();
    let others = [
        (input.filter.or(options.filter).is_some(), "a filter"),
        (options.levels_from != usual.levels_from, "--levels-from"),
        (options.linear != usual.linear, "--linear off"),
        (options.mask.is_some(), "a mask"),
        (options.drop_transparent, "--drop-transparent"),
        (!options.insets.is_empty(), "insets"),
        (options.part.is_some(), "--shard"),
        (options.resume, "--resume"),
        (matches!(options.nodata, NodataRule::Value(_)), "--nodata VALUE"),
        (options.tolerant, "--tolerant"),
        (options.memory_limit != usual.memory_limit, "--memory-mib"),
        (options.address.contains(&AddressMode::Border), "a border colour"),
    ];
    match others.into_iter().find(|(is_asked, _)| *is_asked) {
        Some((_, what)) => Err(BuildError::KeptLevels(what)),
        None => Ok(()),
    }
}

/// What becomes of a pyramid: its texels, or blocks that are made of them.
fn texture(
    input: &LayerInput,
    options: &BuildOptions,
    described: &Description,
) -> Result<Description, BuildError> {
    let held = described.layers[0].format;
    let format = input.format.unwrap_or(held);
    // Levels that are missing are made as those of colours and other plain numbers are.
    let filter = |name: &str| LayerFilter::for_layer(name, held, true);
    if filter(&input.name) != filter("color") {
        return Err(BuildError::KeptLevels(
            "a layer of this name, whose levels are made in a way of their own",
        ));
    }
    if format.decoded() != held {
        let possible = vastex_core::LayerFormat::ALL.into_iter().filter(|format| format.decoded() == held);
        return Err(BuildError::Format {
            path: input.path.clone(),
            image: held.name().to_owned(),
            format: format.name(),
            possible: possible.map(vastex_core::LayerFormat::name).collect::<Vec<_>>().join(", "),
        });
    }
    if format.is_compressed() && !blocks::AVAILABLE {
        return Err(BuildError::NoEncoders(format.name()));
    }
    let nodata = described.layers[0].nodata.filter(|_| options.nodata == NodataRule::OfFile);
    let layers = vec![Layer { nodata, ..Layer::new(input.name.clone(), format) }];
    let texture = Description {
        border_color: options.border_color,
        ..Description::new(described.geometry.clone(), layers)
    };
    let unit = texture.layers[0].format.block_side();
    texture.check().map_err(|error| BuildError::layers(error, options.page, options.border, unit))?;
    Ok(texture)
}

/// What has levels to keep.
enum Pyramid {
    Tiff(Box<TiffSource>),
    Directory(Box<DirectorySource>),
}

impl Pyramid {
    fn open(input: &LayerInput, options: &BuildOptions) -> Result<Pyramid, BuildError> {
        let path = &input.path;
        let format = input.format.map(|format| Layer::new(input.name.clone(), format));
        let shape = Shape {
            page: Some(options.page),
            border: options.border,
            address: options.address,
            tail_align: Description::tail_align(format.as_slice()),
        };
        let is_none = |error: &SourceError| {
            matches!(error, SourceError::Input { fault: InputFault::NoTiles | InputFault::Text, .. })
        };
        let failed = |error: SourceError| match error {
            SourceError::Geometry(error) => BuildError::Geometry(error),
            SourceError::BrokenOff { .. } => BuildError::Cancelled,
            SourceError::Input { path, fault: InputFault::NoTiles } => {
                BuildError::NoLevels { path, why: "is no pyramid of tiles".into() }
            }
            SourceError::Input { path, fault } => BuildError::Input { path, fault },
        };
        if !path.is_dir() {
            match TiffSource::open_as(path, &shape) {
                Ok(tiff) if tiff.levels().len() < 2 => {
                    let why = "is a TIFF without further levels".into();
                    return Err(BuildError::NoLevels { path: path.clone(), why });
                }
                Ok(tiff) => return Ok(Pyramid::Tiff(Box::new(tiff))),
                Err(error) if is_none(&error) => {}
                Err(error) => return Err(failed(error)),
            }
        }
        let opened = DirectorySource::open_as(path, &shape);
        opened.map(|directory| Pyramid::Directory(Box::new(directory))).map_err(failed)
    }

    fn tiles(&self) -> &dyn TileSource {
        match self {
            Pyramid::Tiff(tiff) => &**tiff,
            Pyramid::Directory(directory) => &**directory,
        }
    }

    fn notices(&self) -> &[Notice] {
        match self {
            Pyramid::Tiff(tiff) => tiff.notices(),
            Pyramid::Directory(directory) => directory.notices(),
        }
    }

    /// What the texels that were read so far lost in a layer of a format.
    fn losses(&self, format: LayerFormat) -> Vec<Notice> {
        match self {
            Pyramid::Tiff(tiff) => tiff.losses(format),
            Pyramid::Directory(directory) => directory.losses(format),
        }
    }
}

/// Writes all pages, the coarsest first.
fn write(
    pyramid: &Pyramid,
    path: &Path,
    encoder: &TileEncoder,
    mut writer: ContainerWriter<vastex_tiles::TempFile>,
    options: &BuildOptions,
    progress: &dyn Progress,
) -> Result<Written, BuildError> {
    let (tiles, pool) = (pyramid.tiles(), threads::pool(options.threads)?);
    let source = tiles.description();
    let (recoder, geometry) = (Recoder::new(encoder, source), &source.geometry);
    let at_once = (BATCH_BYTES / source.tile_bytes()).max(1);
    let encoded = |&pos: &PagePos| -> Result<(PagePos, EncodedTile), BuildError> {
        let tile = pollster::block_on(tiles.read(pos));
        let recoded = tile.and_then(|tile| recoder.recode(pos, &tile, &path.display().to_string()));
        Ok((pos, recoded.map_err(|error| BuildError::Tile { path: path.into(), error })?))
    };
    let (rows, count) = (u64::from(geometry.size()[1]), geometry.page_count());
    let (mut pages, mut done, mut bytes) = (geometry.pages(), 0, 0);
    loop {
        // In rows, as other builds tell it.
        let rows_done = (u128::from(rows) * u128::from(done) / u128::from(count)) as u64;
        if progress.advance(rows_done, rows, bytes) == ControlFlow::Break(()) {
            return Err(BuildError::Cancelled);
        }
        let batch: Vec<PagePos> = pages.by_ref().take(at_once).collect();
        if batch.is_empty() {
            return Ok(writer.finish()?);
        }
        done += batch.len() as u64;
        let made = pool.install(|| threads::try_map(&batch, encoded))?;
        for (pos, tile) in made {
            bytes += tile.tile().bytes.len() as u64;
            writer.append(pos, tile)?;
        }
    }
}
