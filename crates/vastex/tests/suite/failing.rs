//! A device that refuses: whatever fails midway of `update` and `resize_pool` is not counted as done,
//! pictures are meanwhile what they were, and what comes later is right.

use vastex::{Error, Event, FeedbackMode, PoolId, TableChoice, Textures, ViewId};
use vastex_wgpu::GpuError;
use vastex_wgpu::test_device::fail_after;

use crate::common::{PICTURE, Screen};
use crate::moving::{Case, beside, check_counts, flight, wrong_pixels};

const POOL: PoolId = PoolId::new(0);
const FRAMES: u32 = 44;
/// Frames before which the pool gets so many tiles.
const RESIZES: [(u32, u64); 2] = [(17, 110), (30, 60)];

/// Does something that may fail until it does not: once at each of its steps that can, before each of which
/// `look` sees how things are. How often it failed.
fn fail_everywhere(
    screen: &mut Screen,
    mut act: impl FnMut(&mut Textures) -> Result<(), Error>,
    mut look: impl FnMut(&mut Screen, u32),
) -> u32 {
    for step in 0.. {
        fail_after(Some(step));
        let done = act(&mut screen.textures);
        let is_left = fail_after(None);
        match done {
            Ok(()) => {
                assert!(is_left, "what failed is an error");
                return step;
            }
            Err(error) => assert!(
                matches!(error, Error::Gpu(GpuError::DeviceLost | GpuError::OutOfMemory { .. })) && !is_left,
                "{error}"
            ),
        }
        assert!(step < 40, "it never comes to an end");
        look(screen, step);
    }
    0
}

/// Pixels of either texture that show what they must not.
fn wrong(screen: &Screen, frame: u32) -> [usize; 2] {
    let picture = screen.picture();
    [wrong_pixels(&picture, 0, &flight(frame)), wrong_pixels(&picture, 1, &beside())]
}

fn fails_midway(case: Case) {
    let mut screen = case.screen(70);
    let mut failures = [0; 2];
    for frame in 0..FRAMES {
        if let Some((_, tiles)) = RESIZES.into_iter().find(|(at, _)| *at == frame) {
            let before = screen.picture();
            let resize = |textures: &mut Textures| {
                textures.memory().resize_pool(POOL, case.pool_bytes(tiles)).map(drop)
            };
            failures[1] += fail_everywhere(&mut screen, resize, |screen, _| {
                assert!(screen.picture() == before, "{case:?}: frame {frame}, while it is resized");
            });
            assert_eq!(wrong(&screen, frame - 1), [0, 0], "{case:?}: frame {frame}, resized");
        }
        screen.set_mapping(0, &flight(frame));
        let wanted = screen.record_wanted(PICTURE);
        screen.gpu.queue.submit([wanted.finish()]);
        // Pictures take most of the time.
        let before = (frame % 2 == 0).then(|| screen.picture());
        let mut is_caught_up = false;
        failures[0] += fail_everywhere(&mut screen, Textures::update, |screen, step| {
            assert!(!screen.textures.inspect().is_converged(), "{case:?}: frame {frame}");
            if let Some(before) = &before {
                assert!(is_caught_up || screen.picture() == *before, "{case:?}: frame {frame}");
            }
            // What binds page tables meanwhile does first what the frame could not, such as to fill a table
            // that lies elsewhere.
            if step == 2 {
                let view = screen.textures.add_view(vastex::ViewSettings::default()).unwrap();
                assert!(screen.textures.view_mut(view).is_ok_and(vastex::ViewMut::remove));
                is_caught_up = true;
                assert_eq!(wrong(screen, frame), [0, 0], "{case:?}: frame {frame}, bound");
            }
        });
        let picture = screen.record_picture(PICTURE);
        screen.gpu.queue.submit([picture.finish()]);
        if frame % 2 == 0 {
            assert_eq!(wrong(&screen, frame), [0, 0], "{case:?}: frame {frame}");
        }
    }
    assert!(failures[0] > 4 && failures[1] > 4, "{case:?}: {failures:?} failures");
    screen.textures.memory().resize_pool(POOL, case.pool_bytes(400)).unwrap();
    let settle = |screen: &mut Screen| {
        screen.set_mapping(0, &flight(FRAMES));
        screen.textures.view_mut(ViewId::MAIN).unwrap().cut();
        screen.settle(|_| false, |_| {});
    };
    settle(&mut screen);
    check_counts(&screen, &case);
    assert_eq!(wrong(&screen, FRAMES), [0, 0], "{case:?}");
    if case.mode == FeedbackMode::Separate {
        let mut control = case.screen(400);
        settle(&mut control);
        assert!(screen.picture() == control.picture(), "{case:?}");
    }
}

#[test]
fn what_fails_midway_is_not_counted_as_done() {
    let has_tables_of_its_own =
        |case: &Case| case.mode != FeedbackMode::Inline || case.tables == TableChoice::Direct;
    Case::all().filter(has_tables_of_its_own).for_each(fails_midway);
}

/// What was to be uploaded when a texture was removed goes with it, and the others come right.
#[test]
fn a_texture_may_be_removed_after_a_frame_that_failed() {
    for case in Case::all().take(1) {
        let mut screen = case.screen(70);
        let mut removed = 0;
        for frame in 0..24 {
            screen.set_mapping(0, &flight(frame));
            let wanted = screen.record_wanted(PICTURE);
            screen.gpu.queue.submit([wanted.finish()]);
            fail_after(Some(0));
            let failed = screen.textures.update().is_err();
            fail_after(None);
            if failed {
                if removed < 3 {
                    screen.remove(1);
                    screen.replace_with(1, |textures| case.add(textures, 1));
                    screen.set_mapping(1, &beside());
                    removed += 1;
                }
                screen.textures.update().unwrap();
            }
            let picture = screen.record_picture(PICTURE);
            screen.gpu.queue.submit([picture.finish()]);
            assert_eq!(wrong(&screen, frame), [0, 0], "{case:?}: frame {frame}");
        }
        assert!(removed > 0, "{case:?}: nothing failed");
        while let Some(event) = screen.textures.poll_event() {
            assert!(!matches!(event, Event::Failed { .. }), "{event:?}");
        }
    }
}

/// An application that goes on to its next frame after an update that failed.
#[test]
fn the_frame_after_an_update_that_failed_is_drawn_as_any_other() {
    for mode in FeedbackMode::ALL {
        let case = Case { mode, tables: TableChoice::Direct };
        let mut screen = case.screen(400);
        let mut failures = 0;
        for frame in 0..60 {
            screen.set_mapping(0, &flight(frame));
            let wanted = screen.record_wanted(PICTURE);
            fail_after((frame % 3 == 0).then_some(frame / 3 % 2));
            failures += u32::from(screen.textures.update().is_err());
            fail_after(None);
            let picture = screen.record_picture(PICTURE);
            screen.gpu.queue.submit([wanted.finish(), picture.finish()]);
        }
        assert!(failures > 3, "{mode:?}: {failures} failures");
        assert_eq!(screen.textures.inspect().frame(), 60, "{mode:?}: each is a frame");
        screen.set_mapping(0, &flight(0));
        screen.settle(|_| false, |_| {});
        assert_eq!(wrong(&screen, 0), [0, 0], "{mode:?}");
    }
}
