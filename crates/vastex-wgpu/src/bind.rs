//! The one bind group through which an application's shaders see a virtual texture; that of several is `group`'s.
//!
//! It holds the texture's parameters and page table, its pool's parameters and the atlas of one layer, where tiles fade in how far they
//! have, and the parameters of the view that is drawn into a feedback target; the main pass takes the same group and ignores the view.

use crate::feedback::ViewBuffer;
use crate::pool::Pool;
use crate::shader::Atlas;
use crate::table::TableBuffers;
use crate::way::FeedbackWay;

const TEXTURE: u32 = 0;
const TABLE: u32 = 1;
const POOL: u32 = 2;
const VIEW: u32 = 3;
const SAMPLER: u32 = 4;
const ATLAS: u32 = 5;
const CELLS: u32 = 6;
/// Only where tiles fade in.
pub(crate) const FADES: u32 = 7;

/// The bindings, as (name, value), for the generator of shader text.
pub(crate) const BINDINGS: &[(&str, u32)] = &[
    ("BINDING_TEXTURE", TEXTURE),
    ("BINDING_TABLE", TABLE),
    ("BINDING_POOL", POOL),
    ("BINDING_VIEW", VIEW),
    ("BINDING_SAMPLER", SAMPLER),
    ("BINDING_ATLAS", ATLAS),
    ("BINDING_CELLS", CELLS),
];

/// The layout of that bind group, for all layers of pools that are read in the same way.
#[derive(Clone, Debug)]
pub struct BindLayout {
    layout: wgpu::BindGroupLayout,
    sampler: wgpu::Sampler,
    atlas: Atlas,
    way: FeedbackWay,
    fade: bool,
}

impl BindLayout {
    /// A layout for layers that are read as `atlas` says ([`Pool::atlas`]), and for shaders made for a way of feedback that the device
    /// has.
    pub fn new(device: &wgpu::Device, atlas: Atlas, way: FeedbackWay) -> BindLayout {
        BindLayout::with_fade(device, atlas, way, false)
    }

    /// The same for shaders in which tiles fade in where `fade` says so ([`crate::ShaderOptions::fade`]), and pools that have
    /// [`crate::Fades`].
    pub fn with_fade(device: &wgpu::Device, atlas: Atlas, way: FeedbackWay, fade: bool) -> BindLayout {
        let mut entries = vec![
            entry(TEXTURE, buffer(wgpu::BufferBindingType::Uniform)),
            table_entry(TABLE, way),
            entry(POOL, buffer(wgpu::BufferBindingType::Uniform)),
            entry(VIEW, buffer(wgpu::BufferBindingType::Uniform)),
            entry(SAMPLER, wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering)),
            atlas_entry(ATLAS, atlas),
        ];
        entries.extend(cells_entry(CELLS, way));
        entries.extend(fade.then(|| fades_entry(FADES)));
        let descriptor = wgpu::BindGroupLayoutDescriptor { label: Some("vastex texture"), entries: &entries };
        BindLayout {
            layout: device.create_bind_group_layout(&descriptor),
            sampler: new_sampler(device),
            atlas,
            way,
            fade,
        }
    }

    /// For the application's pipeline layouts.
    pub fn layout(&self) -> &wgpu::BindGroupLayout {
        &self.layout
    }

    /// How shaders that use this layout read the atlas.
    pub fn atlas(&self) -> Atlas {
        self.atlas
    }

    /// The way of feedback that it is for.
    pub fn way(&self) -> FeedbackWay {
        self.way
    }

    /// Whether tiles fade in in shaders that use this layout.
    pub fn fade(&self) -> bool {
        self.fade
    }

    /// The bind group of one layer of a texture, by its number in the pool. It stays valid while contents change; a new
    /// pool, page table or view needs a new one. The layer exists and is read as this layout says; the pool
    /// has fades where the layout has.
    pub fn bind_group(
        &self,
        device: &wgpu::Device,
        table: &TableBuffers,
        pool: &Pool,
        layer: usize,
        view: &ViewBuffer,
    ) -> wgpu::BindGroup {
        debug_assert_eq!((pool.atlas(layer), view.way()), (self.atlas, self.way));
        let resource = |binding, resource| wgpu::BindGroupEntry { binding, resource };
        let mut entries = vec![
            resource(TEXTURE, table.params().as_entire_binding()),
            resource(TABLE, table.binding()),
            resource(POOL, pool.params(layer).as_entire_binding()),
            resource(VIEW, view.buffer().as_entire_binding()),
            resource(SAMPLER, wgpu::BindingResource::Sampler(&self.sampler)),
            resource(ATLAS, wgpu::BindingResource::TextureView(pool.view(layer))),
        ];
        entries.extend(view.cells().map(|cells| resource(CELLS, cells.as_entire_binding())));
        let fades = pool.fades().filter(|_| self.fade);
        entries.extend(fades.map(|fades| resource(FADES, wgpu::BindingResource::TextureView(fades.view()))));
        device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("vastex texture"),
            layout: &self.layout,
            entries: &entries,
        })
    }
}

pub(crate) fn entry(binding: u32, ty: wgpu::BindingType) -> wgpu::BindGroupLayoutEntry {
    let visibility = wgpu::ShaderStages::VERTEX_FRAGMENT | wgpu::ShaderStages::COMPUTE;
    wgpu::BindGroupLayoutEntry { binding, visibility, ty, count: None }
}

/// The texture array of a layer that is read as `atlas` says.
pub(crate) fn atlas_entry(binding: u32, atlas: Atlas) -> wgpu::BindGroupLayoutEntry {
    let sample_type = match atlas {
        Atlas::Float => wgpu::TextureSampleType::Float { filterable: true },
        Atlas::Unfiltered => wgpu::TextureSampleType::Float { filterable: false },
        Atlas::Uint16 | Atlas::Uint16Rgba => wgpu::TextureSampleType::Uint,
    };
    let view_dimension = wgpu::TextureViewDimension::D2Array;
    entry(binding, wgpu::BindingType::Texture { sample_type, view_dimension, multisampled: false })
}

/// How far the tiles of a pool have faded in.
pub(crate) fn fades_entry(binding: u32) -> wgpu::BindGroupLayoutEntry {
    let sample_type = wgpu::TextureSampleType::Uint;
    let view_dimension = wgpu::TextureViewDimension::D2Array;
    entry(binding, wgpu::BindingType::Texture { sample_type, view_dimension, multisampled: false })
}

/// A page table.
pub(crate) fn table_entry(binding: u32, way: FeedbackWay) -> wgpu::BindGroupLayoutEntry {
    let in_texture = wgpu::BindingType::Texture {
        sample_type: wgpu::TextureSampleType::Uint,
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled: false,
    };
    let in_buffer = buffer(wgpu::BufferBindingType::Storage { read_only: true });
    entry(binding, if way == FeedbackWay::Raw { in_texture } else { in_buffer })
}

/// Where the main pass tells what it wants, if it does.
pub(crate) fn cells_entry(binding: u32, way: FeedbackWay) -> Option<wgpu::BindGroupLayoutEntry> {
    (way == FeedbackWay::Inline).then(|| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::FRAGMENT,
        ty: buffer(wgpu::BufferBindingType::Storage { read_only: false }),
        count: None,
    })
}

/// The sampler for atlases that the device filters.
pub(crate) fn new_sampler(device: &wgpu::Device) -> wgpu::Sampler {
    device.create_sampler(&wgpu::SamplerDescriptor {
        label: Some("vastex atlas"),
        mag_filter: wgpu::FilterMode::Linear,
        min_filter: wgpu::FilterMode::Linear,
        ..Default::default()
    })
}

/// A whole buffer, bound without a dynamic offset.
pub(crate) fn buffer(ty: wgpu::BufferBindingType) -> wgpu::BindingType {
    wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None }
}
