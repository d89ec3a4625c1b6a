//! `vastex info`: what is in a container, for people and scripts; of a TIFF pyramid, [`super::tiff_info`]
//! knows, and of an image [`super::image_info`], of a volume `super::volume`.

use std::path::Path;
use std::process::ExitCode;

use anyhow::{Result, bail};
use serde::Serialize;
use vastex::diagnostics::PoolEstimate;
use vastex::{AddressMode, Description, TileSource as _};
use vastex_core::{Level, TexelPositions};
use vastex_tiles::{Container, ContainerError, Info, Saved};

#[cfg(feature = "view")]
use crate::args::CacheArgs;
use crate::args::InfoArgs;
#[cfg(feature = "view")]
use crate::open::SaidOfFile;
use crate::{open, report};

pub(crate) fn run(args: &InfoArgs) -> Result<ExitCode> {
    #[cfg(feature = "volumes")]
    if super::volume::is_described_as_volume(&args.file) {
        return super::volume::info(args);
    }
    if args.origins.is_given() && args.file.exists() {
        bail!("{}: is no volume, and --origins is for volumes; leave it out", args.file.display());
    }
    if let Some((source, summary)) = super::source_info::of(&args.file, &args.cache)? {
        let said = format!("{}\n{}", args.file.display(), summary.text());
        return say(args, source.description(), &summary, said);
    }
    #[cfg(feature = "build")]
    if open::what_lies_at(&args.file)? == open::Lies::Other {
        let looked = open::Looked::at(&args.file);
        if let Some((description, summary)) = super::tiff_info::of(&args.file, &looked)? {
            let said = format!("{}\n{}", args.file.display(), summary.text());
            return say(args, &description, &summary, said);
        }
        if let Some(summary) = super::image_info::of(&args.file, &looked)? {
            return say_of_image(args, &summary);
        }
        open::check_is_image(&args.file)?;
    }
    let container = Container::open_file(&args.file).or_else(|error| refuse(&args.file, error))?;
    let info = container.info();
    let mut summary = Summary::new(&info, &container);
    let estimate = args.estimate.map(|picture| PoolEstimate::new(&info.description, picture));
    summary.estimate = estimate.as_ref().map(Estimate::new);
    if args.json {
        report::print_json(&summary)?;
    } else {
        let mut text = format!("{}\n{}", args.file.display(), summary.text());
        if let Some(estimate) = estimate {
            text.push_str(&estimate_text(&estimate, info.pages));
        }
        report::print(&text)?;
    }
    Ok(ExitCode::SUCCESS)
}

/// What is said of a file that was looked at, for the window. Fails where nothing can be said.
#[cfg(feature = "view")]
#[cfg_attr(not(feature = "build"), expect(unused_variables, reason = "nothing is found"))]
pub(crate) fn said_of(file: &Path, looked: &open::Looked) -> Result<SaidOfFile> {
    #[cfg(feature = "volumes")]
    if super::volume::is_described_as_volume(file) {
        return super::volume::rows_of(file).map(SaidOfFile::of_rows);
    }
    if open::is_directory_of_tiles(file) {
        let cache = CacheArgs { cache: None, cache_gib: 20 };
        let tiles = super::source_info::of(file, &cache)?;
        let rows: Vec<_> = tiles.map_or_else(Vec::new, |(_, summary)| summary.rows().into());
        return Ok(SaidOfFile::of_rows(rows));
    }
    #[cfg(feature = "build")]
    if open::what_lies_at(file)? == open::Lies::Other {
        if let Some((_, summary)) = super::tiff_info::of(file, looked)? {
            return Ok(SaidOfFile { rows: summary.rows(), converted: summary.converted });
        }
        if let Some(summary) = super::image_info::of(file, looked)? {
            return Ok(SaidOfFile { rows: summary.rows(), converted: summary.converted });
        }
    }
    let container = Container::open_file(file)?;
    Ok(SaidOfFile::of_rows(Summary::new(&container.info(), &container).all_rows()))
}

/// Says a summary as JSON or as text, with the estimate that was asked for.
fn say(
    args: &InfoArgs,
    description: &Description,
    summary: &impl Serialize,
    said: String,
) -> Result<ExitCode> {
    let estimate = args.estimate.map(|picture| PoolEstimate::new(description, picture));
    if args.json {
        let mut value = serde_json::to_value(summary)?;
        if let (Some(estimate), Some(object)) = (&estimate, value.as_object_mut()) {
            object.insert("estimate".into(), serde_json::to_value(Estimate::new(estimate))?);
        }
        report::print_json(&value)?;
    } else {
        let mut text = said;
        if let Some(estimate) = estimate {
            text.push_str(&estimate_text(&estimate, description.geometry.page_count()));
        }
        report::print(&text)?;
    }
    Ok(ExitCode::SUCCESS)
}

/// The same of an image.
#[cfg(feature = "build")]
fn say_of_image(args: &InfoArgs, summary: &super::image_info::ImageSummary) -> Result<ExitCode> {
    let file = args.file.display();
    if args.estimate.is_some() {
        bail!(
            "{file}: how large a pool it needs, its container tells; build it first: `vastex build {file} -o OUT.vastex`"
        );
    }
    match args.json {
        true => report::print_json(summary)?,
        false => report::print(&format!("{file}\n{}", summary.text()))?,
    }
    Ok(ExitCode::SUCCESS)
}

/// Says what a tile directory is good for, if that is what was named.
pub(super) fn refuse<T>(path: &Path, error: ContainerError) -> Result<T> {
    if open::is_directory_of_tiles(path) {
        bail!(
            "{}: is a directory of tiles and no container; `vastex build` makes one of it, and `vastex view` shows it as it is",
            path.display()
        );
    }
    Err(error.into())
}

/// What `--json` prints.
#[derive(Serialize)]
struct Summary {
    /// Version of the container format.
    version: u32,
    /// Width and height in texels.
    size: [u32; 2],
    /// Texels of payload per side of a page.
    page: u32,
    /// Texels of border on each side of a page.
    border: u32,
    /// What lies beyond the edges, in x and y.
    address: [&'static str; 2],
    /// Red, green, blue and alpha in hexadecimal digits, where an edge has one.
    border_color: Option<String>,
    /// Whether texels of coarser levels lie in the middle of what they cover, or keep the positions of finer
    /// ones.
    positions: &'static str,
    /// How many there are.
    levels: usize,
    /// Width and height of each level in texels, the finest first.
    level_sizes: Vec<[u32; 2]>,
    /// The finest level that lies in the tail.
    tail_level: u8,
    layers: Vec<LayerSummary>,
    /// Pages of the texture, the tail counted as one.
    pages: u64,
    tiles: u64,
    /// Pages, and how many of them have a tile, of each level finer than the tail, the finest first.
    pages_by_level: Vec<u64>,
    tiles_by_level: Vec<u64>,
    constant_tiles: u64,
    shared_tiles: u64,
    stored_tiles: u64,
    stored_by_codec: Codecs,
    /// Of the file.
    bytes: u64,
    /// Of the stored tiles.
    stored_bytes: u64,
    /// Of all tiles, decoded.
    raw_bytes: u64,
    saved_bytes: SavedBytes,
    /// Every tile begins at a multiple of so many bytes.
    align: u32,
    /// What the file that it was built of says of its texels.
    #[cfg(feature = "build")]
    #[serde(flatten)]
    about: super::about_info::AboutSummary,
    /// With `--estimate`.
    #[serde(skip_serializing_if = "Option::is_none")]
    estimate: Option<Estimate>,
}

/// The pool that a picture needs.
#[derive(Serialize)]
struct Estimate {
    /// In pixels.
    picture: [u32; 2],
    pages_in_view: u64,
    pages_with_ancestors: u64,
    slots: u64,
    tile_bytes: u64,
    pool_bytes: u64,
}

impl Estimate {
    fn new(estimate: &PoolEstimate) -> Estimate {
        Estimate {
            picture: estimate.picture,
            pages_in_view: estimate.in_view,
            pages_with_ancestors: estimate.with_ancestors,
            slots: estimate.slots,
            tile_bytes: estimate.tile_bytes,
            pool_bytes: estimate.bytes(),
        }
    }
}

/// The arithmetic for people; `pages` are those of the whole texture.
fn estimate_text(estimate: &PoolEstimate, pages: u64) -> String {
    let [width, height] = estimate.picture;
    let mut text = format!("\n  the pool for a picture of {width} x {height} pixels\n");
    for line in estimate.to_string().lines() {
        text.push_str(&format!("    {line}\n"));
    }
    text.push_str(&format!("    = {}", report::bytes(estimate.bytes())));
    if pages < estimate.slots {
        let all = pages * estimate.tile_bytes;
        text.push_str(&format!("; all {pages} pages of this texture are {}", report::bytes(all)));
    }
    text
}

#[derive(Serialize)]
struct LayerSummary {
    name: String,
    format: &'static str,
    /// Texels of the texture along one of the layer.
    scale: u32,
    /// What made the coarser levels, where the file says.
    filter: Option<String>,
    /// True if its values may be mixed where they are sampled.
    mixable: bool,
    /// The value of texels without data, as texels store it; `nan` for what is no number.
    nodata: Option<String>,
    /// Of the layer in a tile, decoded.
    tile_bytes: usize,
}

impl LayerSummary {
    fn text(&self) -> String {
        let LayerSummary { name, format, scale, mixable, tile_bytes, .. } = self;
        let scale = if *scale == 1 { String::new() } else { format!(" at 1/{scale}") };
        let filter = self.filter.as_ref().map(|name| format!(", filter {name}")).unwrap_or_default();
        let mixed = if *mixable { "" } else { ", not mixed" };
        let nodata = self.nodata.as_ref().map(|value| format!(", no data {value}")).unwrap_or_default();
        format!("{name} ({format}{scale}{filter}{mixed}{nodata}, {tile_bytes} bytes a tile)")
    }
}

/// Bytes that tiles would have taken besides, each stored on its own and as it is decoded.
#[derive(Serialize)]
struct SavedBytes {
    absent: u64,
    constant: u64,
    shared: u64,
    compression: u64,
}

/// Stored tiles by how they are compressed.
#[derive(Serialize)]
struct Codecs {
    none: u64,
    lz4: u64,
    zstd: u64,
}

impl Summary {
    fn new(info: &Info, container: &Container) -> Summary {
        // A name for each layer, or none.
        let filters = container.filters();
        let geometry = &info.description.geometry;
        let [x, y, _] = geometry.address();
        let layer = |(number, layer): (usize, &vastex_core::Layer)| LayerSummary {
            name: layer.name.clone(),
            format: layer.format.name(),
            scale: layer.scale,
            filter: filters.get(number).cloned(),
            mixable: layer.is_mixable,
            nodata: layer.nodata.map(|value| value.to_string()),
            tile_bytes: info.description.layer_bytes(layer),
        };
        let [none, lz4, zstd] = info.stored_by_codec;
        let finer = usize::from(geometry.tail().first_level());
        let Saved { absent, constant, shared, compression } = info.saved();
        Summary {
            version: info.version,
            size: first_two(geometry.size()),
            page: geometry.page()[0],
            border: geometry.border()[0],
            address: [x, y].map(address_name),
            border_color: [x, y]
                .contains(&AddressMode::Border)
                .then(|| hexadecimal(info.description.border_color)),
            positions: match geometry.spec().positions {
                TexelPositions::Centered => "centered",
                TexelPositions::Kept => "kept",
            },
            levels: info.levels().len(),
            level_sizes: info.levels().iter().map(|level| first_two(level.size)).collect(),
            tail_level: geometry.tail().first_level(),
            layers: info.description.layers.iter().enumerate().map(layer).collect(),
            pages: info.pages,
            tiles: info.tiles,
            pages_by_level: info.levels()[..finer].iter().map(Level::page_count).collect(),
            tiles_by_level: info.tiles_by_level[..finer].to_vec(),
            constant_tiles: info.constant_tiles,
            shared_tiles: info.shared_tiles,
            stored_tiles: info.stored_tiles,
            stored_by_codec: Codecs { none, lz4, zstd },
            bytes: info.bytes,
            stored_bytes: info.stored_bytes,
            raw_bytes: info.raw_bytes,
            saved_bytes: SavedBytes { absent, constant, shared, compression },
            align: info.align,
            #[cfg(feature = "build")]
            about: super::about_info::AboutSummary::new(
                &vastex_build::TiffAbout::of_container(container),
                None,
            ),
            estimate: None,
        }
    }

    fn text(&self) -> String {
        let rows = self.all_rows().into_iter();
        rows.map(|(name, value)| format!("  {name:<12}{value}")).collect::<Vec<_>>().join("\n")
    }

    /// With what the file that it was built of says of its texels.
    fn all_rows(&self) -> Vec<(String, String)> {
        let rows = self.rows().into_iter().map(|(name, value)| (name.to_owned(), value));
        #[cfg(feature = "build")]
        let rows = rows.chain(self.about.rows(self.size));
        rows.collect()
    }

    /// What there is to say, by names.
    fn rows(&self) -> Vec<(&'static str, String)> {
        let [width, height] = self.size;
        let color = self.border_color.as_ref().map(|color| format!(" ({color})")).unwrap_or_default();
        let layers: Vec<_> = self.layers.iter().map(LayerSummary::text).collect();
        let Codecs { none, lz4, zstd } = self.stored_by_codec;
        let aligned = match self.align {
            1 => String::new(),
            align => format!(", tiles at multiples of {align} bytes"),
        };
        let saved = |bytes: u64| match bytes {
            0 => String::new(),
            bytes => format!(", which saves {}", report::bytes(bytes)),
        };
        let SavedBytes { absent, constant, shared, compression } = self.saved_bytes;
        let rows = [
            ("size", format!("{width} x {height} texels")),
            ("levels", format!("{}, from level {} on in the tail", self.levels, self.tail_level)),
            ("page", format!("{} texels, border {}", self.page, self.border)),
            ("address", self.address.join(", ") + &color),
            ("positions", self.positions.into()),
            ("layers", layers.join(", ")),
            ("tiles", format!("{} for {} pages", self.tiles, self.pages)),
            ("  absent", format!("{}{}", self.pages - self.tiles, saved(absent))),
            ("  constant", format!("{}{}", self.constant_tiles, saved(constant))),
            ("  shared", format!("{}{}", self.shared_tiles, saved(shared))),
            (
                "  stored",
                format!("{} ({none} as they are, {lz4} LZ4, {zstd} Zstandard)", self.stored_tiles)
                    + &saved(compression),
            ),
            ("bytes", format!("{} ({})", self.bytes, report::bytes(self.bytes))),
            ("  decoded", format!("{} ({})", self.raw_bytes, report::bytes(self.raw_bytes))),
            ("format", format!("version {}{aligned}", self.version)),
        ];
        let rows = rows.into_iter().flat_map(|row| match row.0 {
            "  absent" => [vec![row], self.sparse_levels()].concat(),
            _ => vec![row],
        });
        rows.collect()
    }

    /// A row for each level of which pages have no tile.
    fn sparse_levels(&self) -> Vec<(&'static str, String)> {
        let levels = self.pages_by_level.iter().zip(&self.tiles_by_level).enumerate();
        let sparse = levels.filter(|(_, (pages, tiles))| tiles < pages);
        let row = |(level, (pages, tiles))| ("", format!("level {level}: {tiles} tiles for {pages} pages"));
        sparse.map(row).collect()
    }
}

fn first_two([x, y, _]: [u32; 3]) -> [u32; 2] {
    [x, y]
}

fn hexadecimal(color: [u8; 4]) -> String {
    color.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn address_name(mode: AddressMode) -> &'static str {
    match mode {
        AddressMode::Clamp => "clamp",
        AddressMode::Wrap => "wrap",
        AddressMode::Mirror => "mirror",
        AddressMode::Border => "border",
    }
}
