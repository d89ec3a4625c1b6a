//! The views of the machine: what they show is so.

use std::sync::Arc;

use vastex::diagnostics::PageState;
use vastex::{Filter, PoolSettings, Settings, TileSource};
use vastex_scenes::{DisplayOptions, Offscreen, Overlay, Path, Picture, Scene, SceneImage, Until};
use vastex_viewer::layers::{CompareMode, Placement};

use crate::common::{Image, gpu, settings};

const SIZE: [u32; 2] = [160, 90];

fn offscreen(source: Arc<dyn TileSource>, settings: Settings, frames: Option<u64>) -> Offscreen {
    let mut offscreen = Offscreen::new(gpu(), source, Scene::Plane, SIZE, settings).unwrap();
    let until = frames.map_or(Until::Converged, Until::Frames);
    offscreen.run(Path::Still, until, |_, _| ()).unwrap();
    offscreen
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
    let mut sharp = offscreen(open(), settings(16, Filter::Trilinear), None);
    let deficit = sharp.overlay(Overlay::Deficit).unwrap();
    let covered = count(&deficit, |_| true);
    assert!(covered > 1000, "the plane is in view");
    assert!(count(&deficit, is_green) > covered - covered / 1000, "feedback has found nearly all");
    sharp.load_for_every_pixel().unwrap();
    let deficit = sharp.overlay(Overlay::Deficit).unwrap();
    assert_eq!(count(&deficit, is_green), covered);
    // In its first frame nothing but the tail is there: no pixel that wants a page has it.
    let blurred = offscreen(open(), settings(16, Filter::Trilinear), Some(1));
    assert!(count(&blurred.overlay(Overlay::Deficit).unwrap(), is_green) < covered / 10);
    // Too small a pool lacks what its mip bias says.
    let pools = PoolSettings::of_bytes(12 * 72 * 72 * 4);
    let small = Settings { pools, ..settings(1, Filter::Trilinear) };
    let coarse = offscreen(open(), small, None);
    assert!(count(&coarse.overlay(Overlay::Deficit).unwrap(), is_green) < covered / 2);
}

/// Light of a pixel, scaled so that the brightest channel is 1: its hue.
fn hue(pixel: &[u8]) -> [f64; 3] {
    let light = |encoded: u8| {
        let n = f64::from(encoded) / 255.0;
        if n <= 0.04045 { n / 12.92 } else { ((n + 0.055) / 1.055).powf(2.4) }
    };
    scaled([light(pixel[0]), light(pixel[1]), light(pixel[2])])
}

fn scaled(light: [f64; 3]) -> [f64; 3] {
    let most = light.into_iter().fold(1e-9, f64::max);
    light.map(|n| n / most)
}

fn are_alike(a: [f64; 3], b: [f64; 3]) -> bool {
    (0..3).all(|c| (a[c] - b[c]).abs() < 0.04)
}

/// The hue that docs/overlays.md gives a level, or one between two levels.
fn of_level(level: f64) -> [f64; 3] {
    const COLORS: [[f64; 3]; 8] = [
        [0.90, 0.16, 0.22],
        [0.96, 0.52, 0.12],
        [0.95, 0.85, 0.20],
        [0.35, 0.75, 0.25],
        [0.20, 0.78, 0.78],
        [0.22, 0.45, 0.90],
        [0.55, 0.30, 0.85],
        [0.90, 0.40, 0.75],
    ];
    let (below, part) = (level.floor() as usize % 8, level.fract());
    scaled(std::array::from_fn(|c| COLORS[below][c] * (1.0 - part) + COLORS[(below + 1) % 8][c] * part))
}

/// The level of a picture's hue, of those that there are here.
fn level_of(pixel: &[u8]) -> Option<u8> {
    (0..8).find(|&level| are_alike(hue(pixel), of_level(f64::from(level))))
}

/// Overlays of levels say of each place what the pager says of it, while a view loads and when it has.
#[test]
fn overlays_of_levels_say_what_is_shown_and_wanted() {
    let (_directory, file) = Image::new(2000, 1500, 64).build();
    let (mut met, mut short) = (std::collections::BTreeSet::new(), 0);
    for frames in [Some(3), None] {
        let mut offscreen = offscreen(vastex::open(&file).unwrap(), settings(16, Filter::Trilinear), frames);
        let [levels, wanted] =
            [Overlay::Levels, Overlay::Wanted].map(|overlay| offscreen.overlay(overlay).unwrap());
        for (y, x) in (30..SIZE[1]).step_by(11).flat_map(|y| (3..SIZE[0]).step_by(29).map(move |x| (y, x))) {
            let told = offscreen.explain([x, y]).unwrap();
            let Some(told) = told.first() else { continue };
            let at = ((y * SIZE[0] + x) * 4) as usize;
            assert_eq!(level_of(&levels.rgba[at..]), Some(told.shown.level()), "{x},{y}: {told}");
            met.insert(told.shown.level());
            short += u32::from(told.shown.level() > told.at_bias.level());
            // Explanations know eighths of levels.
            let level = f64::from(told.wanted.page.level()) + f64::from(told.wanted.eighth) / 8.0;
            let near = (-4..=12).map(|n| (level + f64::from(n) / 32.0).max(0.0));
            let is_wanted = near.map(of_level).any(|expected| are_alike(hue(&wanted.rgba[at..]), expected));
            assert!(is_wanted, "{x},{y}: {:?} is not level {level}: {told}", &wanted.rgba[at..at + 3]);
        }
    }
    assert!(met.len() > 2 && short > 10, "levels {met:?}, {short} places that lack some");
}

/// Where images lie upon one another texel by texel, each place has the levels of the image that is seen.
#[test]
fn images_that_lie_by_texel_have_their_own_levels_in_overlays() {
    let (_first, large) = Image::new(1000, 750, 64).build();
    let (_second, small) = Image::new(400, 300, 64).build();
    let open = |file| SceneImage::from(vastex::open(file).unwrap());
    // Of the smaller one there is a coarser level alone, so that one level finer of it is seen.
    let over = [SceneImage { size: [800, 600], ..open(&small) }];
    let options = DisplayOptions { placement: Placement::ByTexel, ..DisplayOptions::default() };
    let settings = settings(16, Filter::Nearest);
    let mut drawn =
        Offscreen::showing_together(&options, gpu(), (open(&large), &over), Scene::Image, SIZE, settings)
            .unwrap();
    drawn.run(Path::Still, Until::Converged, |_, _| ()).unwrap();
    let levels = drawn.overlay(Overlay::Levels).unwrap();
    // All of the larger one is as high as the picture.
    let scale = f64::from(SIZE[1]) / 750.0;
    let left = (f64::from(SIZE[0]) - 1000.0 * scale) / 2.0;
    let mut found = [const { std::collections::BTreeSet::new() }; 2];
    for (x, y) in (0..SIZE[1]).step_by(7).flat_map(|y| (24..136).step_by(5).map(move |x| (x, y))) {
        let [column, row] = [(f64::from(x) + 0.5 - left) / scale, (f64::from(y) + 0.5) / scale];
        if (column - 800.0).abs() < 20.0 || (row - 600.0).abs() < 20.0 {
            continue; // at an edge
        }
        let level = level_of(&levels.rgba[((y * SIZE[0] + x) * 4) as usize..]);
        found[usize::from(column < 800.0 && row < 600.0)].insert(level);
    }
    assert_eq!(found, [[Some(3)].into(), [Some(2)].into()], "beside the smaller one, and of it");
}

/// Of layers side by side each pane has the overlay of its own layer, as it would be alone in that pane.
#[test]
fn panes_have_overlays_of_their_own() {
    const PANE: [u32; 2] = [SIZE[0] / 2, SIZE[1]];
    let settings = || settings(16, Filter::Trilinear);
    let (_first, large) = Image::new(2000, 1500, 64).build();
    let (_second, small) = Image::new(500, 375, 64).build();
    let open = |file| vastex::open(file).unwrap();
    let options = DisplayOptions { compare_mode: CompareMode::Beside, ..DisplayOptions::default() };
    let over = [open(&small).into()];
    let images = (open(&large).into(), &over[..]);
    let mut beside =
        Offscreen::showing_together(&options, gpu(), images, Scene::Image, SIZE, settings()).unwrap();
    beside.run(Path::Still, Until::Converged, |_, _| ()).unwrap();
    let pixels = |picture: &Picture, left: u32| -> Vec<[u8; 3]> {
        let rows = picture.rgba.chunks_exact(4 * picture.size[0] as usize);
        let row = |row: &[u8]| row[4 * left as usize..][..4 * PANE[0] as usize].to_vec();
        rows.flat_map(row).collect::<Vec<u8>>().chunks_exact(4).map(|p| [p[0], p[1], p[2]]).collect()
    };
    let is_drawn = |pixel: &[u8; 3]| pixel.iter().any(|channel| *channel > 40);
    for (pane, file) in [&large, &small].into_iter().enumerate() {
        let mut alone = Offscreen::new(gpu(), open(file), Scene::Image, PANE, settings()).unwrap();
        alone.run(Path::Still, Until::Converged, |_, _| ()).unwrap();
        for overlay in [Overlay::Levels, Overlay::Table] {
            let found = pixels(&beside.overlay(overlay).unwrap(), pane as u32 * PANE[0]);
            let expected = pixels(&alone.overlay(overlay).unwrap(), 0);
            let drawn = expected.iter().filter(|pixel| is_drawn(pixel)).count();
            assert!(drawn > 1000, "{overlay:?} of pane {pane}: {drawn}");
            let is_same = |(a, b): &(&[u8; 3], &[u8; 3])| {
                is_drawn(a) == is_drawn(b) && (!is_drawn(a) || level_of(*a) == level_of(*b))
            };
            let same = found.iter().zip(&expected).filter(is_same).count();
            assert!(same * 100 > found.len() * 97, "{overlay:?} of pane {pane}: {same} of {}", found.len());
        }
        // What feedback sees is one view for all of them, and lies where the picture does.
        let feedback = pixels(&beside.overlay(Overlay::Feedback).unwrap(), pane as u32 * PANE[0]);
        let picture = pixels(&alone.overlay(Overlay::Levels).unwrap(), 0);
        let both = feedback.iter().zip(&picture).filter(|(a, b)| is_drawn(a) == is_drawn(b)).count();
        assert!(both * 100 > picture.len() * 85, "{both} of {}", picture.len());
    }
}

/// What plans and lines have to show, and nothing but that.
#[test]
fn plans_show_the_machine_in_the_colours_that_are_documented() {
    let (_directory, file) = Image::new(2000, 1500, 64).build();
    let offscreen = offscreen(vastex::open(&file).unwrap(), settings(16, Filter::Trilinear), None);
    let [picture, levels, pages, feedback, table, atlas] = [
        offscreen.picture(),
        offscreen.overlay(Overlay::Levels).unwrap(),
        offscreen.overlay(Overlay::Pages).unwrap(),
        offscreen.overlay(Overlay::Feedback).unwrap(),
        offscreen.overlay(Overlay::Table).unwrap(),
        offscreen.overlay(Overlay::Atlas).unwrap(),
    ];
    let pixels = |picture: &Picture| -> Vec<[u8; 3]> {
        picture.rgba.chunks_exact(4).map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect()
    };
    let all = (SIZE[0] * SIZE[1]) as usize;
    // Lines are few and in the hue of a level, and everything else is the picture.
    let lines: Vec<[u8; 3]> = pixels(&pages)
        .into_iter()
        .zip(pixels(&picture))
        .filter_map(|(line, below)| (line != below).then_some(line))
        .collect();
    assert!((100..all / 2).contains(&lines.len()), "{} of {all}", lines.len());
    assert!(lines.iter().all(|line| level_of(line).is_some()));
    // A block of 8 pixels a side for each pixel of the target, and colours for pages.
    let feedback = pixels(&feedback);
    let block = |n: usize| {
        let (x, y) = (n % SIZE[0] as usize / 8 * 8, n / SIZE[0] as usize / 8 * 8);
        feedback[y * SIZE[0] as usize + x]
    };
    assert!((0..all).all(|n| feedback[n] == block(n)), "blocks are of one colour");
    let paper = *pixels(&table).last().unwrap(); // below the level 0 of a table is nothing
    let hues = |of: &[[u8; 3]]| -> usize {
        let hues: std::collections::BTreeSet<_> = of
            .iter()
            .filter(|pixel| **pixel != paper)
            .map(|pixel| hue(pixel).map(|n| (n * 8.0) as u8))
            .collect();
        hues.len()
    };
    assert!(hues(&feedback) > 8, "{} pages", hues(&feedback));
    // Bright where a page is resident, dim where a coarser one stands for it; nothing else but paper.
    let on_table = pixels(&table).into_iter().filter(|pixel| *pixel != paper).collect::<Vec<_>>();
    assert!(on_table.len() > all / 3 && on_table.iter().all(|pixel| level_of(pixel).is_some()));
    // What the ground shows is resident, so it has its own entries and slots.
    let ground = &pixels(&levels)[all / 2..];
    let shown: std::collections::BTreeSet<u8> = ground.iter().filter_map(|pixel| level_of(pixel)).collect();
    assert!(shown.len() > 1, "{shown:?}");
    let has = |of: &[[u8; 3]], level: &u8| of.iter().any(|pixel| level_of(pixel) == Some(*level));
    assert!(shown.iter().all(|level| has(&on_table, level)), "{shown:?} in the table");
    // The tail is locked, so there is white; there are frames in the hues of levels, and slots that are free.
    let atlas = pixels(&atlas);
    assert!(atlas.contains(&[255; 3]));
    assert!(shown.iter().all(|level| has(&atlas, level)), "{shown:?} in the pool");
    let is_dark = |pixel: &[u8; 3]| pixel[0] < pixel[2] && pixel[2] < 90 && *pixel != paper;
    assert!(atlas.iter().filter(|pixel| is_dark(pixel)).count() > 100, "16 MiB are more than the view needs");
}

#[test]
fn a_pixel_is_explained_as_the_pager_has_it() {
    let (_directory, file) = Image::new(2000, 1500, 64).build();
    let open = || vastex::open(&file).unwrap();
    let ground = [SIZE[0] / 2, SIZE[1] - 5];
    let mut sharp = offscreen(open(), settings(16, Filter::Trilinear), None);
    let told = sharp.explain(ground).unwrap();
    let [told] = told.as_slice() else { panic!("one texture is there: {told:?}") };
    assert_eq!((told.wait, told.shown), (None, told.at_bias));
    assert!(matches!(sharp.textures().inspect().state(told.shown), PageState::Resident(_)));
    assert_eq!(told.history.len(), 3, "wanted, asked for, in its slot: {told}");
    let mut globe =
        Offscreen::new(gpu(), open(), Scene::Globe, SIZE, settings(16, Filter::Trilinear)).unwrap();
    globe.run(Path::Still, Until::Frames(1), |_, _| ()).unwrap();
    assert!(globe.explain([0, 0]).unwrap().is_empty(), "the sky");
    let mut blurred = offscreen(open(), settings(16, Filter::Trilinear), Some(3));
    let told = &blurred.explain(ground).unwrap()[0];
    assert!(told.wait.is_some() && told.shown.level() > told.at_bias.level(), "{told}");
}
