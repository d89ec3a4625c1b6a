//! Command buffers that are dropped, recorded ahead, or submitted in parts: later pictures are right, and
//! nothing is said to have converged that has not.

use vastex::{AddressMode, FeedbackMode, PoolSettings, Settings, ViewId};
use vastex_wgpu::test_device::{compute_pipelines, polls};

use crate::common::texts::telling;
use crate::common::{Mapping, PICTURE, Screen, property, settings};
use crate::moving::{SIZES, check_counts, wrong_in_all};

const SIZE: [u32; 2] = SIZES[0];
const TILE: u64 = 72 * 72 * 4;
/// Frames in which a view comes right whatever was dropped before.
const PATIENCE: u32 = 300;

fn screen(mode: FeedbackMode, tiles: u64) -> Screen {
    let settings = Settings {
        feedback: Some(mode),
        pools: PoolSettings::of_bytes(tiles * TILE),
        upload_bytes_per_frame: 6 * TILE,
        telemetry_frames: 10_000,
        ..settings()
    };
    Screen::showing(settings, &telling(), |textures| {
        textures.add_blocking(property(SIZE, 64, AddressMode::Clamp)).unwrap()
    })
}

/// Views that have little in common, from coarse to level 0.
fn pose(nth: u32) -> Mapping {
    let centre = [[0.3, 0.4], [0.7, 0.6], [0.5, 0.3], [0.25, 0.7], [0.6, 0.35]][nth as usize % 5];
    let texels = [1.1, 5.0, 0.9, 2.3][nth as usize % 4];
    Mapping::new(SIZE, centre, texels, 1.0, 0.3 * f64::from(nth))
}

/// The picture of a view in which nothing is missing.
fn sharp(screen: &mut Screen, nth: u32) -> Vec<[u8; 4]> {
    screen.set_mapping(0, &pose(nth));
    screen.textures.view_mut(ViewId::MAIN).unwrap().cut();
    screen.settle(|_| false, |_| {});
    screen.picture()
}

/// Which of a frame's command buffers are dropped.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Dropped {
    Wanted,
    Picture,
    Both,
    EverySecond,
}

impl Dropped {
    /// `part` is 0 for the feedback pass, 1 for the picture.
    fn is(self, frame: u32, part: usize) -> bool {
        match self {
            Dropped::Wanted => part == 0,
            Dropped::Picture => part == 1,
            Dropped::Both => true,
            Dropped::EverySecond => frame % 2 == 1,
        }
    }
}

fn whatever_is_dropped(mode: FeedbackMode) {
    let (mut control, mut screen) = (screen(mode, 400), screen(mode, 400));
    let kinds = [Dropped::Wanted, Dropped::Picture, Dropped::Both, Dropped::EverySecond];
    let cases = kinds.into_iter().flat_map(|kind| [0, 2, 5].map(move |begin| (kind, begin)));
    for ((kind, begin), nth) in cases.zip(0..) {
        let expected = sharp(&mut control, nth);
        let mapping = pose(nth);
        screen.set_mapping(0, &mapping);
        screen.textures.view_mut(ViewId::MAIN).unwrap().cut();
        // Ten frames in a row from some frame on, as the view loads; then all are submitted.
        let dropped = |part: (u32, usize)| (begin..begin + 10).contains(&part.0) && kind.is(part.0, part.1);
        let (mut frame, mut checked) = (0, 0);
        screen.settle(dropped, |screen| {
            let is_sharp = screen.textures.stats().converged && screen.textures.inspect().is_converged();
            if frame >= begin || is_sharp {
                let picture = screen.picture();
                // As coarse as what is there, but of the place where each pixel looks.
                let wrong = wrong_in_all(&picture, &mapping);
                assert_eq!(wrong, 0, "{mode:?} {kind:?} from {begin}: frame {frame}");
                assert!(!is_sharp || picture == expected, "{mode:?} {kind:?} from {begin}: said to be sharp");
                checked += 1;
            }
            frame += 1;
        });
        assert!(checked > 10, "{mode:?} {kind:?} from {begin}: {checked} pictures");
        assert!(screen.picture() == expected, "{mode:?} {kind:?} from {begin}");
    }
    check_counts(&screen, &mode);
}

#[test]
fn whatever_is_dropped_of_a_pass_of_its_own_the_picture_comes_right() {
    whatever_is_dropped(FeedbackMode::Separate);
}

#[test]
fn whatever_is_dropped_of_inline_feedback_the_picture_comes_right() {
    whatever_is_dropped(FeedbackMode::Inline);
}

#[test]
fn whatever_is_dropped_of_raw_feedback_the_picture_comes_right() {
    whatever_is_dropped(FeedbackMode::Raw);
}

/// As a window that shows nothing for a while does.
#[test]
fn ten_times_in_a_row_takes_no_more_frames_than_once() {
    for mode in FeedbackMode::ALL {
        let frames = |dropped: u32| {
            let mut screen = screen(mode, 400);
            screen.set_mapping(0, &pose(0));
            screen.settle(|(frame, _)| frame < dropped, |_| {}) - dropped
        };
        let [none, ten] = [0, 10].map(frames);
        assert!(ten <= none + 2, "{mode:?}: {ten} frames after ten that were dropped, {none} otherwise");
    }
}

/// No compute pipeline is made for a picture of another size, or another view.
#[test]
fn compute_pipelines_are_made_once_for_a_device() {
    for mode in FeedbackMode::ALL {
        let mut screen = screen(mode, 400);
        screen.set_mapping(0, &pose(0));
        let before = compute_pipelines();
        for step in 0..100 {
            let size = [640 + step * 1280 / 99, 360 + step * 720 / 99];
            screen.frame_of_size(size);
        }
        screen.textures.add_view(vastex::ViewSettings::default()).unwrap();
        assert_eq!(compute_pipelines(), before, "{mode:?}");
    }
}

/// However many views there are, and however much is under way.
#[test]
fn the_device_is_polled_once_a_frame() {
    for mode in FeedbackMode::ALL {
        let settings = Settings { feedback: Some(mode), ..Settings::default() };
        let mut screen = Screen::showing(settings, &telling(), |textures| {
            textures.add_blocking(property(SIZE, 64, AddressMode::Clamp)).unwrap()
        });
        screen.set_mapping(0, &pose(0));
        let others = [(); 2].map(|()| screen.textures.add_view(vastex::ViewSettings::default()).unwrap());
        for frame in 0..12 {
            let views = others.map(|view| (view, PICTURE, 0..1));
            let before = polls();
            screen.frame_of(&views).unwrap();
            let wanted = screen.record_wanted(PICTURE);
            screen.gpu.queue.submit([wanted.finish()]);
            assert_eq!(polls() - before, 1, "{mode:?}: frame {frame}");
        }
    }
}

impl Screen {
    /// Frames of the view as it stands, each in a command buffer for the feedback pass and one for the
    /// picture, until all of it is there: how many it took. `is_dropped` says of a frame and its part whether
    /// it is dropped, `look` looks after each frame.
    pub(crate) fn settle(
        &mut self,
        is_dropped: impl Fn((u32, usize)) -> bool,
        mut look: impl FnMut(&mut Screen),
    ) -> u32 {
        let mut converged = false;
        for frame in 0..PATIENCE {
            self.frame_in_parts(PICTURE, |part| is_dropped((frame, part)));
            look(self);
            while let Some(event) = self.textures.poll_event() {
                converged |= matches!(event, vastex::Event::Converged { .. });
            }
            let was_dropped = is_dropped((frame, 0)) || is_dropped((frame, 1));
            if converged && self.textures.inspect().is_converged() && frame > 20 && !was_dropped {
                return frame;
            }
        }
        panic!("not converged: {:?}", self.textures.stats());
    }

    fn frame_of_size(&mut self, size: [u32; 2]) {
        self.frame_in_parts(size, |_| false);
    }

    fn frame_in_parts(&mut self, size: [u32; 2], is_dropped: impl Fn(usize) -> bool) {
        let wanted = self.record_wanted(size);
        if !is_dropped(0) {
            self.gpu.queue.submit([wanted.finish()]);
        }
        self.textures.update().unwrap();
        let picture = self.record_picture(size);
        if !is_dropped(1) {
            self.gpu.queue.submit([picture.finish()]);
        }
    }
}
