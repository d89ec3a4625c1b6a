//! Labels, whole numbers of up to 64 bits, come back from the GPU exactly as they are stored: every voxel of
//! every level, in both formats, whatever the page table.

use std::sync::Arc;

use vastex::source::{Codec, ReadFuture, Tile};
use vastex::{
    Description, Geometry, GeometrySpec, Layer, LayerFormat, Pace, PagePos, PoolSettings, Region, Settings,
    TableChoice, TextureSettings, Textures, TileSource,
};
use vastex_core::Box3;
use vastex_wgpu::test_device::{TestDevice, finish};

use crate::common::add_with;
use crate::common::texts::LABELS;
use crate::common::tiles::parts_of_tile;

/// Every voxel of every level has a label of its own: neighbours often differ in the upper half alone.
pub(crate) struct Labelled(Arc<Description>);

impl Labelled {
    pub(crate) fn new(format: LayerFormat) -> Arc<Labelled> {
        let spec = GeometrySpec { page: 16, border: 1, ..GeometrySpec::volume([50, 41, 30]) };
        let layer = Layer { is_mixable: false, ..Layer::new("labels", format) };
        Arc::new(Labelled(Arc::new(Description::new(Geometry::new(spec).unwrap(), vec![layer]))))
    }

    fn is_wide(&self) -> bool {
        self.0.layers[0].format == LayerFormat::Rg32Uint
    }

    /// Of a voxel that there is.
    fn label(&self, level: u8, [x, y, z]: [u32; 3]) -> u64 {
        let mixed = (x ^ (y << 8) ^ (z << 16)).wrapping_mul(0x9e37_79b1) ^ u32::from(level) << 28;
        match self.is_wide() {
            // The same lower half along x.
            true => u64::from(mixed) << 32 | u64::from(u32::MAX - y),
            false => mixed.into(),
        }
    }

    /// Of any voxel: beyond the faces the last ones go on.
    fn at(&self, level: u8, at: [i64; 3]) -> u64 {
        let size = self.0.geometry.level(level).size;
        self.label(level, std::array::from_fn(|a| at[a].clamp(0, i64::from(size[a]) - 1) as u32))
    }

    fn fill(&self, level: u8, of_level: Box3, offset: [u32; 3], tile: &mut [u8]) {
        let [across, down, _] = self.0.geometry.tile().map(|side| side as usize);
        let bytes = self.0.tile_bytes() / self.0.geometry.tile_texels() as usize;
        let [nx, ny, nz] = of_level.size;
        for (z, y, x) in (0..nz).flat_map(|z| (0..ny).flat_map(move |y| (0..nx).map(move |x| (z, y, x)))) {
            let from = std::array::from_fn(|a| of_level.origin[a] + i64::from([x, y, z][a]));
            let [tx, ty, tz] = [offset[0] + x, offset[1] + y, offset[2] + z].map(|n| n as usize);
            let to = ((tz * down + ty) * across + tx) * bytes;
            tile[to..to + bytes].copy_from_slice(&self.at(level, from).to_le_bytes()[..bytes]);
        }
    }
}

impl TileSource for Labelled {
    fn description(&self) -> &Arc<Description> {
        &self.0
    }

    fn read(&self, pos: PagePos) -> ReadFuture<'_> {
        let mut tile = vec![0; self.0.tile_bytes()];
        parts_of_tile(&self.0.geometry, pos, |level, part, offset| self.fill(level, part, offset, &mut tile));
        Box::pin(async move { Ok(Tile { codec: Codec::Raw, bytes: tile.into() }) })
    }
}

/// Textures of one volume of labels, all of it in the pool; and its id in shaders.
fn loaded(gpu: &TestDevice, source: &Arc<Labelled>, table: TableChoice) -> (Textures, vastex::TextureId) {
    let pace = Pace::LockStep { latency_frames: 1 };
    let pools = PoolSettings::of_bytes(400 * source.0.tile_bytes() as u64);
    let settings = Settings { pace, pools, whole_bytes: 0, ..Settings::default() };
    let mut textures = Textures::new(&gpu.device, &gpu.queue, settings).unwrap();
    let own = TextureSettings { page_table: table, ..TextureSettings::default() };
    let texture = add_with(&mut textures, source.clone(), own).unwrap();
    let ticket = textures.ahead().pin(texture, &Region::whole()).unwrap();
    for _ in 0..400 {
        textures.update().unwrap();
    }
    let progress = ticket.progress();
    assert_eq!(progress.resident, progress.pages, "all of it is loaded");
    (textures, texture)
}

/// What the GPU reads at these voxels: x, y, z and level.
fn read(
    gpu: &TestDevice,
    textures: &Textures,
    texture: vastex::TextureId,
    places: &[[u32; 4]],
) -> Vec<[u64; 2]> {
    let device = &gpu.device;
    let (kinds, id) = (textures.kinds(texture).unwrap(), textures.shader_id(texture).unwrap());
    let text = format!("{LABELS}\n{}\noverride ID: u32 = 0u;\n", textures.wgsl(&kinds));
    let constants = [("ID", f64::from(id))];
    let module = vastex_wgpu::shader_module(device, None, text);
    let entry = wgpu::BindGroupLayoutEntry {
        binding: 0,
        visibility: wgpu::ShaderStages::COMPUTE,
        ty: wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Storage { read_only: false },
            has_dynamic_offset: false,
            min_binding_size: None,
        },
        count: None,
    };
    let layout =
        device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: None, entries: &[entry] });
    let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: None,
        bind_group_layouts: &[Some(&textures.bind_group_layout(&kinds)), Some(&layout)],
        immediate_size: 0,
    });
    let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: None,
        layout: Some(&pipeline_layout),
        module: &module,
        entry_point: Some("main"),
        compilation_options: wgpu::PipelineCompilationOptions { constants: &constants, ..Default::default() },
        cache: None,
    });
    let bytes: &[u8] = bytemuck::cast_slice(places);
    let buffer = |usage| {
        let size = bytes.len() as u64;
        device.create_buffer(&wgpu::BufferDescriptor { label: None, size, usage, mapped_at_creation: false })
    };
    use wgpu::BufferUsages as Usage;
    let storage = buffer(Usage::STORAGE | Usage::COPY_DST | Usage::COPY_SRC);
    let read = buffer(Usage::MAP_READ | Usage::COPY_DST);
    gpu.queue.write_buffer(&storage, 0, bytes);
    let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &layout,
        entries: &[wgpu::BindGroupEntry { binding: 0, resource: storage.as_entire_binding() }],
    });
    let mut encoder = device.create_command_encoder(&Default::default());
    let mut pass = encoder.begin_compute_pass(&Default::default());
    pass.set_pipeline(&pipeline);
    pass.set_bind_group(0, textures.bind_group(texture).unwrap(), &[]);
    pass.set_bind_group(1, &group, &[]);
    pass.dispatch_workgroups((places.len() as u32).div_ceil(64), 1, 1);
    drop(pass);
    encoder.copy_buffer_to_buffer(&storage, 0, &read, 0, bytes.len() as u64);
    gpu.queue.submit([encoder.finish()]);
    read.map_async(wgpu::MapMode::Read, .., |_| {});
    finish(device);
    let found: Vec<[u32; 4]> = bytemuck::pod_collect_to_vec(&read.get_mapped_range(..).unwrap());
    let wide = |low: u32, high: u32| u64::from(low) | u64::from(high) << 32;
    found.into_iter().map(|[a, b, c, d]| [wide(a, b), wide(c, d)]).collect()
}

#[test]
fn labels_are_what_is_stored() {
    let gpu = TestDevice::new();
    for (format, table) in [
        (LayerFormat::R32Uint, TableChoice::Direct),
        (LayerFormat::Rg32Uint, TableChoice::Direct),
        (LayerFormat::Rg32Uint, TableChoice::Hashed),
    ] {
        let source = Labelled::new(format);
        let (textures, texture) = loaded(&gpu, &source, table);
        let mut places = Vec::new();
        for level in 0..=source.0.geometry.coarsest() {
            let [nx, ny, nz] = source.0.geometry.level(level).size;
            let of_row = move |z, y| (0..nx).map(move |x| [x, y, z, u32::from(level)]);
            places.extend((0..nz).flat_map(|z| (0..ny).flat_map(move |y| of_row(z, y))));
        }
        for (place, found) in places.iter().zip(read(&gpu, &textures, texture, &places)) {
            let [x, y, z, level] = *place;
            let at = |x: u32| source.at(level as u8, [x, y, z].map(i64::from));
            assert_eq!(found, [at(x), at(x + 1)], "{format:?}, {table:?}: {place:?}");
        }
    }
}

#[test]
fn images_have_no_labels() {
    let spec = GeometrySpec::image(300, 200);
    let layer = Layer { is_mixable: false, ..Layer::new("labels", LayerFormat::R32Uint) };
    let description = Arc::new(Description::new(Geometry::new(spec).unwrap(), vec![layer]));
    let gpu = TestDevice::new();
    let mut textures = Textures::new(&gpu.device, &gpu.queue, Settings::default()).unwrap();
    let refused = add_with(&mut textures, Arc::new(Labelled(description)), TextureSettings::default());
    assert!(refused.unwrap_err().to_string().contains("volumes alone"), "said why");
}
