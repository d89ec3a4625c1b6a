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

use anyhow::{Result, anyhow};
use vastex::{FeedbackMode, Settings, TextureSettings, Textures, ViewId};
use vastex_scenes::{Gpu, Pose};
use vastex_viewer::hud::ChosenPools;
use vastex_viewer::stage::{Canvas, Frame, Pictures, StageView, draw_again};
use vastex_viewer::surface_scene::{Blueprint, DisplaySettings, Displayed};

use super::super::is_device_lost;
use super::Viewer;
use crate::report;

/// Frames after which what a view wants is known.
const FIRST_WANTED: u32 = 8;
/// How long a source is waited for at most until the picture is sharp, and for how much feedback at least: a
/// slow machine gives little of it in that time, and is no slow source. The window has its picture meanwhile.
const LONGEST_WAIT: Duration = Duration::from_secs(10);
const LEAST_FEEDBACK: u32 = 100;
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
    /// Returns true if textures are wanted in the place of those of the scene that nothing makes yet.
    pub(in super::super) fn wants_anew(&mut self) -> bool {
        if self.scene.take_feedback_news() {
            self.anew.want(self.scene.wanted_feedback());
        }
        self.anew.is_waiting()
    }

    /// Begins to make the textures that are wanted, on a thread that hands them to `send`.
    pub(in super::super) fn make_anew(&mut self, pose: Pose, send: impl FnOnce(MadeAnew) + Send + 'static) {
        let Some((number, mode, is_broken_off)) = self.anew.begin() else { return };
        let (blueprint, size) = (self.scene.blueprint(), self.surface.size());
        let before = self.scene.textures().inspect().settings().clone();
        let maker = Maker {
            gpu: self.scene.gpu().clone(),
            with: Settings { feedback: Some(mode), picture: size, ..before },
            settings: self.scene.settings().clone(),
            blueprint,
            chosen: self.scene.beside.chosen().pools().clone(),
            pose,
            size,
            longest_wait: LONGEST_WAIT,
            is_broken_off: is_broken_off.clone(),
        };
        if let Err(error) = self.anew.run((number, is_broken_off), move || maker.make(), send) {
            self.anew.want(None);
            self.scene.refuse_feedback(&format!("no thread can be started for another: {error}"));
        }
    }

    /// Textures were made: they take the place of those of the scene, unless something else is wanted by now.
    pub(in super::super) fn take_anew(&mut self, MadeAnew { number, made }: MadeAnew) {
        let Some((wanted, made)) = self.anew.end(number).zip(made) else { return };
        let exchanged = made.and_then(|Made { textures, displayed, settings }| {
            Ok(self.scene.exchange((textures, displayed), &settings)?)
        });
        match exchanged {
            Ok(true) => {}
            // Something else is displayed by now.
            Ok(false) => self.anew.wanted = Some(Wanted { making: None, ..wanted }),
            // The next frame finds that, and they are made anew on the next device.
            Err(error) if is_device_lost(&error) => {
                self.anew.wanted = Some(Wanted { making: None, ..wanted });
            }
            Err(error) => self.scene.refuse_feedback(&report::message(&error)),
        }
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
        let format = blueprint.format();
        let unseen = Canvas::new(&self.gpu, self.size, format.viewed, format.kind);
        let preparer = textures.preparer();
        let read = |source: &Arc<_>| preparer.read_blocking(Arc::clone(source), TextureSettings::default());
        let prepared: Vec<_> = blueprint.sources().map(read).collect::<Result<_, _>>()?;
        let (gpu, settings) = (&self.gpu, &self.settings);
        let displayed = Displayed::of_blueprint(gpu, &mut textures, settings, blueprint, prepared)?;
        self.go_on()?;
        // What cannot have its size is told of where it is in the window.
        drop(self.chosen.give(&mut textures));
        self.sharpen(&mut textures, &displayed, &unseen)?;
        Ok(Made { textures, displayed: Some(displayed), settings: self.settings })
    }

    /// Draws pictures that nobody sees until they are sharp, or have been waited for long enough.
    fn sharpen(&self, textures: &mut Textures, displayed: &Displayed, unseen: &Canvas) -> Result<()> {
        let (renderer, target, begun) = (&displayed.renderer, unseen.target(), Instant::now());
        let (mut heard, mut bytes) = (0, 0);
        for frame in 0.. {
            let stats = textures.stats();
            heard += u32::from(
                stats.feedback_bytes_read != std::mem::replace(&mut bytes, stats.feedback_bytes_read),
            );
            let is_sharp = stats.converged && stats.fading == 0;
            if frame >= FIRST_WANTED && is_sharp
                || heard >= LEAST_FEEDBACK && begun.elapsed() > self.longest_wait
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

#[cfg(feature = "build")]
#[cfg(test)]
mod tests {
    use std::path::Path;

    use vastex::source::ReadFuture;
    use vastex::{Description, Filter, PagePos, TileSource};
    use vastex_build::{DecodeOptions, Decoding, MemoryImage};
    use vastex_scenes::{DisplayOptions, Scene, headless_gpu};
    use vastex_viewer::panels::FileAbout;
    use vastex_viewer::surface_scene::{Growth, PictureFormats, PreparedSource};

    use super::*;

    const SIZE: [u32; 2] = [160, 120];

    fn decoded() -> Arc<MemoryImage> {
        let image = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/earth-elevation-1080x540-u16.png");
        Decoding::open(Path::new(image), &DecodeOptions::default()).unwrap().run(&()).unwrap()
    }

    /// What an image with itself over it is made of.
    fn blueprint(gpu: &Gpu, settings: &DisplaySettings, tiles: &Arc<dyn TileSource>) -> Blueprint {
        use wgpu::TextureFormat::{Rgba8Unorm, Rgba8UnormSrgb};
        let mut textures = Textures::new(&gpu.device, &gpu.queue, Settings::default()).unwrap();
        let formats = PictureFormats::new(&gpu.adapter, vec![Rgba8UnormSrgb, Rgba8Unorm], Rgba8Unorm);
        let [first, over] = [(); 2].map(|()| PreparedSource {
            prepared: textures.preparer().read_blocking(tiles.clone(), TextureSettings::default()).unwrap(),
            tiles: tiles.clone(),
            size: [1080, 540],
            about: FileAbout::default(),
            growth: Growth::Whole,
        });
        let source = ("earth", first);
        let mut displayed = Displayed::new(gpu, &mut textures, &formats, settings, false, source).unwrap();
        displayed.lay_over(gpu, &mut textures, settings, ("over it", over)).unwrap();
        displayed.blueprint(&textures)
    }

    fn maker(gpu: &Gpu, mode: FeedbackMode, tiles: &Arc<dyn TileSource>) -> Maker {
        let settings = DisplaySettings {
            scene: Scene::Image,
            options: DisplayOptions::default(),
            overlay: None,
            may_be_crisp: true,
            range_is_free: false,
        };
        let blueprint = blueprint(gpu, &settings, tiles);
        Maker {
            gpu: gpu.clone(),
            with: Settings { feedback: Some(mode), picture: SIZE, ..Settings::default() },
            settings,
            blueprint: Some(blueprint),
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
            let names = displayed.blueprint(&made.textures);
            assert!(names.names().eq(["earth", "over it"]));
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

    /// A machine that takes longer for its frames than anybody waits shows a sharp picture all the same.
    #[test]
    fn a_slow_machine_is_no_slow_source() {
        let gpu = headless_gpu().unwrap();
        let tiles: Arc<dyn TileSource> = decoded();
        let maker = Maker { longest_wait: Duration::ZERO, ..maker(&gpu, FeedbackMode::Raw, &tiles) };
        let made = maker.make().unwrap();
        assert!(made.textures.stats().converged, "what is seen is not sharp");
    }

    /// A source that gives its coarsest tile, and no other.
    struct Hung(Arc<MemoryImage>);

    impl TileSource for Hung {
        fn description(&self) -> &Arc<Description> {
            self.0.description()
        }

        fn read(&self, pos: PagePos) -> ReadFuture<'_> {
            let is_tail = pos == self.description().geometry.tail_pos();
            if is_tail { self.0.read(pos) } else { Box::pin(std::future::pending()) }
        }
    }

    /// Textures of a source that does not answer come, too, as those that there were.
    #[test]
    fn a_source_that_does_not_answer_is_waited_for_no_longer_than_is_said() {
        let gpu = headless_gpu().unwrap();
        let tiles: Arc<dyn TileSource> = Arc::new(Hung(decoded()));
        let maker = Maker { longest_wait: Duration::ZERO, ..maker(&gpu, FeedbackMode::Raw, &tiles) };
        let made = maker.make().unwrap();
        assert!(made.displayed.is_some() && !made.textures.stats().converged);
        assert!(made.textures.inspect().frame() >= u64::from(LEAST_FEEDBACK));
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
