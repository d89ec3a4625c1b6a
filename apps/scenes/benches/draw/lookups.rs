//! Trilinear samples of a texture in a compute shader, by page tables and functions of choice: at levels that differ over the picture as
//! on a plane seen aslant.

use std::time::Duration;

use anyhow::{Context, Result};
use vastex_core::{
    ChangeRule, Description, Geometry, GeometrySpec, LayerFormat, PageId, PageNumbering, PagePos, PoolLayout,
    Slot, TableChange, TableEntry, TextureId,
};
use vastex_scenes::Gpu;
use vastex_wgpu::{
    BindLayout, FeedbackWay, Filter, PageSides, Pool, ShaderOptions, TableBuffers, TableChanger, TableChoice,
    TableKinds, ViewBuffer, limits, shader_module, wgsl,
};

use crate::texts::{self, Own};
use crate::world::Bench;

const NUMBER: u16 = 3;
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
    number: TextureId,
    description: Description,
    pool: Pool,
    layout: BindLayout,
    view: ViewBuffer,
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
        let layout = BindLayout::new(device, pool.atlas(0), FeedbackWay::Separate);
        let view = ViewBuffer::new(device, queue, FeedbackWay::Separate);
        let number = TextureId::new(NUMBER).context("a texture's number")?;
        Ok(Lookups {
            bench,
            gpu,
            number,
            description,
            pool,
            layout,
            view,
            pixels,
            data,
            second_atlas,
            sampler,
        })
    }

    /// All pages of the levels from `finest` on.
    pub(crate) fn resident(&self, finest: u8) -> Vec<(PagePos, TableEntry)> {
        let geometry = &self.description.geometry;
        let pages = geometry.pages().skip(1).filter(|pos| pos.level >= finest);
        (1..).zip(pages).map(|(slot, pos)| (pos, TableEntry::new(pos.level, Slot::new(slot)))).collect()
    }

    /// A table that has been told what is resident.
    pub(crate) fn table(
        &self,
        choice: TableChoice,
        resident: &[(PagePos, TableEntry)],
    ) -> Result<TableBuffers> {
        let (device, queue, geometry) = (&self.gpu.device, &self.gpu.queue, &self.description.geometry);
        let mut table = TableBuffers::new(
            device,
            queue,
            geometry,
            self.number,
            Slot::new(0),
            choice,
            FeedbackWay::Separate,
        )?;
        let change = |&(pos, entry): &(PagePos, TableEntry)| {
            let page = PageId::new(self.number, geometry.dims(), pos).context("a page of the texture")?;
            Ok(TableChange { page, rule: ChangeRule::Coarser, entry })
        };
        let changes = resident.iter().map(change).collect::<Result<Vec<TableChange>>>()?;
        let mut encoder = device.create_command_encoder(&Default::default());
        let changer = TableChanger::new(device, FeedbackWay::Separate);
        changer.grow(device, queue, &mut encoder, &mut table, 0, &[], &[])?;
        queue.submit([encoder.finish()]);
        let mut encoder = device.create_command_encoder(&Default::default());
        changer.apply(device, queue, &mut encoder, &mut table, &changes)?;
        queue.submit([encoder.finish()]);
        Ok(table)
    }

    /// A direct table that is not filled downward.
    pub(crate) fn unfilled(&self, resident: &[(PagePos, TableEntry)]) -> Result<TableBuffers> {
        let layout = PageNumbering::new(&self.description.geometry);
        let table = self.table(TableChoice::Direct, &[])?;
        let mut entries = vec![u32::MAX; layout.entries() as usize];
        for &(pos, entry) in resident {
            entries[layout.entry_of(pos) as usize] = entry.to_bits();
        }
        let buffer = table.entries().context("a direct table that is read from a buffer")?;
        self.gpu.queue.write_buffer(buffer, 0, bytemuck::cast_slice(&entries));
        Ok(table)
    }

    /// A pipeline whose text has a function of its own in the place of that name.
    pub(crate) fn case(&self, table: &TableBuffers, tables: TableKinds, own: Option<Own>) -> Case {
        let device = &self.gpu.device;
        let options = ShaderOptions {
            filter: Filter::Trilinear,
            atlas: self.pool.atlas(0),
            tables,
            pages: PageSides::of(&self.description.geometry),
            ..ShaderOptions::default()
        };
        let module = shader_module(device, None, texts::picture(&wgsl(&options), own));
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: None,
            bind_group_layouts: &[Some(self.layout.layout()), Some(&self.data)],
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
        let texture = self.layout.bind_group(device, table, &self.pool, 0, &self.view);
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
    let [width, height] = layout.image_size();
    let atlas = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("second levels"),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: layout.images },
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
