//! Page tables that become very large, finer while they are on their way, and small again; and what is sent
//! for a hash table.

use std::collections::VecDeque;

use vastex_core::{Geometry, GeometrySpec, PagePos};
use vastex_wgpu::{FeedbackMode, RECORDED_AHEAD};

use crate::pool_tables::check_former;
use crate::pool_world::{MODES, Memory, Pool, geometries, number};

fn image(side: u32) -> Geometry {
    Geometry::new(GeometrySpec { page: 8, border: 2, ..GeometrySpec::image(side, side) }).unwrap()
}

/// 2048 x 2048 pages of level 0: more workgroups than a dispatch has along one axis.
#[test]
fn a_large_level_is_filled_on_the_gpu() {
    let mut pool = Pool::direct(FeedbackMode::Separate, 21);
    let (of, geometry) = (number(3), image(16_384));
    pool.add(of, &geometry);
    pool.update(&[]);
    let load = pool.load(of, PagePos::new_2d(0, 1500, 700));
    let applied = pool.update(&[load]);
    assert!(applied.bytes < 2048, "{} bytes", applied.bytes);
    assert!(pool.tables.is_settled());
    assert_eq!(pool.placements[&of].finest, 0);
    let entries = pool.check(&Memory::of(&pool.tables).words(), "after the load");
    assert!(entries > 1 << 22, "{entries}");
}

/// What comes while a table is on its way is not waited for by what comes before it.
#[test]
fn a_level_that_comes_while_a_table_grows_is_grown_to_afterwards() {
    let mut pool = Pool::direct(FeedbackMode::Raw, 22);
    let (of, geometry) = (number(5), image(2048));
    pool.add(of, &geometry);
    pool.update(&[]);
    pool.budget = 1024;
    let load = pool.load(of, PagePos::new_2d(2, 20, 30));
    pool.update(&[load]);
    let mut finest = vec![pool.placements[&of].finest];
    assert!(!pool.tables.is_settled() && finest[0] > 2, "{finest:?}");
    pool.budget = 8192;
    let mut changes = vec![pool.load(of, PagePos::new_2d(0, 100, 200))];
    while !pool.tables.is_settled() {
        pool.update(&changes);
        changes.clear();
        pool.check(&Memory::of(&pool.tables).words(), &format!("after {finest:?}"));
        finest.push(pool.placements[&of].finest);
        assert!(finest.len() < 100, "{finest:?}");
    }
    assert!(finest.is_sorted_by(|a, b| a >= b), "{finest:?}");
    finest.dedup();
    assert!(finest.ends_with(&[2, 1, 0]), "{finest:?}");
}

/// A hash table sends the buckets that differ, and what names them.
#[test]
fn a_hash_table_sends_in_proportion_to_what_changes() {
    for mode in MODES {
        let mut pool = Pool::hashed(mode, 3000, 23);
        (0..10).for_each(|n| pool.add(number(n), &geometries()[1 + n % 5]));
        pool.update(&[]);
        for frame in 0..20 {
            let before = pool.tables.hash_table().unwrap().buckets().to_vec();
            let changes: Vec<_> = (0..10).flat_map(|n| pool.changes(number(n), 5)).collect();
            let applied = pool.update(&changes);
            let now = pool.tables.hash_table().unwrap().buckets();
            let differ = before.iter().zip(now).filter(|(was, is)| was.words() != is.words()).count() as u64;
            // In a texture whole rows of 512 bytes are copied.
            let of_bucket = if mode == FeedbackMode::Raw { 2 * 512 } else { 32 };
            let most = 64 + of_bucket * (differ + 2 * changes.len() as u64);
            assert!(applied.bytes <= most, "{mode:?}, frame {frame}: {} bytes for {differ}", applied.bytes);
            assert!(!applied.moved && differ > 0, "{mode:?}, frame {frame}");
        }
        assert_eq!(pool.update(&[]).bytes, 0, "{mode:?}");
    }
}

/// With nothing in it, a hash table takes as little as at first.
#[test]
fn a_hash_table_shrinks_and_gives_its_memory_back() {
    for mode in MODES {
        let mut pool = Pool::hashed(mode, 1, 24);
        let (of, geometry) = (number(7), image(512));
        pool.add(of, &geometry);
        pool.update(&[]);
        let (at_first, pages) = (pool.tables.bytes(), geometry.pages().skip(1).take(2000));
        let pages: Vec<PagePos> = pages.filter(|pos| !geometry.is_tail(*pos)).collect();
        let mut former = VecDeque::new();
        let mut most = 0;
        for step in 0..32 {
            let chunk = &pages[step % 16 * 125..][..125];
            let (bound, was) = (Memory::of(&pool.tables), pool.tables.hash_table().unwrap().buckets().len());
            let changes: Vec<_> = match step < 16 {
                true => chunk.iter().map(|&pos| pool.load(of, pos)).collect(),
                // The finest first, so that each goes while what is coarser is there.
                false => {
                    let chunk = &pages[(31 - step) * 125..][..125];
                    chunk.iter().rev().map(|&pos| pool.evict(of, pos)).collect()
                }
            };
            let applied = pool.update(&changes);
            let is = pool.tables.hash_table().unwrap().buckets().len();
            assert_eq!(applied.moved, was != is, "{mode:?}, step {step}");
            former.retain(|(moved, _)| *moved + 2 > step);
            if applied.moved {
                former.push_back((step, bound));
            }
            let what = format!("{mode:?}, step {step}");
            for (_, memory) in &former {
                check_former(&pool, &memory.words(), &what);
            }
            pool.check(&Memory::of(&pool.tables).words(), &what);
            most = most.max(pool.tables.bytes());
        }
        assert_eq!(pool.tables.hash_table().unwrap().len(), 0);
        (0..=RECORDED_AHEAD).for_each(|_| {
            pool.update(&[]);
        });
        assert!(pool.tables.bytes() == at_first && most > 2 * at_first, "{mode:?}: {at_first}, {most}");
    }
}
