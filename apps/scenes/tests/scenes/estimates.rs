//! Estimates beside feedback: nothing that a pixel wants is missing, whatever feeds the pager.

use std::collections::BTreeSet;
use std::sync::Arc;

use vastex::survey::{SurveySettings, SurveyedTexture};
use vastex::{Filter, Geometry, PagePos, TextureNumber, TileSource};
use vastex_core::GeometrySpec;
use vastex_scenes::{Estimate, Estimating, Offscreen, Path, Scene, trace_of_every};
use vastex_tiles::PropertySource;

use crate::common::{gpu, settings};

const PICTURE: [u32; 2] = [1280, 720];
/// Of so many frames of a path one is looked at.
const EVERY: usize = 16;

/// Pages of a feedback with their ancestors.
fn set_of(geometry: &Geometry, feedback: &[vastex_core::WantedPage]) -> BTreeSet<PagePos> {
    let pages = feedback.iter().map(|wanted| wanted.page.pos(geometry.dims()));
    pages.flat_map(|page| std::iter::successors(Some(page), |&page| geometry.parent(page))).collect()
}

/// Pages that feedback wants are in the estimate, but for a hundredth of the pixels, and of these the parents
/// are but for a thousandth: gradients of feedback are taken over 8 pixels, and at the edge of a globe there
/// is nothing to take them to. Prints by how much the estimate is larger.
#[test]
fn on_the_five_paths_what_feedback_finds_is_estimated() {
    let geometry = Geometry::new(GeometrySpec::image(32768, 16384)).unwrap();
    let texture = SurveyedTexture::new(TextureNumber::new(0).unwrap(), &geometry);
    for (scene, path) in Scene::SMOOTH.into_iter().flat_map(|scene| Path::ALL.map(|path| (scene, path))) {
        let trace = trace_of_every(EVERY, scene, path, &geometry, PICTURE);
        let mut line = format!("{}/{}", scene.name(), path.name());
        for estimate in [Estimate::Quadtree, Estimate::Distance] {
            let (mut wanted, mut found) = (0, 0);
            let [mut all, mut coarser, mut missing] = [0; 3];
            for (pages, frame) in trace.frames().iter().zip((0..path.frames()).step_by(EVERY)) {
                let pose = path.pose(scene, 2.0, frame);
                let settings = SurveySettings::default();
                let surveyed = estimate.of_view(scene, &pose, texture, PICTURE, settings, frame).unwrap();
                let in_estimate = set_of(&geometry, &surveyed.seen.pages);
                for page in pages {
                    let pos = page.page.pos(geometry.dims());
                    let is_there = |pos| in_estimate.contains(&pos);
                    let parent_is_there = geometry.parent(pos).is_none_or(is_there);
                    all += page.pixels;
                    coarser += if is_there(pos) { 0 } else { page.pixels };
                    missing += if is_there(pos) || parent_is_there { 0 } else { page.pixels };
                }
                wanted += set_of(&geometry, pages).len();
                found += in_estimate.len();
            }
            let ratio = found as f64 / wanted as f64;
            line += &format!(", {} {ratio:.2} ({coarser}, {missing} of {all})", estimate.name());
            assert!(coarser * 100 <= all && missing * 1000 <= all, "{line}");
        }
        println!("{line} times the pages");
    }
}

/// A texture of 16384x8192 texels that takes no space.
fn huge() -> Arc<dyn TileSource> {
    Arc::new(PropertySource::new(Geometry::new(GeometrySpec::image(16384, 8192)).unwrap()))
}

/// A converged view of a path's middle, fed by feedback or by an estimate; the share of its pixels that show
/// at least the level that they want, the pages wanted, and the feedback read back.
fn fed_by(scene: Scene, path: Path, estimating: Option<Estimating>) -> (f64, u32, u64) {
    let mut offscreen =
        Offscreen::new(gpu(), huge(), scene, [640, 360], settings(256, Filter::Trilinear)).unwrap();
    estimating.into_iter().for_each(|estimating| offscreen.estimate(estimating));
    let pose = path.pose(scene, 2.0, path.frames() / 2);
    for frame in 0.. {
        offscreen.frame(pose).unwrap();
        if frame > 40 && offscreen.textures().inspect().is_converged() {
            break;
        }
        assert!(frame < 1000, "{scene:?} {path:?} {estimating:?}: {:?}", offscreen.textures().stats());
    }
    let stats = offscreen.textures().stats();
    assert_eq!(stats.pager.bias_eighths, 0);
    (offscreen.share_at_wanted_level().unwrap(), stats.pager.wanted, stats.feedback_bytes_read)
}

/// Every path, every scene with at least one of them.
#[test]
fn without_any_feedback_pass_a_view_becomes_as_sharp_as_with_it() {
    for (scene, path) in Scene::SMOOTH.into_iter().cycle().zip(Path::ALL) {
        let (share, wanted, read) = fed_by(scene, path, None);
        assert!(read > 0 && share > 0.99, "{scene:?} {path:?}: {share}");
        let mut line = format!("{}/{}: feedback {wanted} pages, {share:.5}", scene.name(), path.name());
        for estimate in Estimate::ALL {
            let settings = SurveySettings::default();
            let by_estimate = fed_by(scene, path, Some(Estimating { estimate, beside: false, settings }));
            let (estimated_share, estimated, read) = by_estimate;
            line += &format!("; {} {estimated} pages, {estimated_share:.5}", estimate.name());
            assert_eq!(read, 0, "there is no feedback pass");
            assert!(estimated_share >= share.min(0.9999), "{line}");
        }
        println!("{line}");
    }
}
