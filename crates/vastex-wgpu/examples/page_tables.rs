//! What a lookup costs by the kind of page table: direct and filled downward, direct with a loop up the levels in the shader, hashed;
//! with everything wanted resident, and with less and less of it. First each alone, then as shaders have them, which ask the texture which
//! kind it has.
//!
//! `cargo run --release -p vastex-wgpu --example page_tables` prints the best of several runs of each. A picture is
//! sampled trilinearly (two lookups) in a compute shader, at levels that differ over it as on a plane seen aslant. Of a software driver the
//! processors' time counts.

#![expect(clippy::print_stdout, reason = "an example tells what it has measured")]
#![expect(clippy::unwrap_used, reason = "it measures on a device that is there")]

use std::time::{Duration, Instant};

use vastex_core::{
    ChangeRule, Description, Geometry, GeometrySpec, LayerFormat, PageId, PagePos, PoolLayout, Slot,
    TableChange, TableEntry, TableLayout, TextureId,
};
use vastex_wgpu::test_device::TestDevice;
use vastex_wgpu::{
    BindLayout, FeedbackWay, Filter, Pool, ShaderOptions, TableBuffers, TableChanger, TableChoice,
    ViewBuffer, limits, wgsl,
};

const NUMBER: TextureId = TextureId::new(3).unwrap();
/// Texels of the texture per axis.
const TEXELS: u32 = 1 << 13;
/// Pixels of the picture.
const PICTURE: [u32; 2] = [320, 192];
/// Runs of each, of which the fastest counts; taken in turns, so that what else the machine does falls on all alike.
const RUNS: usize = 80;

/// A plane seen aslant: from magnified below to some levels up above.
const PICTURE_SHADER: &str = "
    @group(1) @binding(0) var<storage, read_write> pixels: array<vec4<f32>>;
    @compute @workgroup_size(8, 8) fn main(@builtin(global_invocation_id) id: vec3<u32>) {
        let size = vec2<f32>(320.0, 192.0);
        let at = vec2<f32>(id.xy) / size;
        let depth = 1.0 / (0.06 + at.y);
        let uv = vec2<f32>(0.5 + (at.x - 0.5) * depth * 0.055, 0.05 + 0.055 * depth);
        let along = depth * 0.055 / size.x;
        pixels[id.y * 320u + id.x] =
            vastex_sample_grad(uv, vec2<f32>(along, 0.0), vec2<f32>(0.0, along * depth * 0.6));
    }";

/// In the place of `vastex_entry`: the walk up the levels of a table in which a page that is not resident has no entry.
const LOOP: &str = "
fn vastex_entry(texel: vec2<u32>, wanted: u32) -> u32 {
    for (var level = max(wanted, vastex_texture.table_level); level < vastex_texture.tail_level; level++) {
        let page = vastex_page_from_texel(texel, level);
        let row = vastex_texture.levels[level].pages.x;
        let entry = vastex_table_entry(vastex_texture.levels[level].first_entry + page.y * row + page.x);
        if entry != VASTEX_NONE {
            return entry;
        }
    }
    return vastex_texture.tail_level << VASTEX_ENTRY_SLOT_BITS | vastex_texture.tail_slot;
}
";

/// In its place: the one read of a table that is filled downward, without the question which kind it is.
const FILLED: &str = "
fn vastex_entry(texel: vec2<u32>, wanted: u32) -> u32 {
    let level = max(wanted, vastex_texture.table_level);
    let page = vastex_page_from_texel(texel, level);
    let row = vastex_texture.levels[level].pages.x;
    return vastex_table_entry(vastex_texture.levels[level].first_entry + page.y * row + page.x);
}
";

/// In its place: the hash table, without that question.
const HASHED: &str = "
fn vastex_entry(texel: vec2<u32>, wanted: u32) -> u32 {
    return vastex_hashed_entry(texel, wanted);
}
";

struct Bench {
    gpu: TestDevice,
    description: Description,
    pool: Pool,
    layout: BindLayout,
    view: ViewBuffer,
    pixels: wgpu::Buffer,
    data: wgpu::BindGroupLayout,
}

impl Bench {
    fn new() -> Bench {
        let gpu = TestDevice::new();
        let (device, queue) = (&gpu.device, &gpu.queue);
        let geometry = Geometry::new(GeometrySpec::image(TEXELS, TEXELS)).unwrap();
        let description = Description::one_layer(geometry, LayerFormat::R8);
        let tiles = description.geometry.page_count() + 4;
        let layout =
            PoolLayout::fit(&description, tiles * description.tile_bytes() as u64, limits(device)).unwrap();
        let pool = Pool::new(device, queue, &layout, &description.layers).unwrap();
        let data = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: None,
            entries: &[wgpu::BindGroupLayoutEntry {
                binding: 0,
                visibility: wgpu::ShaderStages::COMPUTE,
                ty: wgpu::BindingType::Buffer {
                    ty: wgpu::BufferBindingType::Storage { read_only: false },
                    has_dynamic_offset: false,
                    min_binding_size: None,
                },
                count: None,
            }],
        });
        let pixels = device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: u64::from(PICTURE[0] * PICTURE[1]) * 16,
            usage: wgpu::BufferUsages::STORAGE,
            mapped_at_creation: false,
        });
        let layout = BindLayout::new(device, pool.atlas(0), FeedbackWay::Separate);
        let view = ViewBuffer::new(device, queue, FeedbackWay::Separate);
        Bench { description, pool, layout, view, pixels, data, gpu }
    }

    /// All pages of the levels from `finest` on.
    fn resident(&self, finest: u8) -> Vec<(PagePos, TableEntry)> {
        let geometry = &self.description.geometry;
        let pages = geometry.pages().skip(1).filter(|pos| pos.level >= finest);
        (1..).zip(pages).map(|(slot, pos)| (pos, TableEntry::new(pos.level, Slot::new(slot)))).collect()
    }

    /// A table that has been told what is resident.
    fn table(&self, choice: TableChoice, resident: &[(PagePos, TableEntry)]) -> TableBuffers {
        let (device, queue, geometry) = (&self.gpu.device, &self.gpu.queue, &self.description.geometry);
        let mut table =
            TableBuffers::new(device, queue, geometry, NUMBER, Slot::new(0), choice, FeedbackWay::Separate)
                .unwrap();
        table.grow(device, queue, 0).unwrap();
        let change = |&(pos, entry): &(PagePos, TableEntry)| TableChange {
            page: PageId::new(NUMBER, geometry.dims(), pos).unwrap(),
            rule: ChangeRule::Coarser,
            entry,
        };
        let changes: Vec<TableChange> = resident.iter().map(change).collect();
        let mut encoder = device.create_command_encoder(&Default::default());
        TableChanger::new(device, FeedbackWay::Separate)
            .apply(device, queue, &mut encoder, &mut table, &changes)
            .unwrap();
        queue.submit([encoder.finish()]);
        table
    }

    /// A direct table that is not filled downward.
    fn unfilled(&self, resident: &[(PagePos, TableEntry)]) -> TableBuffers {
        let layout = TableLayout::new(&self.description.geometry);
        let table = self.table(TableChoice::Direct, &[]);
        let mut entries = vec![u32::MAX; layout.entries() as usize];
        for &(pos, entry) in resident {
            entries[layout.entry_of(pos) as usize] = entry.to_bits();
        }
        self.gpu.queue.write_buffer(table.entries().unwrap(), 0, bytemuck::cast_slice(&entries));
        table
    }

    fn case(&self, table: &TableBuffers, entry: Option<&str>) -> Case {
        let device = &self.gpu.device;
        let options = ShaderOptions {
            filter: Filter::Trilinear,
            atlas: self.pool.atlas(0),
            ..ShaderOptions::default()
        };
        let mut text = wgsl(&options);
        if let Some(entry) = entry {
            let first = text.find("fn vastex_entry(").unwrap();
            let end = first + text[first..].find("\n}\n").unwrap() + 3;
            text.replace_range(first..end, entry);
        }
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: None,
            source: wgpu::ShaderSource::Wgsl((text + PICTURE_SHADER).into()),
        });
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
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: self.pixels.as_entire_binding() }],
        });
        let texture = self.layout.bind_group(device, table, &self.pool, 0, &self.view);
        Case { pipeline, texture, data, best: Duration::MAX }
    }

    /// Plays all cases in turns, and gives the milliseconds of each.
    fn measure<const N: usize>(&self, mut cases: [Case; N]) -> [f64; N] {
        for _ in 0..RUNS {
            cases.iter_mut().for_each(|case| case.run(&self.gpu));
        }
        cases.map(|case| case.best.as_secs_f64() * 1e3)
    }
}

/// A pipeline and what it reads.
struct Case {
    pipeline: wgpu::ComputePipeline,
    texture: wgpu::BindGroup,
    data: wgpu::BindGroup,
    best: Duration,
}

impl Case {
    fn run(&mut self, gpu: &TestDevice) {
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.texture, &[]);
        pass.set_bind_group(1, &self.data, &[]);
        pass.dispatch_workgroups(PICTURE[0] / 8, PICTURE[1] / 8, 1);
        drop(pass);
        let encoder = encoder.finish();
        let start = (Instant::now(), processor_time());
        gpu.queue.submit([encoder]);
        gpu.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
        let is_software = gpu.info.device_type == wgpu::DeviceType::Cpu;
        let taken = match (start.1, processor_time()) {
            (Some(before), Some(after)) if is_software => after.saturating_sub(before),
            _ => start.0.elapsed(),
        };
        self.best = self.best.min(taken);
    }
}

/// What all threads of this process have had of the processors, where the system says so: of a software driver it is the work, whatever
/// else the machine does.
fn processor_time() -> Option<Duration> {
    let threads = std::fs::read_dir("/proc/self/task").ok()?;
    let of_thread = |thread: std::fs::DirEntry| {
        let said = std::fs::read_to_string(thread.path().join("schedstat")).ok()?;
        said.split_whitespace().next()?.parse().ok().map(Duration::from_nanos)
    };
    Some(threads.flatten().filter_map(of_thread).sum())
}

fn main() {
    let bench = Bench::new();
    println!("adapter: {}", bench.gpu.info.name);
    println!("ms         resident: filled      loop    hashed | either: filled    hashed");
    for finest in [0, 1, 2, 3, 5] {
        let resident = bench.resident(finest);
        let filled = bench.table(TableChoice::Direct, &resident);
        let unfilled = bench.unfilled(&resident);
        let hashed = bench.table(TableChoice::Hashed, &resident);
        let taken = bench.measure([
            bench.case(&filled, Some(FILLED)),
            bench.case(&unfilled, Some(LOOP)),
            bench.case(&hashed, Some(HASHED)),
            bench.case(&filled, None),
            bench.case(&hashed, None),
        ]);
        let name = if finest == 0 { "all".to_owned() } else { format!("from level {finest} on") };
        let [filled, walked, hashed, filled_of_either, hashed_of_either] = taken;
        println!(
            "{name:19} {filled:7.2} {walked:9.2} {hashed:9.2} | {filled_of_either:14.2} {hashed_of_either:9.2}"
        );
    }
}
