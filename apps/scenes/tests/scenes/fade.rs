//! Tiles that fade in, in scenes: a run ends when everything is there, and with the picture that it ends with
//! without fading.

use std::sync::Arc;
use std::time::Duration;

use crate::common::{gpu, settings};
use vastex::{FeedbackMode, Filter, Geometry, GeometrySpec, Settings, TileSource};
use vastex_scenes::{Offscreen, Outcome, Path, Picture, Scene, Until};
use vastex_tiles::PropertySource;

/// Longer than a view takes to converge: 60 frames.
const FADE: Duration = Duration::from_secs(1);

fn image() -> Arc<dyn TileSource> {
    Arc::new(PropertySource::new(Geometry::new(GeometrySpec::image(4096, 2048)).unwrap()))
}

/// A run of a still view, and the most tiles that faded in at once.
fn run(scene: Scene, filter: Filter, feedback: FeedbackMode, fade: Duration) -> (Picture, Outcome, usize) {
    let settings = Settings { fade, feedback: Some(feedback), ..settings(16, filter) };
    let mut offscreen = Offscreen::new(gpu(), image(), scene, [160, 90], settings).unwrap();
    let mut most = 0;
    let note = |textures: &vastex::Textures, _| most = most.max(textures.stats().fading);
    let outcome = offscreen.run(Path::Still, Until::Converged, note).unwrap();
    (offscreen.picture(), outcome, most)
}

#[test]
fn a_run_ends_when_nothing_fades_any_more_with_the_picture_without_fading() {
    for (scene, filter, feedback) in [
        (Scene::Plane, Filter::Trilinear, FeedbackMode::Separate),
        (Scene::Globe, Filter::Bicubic, FeedbackMode::Inline),
        (Scene::Image, Filter::Bilinear, FeedbackMode::Raw),
    ] {
        let (at_once, first, none) = run(scene, filter, feedback, Duration::ZERO);
        let (picture, outcome, most) = run(scene, filter, feedback, FADE);
        assert!(none == 0 && most > 1, "{scene:?}: {most}");
        assert!(first.converged && outcome.converged && outcome.stats.fading == 0, "{scene:?}");
        assert!(
            outcome.stats.frame >= 60 && outcome.stats.frame > first.stats.frame,
            "{scene:?}: {outcome:?}"
        );
        assert!(picture == at_once, "{scene:?}: another picture");
        assert_eq!(
            outcome.stats.pager.requests, first.stats.pager.requests,
            "{scene:?}: what is wanted is the same"
        );
    }
}
