//! Queries on the CPU: the same as the GPU says where the tiles are, and an honest level where they are not.

use std::sync::Arc;

use crate::common::tiles::parts_of_tile;
use vastex::source::{ReadFuture, Tile};
use vastex::{
    AddressMode, CpuSample, Description, Filter, Geometry, GeometrySpec, LayerFormat, Pace, PagePos,
    PoolSettings, Region, Settings, TextureId, Textures, TileSource,
};
use vastex_core::Box3;
use vastex_tiles::Codec;
use vastex_wgpu::test_device::{TestDevice, finish};

const SIZE: [u32; 2] = [500, 333];
const FORMATS: [LayerFormat; 4] =
    [LayerFormat::R16, LayerFormat::R16Float, LayerFormat::R32Float, LayerFormat::Rgba8];

/// Hills, a constant apart on each level, so that an answer says where and from which level it is.
struct Hills(Arc<Description>);

impl Hills {
    fn new(format: LayerFormat, address: AddressMode) -> Arc<Hills> {
        let spec = GeometrySpec { page: 32, address: [address; 3], ..GeometrySpec::image(SIZE[0], SIZE[1]) };
        Arc::new(Hills(Arc::new(Description::one_layer(Geometry::new(spec).unwrap(), format))))
    }

    fn height(level: u8, texel: [u32; 3]) -> f32 {
        let [x, y] = [0, 1].map(|a| (texel[a] << level) as f32);
        let grain = (texel[0] * 7 + texel[1] * 13) % 5;
        0.3 + 0.15 * (x * 0.02).sin() * (y * 0.03).cos() + 0.06 * f32::from(level) + 0.01 * grain as f32
    }

    fn fill(&self, level: u8, level_box: Box3, offset: [u32; 3], tile: &mut [u8]) {
        let (geometry, format) = (&self.0.geometry, self.0.layers[0].format);
        for (y, x) in (0..level_box.size[1]).flat_map(|y| (0..level_box.size[0]).map(move |x| (y, x))) {
            let texel = std::array::from_fn(|a| level_box.origin[a] + i64::from([x, y, 0][a]));
            let height = Hills::height(level, geometry.fold_texel(level, texel));
            let bytes = match format {
                LayerFormat::R16 => ((height * 65535.0) as u16).to_le_bytes().to_vec(),
                LayerFormat::R16Float => half::f16::from_f32(height).to_le_bytes().to_vec(),
                LayerFormat::R32Float => height.to_le_bytes().to_vec(),
                _ => vec![(height * 255.0) as u8; 4],
            };
            let at = ((offset[1] + y) * geometry.tile()[0] + offset[0] + x) as usize * bytes.len();
            tile[at..at + bytes.len()].copy_from_slice(&bytes);
        }
    }
}

impl TileSource for Hills {
    fn description(&self) -> &Arc<Description> {
        &self.0
    }

    fn read(&self, pos: PagePos) -> ReadFuture<'_> {
        let (geometry, mut tile) = (&self.0.geometry, vec![0; self.0.tile_bytes()]);
        parts_of_tile(geometry, pos, |level, of_level, offset| self.fill(level, of_level, offset, &mut tile));
        Box::pin(async move { Ok(Tile { codec: Codec::Raw, bytes: tile.into() }) })
    }
}

/// A texture whose tiles come only when they are asked for by hand.
struct World {
    gpu: TestDevice,
    textures: Textures,
    texture: TextureId,
}

fn settings() -> Settings {
    Settings { pace: Pace::LockStep { latency_frames: 1 }, ..Settings::default() }
}

impl World {
    fn new(source: Arc<dyn TileSource>, settings: Settings) -> World {
        let gpu = TestDevice::new();
        let mut textures = Textures::new(&gpu.device, &gpu.queue, settings).unwrap();
        let texture = textures.add_blocking(source).unwrap();
        World { gpu, textures, texture }
    }

    /// Has a region in the pool, on these levels, after some frames.
    fn load(&mut self, region: &Region) {
        let ticket = self.textures.ahead().pin(self.texture, region).unwrap();
        for _ in 0..200 {
            self.textures.update().unwrap();
        }
        let progress = ticket.progress();
        assert_eq!(progress.resident, progress.pages);
        self.textures.ahead().release(&ticket);
    }

    fn sample(&self, uv: [f32; 2], level: f32) -> CpuSample {
        self.textures.cpu().sample(self.texture, uv, level).unwrap()
    }

    /// What the GPU says at each of these points and levels.
    fn on_gpu(&self, inputs: &[[f32; 4]]) -> Vec<[f32; 4]> {
        let (device, queue) = (&self.gpu.device, &self.gpu.queue);
        let (kinds, id) =
            (self.textures.kinds(self.texture).unwrap(), self.textures.shader_id(self.texture).unwrap());
        let points = crate::common::texts::POINTS;
        let text = format!("{points}\n{}\noverride ID: u32 = 0u;\n", self.textures.wgsl(&kinds));
        let constants = [("ID", f64::from(id))];
        let module = vastex_wgpu::shader_module(device, None, text);
        let storage = wgpu::BindGroupLayoutEntry {
            binding: 0,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty: wgpu::BindingType::Buffer {
                ty: wgpu::BufferBindingType::Storage { read_only: false },
                has_dynamic_offset: false,
                min_binding_size: None,
            },
            count: None,
        };
        let layout = device
            .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: None, entries: &[storage] });
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: None,
            bind_group_layouts: &[Some(&self.textures.bind_group_layout(&kinds)), Some(&layout)],
            immediate_size: 0,
        });
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: None,
            layout: Some(&pipeline_layout),
            module: &module,
            entry_point: Some("main"),
            compilation_options: wgpu::PipelineCompilationOptions {
                constants: &constants,
                ..Default::default()
            },
            cache: None,
        });
        let bytes: &[u8] = bytemuck::cast_slice(inputs);
        let buffer = |usage| {
            let size = bytes.len() as u64;
            device.create_buffer(&wgpu::BufferDescriptor {
                label: None,
                size,
                usage,
                mapped_at_creation: false,
            })
        };
        use wgpu::BufferUsages as Usage;
        let points = buffer(Usage::STORAGE | Usage::COPY_DST | Usage::COPY_SRC);
        let read = buffer(Usage::MAP_READ | Usage::COPY_DST);
        queue.write_buffer(&points, 0, bytes);
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &layout,
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: points.as_entire_binding() }],
        });
        let mut encoder = device.create_command_encoder(&Default::default());
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, self.textures.bind_group(self.texture).unwrap(), &[]);
        pass.set_bind_group(1, &group, &[]);
        pass.dispatch_workgroups((inputs.len() as u32).div_ceil(64), 1, 1);
        drop(pass);
        encoder.copy_buffer_to_buffer(&points, 0, &read, 0, bytes.len() as u64);
        queue.submit([encoder.finish()]);
        read.map_async(wgpu::MapMode::Read, .., |_| {});
        finish(device);
        let bytes = read.get_mapped_range(..).unwrap();
        bytemuck::pod_collect_to_vec(&bytes)
    }

    /// All answers are the GPU's, in one texture whose tiles both have. Weights of the GPU's filter have 8
    /// bits, and so have its results for texels of 8 bits.
    fn check(&self, inputs: &[[f32; 4]]) {
        let mut sampler = self.textures.cpu().sampler(self.texture).unwrap();
        let format = self.textures.texture(self.texture).unwrap().description().layers[0].format;
        let tolerance = if format == LayerFormat::Rgba8 { 2.5 / 255.0 } else { 1.5e-3 };
        for (input, on_gpu) in inputs.iter().zip(self.on_gpu(inputs)) {
            let [u, v, level, _] = *input;
            let sample = sampler.sample([u, v], level);
            let near = sample.value.iter().zip(&on_gpu).all(|(a, b)| (a - b).abs() < tolerance);
            assert!(near, "{input:?}: {sample:?}, on the GPU {on_gpu:?}");
        }
    }
}

/// Points everywhere, beyond the edges too, on edges of pages and of the texture; at levels and between them.
fn inputs() -> Vec<[f32; 4]> {
    let mut state = 1u32;
    let mut random = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / (1 << 24) as f32
    };
    let mut inputs: Vec<_> =
        (0..800).map(|_| [random() * 3.0 - 1.0, random() * 3.0 - 1.0, random() * 9.0, 0.0]).collect();
    for level in 0..4u8 {
        let page = f32::from(32u16 << level);
        for texel in [0.0, page - 0.25, page, page + 0.25, 2.0 * page, SIZE[0] as f32 - 0.25, SIZE[0] as f32]
        {
            inputs.push([texel / SIZE[0] as f32, 0.4, f32::from(level), 0.0]);
            inputs.push([0.3, texel / SIZE[1] as f32, f32::from(level) + 0.5, 0.0]);
        }
    }
    inputs
}

#[test]
fn a_texel_is_what_is_stored_on_the_level_that_is_said() {
    for format in FORMATS {
        let source = Hills::new(format, AddressMode::Clamp);
        // A filter that blends, which texels do not.
        let mut world = World::new(source, Settings { filter: Filter::Bicubic, ..settings() });
        world.load(&Region::image(0..160, 0..96).on_levels(0..=0));
        let mut sampler = world.textures.cpu().sampler(world.texture).unwrap();
        let mut levels = [0; 2];
        for [x, y] in (0..SIZE[1]).step_by(7).flat_map(|y| (0..SIZE[0]).step_by(5).map(move |x| [x, y])) {
            for wanted in [0, 2] {
                let CpuSample { value, level } = sampler.texel([x, y], wanted);
                assert!(level >= f32::from(wanted) && level.fract() == 0.0, "{level} at {x},{y}");
                let level = level as u8;
                if wanted == 0 {
                    assert_eq!(sampler.resident_level([x, y]), level, "at {x},{y}");
                }
                levels[usize::from(level > wanted)] += 1;
                let height = Hills::height(level, [x >> level, y >> level, 0]);
                let stored = match format {
                    LayerFormat::R16 => f32::from((height * 65535.0) as u16) / 65535.0,
                    LayerFormat::R16Float => half::f16::from_f32(height).to_f32(),
                    LayerFormat::R32Float => height,
                    _ => f32::from((height * 255.0) as u8) / 255.0,
                };
                assert_eq!(value[0], stored, "{format:?} at {x},{y} on level {level}");
            }
        }
        assert!(levels.into_iter().all(|count| count > 100), "{levels:?}");
    }
}

#[test]
fn where_the_tiles_are_it_says_what_the_gpu_says() {
    use AddressMode::{Border, Clamp, Mirror, Wrap};
    for (format, address) in FORMATS.into_iter().zip([Clamp, Wrap, Mirror, Border]) {
        let mut world = World::new(Hills::new(format, address), settings());
        world.load(&Region::whole());
        world.check(&inputs());
        for level in [0.0, 2.5, 7.0] {
            assert_eq!(world.sample([0.6, 0.7], level).level, level, "{format:?}");
        }
        let coarsest =
            f32::from(world.textures.texture(world.texture).unwrap().description().geometry.coarsest());
        assert_eq!(world.sample([0.6, 0.7], 100.0).level, coarsest);
    }
}

#[test]
fn where_tiles_are_missing_it_answers_coarser_and_says_so() {
    let mut world = World::new(Hills::new(LayerFormat::R32Float, AddressMode::Clamp), settings());
    let tail =
        f32::from(world.textures.texture(world.texture).unwrap().description().geometry.tail().first_level());
    assert!(tail >= 3.0, "{tail}");
    assert_eq!(world.sample([0.1, 0.1], 0.0).level, tail, "the tail is always there");
    world.load(&Region::image(0..250, 0..166).on_levels(1..=1));
    assert_eq!(world.sample([0.1, 0.1], 0.0).level, 1.0);
    assert_eq!(world.sample([0.1, 0.1], 1.0).level, 1.0);
    let elsewhere = world.sample([0.9, 0.9], 1.0).level;
    assert!((2.0..=tail).contains(&elsewhere), "an ancestor of what was loaded: {elsewhere}");
    // Both say the same, whatever is missing.
    world.check(&inputs());
    let stats = world.textures.cpu().stats();
    assert!(stats.misses > 0 && stats.hits > 0 && stats.bytes == stats.tiles * 40 * 40 * 4, "{stats:?}");
}

#[test]
fn it_answers_from_the_ram_cache_after_an_eviction_and_from_coarser_tiles_after_that() {
    let source = Hills::new(LayerFormat::R16, AddressMode::Clamp);
    let tile = 40 * 40 * 2;
    // The pool holds two of three parts; the RAM cache everything.
    let pools = PoolSettings::of_bytes(tile * 60);
    let mut world = World::new(source.clone(), Settings { pools: pools.clone(), ..settings() });
    let parts = [(0..100, 0..100), (200..300, 100..200), (400..500, 233..333)];
    let parts = parts.map(|(columns, rows)| Region::image(columns, rows).on_levels(0..=0));
    parts.iter().for_each(|part| world.load(part));
    assert!(world.textures.stats().pager.evicted > 0, "the first part has left the pool");
    assert_eq!(world.sample([0.1, 0.1], 0.0).level, 0.0);
    // A RAM cache that holds next to nothing.
    let settings = Settings { pools, ram_cache_bytes: tile, ..settings() };
    let mut world = World::new(source.clone(), settings.clone());
    parts.iter().for_each(|part| world.load(part));
    let tail = f32::from(source.0.geometry.tail().first_level());
    assert_eq!([[0.1, 0.1], [0.81, 0.75]].map(|uv| world.sample(uv, 0.0).level), [tail; 2]);
    // What is kept is what is resident.
    let mut world = World::new(source, settings);
    assert!(world.textures.texture_mut(world.texture).unwrap().keep_for_cpu(0, true));
    parts.iter().for_each(|part| world.load(part));
    assert!(world.sample([0.1, 0.1], 0.0).level > 0.0, "it has left the pool");
    assert_eq!(world.sample([0.81, 0.75], 0.0).level, 0.0);
    let stats = world.textures.cpu().stats();
    assert!(stats.kept_tiles > 9 && stats.kept_bytes == stats.kept_tiles * tile, "{stats:?}");
    assert!(stats.kept_bytes <= world.textures.stats().pool_bytes, "{stats:?}");
    // In a pool of another size the tiles are in other slots.
    world.textures.memory().resize_pool(vastex::PoolId::new(0), tile * 80).unwrap();
    let in_corner = |n: u32| [0.82 + 0.01 * (n % 17) as f32, 0.72 + 0.01 * (n % 25) as f32, 0.0, 0.0];
    world.check(&(0..50).map(in_corner).collect::<Vec<_>>());
    assert_eq!(world.sample([0.81, 0.75], 0.0).level, 0.0);
    assert!(world.textures.texture_mut(world.texture).unwrap().keep_for_cpu(0, false));
    assert_eq!(world.textures.cpu().stats().kept_bytes, 0);
}

#[test]
fn nothing_that_is_asked_reads_or_panics() {
    let source = Hills::new(LayerFormat::R16, AddressMode::Wrap);
    let mut world = World::new(source, Settings { cpu_cache_bytes: 0, ..settings() });
    world.load(&Region::whole());
    let strange = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, f32::MIN_POSITIVE, -0.0];
    for (u, level) in strange.into_iter().flat_map(|u| strange.map(|level| (u, level))) {
        let _ = world.sample([u, 0.5], level);
    }
    assert_eq!(world.textures.cpu().stats().bytes, 0, "the budget holds");
    world.textures.remove(world.texture);
    assert_eq!(world.textures.cpu().sample(world.texture, [0.5; 2], 0.0), None);
    assert!(world.textures.texture_mut(world.texture).is_err());
}

#[test]
fn the_filter_is_the_gpus() {
    for filter in [Filter::Nearest, Filter::Bilinear] {
        let source = Hills::new(LayerFormat::R32Float, AddressMode::Clamp);
        let mut world = World::new(source, Settings { filter, ..settings() });
        world.load(&Region::whole());
        let inside =
            |n: u32| [(n as f32 + 0.3) / SIZE[0] as f32, (n as f32 + 0.3) / SIZE[1] as f32, 0.4, 0.0];
        world.check(&(0..300).map(inside).collect::<Vec<_>>());
        assert_eq!(world.sample([0.5; 2], 1.7).level, 1.0);
    }
}
