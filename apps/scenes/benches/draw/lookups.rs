//! Trilinear samples of a texture in a compute shader, by page tables and functions of choice: at levels that
//! differ over the picture as on a plane seen aslant.

use std::time::Duration;

use anyhow::{Context, Result};
use vastex_core::{
    ChangeRule, Description, Geometry, GeometrySpec, LayerFormat, LevelRule, PageId, PagePos, PoolLayout,
    Slot, TableChange, TableEntry, TextureNumber,
};
use vastex_scenes::Gpu;
use vastex_wgpu::{
    BindingPlace, Bound, FeedbackMode, Filter, Kind, Kinds, PageSides, ParamStore, Pool, PoolTableChanger,
    PoolTables, RECORD_WORDS, RecordOf, TableKind, Views, entries, layout_entries, limits, new_sampler,
    shader_module, texture_record, wgsl,
};

use crate::texts::{self, ID, NUMBER, Own};
use crate::world::Bench;

/// Texels of the texture per axis.
pub(crate) const TEXELS: u32 = 1 << 13;
/// Pixels of the picture.
pub(crate) const PICTURE: [u32; 2] = [320, 192];
/// Runs of each, in turns, of which the fastest counts.
const RUNS: usize = 60;

/// The texture, and what shaders bind of it.
pub(crate) struct Lookups<'a> {
    bench: &'a Bench,
    gpu: &'a Gpu,
    description: Description,
    pool: Pool,
    views: Views,
    pixels: wgpu::Buffer,
    data: wgpu::BindGroupLayout,
    second_atlas: wgpu::TextureView,
    sampler: wgpu::Sampler,
}

impl<'a> Lookups<'a> {
    pub(crate) fn new(bench: &'a Bench) -> Result<Lookups<'a>> {
        let gpu = &bench.gpu;
        let (device, queue) = (&gpu.device, &gpu.queue);
        let geometry = Geometry::new(GeometrySpec::image(TEXELS, TEXELS))?;
        let description = Description::one_layer(geometry, LayerFormat::R8);
        let tiles = description.geometry.page_count() + 4;
        let layout = PoolLayout::fit(&description, tiles * description.tile_bytes() as u64, limits(device))?;
        let pool = Pool::new(device, queue, &layout, &description.layers)?;
        let entry = |binding, ty| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty,
            count: None,
        };
        let data = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: None,
            entries: &[
                entry(
                    0,
                    wgpu::BindingType::Buffer {
                        ty: wgpu::BufferBindingType::Storage { read_only: false },
                        has_dynamic_offset: false,
                        min_binding_size: None,
                    },
                ),
                entry(
                    1,
                    wgpu::BindingType::Texture {
                        sample_type: wgpu::TextureSampleType::Float { filterable: true },
                        view_dimension: wgpu::TextureViewDimension::D2Array,
                        multisampled: false,
                    },
                ),
                entry(2, wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering)),
            ],
        });
        let pixels = device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: u64::from(PICTURE[0] * PICTURE[1]) * 16,
            usage: wgpu::BufferUsages::STORAGE,
            mapped_at_creation: false,
        });
        let second_atlas = second_atlas(device, &layout);
        let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            mipmap_filter: wgpu::MipmapFilterMode::Linear,
            ..Default::default()
        });
        let views = Views::new(device, queue, FeedbackMode::Separate);
        Ok(Lookups { bench, gpu, description, pool, views, pixels, data, second_atlas, sampler })
    }

    /// All pages of the levels from `finest` on.
    pub(crate) fn resident(&self, finest: u8) -> Vec<(PagePos, TableEntry)> {
        let geometry = &self.description.geometry;
        let pages = geometry.pages().skip(1).filter(|pos| pos.level >= finest);
        (1..).zip(pages).map(|(slot, pos)| (pos, TableEntry::new(pos.level, Slot::new(slot)))).collect()
    }

    /// A table that has been told what is resident.
    pub(crate) fn table(&self, kind: TableKind, resident: &[(PagePos, TableEntry)]) -> Result<Table> {
        let (device, queue, geometry) = (&self.gpu.device, &self.gpu.queue, &self.description.geometry);
        let mode = FeedbackMode::Separate;
        let mut tables = match kind {
            TableKind::Direct => PoolTables::direct(device, mode)?,
            TableKind::Hashed => PoolTables::hashed(device, queue, mode, self.pool.layout().slots())?,
        };
        tables.add(NUMBER, geometry, Slot::new(0))?;
        let change = |&(pos, entry): &(PagePos, TableEntry)| {
            let page = PageId::new(NUMBER, geometry.dims(), pos).context("a page of the texture")?;
            Ok(TableChange { page, rule: ChangeRule::Coarser, entry })
        };
        let changes = resident.iter().map(change).collect::<Result<Vec<TableChange>>>()?;
        let mut all = |_: TextureNumber, resident: &mut Vec<TableChange>| resident.clone_from(&changes);
        let mut encoder = device.create_command_encoder(&Default::default());
        let (changer, mut budget) = (PoolTableChanger::new(device, mode), u64::MAX);
        tables.apply(&changer, device, queue, &mut encoder, &changes, &mut all, &mut budget)?;
        let placement = tables.placement(NUMBER);
        let mut params = ParamStore::new(device, RECORD_WORDS)?;
        let record = texture_record(&RecordOf {
            geometry,
            voxels: None,
            id: ID,
            tail_slot: Slot::new(0),
            rule: LevelRule::default().within(geometry),
            placement: &placement,
        });
        params.set(NUMBER, &record);
        params.write(device, &mut encoder)?;
        queue.submit([encoder.finish()]);
        tables.submitted();
        params.submitted();
        Ok(Table { tables, params })
    }

    /// A direct table that is not filled downward.
    pub(crate) fn unfilled(&self, resident: &[(PagePos, TableEntry)]) -> Result<Table> {
        let geometry = &self.description.geometry;
        let table = self.table(TableKind::Direct, &self.resident(0))?;
        let placement = table.tables.placement(NUMBER);
        let buffer = table.tables.buffer().context("a direct table that is read from a buffer")?;
        let mut entries = vec![u32::MAX; buffer.size() as usize / 4];
        for &(pos, entry) in resident {
            let row = geometry.level(pos.level).pages[0];
            let place = placement.first_entry(pos.level) + pos.y * row + pos.x;
            entries[place as usize] = entry.to_bits();
        }
        self.gpu.queue.write_buffer(buffer, 0, bytemuck::cast_slice(&entries));
        Ok(table)
    }

    /// A pipeline whose text has a function of its own in the place of that name.
    pub(crate) fn case(&self, table: &Table, own: Option<Own>) -> Case {
        let device = &self.gpu.device;
        let kind = Kind {
            dims: vastex_core::Dims::D2,
            tables: if table.tables.is_hashed() { TableKind::Hashed } else { TableKind::Direct },
            pages: PageSides::of(&self.description.geometry),
            layer: 0,
            atlas: self.pool.atlas(0),
            scale: 1,
            filter: Filter::Trilinear,
            is_mixed: true,
        };
        let kinds = Kinds::of(kind, FeedbackMode::Separate, false);
        let module = shader_module(device, None, texts::picture(&wgsl(&kinds, BindingPlace::default()), own));
        let textures = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: None,
            entries: &layout_entries(&kinds, 0),
        });
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: None,
            bind_group_layouts: &[Some(&textures), Some(&self.data)],
            immediate_size: 0,
        });
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: None,
            layout: Some(&layout),
            module: &module,
            entry_point: Some("main"),
            compilation_options: Default::default(),
            cache: None,
        });
        let data = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &self.data,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: self.pixels.as_entire_binding() },
                wgpu::BindGroupEntry {
                    binding: 1,
                    resource: wgpu::BindingResource::TextureView(&self.second_atlas),
                },
                wgpu::BindGroupEntry { binding: 2, resource: wgpu::BindingResource::Sampler(&self.sampler) },
            ],
        });
        let bound = Bound {
            params: table.params.binding(),
            views: &self.views,
            sampler: &new_sampler(device),
            pools: vec![(&self.pool, table.tables.binding())],
        };
        let texture = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &textures,
            entries: &entries(&kinds, 0, &bound),
        });
        Case { pipeline, texture, data }
    }

    /// Plays all cases in turns, and gives the milliseconds of each.
    pub(crate) fn measure<const N: usize>(&self, cases: &[Case; N]) -> [f64; N] {
        let mut best = [Duration::MAX; N];
        for _ in 0..RUNS {
            for (case, best) in cases.iter().zip(&mut best) {
                *best = (*best).min(self.bench.clock.time(self.gpu, |encoder| case.run(encoder)));
            }
        }
        best.map(|best| best.as_secs_f64() * 1e3)
    }
}

/// The page table of the texture, and where it lies.
pub(crate) struct Table {
    tables: PoolTables,
    params: ParamStore,
}

/// A pipeline and what it reads.
pub(crate) struct Case {
    pipeline: wgpu::ComputePipeline,
    texture: wgpu::BindGroup,
    data: wgpu::BindGroup,
}

impl Case {
    fn run(&self, encoder: &mut wgpu::CommandEncoder) {
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.texture, &[]);
        pass.set_bind_group(1, &self.data, &[]);
        pass.dispatch_workgroups(PICTURE[0] / 8, PICTURE[1] / 8, 1);
    }
}

/// An atlas beside the pool's whose slots hold a second level: as large, with half of every tile below it.
fn second_atlas(device: &wgpu::Device, layout: &PoolLayout) -> wgpu::TextureView {
    let [width, height, images] = layout.size();
    let atlas = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("second levels"),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: images },
        mip_level_count: 2,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::R8Unorm,
        usage: wgpu::TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    });
    let dimension = Some(wgpu::TextureViewDimension::D2Array);
    atlas.create_view(&wgpu::TextureViewDescriptor { dimension, ..Default::default() })
}
