//! What is compiled for a scene, and that a scene like one before it is drawn without compiling anything.

use glam::DVec2;
use vastex::Filter;
use vastex_scenes::{Gpu, Offscreen, Pose, Scene, headless_gpu};
use vastex_viewer::SceneRenderer;

use crate::common::{Image, settings, settle};

const POSE: Pose = Pose::image(DVec2::new(0.4, 0.6), 1.7);

/// Draws an image, compares it with an ordinary texture, and tells what was compiled for that.
fn compiled_for(gpu: &Gpu, image: Image, filter: Filter) -> u32 {
    let (_directory, file) = image.build();
    let before = SceneRenderer::pipelines_compiled(gpu);
    let source = vastex::open(file).unwrap();
    let mut offscreen = Offscreen::new(gpu, source, Scene::Image, [120, 80], settings(16, filter)).unwrap();
    settle(&mut offscreen, POSE);
    let compared = offscreen.compare().unwrap().0;
    assert!(compared.max_error <= 3, "{image:?}: {compared:?}");
    SceneRenderer::pipelines_compiled(gpu) - before
}

#[test]
fn a_scene_like_one_before_it_compiles_nothing() {
    let (first, second) = (Image::new(500, 300, 128), Image::new(300, 800, 128));
    let gpu = headless_gpu().unwrap();
    let at_first = compiled_for(&gpu, first, Filter::Trilinear);
    assert!((2..6).contains(&at_first), "{at_first}");
    assert_eq!(compiled_for(&gpu, second, Filter::Trilinear), 0);
    assert!(compiled_for(&gpu, second, Filter::Bicubic) > 0, "another text");
    assert_eq!(compiled_for(&gpu, first, Filter::Bicubic), 0);
    assert_eq!(compiled_for(&gpu, first, Filter::Trilinear), 0, "both are kept");
    // A device of its own has nothing of the other's.
    assert_eq!(compiled_for(&headless_gpu().unwrap(), first, Filter::Trilinear), at_first);
}
