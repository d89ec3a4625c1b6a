//! A pager and the loader's threads together: no page in view waits for one that is not. Decided by the order
//! in which the source is read, one read after the other; time plays no part.

use std::collections::BTreeSet;
use std::ops::Range;
use std::sync::{Arc, Condvar, Mutex, MutexGuard};
use std::time::{Duration, Instant};

use vastex_core::{
    BiasRule, Budgets, Description, Dims, Feedback, Geometry, GeometrySpec, PageId, PagePos, Pager, Region,
    TextureNumber, Urgency, ViewId, WantedPage,
};

use super::FakeClock;
use crate::loader::{LoadError, Loader, LoaderSettings};
use crate::sources::PropertySource;
use crate::sources::{ReadFuture, TileSource};

/// No wait of a test takes longer than this on a machine that works at all.
const PATIENCE: Duration = Duration::from_secs(120);
/// Pages along the sides of what is seen.
const VIEW: u32 = 6;
/// Frames after which the view jumps.
const STAY: u64 = 12;
const FRAMES: u64 = 60;
const READS_PER_FRAME: usize = 5;

/// A source that lets reads end one by one, when it is told to.
struct Turnstile {
    inner: PropertySource,
    state: Mutex<Passing>,
    changed: Condvar,
}

#[derive(Default)]
struct Passing {
    /// Reads in the order in which they began.
    begun: Vec<PagePos>,
    ended: usize,
    permits: usize,
}

impl Turnstile {
    fn new(geometry: Geometry) -> Arc<Turnstile> {
        Arc::new(Turnstile {
            inner: PropertySource::new(geometry),
            state: Mutex::default(),
            changed: Condvar::new(),
        })
    }

    fn wait_until(&self, mut is_so: impl FnMut(&Passing) -> bool) -> MutexGuard<'_, Passing> {
        let waiting = self.state.lock().unwrap();
        let (state, late) =
            self.changed.wait_timeout_while(waiting, PATIENCE, |state| !is_so(state)).unwrap();
        assert!(!late.timed_out(), "{} reads begun, {} ended", state.begun.len(), state.ended);
        state
    }

    fn allow(&self, reads: usize) {
        let mut state = self.state.lock().unwrap();
        state.permits = state.permits.saturating_add(reads);
        self.changed.notify_all();
    }
}

impl TileSource for Turnstile {
    fn description(&self) -> &Arc<Description> {
        self.inner.description()
    }

    fn read(&self, pos: PagePos) -> ReadFuture<'_> {
        self.state.lock().unwrap().begun.push(pos);
        self.changed.notify_all();
        let mut state = self.wait_until(|state| state.permits > 0);
        state.permits -= 1;
        state.ended += 1;
        self.changed.notify_all();
        drop(state);
        self.inner.read(pos)
    }
}

fn texture() -> TextureNumber {
    TextureNumber::new(0).unwrap()
}

fn page(pos: PagePos) -> PageId {
    PageId::new(texture(), Dims::D2, pos).unwrap()
}

/// Which pages of level 0 are seen in a frame: a square that moves on, and jumps to a strip that lies ahead.
fn seen(frame: u64) -> [Range<u32>; 2] {
    let (stay, moved) = (frame / STAY, frame % STAY);
    let [x, y] = [8 + (moved / 2) as u32, 2 + 7 * (stay % 8) as u32];
    [x..x + VIEW, y..y + VIEW]
}

fn feedback(frame: u64, at: u64) -> Feedback {
    let [columns, rows] = seen(at);
    let squares = rows.flat_map(|y| columns.clone().map(move |x| PagePos::new_2d(0, x, y)));
    let mut pages: Vec<_> =
        squares.map(|pos| WantedPage { page: page(pos), pixels: 16, eighth: 0 }).collect();
    pages.sort_unstable();
    Feedback { frame, pages, ..Feedback::default() }
}

struct Run {
    pager: Pager,
    loader: Loader,
    source: Arc<Turnstile>,
    geometry: Geometry,
    threads: usize,
    follows_ranks: bool,
    /// Asked for, and neither begun nor called off.
    waiting: BTreeSet<PageId>,
    /// What is in view, ancestors included.
    in_view: BTreeSet<PageId>,
    /// Reads that were looked at.
    looked_at: usize,
    /// Reads of pages that were not in view, while one that was had to wait.
    out_of_turn: usize,
    reranked: usize,
}

impl Run {
    fn new(threads: usize, follows_ranks: bool) -> Run {
        let geometry = Geometry::new(GeometrySpec { page: 8, ..GeometrySpec::image(512, 512) }).unwrap();
        let source = Turnstile::new(geometry.clone());
        let mut pager = Pager::new(Budgets { upload_bytes_per_frame: 1000, in_flight_bytes: 300 });
        let pool = pager.add_pool(3000, 1, Some(BiasRule::Solved)).unwrap();
        pager.add_texture(pool, &geometry, None, None).unwrap();
        // No time passes for it: reads that are held back here are none that are slow.
        let settings = LoaderSettings { threads, ..LoaderSettings::default() };
        let mut loader = Loader::with(settings, Arc::new(FakeClock::default())).unwrap();
        loader.add_source(texture(), source.clone());
        Run {
            pager,
            loader,
            source,
            geometry,
            threads,
            follows_ranks,
            waiting: BTreeSet::new(),
            in_view: BTreeSet::new(),
            looked_at: 0,
            out_of_turn: 0,
            reranked: 0,
        }
    }

    /// Every thread has a read under way, or there is nothing left to read.
    fn settle(&mut self) {
        let begun = Instant::now();
        loop {
            while let Some(loaded) = self.loader.poll() {
                match loaded.result {
                    Ok(tile) => self.pager.tile_ready(loaded.page, tile),
                    Err(LoadError::Cancelled) => self.pager.tile_cancelled(loaded.page),
                    Err(error) => panic!("{error}"),
                }
            }
            let under_way = {
                let state = self.source.state.lock().unwrap();
                if state.permits == 0 { state.begun.len() - state.ended } else { 0 }
            };
            if under_way == self.threads || under_way > 0 && under_way == self.loader.outstanding() {
                return;
            }
            if self.loader.outstanding() == 0 {
                return;
            }
            assert!(begun.elapsed() < PATIENCE, "{under_way} reads under way");
            std::thread::sleep(Duration::from_micros(100));
        }
    }

    /// What was begun since the last time was not begun before what matters more.
    fn look(&mut self) {
        let begun = self.source.state.lock().unwrap().begun[self.looked_at..].to_vec();
        self.looked_at += begun.len();
        for pos in begun {
            self.waiting.remove(&page(pos));
            let is_ahead = !self.in_view.contains(&page(pos));
            self.out_of_turn += usize::from(is_ahead && !self.waiting.is_disjoint(&self.in_view));
        }
    }

    fn play(&mut self, frame: u64) {
        self.pager.begin_frame(frame);
        let jumps = frame.is_multiple_of(STAY);
        if jumps {
            self.pager.view_cut(ViewId::MAIN, frame);
            self.in_view.clear();
        }
        let now = feedback(frame, frame);
        for wanted in &now.pages {
            let pos = wanted.page.pos(Dims::D2);
            let line =
                (0..self.geometry.tail().first_level()).map(|level| self.geometry.ancestor(pos, level));
            self.in_view.extend(line.map(page));
        }
        self.pager.observe_views(&[now]);
        self.pager.expect(&feedback(frame, frame + 4));
        if frame % STAY == 2 {
            // What the view will see after its next jump, and what it never will.
            let [_, rows] = seen(frame + STAY);
            let part = Region::image(0..512, rows.start * 8..rows.end * 8).on_levels(0..=0);
            self.pager.prefetch(texture(), &part, Urgency::default()).unwrap();
        }
        while let Some(page) = self.pager.poll_cancel() {
            self.loader.cancel(page);
            self.waiting.remove(&page);
        }
        while let Some(request) = self.pager.poll_rerank().filter(|_| self.follows_ranks) {
            self.loader.rerank(request.page, request.rank);
            self.reranked += 1;
        }
        while let Some(request) = self.pager.poll_request() {
            // A thread may begin at once: it is looked at when all have been asked for.
            self.loader.request(request.page, request.rank);
            self.waiting.insert(request.page);
        }
        while self.pager.poll_upload().is_some() {}
    }

    fn run(mut self) -> Run {
        for frame in 1..=FRAMES {
            self.play(frame);
            // Threads that were idle have begun while requests were still coming; that is no fault of
            // anybody's.
            let before = self.out_of_turn;
            self.settle();
            self.look();
            self.out_of_turn = before;
            for _ in 0..READS_PER_FRAME {
                self.source.allow(1);
                self.settle();
                self.look();
            }
        }
        self.source.allow(usize::MAX);
        self
    }
}

#[test]
fn no_page_in_view_waits_for_one_that_is_not() {
    let mut stale = Vec::new();
    for threads in [1, 2, 4] {
        let run = Run::new(threads, true).run();
        assert_eq!(run.out_of_turn, 0, "of {} reads on {threads} threads", run.looked_at);
        assert!(run.reranked > 20 && run.looked_at > 100, "{} of {}", run.reranked, run.looked_at);
        // The same, if the first rank of a page were its last. How many reads are out of turn then depends on
        // how threads take turns.
        stale.push(Run::new(threads, false).run().out_of_turn);
    }
    println!("reads out of turn with the first ranks: {stale:?}");
    assert!(stale.iter().sum::<usize>() > 0, "nothing was tried");
}
