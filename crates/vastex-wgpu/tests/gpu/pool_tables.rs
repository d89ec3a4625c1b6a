//! The page tables of a pool, in an arena or as one hash table, stay equal to the CPU's images of them,
//! whatever is added, loaded, evicted and removed, wherever they move; so does, for as long as is promised,
//! what they lay in before.

use std::collections::VecDeque;

use vastex_core::{
    ChangeRule, Geometry, GeometrySpec, PageId, PageNumbering, PagePos, Slot, TableChange, TableEntry,
    TableImage,
};
use vastex_wgpu::test_device::fail_after;
use vastex_wgpu::{FeedbackMode, GpuError, PoolTables};

use crate::common::GPU;
use crate::pool_world::{MODES, Memory, Pool, TEXTURES, Texture, geometries, number};

#[test]
fn tables_of_many_textures_follow_whatever_comes_and_goes() {
    for mode in MODES {
        let mut pool = Pool::direct(mode, 11);
        let (mut moved, mut memory) = (0, VecDeque::new());
        for frame in 0..60 {
            let bound = Memory::of(&pool.tables);
            let changes = pool.frame(&geometries());
            let applied = pool.update(&changes);
            if applied.moved {
                moved += 1;
                memory.push_back((frame, bound));
            }
            // What was recorded before the move is submitted after this update, or after the next.
            memory.retain(|(moved, _)| moved + 2 > frame);
            for (moved, memory) in &memory {
                pool.check(
                    &memory.words(),
                    &format!("{mode:?}, frame {frame}, as it lay before frame {moved}"),
                );
            }
            pool.check(&Memory::of(&pool.tables).words(), &format!("{mode:?}, frame {frame}"));
        }
        assert!(moved >= 2, "{mode:?}: {moved}");
        let entries = pool.check(&Memory::of(&pool.tables).words(), "at the end");
        assert!(entries > 5000, "{mode:?}: {entries} entries");
    }
}

#[test]
fn one_hash_table_follows_all_textures_of_its_pool() {
    for mode in MODES {
        let mut pool = Pool::hashed(mode, 100, 12);
        let (mut moved, mut before) = (0, None);
        for frame in 0..60 {
            let (bound, was) = (Memory::of(&pool.tables), pool.tables.hash_table().unwrap().buckets().len());
            let changes = pool.frame(&geometries());
            let applied = pool.update(&changes);
            let buckets = pool.tables.hash_table().unwrap().buckets().len();
            assert_eq!(applied.moved, was != buckets);
            if applied.moved {
                (moved, before) = (moved + 1, Some((frame, bound)));
            }
            before.take_if(|(moved, _)| *moved + 2 <= frame);
            if let Some((moved, memory)) = &before {
                let what = format!("{mode:?}, frame {frame}, as before frame {moved}");
                let pages = check_former(&pool, &memory.words(), &what);
                assert!(pages > 100, "{what}: {pages}");
            }
            pool.check(&Memory::of(&pool.tables).words(), &format!("{mode:?}, frame {frame}"));
        }
        assert!(moved >= 1, "{mode:?}: {moved}");
    }
}

/// What lay elsewhere leads to nothing that has left, though it may not know what has come; the pages that it
/// leads to.
pub(crate) fn check_former(pool: &Pool, words: &[u32], what: &str) -> usize {
    let mut pages = 0;
    for bucket in words.chunks_exact(3).filter(|bucket| bucket[1] != u32::MAX && bucket[2] != 0) {
        let page = PageId::from_bits(u64::from(bucket[0]) | u64::from(bucket[1]) << 32).unwrap();
        let Texture { geometry, resident, .. } = &pool.textures[&page.texture()];
        let pos = page.pos(geometry.dims());
        let slot = TableEntry::from_bits(bucket[2]).slot();
        assert_eq!(resident.get(&pos), Some(&slot), "{what}: {page:?}");
        pages += 1;
    }
    pages
}

/// One upload and the same dispatches for all textures of a pool; and of nothing, nothing.
#[test]
fn a_frame_sends_in_proportion_to_what_changes() {
    let mut pool = Pool::direct(FeedbackMode::Separate, 13);
    let geometry =
        Geometry::new(GeometrySpec { page: 8, border: 2, ..GeometrySpec::image(256, 256) }).unwrap();
    (0..TEXTURES).for_each(|n| pool.add(number(n), &geometry));
    assert!(pool.update(&[]).bytes <= 32 + 16 * TEXTURES as u64, "coarse levels are filled by the GPU");
    assert_eq!(pool.update(&[]).bytes, 0);
    for _ in 0..3 {
        let all: Vec<TableChange> = (0..TEXTURES).flat_map(|n| pool.changes(number(n), 8)).collect();
        pool.update(&all);
    }
    let all: Vec<TableChange> = (0..TEXTURES).flat_map(|n| pool.changes(number(n), 8)).collect();
    let fresh = pool.placements.values().filter(|placement| placement.finest > 0).count();
    let levels = u64::from(geometry.tail().first_level());
    let sent = pool.update(&all).bytes;
    let most = 32 * all.len() as u64 + (28 * levels) * TEXTURES as u64 + 32;
    assert_eq!(fresh, 0, "all tables have grown as far as they can");
    assert!(sent <= most, "{sent} bytes for {} changes", all.len());
}

/// Where an update is not submitted the next one makes good for it, whatever was in it.
#[test]
fn what_was_not_submitted_is_written_anew() {
    for mode in MODES {
        for hashed in [false, true] {
            let mut pool = if hashed { Pool::hashed(mode, 60, 14) } else { Pool::direct(mode, 14) };
            for frame in 0..30 {
                let changes = pool.frame(&geometries());
                if frame % 3 == 1 {
                    let mut encoder = GPU.device.create_command_encoder(&Default::default());
                    pool.record(&mut encoder, &changes).unwrap();
                    continue; // the encoder is dropped
                }
                let was_lost = frame % 3 == 2;
                let applied = pool.update(&changes);
                assert!(!was_lost || applied.placed.len() == pool.textures.len());
                let what = format!("{mode:?}, hashed: {hashed}, frame {frame}");
                pool.check(&Memory::of(&pool.tables).words(), &what);
            }
        }
    }
}

#[test]
fn a_table_begins_anew_with_its_tail_elsewhere() {
    for mode in MODES {
        for hashed in [false, true] {
            let mut pool = if hashed { Pool::hashed(mode, 60, 15) } else { Pool::direct(mode, 15) };
            let geometry = &geometries()[1];
            (0..3).for_each(|n| pool.add(number(n), geometry));
            let changes: Vec<_> = (0..3).flat_map(|n| pool.changes(number(n), 30)).collect();
            pool.update(&changes);
            let of = number(1);
            let texture = pool.textures.get_mut(&of).unwrap();
            let tail = Slot::new(99);
            texture.resident.insert(geometry.tail_pos(), tail);
            // Every other page is gone, and nobody says so.
            let all: Vec<PagePos> =
                texture.resident.keys().copied().filter(|pos| !geometry.is_tail(*pos)).collect();
            all.iter().step_by(2).for_each(|pos| {
                texture.resident.remove(pos);
            });
            texture.image = TableImage::new(geometry, tail);
            for (&pos, &slot) in texture.resident.iter().filter(|(pos, _)| !geometry.is_tail(**pos)) {
                let page = PageId::new(of, geometry.dims(), pos).unwrap();
                let entry = TableEntry::new(pos.level, slot);
                texture.image.apply(geometry, &TableChange { page, rule: ChangeRule::Coarser, entry });
            }
            pool.tables.begin_anew(of, tail);
            let applied = pool.update(&[]);
            assert_eq!(applied.placed, [of]);
            pool.check(&Memory::of(&pool.tables).words(), &format!("{mode:?}, hashed: {hashed}"));
        }
    }
}

/// In a texture a level is looked up as soon as all of it is there, and no frame sends much.
#[test]
fn levels_are_sent_by_and_by_where_the_gpu_cannot_fill_them() {
    const BUDGET: u64 = 16 << 10;
    let mut pool = Pool::direct(FeedbackMode::Raw, 16);
    let geometry =
        Geometry::new(GeometrySpec { page: 8, border: 2, ..GeometrySpec::image(2048, 2048) }).unwrap();
    let of = number(3);
    pool.add(of, &geometry);
    pool.update(&[]);
    pool.budget = BUDGET;
    let mut finest = vec![pool.placements[&of].finest];
    assert!(finest[0] > 3 && pool.tables.is_settled());
    let page = PagePos::new_2d(0, 100, 200);
    let mut changes = vec![pool.load(of, page)];
    let mut memory = VecDeque::new();
    while finest.last() != Some(&0) {
        let bound = Memory::of(&pool.tables);
        // Each change sends the pieces that it is in: 32 rows of coarse levels at most.
        let applied = pool.update(&changes);
        // What was recorded before a move is submitted after this update, or after the next.
        memory.retain(|(moved, _)| *moved + 2 > finest.len());
        if applied.moved {
            memory.push_back((finest.len(), bound));
        }
        for (_, memory) in &memory {
            pool.check(&memory.words(), &format!("after {finest:?}, as it lay before"));
        }
        assert!(applied.bytes <= BUDGET + 256 * 600, "{} bytes", applied.bytes);
        assert_eq!(pool.tables.is_settled(), pool.placements[&of].finest == 0);
        pool.check(&Memory::of(&pool.tables).words(), &format!("after {finest:?}"));
        finest.push(pool.placements[&of].finest);
        // A frame for each budget's worth of entries, and little more.
        let bytes = 4 * PageNumbering::new(&geometry).entries();
        assert!(finest.len() as u64 <= bytes.div_ceil(BUDGET) + 3, "{finest:?}");
        changes = pool.changes(of, 3);
    }
    // 256 x 256 entries are 256 KiB.
    assert!(finest.len() > 20 && finest.is_sorted_by(|a, b| a >= b), "{finest:?}");
    finest.dedup();
    assert!(finest.len() > 3 && finest.ends_with(&[1, 0]), "coarse levels come first: {finest:?}");
}

#[test]
fn what_has_no_room_at_its_full_size_is_refused() {
    let most = PoolTables::most_entries(&GPU.device, FeedbackMode::Separate);
    assert_eq!(most, 1 << 25, "128 MiB");
    let mut tables = PoolTables::direct(&GPU.device, FeedbackMode::Separate).unwrap();
    // 2^22 entries of its finest level, and 2^21 in all coarser ones.
    let geometry = Geometry::new(GeometrySpec { page: 8, ..GeometrySpec::image(16_384, 16_384) }).unwrap();
    let full = PoolTables::full_entries(&geometry);
    assert!(full > 1 << 22 && full < 1 << 23);
    let fits = (0..9).take_while(|&n| {
        tables.has_room(&geometry) && tables.add(number(n), &geometry, Slot::new(0)).is_ok()
    });
    assert_eq!(fits.count() as u64, most / full);
    assert!(matches!(tables.add(number(9), &geometry, Slot::new(0)), Err(GpuError::TableTooLarge { .. })));
    let small = Geometry::new(GeometrySpec::image(1000, 1000)).unwrap();
    assert!(tables.has_room(&small), "what is left is still there for others");
    tables.remove(number(0));
    assert!(tables.has_room(&geometry));
    assert!(tables.bytes() < 1 << 20, "nothing is taken of it before it is wanted");
}

/// Whatever step fails for want of memory, the next update is right.
#[test]
fn an_update_that_fails_at_any_step_is_made_good_by_the_next() {
    for mode in MODES {
        for hashed in [false, true] {
            let mut failed = 0;
            for steps in 0..12 {
                let mut pool = if hashed { Pool::hashed(mode, 20, 17) } else { Pool::direct(mode, 17) };
                pool.add(number(1), &geometries()[1]);
                let changes = pool.changes(number(1), 20);
                pool.update(&changes);
                // Enough to move to larger memory.
                (2..30).for_each(|n| pool.add(number(n), &geometries()[1]));
                let changes: Vec<_> = (1..30).flat_map(|n| pool.changes(number(n), 20)).collect();
                let mut encoder = GPU.device.create_command_encoder(&Default::default());
                fail_after(Some(steps));
                let result = pool.record(&mut encoder, &changes);
                fail_after(None);
                drop(encoder);
                let error = match result {
                    Ok(_) => continue,
                    Err(error) => error,
                };
                assert!(matches!(error, GpuError::OutOfMemory { .. } | GpuError::DeviceLost), "{error}");
                failed += 1;
                let changes: Vec<_> = (1..30).flat_map(|n| pool.changes(number(n), 5)).collect();
                assert!(pool.update(&changes).moved);
                let what = format!("{mode:?}, hashed: {hashed}, failed at step {steps}");
                pool.check(&Memory::of(&pool.tables).words(), &what);
            }
            assert!((2..12).contains(&failed), "{mode:?}, hashed: {hashed}: {failed} steps");
        }
    }
}

/// Where a table goes that was on its way, others come at once, whole.
#[test]
fn what_a_table_leaves_midway_is_as_good_as_new() {
    let mut pool = Pool::direct(FeedbackMode::Raw, 18);
    let of = |side: u32| {
        Geometry::new(GeometrySpec { page: 8, border: 2, ..GeometrySpec::image(side, side) }).unwrap()
    };
    pool.add(number(0), &of(2048));
    pool.budget = 4096;
    let changes = pool.changes(number(0), 300);
    pool.update(&changes);
    assert!(!pool.tables.is_settled());
    pool.remove(number(0));
    assert!(pool.tables.is_settled());
    for n in 1..TEXTURES {
        pool.add(number(n), &of(64 + 8 * n as u32));
    }
    pool.update(&[]);
    for frame in 0..4 {
        let changes: Vec<_> = (1..TEXTURES).flat_map(|n| pool.changes(number(n), 5)).collect();
        pool.update(&changes);
        pool.check(&Memory::of(&pool.tables).words(), &format!("frame {frame}"));
    }
}
