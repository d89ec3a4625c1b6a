//! What a texture says at a point, asked on the CPU while the GPU draws it.

use super::Textures;
use crate::cpu::{CpuSample, CpuSampler, CpuStats};
use crate::ids::LayerId;

/// Samples on the CPU; returned by [`Textures::cpu`].
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
    /// The value of a layer at `uv`, `level` levels coarser than level 0, as `vastex_sample_level(id, uv,
    /// level)` gives it on the GPU, with the same filter and address modes, and across pages. `level` is used
    /// as it is: neither the texture's bias nor its pool's is added (add
    /// [`TextureRef::bias_eighths`](crate::TextureRef::bias_eighths), in eighths of a level, to match what
    /// the GPU shows).
    ///
    /// Never reads and never waits: the answer comes from the tiles of
    /// [`TextureMut::keep_for_cpu`](crate::TextureMut::keep_for_cpu), from the RAM cache
    /// ([`Settings::ram_cache_bytes`](crate::Settings::ram_cache_bytes)) or from the tail, whichever is
    /// finest, and [`CpuSample::level`] says how fine that is. A tile in the pool answers only if it is kept
    /// or still in the RAM cache; a tile seen before answers as long as the RAM cache has it. `None` if the
    /// texture was removed or has no such layer.
    ///
    /// Costs about a microsecond if decoded tiles are in memory; a tile that has to be decoded, once, costs
    /// as much as in the loader. Decoded tiles are held within
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

    /// A sampler for many points at once: tiles found for one point are reused for the next.
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
