//! What is said of who takes a pool: its sums are the pool's own counts, in any world.

use vastex_core::sim::{Crowd, Path};
use vastex_core::{BiasRule, Budgets, Event, GeometrySpec, PoolUsage, TextureNumber};

const BUDGETS: Budgets = Budgets { upload_bytes_per_frame: 4000, in_flight_bytes: 20_000 };

fn image(side: u32) -> GeometrySpec {
    GeometrySpec::image(side, side)
}

/// Two pools, the first with three textures and the second with one.
fn crowd(slots: u32, seed: u64) -> Crowd {
    let mut crowd = Crowd::new(BUDGETS, [320, 180], seed);
    let [first, second] =
        [slots, 300].map(|slots| crowd.add_pool(slots, 100, Some(BiasRule::Solved)).unwrap());
    crowd.add(first, image(1000), Path::Still).unwrap();
    crowd.add(first, image(30_000), Path::Spin).unwrap();
    crowd.add(first, image(7000), Path::Fly).unwrap();
    crowd.add(second, image(9000), Path::Zoom).unwrap();
    crowd
}

fn check(usage: &PoolUsage, crowd: &Crowd) {
    let pager = crowd.pager.pool(usage.pool);
    let stats = pager.stats();
    assert_eq!((usage.slots, usage.occupied, usage.locked), (stats.slots, stats.occupied, stats.locked));
    assert_eq!(usage.bias_eighths, stats.bias_eighths);
    assert_eq!(usage.pages, usage.textures.iter().map(|texture| texture.pages).sum::<u32>());
    assert!(usage.textures.is_sorted_by(|a, b| (b.pages, a.texture) <= (a.pages, b.texture)), "{usage:?}");
    let slots = pager.slots();
    let taken: Vec<_> = slots.iter().flatten().collect();
    assert_eq!((slots.len(), taken.len()), (stats.slots as usize, stats.occupied as usize));
    assert_eq!(taken.iter().map(|slot| slot.pages).sum::<u32>(), usage.pages);
    assert_eq!(taken.iter().filter(|slot| slot.is_locked).count(), stats.locked as usize);
    for (page, slot) in pager.resident() {
        assert!(slots[slot.index() as usize].is_some_and(|usage| usage.page <= page));
    }
    for texture in &usage.textures {
        assert_eq!(texture.pages, texture.levels.iter().map(|&(_, pages)| pages).sum::<u32>());
        for &(level, pages) in &texture.levels {
            let own = pager.resident().map(|(page, _)| page).filter(|page| page.texture() == texture.texture);
            assert_eq!(own.filter(|page| page.level() == level).count() as u32, pages);
        }
    }
}

#[test]
fn the_pages_of_all_textures_and_levels_are_the_slots_occupied() {
    for seed in 0..6 {
        let mut crowd = crowd(10 + 40 * seed as u32, seed);
        for frame in 0..60 {
            crowd.step().unwrap();
            if frame == 40 {
                let gone = crowd.textures().nth(seed as usize % 4).unwrap();
                crowd.remove(gone).unwrap();
            }
            crowd.pager.pools().for_each(|pager| check(&pager.usage(), &crowd));
        }
    }
}

#[test]
fn an_oversubscribed_pool_names_the_textures_that_want_most() {
    let mut crowd = crowd(20, 1);
    let mut named = 0;
    let mut seen = 0;
    for _ in 0..30 {
        let before: Vec<u32> = crowd.pager.pools().map(|pager| pager.stats().occupied).collect();
        crowd.step().unwrap();
        for (_, event) in crowd.events.iter().skip(seen) {
            let Event::Oversubscribed { pool, wanted, slots, occupied, bias_eighths, largest } = event else {
                continue;
            };
            named += 1;
            assert_eq!((pool.number(), *slots, largest.len()), (0, 20, 3));
            assert!(*bias_eighths > 0 && *occupied == before[0] && *wanted > 18);
            assert!(largest.is_sorted_by_key(|pages| std::cmp::Reverse(pages.wanted)), "{largest:?}");
            // The tails are wanted as well, of each texture one.
            assert_eq!(*wanted, 3 + largest.iter().map(|pages| pages.wanted).sum::<u32>());
            assert_eq!(*occupied, largest.iter().map(|pages| pages.resident).sum::<u32>());
            assert_eq!(largest[0].texture, TextureNumber::new(1).unwrap(), "the largest of them all");
        }
        seen = crowd.events.len();
    }
    assert!(named > 0);
}
