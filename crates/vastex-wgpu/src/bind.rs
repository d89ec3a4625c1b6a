//! What shaders of some kinds see, and at which bindings: in a bind group of its own, or among the entries of
//! an application's.
//!
//! From the first binding on: the records, the views, the sampler, where feedback is inline its cells; for
//! each pool of the text its page tables, its parameters, where tiles fade in, how far they have, and of
//! volumes the range of values in each slot; then the atlas of each layer.

use vastex_core::Dims;

use crate::device::whole_buffer;
use crate::error::GpuError;
use crate::feedback_mode::FeedbackMode;
use crate::kind::{Atlas, Kinds, TextLayer};
use crate::pool::Pool;
use crate::views::Views;

/// Where an application has room for the bindings of its shaders' Vastex text.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct BindingPlace {
    /// Index of the bind group.
    pub group: u32,
    /// The first binding; the others follow it, without gaps.
    pub first: u32,
}

impl BindingPlace {
    /// Fails if a device has no such group, or too few bindings in it from the first on for a text of one
    /// pool and one layer.
    pub fn check(self, limits: &wgpu::Limits) -> Result<(), GpuError> {
        let most = Bindings { first: 0, has_cells: true, has_fades: true, solid: vec![false] };
        self.check_count(limits, most.atlas(1))
    }

    fn check_count(self, limits: &wgpu::Limits, needed: u32) -> Result<(), GpuError> {
        let (max_groups, max_bindings) = (limits.max_bind_groups, limits.max_bindings_per_bind_group);
        let BindingPlace { group, first } = self;
        let end = u64::from(first) + u64::from(needed);
        match group < max_groups && end <= u64::from(max_bindings) {
            true => Ok(()),
            false => Err(GpuError::BindingPlace { group, first, needed, max_groups, max_bindings }),
        }
    }
}

/// The numbers of the bindings.
pub(crate) struct Bindings {
    first: u32,
    has_cells: bool,
    has_fades: bool,
    /// Of each pool whether it is one of volumes.
    solid: Vec<bool>,
}

impl Bindings {
    pub(crate) fn new(kinds: &Kinds, first: u32) -> Bindings {
        Bindings {
            first,
            has_cells: kinds.mode() == FeedbackMode::Inline,
            has_fades: kinds.fade(),
            solid: kinds.text_pools().iter().map(|pool| pool.dims == Dims::D3).collect(),
        }
    }

    pub(crate) fn params(&self) -> u32 {
        self.first
    }

    pub(crate) fn views(&self) -> u32 {
        self.first + 1
    }

    pub(crate) fn sampler(&self) -> u32 {
        self.first + 2
    }

    pub(crate) fn cells(&self) -> Option<u32> {
        self.has_cells.then_some(self.first + 3)
    }

    pub(crate) fn table(&self, pool: usize) -> u32 {
        self.first_of_pool(pool)
    }

    pub(crate) fn pool(&self, pool: usize) -> u32 {
        self.first_of_pool(pool) + 1
    }

    pub(crate) fn fades(&self, pool: usize) -> Option<u32> {
        self.has_fades.then_some(self.first_of_pool(pool) + 2)
    }

    pub(crate) fn ranges(&self, pool: usize) -> Option<u32> {
        let is_solid = self.solid.get(pool).copied().unwrap_or(false);
        is_solid.then_some(self.first_of_pool(pool) + 2 + u32::from(self.has_fades))
    }

    pub(crate) fn atlas(&self, layer: usize) -> u32 {
        self.first_of_pool(self.solid.len()) + layer as u32
    }

    fn first_of_pool(&self, pool: usize) -> u32 {
        let of_pool = |solid: &bool| 2 + u32::from(self.has_fades) + u32::from(*solid);
        self.first + 3 + u32::from(self.has_cells) + self.solid.iter().take(pool).map(of_pool).sum::<u32>()
    }
}

/// The entries of a bind group layout for kinds, from the binding `first` on.
pub fn layout_entries(kinds: &Kinds, first: u32) -> Vec<wgpu::BindGroupLayoutEntry> {
    let (at, mode) = (Bindings::new(kinds, first), kinds.mode());
    let uniform = || whole_buffer(wgpu::BufferBindingType::Uniform);
    let mut entries = vec![
        entry(at.params(), words_in_texture()),
        entry(at.views(), uniform()),
        entry(at.sampler(), wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering)),
    ];
    entries.extend(at.cells().map(cells_entry));
    for pool in 0..kinds.text_pools().len() {
        entries.push(entry(at.table(pool), words(mode)));
        entries.push(entry(at.pool(pool), uniform()));
        entries.extend(at.fades(pool).map(fades_entry));
        entries.extend(at.ranges(pool).map(ranges_entry));
    }
    let atlases = kinds.layers().iter().enumerate();
    let dims = |layer: &TextLayer| kinds.text_pools()[layer.pool].dims;
    entries.extend(atlases.map(|(nth, layer)| atlas_entry(at.atlas(nth), layer.atlas, dims(layer))));
    entries
}

/// What is bound for the members of kinds.
pub struct Bound<'a> {
    /// The records of all textures.
    pub params: wgpu::BindingResource<'a>,
    /// The views.
    pub views: &'a Views,
    /// The sampler of atlases: [`new_sampler`].
    pub sampler: &'a wgpu::Sampler,
    /// Of each pool of the text, in the order of [`Kinds::pools`], the pool and its page tables.
    pub pools: Vec<(&'a Pool, wgpu::BindingResource<'a>)>,
}

/// The entries of a bind group of [`layout_entries`]. They stay valid while contents change; new records,
/// views, pools or page tables need new ones. The pools' layers are as the kinds say.
pub fn entries<'a>(kinds: &Kinds, first: u32, bound: &Bound<'a>) -> Vec<wgpu::BindGroupEntry<'a>> {
    let at = Bindings::new(kinds, first);
    let entry = |binding, resource| wgpu::BindGroupEntry { binding, resource };
    let mut entries = vec![
        entry(at.params(), bound.params.clone()),
        entry(at.views(), bound.views.buffer().as_entire_binding()),
        entry(at.sampler(), wgpu::BindingResource::Sampler(bound.sampler)),
    ];
    let cells = at.cells().zip(bound.views.cells());
    entries.extend(cells.map(|(binding, cells)| entry(binding, cells.as_entire_binding())));
    for (nth, (pool, table)) in bound.pools.iter().enumerate() {
        entries.push(entry(at.table(nth), table.clone()));
        entries.push(entry(at.pool(nth), pool.params().as_entire_binding()));
        let fades = at.fades(nth).zip(pool.fades());
        let fades = fades.map(|(at, fades)| entry(at, wgpu::BindingResource::TextureView(fades.view())));
        entries.extend(fades);
        let ranges = at.ranges(nth).zip(pool.ranges());
        entries.extend(ranges.map(|(at, view)| entry(at, wgpu::BindingResource::TextureView(view))));
    }
    for (nth, layer) in kinds.layers().iter().enumerate() {
        let (pool, _) = &bound.pools[layer.pool];
        debug_assert_eq!(pool.atlas(layer.index.into()), layer.atlas);
        let view = wgpu::BindingResource::TextureView(pool.view(layer.index.into()));
        entries.push(entry(at.atlas(nth), view));
    }
    entries
}

/// Fails where one stage of a shader of a device with these limits cannot read so much, by itself.
pub fn check_bindings(limits: &wgpu::Limits, kinds: &Kinds, place: BindingPlace) -> Result<(), GpuError> {
    place.check_count(limits, Bindings::new(kinds, 0).atlas(kinds.layers().len()))?;
    let (pools, layers) = (kinds.text_pools().len(), kinds.layers().len());
    let buffers = limits.max_storage_buffers_per_shader_stage as usize;
    let sampled = limits.max_sampled_textures_per_shader_stage as usize;
    let uniforms = limits.max_uniform_buffers_per_shader_stage as usize;
    let fades = usize::from(kinds.fade());
    // Records are a texture, and ranges of values of volumes. Tables are buffers, and so is where the main
    // pass reports what it wants; or tables are textures as well.
    let solid = kinds.text_pools().iter().filter(|pool| pool.dims == Dims::D3).count();
    let free_textures = sampled.saturating_sub(1 + solid);
    let (free_buffers, of_pool) = match kinds.mode() {
        FeedbackMode::Separate => (buffers, fades),
        FeedbackMode::Inline => (buffers.saturating_sub(1), fades),
        FeedbackMode::Raw => (usize::MAX, fades + 1),
    };
    let for_pools = free_textures.saturating_sub(layers);
    let by_textures = for_pools.checked_div(of_pool).unwrap_or(usize::MAX);
    let max_pools = free_buffers.min(uniforms.saturating_sub(1)).min(by_textures);
    let max_layers = free_textures.saturating_sub(pools * of_pool);
    match pools <= max_pools && layers <= max_layers {
        true => Ok(()),
        false => Err(GpuError::GroupTooLarge { pools, layers, max_pools, max_layers }),
    }
}

/// The sampler for atlases that the device filters.
pub fn new_sampler(device: &wgpu::Device) -> wgpu::Sampler {
    device.create_sampler(&wgpu::SamplerDescriptor {
        label: Some("vastex atlas"),
        mag_filter: wgpu::FilterMode::Linear,
        min_filter: wgpu::FilterMode::Linear,
        ..Default::default()
    })
}

fn entry(binding: u32, ty: wgpu::BindingType) -> wgpu::BindGroupLayoutEntry {
    let visibility = wgpu::ShaderStages::VERTEX_FRAGMENT | wgpu::ShaderStages::COMPUTE;
    wgpu::BindGroupLayoutEntry { binding, visibility, ty, count: None }
}

/// The texture of a layer that is read as `atlas` says.
fn atlas_entry(binding: u32, atlas: Atlas, dims: Dims) -> wgpu::BindGroupLayoutEntry {
    let sample_type = match atlas {
        Atlas::Float | Atlas::HighLow => wgpu::TextureSampleType::Float { filterable: true },
        Atlas::Unfiltered => wgpu::TextureSampleType::Float { filterable: false },
        Atlas::Uint16 | Atlas::Uint16Rgba | Atlas::Whole => wgpu::TextureSampleType::Uint,
    };
    let view_dimension = match dims {
        Dims::D2 => wgpu::TextureViewDimension::D2Array,
        Dims::D3 => wgpu::TextureViewDimension::D3,
    };
    entry(binding, wgpu::BindingType::Texture { sample_type, view_dimension, multisampled: false })
}

/// How far the tiles of a pool have faded in.
fn fades_entry(binding: u32) -> wgpu::BindGroupLayoutEntry {
    let sample_type = wgpu::TextureSampleType::Uint;
    let view_dimension = wgpu::TextureViewDimension::D2Array;
    entry(binding, wgpu::BindingType::Texture { sample_type, view_dimension, multisampled: false })
}

/// The range of values in each slot of a pool of volumes.
fn ranges_entry(binding: u32) -> wgpu::BindGroupLayoutEntry {
    let sample_type = wgpu::TextureSampleType::Float { filterable: false };
    let view_dimension = wgpu::TextureViewDimension::D2;
    entry(binding, wgpu::BindingType::Texture { sample_type, view_dimension, multisampled: false })
}

/// Page tables: words in a buffer, or where there are none in a texture.
fn words(mode: FeedbackMode) -> wgpu::BindingType {
    match mode {
        FeedbackMode::Separate | FeedbackMode::Inline => {
            whole_buffer(wgpu::BufferBindingType::Storage { read_only: true })
        }
        FeedbackMode::Raw => words_in_texture(),
    }
}

fn words_in_texture() -> wgpu::BindingType {
    wgpu::BindingType::Texture {
        sample_type: wgpu::TextureSampleType::Uint,
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled: false,
    }
}

/// Where the main pass reports what it wants.
fn cells_entry(binding: u32) -> wgpu::BindGroupLayoutEntry {
    wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::FRAGMENT,
        ty: whole_buffer(wgpu::BufferBindingType::Storage { read_only: false }),
        count: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filter::Filter;
    use crate::kind::{Kind, KindMember, PageSides, TableKind};

    fn kinds(pools: usize, layers: usize, mode: FeedbackMode, fade: bool) -> Kinds {
        let member = |nth: usize| {
            let (tables, pages) = (TableKind::Direct, PageSides::Any);
            let (atlas, filter, layer) = (Atlas::Float, Filter::Trilinear, (nth / pools) as u8);
            let (dims, is_mixed) = (Dims::D2, true);
            let kind = Kind { dims, tables, pages, layer, atlas, scale: 1, filter, is_mixed };
            KindMember { name: format!("m{nth}"), pool: nth % pools, kind }
        };
        Kinds::of_group((0..layers).map(member).collect(), mode, fade).unwrap()
    }

    #[test]
    fn a_group_that_no_shader_could_read_is_refused_and_says_what_fits() {
        let limits = wgpu::Limits::default();
        let check = |pools, layers, mode, fade| {
            check_bindings(&limits, &kinds(pools, layers, mode, fade), BindingPlace::default())
        };
        use FeedbackMode::{Inline, Raw, Separate};
        assert!(check(8, 15, Separate, false).is_ok());
        let error = check(9, 9, Separate, false).unwrap_err();
        assert!(matches!(error, GpuError::GroupTooLarge { pools: 9, max_pools: 8, max_layers: 15, .. }));
        assert!(error.to_string().contains("at most 8 pools and 15 layers"), "{error}");
        assert!(check(1, 16, Separate, false).is_err());
        assert!(check(7, 8, Separate, true).is_ok() && check(7, 9, Separate, true).is_err());
        assert!(check(7, 7, Inline, false).is_ok() && check(8, 8, Inline, false).is_err());
        assert!(check(7, 8, Raw, false).is_ok() && check(7, 9, Raw, false).is_err());
    }

    #[test]
    fn a_place_that_a_device_does_not_have_is_refused() {
        let limits = wgpu::Limits::default();
        let check = |group, first| BindingPlace { group, first }.check(&limits);
        assert!(check(3, 0).is_ok() && check(0, 992).is_ok());
        for (group, first) in [(4, 0), (u32::MAX, 0), (0, 993), (0, u32::MAX)] {
            assert!(check(group, first).is_err(), "{group}, {first}");
        }
        let of_group = check_bindings(
            &limits,
            &kinds(3, 5, FeedbackMode::Separate, false),
            BindingPlace { group: 1, first: 987 },
        );
        assert!(of_group.unwrap_err().to_string().contains("14 bindings from 987 on in group 1"));
    }

    #[test]
    fn bindings_follow_one_another_from_the_first_on() {
        for (mode, fade) in [(FeedbackMode::Inline, true), (FeedbackMode::Separate, false)] {
            let entries = layout_entries(&kinds(3, 5, mode, fade), 7);
            let bindings: Vec<u32> = entries.iter().map(|entry| entry.binding).collect();
            assert_eq!(bindings, (7..7 + bindings.len() as u32).collect::<Vec<_>>());
        }
    }
}
