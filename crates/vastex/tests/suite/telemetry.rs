//! Telemetry and dumps of the frame loop: their sums are the loop's own counts, while textures come and go.

use crate::common::{Mapping, Screen, property, settings};
use vastex::diagnostics::{Cell, PoolRecord};
use vastex::{AddressMode, LevelRule, PoolSettings, Settings};

const SIZE: [u32; 2] = [1000, 777];

/// Two textures in a pool that is too small for them, one in a pool of its own.
fn screen(more: &Settings) -> Screen {
    let page = |page| property(SIZE, page, AddressMode::Clamp);
    let mut screen = Screen::new(
        &[page(32), page(100), page(32)],
        Settings { pools: PoolSettings::of_bytes(20 * 108 * 108 * 4), ..more.clone() },
    );
    look(&mut screen, 0.3);
    screen
}

fn look(screen: &mut Screen, at: f64) {
    (0..3).for_each(|nth| screen.set_mapping(nth, &Mapping::new(SIZE, [at, 0.5], 1.1, 1.0, 0.2)));
}

fn count(record: &PoolRecord, name: &str) -> u64 {
    match record.columns().find(|(column, _)| *column == name) {
        Some((_, Cell::Count(count))) => count,
        other => panic!("{name}: {other:?}"),
    }
}

#[test]
fn every_frame_has_a_record_of_every_pool_and_they_add_up() {
    let mut screen = screen(&Settings { ram_cache_bytes: 100_000, ..settings() });
    let mut records: Vec<PoolRecord> = Vec::new();
    for frame in 0..60u32 {
        look(&mut screen, 0.2 + 0.01 * f64::from(frame));
        if frame == 30 {
            screen.remove(0);
        }
        screen.frame().unwrap();
        let newest: Vec<PoolRecord> = screen.textures.inspect().telemetry().newest().copied().collect();
        let of = newest.iter().map(|record| (record.pager.frame, record.pager.pool.number()));
        assert_eq!(of.collect::<Vec<_>>(), [(u64::from(frame), 0), (u64::from(frame), 1)]);
        records.extend(newest);
    }
    assert!(screen.textures.inspect().telemetry().iter().eq(&records), "all of them are within 256 frames");
    let stats = screen.textures.stats();
    for pool in &stats.pools {
        let of_pool = || records.iter().filter(|record| record.pager.pool == pool.pool);
        let sum = |name: &str| of_pool().map(|record| count(record, name)).sum::<u64>();
        let totals = &pool.pager;
        assert_eq!((sum("uploads"), sum("evictions")), (totals.loaded, totals.evicted));
        assert_eq!((sum("upload_bytes"), sum("requests")), (totals.uploaded_bytes, totals.requests));
        assert!(sum("uploads") > 20 && sum("ram_misses") > 0);
        // Each request is one read of the cache, and so is each tail; what was called off may have been read
        // all the same.
        let tails = if pool.pool.number() == 0 { 2 } else { 1 };
        let reads = sum("ram_hits") + sum("ram_misses");
        assert!(reads >= totals.loaded + tails && reads <= totals.requests + tails, "{reads}: {totals:?}");
        assert!(of_pool().all(|record| count(record, "ram_bytes") <= 100_000));
    }
}

#[test]
fn as_many_frames_are_kept_as_are_asked_for() {
    for telemetry_frames in [0, 1, 7] {
        let mut screen = screen(&Settings { telemetry_frames, ..settings() });
        (0..12).for_each(|_| drop(screen.frame().unwrap()));
        let frames: Vec<u64> =
            screen.textures.inspect().telemetry().iter().map(|record| record.pager.frame).collect();
        let expected: Vec<u64> = (12 - telemetry_frames..12).flat_map(|frame| [frame; 2]).collect();
        assert_eq!(frames, expected);
    }
}

#[test]
fn a_dump_accounts_for_every_slot() {
    let mut screen = screen(&settings());
    let [first, third] = [0, 2].map(|nth| screen.texture(nth));
    screen.textures.texture_mut(third).unwrap().set_name("clouds");
    screen.textures.texture_mut(third).unwrap().set_levels(LevelRule { bias: -0.5, finest: 0, coarsest: 5 });
    assert_eq!(
        (screen.textures.texture(third).unwrap().name(), screen.textures.texture(first).unwrap().name()),
        (Some("clouds"), None)
    );
    screen.converge();
    let (dump, stats) = (screen.textures.inspect().pool_usage(), screen.textures.stats());
    assert_eq!(dump.pools.len(), 2);
    for (dumped, pool) in dump.pools.iter().zip(&stats.pools) {
        assert_eq!((dumped.slots, dumped.occupied), (pool.pager.slots, pool.pager.occupied));
        assert_eq!((dumped.locked, dumped.bytes), (pool.pager.locked, pool.bytes));
        assert_eq!(dumped.bias, f64::from(pool.pager.bias_eighths) / 8.0);
        assert_eq!(dumped.textures.iter().map(|texture| texture.pages).sum::<u32>(), dumped.occupied);
        assert!(dumped.textures.is_sorted_by_key(|texture| std::cmp::Reverse(texture.pages)));
        for texture in &dumped.textures {
            assert_eq!(texture.levels.iter().map(|level| level.pages).sum::<u32>(), texture.pages);
        }
    }
    let clouds =
        dump.pools[0].textures.iter().find(|texture| texture.texture == third.number().number()).unwrap();
    assert_eq!((clouds.name.as_deref(), clouds.bias, clouds.coarsest), (Some("clouds"), -0.5, 5));
    screen.remove(2);
    assert!(screen.textures.texture_mut(third).is_err() && screen.textures.texture(third).is_err());
    let left = screen.textures.inspect().pool_usage();
    assert!(left.pools[0].textures.iter().all(|texture| texture.texture == first.number().number()));
}
