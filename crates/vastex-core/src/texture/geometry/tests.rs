//! How levels and pages nest, whatever the sizes and factors.

use super::*;
use proptest::prelude::*;

/// Any shape that is quick to walk: up to 1000 texels per side, odd pages included.
pub(crate) fn any_geometry() -> impl Strategy<Value = Geometry> {
    (any::<bool>(), prop::array::uniform3(1u32..1000), 8u32..80, 1u32..5).prop_map(
        |(volume, size, page, border)| {
            let dims = if volume { Dims::D3 } else { Dims::D2 };
            let size = if volume { size.map(|n| n.div_ceil(4)) } else { [size[0], size[1], 1] };
            Geometry::new(GeometrySpec { dims, size, page, border, ..GeometrySpec::image(1, 1) }).unwrap()
        },
    )
}

proptest! {
    #[test]
    fn pages_nest(geometry in any_geometry()) {
        for pos in geometry.pages() {
            prop_assert!(geometry.contains(pos));
            let Some(parent) = geometry.parent(pos) else {
                prop_assert!(geometry.is_tail(pos));
                continue;
            };
            prop_assert!(geometry.contains(parent));
            let (lo, hi) = geometry.descendants(parent, pos.level);
            let c = pos.coords();
            prop_assert!((0..3).all(|a| lo[a] <= c[a] && c[a] < hi[a]), "{pos} is not under its parent {parent}");
        }
    }

    #[test]
    fn children_cover_their_parent_once(geometry in any_geometry()) {
        for level in 1..geometry.tail().first_level() {
            let mut covered = 0;
            for pos in geometry.pages_of_level(level) {
                let (lo, hi) = geometry.descendants(pos, level - 1);
                covered += (0..3).map(|a| u64::from(hi[a] - lo[a])).product::<u64>();
            }
            prop_assert_eq!(covered, geometry.level(level - 1).page_count());
        }
    }
}

proptest! {
    #[test]
    fn a_layer_of_half_the_resolution_has_the_same_pages(
        size in prop::array::uniform2(1u32..3000), page in 1u32..20, border in 1u32..3, quarter: bool,
    ) {
        let scale = if quarter { 4 } else { 2 };
        let spec = GeometrySpec {
            page: 8 * page, border: 4 * border, tail_align: 4 * scale, ..GeometrySpec::image(size[0], size[1])
        };
        let Ok(geometry) = Geometry::new(spec) else { return Ok(()) };
        let layer = geometry.of_layer(scale);
        for (whole, part) in geometry.levels().iter().zip(layer.levels()) {
            for a in 0..2 {
                prop_assert_eq!(part.pages[a], part.size[a].div_ceil(layer.page()[a]));
                prop_assert_eq!(part.size[a], whole.size[a].div_ceil(scale));
            }
        }
        for level in geometry.tail().first_level()..=geometry.coarsest() {
            let (whole, part) = (geometry.tail().offset(level), layer.tail().offset(level));
            prop_assert_eq!(part.map(|n| n * scale)[..2].to_vec(), whole[..2].to_vec());
            let shown = layer.level_box_of_tail(level).size;
            prop_assert!((0..2).all(|a| part[a] + shown[a] <= layer.tile()[a]));
        }
    }
}

#[test]
fn texels_that_keep_their_positions_are_off_by_less_than_half() {
    let spec = GeometrySpec { positions: TexelPositions::Kept, ..GeometrySpec::image(1000, 777) };
    let geometry = Geometry::new(spec).unwrap();
    // Texel 1 of level 2 lies where texel 4 of level 0 does.
    let offset = geometry.sample_offset(2)[0];
    assert_eq!(4.5 / 4.0 + offset, 1.5);
    assert_eq!(geometry.sample_offset(0), [0.0; 3]);
}

#[test]
fn levels_halve_upwards_to_one_texel() {
    let geometry = Geometry::new(GeometrySpec::image(1000, 777)).unwrap();
    let sizes: Vec<_> = geometry.levels().iter().map(|l| [l.size[0], l.size[1]]).collect();
    assert_eq!(sizes[..4], [[1000, 777], [500, 389], [250, 195], [125, 98]]);
    assert_eq!(sizes.last(), Some(&[1, 1]));
    assert_eq!(geometry.coarsest(), 10);
}

#[test]
fn the_largest_texture_is_addressable() {
    let geometry = Geometry::new(GeometrySpec::image(MAX_TEXELS, MAX_TEXELS)).unwrap();
    assert_eq!((geometry.levels().len(), geometry.level(0).pages), (32, [1 << 24, 1 << 24, 1]));
    let last = PagePos::new_2d(0, (1 << 24) - 1, 0);
    assert_eq!(geometry.ancestor(last, 20), PagePos::new_2d(20, 15, 0));
}

#[test]
fn impossible_shapes_are_refused() {
    let image = GeometrySpec::image(100, 100);
    let refused = |spec| Geometry::new(spec).unwrap_err();
    assert_eq!(refused(GeometrySpec { page: 0, ..image }), GeometryError::Page(0));
    assert_eq!(refused(GeometrySpec { page: 100_000, ..image }), GeometryError::Page(100_000));
    assert_eq!(refused(GeometrySpec { border: 0, ..image }), GeometryError::Border { border: 0, page: 128 });
    assert_eq!(
        refused(GeometrySpec { border: 65, ..image }),
        GeometryError::Border { border: 65, page: 128 }
    );
    assert_eq!(refused(GeometrySpec::image(0, 5)), GeometryError::Size([0, 5, 1]));
    assert_eq!(refused(GeometrySpec { size: [5, 5, 2], ..image }), GeometryError::Size([5, 5, 2]));
    let huge = GeometrySpec { page: 8, ..GeometrySpec::image(MAX_TEXELS, 8) };
    assert!(matches!(refused(huge), GeometryError::Pages { pages: 268_435_456, max: 16_777_216, .. }));
    assert_eq!(Geometry::with_factors(image, &[[0, 2, 1]]).unwrap_err(), GeometryError::Levels(1));
    assert_eq!(Geometry::with_factors(image, &[[10, 10, 1]]).unwrap_err(), GeometryError::Levels(1));
}

#[test]
fn factors_other_than_two_nest_too() {
    let geometry =
        Geometry::with_factors(GeometrySpec::image(900, 300), &[[3, 1, 1], [300, 300, 1]]).unwrap();
    assert_eq!(geometry.level(1).size, [300, 300, 1]);
    assert_eq!(geometry.ancestor(PagePos::new_2d(0, 5, 2), 1), PagePos::new_2d(1, 1, 2));
}
