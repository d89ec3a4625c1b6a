//! Sources that do not answer: the others' pictures come all the same, their own pages are reported, and the
//! program can end.
//!
//! Reads that should come may be overdue on a slow machine; then they are tried again, so that nothing here
//! depends on its speed.

use std::collections::BTreeSet;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, mpsc};
use std::time::{Duration, Instant};

use vastex::diagnostics::PageState;
use vastex::{AddressMode, Error, Event, Pace, Settings, Textures, TileSource};
use vastex_core::{Description, PagePos};
use vastex_tiles::{ReadFuture, ends_within};
use vastex_wgpu::test_device::TestDevice;

use crate::common::{Mapping, Screen, property, settings};

const SIZE: [u32; 2] = [1000, 777];
const PAGE: u32 = 32;
const TILE_BYTES: u64 = 40 * 40 * 4;
/// What takes longer than this never comes.
const DEADLINE: Duration = Duration::from_secs(240);

#[derive(Clone, Copy, Debug)]
enum How {
    /// The future suspends and is never woken.
    Suspends,
    /// The read blocks its thread.
    Blocks,
}

/// A source that gives its tail, if any, and then nothing until it is told to.
struct Hung {
    source: Arc<dyn TileSource>,
    how: How,
    gives_tail: AtomicBool,
    answers: Mutex<bool>,
    told: Condvar,
}

impl Hung {
    fn new(how: How) -> Arc<Hung> {
        let (source, gives_tail) = (property(SIZE, PAGE, AddressMode::Clamp), AtomicBool::new(true));
        Arc::new(Hung { source, how, gives_tail, answers: Mutex::new(false), told: Condvar::new() })
    }

    /// One that gives nothing at all.
    fn without_tail(how: How) -> Arc<Hung> {
        let hung = Hung::new(how);
        hung.gives_tail.store(false, Ordering::SeqCst);
        hung
    }

    fn answer(&self) {
        *self.answers.lock().unwrap() = true;
        self.told.notify_all();
    }
}

impl TileSource for Hung {
    fn description(&self) -> &Arc<Description> {
        self.source.description()
    }

    fn read(&self, pos: PagePos) -> ReadFuture<'_> {
        Box::pin(async move {
            let is_tail = pos == self.description().geometry.tail_pos();
            match self.how {
                _ if is_tail && self.gives_tail.load(Ordering::SeqCst) => {}
                How::Suspends if !*self.answers.lock().unwrap() => std::future::pending().await,
                How::Suspends => {}
                How::Blocks => drop(self.told.wait_while(self.answers.lock().unwrap(), |answers| !*answers)),
            }
            self.source.read(pos).await
        })
    }
}

/// The first texture hangs, the second one does not.
fn screen(hung: &Arc<Hung>, settings: Settings) -> Screen {
    let sources: [Arc<dyn TileSource>; 2] = [hung.clone(), property(SIZE, PAGE, AddressMode::Clamp)];
    let mut screen = Screen::new(&sources, settings);
    let mapping = Mapping::new(SIZE, [0.5, 0.5], 1.1, 1.0, 0.2);
    (0..2).for_each(|nth| screen.set_mapping(nth, &mapping));
    screen
}

/// Returns true if all that the second texture certainly wants is there.
fn second_is_sharp(screen: &Screen, wanted: &[vastex_core::WantedPage]) -> bool {
    let texture = screen.texture(1);
    let mut of_it =
        wanted.iter().filter(|wanted| wanted.page.texture() == texture.number() && wanted.pixels > 64);
    of_it.clone().count() > 5
        && of_it.all(|wanted| matches!(screen.textures.inspect().state(wanted.page), PageState::Resident(_)))
}

/// The program can end: this does, though reads have not.
fn drop_in_time(screen: Screen) {
    // Which thread lets go of the device is not what is tested, and NVIDIA's driver (580.159, with OpenGL
    // beside Vulkan) ends the program where that thread ends before the program.
    let device = screen.gpu.device.clone();
    ends_within(DEADLINE, move || drop(screen)).unwrap();
    drop(device);
}

#[test]
fn other_textures_converge_and_each_page_that_hangs_is_said_once() {
    for how in [How::Suspends, How::Blocks] {
        let hung = Hung::new(how);
        // As few bytes in flight as those that hang hold all at once.
        let limits = Settings {
            pace: Pace::Realtime,
            in_flight_bytes: 6 * TILE_BYTES,
            read_time_out: Duration::from_millis(100),
            ..settings()
        };
        let mut screen = screen(&hung, limits);
        let wanted = screen.feedback_of_every_pixel().pages;
        let (start, mut failed) = (Instant::now(), BTreeSet::new());
        loop {
            for event in screen.frame().unwrap() {
                if let Event::Failed { page, why, .. } = event
                    && page.texture() == screen.texture(0).number()
                {
                    assert!(why.contains("no answer within 100ms"), "{why}");
                    assert!(failed.insert(page), "{how:?}: {page:?} was said twice");
                }
            }
            if second_is_sharp(&screen, &wanted) && failed.len() > 5 && screen.textures.stats().converged {
                break;
            }
            assert!(start.elapsed() < DEADLINE, "{how:?}: {:?}", screen.textures.stats());
            std::thread::sleep(Duration::from_millis(1));
        }
        // When it answers again, it comes by itself.
        hung.answer();
        while !screen.textures.inspect().failed_pages().is_empty() {
            screen.frame().unwrap();
            assert!(start.elapsed() < DEADLINE, "{how:?}: {:?}", screen.textures.inspect().failed_pages());
            std::thread::sleep(Duration::from_millis(1));
        }
        drop_in_time(screen);
    }
}

/// Nothing is ever overdue here: what hangs holds its part of what may be in flight, and no more.
#[test]
fn other_textures_are_sharp_before_anything_is_overdue() {
    let hung = Hung::new(How::Suspends);
    let limits = Settings {
        pace: Pace::Realtime,
        in_flight_bytes: 6 * TILE_BYTES,
        read_time_out: Duration::from_secs(3600),
        ..settings()
    };
    let mut screen = screen(&hung, limits);
    let wanted = screen.feedback_of_every_pixel().pages;
    let start = Instant::now();
    while !second_is_sharp(&screen, &wanted) {
        let events = screen.frame().unwrap();
        assert!(!events.iter().any(|event| matches!(event, Event::Failed { .. })), "{events:?}");
        assert!(start.elapsed() < DEADLINE, "{:?}", screen.textures.stats());
        std::thread::sleep(Duration::from_millis(1));
    }
    assert!(screen.textures.stats().pager.in_flight > 0, "what hangs is under way");
    drop_in_time(screen);
}

#[test]
fn textures_are_dropped_without_those_that_hang() {
    for (how, pace) in [(How::Suspends, Pace::Realtime), (How::Blocks, Pace::Realtime)] {
        let hung = Hung::new(how);
        let mut screen = screen(&hung, Settings { pace, ..settings() });
        // Until reads hang, and long before they are overdue.
        (0..30).for_each(|_| drop(screen.frame().unwrap()));
        drop_in_time(screen);
        hung.answer();
    }
}

#[test]
fn lock_step_waits_for_the_time_out_and_no_longer() {
    for how in [How::Suspends, How::Blocks] {
        let hung = Hung::new(how);
        let mut screen = screen(&hung, Settings { read_time_out: Duration::from_millis(50), ..settings() });
        let wanted = screen.feedback_of_every_pixel().pages;
        // Enough frames for those to be tried again that a slow machine made overdue, and those that hang to
        // fail again and again.
        let is_sharp = (0..2000).any(|_| {
            screen.frame().unwrap();
            second_is_sharp(&screen, &wanted) && screen.textures.stats().converged
        });
        assert!(is_sharp, "{how:?}: {:?}", screen.textures.stats());
        let first = screen.texture(0);
        assert!(screen.textures.inspect().failed_pages().iter().all(|page| page.texture() == first.number()));
        assert!(!screen.textures.inspect().failed_pages().is_empty());
        drop_in_time(screen);
        hung.answer();
    }
}

#[test]
fn a_tail_that_does_not_come_is_an_error_in_time() {
    for how in [How::Suspends, How::Blocks] {
        let hung = Hung::without_tail(how);
        let time_out = Duration::from_millis(50);
        let (done, end) = mpsc::channel();
        let source = hung.clone();
        std::thread::spawn(move || {
            let gpu = TestDevice::new();
            let limits = Settings { read_time_out: time_out, ..settings() };
            let mut textures = Textures::new(&gpu.device, &gpu.queue, limits).unwrap();
            let error = textures.add_blocking(source).unwrap_err();
            assert_eq!(textures.inspect().textures().count(), 0);
            done.send((error, textures)).unwrap();
        });
        let (error, textures) = end.recv_timeout(DEADLINE).unwrap();
        assert!(matches!(error, Error::TailOverdue { size: SIZE, time_out: after } if after == time_out));
        let said = error.to_string();
        for words in ["1000x777 texels", "within 50ms", "check the disk or the network", "read_time_out"] {
            assert!(said.contains(words), "{words}: {said}");
        }
        // When it answers, it may come.
        hung.answer();
        let mut textures = textures;
        let start = Instant::now();
        while let Err(error) = textures.add_blocking(hung.clone()) {
            assert!(matches!(error, Error::TailOverdue { .. }) && start.elapsed() < DEADLINE, "{error}");
        }
    }
}

/// All of its pages are one read then, which may take as long as they come; the first that does not ends it.
#[test]
fn a_texture_held_whole_is_waited_for_no_longer_than_one_page() {
    let (gpu, time_out) = (TestDevice::new(), Duration::from_millis(200));
    let limits = Settings { read_time_out: time_out, whole_bytes: 64 << 20, ..settings() };
    let mut textures = Textures::new(&gpu.device, &gpu.queue, limits).unwrap();
    let hung = Hung::new(How::Suspends);
    assert!(hung.description().geometry.page_count() > 500);
    let error = textures.add_blocking(hung).unwrap_err();
    assert!(matches!(error, Error::TailOverdue { time_out: after, .. } if after == time_out), "{error}");
}

#[test]
fn another_device_is_gone_on_with_though_a_source_hangs() {
    let hung = Hung::new(How::Blocks);
    let time_out = Duration::from_secs(20);
    let limits = Settings { pace: Pace::Realtime, ram_cache_bytes: 0, read_time_out: time_out, ..settings() };
    let mut screen = Screen::new(&[hung.clone() as Arc<dyn TileSource>], limits);
    let picture = |screen: &mut Screen| {
        screen.set_mapping(0, &Mapping::new(SIZE, [0.5, 0.5], 1.1, 1.0, 0.2));
        screen.frame().unwrap();
        screen.picture()
    };
    let before = picture(&mut screen);
    assert!(before.iter().any(|colour| *colour != before[0]), "the tail is seen");
    // From here on it gives no tail, either, and no cache has it.
    hung.gives_tail.store(false, Ordering::SeqCst);
    let mut screen = screen.on_another_device();
    assert!(picture(&mut screen) == before);
    drop_in_time(screen);
    hung.answer();
}

struct Panics(Arc<dyn TileSource>);

impl TileSource for Panics {
    fn description(&self) -> &Arc<Description> {
        self.0.description()
    }

    fn read(&self, _: PagePos) -> ReadFuture<'_> {
        panic!("on purpose")
    }
}

#[test]
fn a_source_that_panics_over_its_tail_is_an_error() {
    let gpu = TestDevice::new();
    let mut textures = Textures::new(&gpu.device, &gpu.queue, settings()).unwrap();
    let error =
        textures.add_blocking(Arc::new(Panics(property(SIZE, PAGE, AddressMode::Clamp)))).unwrap_err();
    assert!(
        matches!(error, Error::TailFailed { size: SIZE, .. }) && error.to_string().contains("on purpose"),
        "{error}"
    );
}
