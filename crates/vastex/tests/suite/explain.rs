//! Why a pixel shows what it shows: asked without waiting, and as a view of the whole picture has it.

use std::collections::BTreeSet;

use crate::common::{Mapping, PICTURE, Screen, property, settings};
use vastex::{AddressMode, Error, GpuError, PageId};

const SIZE: [u32; 2] = [3000, 2000];

fn screen() -> Screen {
    let mut screen = Screen::new(&[property(SIZE, 64, AddressMode::Clamp)], settings());
    screen.set_mapping(0, &Mapping::new(SIZE, [0.4, 0.6], 1.7, 1.3, 0.7));
    screen
}

#[test]
fn a_pixel_wants_what_it_wants_in_a_view_of_the_whole_picture() {
    let mut screen = screen();
    screen.converge();
    let wanted: BTreeSet<PageId> =
        screen.feedback_of_every_pixel().pages.iter().map(|wanted| wanted.page).collect();
    let mut explained = BTreeSet::new();
    // Even and odd ones, and those at the edges.
    for pixel in (0..9).flat_map(|x| (0..7).map(move |y| [x * 20 - x / 8, y * 20 - y / 6])) {
        screen.explain(pixel).unwrap();
        let told = screen.textures.pixels().wait().unwrap().unwrap();
        assert_eq!(told.pixel, pixel);
        let [told] = told.explanations.as_slice() else { panic!("{pixel:?}: {told:?}") };
        assert!(wanted.contains(&told.wanted.page), "{pixel:?}: {told}");
        assert_eq!((told.wait, told.shown), (None, told.at_bias), "{pixel:?}: {told}");
        explained.insert(told.wanted.page);
    }
    assert!(explained.len() > 5, "of {} pages, {} were met", wanted.len(), explained.len());
}

#[test]
fn an_answer_comes_when_it_comes_and_in_the_order_of_the_questions() {
    let mut screen = screen();
    assert_eq!(screen.textures.pixels().poll().unwrap(), None);
    assert_eq!(screen.textures.pixels().wait().unwrap(), None);
    let pixels = [[3, 4], [PICTURE[0], 0], [100, 90]];
    for pixel in pixels {
        screen.explain(pixel).unwrap();
    }
    assert_eq!(screen.textures.pixels().asked(), 3);
    let mut answers = Vec::new();
    // Frames go on meanwhile; each of them lets the device say what it has done.
    for _ in 0..1000 {
        screen.frame().unwrap();
        while let Some(answer) = screen.textures.pixels().poll().unwrap() {
            answers.push(answer);
        }
        if answers.len() == pixels.len() {
            break;
        }
    }
    assert!(answers.iter().map(|answer| answer.pixel).eq(pixels));
    assert!(answers[1].explanations.is_empty(), "beyond the picture");
    assert_eq!((answers[0].explanations.len(), answers[2].explanations.len()), (1, 1));
    // Of too many the oldest are forgotten.
    for x in 0..40 {
        screen.explain([x, 0]).unwrap();
    }
    assert_eq!(screen.textures.pixels().asked(), 16);
    assert_eq!(screen.textures.pixels().wait().unwrap().unwrap().pixel, [24, 0]);
}

#[test]
fn a_lost_device_is_an_error_and_another_one_answers() {
    let mut screen = screen();
    screen.explain([3, 4]).unwrap();
    screen.gpu.device.destroy();
    let is_lost = |error: &Error| matches!(error, Error::Gpu(GpuError::DeviceLost));
    assert!(screen.explain([5, 6]).is_err_and(|error| is_lost(&error)));
    let mut screen = screen.on_another_device();
    assert_eq!(screen.textures.pixels().asked(), 0);
    screen.set_mapping(0, &Mapping::new(SIZE, [0.4, 0.6], 1.7, 1.3, 0.7));
    screen.explain([5, 6]).unwrap();
    let told = screen.textures.pixels().wait().unwrap().unwrap();
    assert_eq!(told.explanations.len(), 1);
}
