//! Several views in one encoder: each says what it wants as if it were alone.

use std::collections::BTreeSet;
use std::ops::Range;

use crate::common::texts::{scales, telling};
use crate::common::{Mapping, PICTURE, Screen, property, settings};
use vastex::diagnostics::PageState;
use vastex::{
    AddressMode, Error, FeedbackMode, JITTER_CYCLE, Pace, PageId, Settings, ViewError, ViewId, ViewSettings,
};

const SIZE: [u32; 2] = [1000, 777];
/// Of the view beside the main one.
const SMALL: [u32; 2] = [96, 50];
const FRAMES: u64 = 40;

/// Two textures, each seen around a place of its own, with pages so small that a view needs its whole cycle
/// to see them all.
fn screen(pace: Pace) -> Screen {
    let sources = [8, 16].map(|page| property(SIZE, page, AddressMode::Clamp));
    let mut screen = Screen::new(&sources, Settings { pace, ..settings() });
    screen.set_mapping(0, &Mapping::new(SIZE, [0.3, 0.6], 1.1, 1.0, 0.2));
    screen.set_mapping(1, &Mapping::new(SIZE, [0.7, 0.4], 0.7, 1.3, 1.0));
    screen
}

fn lock_step() -> Screen {
    screen(Pace::LockStep { latency_frames: 1 })
}

type Drawn = (ViewId, [u32; 2], Range<usize>);

/// What each feedback wanted while the views were drawn, as often as each says.
fn trace(screen: &mut Screen, views: &[(Drawn, u64)]) -> Vec<Vec<vastex_core::WantedPage>> {
    screen.textures.ahead().trace().record();
    for frame in 0..FRAMES {
        let due = views.iter().filter(|(_, every)| frame.is_multiple_of(*every));
        screen.frame_of(&due.map(|(drawn, _)| drawn.clone()).collect::<Vec<_>>()).unwrap();
    }
    screen.textures.ahead().trace().take().unwrap().unwrap().frames().to_vec()
}

#[test]
fn views_of_different_sizes_in_one_encoder_want_what_each_would_alone() {
    let main = (ViewId::MAIN, PICTURE, 0..1);
    let alone = [
        trace(&mut lock_step(), &[(main.clone(), 1)]),
        trace(&mut lock_step(), &[((ViewId::MAIN, SMALL, 1..2), 1)]),
    ];
    let mut screen = lock_step();
    let mirror = screen.textures.add_view(ViewSettings::default().with_weight(0.3)).unwrap();
    let together = trace(&mut screen, &[(main, 1), ((mirror, SMALL, 1..2), 1)]);
    assert_eq!((together.len(), alone[0].len(), alone[1].len()), (38, 38, 38));
    for (frame, together) in together.iter().enumerate() {
        let mut both = [&alone[0][frame][..], &alone[1][frame]].concat();
        both.sort_unstable();
        assert_eq!(together, &both, "frame {frame}");
        assert!(both.len() > alone[0][frame].len());
    }
    assert!(screen.textures.stats().converged, "{:?}", screen.textures.stats());
    let resident = |page: PageId| matches!(screen.textures.inspect().state(page), PageState::Resident(_));
    assert!(together.iter().flatten().all(|wanted| resident(wanted.page)));
}

#[test]
fn a_view_says_once_in_a_frame_what_it_wants() {
    for mode in FeedbackMode::ALL {
        let mut screen =
            Screen::showing(Settings { feedback: Some(mode), ..settings() }, &telling(), |textures| {
                textures.add_blocking(property(SIZE, 16, AddressMode::Clamp)).unwrap()
            });
        screen.set_mapping(0, &Mapping::new(SIZE, [0.3, 0.6], 1.1, 1.0, 0.2));
        for frame in 0..FRAMES {
            let recorded = if mode == FeedbackMode::Inline {
                screen.textures.update().unwrap();
                screen.record_picture(PICTURE)
            } else {
                screen.record_wanted(PICTURE)
            };
            let mut again = screen.gpu.device.create_command_encoder(&Default::default());
            let twice = match mode {
                FeedbackMode::Inline => screen.textures.main_pass(&mut again, PICTURE, |_, _| ()),
                _ => screen.textures.feedback(&mut again, PICTURE, |_, _| ()),
            };
            assert!(
                matches!(twice, Err(Error::FeedbackTwice { view: ViewId::MAIN, .. })),
                "{mode:?}: {twice:?}"
            );
            // Where the first is dropped the second is as good; an application has done so for a window that
            // gives no picture.
            drop(recorded);
            let again = match mode {
                FeedbackMode::Inline => screen.record_picture(PICTURE),
                _ => screen.record_wanted(PICTURE),
            };
            screen.gpu.queue.submit([again.finish()]);
            if mode != FeedbackMode::Inline {
                screen.textures.update().unwrap();
            }
            assert!(frame < 20 || screen.textures.stats().pager.wanted > 20, "{mode:?}");
        }
        assert!(screen.textures.stats().converged, "{mode:?}: {:?}", screen.textures.stats());
        let wanted = screen.feedback_of_every_pixel().pages;
        let resident = |page: PageId| matches!(screen.textures.inspect().state(page), PageState::Resident(_));
        let mut plain = wanted.iter().filter(|wanted| wanted.pixels > 64);
        assert!(plain.clone().count() > 10 && plain.all(|wanted| resident(wanted.page)), "{mode:?}");
    }
}

/// Inline, the first main pass of an added view moves the cells of all views. What is drawn after it in that
/// frame by a bind group that the application has kept reports into the old ones.
#[test]
fn a_view_is_looked_at_again_whose_cells_another_view_has_moved() {
    // What each feedback of the main view wanted.
    let wanted = |keeps: bool| {
        let settings = Settings {
            pace: Pace::LockStep { latency_frames: 1 },
            feedback: Some(FeedbackMode::Inline),
            picture: PICTURE,
            ..settings()
        };
        let mut screen = Screen::showing(settings, &telling(), |textures| {
            textures.add_blocking(property(SIZE, 16, AddressMode::Clamp)).unwrap()
        });
        screen.set_mapping(0, &Mapping::new(SIZE, [0.3, 0.6], 1.1, 1.0, 0.2));
        let mirror = screen.textures.add_view(ViewSettings::default()).unwrap();
        let kept = screen.textures.bind_group(screen.texture(0)).unwrap().clone();
        screen.textures.ahead().trace().record();
        for frame in 0..12 {
            screen.textures.update().unwrap();
            let mut first = screen.gpu.device.create_command_encoder(&Default::default());
            screen.textures.view_mut(mirror).unwrap().main_pass(&mut first, SMALL, |_, _| ()).unwrap();
            assert!(frame > 0 || *screen.textures.bind_group(screen.texture(0)).unwrap() != kept);
            let then = screen.record_picture_by(PICTURE, (keeps && frame == 0).then_some(&kept));
            screen.gpu.queue.submit([first.finish(), then.finish()]);
        }
        screen.textures.ahead().trace().take().unwrap().unwrap().frames().to_vec()
    };
    let (bound_anew, kept) = (wanted(false), wanted(true));
    assert!(kept[0].is_empty());
    assert!(kept[1] == bound_anew[0], "what the first position sees comes in the next frame");
    assert!(bound_anew[2] != bound_anew[0], "positions see the same");
}

#[test]
fn a_view_that_is_seldom_drawn_looks_at_all_of_its_pixels() {
    let pages_of = |every: u64| -> BTreeSet<PageId> {
        let mut screen = lock_step();
        let mirror = screen.textures.add_view(ViewSettings::default()).unwrap();
        let mut pages = BTreeSet::new();
        screen.textures.ahead().trace().record();
        for frame in 0..every * u64::from(JITTER_CYCLE) + 2 {
            let is_drawn = frame.is_multiple_of(every) && frame < every * u64::from(JITTER_CYCLE);
            let views = if is_drawn { vec![(mirror, SMALL, 0..1)] } else { Vec::new() };
            screen.frame_of(&views).unwrap();
        }
        let trace = screen.textures.ahead().trace().take().unwrap().unwrap();
        assert_eq!(trace.frames().len(), JITTER_CYCLE as usize);
        pages.extend(trace.frames().iter().flatten().map(|wanted| wanted.page));
        pages
    };
    let often = pages_of(1);
    assert!(often.len() > 40, "{} pages", often.len());
    assert_eq!(often, pages_of(4));
}

#[test]
fn runs_with_several_views_are_the_same_each_time() {
    let run = || {
        let mut screen = lock_step();
        let mirror = screen.textures.add_view(ViewSettings::default()).unwrap();
        let mut said = Vec::new();
        for frame in 0..60 {
            let views = [(ViewId::MAIN, PICTURE, 0..1), (mirror, SMALL, 1..2)];
            screen.frame_of(&views[..if frame % 3 == 0 { 2 } else { 1 }]).unwrap();
            if frame == 30 {
                screen.textures.view_mut(mirror).unwrap().cut();
                screen.textures.view_mut(mirror).unwrap().set_weight(4.0);
            }
            said.push(screen.textures.stats());
        }
        (said, screen.picture())
    };
    assert_eq!(run(), run());
}

#[test]
fn a_view_comes_and_goes_and_outlives_its_device() {
    for pace in [Pace::Realtime, Pace::LockStep { latency_frames: 1 }] {
        let mut screen = screen(pace);
        let mirror = screen.textures.add_view(ViewSettings::default()).unwrap();
        let both = [(ViewId::MAIN, PICTURE, 0..1), (mirror, SMALL, 1..2)];
        let converge = |screen: &mut Screen, views: &[Drawn]| {
            for frame in 0..2000 {
                screen.frame_of(views).unwrap();
                if frame > 20 && screen.textures.stats().converged {
                    return screen.textures.stats();
                }
            }
            panic!("not converged: {:?}", screen.textures.stats());
        };
        // Where the GPU is behind, a feedback is left out, and with it a position of the jitter.
        let is_near = |a: u32, b: u32| a.abs_diff(b) <= if pace == Pace::Realtime { 10 } else { 0 };
        let of_both = converge(&mut screen, &both).pager.wanted;
        let mut screen = screen.on_another_device();
        screen.set_mapping(0, &Mapping::new(SIZE, [0.3, 0.6], 1.1, 1.0, 0.2));
        screen.set_mapping(1, &Mapping::new(SIZE, [0.7, 0.4], 0.7, 1.3, 1.0));
        let again = converge(&mut screen, &both).pager.wanted;
        assert!(is_near(again, of_both), "{again} of {of_both}: {pace:?}");
        // Its feedback is under way, and it has another size from now on; then it goes.
        screen.frame_of(&[(mirror, PICTURE, 1..2)]).unwrap();
        assert!(screen.textures.view_mut(mirror).unwrap().remove());
        assert!(matches!(screen.textures.view_mut(mirror), Err(Error::NoView(id)) if id == mirror));
        assert!(!screen.textures.view_mut(ViewId::MAIN).unwrap().remove());
        let of_main = screen.textures.stats().pager.wanted;
        assert!(of_main + 10 < of_both, "{of_main} of {of_both}");
        let alone = converge(&mut screen, &both[..1]).pager.wanted;
        assert!(is_near(alone, of_main), "{alone} of {of_main}: {pace:?}");
    }
}

#[test]
fn there_are_as_many_views_as_there_can_be() {
    let mut screen = lock_step();
    let views: Vec<ViewId> = (1..vastex_core::MAX_VIEWS)
        .map(|_| screen.textures.add_view(ViewSettings::default()).unwrap())
        .collect();
    let refused = screen.textures.add_view(ViewSettings::default());
    assert!(matches!(refused, Err(Error::View(ViewError::TooMany))), "{refused:?}");
    let drawn: Vec<Drawn> = views.iter().map(|&view| (view, SMALL, 0..2)).collect();
    for _ in 0..4 {
        screen.frame_of(&drawn).unwrap();
    }
    assert!(screen.textures.stats().pager.wanted > 0);
}

/// A picture that is drawn after the feedback of its view is no feedback itself.
#[test]
fn pictures_are_of_their_own_pixels_whatever_was_drawn_before_them() {
    for mode in FeedbackMode::ALL {
        let settings = Settings { feedback: Some(mode), ..settings() };
        let mut screen = Screen::showing(settings, &scales(), |textures| {
            textures.add_blocking(property(SIZE, 16, AddressMode::Clamp)).unwrap()
        });
        screen.set_mapping(0, &Mapping::new(SIZE, [0.3, 0.6], 1.1, 1.0, 0.2));
        let expected = (ViewId::EXPECTED, PICTURE, 0..1);
        for views in
            [vec![], vec![(ViewId::MAIN, PICTURE, 0..1)], vec![(ViewId::MAIN, PICTURE, 0..1), expected]]
        {
            screen.frame_of(&views).unwrap();
            assert!(
                screen.picture().iter().all(|pixel| *pixel == [32; 4]),
                "{mode:?}, {} passes",
                views.len()
            );
        }
        screen.feedback_of_every_pixel();
        assert!(screen.picture().iter().all(|pixel| *pixel == [32; 4]), "{mode:?}");
    }
}
