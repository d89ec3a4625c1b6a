//! Textures made anew for another mode of feedback, beside those that are drawn meanwhile.
//!
//! A thread makes them, reads the sources of what is displayed into them (which stay open, and are decoded no
//! second time) and draws pictures that nobody sees, until these are sharp. Then they take the place of the
//! textures of the window, from one frame to the next.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use anyhow::{Error, Result, anyhow};
use vastex::{FeedbackMode, GpuError, Settings, Textures, ViewId};
use vastex_scenes::{Gpu, Pose};
use vastex_viewer::stage::{Frame, Pictures, StageView, draw_again};

use super::super::displayed::{Blueprint, DisplaySettings, Displayed};
use super::super::panel::Asked;
use super::super::surface::UnseenPicture;
use super::Viewer;
use super::pools::ChosenPools;
use crate::report;

/// Frames after which what a view wants is known, and how long it is waited for at most until it is sharp.
const FIRST_WANTED: u32 = 8;
const LONGEST_WAIT: Duration = Duration::from_secs(1);
/// Between two frames that nobody sees, so that the window has the device for its own.
const PAUSE: Duration = Duration::from_millis(8);
/// Threads that make textures at once: each of them has pools of its own. One that was broken off ends as
/// soon as a source that it reads answers, or is overdue.
const MOST_THREADS: usize = 2;
/// How long the end of the window waits for a thread.
const LONGEST_END: Duration = Duration::from_secs(2);

/// The textures that are wanted for the window, and the threads that make or made some.
#[derive(Default)]
pub(super) struct Anew {
    wanted: Option<Wanted>,
    begun: u64,
    /// Each with the number of what it makes.
    threads: Vec<(u64, JoinHandle<()>)>,
}

/// A mode of feedback that is wanted, and what makes textures for it, once that has begun.
struct Wanted {
    mode: FeedbackMode,
    making: Option<Making>,
}

struct Making {
    number: u64,
    is_broken_off: Arc<AtomicBool>,
}

/// What a thread has made: nothing, where it was broken off.
pub(in super::super) struct MadeAnew {
    number: u64,
    made: Option<Result<Made>>,
}

struct Made {
    textures: Textures,
    /// Nothing, if nothing was displayed.
    displayed: Option<Displayed>,
    /// What it was made with.
    settings: DisplaySettings,
}

impl Anew {
    /// Wants another mode, or none, and breaks off what makes textures for the one before.
    fn want(&mut self, mode: Option<FeedbackMode>) {
        if let Some(Wanted { making: Some(making), .. }) = &self.wanted {
            making.is_broken_off.store(true, Ordering::Relaxed);
        }
        self.wanted = mode.map(|mode| Wanted { mode, making: None });
    }

    /// Begins what makes the textures that are wanted: its number, the mode, and what breaks it off. Nothing
    /// where none are wanted, or as many threads as may be are at it: then it is to be asked for again when
    /// one of them ends.
    fn begin(&mut self) -> Option<(u64, FeedbackMode, Arc<AtomicBool>)> {
        self.threads.retain(|(_, thread)| !thread.is_finished());
        if self.threads.len() >= MOST_THREADS {
            return None;
        }
        let wanted = self.wanted.as_mut()?;
        self.begun += 1;
        let (number, is_broken_off) = (self.begun, Arc::new(AtomicBool::new(false)));
        wanted.making = Some(Making { number, is_broken_off: is_broken_off.clone() });
        Some((number, wanted.mode, is_broken_off))
    }

    /// Runs what makes textures, on a thread of its own, which gives back what it made, or the memory of what
    /// was broken off.
    fn run(
        &mut self,
        (number, is_broken_off): (u64, Arc<AtomicBool>),
        make: impl FnOnce() -> Result<Made> + Send + 'static,
        send: impl FnOnce(MadeAnew) + Send + 'static,
    ) -> std::io::Result<()> {
        let run = move || {
            let made = catch_unwind(AssertUnwindSafe(make));
            let made = made.unwrap_or_else(|_| Err(anyhow!("a fault of this program")));
            // What nobody wants goes here, and not on the loop of events.
            let made = (!is_broken_off.load(Ordering::Relaxed)).then_some(made);
            send(MadeAnew { number, made });
        };
        self.threads.push((number, thread::Builder::new().name("vastex-anew".into()).spawn(run)?));
        Ok(())
    }

    /// The thread with this number has said what it made, and ends. Gives back what it was for, if that is
    /// still wanted.
    fn end(&mut self, number: u64) -> Option<Wanted> {
        if let Some(at) = self.threads.iter().position(|(other, _)| *other == number) {
            // A panic was caught there.
            drop(self.threads.swap_remove(at).1.join());
        }
        let is_of =
            |wanted: &mut Wanted| wanted.making.as_ref().is_some_and(|making| making.number == number);
        self.wanted.take_if(is_of)
    }

    /// Returns true if textures are wanted that nothing makes.
    fn is_waiting(&self) -> bool {
        self.wanted.as_ref().is_some_and(|wanted| wanted.making.is_none())
    }
}

impl Drop for Anew {
    /// Waits a little for threads that still have the device.
    fn drop(&mut self) {
        self.want(None);
        let begun = Instant::now();
        while self.threads.iter().any(|(_, thread)| !thread.is_finished()) && begun.elapsed() < LONGEST_END {
            thread::sleep(Duration::from_millis(5));
        }
    }
}

impl Viewer {
    /// The mode of feedback, or the one that is wanted in its place.
    pub(super) fn feedback_mode(&self) -> FeedbackMode {
        let wanted = self.anew.wanted.as_ref().map(|wanted| wanted.mode);
        wanted.unwrap_or_else(|| self.textures.inspect().feedback_mode())
    }

    /// Has the textures made anew with another mode of feedback. Those that there are are drawn until the
    /// others have a picture.
    pub(super) fn change_feedback(&mut self, mode: FeedbackMode) {
        let is_another = mode != self.textures.inspect().feedback_mode();
        self.anew.want(is_another.then_some(mode));
        if is_another {
            self.notify_in_title(&format!("feedback: {}, as soon as it has a picture", mode.name()));
            self.asked.push(Asked::MakeAnew);
        } else {
            self.chosen.set_feedback(mode);
        }
    }

    /// Goes on to want what was wanted on a device that was lost.
    pub(super) fn want_anew_again(&mut self) {
        if let Some(mode) = self.anew.wanted.as_ref().map(|wanted| wanted.mode) {
            self.anew.want(Some(mode));
            self.asked.push(Asked::MakeAnew);
        }
    }

    /// Begins to make the textures that are wanted, on a thread that hands them to `send`.
    pub(in super::super) fn make_anew(&mut self, pose: Pose, send: impl FnOnce(MadeAnew) + Send + 'static) {
        self.finish_taking_over();
        let Some((number, mode, is_broken_off)) = self.anew.begin() else { return };
        let (blueprint, size) = (
            self.display.displayed().map(|displayed| displayed.blueprint(&self.textures)),
            self.surface.size(),
        );
        let before = self.textures.inspect().settings().clone();
        let maker = Maker {
            gpu: self.gpu.clone(),
            with: Settings { feedback: Some(mode), picture: size, ..before },
            settings: self.settings.clone(),
            blueprint,
            chosen: self.chosen.pools().clone(),
            pose,
            size,
            longest_wait: LONGEST_WAIT,
            is_broken_off: is_broken_off.clone(),
        };
        if let Err(error) = self.anew.run((number, is_broken_off), move || maker.make(), send) {
            self.anew.want(None);
            self.refuse_anew(&anyhow!("no thread can be started for another: {error}"));
        }
    }

    /// Textures were made: they take the place of those of the window, unless something else is wanted by
    /// now.
    pub(in super::super) fn take_anew(&mut self, MadeAnew { number, made }: MadeAnew) {
        let Some((wanted, made)) = self.anew.end(number).zip(made) else {
            // What waited for the end of others begins.
            if self.anew.is_waiting() {
                self.asked.push(Asked::MakeAnew);
            }
            return;
        };
        let made = match made {
            Ok(made) => made,
            Err(error) if is_device_lost(&error) => {
                // The next frame finds that, and they are made anew on the next device.
                self.anew.wanted = Some(Wanted { making: None, ..wanted });
                return;
            }
            Err(error) => return self.refuse_anew(&error),
        };
        self.finish_taking_over();
        let is_same = match (&made.displayed, self.display.displayed()) {
            (Some(made), Some(displayed)) => made.is_of(displayed),
            (None, None) => true,
            _ => false,
        };
        if !is_same {
            // Something else is displayed by now.
            self.anew.wanted = Some(Wanted { making: None, ..wanted });
            self.asked.push(Asked::MakeAnew);
            return;
        }
        if let Err(error) = self.exchange(made) {
            self.refuse_anew(&error);
        }
    }

    fn exchange(&mut self, made: Made) -> Result<()> {
        let Made { mut textures, mut displayed, settings: before } = made;
        if let Some(displayed) = &mut displayed {
            displayed.become_like(&self.gpu, &mut textures, &before, &self.settings)?;
            displayed.catch_up(&mut textures)?;
        }
        let of_window = self.textures.inspect().settings();
        let (uploads, in_flight) = (of_window.upload_bytes_per_frame, of_window.in_flight_bytes);
        textures.memory().set_budgets(uploads, in_flight);
        let gone = displayed.and_then(|displayed| self.display.exchange(displayed));
        let before = std::mem::replace(&mut self.textures, textures);
        // What was made for textures goes before them.
        drop((gone, before));
        self.hud.forget_textures();
        self.to_print.clear();
        (self.values, self.is_shortage_reported) = (None, false);
        self.minimaps.clear();
        self.change_pools_again();
        if self.textures.inspect().settings().picture != self.surface.size() {
            self.fit_pools();
        }
        self.messages.forget("feedback");
        self.chosen.set_feedback(self.textures.inspect().feedback_mode());
        self.notify_in_title(&format!("feedback: {}", self.feedback_mode().name()));
        self.wake();
        self.window.request_redraw();
        Ok(())
    }

    /// The textures that there are stay.
    fn refuse_anew(&mut self, error: &Error) {
        let message = format!("the feedback mode stays as it was: {}", report::message(error));
        report::say(&format!("{}: {message}", self.name()));
        self.tell("feedback", &message);
    }
}

/// Makes textures on a thread of its own.
struct Maker {
    gpu: Gpu,
    with: Settings,
    settings: DisplaySettings,
    blueprint: Option<Blueprint>,
    chosen: ChosenPools,
    pose: Pose,
    /// Of the picture, in pixels.
    size: [u32; 2],
    /// As long is waited for a sharp picture.
    longest_wait: Duration,
    is_broken_off: Arc<AtomicBool>,
}

impl Maker {
    fn make(self) -> Result<Made> {
        let mut textures = Textures::new(&self.gpu.device, &self.gpu.queue, self.with.clone())?;
        let Some(blueprint) = self.blueprint.clone() else {
            return Ok(Made { textures, displayed: None, settings: self.settings });
        };
        self.go_on()?;
        let unseen = UnseenPicture::new(&self.gpu.device, blueprint.format(), self.size);
        let displayed = Displayed::of_blueprint(&self.gpu, &mut textures, &self.settings, blueprint)?;
        self.go_on()?;
        // What cannot have its size is told of where it is in the window.
        drop(self.chosen.give(&mut textures));
        self.sharpen(&mut textures, &displayed, &unseen)?;
        Ok(Made { textures, displayed: Some(displayed), settings: self.settings })
    }

    /// Draws pictures that nobody sees until they are sharp, or have been waited for long enough.
    fn sharpen(&self, textures: &mut Textures, displayed: &Displayed, unseen: &UnseenPicture) -> Result<()> {
        let (renderer, target, begun) = (&displayed.renderer, unseen.target(), Instant::now());
        for frame in 0.. {
            let stats = textures.stats();
            let is_sharp = stats.converged && stats.fading == 0;
            if frame >= FIRST_WANTED && is_sharp
                || begun.elapsed() > self.longest_wait
                || self.is_broken_off()
            {
                break;
            }
            let view = StageView { view: ViewId::MAIN, camera: renderer.camera(), pose: self.pose };
            let recorded = Frame {
                views: &[view],
                expected: None,
                picture: self.size,
                has_feedback: true,
                pictures: Pictures::ForFeedback,
            };
            textures.set_frame_time(PAUSE);
            let encoder = recorded.record(&self.gpu, textures, renderer, &target, |_, _| Ok(()))?;
            self.gpu.queue.submit([encoder.finish()]);
            thread::sleep(PAUSE);
        }
        if !self.is_broken_off() {
            // So that the first frame that is seen has its pipelines.
            renderer.compile_all();
            let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
            draw_again(&mut encoder, textures, renderer, renderer.camera(), &target);
            self.gpu.queue.submit([encoder.finish()]);
        }
        Ok(())
    }

    /// Fails where nobody wants the textures any more.
    fn go_on(&self) -> Result<()> {
        if self.is_broken_off() { Err(anyhow!("it is not wanted any more")) } else { Ok(()) }
    }

    fn is_broken_off(&self) -> bool {
        self.is_broken_off.load(Ordering::Relaxed)
    }
}

fn is_device_lost(error: &Error) -> bool {
    matches!(error.downcast_ref(), Some(vastex::Error::Gpu(GpuError::DeviceLost)))
}

#[cfg(feature = "build")]
#[cfg(test)]
mod tests {
    use std::path::Path;

    use vastex::{Filter, TileSource};
    use vastex_build::{DecodeOptions, Decoding, MemoryImage};
    use vastex_scenes::{DisplayOptions, Scene, headless_gpu};

    use super::super::super::opening::Growth;
    use super::*;

    const SIZE: [u32; 2] = [160, 120];

    fn decoded() -> Arc<MemoryImage> {
        let image = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/earth-elevation-1080x540-u16.png");
        Decoding::open(Path::new(image), &DecodeOptions::default()).unwrap().run(&()).unwrap()
    }

    fn maker(gpu: &Gpu, mode: FeedbackMode, tiles: &Arc<dyn TileSource>) -> Maker {
        let settings = DisplaySettings {
            scene: Scene::Image,
            options: DisplayOptions::default(),
            overlay: None,
            may_be_crisp: true,
            range_is_free: false,
        };
        let sources = vec![("earth".to_owned(), tiles.clone()), ("over it".to_owned(), tiles.clone())];
        Maker {
            gpu: gpu.clone(),
            with: Settings { feedback: Some(mode), picture: SIZE, ..Settings::default() },
            settings,
            blueprint: Some(Blueprint::for_test(sources, [1080, 540], Growth::Whole)),
            chosen: ChosenPools::default(),
            pose: Pose::first(Scene::Image),
            size: SIZE,
            longest_wait: Duration::from_secs(60),
            is_broken_off: Arc::default(),
        }
    }

    /// The sources are those that there were, read and not opened again, and the picture is sharp before
    /// anybody sees it.
    #[test]
    fn textures_are_made_anew_of_the_sources_that_are_open_and_are_sharp_when_they_come() {
        let gpu = headless_gpu().unwrap();
        let image = decoded();
        let tiles: Arc<dyn TileSource> = image.clone();
        let mut before: Option<Displayed> = None;
        for mode in [FeedbackMode::Raw, FeedbackMode::Inline, FeedbackMode::Separate] {
            let made = maker(&gpu, mode, &tiles).make().unwrap();
            let displayed = made.displayed.unwrap();
            assert_eq!(made.textures.inspect().feedback_mode(), mode);
            assert_eq!(made.textures.inspect().settings().filter, Filter::default());
            assert!(made.textures.stats().converged, "{mode:?} shows a picture that is not sharp");
            assert_eq!(displayed.textures().len(), 2, "and what lies over it");
            assert_eq!(displayed.blueprint(&made.textures).names(), ["earth", "over it"]);
            assert!(before.is_none_or(|before| before.is_of(&displayed)), "{mode:?} has other sources");
            before = Some(displayed);
        }
        let other: Arc<dyn TileSource> = decoded();
        let made = maker(&gpu, FeedbackMode::Raw, &other).make().unwrap();
        assert!(!made.displayed.unwrap().is_of(&before.unwrap()), "another source of the same tiles");
    }

    #[test]
    fn what_is_no_longer_wanted_ends_at_once() {
        let gpu = headless_gpu().unwrap();
        let tiles: Arc<dyn TileSource> = decoded();
        let maker = maker(&gpu, FeedbackMode::Raw, &tiles);
        maker.is_broken_off.store(true, Ordering::Relaxed);
        assert!(maker.make().is_err(), "textures were made for nobody");
    }

    /// Whoever goes through the modes while a source does not answer has no more pools than two beside those
    /// of the window, and the mode that was chosen last comes once one of the others has ended.
    #[test]
    fn few_threads_make_textures_at_once_and_the_last_mode_is_made_when_one_ends() {
        let (mut anew, patience) = (Anew::default(), Duration::from_secs(60));
        let (send, ended) = std::sync::mpsc::channel();
        let mut answers = Vec::new();
        let mut choose = |anew: &mut Anew, mode| {
            anew.want(Some(mode));
            let (number, mode, is_broken_off) = anew.begin()?;
            let (answer, wait) = std::sync::mpsc::channel::<()>();
            answers.push(answer);
            let make = move || {
                // A source that answers when it likes.
                let _ = wait.recv_timeout(patience);
                Err(anyhow!("nothing is made for a test"))
            };
            let send = send.clone();
            anew.run((number, is_broken_off), make, move |made| drop(send.send(made))).unwrap();
            Some((number, mode))
        };
        assert_eq!(choose(&mut anew, FeedbackMode::Raw), Some((1, FeedbackMode::Raw)));
        assert_eq!(choose(&mut anew, FeedbackMode::Inline), Some((2, FeedbackMode::Inline)));
        for mode in [FeedbackMode::Raw, FeedbackMode::Separate, FeedbackMode::Raw] {
            assert_eq!(choose(&mut anew, mode), None, "a third");
        }
        assert!(anew.is_waiting() && anew.threads.len() == MOST_THREADS);
        answers.remove(0).send(()).unwrap();
        let MadeAnew { number, made } = ended.recv_timeout(patience).unwrap();
        assert!(number == 1 && made.is_none(), "what was broken off is kept");
        assert!(anew.end(number).is_none() && anew.is_waiting());
        let (number, mode, _) = anew.begin().unwrap();
        assert_eq!((number, mode), (3, FeedbackMode::Raw));
        assert!(!anew.is_waiting());
        answers.remove(0).send(()).unwrap();
        assert_eq!(ended.recv_timeout(patience).unwrap().number, 2);
        assert!(anew.end(2).is_none() && anew.end(3).is_some());
        drop(answers);
    }
}
