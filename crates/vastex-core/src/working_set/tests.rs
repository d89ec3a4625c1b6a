//! The set against the definition of the design, and what comes into it and leaves.

use super::*;
use crate::geometry::{Geometry, GeometrySpec};
use crate::page::{Dims, PagePos};
use proptest::prelude::*;
use std::collections::BTreeSet;
use std::sync::Arc;

fn textures() -> (Textures, TextureId, Arc<Geometry>) {
    let geometry = Arc::new(Geometry::new(GeometrySpec::image(8192, 4096)).unwrap());
    let mut textures = Textures::default();
    let id = TextureId::new(0).unwrap();
    assert!(textures.add(id, geometry.clone(), None));
    (textures, id, geometry)
}

fn wanted(texture: TextureId, level: u8, x: u32, y: u32, eighth: u8) -> WantedPage {
    let page = PageId::new(texture, Dims::D2, PagePos::new_2d(level, x, y)).unwrap();
    WantedPage { page, pixels: 1, eighth }
}

/// The set at a bias as the design states it: for each need, the ancestor at its level, and its ancestors.
fn naive(list: &[WantedPage], geometry: &Geometry, bias: u16) -> BTreeSet<PagePos> {
    let mut set = BTreeSet::new();
    for w in list {
        let pos = w.page.pos(Dims::D2);
        let level = Need::new(pos.level, w.eighth).level_at(bias);
        let mut at = geometry.ancestor(pos, level.min(geometry.coarsest()));
        while !geometry.is_tail(at) {
            set.insert(at);
            at = geometry.parent(at).unwrap();
        }
    }
    set
}

proptest! {
    #[test]
    fn thresholds_agree_with_the_definition(list in prop::collection::vec((0u8..6, any::<u32>(), any::<u32>(), 0u8..8), 0..60)) {
        let (textures, id, geometry) = textures();
        let list: Vec<_> = list.into_iter().map(|(level, x, y, eighth)| {
            let [nx, ny, _] = geometry.level(level).pages;
            wanted(id, level, x % nx, y % ny, eighth)
        }).collect();
        let mut set = WorkingSet::new();
        set.observe(&Feedback { frame: 0, pages: list.clone(), degenerate: 0 }, &textures);
        set.rebuild(|_, record| (record, false));
        for bias in 0..70 {
            let expected = naive(&list, &geometry, bias);
            prop_assert_eq!(set.size_at(bias) as usize, expected.len());
            let pages: BTreeSet<_> = set.pages_at(bias).map(|(page, _)| page.pos(Dims::D2)).collect();
            prop_assert_eq!(pages, expected);
        }
        for limit in 0..60 {
            let bias = set.bias_for(limit);
            prop_assert!(set.size_at(bias) <= limit);
            prop_assert!(bias == 0 || set.size_at(bias - 1) > limit);
        }
    }
}

proptest! {
    #[test]
    fn the_shortfall_is_what_each_pixel_lacks(
        list in prop::collection::vec((0u8..10, any::<u32>(), any::<u32>(), 1u32..100), 0..60),
        residents in 0u64..8,
    ) {
        let (textures, id, geometry) = textures();
        let list: Vec<_> = list.into_iter().map(|(level, x, y, pixels)| {
            let [nx, ny, _] = geometry.level(level).pages;
            WantedPage { pixels, ..wanted(id, level, x % nx, y % ny, 0) }
        }).collect();
        // More of the coarse pages than of the fine ones.
        let is_resident =
            |page: PageId| page.to_bits().wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 61 < residents + u64::from(page.level());
        let mut set = WorkingSet::new();
        set.observe(&Feedback { frame: 0, pages: list.clone(), degenerate: 0 }, &textures);
        set.rebuild(|page, record| (record, is_resident(page)));
        let (mut pixels, mut levels) = (0, 0);
        for w in &list {
            let shown = std::iter::once(w.page)
                .chain(textures.ancestors(w.page))
                .find(|&page| textures.is_tail(page) || is_resident(page))
                .unwrap();
            let short = u64::from(shown.level().saturating_sub(w.page.level()));
            pixels += u64::from(w.pixels) * u64::from(short > 0);
            levels += u64::from(w.pixels) * short;
        }
        prop_assert_eq!((set.shortfall().pixels, set.shortfall().levels), (pixels, levels));
        prop_assert_eq!(set.pixels(), list.iter().map(|w| u64::from(w.pixels)).sum::<u64>());
    }
}

#[test]
fn a_page_stays_for_one_jitter_cycle() {
    let (textures, id, _) = textures();
    let mut set = WorkingSet::new();
    set.observe(&Feedback { frame: 0, pages: vec![wanted(id, 2, 1, 1, 3)], degenerate: 0 }, &textures);
    for frame in 1..=JITTER_CYCLE as u64 {
        set.rebuild(|_, record| (record, false));
        assert_eq!(set.size_at(0), 4, "frame {frame}");
        set.observe(&Feedback { frame, ..Feedback::default() }, &textures);
    }
    set.rebuild(|_, record| (record, false));
    assert_eq!(set.size_at(0), 0);
}

#[test]
fn a_far_view_is_a_jump_and_a_near_one_is_not() {
    let (textures, id, _) = textures();
    let mut set = WorkingSet::new();
    let view = |x| Feedback { frame: 0, pages: vec![wanted(id, 0, x, 0, 0)], degenerate: 0 };
    for _ in 0..JITTER_CYCLE {
        assert!(!set.is_jump(&view(40), &textures), "too early to tell");
        set.observe(&view(3), &textures);
    }
    set.rebuild(|_, record| (record, false));
    assert!(!set.is_jump(&view(3), &textures));
    assert!(set.is_jump(&view(40), &textures));
    let coarser = Feedback { frame: 1, pages: vec![wanted(id, 3, 0, 0, 0)], degenerate: 0 };
    assert!(!set.is_jump(&coarser, &textures), "zooming out is no jump");
}
