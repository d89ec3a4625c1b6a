//! A small world for GPU tests: a texture of noise, some pages of it resident, on the CPU and on the GPU alike.

use std::collections::BTreeMap;
use std::sync::LazyLock;

use vastex_core::{
    ChangeRule, Description, Geometry, HashedTable, Layer, LayerFormat, PageId, PageNumbering, PagePos,
    PageTable, PoolLayout, Slot, TableChange, TableEntry, TableImage, TextureId,
};
use vastex_wgpu::test_device::TestDevice;
use vastex_wgpu::{
    FeedbackWay, PageSides, Pool, TableBuffers, TableChanger, TableChoice, TableKinds, limits,
};

/// One device for all tests that leave it whole.
pub(crate) static GPU: LazyLock<TestDevice> = LazyLock::new(TestDevice::new);

/// The texture's number in these tests; its high bits and low bits differ.
pub(crate) const NUMBER: TextureId = TextureId::new(1029).unwrap();

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
    /// The layer that is sampled, and its number.
    pub(crate) layer: Layer,
    pub(crate) index: usize,
    pub(crate) image: Box<dyn PageTable>,
    /// Texels of that layer.
    pub(crate) tiles: BTreeMap<Slot, Vec<u8>>,
    pub(crate) pool: Pool,
    pub(crate) table: TableBuffers,
    /// What made the table what it is.
    pub(crate) changes: Vec<TableChange>,
}

impl World {
    /// What its shaders read.
    pub(crate) fn tables(&self) -> TableKinds {
        if self.table.hashed().is_some() { TableKinds::Hashed } else { TableKinds::Direct }
    }

    /// What its shaders know of its pages.
    pub(crate) fn pages(&self) -> PageSides {
        PageSides::of(&self.geometry)
    }

    /// A texture of one layer, about `share` of its pages resident, in shuffled slots; every other seed has a hashed page table.
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
        let choice = [TableChoice::Direct, TableChoice::Hashed][seed as usize % 2];
        World::with(gpu, description, index, resident, choice, seed)
    }

    /// The same with these pages resident beside the tail, through a table of a kind.
    pub(crate) fn with(
        gpu: &TestDevice,
        description: &Description,
        index: usize,
        mut resident: Vec<PagePos>,
        choice: TableChoice,
        seed: u64,
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
                let page = PageId::new(NUMBER, geometry.dims(), pos).unwrap();
                let entry = TableEntry::new(pos.level, slot);
                changes.push(TableChange { page, rule: ChangeRule::Coarser, entry });
            }
        }
        let table = table_of(gpu, geometry, slots[0], choice, &changes);
        let layer = description.layers[index].clone();
        let image = image_of(geometry, slots[0], &changes);
        World { geometry: geometry.clone(), layer, index, image, tiles, pool, table, changes }
    }

    /// The slot of the tail.
    pub(crate) fn tail_slot(&self) -> Slot {
        self.image.lookup(self.geometry.tail_pos()).slot()
    }
}

/// A page table of every level after these loads.
pub(crate) fn table_of(
    gpu: &TestDevice,
    geometry: &Geometry,
    tail: Slot,
    choice: TableChoice,
    changes: &[TableChange],
) -> TableBuffers {
    let (device, queue, way) = (&gpu.device, &gpu.queue, FeedbackWay::Separate);
    let mut table = TableBuffers::new(device, queue, geometry, NUMBER, tail, choice, way).unwrap();
    let mut encoder = device.create_command_encoder(&Default::default());
    let changer = TableChanger::new(device, way);
    changer.grow(device, queue, &mut encoder, &mut table, 0, &[], &[]).unwrap();
    queue.submit([encoder.finish()]);
    // A table that has all levels from the beginning, or is hashed, did not grow.
    let mut encoder = device.create_command_encoder(&Default::default());
    changer.apply(device, queue, &mut encoder, &mut table, changes).unwrap();
    queue.submit([encoder.finish()]);
    table
}

/// What a table must say after these loads: from a direct image, where there may be one.
fn image_of(geometry: &Geometry, tail: Slot, changes: &[TableChange]) -> Box<dyn PageTable> {
    if PageNumbering::new(geometry).entries() > TableImage::MOST_ENTRIES {
        let mut image = HashedTable::new(geometry, tail);
        image.apply(changes);
        return Box::new(image);
    }
    let mut image = TableImage::new(geometry, tail);
    changes.iter().for_each(|change| {
        image.apply(geometry, change);
    });
    Box::new(image)
}

/// A layer's part of a tile, of random texels: floats from 0 to 1, blocks of any content that means something.
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
    gpu.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
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
