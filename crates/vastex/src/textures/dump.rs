//! What is in the pools, and the names that textures have for people.

use std::sync::Arc;

use vastex_core::{TextureId, TextureUsage};

use super::Textures;
use crate::watch::{DumpedPool, DumpedTexture, LevelPages, PoolDump};

impl Textures {
    /// What is in the pools, by texture and level. Costs a visit of every page that has a state: for people and tools, not for each frame.
    pub fn dump_pool_usage(&self) -> PoolDump {
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
        let rule = self.levels(texture).unwrap_or_default();
        DumpedTexture {
            texture: texture.number(),
            name: self.name(texture).map(str::to_owned),
            pages,
            levels: levels.into_iter().map(|(level, pages)| LevelPages { level, pages }).collect(),
            finest: rule.finest,
            coarsest: rule.coarsest,
            bias: rule.bias,
        }
    }

    /// Gives a texture a name for people, in place of the one it had. Says whether there is such a texture.
    pub fn set_name(&mut self, texture: TextureId, name: impl Into<Arc<str>>) -> bool {
        let exists = self.paging.texture(texture).is_some();
        if exists {
            self.watch.set_name(texture, name.into());
        }
        exists
    }

    /// The name of a texture, if it was given one.
    pub fn name(&self, texture: TextureId) -> Option<&str> {
        self.watch.name(texture)
    }
}
