//! A small world for GPU tests: a texture of noise, some pages of it resident, on the CPU and on the GPU
//! alike.

use std::collections::BTreeMap;
use std::sync::LazyLock;

use vastex_core::{
    ChangeRule, Description, Geometry, HashedTextureTable, Layer, LayerFormat, LevelRule, PageId,
    PageNumbering, PagePos, PageTable, PoolLayout, Slot, TableChange, TableEntry, TableImage, TextureNumber,
};
use vastex_wgpu::test_device::{TestDevice, finish};
use vastex_wgpu::{
    BindingPlace, Bound, FeedbackMode, Filter, Kind, Kinds, PageSides, ParamStore, Pool, PoolTableChanger,
    PoolTables, RECORD_WORDS, RecordOf, TableKind, Views, entries, layout_entries, limits, new_sampler,
    shader_id, texture_record, wgsl,
};

use crate::test_text::TestText;

/// One device for all tests that leave it whole.
pub(crate) static GPU: LazyLock<TestDevice> = LazyLock::new(TestDevice::new);

/// The texture's number in these tests; its high bits and low bits differ.
pub(crate) const NUMBER: TextureNumber = TextureNumber::new(1029).unwrap();

/// Small, seeded and the same everywhere (xorshift).
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    pub(crate) fn below(&mut self, n: usize) -> usize {
        (self.next() >> 16) as usize % n
    }

    /// 0 to 1.
    pub(crate) fn unit(&mut self) -> f32 {
        (self.next() >> 40) as f32 / (1u64 << 24) as f32
    }

    pub(crate) fn between(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.unit()
    }
}

/// A texture whose tiles are noise, borders included, so that any wrong texel shows.
pub(crate) struct World {
    pub(crate) geometry: Geometry,
    pub(crate) description: Description,
    /// The layer that is sampled.
    pub(crate) layer: Layer,
    pub(crate) image: Box<dyn PageTable>,
    /// Texels of that layer.
    pub(crate) tiles: BTreeMap<Slot, Vec<u8>>,
    pub(crate) pool: Pool,
    pub(crate) tables: PoolTables,
    pub(crate) params: ParamStore,
    /// What shaders call it.
    pub(crate) id: u32,
    pub(crate) number: TextureNumber,
    pub(crate) rule: LevelRule,
    /// What made the table what it is.
    pub(crate) changes: Vec<TableChange>,
}

/// What shaders of some kinds bind of a world, and their text.
pub(crate) struct Bindings {
    pub(crate) kinds: Kinds,
    pub(crate) layout: wgpu::BindGroupLayout,
    pub(crate) sampler: wgpu::Sampler,
    pub(crate) views: Views,
}

impl Bindings {
    /// For a kind, in bind group 0.
    pub(crate) fn new(gpu: &TestDevice, kind: Kind, mode: FeedbackMode, fade: bool) -> Bindings {
        Bindings::of(gpu, Kinds::of(kind, mode, fade))
    }

    pub(crate) fn of(gpu: &TestDevice, kinds: Kinds) -> Bindings {
        let layout = gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: None,
            entries: &layout_entries(&kinds, 0),
        });
        let views = Views::new(&gpu.device, &gpu.queue, kinds.mode());
        Bindings { layout, sampler: new_sampler(&gpu.device), views, kinds }
    }

    /// A shader's text, this text, and the id of the texture that it is to sample as `ID`.
    pub(crate) fn text(&self, shader: &str, id: u32) -> TestText {
        let text = format!("{shader}\n{}", wgsl(&self.kinds, BindingPlace::default()));
        TestText::new(text).with("ID", id)
    }

    /// The bind group of a world.
    pub(crate) fn group(&self, gpu: &TestDevice, world: &World) -> wgpu::BindGroup {
        self.group_through(gpu, &world.tables, &world.params, world)
    }

    /// The same through other page tables.
    pub(crate) fn group_through(
        &self,
        gpu: &TestDevice,
        tables: &PoolTables,
        params: &ParamStore,
        world: &World,
    ) -> wgpu::BindGroup {
        self.group_of(gpu, params, vec![(&world.pool, tables)])
    }

    /// The same of several pools.
    pub(crate) fn group_of(
        &self,
        gpu: &TestDevice,
        params: &ParamStore,
        pools: Vec<(&Pool, &PoolTables)>,
    ) -> wgpu::BindGroup {
        let pools = pools.into_iter().map(|(pool, tables)| (pool, tables.binding())).collect();
        let bound = Bound { params: params.binding(), views: &self.views, sampler: &self.sampler, pools };
        gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &self.layout,
            entries: &entries(&self.kinds, 0, &bound),
        })
    }
}

/// The array of records of some worlds.
pub(crate) fn params_of(gpu: &TestDevice, records: &[(TextureNumber, Vec<[u32; 4]>)]) -> ParamStore {
    let mut params = ParamStore::new(&gpu.device, RECORD_WORDS).unwrap();
    records.iter().for_each(|(number, record)| params.set(*number, record));
    write_params(gpu, &mut params);
    params
}

fn write_params(gpu: &TestDevice, params: &mut ParamStore) {
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    params.write(&gpu.device, &mut encoder).unwrap();
    gpu.queue.submit([encoder.finish()]);
    params.submitted();
}

impl World {
    /// How a layer of it is read by a filter.
    pub(crate) fn kind(&self, layer: usize, filter: Filter) -> Kind {
        Kind {
            dims: self.geometry.dims(),
            tables: if self.tables.is_hashed() { TableKind::Hashed } else { TableKind::Direct },
            pages: PageSides::of(&self.geometry),
            layer: layer as u8,
            atlas: self.pool.atlas(layer),
            scale: self.description.layers[layer].scale,
            filter,
            is_mixed: true,
        }
    }

    /// Its record, with its page table in some place.
    pub(crate) fn record(&self, tables: &PoolTables) -> Vec<[u32; 4]> {
        let placement = tables.placement(self.number);
        texture_record(&RecordOf {
            geometry: &self.geometry,
            voxels: None,
            id: self.id,
            tail_slot: self.tail_slot(),
            rule: self.rule,
            placement: &placement,
        })
    }

    /// Tells shaders what its record says now.
    pub(crate) fn tell(&mut self, gpu: &TestDevice) {
        let record = self.record(&self.tables);
        self.params.set(self.number, &record);
        write_params(gpu, &mut self.params);
    }

    /// Sets how its levels are chosen.
    pub(crate) fn set_rule(&mut self, gpu: &TestDevice, rule: LevelRule) {
        self.rule = rule.within(&self.geometry);
        self.tell(gpu);
    }

    /// A texture of one layer, about `share` of its pages resident, in shuffled slots; every other seed has a
    /// hashed page table.
    pub(crate) fn new(
        gpu: &TestDevice,
        geometry: &Geometry,
        format: LayerFormat,
        share: f32,
        seed: u64,
    ) -> World {
        World::of(gpu, &Description::one_layer(geometry.clone(), format), 0, share, seed)
    }

    /// The same for layer number `index` of a texture.
    pub(crate) fn of(
        gpu: &TestDevice,
        description: &Description,
        index: usize,
        share: f32,
        seed: u64,
    ) -> World {
        let mut random = Random(seed | 1);
        let mut resident: Vec<PagePos> = description.geometry.pages().skip(1).collect();
        resident.retain(|_| random.unit() < share);
        // What is sampled is the same through either kind.
        let kind = [TableKind::Direct, TableKind::Hashed][seed as usize % 2];
        World::with(gpu, description, index, resident, kind, seed)
    }

    /// The same with these pages resident beside the tail, through a table of a kind.
    pub(crate) fn with(
        gpu: &TestDevice,
        description: &Description,
        index: usize,
        resident: Vec<PagePos>,
        kind: TableKind,
        seed: u64,
    ) -> World {
        World::numbered(gpu, description, index, resident, kind, seed, NUMBER, FeedbackMode::Separate)
    }

    /// The same of a texture of this number, for shaders of a mode of feedback.
    #[expect(clippy::too_many_arguments, reason = "a test's world")]
    pub(crate) fn numbered(
        gpu: &TestDevice,
        description: &Description,
        index: usize,
        mut resident: Vec<PagePos>,
        kind: TableKind,
        seed: u64,
        number: TextureNumber,
        mode: FeedbackMode,
    ) -> World {
        description.check().unwrap();
        let geometry = &description.geometry;
        let mut random = Random(seed | 2);
        resident.insert(0, geometry.tail_pos());
        let mut slots: Vec<Slot> = (0..resident.len() as u32 + 3).map(Slot::new).collect();
        for i in (1..slots.len()).rev() {
            slots.swap(i, random.below(i + 1));
        }
        let tile_bytes = description.tile_bytes();
        // Slightly too many bytes for a square, so that several images and a ragged grid are met.
        let mut limits = limits(&gpu.device);
        limits.max_side = 4 * geometry.tile()[0];
        let layout =
            PoolLayout::fit(description, (slots.len() + 2) as u64 * tile_bytes as u64 * 2, limits).unwrap();
        assert!(layout.slots() as usize >= slots.len(), "{layout:?}");
        let pool = Pool::new(&gpu.device, &gpu.queue, &layout, &description.layers).unwrap();
        let mut tiles = BTreeMap::new();
        let mut changes = Vec::new();
        for (&pos, &slot) in resident.iter().zip(&slots) {
            let tile: Vec<u8> =
                description.layers.iter().flat_map(|layer| noise(description, layer, &mut random)).collect();
            pool.upload(&gpu.queue, slot, &tile).unwrap();
            tiles.insert(slot, vastex_tiles::decode_layer(description, index, &tile.into()).to_vec());
            if !geometry.is_tail(pos) {
                let page = PageId::new(number, geometry.dims(), pos).unwrap();
                let entry = TableEntry::new(pos.level, slot);
                changes.push(TableChange { page, rule: ChangeRule::Coarser, entry });
            }
        }
        let tables = tables_of(gpu, geometry, number, slots[0], kind, mode, &changes);
        let image = image_of(geometry, number, slots[0], &changes);
        let mut world = World {
            geometry: geometry.clone(),
            description: description.clone(),
            layer: description.layers[index].clone(),
            image,
            tiles,
            pool,
            tables,
            params: ParamStore::new(&gpu.device, RECORD_WORDS).unwrap(),
            id: shader_id(number, 3),
            number,
            rule: LevelRule::default().within(geometry),
            changes,
        };
        world.tell(gpu);
        world
    }

    /// The slot of the tail.
    pub(crate) fn tail_slot(&self) -> Slot {
        self.image.lookup(self.geometry.tail_pos()).slot()
    }
}

/// Page tables of one texture after these loads.
pub(crate) fn tables_of(
    gpu: &TestDevice,
    geometry: &Geometry,
    number: TextureNumber,
    tail: Slot,
    kind: TableKind,
    mode: FeedbackMode,
    changes: &[TableChange],
) -> PoolTables {
    let (device, queue) = (&gpu.device, &gpu.queue);
    let mut tables = match kind {
        TableKind::Direct => PoolTables::direct(device, mode).unwrap(),
        TableKind::Hashed => PoolTables::hashed(device, queue, mode, changes.len() as u32 + 1).unwrap(),
    };
    tables.add(number, geometry, tail).unwrap();
    let changer = PoolTableChanger::new(device, mode);
    let (mut budget, mut applied) = (u64::MAX, false);
    while !applied || !tables.is_settled() {
        let changes = if applied { &[] } else { changes };
        let mut encoder = device.create_command_encoder(&Default::default());
        let resident = &mut |_: TextureNumber, all: &mut Vec<TableChange>| all.extend_from_slice(changes);
        tables.apply(&changer, device, queue, &mut encoder, changes, resident, &mut budget).unwrap();
        queue.submit([encoder.finish()]);
        tables.submitted();
        applied = true;
    }
    tables
}

/// What a table must say after these loads: from a direct image, where there may be one.
fn image_of(
    geometry: &Geometry,
    number: TextureNumber,
    tail: Slot,
    changes: &[TableChange],
) -> Box<dyn PageTable> {
    if PageNumbering::new(geometry).entries() > TableImage::MOST_ENTRIES {
        let mut image = HashedTextureTable::new(geometry, number, tail);
        image.table.apply(changes);
        return Box::new(image);
    }
    let mut image = TableImage::new(geometry, tail);
    changes.iter().for_each(|change| {
        image.apply(geometry, change);
    });
    Box::new(image)
}

/// A layer's part of a tile, of random texels: floats from 0 to 1, blocks of any content that means
/// something.
fn noise(description: &Description, layer: &Layer, random: &mut Random) -> Vec<u8> {
    let bytes = description.layer_bytes(layer);
    let block = |random: &mut Random| match layer.format {
        LayerFormat::R16Float | LayerFormat::Rgba16Float => {
            half::f16::from_f32(random.unit()).to_le_bytes().to_vec()
        }
        LayerFormat::R32Float => random.unit().to_le_bytes().to_vec(),
        LayerFormat::Bc6h => {
            let mut block = [random.next().to_le_bytes(), random.next().to_le_bytes()].concat();
            // Of the modes that begin with two ones, four are reserved; the one of zeros is not.
            if block[0] & 3 == 3 {
                block[0] &= !0x1c;
            }
            block
        }
        _ => random.next().to_le_bytes().to_vec(),
    };
    std::iter::repeat_with(|| block(random)).take(bytes).flatten().take(bytes).collect()
}

/// A buffer's contents.
pub(crate) fn read<T: bytemuck::Pod>(gpu: &TestDevice, buffer: &wgpu::Buffer) -> Vec<T> {
    let copy = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: buffer.size(),
        usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    encoder.copy_buffer_to_buffer(buffer, 0, &copy, 0, buffer.size());
    gpu.queue.submit([encoder.finish()]);
    copy.map_async(wgpu::MapMode::Read, .., |result| result.unwrap());
    finish(&gpu.device);
    bytemuck::pod_collect_to_vec(&copy.get_mapped_range(..).unwrap())
}

/// A storage buffer with contents.
pub(crate) fn storage(gpu: &TestDevice, contents: &[u8]) -> wgpu::Buffer {
    let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST;
    let size = contents.len() as u64;
    let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size,
        usage,
        mapped_at_creation: false,
    });
    gpu.queue.write_buffer(&buffer, 0, contents);
    buffer
}
