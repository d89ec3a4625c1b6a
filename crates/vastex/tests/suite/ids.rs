//! Which texture a pixel shows: ids that are others from pixel to pixel, ids that name nothing any more, and
//! numbers that are given again.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::common::texts::{checkered, telling};
use crate::common::{Mapping, PICTURE, Screen, property, settings};
use vastex::{
    AddressMode, Dims, Feedback, FeedbackMode, Filter, PagePos, Settings, TextureId, TextureNumber,
    TileSource, ViewId,
};

/// Of one kind, and of sizes that nothing divides, so that the same uv is of another level in each.
const SIZES: [[u32; 2]; 2] = [[1000, 777], [2900, 500]];
const TEXELS: f64 = 1.7;
const STRETCH: f64 = 1.3;

fn source(nth: usize) -> Arc<dyn TileSource> {
    property(SIZES[nth], 64, AddressMode::Wrap)
}

fn mapping() -> Mapping {
    Mapping::new(SIZES[0], [0.4, 0.6], TEXELS, STRETCH, 0.7)
}

fn of(mode: FeedbackMode, filter: Filter) -> Settings {
    Settings { feedback: Some(mode), filter, ..settings() }
}

/// What is seen of a view.
struct Seen {
    /// Once nothing is missing of what its feedback has found, which is all but corners of pages of a pixel
    /// or two.
    by_feedback: Vec<[u8; 4]>,
    /// Once nothing is missing of what every pixel wants.
    picture: Vec<[u8; 4]>,
    /// What every pixel wants.
    wanted: Feedback,
}

fn sharp(screen: &mut Screen) -> Seen {
    screen.textures.view_mut(ViewId::MAIN).unwrap().cut();
    screen.settle(|_| false, |_| {});
    let by_feedback = screen.picture();
    let wanted = screen.complete();
    Seen { by_feedback, picture: screen.picture(), wanted }
}

fn alone(nth: usize, settings: Settings) -> Seen {
    let mut screen =
        Screen::showing(settings, &telling(), |textures| textures.add_blocking(source(nth)).unwrap());
    screen.set_mapping(0, &mapping());
    sharp(&mut screen)
}

/// How many pixels want each page of a texture.
fn pixels(feedback: &Feedback, texture: TextureNumber) -> BTreeMap<PagePos, u32> {
    let pages = feedback.pages.iter().filter(|wanted| wanted.page.texture() == texture);
    pages.map(|wanted| (wanted.page.pos(Dims::D2), wanted.pixels)).collect()
}

/// Returns true if a pixel is one of those that show the first texture at first.
fn is_first(pixel: usize) -> bool {
    (pixel % PICTURE[0] as usize + pixel / PICTURE[0] as usize).is_multiple_of(2)
}

/// Of every block of four pixels two show one texture and two the other, each as if there were no other.
fn neighbours_show_other_textures(mode: FeedbackMode, filter: Filter) {
    let (first, second) = (alone(0, of(mode, filter)), alone(1, of(mode, filter)));
    let mut added = Vec::new();
    let mut screen = Screen::showing(of(mode, filter), &checkered(), |textures| {
        added = vec![source(0), source(1)]
            .into_iter()
            .map(|source| textures.add_blocking(source).unwrap())
            .collect();
        assert_eq!(textures.kinds(added[0]).unwrap(), textures.kinds(added[1]).unwrap());
        assert_eq!(textures.bind_group(added[0]).unwrap(), textures.bind_group(added[1]).unwrap());
        added[0]
    });
    let ids = [added[0], added[1]].map(|texture| screen.textures.shader_id(texture).unwrap());
    screen.set_mapping(0, &mapping());
    screen.set_id(0, 1, ids[1]);
    let seen = sharp(&mut screen);
    let expected = |n: usize| if is_first(n) { first.picture[n] } else { second.picture[n] };
    // Tiles lie in other slots, which a filter's weights are rounded by.
    let allowed = if filter == Filter::Nearest { 0 } else { 1 };
    let is_off = |pixel: [u8; 4], n: usize| (0..4).any(|c| pixel[c].abs_diff(expected(n)[c]) > allowed);
    let wrong = |picture: &[[u8; 4]]| (0..picture.len()).filter(|&n| is_off(picture[n], n)).count();
    assert!(wrong(&seen.by_feedback) < 20, "{mode:?}, {filter}: {} by feedback", wrong(&seen.by_feedback));
    assert_eq!(wrong(&seen.picture), 0, "{mode:?}, {filter}: of {} pixels", seen.picture.len());

    // With both exchanged, what the two pictures want together is what each texture wants that has all of it.
    (0..).zip([ids[1], ids[0]]).for_each(|(place, id)| screen.set_id(0, place, id));
    let exchanged = sharp(&mut screen);
    for (texture, alone) in added.iter().zip([first.wanted, second.wanted]) {
        let mut together = pixels(&seen.wanted, texture.number());
        for (page, pixels) in pixels(&exchanged.wanted, texture.number()) {
            *together.entry(page).or_default() += pixels;
        }
        let expected = pixels(&alone, alone.pages[0].page.texture());
        assert_eq!(together, expected, "{mode:?}, {filter}, {texture:?}");
    }
    if (mode, filter) == (FeedbackMode::Separate, Filter::Trilinear) {
        is_as_the_cpu_says(&screen, [added[1], added[0]]);
    }
}

/// A pixel is what the CPU says is there, whatever shows beside it.
fn is_as_the_cpu_says(screen: &Screen, shown: [TextureId; 2]) {
    let (picture, mapping) = (screen.picture(), mapping());
    let mut samplers = shown.map(|texture| screen.textures.cpu().sampler(texture).unwrap());
    let mut far = 0;
    for (n, pixel) in picture.iter().enumerate() {
        let nth = usize::from(!is_first(n));
        let size = screen.textures.texture(shown[nth]).unwrap().description().geometry.size();
        let [x, y] = [n % PICTURE[0] as usize, n / PICTURE[0] as usize].map(|at| at as f32 + 0.5);
        let uv = [0, 1].map(|a| mapping.origin[a] + mapping.along_x[a] * x + mapping.along_y[a] * y);
        let texels = |uv: [f32; 2]| (uv[0] * size[0] as f32).hypot(uv[1] * size[1] as f32);
        let level = texels(mapping.along_x).max(texels(mapping.along_y)).log2();
        let expected = samplers[nth].sample(uv, level).value.map(|part| part * 255.0);
        let is_close = (0..4).all(|c| (f32::from(pixel[c]) - expected[c]).abs() < 2.5);
        far += usize::from(!is_close);
    }
    assert_eq!(far, 0, "of {} pixels", picture.len());
}

#[test]
fn ids_may_differ_from_pixel_to_pixel_in_every_mode_of_feedback() {
    for mode in FeedbackMode::ALL {
        neighbours_show_other_textures(mode, Filter::Trilinear);
    }
}

#[test]
fn ids_may_differ_from_pixel_to_pixel_with_every_filter() {
    for filter in Filter::KINDS.into_iter().filter(|filter| *filter != Filter::Trilinear) {
        neighbours_show_other_textures(FeedbackMode::Separate, filter);
    }
}

/// What an id shows that names nothing, in 255ths.
const UNKNOWN: [u8; 4] = [51, 102, 153, 204];

fn with_unknown(mode: FeedbackMode) -> Settings {
    let unknown_color = UNKNOWN.map(|part| f32::from(part) / 255.0);
    Settings { unknown_color, ..of(mode, Filter::Nearest) }
}

/// Frames go on with an id that names nothing: each shows the colour, and nothing is asked for.
fn names_nothing(screen: &mut Screen, id: u32) {
    screen.set_id(0, 0, id);
    screen.textures.view_mut(ViewId::MAIN).unwrap().cut();
    let loaded = screen.textures.stats().pager.loaded;
    screen.settle(
        |_| false,
        |screen| {
            assert!(screen.picture().iter().all(|pixel| *pixel == UNKNOWN), "{id:#x}");
        },
    );
    let asked = screen.feedback_of_every_pixel();
    assert!(asked.pages.is_empty(), "{id:#x}: {asked:?}");
    let stats = screen.textures.stats();
    assert_eq!((stats.pager.loaded, stats.pager.missing), (loaded, 0), "{id:#x}");
}

#[test]
fn an_id_that_names_nothing_shows_a_colour_that_is_set_and_asks_for_nothing() {
    for mode in FeedbackMode::ALL {
        let expected = alone(0, of(mode, Filter::Nearest)).picture;
        let mut screen = Screen::showing(with_unknown(mode), &telling(), |textures| {
            textures.add_blocking(source(0)).unwrap()
        });
        screen.set_mapping(0, &mapping());
        let gone = screen.textures.add_blocking(source(1)).unwrap();
        let [known, stale] =
            [screen.texture(0), gone].map(|texture| screen.textures.shader_id(texture).unwrap());
        screen.set_id(0, 0, stale);
        let before = sharp(&mut screen).picture;
        assert!(before.iter().all(|pixel| *pixel != UNKNOWN), "{mode:?}: it is there");
        assert!(screen.textures.remove(gone));
        // Its own, that of nobody, those of numbers that nobody has had, and of generations to come and long
        // past.
        for id in [stale, 0, u32::MAX, 2047, known ^ (1 << 11), known ^ (1 << 31)] {
            names_nothing(&mut screen, id);
        }
        screen.set_id(0, 0, known);
        assert!(sharp(&mut screen).picture == expected, "{mode:?}");
        number_given_again(&mut screen, gone, stale, &before);
    }
}

/// The next texture has the number of the one that is gone, and another id.
fn number_given_again(screen: &mut Screen, gone: TextureId, stale: u32, shown: &[[u8; 4]]) {
    let again = screen.textures.add_blocking(source(1)).unwrap();
    assert_eq!(again.number(), gone.number());
    let id = screen.textures.shader_id(again).unwrap();
    assert_ne!(id, stale);
    names_nothing(screen, stale);
    screen.set_id(0, 0, id);
    assert!(sharp(screen).picture == shown);
}

/// The pixels of a column of the picture, which has two.
fn column(picture: &[[u8; 4]], nth: usize) -> Vec<[u8; 4]> {
    let half = PICTURE[0] as usize / 2;
    picture.chunks(2 * half).flat_map(|row| row[nth * half..][..half].to_vec()).collect()
}

/// A texture is removed and another added, beside the first in its pool or in a pool of their own, while a
/// frame is recorded and not submitted.
fn replaced_under_a_recorded_frame(mode: FeedbackMode, page: u32) {
    let replaced = || property(SIZES[1], page, AddressMode::Wrap);
    let mut screen = Screen::showing_all(with_unknown(mode), &telling(), |textures| {
        [source(0), replaced()].map(|source| textures.add_blocking(source).unwrap()).to_vec()
    });
    (0..2).for_each(|nth| screen.set_mapping(nth, &mapping()));
    let before = sharp(&mut screen).picture;
    assert!(before.iter().all(|pixel| *pixel != UNKNOWN), "{mode:?}");

    let wanted = screen.record_wanted(PICTURE);
    let mut recorded = screen.record_picture(PICTURE);
    let copy = screen.copy_picture(&mut recorded);
    let gone = screen.texture(1);
    assert!(screen.textures.remove(gone));
    let again = screen.textures.add_blocking(replaced()).unwrap();
    screen.textures.update().unwrap();
    let faults = screen.gpu.device.push_error_scope(wgpu::ErrorFilter::Validation);
    screen.gpu.queue.submit([wanted.finish(), recorded.finish()]);
    let fault = pollster::block_on(faults.pop());
    assert!(fault.is_none(), "{mode:?}: {fault:?}");
    let shown = screen.read_copy(&copy);
    assert!(column(&shown, 0) == column(&before, 0), "{mode:?}: beside what is gone all is right");
    assert!(column(&shown, 1).iter().all(|pixel| *pixel == UNKNOWN), "{mode:?}: the next one is not shown");

    // From here on the application knows.
    screen.replace_with(1, |_| again.into());
    assert!(sharp(&mut screen).picture == before, "{mode:?}: later pictures are exact");
}

#[test]
fn what_was_recorded_before_a_texture_was_replaced_shows_neither_of_them() {
    for mode in FeedbackMode::ALL {
        for page in [64, 32] {
            replaced_under_a_recorded_frame(mode, page);
        }
    }
}
