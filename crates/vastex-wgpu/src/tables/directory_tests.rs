//! The directory against a naive account of who has which entry, while textures come, grow and go by chance.

use std::collections::{BTreeMap, HashMap};

use vastex_core::{Geometry, GeometrySpec, PageNumbering, Slot, TextureNumber};

use super::*;

struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 16) as usize % n
    }
}

/// Images of many sizes, in pages of 128: from one that is all tail to one of 5.6 Mi pages.
fn geometries(largest: u32) -> Vec<Geometry> {
    let sizes = [100, 600, 1000, 3000, 4096, 7000, 16_384, 21_600, 65_536, 200_000];
    let pairs = sizes.iter().flat_map(|&w| [(w, w), (w, w / 2 + 1), (w / 3 + 1, w)]);
    let images = pairs.filter(|&(w, h)| w.max(h) <= largest);
    images.map(|(w, h)| Geometry::new(GeometrySpec::image(w, h)).unwrap()).collect()
}

/// What must hold of a directory: every table has each of its levels once, whole, where nobody else has
/// anything.
fn check(directory: &Directory) {
    let mut owners: BTreeMap<u32, u32> = BTreeMap::new();
    let mut reserved = 0;
    for table in directory.tables.values() {
        reserved += full_entries(&table.geometry);
        let numbering = PageNumbering::new(&table.geometry);
        let tail = table.geometry.tail().first_level();
        let placement = table.placement(&[]);
        assert_eq!(placement.finest, table.finest());
        assert!(placement.least_length() <= directory.arena.capacity());
        // In a shorter arena all levels from the one that is looked up on have their entries, and the range
        // of the next one is not in it.
        for (shorter, longer) in (10..26).flat_map(|log| (log..26).map(move |of| (1 << log, 1 << of))) {
            let placement = table.placement(&[longer, shorter]);
            let end =
                |level| u64::from(placement.first_entry(level)) + table.geometry.level(level).page_count();
            for length in [longer, shorter] {
                let finest = placement.finest_in(length);
                assert!((finest..tail).all(|level| end(level) <= u64::from(length)), "{finest} in {length}");
                let next = table.ranges.iter().find(|of| of.coarsest + 1 == finest);
                let is_out = next.is_none_or(|of| of.range.first + of.range.entries() > length);
                assert!(is_out, "{finest} in {length}");
            }
        }
        for level in 0..table.geometry.coarsest() + 1 {
            let first = placement.first_entry(level);
            if level < table.finest() || level >= tail {
                assert_eq!(first, Placement::NONE);
                continue;
            }
            let count = table.geometry.level(level).page_count();
            assert!(u64::from(first) + count <= u64::from(directory.arena.capacity()));
            assert!(owners.insert(first, first + count as u32).is_none());
        }
        let used: u64 = table.ranges.iter().map(|level| u64::from(level.range.entries())).sum();
        assert!(used <= full_entries(&table.geometry));
        if table.finest() == 0 && tail > 0 {
            assert_eq!(used, full_entries(&table.geometry));
            assert!(used <= 2 * numbering.entries());
        }
    }
    assert_eq!(directory.room(), u64::from(directory.arena.most()).saturating_sub(reserved));
    let mut end = 0;
    for (first, next) in owners {
        assert!(first >= end, "two tables at {first}");
        end = next;
    }
}

/// Returns how many tables were refused, and how often ranges were given anew.
fn play(most: u32, largest: u32, steps: u32, seed: u64) -> (u32, u32, usize) {
    let geometries = geometries(largest);
    let mut directory = Directory::new(Arena::new(1024, most));
    let mut random = Random(seed);
    let (mut refused, mut anew, mut peak) = (0, 0, 0);
    let mut placements: HashMap<TextureNumber, Placement> = HashMap::new();
    for step in 0..steps {
        let texture = TextureNumber::new(random.below(2000) as u16).unwrap();
        match directory.tables.get(&texture).map(|table| table.finest()) {
            None => {
                let geometry = &geometries[random.below(geometries.len())];
                let has_room = full_entries(geometry) <= directory.room();
                assert_eq!(directory.add(texture, geometry, Slot::new(step)), has_room);
                refused += u32::from(!has_room);
            }
            Some(finest) if finest > 0 && random.below(4) > 0 => {
                directory.grow(texture, random.below(usize::from(finest)) as u8);
                assert!(directory.tables[&texture].finest() < finest);
            }
            Some(_) => directory.remove(texture),
        }
        placements.retain(|texture, _| directory.tables.contains_key(texture));
        let mut is_anew = false;
        for (&of, table) in &mut directory.tables {
            let (now, then) = (table.placement(&[]), placements.get(&of));
            let kept = |then: &Placement| {
                (then.finest..table.tail.level()).all(|l| then.first_entry(l) == now.first_entry(l))
            };
            is_anew |= !then.is_none_or(kept);
            let is_told = std::mem::take(&mut table.is_placed) && directory.touched.contains(&of);
            assert!(is_told || then == Some(&now), "nobody was told");
            placements.insert(of, now);
        }
        directory.touched.clear();
        anew += u32::from(is_anew);
        peak = peak.max(directory.tables.len());
        if step % 50 == 0 {
            check(&directory);
        }
    }
    check(&directory);
    for number in 0..2000 {
        directory.remove(TextureNumber::new(number).unwrap());
    }
    let all = directory.arena.capacity();
    assert_eq!(directory.room(), u64::from(directory.arena.most()));
    assert_eq!(directory.arena.take(all).map(Range::entries), Some(all), "all is free again");
    (refused, anew, peak)
}

#[test]
fn two_thousand_textures_come_grow_and_go() {
    // 128 MiB of entries: what WebGPU's limits allow.
    let (_, anew, peak) = play(1 << 25, 8000, 8000, 3);
    assert!(anew == 0 && peak > 900, "{anew} {peak}");
}

/// What WebGL 2's limits allow is full; so is less than that, where levels come for which free ranges are too
/// small.
#[test]
fn a_table_that_would_not_fit_at_its_full_size_is_refused_and_one_that_fits_always_grows() {
    let side = wgpu::Limits::downlevel_webgl2_defaults().max_texture_dimension_2d;
    // Of small textures there is room for all of them.
    let (refused, _, peak) = play(side * side, 1000, 8000, 6);
    assert!(refused == 0 && peak > 900, "{refused} {peak}");
    let (refused, _, peak) = play(side * side, 200_000, 6000, 4);
    assert!(refused > 100 && peak > 200, "{refused} {peak}");
    let (refused, anew, peak) = play(1 << 11, 4096, 6000, 5);
    assert!(refused > 100 && anew > 0 && peak > 5, "{refused} {anew} {peak}");
}

/// The figures of docs/page-tables.md.
#[test]
fn bytes_of_two_thousand_tables() {
    let bytes = |size: u32, finest: u8| {
        let mut directory = Directory::new(Arena::new(1024, 1 << 28));
        let geometry = Geometry::new(GeometrySpec::image(size, size)).unwrap();
        let mut entries = 0;
        for number in 0..2000 {
            let texture = TextureNumber::new(number).unwrap();
            assert!(directory.add(texture, &geometry, Slot::new(0)));
            directory.grow(texture, finest);
            let table = &directory.tables[&texture];
            entries += table.ranges.iter().map(|level| u64::from(level.entries)).sum::<u64>();
        }
        let (taken, capacity) = (4 * directory.taken(), 4 * u64::from(directory.arena.capacity()));
        println!(
            "{size}, from level {finest}: {entries} entries, {} bytes a texture, {:.2} an entry, {capacity} in all",
            taken / 2000,
            taken as f64 / entries as f64
        );
        (taken / 2000, capacity)
    };
    for size in [1000, 4096, 7000, 16_384] {
        for finest in [u8::MAX, 2, 1, 0] {
            bytes(size, finest);
        }
    }
    assert_eq!(bytes(4096, u8::MAX).0, 512);
    // 32 x 32 pages and all coarser levels: each a power of two already.
    assert_eq!(bytes(4096, 0).0, 4 * (1024 + 256 + 128));
}
