//! Sampling and feedback on the CPU: queries that are answered from main memory, textures that are read for
//! it, and views without a GPU.

mod feedback;
mod sample;
#[cfg(not(target_family = "wasm"))]
mod texture;
mod tiles;

use vastex_core::{Description, Geometry, PoolId, Region, SlotMove, TextureNumber, Upload};

use crate::ids::LayerId;
use crate::paging::Paging;
use crate::settings::Filter;
pub use feedback::CpuFeedback;
pub use sample::{CpuSample, CpuSampler};
#[cfg(not(target_family = "wasm"))]
pub use texture::CpuTexture;
pub use tiles::CpuStats;
use tiles::CpuTiles;

/// What queries on the CPU are answered from.
#[derive(Debug)]
pub(crate) struct CpuSide {
    tiles: CpuTiles,
}

impl CpuSide {
    /// Decoded tiles are held within so many bytes.
    pub(crate) fn new(budget: u64) -> CpuSide {
        CpuSide { tiles: CpuTiles::new(budget) }
    }

    /// Answers for a layer that is blended by `filter`; `None` if there is no such layer.
    pub(crate) fn sampler<'a>(
        &'a self,
        paging: &'a Paging,
        layer: LayerId,
        filter: Filter,
    ) -> Option<CpuSampler<'a>> {
        let state = paging.texture(layer.number())?;
        state.source.description().layers.get(layer.index())?;
        Some(CpuSampler::new(&self.tiles, paging, state, layer, filter))
    }

    /// From now on, keeps what comes of a layer; or no longer.
    pub(crate) fn keep(&mut self, layer: LayerId, keep: bool) {
        self.tiles.keep(layer, keep);
    }

    pub(crate) fn stats(&self) -> CpuStats {
        self.tiles.stats()
    }

    /// A tile goes to the GPU.
    pub(crate) fn uploaded(&mut self, pool: PoolId, upload: &Upload, paging: &Paging) {
        if let Some(state) = paging.texture(upload.page.texture()) {
            let held: &Description = state.source.description();
            let pool_of = |texture| paging.pager().pool_of(texture);
            self.tiles.uploaded((pool, upload.slot), held, &upload.bytes, pool_of);
        }
    }

    /// Tiles of a pool are in other slots now, and those that are not named are in none.
    pub(crate) fn moved(&mut self, pool: PoolId, moves: &[SlotMove]) {
        self.tiles.moved(pool, moves);
    }

    /// The pools are empty.
    pub(crate) fn tiles_lost(&mut self) {
        self.tiles.tiles_lost();
    }

    /// The content of a region has changed.
    pub(crate) fn forget(&self, texture: TextureNumber, geometry: &Geometry, region: &Region) {
        self.tiles.forget(texture, geometry, region);
    }

    /// A texture is gone.
    pub(crate) fn remove(&mut self, texture: TextureNumber) {
        self.tiles.remove(texture);
    }
}
