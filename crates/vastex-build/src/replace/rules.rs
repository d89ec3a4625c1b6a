//! Of which containers a region can be replaced, by which images, and at what cost.

use std::path::PathBuf;
use std::sync::Arc;

use vastex_core::{Description, Dims};

use super::error::ReplaceError;
use super::patch::Patch;
use super::region::{Placed, Region, Strip, strips};
use super::slice::LayerShape;
use super::spans::{Axis, Spans};
use super::{BATCH_BYTES, ReplaceOptions};
use crate::image::{ImageHeader, InputFault, Notice, Opened, RowReader, in_srgb, open_with_files_while};
use crate::progress::Progress;
use crate::texels::convert::Conversion;
use crate::texels::filter::{Filter, LayerFilter, LevelsFrom};
use crate::threads;
use crate::tile::{Findings, INDEX_BYTES};

/// What is known of a texture in which regions are replaced.
pub(crate) struct Rules {
    pub(super) description: Arc<Description>,
    /// Of all layers.
    pub(super) shapes: Vec<LayerShape>,
    /// The names of the layers' filters.
    filters: Vec<String>,
}

impl Rules {
    /// The rules of a texture whose levels the named filters made; an error says why it has none.
    pub(crate) fn new(description: &Arc<Description>, filters: &[String]) -> Result<Rules, String> {
        let geometry = &description.geometry;
        if geometry.dims() != Dims::D2 {
            return Err("it holds a volume".into());
        }
        if geometry.levels()[1..].iter().any(|level| level.factor != [2, 2, 1]) {
            return Err("its levels do not halve".into());
        }
        if filters.len() != description.layers.len() {
            return Err("it does not say how its levels were filtered".into());
        }
        let shapes = LayerShape::all(description);
        Ok(Rules { description: description.clone(), shapes, filters: filters.to_vec() })
    }

    /// How the levels of one layer are made again in one place; an error says why they cannot be.
    pub(crate) fn of_layer(&self, number: usize) -> Result<LayerRules, String> {
        let (shape, name) = (&self.shapes[number], &self.filters[number]);
        let format = shape.layer.format;
        let named = name.parse::<LayerFilter>().ok().and_then(|filter| filter.for_format(format).ok());
        let of = match self.shapes.len() {
            1 => "its levels".to_string(),
            _ => format!("the levels of its layer {:?}", shape.layer.name),
        };
        let named =
            named.ok_or_else(|| format!("{of} were made by the filter {name:?}, which is not known"))?;
        if named.from != LevelsFrom::Chain {
            let what = "and only levels made from the next finer one can be made again in one place";
            return Err(format!("{of} were made by the filter {name:?}, {what}"));
        }
        Ok(LayerRules {
            number,
            shape: shape.clone(),
            is_color: LayerFilter::is_of_color(Some(named), &shape.layer),
            filter: Filter::new(named, format.decoded(), 2),
            named,
        })
    }

    /// Bytes of the texels of a tile.
    pub(super) fn tile_texel_bytes(&self) -> usize {
        self.shapes.iter().map(LayerShape::texel_bytes).sum::<usize>().max(1)
    }

    /// The bytes that replacing takes at most with these images, and how many pieces of each are decoded
    /// ahead, none where those would be too many bytes; an error where there are too many without them.
    /// `is_sparse` says whether pages may lack tiles.
    pub(crate) fn check_memory(
        &self,
        images: &[OpenImage<'_>],
        is_sparse: bool,
        options: &ReplaceOptions,
    ) -> Result<(u64, usize), ReplaceError> {
        /// Tiles of which one is made that gets texels of those beside it, and their ancestors.
        const JOINED_TILES: u64 = 12;
        /// Pieces that are decoded ahead, for each thread.
        const PIECES: usize = 2;
        let limit = options.memory_limit;
        let index = self.description.geometry.page_count().saturating_mul(INDEX_BYTES);
        let tile = self.tile_texel_bytes() + self.description.tile_bytes();
        let threads = threads::count(options.threads).min((BATCH_BYTES / tile).max(1)) as u64;
        let tiles = 2 * (BATCH_BYTES.max(tile) as u64);
        let joined = if is_sparse { threads.saturating_mul(JOINED_TILES * tile as u64) } else { 0 };
        let of_image = |image: &OpenImage<'_>| {
            let held = image.rules.held(image.placed.level, &image.region().changed);
            let patch = Patch::bytes_of(&held, image.rules.shape.texel());
            // The level above it has about a quarter.
            patch.saturating_add(patch / 2).saturating_add(image.header().memory)
        };
        let needed =
            images.iter().map(of_image).chain([index, tiles, joined]).fold(0u64, u64::saturating_add);
        let pieces = PIECES * threads::count(options.threads);
        // Images are read one after the other.
        let ahead = images.iter().map(|image| image.reader.memory_ahead(pieces)).max().unwrap_or(0);
        let largest = images.iter().max_by_key(|image| of_image(image));
        match needed.saturating_add(ahead) <= limit {
            true => Ok((needed.saturating_add(ahead), pieces)),
            false if needed <= limit => Ok((needed, 0)),
            false => {
                let path = largest.map(|image| image.placed.image.into()).unwrap_or_default();
                Err(ReplaceError::Memory { path, needed, limit })
            }
        }
    }
}

/// How the levels of one layer are made again in one place.
pub(crate) struct LayerRules {
    pub(super) number: usize,
    pub(super) shape: LayerShape,
    pub(super) filter: Filter,
    /// The filter by its name.
    pub(super) named: LayerFilter,
    /// True if the layer holds colours.
    is_color: bool,
}

impl LayerRules {
    pub(super) fn axes(&self, level: u8) -> [Axis; 2] {
        self.shape.axes(level, self.filter.reach)
    }

    /// The texels of a level that are held where `changed` ones change: those of which the next level is
    /// made.
    pub(super) fn held(&self, level: u8, changed: &[Spans; 2]) -> [Spans; 2] {
        let axes = self.axes(level);
        match level == self.shape.geometry.coarsest() {
            true => changed.clone(),
            false => [0, 1].map(|a| axes[a].finer(&axes[a].coarser(&changed[a]))),
        }
    }
}

/// An image that suits its place in a layer.
pub(crate) struct OpenImage<'a> {
    pub(super) placed: Placed<'a>,
    pub(super) rules: LayerRules,
    pub(super) reader: Box<dyn RowReader>,
    /// All that is read of it.
    pub(crate) files: Vec<PathBuf>,
    pub(super) conversion: Conversion,
    /// Columns and rows, and where they lie.
    pub(super) strips: [Vec<Strip>; 2],
}

impl<'a> OpenImage<'a> {
    /// Opens the image as long as `progress` lets it; an error where it cannot be read or does not suit the
    /// layer.
    pub(crate) fn open(
        rules: LayerRules,
        placed: Placed<'a>,
        progress: &dyn Progress,
    ) -> Result<OpenImage<'a>, ReplaceError> {
        let path = || placed.image.to_path_buf();
        let opened = open_with_files_while(placed.image, &|| progress.opening());
        let Opened { reader, files } = opened.map_err(|fault| match fault {
            InputFault::BrokenOff => ReplaceError::Cancelled,
            fault => ReplaceError::Image { path: path(), fault },
        })?;
        let reader = if rules.is_color { in_srgb(reader) } else { reader };
        let (image, held) = (reader.header(), rules.shape.layer.format);
        let conversion = Conversion::new(image, held, rules.is_color).ok_or_else(|| {
            ReplaceError::Format { path: path(), image: image.format.to_string(), container: held.name() }
        })?;
        let (at, size) = (placed.at, [image.width, image.height]);
        let (geometry, scale) = (&rules.shape.geometry, rules.shape.layer.scale);
        let of_level = geometry.level(placed.level).size;
        let strips = [0, 1].map(|a| strips(at[a], size[a], of_level[a], geometry.address()[a]));
        let [Some(columns), Some(rows)] = strips else {
            let of = match scale {
                1 => "the texture".into(),
                scale => format!("the layer {:?} (1/{scale} of the texture)", rules.shape.layer.name),
            };
            return Err(ReplaceError::Outside {
                path: path(),
                at,
                size,
                of,
                texture: [of_level[0], of_level[1]],
            });
        };
        Ok(OpenImage { placed, rules, reader, files, conversion, strips: [columns, rows] })
    }

    pub(crate) fn header(&self) -> &ImageHeader {
        self.reader.header()
    }

    /// What there is to say of it when its texels are read.
    pub(super) fn notices(&self, findings: &Findings) -> Vec<Notice> {
        let mut notices = self.header().notices_of_layer();
        notices.extend(self.conversion.notices());
        notices.extend(findings.notices(self.rules.number, self.rules.shape.layer.format));
        notices
    }

    /// What it changes of its own level.
    pub(super) fn region(&self) -> Region {
        Region::new(&self.strips)
    }
}
