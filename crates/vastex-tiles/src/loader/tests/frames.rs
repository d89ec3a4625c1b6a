//! Without threads, a frame decodes for so long and no longer. Time is what the reads say has passed.

use super::*;
use crate::LocalLoader;

/// A source each of whose tiles takes so long.
struct Costly(PropertySource, Arc<FakeClock>, Duration);

impl TileSource for Costly {
    fn description(&self) -> &Arc<Description> {
        self.0.description()
    }

    fn read(&self, pos: PagePos) -> ReadFuture<'_> {
        Box::pin(async move {
            self.1.pass(self.2);
            self.0.read(pos).await
        })
    }
}

/// The pages of each frame, until nothing is outstanding.
fn frames(budget_ms: u64, tile_ms: u64, suspended: u32) -> Vec<Vec<PageId>> {
    let clock = Arc::new(FakeClock::default());
    let decode_time = Duration::from_millis(budget_ms);
    let settings = LoaderSettings { decode_time, ..LoaderSettings::default() };
    let mut loader = LocalLoader::with(settings, clock.clone()).unwrap();
    let costly = Costly(source(), clock.clone(), Duration::from_millis(tile_ms));
    let suspend = move |_, _| (suspended > 0).then_some(Injection::Suspend(suspended));
    loader.add_source(texture(0), Arc::new(Faults::new(costly, suspend)));
    // The last asked for is the best.
    (0..24).for_each(|x| loader.request(page(x), 100 - u64::from(x)));
    let mut frames = Vec::new();
    while loader.outstanding() > 0 {
        let ended = std::iter::from_fn(|| loader.poll());
        frames.push(ended.map(|end| end.result.map(|_| end.page).unwrap()).collect::<Vec<_>>());
        clock.pass(Duration::from_millis(12));
        assert!(frames.len() < 1000, "{frames:?}");
    }
    frames
}

#[test]
fn a_frame_decodes_for_its_time_and_one_tile_at_least() {
    for (budget, tile, expected) in
        [(10, 3, 4), (10, 5, 2), (10, 10, 1), (10, 1000, 1), (0, 3, 1), (10, 0, 24)]
    {
        let frames = frames(budget, tile, 0);
        let best_first: Vec<_> = (0..24).rev().map(page).collect();
        assert_eq!(frames.concat(), best_first, "in the order of the ranks");
        assert!(frames.iter().all(|frame| frame.len() == expected), "{budget} ms, {tile} ms: {frames:?}");
    }
}

#[test]
fn reads_that_suspend_go_on_in_every_frame() {
    // Eight at once are begun in the first frame and go on in the next, as many as its time allows.
    let frames = frames(10, 3, 1);
    let counts: Vec<_> = frames.iter().map(Vec::len).collect();
    assert_eq!((counts[0], counts.iter().sum::<usize>()), (0, 24));
    assert!(counts.iter().all(|&count| count <= 4) && counts.len() <= 10, "{counts:?}");
}

#[test]
fn a_frame_that_is_left_early_costs_the_next_nothing() {
    let clock = Arc::new(FakeClock::default());
    let mut loader = LocalLoader::with(LoaderSettings::default(), clock.clone()).unwrap();
    loader.add_source(texture(0), Arc::new(Costly(source(), clock, Duration::from_secs(1))));
    (0..5).for_each(|x| loader.request(page(x), 0));
    assert_eq!(std::iter::from_fn(|| loader.wait()).count(), 5);
}
