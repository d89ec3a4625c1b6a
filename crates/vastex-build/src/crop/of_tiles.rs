//! Regions of a texture: the texels of one layer of its tiles, without their borders.

use std::sync::Arc;

use vastex_core::{LayerFormat, PagePos};
use vastex_tiles::TileSource;

use super::CropError;
use super::stored::{Stored, copy, parts, up_to_next};
use crate::image::Number;
use crate::progress::Progress;
use crate::threads;
use crate::tile::LayerOf;

/// Bytes of decoded tiles that are held at once, where that is at least one tile.
const TILES_BYTES: u64 = 64 << 20;

pub(super) struct OfTiles {
    tiles: Arc<dyn TileSource>,
    layer: LayerOf,
    level: u8,
}

impl OfTiles {
    pub(super) fn new(tiles: Arc<dyn TileSource>, layer: LayerOf, level: u32) -> Result<OfTiles, CropError> {
        let coarsest = layer.geometry().coarsest();
        match u8::try_from(level).ok().filter(|level| *level <= coarsest) {
            Some(level) => Ok(OfTiles { tiles, layer, level }),
            None => Err(CropError::Level { level, there: format!("there are levels 0 to {coarsest}") }),
        }
    }

    /// Columns and rows of what lies in one tile: a page, or the whole of a level of the tail.
    fn cell(&self) -> [u32; 2] {
        let geometry = self.layer.geometry();
        if self.level >= geometry.tail().first_level() {
            return self.size();
        }
        let [width, height, _] = geometry.page();
        [width, height]
    }
}

impl Stored for OfTiles {
    fn size(&self) -> [u32; 2] {
        let [width, height, _] = self.layer.geometry().level(self.level).size;
        [width, height]
    }

    fn number(&self) -> Number {
        match self.layer.format() {
            LayerFormat::R16 | LayerFormat::Rgba16 => Number::U16,
            LayerFormat::R16Float | LayerFormat::Rgba16Float => Number::F16,
            LayerFormat::R32Float => Number::F32,
            _ => Number::U8,
        }
    }

    fn channels(&self) -> u16 {
        self.layer.format().channels() as u16
    }

    fn rows_together(&self, row: u32) -> u32 {
        up_to_next(row, self.cell()[1])
    }

    fn read(
        &mut self,
        first: [u32; 2],
        size: [u32; 2],
        texels: &mut [u8],
        _: &dyn Progress,
    ) -> Result<(), CropError> {
        let OfTiles { tiles, layer, level } = &*self;
        let (geometry, texel) = (layer.geometry(), layer.format().texel_bytes());
        let is_tail = *level >= geometry.tail().first_level();
        let [x, y, _] = match is_tail {
            true => geometry.tile_texel_from_tail_texel(*level, [0; 3]),
            false => geometry.tile_texel_from_page_texel([0; 3]),
        };
        let at_once = (TILES_BYTES / (geometry.tile_texels() * texel as u64).max(1)).clamp(1, 256) as usize;
        for some in parts(first, size, self.cell()).chunks(at_once) {
            let page = |[x, y]: [u32; 2]| match is_tail {
                true => geometry.tail_pos(),
                false => PagePos::new_2d(*level, x, y),
            };
            let decoded = threads::try_map(some, |part| layer.texels(&**tiles, page(part.cell)))?;
            for (part, tile) in some.iter().zip(decoded) {
                copy(part, &tile, geometry.tile()[0] as usize, [x, y], texels, size[0], texel);
            }
        }
        Ok(())
    }
}
