//! `vastex info` of what is shown as it is and is neither a container nor one file of an image: directories
//! of tiles, and planets.

use std::path::Path;
use std::sync::Arc;

use anyhow::Result;
use serde::Serialize;
use vastex::{Layer, TileSource};

use crate::args::CacheArgs;
use crate::open::{self, Lies, OpenImage};

/// What `--json` prints of it.
#[derive(Serialize)]
pub(super) struct SourceSummary {
    /// `tiles` or `planet`.
    kind: &'static str,
    /// Width and height in texels.
    size: [u32; 2],
    /// How many there are, and width and height of each in texels, the finest first.
    levels: usize,
    level_sizes: Vec<[u32; 2]>,
    layers: Vec<LayerSummary>,
    /// Texels of a page along a side, and of border on each side, as it is shown.
    page: u32,
    border: u32,
    pages: u64,
}

#[derive(Serialize)]
struct LayerSummary {
    name: String,
    format: &'static str,
}

/// Of a directory of tiles or a planet; `None` if the words mean something else. An image that a planet names
/// is built into the cache.
pub(super) fn of(source: &Path, cache: &CacheArgs) -> Result<Option<(Arc<dyn TileSource>, SourceSummary)>> {
    let (kind, image) = match open::what_lies_at(source)? {
        Lies::Generated => ("planet", Some(OpenImage { cache, wraps: true, observer: &() })),
        Lies::Other if open::is_directory_of_tiles(source) => ("tiles", None),
        Lies::Other | Lies::Container => return Ok(None),
    };
    let tiles = open::open_tiles(source, false, image)?;
    let described = tiles.description();
    let geometry = &described.geometry;
    let two = |[width, height, _]: [u32; 3]| [width, height];
    let layer = |layer: &Layer| LayerSummary { name: layer.name.clone(), format: layer.format.name() };
    let summary = SourceSummary {
        kind,
        size: two(geometry.size()),
        levels: geometry.levels().len(),
        level_sizes: geometry.levels().iter().map(|level| two(level.size)).collect(),
        layers: described.layers.iter().map(layer).collect(),
        page: geometry.page()[0],
        border: geometry.border()[0],
        pages: geometry.page_count(),
    };
    Ok(Some((tiles, summary)))
}

impl SourceSummary {
    pub(super) fn text(&self) -> String {
        self.rows().map(|(name, value)| format!("  {name:<12}{value}")).join("\n")
    }

    /// What there is to say, by names.
    pub(super) fn rows(&self) -> [(&'static str, String); 5] {
        let SourceSummary { kind, size: [width, height], levels, page, border, pages, .. } = self;
        let layers: Vec<String> =
            self.layers.iter().map(|LayerSummary { name, format }| format!("{name} ({format})")).collect();
        let made = match *kind {
            "planet" => "made up while it is looked at",
            _ => "a directory of tiles, shown as it is",
        };
        [
            ("size", format!("{width} x {height} texels")),
            ("levels", levels.to_string()),
            ("layers", layers.join(", ")),
            ("page", format!("{page} texels, border {border}; {pages} pages")),
            ("source", made.to_owned()),
        ]
    }
}
