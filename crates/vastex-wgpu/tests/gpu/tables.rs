//! Page tables on the GPU stay equal to the CPU's image of them, whatever is loaded and evicted.

use std::collections::BTreeMap;

use vastex_core::{
    ChangeRule, Dims, Geometry, GeometrySpec, HashedTable, PageId, PagePos, PageTable, Slot, TableChange,
    TableEntry, TableImage,
};
use vastex_wgpu::{FeedbackWay, TableBuffers, TableChanger, TableChoice};

use crate::common::{GPU, NUMBER, Random, read, storage};

/// The frames of a random run: what is evicted and loaded, slots used again at once included.
struct Run<'a> {
    geometry: &'a Geometry,
    pages: Vec<PagePos>,
    resident: BTreeMap<PagePos, Slot>,
    free: Vec<Slot>,
    random: Random,
}

impl Run<'_> {
    fn change(&self, pos: PagePos, rule: ChangeRule, entry: TableEntry) -> TableChange {
        TableChange { page: PageId::new(NUMBER, self.geometry.dims(), pos).unwrap(), rule, entry }
    }

    fn frame(&mut self) -> Vec<TableChange> {
        let count = self.random.below(30) + 1;
        let picks: Vec<_> = (0..count).map(|_| self.pages[self.random.below(self.pages.len())]).collect();
        let (random, resident) = (&mut self.random, &mut self.resident);
        let evicted: BTreeMap<_, _> =
            picks.iter().filter(|_| random.unit() < 0.6).filter_map(|p| resident.remove_entry(p)).collect();
        let mut changes: Vec<_> = evicted.iter().map(|(&pos, &slot)| self.eviction(pos, slot)).collect();
        self.free.extend(evicted.values());
        for pos in picks {
            if self.resident.contains_key(&pos) {
                continue;
            }
            let Some(slot) = self.free.pop() else { break };
            self.resident.insert(pos, slot);
            changes.push(self.change(pos, ChangeRule::Coarser, TableEntry::new(pos.level, slot)));
        }
        changes
    }

    fn eviction(&self, pos: PagePos, slot: Slot) -> TableChange {
        let mut ancestors = std::iter::successors(self.geometry.parent(pos), |&p| self.geometry.parent(p));
        let heir = ancestors.find(|p| self.resident.contains_key(p)).unwrap();
        let entry = TableEntry::new(heir.level, self.resident[&heir]);
        self.change(pos, ChangeRule::Naming(TableEntry::new(pos.level, slot)), entry)
    }
}

/// Direct and hashed, in buffers and in textures, with the same changes.
fn check(geometry: &Geometry, seed: u64) {
    for way in [FeedbackWay::Separate, FeedbackWay::Raw] {
        check_kind(geometry, seed, TableChoice::Direct, way);
        check_kind(geometry, seed, TableChoice::Hashed, way);
    }
}

/// What the GPU has of a table, wherever it lies.
pub(crate) fn words(table: &TableBuffers) -> Vec<u32> {
    let gpu = &*GPU;
    let Some(texture) = table.texture() else { return read(gpu, table.entries().unwrap()) };
    let size = texture.size();
    let buffer = storage(gpu, &vec![0; (size.width * size.height * 4) as usize]);
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let bytes_per_row = Some(size.width * 4);
    let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row, rows_per_image: None };
    let to = wgpu::TexelCopyBufferInfo { buffer: &buffer, layout };
    encoder.copy_texture_to_buffer(texture.as_image_copy(), to, size);
    gpu.queue.submit([encoder.finish()]);
    read(gpu, &buffer)
}

fn apply(changer: &TableChanger, table: &mut TableBuffers, changes: &[TableChange]) {
    let mut encoder = GPU.device.create_command_encoder(&Default::default());
    changer.apply(&GPU.device, &GPU.queue, &mut encoder, table, changes).unwrap();
    GPU.queue.submit([encoder.finish()]);
}

fn grow(
    changer: &TableChanger,
    table: &mut TableBuffers,
    level: u8,
    changes: &[TableChange],
    resident: &[TableChange],
) {
    let mut encoder = GPU.device.create_command_encoder(&Default::default());
    changer.grow(&GPU.device, &GPU.queue, &mut encoder, table, level, changes, resident).unwrap();
    // In a texture it is sent by and by.
    let mut budget = u64::MAX;
    changer.go_on(&GPU.device, &GPU.queue, &mut encoder, table, &mut budget).unwrap();
    GPU.queue.submit([encoder.finish()]);
}

fn check_kind(geometry: &Geometry, seed: u64, choice: TableChoice, way: FeedbackWay) {
    let gpu = &*GPU;
    let tail = Slot::new(70_000);
    let changer = TableChanger::new(&gpu.device, way);
    let mut table = TableBuffers::new(&gpu.device, &gpu.queue, geometry, NUMBER, tail, choice, way).unwrap();
    grow(&changer, &mut table, 0, &[], &[]);
    let mut image = TableImage::new(geometry, tail);
    let mut run = Run {
        geometry,
        pages: geometry.pages().skip(1).collect(),
        resident: BTreeMap::from([(geometry.tail_pos(), tail)]),
        free: (0..40).map(Slot::new).collect(),
        random: Random(seed),
    };
    for frame in 0..12 {
        let changes = run.frame();
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let sent = changer.apply(&gpu.device, &gpu.queue, &mut encoder, &mut table, &changes).unwrap();
        gpu.queue.submit([encoder.finish()]);
        for change in &changes {
            image.apply(geometry, change);
        }
        let expected: Vec<u32> = match table.hashed() {
            None => {
                if way == FeedbackWay::Separate {
                    assert_eq!(
                        sent.bytes,
                        if changes.is_empty() { 0 } else { 16 + 24 * changes.len() as u64 }
                    );
                }
                image.entries().iter().map(|entry| entry.to_bits()).collect()
            }
            Some(hashed) => {
                assert!(geometry.pages().all(|pos| hashed.lookup(pos) == image.lookup(pos)), "frame {frame}");
                hashed.buckets().iter().flat_map(|place| place.words()).collect()
            }
        };
        let mut found = words(&table);
        assert!(
            found.len() >= expected.len() && sent.bytes <= 4 * found.len() as u64
                || way == FeedbackWay::Separate
        );
        found.truncate(expected.len()); // a texture's last row may go on
        assert!(found == expected, "frame {frame} of {:?}: {changes:?}", geometry.spec());
    }
    assert!(run.resident.len() > 1, "nothing was ever resident");
}

#[test]
fn a_table_follows_random_loads_and_evictions() {
    for (n, size) in [[1000, 777], [777, 1000], [5000, 300], [300, 5000]].into_iter().enumerate() {
        let spec = GeometrySpec { page: [32, 40, 100, 37][n], ..GeometrySpec::image(size[0], size[1]) };
        check(&Geometry::new(spec).unwrap(), n as u64 + 1);
    }
}

#[test]
fn a_table_follows_with_factors_of_three_and_one() {
    let factors = [[3, 1, 1], [2, 3, 1], [1, 2, 1], [5, 5, 1], [100, 100, 1]];
    let spec = GeometrySpec { page: 16, ..GeometrySpec::image(1400, 900) };
    check(&Geometry::with_factors(spec, &factors).unwrap(), 9);
}

#[test]
fn a_table_of_a_volume_follows_too() {
    let spec = GeometrySpec {
        dims: Dims::D3,
        size: [90, 130, 70],
        page: 16,
        border: 2,
        ..GeometrySpec::image(1, 1)
    };
    check(&Geometry::new(spec).unwrap(), 11);
}

#[test]
fn a_table_grows_when_finer_pages_come() {
    let gpu = &*GPU;
    let geometry = &Geometry::new(GeometrySpec { page: 32, ..GeometrySpec::image(5000, 3000) }).unwrap();
    let tail = Slot::new(70_000);
    let changer = TableChanger::new(&gpu.device, FeedbackWay::Separate);
    let mut table = TableBuffers::new(
        &gpu.device,
        &gpu.queue,
        geometry,
        NUMBER,
        tail,
        TableChoice::Direct,
        FeedbackWay::Separate,
    )
    .unwrap();
    let mut image = TableImage::new(geometry, tail);
    let mut run = Run {
        geometry,
        pages: Vec::new(),
        resident: BTreeMap::from([(geometry.tail_pos(), tail)]),
        free: (0..400).map(Slot::new).collect(),
        random: Random(5),
    };
    let first = (0..).find(|&level| table.has_level(level)).unwrap();
    assert!(first >= 2, "levels to grow by");
    let mut bytes = table.bytes();
    for finest in (0..=first).rev() {
        run.pages = geometry.pages().skip(1).filter(|page| page.level >= finest).collect();
        // What is resident is told anew, then the frames go on; the first changes of the finer level are told the old table as well.
        let finer = run.resident.iter().filter(|(pos, _)| !geometry.is_tail(**pos));
        let told: Vec<TableChange> = finer
            .map(|(&pos, &slot)| run.change(pos, ChangeRule::Coarser, TableEntry::new(pos.level, slot)))
            .collect();
        let old = table.entries().unwrap().clone();
        grow(&changer, &mut table, finest, &[], &told);
        assert_eq!(
            (old != *table.entries().unwrap(), table.bytes() > bytes),
            (finest < first, finest < first)
        );
        assert!(table.has_level(finest) && (finest == 0 || !table.has_level(finest - 1)));
        bytes = table.bytes();
        for change in &told {
            image.apply(geometry, change);
        }
        for frame in 0..5 {
            let changes = if frame == 0 { Vec::new() } else { run.frame() };
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            changer.apply(&gpu.device, &gpu.queue, &mut encoder, &mut table, &changes).unwrap();
            gpu.queue.submit([encoder.finish()]);
            for change in &changes {
                image.apply(geometry, change);
            }
            let found: Vec<u32> = words(&table);
            let finer = image.entries().len() - found.len();
            let expected: Vec<u32> = image.entries()[finer..].iter().map(|entry| entry.to_bits()).collect();
            assert!(found == expected, "frame {frame} with levels from {finest} on");
        }
    }
    assert!(run.resident.keys().any(|pos| pos.level == 0), "nothing fine was ever resident");
}

/// What was recorded with the old table's bind groups shows what it did, without what has left its slot.
#[test]
fn a_table_that_grows_tells_the_old_one_what_has_changed() {
    let gpu = &*GPU;
    let geometry = &Geometry::new(GeometrySpec { page: 32, ..GeometrySpec::image(5000, 3000) }).unwrap();
    let (tail, way) = (Slot::new(70_000), FeedbackWay::Separate);
    let changer = TableChanger::new(&gpu.device, way);
    for (choice, count) in [(TableChoice::Direct, 20), (TableChoice::Hashed, 700)] {
        let mut table =
            TableBuffers::new(&gpu.device, &gpu.queue, geometry, NUMBER, tail, choice, way).unwrap();
        let begins = (0..).find(|&level| table.has_level(level)).unwrap();
        let level = if choice == TableChoice::Direct { begins } else { 1 };
        let of_level = |level: u8| geometry.pages().filter(move |page| page.level == level);
        let load = |(pos, n): (PagePos, u32)| TableChange {
            page: PageId::new(NUMBER, geometry.dims(), pos).unwrap(),
            rule: ChangeRule::Coarser,
            entry: TableEntry::new(pos.level, Slot::new(n)),
        };
        let coarse: Vec<TableChange> = of_level(level).zip(0..30).map(load).collect();
        apply(&changer, &mut table, &coarse);
        // Half of them leave; so many finer ones come that the table grows.
        let evict = |change: &TableChange| TableChange {
            rule: ChangeRule::Naming(change.entry),
            entry: TableEntry::new(geometry.tail().first_level(), tail),
            ..*change
        };
        let fine: Vec<TableChange> = of_level(0).zip(100..100 + count).map(load).collect();
        let changes: Vec<TableChange> = coarse[..15].iter().map(evict).chain(fine.iter().copied()).collect();
        let resident: Vec<TableChange> = coarse[15..].iter().copied().chain(fine).collect();
        let old = table.entries().unwrap().clone();
        let gone: Vec<u32> = coarse[..15].iter().map(|change| change.entry.to_bits()).collect();
        let named =
            |entries: &wgpu::Buffer, of: &[u32]| read(gpu, entries).iter().filter(|e| of.contains(e)).count();
        assert!(named(&old, &gone) >= 15);
        grow(&changer, &mut table, 0, &changes, &resident);
        assert!(*table.entries().unwrap() != old, "{choice:?} has grown");
        assert_eq!(named(&old, &gone), 0, "{choice:?}: the old table leads to what is gone");
        let stay: Vec<u32> = coarse[15..].iter().map(|change| change.entry.to_bits()).collect();
        assert!(named(&old, &stay) >= 15 && named(table.entries().unwrap(), &stay) >= 15);
        assert_eq!(named(table.entries().unwrap(), &gone), 0);
    }
}

/// 4 Mi entries are filled by the GPU: what is sent, and what the processor does, follows from the changes alone.
#[test]
fn a_large_table_is_filled_on_the_gpu() {
    let gpu = &*GPU;
    // 2048 x 2048 pages of the finest level.
    let geometry = &Geometry::new(GeometrySpec { page: 8, ..GeometrySpec::image(16384, 16384) }).unwrap();
    let (tail, way) = (Slot::new(5), FeedbackWay::Separate);
    let changer = TableChanger::new(&gpu.device, way);
    let (device, queue) = (&gpu.device, &gpu.queue);
    let mut table =
        TableBuffers::new(device, queue, geometry, NUMBER, tail, TableChoice::Direct, way).unwrap();
    let mut encoder = device.create_command_encoder(&Default::default());
    let before = std::time::Instant::now();
    let applied = changer.grow(device, queue, &mut encoder, &mut table, 0, &[], &[]).unwrap();
    println!("{:?}", before.elapsed());
    queue.submit([encoder.finish()]);
    assert_eq!(applied.bytes, 0);
    assert!(applied.before.is_some() && !table.is_growing() && table.finest() == 0);
    assert!(table.bytes() > 4 * (4 << 20));
    let entries: Vec<u32> = read(gpu, table.entries().unwrap());
    let expected = TableEntry::new(geometry.tail().first_level(), tail).to_bits();
    assert!(entries.iter().all(|&entry| entry == expected));
}

#[test]
fn a_texture_that_is_all_tail_has_a_table_that_nobody_reads() {
    let geometry = Geometry::new(GeometrySpec::image(1, 1)).unwrap();
    let table = TableBuffers::new(
        &GPU.device,
        &GPU.queue,
        &geometry,
        NUMBER,
        Slot::new(7),
        TableChoice::BySize,
        FeedbackWay::Separate,
    )
    .unwrap();
    assert_eq!(words(&table), [TableEntry::new(0, Slot::new(7)).to_bits()]);
}

#[test]
fn a_hashed_table_grows_and_shrinks_with_what_is_resident() {
    let gpu = &*GPU;
    let geometry = Geometry::new(GeometrySpec::image(1 << 31, 1 << 31)).unwrap();
    let tail = Slot::new(9);
    let (choice, device, queue) = (TableChoice::BySize, &gpu.device, &gpu.queue);
    let changer = TableChanger::new(device, FeedbackWay::Separate);
    let mut table =
        TableBuffers::new(device, queue, &geometry, NUMBER, tail, choice, FeedbackWay::Separate).unwrap();
    let bytes = table.bytes();
    let change = |n: u32, rule, heir: Option<TableEntry>| {
        let pos = PagePos::new_2d(n as u8 % 20, n, (1 << 4) - 1 - n % 16);
        let own = TableEntry::new(pos.level, Slot::new(n));
        let page = PageId::new(NUMBER, Dims::D2, pos).unwrap();
        match heir {
            None => TableChange { page, rule, entry: own },
            Some(entry) => TableChange { page, rule: ChangeRule::Naming(own), entry },
        }
    };
    let tail = TableEntry::new(geometry.tail().first_level(), tail);
    let mut most = 0;
    let loads = (0..2000).map(|n| change(n, ChangeRule::Coarser, None));
    let evictions = (0..2000).map(|n| change(n, ChangeRule::Coarser, Some(tail)));
    let changes: Vec<TableChange> = loads.chain(evictions).collect();
    for changes in changes.chunks(125) {
        let mut encoder = device.create_command_encoder(&Default::default());
        let before = table.bytes();
        let applied = changer.apply(device, queue, &mut encoder, &mut table, changes).unwrap();
        queue.submit([encoder.finish()]);
        assert_eq!(applied.before.is_some(), table.bytes() != before);
        let hashed = table.hashed().unwrap();
        let expected: Vec<u32> = hashed.buckets().iter().flat_map(|place| place.words()).collect();
        assert!(words(&table) == expected, "with {} pages", hashed.len());
        most = most.max(hashed.len());
    }
    assert_eq!((most, table.hashed().map(HashedTable::len), table.bytes()), (2000, Some(0), bytes));
}
