//! Sampling on the CPU, from a source, by the same arithmetic as on the GPU.
//!
//! Every page counts as resident; a tile is read and decoded when it is first touched, and kept. For what a
//! GPU cannot do (a picture beyond a device's limits) and for what tests compare with.

use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use bytes::Bytes;
use vastex_core::{
    ChangeRule, LevelRule, PageId, PagePos, Slot, TableChange, TableEntry, TableImage, TextureNumber,
};
use vastex_tiles::{TileSource, decode_layer};
use vastex_wgpu::twins::{Sampler, Texture};

use crate::error::Error;
use crate::settings::Filter;

/// One layer of a texture, to be sampled on the CPU. Costs 4 bytes of table and a few more for each page.
pub struct CpuTexture {
    source: Arc<dyn TileSource>,
    /// All pages; each has the slot of its index.
    pages: Vec<PagePos>,
    /// Texels of the layer.
    tiles: Vec<OnceLock<Bytes>>,
    layer: usize,
    table: TableImage,
    filter: Filter,
    bias_eighths: u16,
    rule: LevelRule,
    failed: Mutex<Option<Error>>,
}

/// The number that the texture has in its own table; nobody else sees it.
const NUMBER: Option<TextureNumber> = TextureNumber::new(0);

impl CpuTexture {
    /// Layer number `layer` of a texture, which exists, at a mip bias in eighths of a level. Fails where the
    /// texture has more pages than [`CpuTexture::MOST_PAGES`].
    pub fn new(
        source: Arc<dyn TileSource>,
        layer: usize,
        filter: Filter,
        bias_eighths: u16,
    ) -> Result<CpuTexture, Error> {
        let description = source.description().clone();
        let geometry = &description.geometry;
        if geometry.page_count() > CpuTexture::MOST_PAGES {
            let (pages, most) = (geometry.page_count(), CpuTexture::MOST_PAGES);
            return Err(Error::TooManyPages { pages, most });
        }
        let pages: Vec<PagePos> = geometry.pages().collect();
        let mut table = TableImage::new(geometry, Slot::new(0)); // the tail comes first
        let is_present = |pos| source.present().is_none_or(|present| present.contains(pos));
        for (slot, &pos) in (0..).zip(&pages).skip(1).filter(|(_, pos)| is_present(**pos)) {
            let Some(Ok(page)) = NUMBER.map(|number| PageId::new(number, geometry.dims(), pos)) else {
                continue;
            };
            let entry = TableEntry::new(pos.level, Slot::new(slot));
            table.apply(geometry, &TableChange { page, rule: ChangeRule::Coarser, entry });
        }
        let tiles = pages.iter().map(|_| OnceLock::new()).collect();
        Ok(CpuTexture {
            rule: LevelRule::default().within(&description.geometry),
            source,
            pages,
            tiles,
            layer,
            table,
            filter,
            bias_eighths,
            failed: Mutex::default(),
        })
    }

    /// Pages that a texture on the CPU lists at most, of 60 bytes each.
    pub const MOST_PAGES: u64 = 1 << 24;

    /// This texture with levels chosen by another rule.
    pub fn with_levels(mut self, rule: LevelRule) -> CpuTexture {
        self.rule = rule.within(&self.source.description().geometry);
        self
    }

    /// The colour at `uv`, from gradients of uv along one pixel; linear, 0 to 1 but for floats. Fails if a
    /// tile cannot be read.
    pub fn sample_grad(&self, uv: [f32; 2], ddx: [f32; 2], ddy: [f32; 2]) -> Result<[f32; 4], Error> {
        let description = self.source.description();
        let number = NUMBER.ok_or(Error::TailPending)?;
        let mut texture = Texture::new(&description.geometry, &self.table, number);
        let layer = &description.layers[self.layer];
        (texture.rule, texture.pool_bias, texture.layer_scale) = (self.rule, self.bias_eighths, layer.scale);
        texture.filter = self.filter;
        let tile = |slot: Slot| self.tile(slot);
        let sampler = Sampler { texture, format: layer.format, tile: &tile };
        let colour = sampler.sample_grad(uv, ddx, ddy);
        match self.failed.lock().unwrap_or_else(PoisonError::into_inner).take() {
            None => Ok(colour),
            Some(error) => Err(error),
        }
    }

    fn tile(&self, slot: Slot) -> &[u8] {
        let index = slot.index() as usize;
        self.tiles[index].get_or_init(|| {
            self.read(self.pages[index]).unwrap_or_else(|error| {
                *self.failed.lock().unwrap_or_else(PoisonError::into_inner) = Some(error);
                let (description, layer) =
                    (self.source.description(), &self.source.description().layers[self.layer]);
                let [width, height, _] = description.layer_tile(layer);
                Bytes::from(vec![0; width as usize * height as usize * layer.format.texel_bytes()])
            })
        })
    }

    fn read(&self, pos: PagePos) -> Result<Bytes, Error> {
        let tile = pollster::block_on(self.source.read(pos)).map_err(Error::Tile)?;
        let description = self.source.description();
        let bytes = tile.decode(description).map_err(|error| Error::TileDamaged { pos, error })?;
        Ok(decode_layer(description, self.layer, &bytes))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vastex_tiles::{PlanetImage, PlanetSource};

    #[test]
    fn a_texture_without_end_is_refused() {
        let image = || PlanetImage { size: [2, 1], texels: vec![[90, 80, 70, 255]; 2] };
        let texture = |bits| {
            let planet = PlanetSource::new(image(), bits).unwrap();
            CpuTexture::new(Arc::new(planet), 0, Filter::Trilinear, 0)
        };
        assert!(texture(12).is_ok());
        let Err(Error::TooManyPages { pages, most: CpuTexture::MOST_PAGES }) = texture(31) else {
            panic!("2^31 texels are accepted");
        };
        assert!(pages > 1 << 46);
    }
}
