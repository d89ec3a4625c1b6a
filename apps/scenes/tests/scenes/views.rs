//! Two views in one picture equal the same views of an ordinary texture.

use crate::common::{Image, gpu, play, settings};
use crate::pictures::assert_alike;
use vastex::Filter;
use vastex_scenes::{Offscreen, Path, Scene, Views};

const SIZE: [u32; 2] = [320, 180];

#[test]
fn both_views_equal_those_of_an_ordinary_texture() {
    let (_directory, file) = Image::new(1000, 777, 128).build();
    for (scene, views) in
        Scene::SMOOTH.into_iter().flat_map(|scene| [Views::Stereo, Views::Mirror].map(|v| (scene, v)))
    {
        let what = format!("{scene:?} {views:?}");
        let source = vastex::open(&file).unwrap();
        let mut offscreen =
            Offscreen::new(gpu(), source, scene, SIZE, settings(16, Filter::Trilinear)).unwrap();
        offscreen.show(views).unwrap();
        play(&mut offscreen, Path::Zoom);
        assert_eq!(offscreen.share_at_wanted_level().unwrap(), 1.0, "{what}");
        assert_alike(&offscreen.compare().unwrap().0, &what);
        let picture = offscreen.picture();
        let halves = [0, SIZE[0] as usize / 2].map(|from| {
            let rows = picture.rgba.chunks_exact(SIZE[0] as usize * 4);
            rows.flat_map(|row| row[from * 4..(from + 160) * 4].to_vec()).collect::<Vec<u8>>()
        });
        assert_ne!(halves[0], halves[1], "{what}: they look from different places");
    }
}

#[test]
fn what_a_second_view_wants_is_not_there_without_it() {
    let (_directory, file) = Image::new(4000, 2000, 128).build();
    let source = vastex::open(&file).unwrap();
    let mut offscreen =
        Offscreen::new(gpu(), source, Scene::Image, SIZE, settings(16, Filter::Trilinear)).unwrap();
    let before = play(&mut offscreen, Path::Zoom).stats.pager.loaded;
    offscreen.show(Views::Mirror).unwrap();
    assert!(offscreen.share_at_wanted_level().unwrap() < 0.7, "the mirror shows another part of the image");
    let outcome = play(&mut offscreen, Path::Zoom);
    assert!(outcome.stats.pager.loaded > before);
    assert_eq!(offscreen.share_at_wanted_level().unwrap(), 1.0);
    offscreen.show(Views::One).unwrap();
    let wanted = offscreen.textures().stats().pager.wanted;
    assert!(wanted < outcome.stats.pager.wanted, "what only the second view wanted is let go of");
}
