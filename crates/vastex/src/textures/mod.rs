//! The textures of one device, as an application has them: four parts, joined here and in the files of this
//! folder.
//!
//! What happens each frame is `frame`'s business. Each part keeps its state to itself, so a method here is a
//! call or two. What few applications need, or few frames, is not a method of [`Textures`] but of a handle
//! that one of its methods gives.

mod add;
mod ahead;
mod bindings;
mod cpu;
mod feedback;
mod frame;
mod groups;
mod inspect;
mod memory;
mod pixels;
mod pool_dump;
mod shaders;
mod stats;
mod texture;
mod trace;
mod views;

use vastex_core::{PoolId, TextureNumber};

use crate::cpu::CpuSide;
use crate::error::Error;
use crate::gpu::Gpu;
use crate::ids::{Sampled, TextureId};
use crate::paging::Paging;
use crate::settings::Settings;
use crate::watch::Watch;
pub use add::AddError;
pub use ahead::Ahead;
pub use bindings::Bindings;
pub use cpu::Cpu;
pub use inspect::Inspect;
pub use memory::Memory;
pub use pixels::Pixels;
pub use texture::{TextureMut, TextureRef};
pub use trace::TraceControl;
pub use views::{ViewMut, ViewRef, ViewSettings};

/// The virtual textures of a device, and the loop that keeps their pools filled.
///
/// Textures share a pool whose tiles have the same size, whose layers have the same formats and resolutions,
/// whose page tables lie alike ([`TableChoice`](crate::TableChoice)), and whose pages all have sides that are
/// powers of two, or none of them.
pub struct Textures {
    settings: Settings,
    /// What is wanted and loaded.
    paging: Paging,
    /// What is on the GPU.
    gpu: Gpu,
    /// What is kept for people and tools.
    watch: Watch,
    /// What the CPU samples.
    cpu: CpuSide,
}

impl Textures {
    /// No textures yet, on the application's own device. Fails where the device lacks what the settings ask
    /// for, and in a browser for [`Pace::LockStep`](crate::Pace::LockStep).
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue, settings: Settings) -> Result<Textures, Error> {
        Ok(Textures {
            paging: Paging::new(&settings)?,
            gpu: Gpu::new(device, queue, &settings)?,
            watch: Watch::new(settings.telemetry_frames),
            cpu: CpuSide::new(settings.cpu_cache_bytes),
            settings,
        })
    }

    /// The number of a texture that there is.
    fn number(&self, texture: TextureId) -> Option<TextureNumber> {
        self.gpu.has(texture).then(|| texture.number())
    }

    /// The pool of who has a number.
    fn pool_of(&self, number: TextureNumber) -> Option<PoolId> {
        self.paging.pager().pool_of(number)
    }

    /// The texture that has a number, if there is one.
    fn texture_of(&self, number: TextureNumber) -> Option<TextureId> {
        self.paging.texture(number)?;
        Some(TextureId::new(number, self.gpu.generation(number)))
    }
}

/// Why there is nothing of what is sampled.
fn unknown(sampled: Sampled) -> Error {
    match sampled {
        Sampled::Layer(layer) => Error::NoTexture(layer.texture()),
        Sampled::Group(group) => Error::NoGroup(group),
    }
}
