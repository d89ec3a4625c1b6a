//! The frame loop tells the loader where ranks change: a page that was asked for ahead is read first when it
//! comes into view.

use std::collections::BTreeSet;
use std::sync::{Arc, Condvar, Mutex};
use std::time::{Duration, Instant};

use vastex::{AddressMode, Feedback, Pace, PageId, Region, Settings, Textures, TileSource, Urgency, ViewId};
use vastex_core::{Description, Dims, PagePos, WantedPage};
use vastex_tiles::ReadFuture;
use vastex_wgpu::test_device::TestDevice;

use crate::common::{property, settings};

const SIZE: [u32; 2] = [1000, 777];
/// What takes longer than this never comes.
const DEADLINE: Duration = Duration::from_secs(240);

/// A source that notes which pages are read, beside the tail, and gives none before it is told to.
struct Ordered {
    source: Arc<dyn TileSource>,
    begun: Mutex<Vec<PagePos>>,
    is_open: Mutex<bool>,
    opened: Condvar,
}

impl TileSource for Ordered {
    fn description(&self) -> &Arc<Description> {
        self.source.description()
    }

    fn read(&self, pos: PagePos) -> ReadFuture<'_> {
        Box::pin(async move {
            if pos != self.description().geometry.tail_pos() {
                self.begun.lock().unwrap().push(pos);
                drop(self.opened.wait_while(self.is_open.lock().unwrap(), |is_open| !*is_open));
            }
            self.source.read(pos).await
        })
    }
}

/// Frames until something holds.
fn frames_until(textures: &mut Textures, wanted: &Feedback, mut holds: impl FnMut(&Textures) -> bool) {
    let start = Instant::now();
    while !holds(textures) {
        assert!(start.elapsed() < DEADLINE, "{:?}", textures.stats());
        textures.view_mut(ViewId::MAIN).unwrap().want(wanted.clone());
        textures.update().unwrap();
        std::thread::sleep(Duration::from_millis(1));
    }
}

#[test]
fn a_page_that_was_asked_for_ahead_and_comes_into_view_is_read_before_others() {
    let gpu = TestDevice::new();
    let one_at_a_time = Settings {
        pace: Pace::Realtime,
        loader_threads: 1,
        reads_at_once: 1,
        in_flight_bytes: 64 << 20,
        ..settings()
    };
    let mut textures = Textures::new(&gpu.device, &gpu.queue, one_at_a_time).unwrap();
    let (begun, is_open, opened) = (Mutex::default(), Mutex::new(false), Condvar::new());
    let source = property(SIZE, 32, AddressMode::Clamp);
    let source = Arc::new(Ordered { source, begun, is_open, opened });
    let texture = textures.add_blocking(source.clone()).unwrap();
    let all = Region::image(0..SIZE[0], 0..SIZE[1]).on_levels(0..=0);
    let _ahead = textures.ahead().prefetch(texture, &all, Urgency::default()).unwrap();
    // Until the loader has them all, in an order in which a page at the end comes late, and one is being
    // read.
    let pages = 32 * 25;
    frames_until(&mut textures, &Feedback::default(), |textures| {
        textures.stats().pager.in_flight >= pages && !source.begun.lock().unwrap().is_empty()
    });
    let late = PagePos::new_2d(0, 31, 24);
    let geometry = &source.description().geometry;
    let first_of_tail = geometry.tail().first_level();
    let in_view: BTreeSet<PagePos> = (0..first_of_tail).map(|level| geometry.ancestor(late, level)).collect();
    let page = PageId::new(texture.number(), Dims::D2, late).unwrap();
    let wanted = Feedback { pages: vec![WantedPage { page, pixels: 64, eighth: 0 }], ..Feedback::default() };
    textures.view_mut(ViewId::MAIN).unwrap().want(wanted.clone());
    textures.update().unwrap();
    *source.is_open.lock().unwrap() = true;
    source.opened.notify_all();
    let is_read = || source.begun.lock().unwrap().contains(&late);
    frames_until(&mut textures, &wanted, |_| is_read() && source.begun.lock().unwrap().len() > 20);
    let begun = source.begun.lock().unwrap();
    // The first was being read already; it may be one of those in view.
    let first = &begun[1..];
    let left = in_view.iter().filter(|pos| begun[0] != **pos).count();
    assert!(first[..left].iter().all(|pos| in_view.contains(pos)), "{begun:?}");
}
