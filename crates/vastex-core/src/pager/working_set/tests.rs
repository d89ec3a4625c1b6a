//! The set against the definition of the design, and what comes into it and leaves.

use super::*;
use crate::shader_constants::JITTER_CYCLE;
use crate::texture::geometry::{Geometry, GeometrySpec};
use crate::texture::page::{Dims, PagePos};
use crate::wanted::view::ViewError;
use proptest::prelude::*;
use std::collections::BTreeSet;
use std::sync::Arc;

fn textures() -> (Textures, TextureNumber, Arc<Geometry>) {
    let geometry = Arc::new(Geometry::new(GeometrySpec::image(8192, 4096)).unwrap());
    let mut textures = Textures::default();
    let id = TextureNumber::new(0).unwrap();
    assert!(textures.add(id, geometry.clone(), None));
    (textures, id, geometry)
}

fn wanted(texture: TextureNumber, level: u8, x: u32, y: u32, eighth: u8) -> WantedPage {
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
        set.observe(&Feedback { frame: 0, pages: list.clone(), ..Feedback::default() }, &textures);
        set.rebuild(|_, record| (record, false), |_| false, |_| ContentId::NONE);
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
        set.observe(&Feedback { frame: 0, pages: list.clone(), ..Feedback::default() }, &textures);
        set.rebuild(|page, record| (record, is_resident(page)), |_| false, |_| ContentId::NONE);
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
    set.observe(
        &Feedback { frame: 0, pages: vec![wanted(id, 2, 1, 1, 3)], ..Feedback::default() },
        &textures,
    );
    for frame in 1..=JITTER_CYCLE as u64 {
        set.rebuild(|_, record| (record, false), |_| false, |_| ContentId::NONE);
        assert_eq!(set.size_at(0), 4, "frame {frame}");
        set.observe(&Feedback { frame, ..Feedback::default() }, &textures);
    }
    set.rebuild(|_, record| (record, false), |_| false, |_| ContentId::NONE);
    assert_eq!(set.size_at(0), 0);
}

#[test]
fn a_far_view_is_a_jump_and_a_near_one_is_not() {
    let (textures, id, _) = textures();
    let mut set = WorkingSet::new();
    let view = |x| Feedback { frame: 0, pages: vec![wanted(id, 0, x, 0, 0)], ..Feedback::default() };
    for _ in 0..JITTER_CYCLE {
        assert!(!set.is_jump(&view(40), &textures), "too early to tell");
        set.observe(&view(3), &textures);
    }
    set.rebuild(|_, record| (record, false), |_| false, |_| ContentId::NONE);
    assert!(!set.is_jump(&view(3), &textures));
    assert!(set.is_jump(&view(40), &textures));
    let coarser = Feedback { frame: 1, pages: vec![wanted(id, 3, 0, 0, 0)], ..Feedback::default() };
    assert!(!set.is_jump(&coarser, &textures), "zooming out is no jump");
}

/// What several views want is what any of them wants, at every bias; each is judged by its own window.
mod views {
    use super::*;

    fn feedback(view: u32, pages: Vec<WantedPage>) -> Feedback {
        Feedback { view: ViewId::new(view), pages, ..Feedback::default() }
    }

    fn pages_at(set: &WorkingSet, bias: u16) -> BTreeSet<PageId> {
        set.pages_at(bias).map(|(page, _)| page).collect()
    }

    proptest! {
        #[test]
        fn the_set_is_the_union_of_the_sets_of_each(
            frames in prop::collection::vec((0u32..4, any::<u32>(), 0u8..6, 0u8..8), 1..120),
            weights in prop::array::uniform4(any::<f32>()),
            removed in 0u32..4,
            cut in 0u32..4,
        ) {
            let (textures, id, geometry) = textures();
            let mut together = WorkingSet::new();
            let mut apart: Vec<WorkingSet> = (0..4).map(|_| WorkingSet::new()).collect();
            for (view, set) in (0u32..).zip(&mut apart) {
                let weight = Weight::new(weights[view as usize]);
                let added = together.add_view(ViewId::new(view), weight);
                prop_assert_eq!(added.is_err(), view == 0, "the main view is there");
                together.set_weight(ViewId::new(view), weight);
                let _is_there_for_main = set.add_view(ViewId::new(view), weight);
                set.set_weight(ViewId::new(view), weight);
            }
            for (n, (view, place, level, eighth)) in frames.iter().enumerate() {
                let [nx, ny, _] = geometry.level(*level).pages;
                let pages = vec![wanted(id, *level, place % nx, place / nx % ny, *eighth)];
                together.observe(&feedback(*view, pages.clone()), &textures);
                apart[*view as usize].observe(&feedback(*view, pages), &textures);
                if n == frames.len() / 2 {
                    together.restart(ViewId::new(cut));
                    apart[cut as usize].restart(ViewId::new(cut));
                }
            }
            if removed > 0 {
                prop_assert!(together.remove_view(ViewId::new(removed)));
                apart[removed as usize] = WorkingSet::new();
            }
            together.rebuild(|_, record| (record, false), |_| false, |_| ContentId::NONE);
            apart.iter_mut().for_each(|set| set.rebuild(|_, record| (record, false), |_| false, |_| ContentId::NONE));
            for bias in [0, 1, 3, 8, 20, 47] {
                let union: BTreeSet<PageId> = apart.iter().flat_map(|set| pages_at(set, bias)).collect();
                prop_assert_eq!(together.size_at(bias) as usize, union.len());
                prop_assert_eq!(pages_at(&together, bias), union);
            }
            // The shares of pixels add up.
            let sum = |of: fn(&WorkingSet) -> u64| apart.iter().map(of).sum::<u64>();
            prop_assert_eq!(together.pixels(), sum(WorkingSet::pixels));
            prop_assert_eq!(together.shortfall().pixels, sum(|set| set.shortfall().pixels));
            prop_assert_eq!(together.shortfall().levels, sum(|set| set.shortfall().levels));
        }
    }

    #[test]
    fn a_jump_is_told_by_the_window_of_its_view() {
        let (textures, id, _) = textures();
        let mut set = WorkingSet::new();
        set.add_view(ViewId::new(5), Weight::ONE).unwrap();
        let (here, there) = (vec![wanted(id, 0, 3, 0, 0)], vec![wanted(id, 0, 40, 0, 0)]);
        for _ in 0..JITTER_CYCLE {
            set.observe(&feedback(0, here.clone()), &textures);
            set.observe(&feedback(5, there.clone()), &textures);
        }
        set.rebuild(|_, record| (record, false), |_| false, |_| ContentId::NONE);
        assert!(set.is_cut(&feedback(0, there.clone()), &textures), "though the other view wants it");
        assert!(!set.is_cut(&feedback(5, there), &textures));
        assert!(set.is_cut(&feedback(5, here), &textures));
        assert!(!set.is_cut(&feedback(7, vec![wanted(id, 0, 60, 0, 0)]), &textures), "there is no such view");
    }

    #[test]
    fn numbers_and_places_of_views_run_out() {
        let mut set = WorkingSet::new();
        for view in 1..MAX_VIEWS as u32 {
            assert_eq!(set.add_view(ViewId::new(view), Weight::ONE), Ok(()));
            assert_eq!(set.add_view(ViewId::new(view), Weight::ONE), Err(ViewError::NumberTaken(view)));
        }
        assert_eq!(set.add_view(ViewId::new(100), Weight::ONE), Err(ViewError::TooMany));
        assert!(set.remove_view(ViewId::new(3)) && !set.remove_view(ViewId::new(3)));
        assert_eq!(set.add_view(ViewId::new(100), Weight::ONE), Ok(()));
    }
}
