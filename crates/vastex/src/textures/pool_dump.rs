//! What is in the pools, for people.

use vastex_core::TextureUsage;

use super::Textures;
use crate::watch::{DumpedPool, DumpedTexture, LevelPages, PoolDump};

impl Textures {
    /// What is in the pools, by texture and level.
    pub(super) fn dump_pool_usage(&self) -> PoolDump {
        let dumped = self.gpu.pools().iter().zip(self.paging.pager().pools()).map(|(pool, pager)| {
            let usage = pager.usage();
            DumpedPool {
                pool: usage.pool.number(),
                tiles: pool.tiles.to_string(),
                bytes: pool.bytes(),
                slots: usage.slots,
                occupied: usage.occupied,
                pages: usage.pages,
                locked: usage.locked,
                bias: f64::from(usage.bias_eighths) / 8.0,
                textures: usage.textures.into_iter().map(|texture| self.dumped(texture)).collect(),
            }
        });
        PoolDump { pools: dumped.collect() }
    }

    fn dumped(&self, usage: TextureUsage) -> DumpedTexture {
        let TextureUsage { texture, pages, levels } = usage;
        let rule = self.paging.pager().levels(texture).unwrap_or_default();
        DumpedTexture {
            texture: texture.number(),
            name: self.watch.name(texture).map(str::to_owned),
            pages,
            levels: levels.into_iter().map(|(level, pages)| LevelPages { level, pages }).collect(),
            finest: rule.finest,
            coarsest: rule.coarsest,
            bias: rule.bias,
        }
    }
}
