//! What a texture says at a point, asked on the CPU while the GPU draws it.

use super::Textures;
use crate::cpu::{CpuSample, CpuSampler, CpuStats};
use crate::ids::LayerId;

/// Samples on the CPU; [`Textures::cpu`] gives it.
#[derive(Clone, Copy)]
pub struct Cpu<'a> {
    textures: &'a Textures,
}

impl Textures {
    /// Samples on the CPU: what a layer says at a point.
    pub fn cpu(&self) -> Cpu<'_> {
        Cpu { textures: self }
    }
}

impl<'a> Cpu<'a> {
    /// What a layer says at `uv`, `level` levels coarser than level 0, as `vastex_sample_level(id, uv,
    /// level)` does on the GPU, with the same filter and address modes, and across pages. The level is taken
    /// as it is: neither the texture's bias nor its pool's is added
    /// (add [`TextureRef::bias_eighths`](crate::TextureRef::bias_eighths), in eighths of a level, to match what
    /// the GPU shows).
    ///
    /// It never reads nor waits: the answer comes from the tiles of
    /// [`TextureMut::keep_for_cpu`](crate::TextureMut::keep_for_cpu), from the RAM cache
    /// ([`Settings::ram_cache_bytes`](crate::Settings::ram_cache_bytes)) or from the tail, whichever is
    /// finest, and [`CpuSample::level`] says how fine that is. A tile in the pool answers if it is kept, or
    /// has not left the RAM cache; one that was seen before answers as long as the RAM cache has it. `None`
    /// if the texture was removed or has no such layer.
    ///
    /// Costs about a microsecond where decoded tiles are at hand; a tile that has to be decoded, once, as
    /// much as the loader takes for it. Decoded tiles are held within
    /// [`Settings::cpu_cache_bytes`](crate::Settings::cpu_cache_bytes). For many points see [`Cpu::sampler`].
    ///
    /// ```no_run
    /// # fn walk(textures: &vastex::Textures, island: vastex::TextureId, uv: [f32; 2]) -> Option<()> {
    /// let ground = textures.cpu().sample(textures.texture(island).ok()?.layer("height")?, uv, 0.0)?;
    /// let metres = ground.value[0] * 65535.0 - 11_000.0;
    /// if ground.level > 2.0 { /* too coarse to stand on: it is on its way, or worth a prefetch */ }
    /// # let _ = metres;
    /// # Some(()) }
    /// ```
    pub fn sample(&self, layer: impl Into<LayerId>, uv: [f32; 2], level: f32) -> Option<CpuSample> {
        Some(self.sampler(layer)?.sample(uv, level))
    }

    /// For many points at once: what is found for one is at hand for the next.
    pub fn sampler(&self, layer: impl Into<LayerId>) -> Option<CpuSampler<'a>> {
        let layer = layer.into();
        let sampling = self.textures.gpu.sampling_of(layer)?;
        self.textures.cpu.sampler(&self.textures.paging, layer, sampling.filter)
    }

    /// What queries on the CPU have found so far, and what is held for them.
    pub fn stats(&self) -> CpuStats {
        self.textures.cpu.stats()
    }
}
