//! What Vastex binds, as entries: for hosts whose bind groups have others beside them, or that keep bind
//! groups.

use vastex_wgpu::Kinds;

use super::{Textures, unknown};
use crate::error::Error;
use crate::ids::Sampled;

/// What Vastex binds, entry by entry; returned by [`Textures::bindings`].
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
    /// The entries of [`Textures::bind_group_layout`], numbered from the first binding of
    /// [`Settings::binding`](crate::Settings::binding) on, for a layout of the application's own that has
    /// other entries beside these.
    pub fn layout_entries(&self, kinds: &Kinds) -> Vec<wgpu::BindGroupLayoutEntry> {
        self.textures.gpu.layout_entries(kinds)
    }

    /// The entries of [`Textures::bind_group`], for a bind group of the application's own, whose layout has
    /// [`Bindings::layout_entries`]. They change whenever [`Bindings::revision`] does. Fails if there is no
    /// such texture or group.
    pub fn entries(&self, sampled: impl Into<Sampled>) -> Result<Vec<wgpu::BindGroupEntry<'a>>, Error> {
        let sampled = sampled.into();
        self.textures.gpu.entries(sampled).ok_or_else(|| unknown(sampled))
    }

    /// A number that changes whenever the [bind group](Textures::bind_group) or the
    /// [entries](Bindings::entries) do: whoever keeps one compares it in each frame, after the update. Fails
    /// if there is no such texture or group.
    pub fn revision(&self, sampled: impl Into<Sampled>) -> Result<u64, Error> {
        let sampled = sampled.into();
        self.textures.gpu.bind_groups().revision(sampled).ok_or_else(|| unknown(sampled))
    }

    /// The ids by which shaders know what is sampled: for a layer one, that of its texture
    /// ([`Textures::shader_id`]); for a group that of the group, then those of its members, in the order of
    /// `VastexIds`. Fails if there is no such texture or group.
    pub fn ids(&self, sampled: impl Into<Sampled>) -> Result<Vec<u32>, Error> {
        let sampled = sampled.into();
        self.textures.gpu.ids(sampled).ok_or_else(|| unknown(sampled))
    }
}
