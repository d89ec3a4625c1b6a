//! Of which containers a region can be replaced, by which images, and at what cost.

use std::sync::Arc;

use vastex_core::{Description, Dims, Geometry};

use super::error::ReplaceError;
use super::patch::Patch;
use super::region::{Placed, Region};
use super::spans::{Axis, Spans};
use super::{BATCH_BYTES, ReplaceOptions};
use crate::convert::Conversion;
use crate::filter::{Filter, LayerFilter, LevelsFrom};
use crate::layers::is_color;
use crate::readers::{ImageHeader, RowReader, in_srgb};
use crate::texel::texel_of_color;

/// How the levels of a texture are made again in one place.
pub(crate) struct Rules {
    pub(super) description: Arc<Description>,
    pub(super) filter: Filter,
    /// A texel of the border colour.
    pub(super) color: Vec<u8>,
    /// Bytes of a texel.
    pub(super) texel: usize,
    /// Whether the layer holds colours.
    is_color: bool,
}

impl Rules {
    /// Those of a texture whose levels the named filters made; an error says why it has none.
    pub(crate) fn new(description: &Arc<Description>, filters: &[String]) -> Result<Rules, String> {
        let geometry = &description.geometry;
        let [layer] = description.layers.as_slice() else {
            return Err(format!("it has {} layers", description.layers.len()));
        };
        if layer.format.is_compressed() {
            let what =
                "its layer is compressed in blocks, and the coarser levels need the texels from before that";
            return Err(what.into());
        }
        if geometry.dims() != Dims::D2 {
            return Err("it holds a volume".into());
        }
        if geometry.levels()[1..].iter().any(|level| level.factor != [2, 2, 1]) {
            return Err("its levels do not halve".into());
        }
        let [name] = filters else {
            return Err("it does not say how its levels were filtered".into());
        };
        let filter = name.parse::<LayerFilter>().ok().and_then(|filter| filter.for_format(layer.format).ok());
        let filter = filter
            .ok_or_else(|| format!("its levels were made by the filter {name:?}, which is not known"))?;
        if filter.from != LevelsFrom::Chain {
            let what = "and only levels made from the next finer one can be made again in one place";
            return Err(format!("its levels were made by the filter {name:?}, {what}"));
        }
        Ok(Rules {
            description: description.clone(),
            color: texel_of_color(layer.format, description.border_color),
            texel: layer.format.texel_bytes(),
            is_color: is_color(layer, Some(filter)),
            filter: Filter::new(filter, layer.format, 2),
        })
    }

    fn geometry(&self) -> &Geometry {
        &self.description.geometry
    }

    pub(super) fn axes(&self, level: u8) -> [Axis; 2] {
        [0, 1].map(|axis| Axis::new(self.geometry(), level, axis, self.filter.reach))
    }

    /// The image with its colours as the texture has them, if they are colours.
    pub(crate) fn colors_of(&self, image: Box<dyn RowReader>) -> Box<dyn RowReader> {
        if self.is_color { in_srgb(image) } else { image }
    }

    /// How the image becomes the texture's texels, and which of its level change; an error where it does not suit the texture.
    pub(crate) fn suits(
        &self,
        placed: &Placed<'_>,
        image: &ImageHeader,
    ) -> Result<(Conversion, Region), ReplaceError> {
        let held = self.description.layers[0].format;
        let conversion = Conversion::new(image, held, self.is_color).ok_or_else(|| ReplaceError::Format {
            path: placed.image.into(),
            image: image.format.to_string(),
            container: held.name(),
        })?;
        let (at, size) = (placed.at, [image.width, image.height]);
        let of_level = self.geometry().level(placed.level).size;
        let region = Region::new(at, size, [of_level[0], of_level[1]]);
        let outside = || ReplaceError::Outside {
            path: placed.image.into(),
            at,
            size,
            texture: [of_level[0], of_level[1]],
        };
        Ok((conversion, region.ok_or_else(outside)?))
    }

    /// The bytes that a replacement takes at most; an error where those are too many. `is_sparse` says whether pages may lack
    /// tiles.
    pub(crate) fn check_memory(
        &self,
        placed: &Placed<'_>,
        image: &ImageHeader,
        region: &Region,
        is_sparse: bool,
        options: &ReplaceOptions,
    ) -> Result<u64, ReplaceError> {
        /// What the index of the container takes for each page.
        const INDEX_BYTES: u64 = 64;
        /// Tiles of which one is made that gets texels of those beside it, and their ancestors.
        const JOINED_TILES: u64 = 12;
        let limit = options.memory_limit;
        let index = self.geometry().page_count().saturating_mul(INDEX_BYTES);
        let tile = self.description.tile_bytes();
        let threads = options.threads_used().min((BATCH_BYTES / tile).max(1)) as u64;
        let tiles = 2 * (BATCH_BYTES.max(tile) as u64);
        let joined = if is_sparse { threads.saturating_mul(JOINED_TILES * tile as u64) } else { 0 };
        // The level above it has about a quarter.
        let patch = Patch::bytes_of(&self.held(placed.level, &region.changed), self.texel);
        let needed = [patch, patch / 2, index, tiles, joined, image.memory];
        let needed = needed.iter().fold(0u64, |a, &b| a.saturating_add(b));
        match needed <= limit {
            true => Ok(needed),
            false => Err(ReplaceError::Memory { path: placed.image.into(), needed, limit }),
        }
    }

    /// The texels of a level that are held where `changed` ones change: those of which the next level is made.
    pub(super) fn held(&self, level: u8, changed: &[Spans; 2]) -> [Spans; 2] {
        let axes = self.axes(level);
        match level == self.geometry().coarsest() {
            true => changed.clone(),
            false => [0, 1].map(|a| axes[a].finer(&axes[a].coarser(&changed[a]))),
        }
    }
}
