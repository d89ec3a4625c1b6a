//! What an application's pipelines need: kinds, text, layouts, bind groups, ids.
//!
//! Entries to be merged into groups of the application's own are `bindings`' business.

use vastex_wgpu::Kinds;

use super::{Textures, unknown};
use crate::error::Error;
use crate::ids::{LayerId, Sampled};

impl Textures {
    /// The format of the target that feedback is drawn into, for the application's feedback pipeline.
    pub const FEEDBACK_FORMAT: wgpu::TextureFormat = vastex_wgpu::FEEDBACK_FORMAT;
    /// The format of the depth buffer of that target.
    pub const FEEDBACK_DEPTH_FORMAT: wgpu::TextureFormat = vastex_wgpu::FEEDBACK_DEPTH_FORMAT;
    /// The format of the target for [`Ahead::texture_space`](crate::Ahead::texture_space), for the
    /// application's pipeline.
    pub const TEXTURE_SPACE_FORMAT: wgpu::TextureFormat = vastex_wgpu::TEXTURE_SPACE_FORMAT;
    /// How that pipeline blends.
    pub const TEXTURE_SPACE_BLEND: wgpu::BlendState = vastex_wgpu::TEXTURE_SPACE_BLEND;

    /// What a shader's text depends on that samples this layer, or this group: the key of its pipelines. It
    /// is the same for all textures whose layer has the same format, resolution and blending, whose page
    /// tables lie alike, and whose pages both have sides that are powers of two or both have not, whatever
    /// their sizes, borders, address modes and levels are ([`TextureRef::kind`](crate::TextureRef::kind)
    /// has it for each layer). Fails where there is no such texture or group.
    pub fn kinds(&self, sampled: impl Into<Sampled>) -> Result<Kinds, Error> {
        let sampled = sampled.into();
        self.gpu.kinds(sampled).ok_or_else(|| unknown(sampled))
    }

    /// The WGSL that goes after the application's own shader, whose directives then stay first and whose
    /// lines keep their numbers: `vastex_sample(id, uv)` and its kin for one layer, `vastex_sample_NAME(id,
    /// uv)` for each member of a group, as [`wgsl()`](crate::wgsl()) says. A shader has one such text: two
    /// cannot be joined, since they declare the same names. One that samples several textures of different
    /// kinds asks for the text of a [group](Textures::add_group). The text is plain WGSL; before a
    /// preprocessor such as naga_oil it is one module more, whose names begin with `vastex`. It has every
    /// function; [`shader_module`](crate::shader_module), or [`only_needed`](crate::only_needed) before
    /// another compiler, leaves out what the entry points do not call.
    pub fn wgsl(&self, kinds: &Kinds) -> String {
        self.gpu.wgsl(kinds)
    }

    /// For the application's pipeline layouts, at the group of
    /// [`Settings::binding`](crate::Settings::binding).
    pub fn bind_group_layout(&self, kinds: &Kinds) -> wgpu::BindGroupLayout {
        self.gpu.bind_group_layout(kinds)
    }

    /// Everything that the application's shaders need to sample a layer, or a group, in whichever view: the
    /// same bind group for all textures of the same pools and formats. Which of them is meant the
    /// [id](Textures::shader_id) says. Fails where there is no such texture or group.
    ///
    /// Ask for it in each frame, after [`Textures::update`], and you need to know no more: that costs
    /// nothing. An application that keeps a bind group, or a render bundle that names it, compares
    /// [`Bindings::revision`](crate::Bindings::revision) after each update, or hears
    /// [`BindGroupsChanged`](crate::Event::BindGroupsChanged). The bind group is replaced where memory behind
    /// it moves:
    ///
    /// - by [`Textures::update`], [`Textures::add`] and [`Textures::add_group`], where page tables or records
    ///   need more memory than they have had;
    /// - by [`Textures::remove`] of a pool's last texture;
    /// - by [`Memory::resize_pool`](crate::Memory::resize_pool), [`Memory::fit_pool`](crate::Memory::fit_pool),
    ///   [`Memory::set_picture`](crate::Memory::set_picture) and [`Memory::restore`](crate::Memory::restore),
    ///   and by whatever is called first after an update that failed;
    /// - by [`ViewMut::main_pass`](crate::ViewMut::main_pass), where feedback is
    ///   [inline](crate::FeedbackMode::Inline) and the view's picture is larger than any that it has had:
    ///   that is the first picture of a view that was added, whatever its size, while the main view has
    ///   room for [`Settings::picture`](crate::Settings::picture) from the beginning. Whatever is drawn in
    ///   the same frame with a bind group that was kept counts a frame later.
    pub fn bind_group(&self, sampled: impl Into<Sampled>) -> Result<&wgpu::BindGroup, Error> {
        let sampled = sampled.into();
        self.gpu.bind_groups().get(sampled).ok_or_else(|| unknown(sampled))
    }

    /// The id by which shaders know the texture of a layer. It stays the same for as long as the texture is
    /// there, so that it may lie in materials or instances; afterwards it names nothing, and shaders show
    /// [`Settings::unknown_color`](crate::Settings::unknown_color) for it. Fails where there is no such
    /// texture. The ids of a group are [`Bindings::ids`](crate::Bindings::ids).
    pub fn shader_id(&self, layer: impl Into<LayerId>) -> Result<u32, Error> {
        let texture = layer.into().texture();
        self.gpu.shader_id(texture).ok_or(Error::NoTexture(texture))
    }
}
