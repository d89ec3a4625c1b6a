//! The one bind group through which an application's shaders see a group of virtual textures.
//!
//! It holds the parameters of all members in one buffer, the page table of each texture, the atlas of each layer, and those of the
//! view. A page table is bound once for all layers of its texture.

use vastex_core::{Geometry, LevelRule, Slot, TextureId};

use crate::bind::{atlas_entry, buffer, cells_entry, entry, fades_entry, new_sampler, table_entry};
use crate::error::GpuError;
use crate::feedback::ViewBuffer;
use crate::mirror::{PoolParams, TableParams, TextureParams};
use crate::pool::Pool;
use crate::shader::group::{GroupShape, PARAMS_BINDING, SAMPLER_BINDING, VIEW_BINDING};
use crate::table::TableBuffers;
use crate::way::FeedbackWay;

/// The layout of that bind group.
#[derive(Debug)]
pub struct GroupLayout {
    shape: GroupShape,
    way: FeedbackWay,
    layout: wgpu::BindGroupLayout,
    sampler: wgpu::Sampler,
}

impl GroupLayout {
    /// A layout for groups of this shape, and for shaders made for a way of feedback that the device has. Fails where a shader of the
    /// device cannot read so many textures.
    pub fn new(device: &wgpu::Device, shape: GroupShape, way: FeedbackWay) -> Result<GroupLayout, GpuError> {
        check(&device.limits(), &shape, way)?;
        let mut entries = vec![
            entry(PARAMS_BINDING, buffer(wgpu::BufferBindingType::Uniform)),
            entry(VIEW_BINDING, buffer(wgpu::BufferBindingType::Uniform)),
            entry(SAMPLER_BINDING, wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering)),
        ];
        entries.extend((0..shape.textures()).map(|texture| table_entry(shape.table_binding(texture), way)));
        let atlases = (0..).zip(shape.members());
        entries.extend(atlases.map(|(nth, member)| atlas_entry(shape.atlas_binding(nth), member.atlas)));
        if shape.fade() {
            entries.extend((0..shape.textures()).map(|texture| fades_entry(shape.fades_binding(texture))));
        }
        entries.extend(cells_entry(shape.cells_binding(), way));
        let descriptor = wgpu::BindGroupLayoutDescriptor { label: Some("vastex group"), entries: &entries };
        let layout = device.create_bind_group_layout(&descriptor);
        Ok(GroupLayout { shape, way, layout, sampler: new_sampler(device) })
    }

    /// For the application's pipeline layouts.
    pub fn layout(&self) -> &wgpu::BindGroupLayout {
        &self.layout
    }

    /// What it was made for.
    pub fn shape(&self) -> &GroupShape {
        &self.shape
    }

    /// The way of feedback that it is for.
    pub fn way(&self) -> FeedbackWay {
        self.way
    }

    /// The bind group of textures and layers that match the shape, in its order: a page table for each texture, a pool and the
    /// layer's number in it for each member, with fades where the shape has. It stays valid while contents change; a new pool, page table or view needs a new one.
    pub fn bind_group<'a>(
        &self,
        device: &wgpu::Device,
        params: &GroupParams,
        tables: impl Iterator<Item = &'a TableBuffers>,
        members: impl Iterator<Item = (&'a Pool, usize)>,
        view: &ViewBuffer,
    ) -> wgpu::BindGroup {
        let resource = |binding, resource| wgpu::BindGroupEntry { binding, resource };
        let mut entries = vec![
            resource(PARAMS_BINDING, params.buffer.as_entire_binding()),
            resource(VIEW_BINDING, view.buffer().as_entire_binding()),
            resource(SAMPLER_BINDING, wgpu::BindingResource::Sampler(&self.sampler)),
        ];
        let shape = &self.shape;
        let table =
            |(nth, table): (usize, &'a TableBuffers)| resource(shape.table_binding(nth), table.binding());
        entries.extend(tables.enumerate().map(table));
        let atlas = |(nth, (pool, layer)): (usize, (&'a Pool, usize))| {
            debug_assert_eq!(pool.atlas(layer), shape.members()[nth].atlas);
            resource(shape.atlas_binding(nth), wgpu::BindingResource::TextureView(pool.view(layer)))
        };
        let members: Vec<_> = members.collect();
        entries.extend(members.iter().copied().enumerate().map(atlas));
        if shape.fade() {
            // Members that are layers of a texture have its pool in common.
            let pool_of = |nth| shape.members().iter().position(|member| member.texture == nth);
            let fades = |nth| Some((nth, members.get(pool_of(nth)?)?.0.fades()?));
            let fades = (0..shape.textures()).filter_map(fades);
            entries.extend(fades.map(|(nth, fades)| {
                resource(shape.fades_binding(nth), wgpu::BindingResource::TextureView(fades.view()))
            }));
        }
        let cells = view.cells().map(|cells| cells.as_entire_binding());
        entries.extend(cells.map(|cells| resource(shape.cells_binding(), cells)));
        device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("vastex group"),
            layout: &self.layout,
            entries: &entries,
        })
    }
}

/// What shaders are told about the textures and pools of a group: `VastexGroup`.
#[derive(Debug)]
pub struct GroupParams {
    buffer: wgpu::Buffer,
    textures: usize,
    /// What was written last, of each texture and of each member.
    written: Vec<(LevelRule, Slot, TableParams)>,
    pools: Vec<PoolParams>,
}

impl GroupParams {
    /// For a group that feedback names by `number`, with pages of the levels of `geometry`; textures and members as in
    /// [`GroupLayout::bind_group`].
    pub fn new<'a>(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        geometry: &Geometry,
        number: TextureId,
        tables: impl Iterator<Item = &'a TableBuffers>,
        members: impl Iterator<Item = (&'a Pool, usize)>,
    ) -> GroupParams {
        let (tables, pools): (Vec<_>, Vec<_>) =
            (tables.collect(), members.map(|(pool, layer)| pool.layer_params(layer)).collect());
        let mut textures = vec![TextureParams::of_group(geometry, number)];
        textures.extend(tables.iter().map(|table| table.texture_params()));
        let contents = [bytemuck::cast_slice(&textures), bytemuck::cast_slice::<_, u8>(&pools)].concat();
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("vastex group"),
            size: contents.len() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        queue.write_buffer(&buffer, 0, &contents);
        let written = tables.iter().map(|table| table.changeable()).collect();
        GroupParams { buffer, textures: textures.len(), written, pools }
    }

    /// Tells shaders what has changed: how levels of a texture are chosen, a pool's mip bias or size. To be called once per frame, before
    /// the main pass. Costs a comparison for each texture and member, and returns the bytes sent.
    pub fn update<'a>(
        &mut self,
        queue: &wgpu::Queue,
        tables: impl Iterator<Item = &'a TableBuffers>,
        members: impl Iterator<Item = (&'a Pool, usize)>,
    ) -> u64 {
        let (texture_bytes, pool_bytes) = (size_of::<TextureParams>(), size_of::<PoolParams>());
        let mut sent = 0;
        let mut write = |at: usize, bytes: &[u8]| {
            queue.write_buffer(&self.buffer, at as u64, bytes);
            sent += bytes.len() as u64;
        };
        for ((nth, written), table) in (1..).zip(&mut self.written).zip(tables) {
            if *written != table.changeable() {
                *written = table.changeable();
                write(nth * texture_bytes, bytemuck::bytes_of(&table.texture_params()));
            }
        }
        for ((nth, written), (pool, layer)) in (0..).zip(&mut self.pools).zip(members) {
            let params = pool.layer_params(layer);
            if *written != params {
                *written = params;
                write(self.textures * texture_bytes + nth * pool_bytes, bytemuck::bytes_of(&params));
            }
        }
        sent
    }
}

/// Whether one stage of a shader may read so much.
fn check(limits: &wgpu::Limits, shape: &GroupShape, way: FeedbackWay) -> Result<(), GpuError> {
    let (textures, layers) = (shape.textures(), shape.members().len());
    let params = limits.max_uniform_buffer_binding_size as usize;
    let most_params = params.saturating_sub(layers * size_of::<PoolParams>()) / size_of::<TextureParams>();
    let buffers = limits.max_storage_buffers_per_shader_stage as usize;
    let sampled = limits.max_sampled_textures_per_shader_stage as usize;
    // How far tiles have faded in is in a texture, for each pool.
    let sampled = sampled.saturating_sub(if shape.fade() { textures } else { 0 });
    // Tables are buffers, and so is where the main pass tells what it wants; or they are textures as layers are.
    let (max_tables, max_layers) = match way {
        FeedbackWay::Separate => (buffers, sampled),
        FeedbackWay::Inline => (buffers.saturating_sub(1), sampled),
        FeedbackWay::Raw => (sampled.saturating_sub(layers), sampled.saturating_sub(textures)),
    };
    let max_textures = max_tables.min(most_params.saturating_sub(1));
    match textures <= max_textures && layers <= max_layers {
        true => Ok(()),
        false => Err(GpuError::GroupTooLarge { textures, layers, max_textures, max_layers }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filter::Filter;
    use crate::shader::Atlas;
    use crate::shader::group::{GroupMember, group_wgsl};
    use crate::shader::tests::module;
    use crate::shader::{PageSides, TableKinds};

    fn shape(textures: usize, layers: usize) -> GroupShape {
        let member = |nth: usize| GroupMember {
            name: format!("m{nth}"),
            texture: nth % textures,
            atlas: Atlas::Float,
            tables: TableKinds::Either,
            pages: PageSides::Any,
            filter: None,
            fades: true,
        };
        GroupShape::new((0..layers).map(member).collect(), true).unwrap()
    }

    #[test]
    fn groups_are_laid_out_alike() {
        let module = module(&group_wgsl(0, Filter::Trilinear, FeedbackWay::Separate, &shape(2, 3)));
        let group = module.types.iter().find(|(_, ty)| ty.name.as_deref() == Some("VastexGroup")).unwrap().1;
        let naga::TypeInner::Struct { members, span } = &group.inner else { panic!("no struct") };
        let (texture, pool) = (size_of::<TextureParams>(), size_of::<PoolParams>());
        let offsets: Vec<usize> = members.iter().map(|member| member.offset as usize).collect();
        assert_eq!((offsets, *span as usize), (vec![0, 3 * texture], 3 * texture + 3 * pool));
        for (member, stride) in members.iter().zip([texture, pool]) {
            let naga::TypeInner::Array { stride: found, .. } = module.types[member.ty].inner else {
                panic!("no array")
            };
            assert_eq!(found as usize, stride);
        }
    }

    #[test]
    fn a_group_that_no_shader_could_read_is_refused_and_says_what_fits() {
        let limits = wgpu::Limits::default();
        assert!(check(&limits, &shape(8, 16), FeedbackWay::Separate).is_ok());
        let error = check(&limits, &shape(9, 9), FeedbackWay::Separate).unwrap_err();
        assert!(matches!(
            error,
            GpuError::GroupTooLarge { textures: 9, max_textures: 8, max_layers: 16, .. }
        ));
        assert!(error.to_string().contains("at most 8 textures and 16 layers"), "{error}");
        assert!(check(&limits, &shape(1, 17), FeedbackWay::Separate).is_err());
        let fading = |layers| shape(8, layers).with_fade(true);
        assert!(check(&limits, &fading(8), FeedbackWay::Separate).is_ok());
        assert!(check(&limits, &fading(9), FeedbackWay::Separate).is_err());
        assert!(check(&limits, &shape(8, 8), FeedbackWay::Inline).is_err());
        let small = wgpu::Limits { max_uniform_buffer_binding_size: 16 << 10, ..limits };
        assert!(
            check(&small, &shape(5, 5), FeedbackWay::Separate).is_ok()
                && check(&small, &shape(6, 6), FeedbackWay::Separate).is_err()
        );
    }
}
