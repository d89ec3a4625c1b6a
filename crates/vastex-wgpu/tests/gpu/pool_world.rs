//! A pool whose textures come, change and go by chance, and what its page tables must say.

use std::collections::{BTreeMap, VecDeque};

use vastex_core::{
    ChangeRule, Geometry, GeometrySpec, PageId, PageNumbering, PagePos, PageTable, Slot, TableChange,
    TableEntry, TableImage, TextureNumber,
};
use vastex_wgpu::{
    FeedbackMode, GpuError, Placement, PoolApplied, PoolTableChanger, PoolTables, RECORDED_AHEAD,
};

use crate::common::{GPU, Random, read, storage};

pub(crate) const MODES: [FeedbackMode; 2] = [FeedbackMode::Separate, FeedbackMode::Raw];
pub(crate) const TEXTURES: usize = 40;

/// A texture of the pool, and what its table must say.
pub(crate) struct Texture {
    pub(crate) geometry: Geometry,
    pub(crate) image: TableImage,
    pub(crate) resident: BTreeMap<PagePos, Slot>,
    pub(crate) pages: Vec<PagePos>,
}

/// A pool whose textures come, change and go by chance.
pub(crate) struct Pool {
    pub(crate) tables: PoolTables,
    pub(crate) changer: PoolTableChanger,
    pub(crate) textures: BTreeMap<TextureNumber, Texture>,
    /// As records have it.
    pub(crate) placements: BTreeMap<TextureNumber, Placement>,
    pub(crate) free: Vec<Slot>,
    pub(crate) random: Random,
    pub(crate) budget: u64,
    /// Entries of the arenas that commands may see which were recorded after one of the last updates, the
    /// newest last.
    pub(crate) seen: VecDeque<u32>,
}

pub(crate) fn number(n: usize) -> TextureNumber {
    TextureNumber::new(n as u16 * 51).unwrap()
}

/// What is bound, to be read later.
pub(crate) enum Memory {
    Buffer(wgpu::Buffer),
    Texture(wgpu::Texture),
}

impl Memory {
    pub(crate) fn of(tables: &PoolTables) -> Memory {
        match tables.buffer() {
            Some(buffer) => Memory::Buffer(buffer.clone()),
            None => Memory::Texture(tables.texture().unwrap().clone()),
        }
    }

    pub(crate) fn words(&self) -> Vec<u32> {
        match self {
            Memory::Buffer(buffer) => read(&GPU, buffer),
            Memory::Texture(texture) => texture_words(texture),
        }
    }
}

/// The words of a texture, row after row.
pub(crate) fn texture_words(texture: &wgpu::Texture) -> Vec<u32> {
    let gpu = &*GPU;
    let size = texture.size();
    let row = size.width * texture.format().block_copy_size(None).unwrap();
    let padded = row.next_multiple_of(256);
    let buffer = storage(gpu, &vec![0; (padded * size.height) as usize]);
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(padded), rows_per_image: None };
    let to = wgpu::TexelCopyBufferInfo { buffer: &buffer, layout };
    encoder.copy_texture_to_buffer(texture.as_image_copy(), to, size);
    gpu.queue.submit([encoder.finish()]);
    let words: Vec<u32> = read(gpu, &buffer);
    words.chunks((padded / 4) as usize).flat_map(|words| &words[..(row / 4) as usize]).copied().collect()
}

impl Pool {
    pub(crate) fn new(tables: PoolTables, mode: FeedbackMode, seed: u64) -> Pool {
        Pool {
            tables,
            changer: PoolTableChanger::new(&GPU.device, mode),
            textures: BTreeMap::new(),
            placements: BTreeMap::new(),
            free: (100..3000).map(Slot::new).collect(),
            random: Random(seed),
            budget: u64::MAX,
            seen: VecDeque::new(),
        }
    }

    pub(crate) fn direct(mode: FeedbackMode, seed: u64) -> Pool {
        Pool::new(PoolTables::direct(&GPU.device, mode).unwrap(), mode, seed)
    }

    pub(crate) fn hashed(mode: FeedbackMode, slots: u32, seed: u64) -> Pool {
        Pool::new(PoolTables::hashed(&GPU.device, &GPU.queue, mode, slots).unwrap(), mode, seed)
    }

    pub(crate) fn add(&mut self, texture: TextureNumber, geometry: &Geometry) {
        let tail = Slot::new(u32::from(texture.number()) % 97);
        self.tables.add(texture, geometry, tail).unwrap();
        let image = TableImage::new(geometry, tail);
        let resident = BTreeMap::from([(geometry.tail_pos(), tail)]);
        let pages = geometry.pages().skip(1).collect();
        self.textures.insert(texture, Texture { geometry: geometry.clone(), image, resident, pages });
    }

    pub(crate) fn remove(&mut self, texture: TextureNumber) {
        self.tables.remove(texture);
        self.placements.remove(&texture);
        let Texture { geometry, resident, .. } = self.textures.remove(&texture).unwrap();
        self.free.extend(resident.iter().filter(|(pos, _)| !geometry.is_tail(**pos)).map(|(_, &slot)| slot));
    }

    /// A page comes into a slot that is free.
    pub(crate) fn load(&mut self, texture: TextureNumber, pos: PagePos) -> TableChange {
        let slot = self.free.pop().unwrap();
        let Texture { geometry, image, resident, .. } = self.textures.get_mut(&texture).unwrap();
        resident.insert(pos, slot);
        let page = PageId::new(texture, geometry.dims(), pos).unwrap();
        let change = TableChange { page, rule: ChangeRule::Coarser, entry: TableEntry::new(pos.level, slot) };
        image.apply(geometry, &change);
        change
    }

    /// A page goes.
    pub(crate) fn evict(&mut self, texture: TextureNumber, pos: PagePos) -> TableChange {
        let Texture { geometry, image, resident, .. } = self.textures.get_mut(&texture).unwrap();
        let slot = resident.remove(&pos).unwrap();
        let mut line = std::iter::successors(geometry.parent(pos), |&pos| geometry.parent(pos));
        let heir = line.find(|pos| resident.contains_key(pos)).unwrap();
        let page = PageId::new(texture, geometry.dims(), pos).unwrap();
        let rule = ChangeRule::Naming(TableEntry::new(pos.level, slot));
        let change = TableChange { page, rule, entry: TableEntry::new(heir.level, resident[&heir]) };
        image.apply(geometry, &change);
        self.free.push(slot);
        change
    }

    /// Some pages of a texture go and some come, slots used again at once included.
    pub(crate) fn changes(&mut self, texture: TextureNumber, count: usize) -> Vec<TableChange> {
        let Texture { geometry, image, resident, pages } = self.textures.get_mut(&texture).unwrap();
        let change = |pos, rule, entry| TableChange {
            page: PageId::new(texture, geometry.dims(), pos).unwrap(),
            rule,
            entry,
        };
        if pages.is_empty() {
            return Vec::new();
        }
        // Coarse pages are few, and are to come too.
        let picks: Vec<PagePos> = (0..count)
            .map(|_| {
                let up_to = self.random.below(pages.len());
                pages[self.random.below(up_to + 1)]
            })
            .collect();
        let mut evicted = BTreeMap::new();
        for pos in &picks {
            if self.random.unit() < 0.6 {
                evicted.extend(resident.remove_entry(pos));
            }
        }
        let mut changes = Vec::new();
        for (&pos, &slot) in &evicted {
            let mut line = std::iter::successors(geometry.parent(pos), |&pos| geometry.parent(pos));
            let heir = line.find(|pos| resident.contains_key(pos)).unwrap();
            let (old, entry) =
                (TableEntry::new(pos.level, slot), TableEntry::new(heir.level, resident[&heir]));
            changes.push(change(pos, ChangeRule::Naming(old), entry));
            self.free.push(slot);
        }
        for pos in picks {
            if !resident.contains_key(&pos)
                && let Some(slot) = self.free.pop()
            {
                resident.insert(pos, slot);
                changes.push(change(pos, ChangeRule::Coarser, TableEntry::new(pos.level, slot)));
            }
        }
        changes.iter().for_each(|change| {
            image.apply(geometry, change);
        });
        changes
    }

    pub(crate) fn record(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        changes: &[TableChange],
    ) -> Result<PoolApplied, GpuError> {
        let textures = &self.textures;
        let mut resident = |texture: TextureNumber, out: &mut Vec<TableChange>| {
            let Texture { geometry, resident, .. } = &textures[&texture];
            out.extend(resident.iter().filter(|(pos, _)| !geometry.is_tail(**pos)).map(|(&pos, &slot)| {
                TableChange {
                    page: PageId::new(texture, geometry.dims(), pos).unwrap(),
                    rule: ChangeRule::Coarser,
                    entry: TableEntry::new(pos.level, slot),
                }
            }));
        };
        let mut budget = self.budget;
        let (device, queue) = (&GPU.device, &GPU.queue);
        self.tables.apply(&self.changer, device, queue, encoder, changes, &mut resident, &mut budget)
    }

    /// An update that is submitted.
    pub(crate) fn update(&mut self, changes: &[TableChange]) -> PoolApplied {
        let mut encoder = GPU.device.create_command_encoder(&Default::default());
        let applied = self.record(&mut encoder, changes).unwrap();
        for &texture in &applied.placed {
            self.placements.insert(texture, self.tables.placement(texture));
        }
        GPU.queue.submit([encoder.finish()]);
        self.tables.submitted();
        self.check_between();
        applied
    }

    /// Whether placements that are asked for between two updates lead nobody astray whose commands may still
    /// be submitted then.
    fn check_between(&mut self) {
        let length = match Memory::of(&self.tables) {
            Memory::Buffer(buffer) => (buffer.size() / 4) as u32,
            Memory::Texture(texture) => texture.width() * texture.height(),
        };
        self.seen.push_back(length);
        while self.seen.len() > 1 + usize::from(RECORDED_AHEAD) {
            self.seen.pop_front();
        }
        if self.tables.is_hashed() {
            return;
        }
        for (&of, Texture { geometry, .. }) in &self.textures {
            let placement = self.tables.placement(of);
            for &length in &self.seen {
                let finest = placement.finest_in(length);
                let end =
                    |level| u64::from(placement.first_entry(level)) + geometry.level(level).page_count();
                let mut looked_up = finest..geometry.tail().first_level();
                let is_there = looked_up.all(|level| end(level) <= u64::from(length));
                assert!(is_there, "{of:?}, {placement:?}: level {finest} in {length} of {:?}", self.seen);
            }
        }
    }

    /// Whether what lies somewhere is what tables must say, as far as records lead there.
    pub(crate) fn check(&self, words: &[u32], what: &str) -> usize {
        if self.tables.is_hashed() {
            return self.check_hashed(words, what);
        }
        let mut entries = 0;
        for (&of, Texture { geometry, image, resident, .. }) in &self.textures {
            let (numbering, placement) = (PageNumbering::new(geometry), self.placements[&of]);
            let now = self.tables.placement(of);
            let lie = |placement: &Placement| {
                let levels = 0..geometry.tail().first_level();
                (placement.finest, levels.map(|level| placement.first_entry(level)).collect::<Vec<u32>>())
            };
            assert_eq!(lie(&placement), lie(&now), "{what}: nobody was told where {of:?} lies");
            let finest = resident.keys().map(|pos| pos.level).min();
            assert!(
                !self.tables.is_settled() || finest >= Some(placement.finest),
                "{what}: {of:?} has pages of level {finest:?} and entries from {} on",
                placement.finest
            );
            // Where a shader looks, there are entries.
            let finest = placement.finest_in(words.len() as u32);
            let mut looked_up = finest..geometry.tail().first_level();
            assert!(
                looked_up.all(|level| (placement.first_entry(level) as usize) < words.len()),
                "{what}: {of:?} from level {finest} on"
            );
            for level in 0..geometry.tail().first_level() {
                let (first, count) =
                    (placement.first_entry(level), geometry.level(level).page_count() as usize);
                if first as usize >= words.len() {
                    continue;
                }
                let expected = &image.entries()[numbering.first_entry(level) as usize..][..count];
                let found = &words[first as usize..][..count];
                assert!(
                    expected.iter().map(|entry| entry.to_bits()).eq(found.iter().copied()),
                    "{what}: {of:?}, level {level}"
                );
                entries += count;
            }
        }
        entries
    }

    pub(crate) fn check_hashed(&self, words: &[u32], what: &str) -> usize {
        let table = self.tables.hash_table().unwrap();
        let buckets: Vec<u32> = table.buckets().iter().flat_map(|bucket| bucket.words()).collect();
        assert!(buckets == words[..buckets.len()], "{what}: buckets are others");
        assert_eq!(
            (words.len() / 3).ilog2(),
            table.buckets().len().ilog2(),
            "what shaders take for their number"
        );
        for (&of, Texture { geometry, image, .. }) in &self.textures {
            let tail = image.lookup(geometry.tail_pos());
            assert!(
                geometry.pages().all(|pos| table.lookup_in(geometry, of, tail, pos) == image.lookup(pos)),
                "{what}: {of:?}"
            );
        }
        let resident = self.textures.values().map(|texture| texture.resident.len() - 1).sum::<usize>();
        assert_eq!(table.len(), resident, "{what}: pages of textures that are gone");
        table.buckets().len()
    }

    /// Something by chance for a frame: textures come and go, pages too.
    pub(crate) fn frame(&mut self, geometries: &[Geometry]) -> Vec<TableChange> {
        for _ in 0..2 {
            let of = number(self.random.below(TEXTURES));
            match self.textures.contains_key(&of) {
                true if self.random.unit() < 0.3 => self.remove(of),
                true => {}
                false => {
                    let geometry = &geometries[self.random.below(geometries.len())];
                    self.add(of, geometry);
                }
            }
        }
        let all: Vec<TextureNumber> = self.textures.keys().copied().collect();
        let mut changes = Vec::new();
        for of in all {
            if self.random.unit() < 0.5 {
                let count = 1 + self.random.below(12);
                changes.extend(self.changes(of, count));
            }
        }
        changes
    }
}

/// Images and a volume, of 0 to 8000 pages, of sizes of no power of two and of other factors than 2 among
/// them.
pub(crate) fn geometries() -> Vec<Geometry> {
    let of = |spec: GeometrySpec, page| Geometry::new(GeometrySpec { page, border: 2, ..spec }).unwrap();
    vec![
        of(GeometrySpec::image(5, 5), 8),
        of(GeometrySpec::image(300, 300), 8),
        of(GeometrySpec::image(256, 256), 8),
        of(GeometrySpec::image(517, 65), 12),
        of(GeometrySpec::image(90, 130), 40),
        of(GeometrySpec::volume([50, 60, 70]), 8),
        Geometry::with_factors(
            GeometrySpec { page: 16, border: 2, ..GeometrySpec::image(1400, 900) },
            &[[3, 1, 1], [2, 3, 1], [1, 2, 1], [5, 5, 1], [100, 100, 1]],
        )
        .unwrap(),
    ]
}
