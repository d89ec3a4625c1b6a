//! What a texture says at a point, asked on the CPU while the GPU draws it.

use super::Textures;
use crate::cpu::{CpuSample, CpuSampler, CpuStats};
use crate::sampled::LayerId;

impl Textures {
    /// What a layer says at `uv`, `level` levels coarser than level 0, as `vastex_sample_level(uv, level)` does on the GPU, with the same
    /// filter and address modes, and across pages. The level is taken as it is: neither the texture's bias nor its pool's is
    /// added ([`Textures::bias_eighths`] tells the latter, for who wants what is drawn).
    ///
    /// It never reads nor waits: the answer comes from the tiles of [`Textures::keep_for_cpu`], from the RAM cache
    /// ([`crate::Settings::ram_cache_bytes`]) or from the tail, whichever is finest, and [`CpuSample::level`] says how fine that is. A
    /// tile in the pool answers if it is kept, or has not left the RAM cache; one that was seen before answers as long as
    /// the RAM cache has it. Nothing where the texture was removed or has no such layer.
    ///
    /// Costs about a microsecond where decoded tiles are at hand; a tile that has to be decoded, once, as much as
    /// the loader takes for it. Decoded tiles are held within [`crate::Settings::cpu_cache_bytes`]. For many points see
    /// [`Textures::cpu_sampler`].
    ///
    /// ```no_run
    /// # fn walk(textures: &vastex::Textures, island: vastex::TextureId, uv: [f32; 2]) -> Option<()> {
    /// let ground = textures.sample_cpu(textures.layer(island, "height")?, uv, 0.0)?;
    /// let metres = ground.value[0] * 65535.0 - 11_000.0;
    /// if ground.level > 2.0 { /* too coarse to stand on: it is on its way, or worth a prefetch */ }
    /// # let _ = metres;
    /// # Some(()) }
    /// ```
    pub fn sample_cpu(&self, layer: impl Into<LayerId>, uv: [f32; 2], level: f32) -> Option<CpuSample> {
        Some(self.cpu_sampler(layer)?.sample(uv, level))
    }

    /// For many points at once: what is found for one is at hand for the next.
    pub fn cpu_sampler(&self, layer: impl Into<LayerId>) -> Option<CpuSampler<'_>> {
        let layer = layer.into();
        self.cpu.sampler(&self.paging, layer, || self.gpu.sampling_of(layer).filter)
    }

    /// Keeps the layer's texels of every tile in the pool in main memory too, decoded, so that what can be seen can be asked for,
    /// whatever the RAM cache still has; or no longer. Counts for tiles that come from now on, so it is best said when the texture
    /// is added. Costs at most the layer's part of the pool once more, and a copy of each tile that is uploaded. Says
    /// whether there is such a layer.
    pub fn keep_for_cpu(&mut self, layer: impl Into<LayerId>, keep: bool) -> bool {
        let layer = layer.into();
        let exists = self.cpu_sampler(layer).is_some();
        if exists {
            self.cpu.keep(layer, keep);
        }
        exists
    }

    /// What queries on the CPU have found so far, and what is held for them.
    pub fn cpu_stats(&self) -> CpuStats {
        self.cpu.stats()
    }
}
