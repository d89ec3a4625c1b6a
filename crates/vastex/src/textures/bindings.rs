//! What Vastex binds, as entries: for hosts whose bind groups have others beside them, or that keep bind
//! groups.

use vastex_wgpu::Kinds;

use super::{Textures, unknown};
use crate::error::Error;
use crate::ids::Sampled;

/// What Vastex binds, entry by entry; [`Textures::bindings`] gives it.
#[derive(Clone, Copy)]
pub struct Bindings<'a> {
    textures: &'a Textures,
}

impl Textures {
    /// What is bound, for hosts that merge it into bind groups of their own, or keep bind groups.
    pub fn bindings(&self) -> Bindings<'_> {
        Bindings { textures: self }
    }
}

impl<'a> Bindings<'a> {
    /// What [`Textures::bind_group_layout`] has, from the first binding of
    /// [`Settings::binding`](crate::Settings::binding) on, for a layout of the application's own that has
    /// other entries beside these.
    pub fn layout_entries(&self, kinds: &Kinds) -> Vec<wgpu::BindGroupLayoutEntry> {
        self.textures.gpu.layout_entries(kinds)
    }

    /// What [`Textures::bind_group`] binds, for a bind group of the application's own, whose layout has
    /// [`Bindings::layout_entries`]. They are others where [`Bindings::revision`] is another number. Fails
    /// where there is no such texture or group.
    pub fn entries(&self, sampled: impl Into<Sampled>) -> Result<Vec<wgpu::BindGroupEntry<'a>>, Error> {
        let sampled = sampled.into();
        self.textures.gpu.entries(sampled).ok_or_else(|| unknown(sampled))
    }

    /// A number that is another wherever the [bind group](Textures::bind_group) or the
    /// [entries](Bindings::entries) are: to be compared in each frame, after the update, by whoever keeps
    /// one. Fails where there is no such texture or group.
    pub fn revision(&self, sampled: impl Into<Sampled>) -> Result<u64, Error> {
        let sampled = sampled.into();
        self.textures.gpu.bind_groups().revision(sampled).ok_or_else(|| unknown(sampled))
    }

    /// The ids by which shaders know what is sampled: of a layer one, that of its texture
    /// ([`Textures::shader_id`]); of a group that of the whole, then those of its members, in the order of
    /// `VastexIds`. Fails where there is no such texture or group.
    pub fn ids(&self, sampled: impl Into<Sampled>) -> Result<Vec<u32>, Error> {
        let sampled = sampled.into();
        self.textures.gpu.ids(sampled).ok_or_else(|| unknown(sampled))
    }
}
