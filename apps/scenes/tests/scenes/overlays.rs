//! The views of the machine: what they show is so.

use std::sync::Arc;

use vastex::{Filter, PageState, PoolSettings, Settings, TileSource};
use vastex_scenes::{Overlay, Path, Picture, Scene, Studio, Until};

use crate::common::{Image, gpu, settings};

const SIZE: [u32; 2] = [160, 90];

fn studio(source: Arc<dyn TileSource>, settings: Settings, frames: Option<u64>) -> Studio {
    let mut studio = Studio::new(gpu(), source, Scene::Plane, SIZE, settings).unwrap();
    let until = frames.map_or(Until::Converged, Until::Frames);
    studio.run(Path::Still, until, |_, _| ()).unwrap();
    studio
}

/// Pixels of a picture that are as `is` says of their red, green and blue.
fn count(picture: &Picture, is: impl Fn([u8; 3]) -> bool) -> usize {
    picture.rgba.chunks_exact(4).filter(|pixel| pixel[3] == 255 && is([pixel[0], pixel[1], pixel[2]])).count()
}

fn is_green([r, g, b]: [u8; 3]) -> bool {
    g > r && g > b
}

#[test]
fn a_view_that_has_converged_lacks_nothing_and_one_that_has_not_is_said_to() {
    let (_directory, file) = Image::new(2000, 1500, 64).build();
    let open = || vastex::open(&file).unwrap();
    let sharp = studio(open(), settings(16, Filter::Trilinear), None);
    let deficit = sharp.overlay(Overlay::Deficit).unwrap();
    let covered = count(&deficit, |_| true);
    assert!(covered > 1000, "the plane is in view");
    assert_eq!(count(&deficit, is_green), covered);
    // In its first frame nothing but the tail is there: no pixel that wants a page has it.
    let blurred = studio(open(), settings(16, Filter::Trilinear), Some(1));
    assert!(count(&blurred.overlay(Overlay::Deficit).unwrap(), is_green) < covered / 10);
    // Too small a pool lacks what its mip bias says.
    let pools = PoolSettings::of_bytes(12 * 72 * 72 * 4);
    let small = Settings { pools, ..settings(1, Filter::Trilinear) };
    let coarse = studio(open(), small, None);
    assert!(count(&coarse.overlay(Overlay::Deficit).unwrap(), is_green) < covered / 2);
}

/// Overlays that say the same of a scene in different ways agree, and none is empty.
#[test]
fn every_overlay_shows_something() {
    let (_directory, file) = Image::new(2000, 1500, 64).build();
    let studio = studio(vastex::open(&file).unwrap(), settings(16, Filter::Trilinear), None);
    let picture = studio.picture();
    let colours = |picture: &Picture| {
        let pixels = picture.rgba.chunks_exact(4).filter(|pixel| pixel[3] == 255);
        pixels.collect::<std::collections::BTreeSet<_>>().len()
    };
    for overlay in Overlay::ALL {
        let shown = studio.overlay(overlay).unwrap();
        assert_ne!(shown, picture, "{overlay:?}");
        assert!(colours(&shown) > 5, "{overlay:?} has {} colours", colours(&shown));
    }
    // Lines are few, and everything else is the picture.
    let pages = studio.overlay(Overlay::Pages).unwrap();
    let as_in_picture =
        pages.rgba.chunks_exact(4).zip(picture.rgba.chunks_exact(4)).filter(|(a, b)| a == b).count();
    let all = (SIZE[0] * SIZE[1]) as usize;
    assert!((all / 2..all).contains(&as_in_picture), "{as_in_picture} of {all}");
}

#[test]
fn a_pixel_is_explained_as_the_pager_has_it() {
    let (_directory, file) = Image::new(2000, 1500, 64).build();
    let open = || vastex::open(&file).unwrap();
    let ground = [SIZE[0] / 2, SIZE[1] - 5];
    let mut sharp = studio(open(), settings(16, Filter::Trilinear), None);
    let told = sharp.explain(ground).unwrap();
    let [told] = told.as_slice() else { panic!("one texture is there: {told:?}") };
    assert_eq!((told.wait, told.shown), (None, told.at_bias));
    assert!(matches!(sharp.textures().state(told.shown), PageState::Resident(_)));
    assert_eq!(told.history.len(), 3, "wanted, asked for, in its slot: {told}");
    let mut globe = Studio::new(gpu(), open(), Scene::Globe, SIZE, settings(16, Filter::Trilinear)).unwrap();
    globe.run(Path::Still, Until::Frames(1), |_, _| ()).unwrap();
    assert!(globe.explain([0, 0]).unwrap().is_empty(), "the sky");
    let mut blurred = studio(open(), settings(16, Filter::Trilinear), Some(3));
    let told = &blurred.explain(ground).unwrap()[0];
    assert!(told.wait.is_some() && told.shown.level() > told.at_bias.level(), "{told}");
}
