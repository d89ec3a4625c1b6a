//! Containers rewritten along a curve: the same tiles, near in the file where they are near in the image.

use std::ops::ControlFlow;

use pollster::block_on;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use vastex_core::{LayerFormat, PagePos};

use crate::testing::textures::{any_description, container_bytes, image, open, texels};
use crate::*;

fn go_on(_: u64, _: u64) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 30, rng_seed: RngSeed::Fixed(6), failure_persistence: None, ..Default::default() })]

    #[test]
    fn every_tile_stays_what_it_was(description in any_description(), seed in 0u64..50) {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.vastex");
        let bytes = container_bytes(&description, Compression::Lz4, seed);
        std::fs::write(&path, &bytes).unwrap();
        let written = reorder(&path, &path, false, go_on).unwrap();
        let store = std::sync::Arc::new(FileStore::open(&path).unwrap());
        prop_assert_eq!(block_on(verify(store, |_, _| {})).faults, vec![]);
        prop_assert_eq!(written.bytes, bytes.len() as u64);
        let container = Container::open_file(&path).unwrap();
        prop_assert_eq!(container.info(), open(bytes).info());
        for pos in description.geometry.pages() {
            let tile = block_on(container.read(pos)).unwrap().decode(&description).unwrap();
            prop_assert!(tile == texels(&description, pos, seed), "{}", pos);
        }
    }
}

#[test]
fn tiles_follow_the_curve_and_earlier_versions_are_left_out() {
    let dir = tempfile::tempdir().unwrap();
    let (path, output) = (dir.path().join("a.vastex"), dir.path().join("b.vastex"));
    let description = image(2000, 1500, 250, LayerFormat::Rgba8);
    std::fs::write(&path, container_bytes(&description, Compression::None, 3)).unwrap();
    let mut update = ContainerUpdate::open(&path, false).unwrap();
    let pos = PagePos::new_2d(0, 1, 1);
    let noise: Vec<u8> = (0..description.tile_bytes()).map(|n| ((n * n) >> 5) as u8).collect();
    update.replace(pos, EncodedTile::new(noise.into(), &description, Compression::None)).unwrap();
    let updated = update.commit().unwrap();
    let written = reorder(&path, &output, true, go_on).unwrap();
    assert!(written.bytes <= updated.bytes - updated.bytes_superseded + 1024);
    let container = Container::open_file(&output).unwrap();
    let offset = |[x, y]: [u32; 2]| {
        let page = container.number_of(PagePos::new_2d(0, x, y)).unwrap();
        let record = container.index().record(container.index().record_of_page(page).unwrap()).unwrap();
        (record.codec == Codec::Raw).then_some(record.section.extent.offset)
    };
    let curve =
        [[0, 0], [1, 0], [0, 1], [1, 1], [2, 0], [3, 0], [2, 1], [3, 1], [0, 2], [1, 2], [0, 3], [1, 3]];
    let mut seen = std::collections::HashSet::new();
    let offsets: Vec<u64> =
        curve.into_iter().filter_map(offset).filter(|&offset| seen.insert(offset)).collect();
    assert!(offsets.len() > 4 && offsets.is_sorted(), "{offsets:?}");
    let cancelled = reorder(&path, &output, false, |_, _| ControlFlow::Break(())).unwrap_err();
    assert!(matches!(cancelled, ReorderError::Cancelled));
}
