//! What an application's pipelines need: kinds, text, layouts, bind groups, ids.

use vastex_core::ViewId;
use vastex_wgpu::Kinds;

use super::Textures;
use crate::sampled::{LayerId, Sampled};

impl Textures {
    /// The format of the target that feedback is drawn into, for the application's feedback pipeline.
    pub const FEEDBACK_FORMAT: wgpu::TextureFormat = vastex_wgpu::FEEDBACK_FORMAT;
    /// The format of the depth buffer of that target.
    pub const FEEDBACK_DEPTH_FORMAT: wgpu::TextureFormat = vastex_wgpu::FEEDBACK_DEPTH_FORMAT;
    /// The format of the target for [`Textures::texture_space`], for the application's pipeline.
    pub const TEXTURE_SPACE_FORMAT: wgpu::TextureFormat = vastex_wgpu::TEXTURE_SPACE_FORMAT;
    /// How that pipeline blends.
    pub const TEXTURE_SPACE_BLEND: wgpu::BlendState = vastex_wgpu::TEXTURE_SPACE_BLEND;

    /// What a shader's text depends on that samples this layer, or this group: the key of its pipelines. It is the same for all textures
    /// whose tiles have the same formats and whose page tables lie alike, whatever their sizes, borders, address modes and levels are.
    pub fn kinds(&self, sampled: impl Into<Sampled>) -> Kinds {
        self.gpu.kinds(sampled.into())
    }

    /// The WGSL that goes after the application's own shader, whose directives then stay first and whose lines keep their numbers:
    /// `vastex_sample(id, uv)` and its kin for one layer, `vastex_sample_NAME(id, uv)` for each member of a group, as
    /// [`vastex_wgpu::wgsl()`] says.
    pub fn wgsl(&self, kinds: &Kinds) -> String {
        self.gpu.wgsl(kinds)
    }

    /// For the application's pipeline layouts, at the group of [`crate::Settings::binding`].
    pub fn bind_group_layout(&self, kinds: &Kinds) -> wgpu::BindGroupLayout {
        self.gpu.bind_group_layout(kinds)
    }

    /// The same as entries, from the first binding of [`crate::Settings::binding`] on, for a layout of the application's own that has others
    /// beside them.
    pub fn layout_entries(&self, kinds: &Kinds) -> Vec<wgpu::BindGroupLayoutEntry> {
        self.gpu.layout_entries(kinds)
    }

    /// Everything that the application's shaders need to sample a layer, or a group, in whichever view: the same bind group for all textures of
    /// the same pools and formats. Which of them is meant the [ids](Textures::ids) say.
    ///
    /// It may be another one after [`Textures::update`] and [`Textures::add`] (where page tables or records need more memory than they have
    /// had), [`Textures::resize_pool`], [`Textures::set_picture`] and [`Textures::restore`], and, where feedback is
    /// [inline](crate::FeedbackWay::Inline), where a view has a larger picture than before. [`Textures::revision`] is then another number: who
    /// keeps a bind group, or a render bundle that names it, compares it in each frame, after the update.
    pub fn bind_group(&self, sampled: impl Into<Sampled>) -> &wgpu::BindGroup {
        &self.gpu.bind_groups()[sampled.into()]
    }

    /// The same as entries, for a bind group of the application's own, whose layout has [`Textures::layout_entries`]. They are others where
    /// [`Textures::revision`] is another number.
    pub fn entries(&self, sampled: impl Into<Sampled>) -> Vec<wgpu::BindGroupEntry<'_>> {
        self.gpu.entries(sampled.into())
    }

    /// A number that is another wherever the [bind group](Textures::bind_group) or the [entries](Textures::entries) are.
    pub fn revision(&self, sampled: impl Into<Sampled>) -> u64 {
        self.gpu.bind_groups().revision(sampled.into())
    }

    /// The ids by which shaders know what is sampled: of a layer one, that of its texture; of a group that of the whole, then those of its
    /// members, in the order of `VastexIds`. They stay the same for as long as the texture or the group is there, so that they may lie in
    /// materials or instances; afterwards they name nothing, and shaders show [`crate::Settings::unknown_color`] for them.
    pub fn ids(&self, sampled: impl Into<Sampled>) -> Vec<u32> {
        self.gpu.ids(sampled.into())
    }

    /// The id by which shaders know the texture of a layer: the one of [`Textures::ids`].
    pub fn shader_id(&self, layer: impl Into<LayerId>) -> u32 {
        self.gpu.shader_id(layer.into().texture())
    }

    /// The number by which shaders know a view: 0 of the main one, and of what is only expected.
    pub fn view_number(&self, view: ViewId) -> u32 {
        self.gpu.view_number(view)
    }
}
