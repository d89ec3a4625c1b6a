//! Feedback passes that an application begins and ends itself.

use crate::common::{Mapping, PICTURE, Screen, property, settings};
use vastex::{AddressMode, Error, FeedbackMode, GpuError, Settings, ViewId, ViewSettings};

const SIZE: [u32; 2] = [1000, 777];

fn screen(settings: Settings) -> Screen {
    let sources = [32, 64].map(|page| property(SIZE, page, AddressMode::Clamp));
    let mut screen = Screen::new(&sources, settings);
    (0..2).for_each(|nth| screen.set_mapping(nth, &Mapping::new(SIZE, [0.4, 0.5], 1.1, 1.0, 0.2)));
    screen
}

/// One frame, its pass begun by the application, in an encoder before the one in which it is ended.
fn frame_by_host(screen: &mut Screen, view: ViewId, picture: [u32; 2]) -> Result<(), Error> {
    let mut drawn = screen.gpu.device.create_command_encoder(&Default::default());
    let mut ended = screen.gpu.device.create_command_encoder(&Default::default());
    assert!(screen.draw_by_host(&mut drawn, view, picture)?);
    screen.textures.view_mut(view).unwrap().end_feedback(&mut ended)?;
    screen.textures.update()?;
    screen.gpu.queue.submit([drawn.finish(), ended.finish()]);
    Ok(())
}

#[test]
fn what_the_application_draws_is_what_the_closure_draws() {
    let [mut by_host, mut by_closure] = [(); 2].map(|()| screen(settings()));
    let views = [&mut by_host, &mut by_closure]
        .map(|screen| [ViewId::MAIN, screen.textures.add_view(ViewSettings::default()).unwrap()]);
    // Sizes that no block divides, and of views that take turns.
    let pictures = [PICTURE, [133, 77]];
    for frame in 0..60 {
        let nth = frame % 2;
        frame_by_host(&mut by_host, views[0][nth], pictures[nth]).unwrap();
        by_closure.frame_of(&[(views[1][nth], pictures[nth], 0..2)]).unwrap();
        assert_eq!(by_host.textures.stats().pager, by_closure.textures.stats().pager, "{frame}");
    }
    assert!(by_host.textures.inspect().is_converged() && by_host.textures.stats().pager.loaded > 20);
    assert!(by_host.picture() == by_closure.picture());
}

#[test]
fn a_pass_that_is_not_ended_is_an_error_at_the_next_and_asks_for_nothing() {
    let mut screen = screen(settings());
    for _ in 0..3 {
        let mut encoder = screen.gpu.device.create_command_encoder(&Default::default());
        screen.draw_by_host(&mut encoder, ViewId::MAIN, PICTURE).unwrap();
        screen.textures.update().unwrap();
        screen.gpu.queue.submit([encoder.finish()]);
        let frame = screen.textures.inspect().frame() - 1;
        let mut encoder = screen.gpu.device.create_command_encoder(&Default::default());
        let error = screen.draw_by_host(&mut encoder, ViewId::MAIN, PICTURE).unwrap_err();
        let is_it = |error: &Error| matches!(error, Error::FeedbackNotEnded { view: ViewId::MAIN, frame: of } if *of == frame);
        assert!(is_it(&error) && error.to_string().contains("end_feedback"), "{error}");
    }
    (0..10).for_each(|_| screen.textures.update().unwrap());
    let stats = screen.textures.stats();
    assert_eq!((stats.feedback_bytes_read, stats.pager.loaded), (0, 0), "nothing of it has come");
    // The closure says so, too; and then all is well.
    let mut encoder = screen.gpu.device.create_command_encoder(&Default::default());
    screen.draw_by_host(&mut encoder, ViewId::MAIN, PICTURE).unwrap();
    assert!(matches!(screen.frame(), Err(Error::FeedbackNotEnded { .. })));
    screen.converge();
}

#[test]
fn a_pass_of_what_is_expected_is_not_begun_inside_that_of_the_main_view() {
    let mut screen = screen(settings());
    let mut encoder = screen.gpu.device.create_command_encoder(&Default::default());
    screen.draw_by_host(&mut encoder, ViewId::MAIN, PICTURE).unwrap();
    let expected = screen.draw_by_host(&mut encoder, ViewId::EXPECTED, PICTURE);
    assert!(matches!(expected, Err(Error::FeedbackNotEnded { view: ViewId::MAIN, .. })), "{expected:?}");
    assert!(screen.draw_by_host(&mut encoder, ViewId::EXPECTED, PICTURE).unwrap());
    screen.textures.view_mut(ViewId::EXPECTED).unwrap().end_feedback(&mut encoder).unwrap();
    screen.converge();
}

#[test]
fn what_cannot_be_begun_or_ended_is_an_error() {
    let mut screen = screen(settings());
    let mut encoder = screen.gpu.device.create_command_encoder(&Default::default());
    let ended = screen.textures.view_mut(ViewId::MAIN).unwrap().end_feedback(&mut encoder);
    assert!(matches!(ended, Err(Error::FeedbackNotBegun(ViewId::MAIN))));
    let other = ViewId::new(77);
    assert!(matches!(screen.textures.view_mut(other), Err(Error::NoView(view)) if view == other));
    let begun = screen.textures.view_mut(ViewId::MAIN).unwrap().begin_feedback(&mut encoder, [0, 5]);
    assert!(matches!(begun, Err(Error::Gpu(GpuError::TargetSize { .. }))));
    screen.converge();
}

#[test]
fn inline_there_is_nothing_to_begin() {
    let mut screen = screen(Settings { feedback: Some(FeedbackMode::Inline), ..settings() });
    let mut encoder = screen.gpu.device.create_command_encoder(&Default::default());
    assert!(!screen.draw_by_host(&mut encoder, ViewId::MAIN, PICTURE).unwrap());
    screen.textures.view_mut(ViewId::MAIN).unwrap().end_feedback(&mut encoder).unwrap();
}
