//! The hashed table against the direct one, and its own promises: probes, load, deletions.

use super::*;
use crate::sim::{Knobs, Path, World};
use crate::table::TableImage;
use crate::texture::geometry::{Geometry, GeometrySpec};
use proptest::prelude::*;
use std::collections::BTreeMap;

fn texture() -> TextureNumber {
    TextureNumber::new(7).unwrap()
}

/// The tail of a texture, in slot 0.
fn tail(geometry: &Geometry) -> TableEntry {
    TableEntry::new(geometry.tail().first_level(), Slot::new(0))
}

fn lookup(table: &HashedTable, geometry: &Geometry, pos: PagePos) -> TableEntry {
    table.lookup_in(geometry, texture(), tail(geometry), pos)
}

fn load(geometry: &Geometry, pos: PagePos, slot: u32) -> TableChange {
    let page = PageId::new(texture(), geometry.dims(), pos).unwrap();
    TableChange { page, rule: ChangeRule::Coarser, entry: TableEntry::new(pos.level, Slot::new(slot)) }
}

fn evict(geometry: &Geometry, pos: PagePos, slot: u32, heir: TableEntry) -> TableChange {
    let old = TableEntry::new(pos.level, Slot::new(slot));
    TableChange { rule: ChangeRule::Naming(old), entry: heir, ..load(geometry, pos, slot) }
}

/// What must hold of any table.
fn check(table: &HashedTable) {
    let taken = table.buckets.iter().filter(|bucket| !bucket.is_free()).count();
    assert_eq!(taken, table.len());
    assert!(table.buckets.len().is_power_of_two() && table.buckets.len() >= HashedTable::FEWEST);
    assert!(taken * 2 <= table.buckets.len(), "{taken} in {}", table.buckets.len());
    assert!(table.buckets.len() == HashedTable::FEWEST || taken * 16 >= table.buckets.len());
    assert!(table.longest_probe() <= HASHED_PROBES as usize, "{}", table.longest_probe());
    for (at, bucket) in table.buckets.iter().enumerate().filter(|(_, bucket)| !bucket.is_free()) {
        assert_eq!(table.find(bucket.page), Ok(at), "a page that is not found");
    }
}

/// The largest image: 2^24 pages per axis.
fn endless() -> Geometry {
    Geometry::new(GeometrySpec::image(1 << 31, 1 << 31)).unwrap()
}

proptest! {
    #[test]
    fn it_leads_where_a_direct_table_leads(
        w in 1u32..900, h in 1u32..900, ops in prop::collection::vec(any::<prop::sample::Index>(), 1..120),
    ) {
        let geometry = Geometry::new(GeometrySpec { page: 40, ..GeometrySpec::image(w, h) }).unwrap();
        let pages: Vec<_> = geometry.pages().skip(1).collect();
        prop_assume!(!pages.is_empty());
        let (mut image, mut table) = (TableImage::new(&geometry, Slot::new(0)), HashedTable::new(0));
        let mut resident = BTreeMap::from([(geometry.tail_pos(), 0)]);
        for (n, op) in (1..).zip(&ops) {
            let pos = pages[op.index(pages.len())];
            let change = match resident.remove(&pos) {
                Some(slot) => {
                    let line = std::iter::successors(geometry.parent(pos), |&p| geometry.parent(p));
                    let heir = line.into_iter().find(|p| resident.contains_key(p)).unwrap();
                    evict(&geometry, pos, slot, TableEntry::new(heir.level, Slot::new(resident[&heir])))
                }
                None => {
                    resident.insert(pos, n);
                    load(&geometry, pos, n)
                }
            };
            image.apply(&geometry, &change);
            table.apply(&[change]);
            check(&table);
            prop_assert_eq!(table.len(), resident.len() - 1);
            for pos in geometry.pages() {
                prop_assert_eq!(lookup(&table, &geometry, pos), image.lookup(pos), "{}", pos);
            }
        }
    }

    /// Whatever the pages, and however many: within the bounds, and empty in the end.
    #[test]
    fn load_and_probes_stay_within_bounds(
        count in 1usize..6000, step in 1u32..5000, level in 0u8..12, scattered: bool, seed: u32,
    ) {
        let geometry = endless();
        let side = geometry.level(level).pages[0];
        let at = |n: u32| match scattered {
            true => [n.wrapping_mul(0x9E37_79B9) ^ seed, n.wrapping_mul(0x85EB_CA6B).rotate_left(7)],
            false => [(n % 64) * step, (n / 64) * step],
        };
        let pages: BTreeMap<PagePos, u32> = (0..count as u32)
            .map(|n| (PagePos::at(level, [at(n)[0] % side, at(n)[1] % side, 0]), n))
            .collect();
        let mut table = HashedTable::new(0);
        for (&pos, &slot) in &pages {
            table.apply(&[load(&geometry, pos, slot)]);
        }
        check(&table);
        prop_assert_eq!(table.len(), pages.len());
        for (&pos, &slot) in &pages {
            prop_assert_eq!(lookup(&table, &geometry, pos), TableEntry::new(level, Slot::new(slot)));
        }
        let tail = tail(&geometry);
        for (n, (&pos, &slot)) in pages.iter().enumerate() {
            table.apply(&[evict(&geometry, pos, slot, tail)]);
            if n % 97 == 0 {
                check(&table);
            }
        }
        prop_assert_eq!((table.len(), table.buckets.len()), (0, HashedTable::FEWEST));
        prop_assert!(table.buckets.iter().all(|bucket| bucket.is_free()));
    }
}

#[test]
fn the_same_changes_give_the_same_places() {
    let geometry = endless();
    let run = || {
        let mut table = HashedTable::new(0);
        let changes: Vec<_> =
            (0..3000).map(|n| load(&geometry, PagePos::new_2d(3, n * 7, n % 11), n)).collect();
        changes.chunks(37).for_each(|changes| table.apply(changes));
        (table.seed(), table.buckets)
    };
    assert_eq!(run(), run());
}

#[test]
fn what_was_written_is_told_once_and_a_new_size_tells_all() {
    let geometry = endless();
    let mut table = HashedTable::new(0);
    assert_eq!(table.take_written(), None, "a new table is sent whole");
    let mut copy = table.buckets.clone();
    for n in 0..2000 {
        table.apply(&[load(&geometry, PagePos::new_2d(0, n, n / 3), n)]);
        if n >= 40 && n % 3 == 0 {
            table.apply(&[evict(
                &geometry,
                PagePos::new_2d(0, n - 40, (n - 40) / 3),
                n - 40,
                tail(&geometry),
            )]);
        }
        match table.take_written() {
            None => copy = table.buckets.clone(),
            Some(written) => {
                assert!(written.is_sorted() && written.len() < 40, "{}", written.len());
                written.iter().for_each(|&at| copy[at as usize] = table.buckets[at as usize]);
            }
        }
        assert!(copy == table.buckets, "after page {n}");
    }
    assert!(table.buckets.len() > HashedTable::FEWEST);
}

/// Whoever reads the buckets as they lay before a growth is told what has left since.
#[test]
fn what_was_before_a_growth_goes_on_without_what_leaves() {
    let geometry = endless();
    let page = |n: u32| PagePos::new_2d(0, n, n / 3);
    let mut table = HashedTable::new(0);
    table.take_written();
    let loads = |range: std::ops::Range<u32>| -> Vec<TableChange> {
        range.map(|n| load(&geometry, page(n), n)).collect()
    };
    table.apply(&loads(0..400));
    table.take_written();
    let mut copy = table.buckets.clone();
    // Some leave in the batch in which it grows, by more than one size.
    let mut changes: Vec<TableChange> =
        (0..100).map(|n| evict(&geometry, page(n), n, tail(&geometry))).collect();
    changes.extend(loads(400..3000));
    table.apply(&changes);
    let mut before = table.take_before().unwrap();
    assert!(
        table.take_before().is_none() && table.take_written().is_none() && table.buckets.len() > copy.len()
    );
    for leave in [0..100, 100..200, 500..600] {
        if leave.start > 0 {
            let leaves: Vec<TableChange> =
                leave.clone().map(|n| evict(&geometry, page(n), n, tail(&geometry))).collect();
            before.evict(&leaves);
        }
        let written = before.take_written().unwrap();
        written.iter().for_each(|&at| copy[at as usize] = before.buckets[at as usize]);
        assert!(copy == before.buckets);
        assert!(leave.into_iter().all(|n| lookup(&before, &geometry, page(n)) == tail(&geometry)));
    }
    assert!((200..400).all(|n| lookup(&before, &geometry, page(n)).slot() == Slot::new(n)));
}

/// Changes as the pager makes them, whichever way the camera goes; pages that move between slots among them.
#[test]
fn it_follows_the_pager_as_a_direct_table_does() {
    for path in Path::ALL {
        let knobs = Knobs { slots: 250, ..Knobs::new(path, 1) };
        let geometry = Geometry::new(knobs.spec).unwrap();
        let mut world = World::new(knobs).unwrap();
        let (mut table, tail) = (HashedTable::new(0), world.table.lookup(geometry.tail_pos()));
        for frame in 0..200 {
            world.step().unwrap();
            table.apply(world.table_changes());
            check(&table);
            let texture = TextureNumber::new(0).unwrap();
            if frame % 10 == 0 {
                assert!(
                    geometry
                        .pages()
                        .all(|pos| table.lookup_in(&geometry, texture, tail, pos) == world.table.lookup(pos)),
                    "{path:?}: {frame}"
                );
            }
        }
    }
}

/// The textures of a pool want the same pages of each other's: their numbers alone tell them apart, and
/// neither probes nor buckets are more for it.
#[test]
fn pages_of_many_textures_lie_as_evenly_as_those_of_one() {
    let geometry = endless();
    let mut table = HashedTable::new(16_000);
    let buckets = table.buckets.len();
    let change = |texture: u16, n: u32| {
        let pos = PagePos::new_2d((n / 4) as u8, n % 2, n / 2 % 2);
        let page = PageId::new(TextureNumber::new(texture).unwrap(), geometry.dims(), pos).unwrap();
        let slot = Slot::new(u32::from(texture) * 8 + n);
        TableChange { page, rule: ChangeRule::Coarser, entry: TableEntry::new(pos.level, slot) }
    };
    let changes: Vec<_> = (0..2000).flat_map(|texture| (0..8).map(move |n| (texture, n))).collect();
    changes.iter().for_each(|&(texture, n)| table.apply(&[change(texture, n)]));
    check(&table);
    assert_eq!((table.len(), table.buckets.len()), (16_000, buckets), "it grew only where probes were long");
    for &(texture, n) in &changes {
        let TableChange { page, entry, .. } = change(texture, n);
        assert_eq!(table.get(page), Some(entry));
    }
    // One goes, and only its pages with it.
    let gone = TextureNumber::new(77).unwrap();
    table.take_written();
    let copy = table.buckets.clone();
    table.remove_texture(gone);
    check(&table);
    assert_eq!(table.len(), 16_000 - 8);
    for &(texture, n) in &changes {
        let TableChange { page, entry, .. } = change(texture, n);
        assert_eq!(table.get(page), (texture != 77).then_some(entry));
    }
    let mut copy = copy;
    table.take_written().unwrap().iter().for_each(|&at| copy[at as usize] = table.buckets[at as usize]);
    assert!(copy == table.buckets, "what is written is what has changed");
    // Room that it was made with stays.
    for &(texture, _) in &changes {
        table.remove_texture(TextureNumber::new(texture).unwrap());
    }
    assert_eq!((table.len(), table.buckets.len()), (0, buckets));
}
