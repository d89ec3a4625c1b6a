//! Small textures are kept whole: the same picture, at once, and nothing to page.

use std::sync::Arc;

use vastex::{AddressMode, FeedbackMode, Filter, Geometry, Settings, TileSource};
use vastex_core::GeometrySpec;
use vastex_scenes::{Attribute, Comparison, Offscreen, Path, Planet, Scene};
use vastex_tiles::PropertySource;

use crate::common::{Image, converged, gpu, is_processor, settings};
use crate::pictures::assert_alike;

const SIZE: [u32; 2] = [320, 180];

/// Settings by which a texture of a few MiB is held whole.
fn whole(filter: Filter) -> Settings {
    Settings { whole_bytes: 16 << 20, ..settings(16, filter) }
}

/// The share of pixels that may show the texel beside theirs: on a GPU twice as many as ties of nearest are
/// (docs/draw-checks.md, "What a GPU may differ by"). By a software driver no pixel of these pictures does.
fn ties() -> f64 {
    if is_processor() { 0.0 } else { 4.0 / 16_384.0 }
}

#[test]
fn a_texture_that_fits_is_sharp_at_once_and_equals_an_ordinary_one() {
    for (mode, filter) in [
        (AddressMode::Clamp, Filter::Trilinear),
        (AddressMode::Wrap, Filter::Bilinear),
        (AddressMode::Mirror, Filter::Nearest),
        (AddressMode::Border, Filter::Trilinear),
    ] {
        let image = Image { address: [mode; 2], ..Image::new(1000, 777, 128) };
        let (_directory, file) = image.build();
        let source = vastex::open(file).unwrap();
        for scene in Scene::SMOOTH {
            let mut offscreen = Offscreen::new(gpu(), source.clone(), scene, SIZE, whole(filter)).unwrap();
            offscreen.frame(Path::Still.pose(scene, 1.0, 0)).unwrap();
            let what = format!("{mode:?} {filter:?} {scene:?}");
            let compared = offscreen.compare().unwrap().0;
            // The same pixels as from pages, once those are all there.
            let paged = converged(source.clone(), scene, SIZE, Path::Still, settings(16, filter));
            if filter == Filter::Trilinear {
                assert_alike(&compared, &what);
            }
            let of_pages = paged.compare().unwrap().0;
            assert!(
                compared.share_beyond_3_255 <= of_pages.share_beyond_3_255 + ties(),
                "{what}: {compared:?} {of_pages:?}"
            );
            let comparison = Comparison::of(&offscreen.picture(), &paged.picture());
            assert!(comparison.share_beyond_3_255 <= ties(), "{what}: {comparison:?}");
            let least = if is_processor() { 0.9999 } else { 0.999 };
            assert!(comparison.share_within_1_255 > least, "{what}: {comparison:?}");
        }
    }
}

#[test]
fn it_asks_for_no_page_and_takes_no_more_than_itself() {
    let spec = GeometrySpec { page: 64, ..GeometrySpec::image(1024, 512) };
    let source: Arc<dyn TileSource> = Arc::new(PropertySource::new(Geometry::new(spec).unwrap()));
    for mode in FeedbackMode::ALL {
        let settings = Settings { feedback: Some(mode), ..whole(Filter::Nearest) };
        let mut offscreen = Offscreen::new(gpu(), source.clone(), Scene::Globe, SIZE, settings).unwrap();
        for frame in 0..40 {
            offscreen.frame(Path::Zoom.pose(Scene::Globe, 2.0, 7 * frame)).unwrap();
        }
        let stats = offscreen.textures().stats();
        assert_eq!((stats.pager.requests, stats.pager.loaded, stats.pager.missing), (0, 0, 0), "{mode:?}");
        assert_eq!((stats.pager.slots, stats.pager.resident, stats.table_bytes_sent), (1, 1, 0), "{mode:?}");
        assert_eq!(offscreen.share_at_wanted_level().unwrap(), 1.0);
        // A square that holds all levels: at most twice the wider side of this one.
        assert!(stats.pool_bytes <= 4 * 1040 * 1040, "{} bytes", stats.pool_bytes);
    }
}

/// Beside a texture that is paged, in one group.
#[test]
fn a_group_has_members_of_either_kind() {
    let source = |width, height| -> Arc<dyn TileSource> {
        let spec = GeometrySpec { page: 64, ..GeometrySpec::image(width, height) };
        Arc::new(PropertySource::new(Geometry::new(spec).unwrap()))
    };
    let pictures = [0, 4 << 20].map(|whole_bytes| {
        let parts = vec![(Attribute::Color, source(4096, 2048)), (Attribute::Night, source(500, 250))];
        let settings = Settings { whole_bytes, ..settings(16, Filter::Trilinear) };
        let mut planet = Planet::new(gpu(), parts, SIZE, settings).unwrap();
        let pose = Path::Still.pose(Scene::Globe, 2.0, 0);
        assert!((0..500).any(|_| planet.frame(pose).unwrap().converged));
        assert_eq!(planet.textures().stats().pools.len(), 1 + usize::from(whole_bytes > 0));
        planet.picture()
    });
    let comparison = Comparison::of(&pictures[0], &pictures[1]);
    match is_processor() {
        true => assert!(comparison.share_within_1_255 > 0.9999, "{comparison:?}"),
        false => assert_alike(&comparison, "whole, and in pages"),
    }
}
