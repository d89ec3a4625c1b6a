//! Whatever happens in whatever order: no wrong byte, no byte beyond the budget.

use proptest::prelude::*;

use super::*;
use memory_disk::Troubles;

#[derive(Clone, Debug)]
enum Step {
    /// Of one of two sources that share the tier.
    Read {
        other: bool,
        page: u32,
    },
    Flip {
        file: prop::sample::Index,
        at: prop::sample::Index,
        bits: u8,
    },
    Reopen {
        budget: u64,
    },
    Trouble {
        capacity: Option<u64>,
        read_only: bool,
        keeps_torn: bool,
    },
    Crash {
        after: u64,
        sixteenths: u64,
    },
    Vanish,
}

fn any_step() -> impl Strategy<Value = Step> {
    let budget = prop::sample::select(vec![0, 400, 5 * ENTRY, 30 << 10, 65 << 10, 150 << 10, 1 << 30]);
    let capacity = prop::option::of(0u64..100 << 10);
    prop_oneof![
        40 => (any::<bool>(), 0u32..169).prop_map(|(other, page)| Step::Read { other, page }),
        4 => (any::<prop::sample::Index>(), any::<prop::sample::Index>(), 1u8..)
            .prop_map(|(file, at, bits)| Step::Flip { file, at, bits }),
        2 => budget.prop_map(|budget| Step::Reopen { budget }),
        2 => (capacity, prop::bool::weighted(0.2), any::<bool>())
            .prop_map(|(capacity, read_only, keeps_torn)| Step::Trouble { capacity, read_only, keeps_torn }),
        1 => (0u64..20, 0u64..16).prop_map(|(after, sixteenths)| Step::Crash { after, sixteenths }),
        1 => Just(Step::Vanish),
    ]
}

/// A source of the same shape as [`source`] with other texels.
fn other_source() -> Faults<PropertySource, impl Fn(PagePos, u32) -> Option<Injection>> {
    Faults::new(source(), |pos: PagePos, _| {
        let mut tile = block_on(source().read(pos)).unwrap();
        tile.bytes = tile.bytes.iter().map(|byte| !byte).collect();
        Some(Injection::Replace(tile))
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(150))]

    #[test]
    fn no_wrong_byte_is_ever_served(steps in prop::collection::vec(any_step(), 0..400)) {
        let mut disk = MemoryDisk::default();
        let mut budget = 65 << 10;
        let mut tier = open(&disk, budget);
        for step in steps {
            match step {
                Step::Read { other: false, page: n } => drop(read(&cached(&tier), page(n))),
                Step::Read { other: true, page: n } => {
                    let cache = DiskCache::new(other_source(), tier.clone(), SourceKey::of("other"));
                    let expected = block_on(other_source().read(page(n))).unwrap();
                    prop_assert_eq!(block_on(cache.read(page(n))).unwrap(), expected);
                    flush(&tier);
                }
                Step::Flip { file, at, bits } => {
                    let files: Vec<_> = disk.files().into_iter().filter(|(_, bytes)| !bytes.is_empty()).collect();
                    if !files.is_empty() {
                        let (name, bytes) = file.get(&files);
                        disk.flip(name, at.index(bytes.len()), bits);
                    }
                }
                Step::Reopen { budget: smaller_or_larger } => {
                    budget = smaller_or_larger;
                    disk = MemoryDisk::of(&disk.files());
                    tier = open(&disk, budget);
                }
                Step::Trouble { capacity, read_only, keeps_torn } => {
                    disk.set(Troubles { capacity, read_only, keeps_torn, ..Troubles::default() });
                }
                Step::Crash { after, sixteenths } => {
                    disk.set(Troubles { killed_after: Some((after, sixteenths)), ..Troubles::default() });
                }
                Step::Vanish => disk.remove_all(),
            }
            prop_assert!(disk.most_bytes() <= budget);
            prop_assert!(tier.stats().bytes <= budget);
        }
    }
}
