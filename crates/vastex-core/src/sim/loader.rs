//! A loader with so many lanes: what waits is begun best rank first, takes a whole number of frames in its
//! lane, arrives as the bandwidth allows, and fails when it is told to. Loads of a texture that is silent
//! never end, and take no lane.

use crate::sim::Random;
use crate::texture::page::{PageId, TextureNumber};

/// Lanes where nothing else is said.
const LANES: usize = 64;
/// What a slow load takes longer.
const SLOWER: u64 = 10;

/// How a load ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Outcome {
    Tile,
    Failure,
    Cancelled,
}

/// Where a load stands among others: by rank, by arrival among equals.
type Turn = (u64, u64);

/// A load that is in a lane.
#[derive(Clone, Copy, Debug)]
struct Running {
    turn: Turn,
    page: PageId,
    due: u64,
    is_cancelled: bool,
}

/// The loads of a simulated world.
#[derive(Clone, Debug)]
pub struct Loads {
    /// Loads that no lane has taken yet.
    waiting: Vec<(Turn, PageId)>,
    running: Vec<Running>,
    /// Loads that were called off before a lane took them.
    called_off: Vec<PageId>,
    /// Loads that never end.
    lost: Vec<PageId>,
    requests: u64,
    random: Random,
    /// Loads that can be under way at once, at least 1.
    pub lanes: usize,
    /// Frames that a load takes in its lane.
    pub latency_frames: u64,
    /// Tiles that can arrive in one frame.
    pub tiles_per_frame: usize,
    /// Share of the pages whose tiles can never be had.
    pub broken: f64,
    /// Share of the loads that fail by chance.
    pub failing: f64,
    /// Share of the loads that take ten times as long.
    pub slow: f64,
    /// Textures whose loads never end from now on.
    pub silent: Vec<TextureNumber>,
}

impl Loads {
    pub(crate) fn new(seed: u64) -> Loads {
        Loads {
            waiting: Vec::new(),
            running: Vec::new(),
            called_off: Vec::new(),
            lost: Vec::new(),
            requests: 0,
            random: Random::new(seed),
            lanes: LANES,
            latency_frames: 1,
            tiles_per_frame: 8,
            broken: 0.0,
            failing: 0.0,
            slow: 0.0,
            silent: Vec::new(),
        }
    }

    /// Returns true if the page's tile can never be had: a property of the page.
    pub(crate) fn is_broken(&self, page: PageId) -> bool {
        Random::new(page.to_bits()).chance(self.broken)
    }

    pub(crate) fn request(&mut self, page: PageId, rank: u64) {
        if self.silent.contains(&page.texture()) {
            return self.lost.push(page);
        }
        self.requests += 1;
        self.waiting.push(((rank, self.requests), page));
    }

    /// What waits has another rank now; what is in a lane stays as it is.
    pub(crate) fn rerank(&mut self, page: PageId, rank: u64) {
        self.waiting.iter_mut().filter(|(_, other)| *other == page).for_each(|(turn, _)| turn.0 = rank);
    }

    /// What waits is let go of; of what is in a lane, see [`Loads::arrivals`].
    pub(crate) fn cancel(&mut self, page: PageId) {
        let before = self.waiting.len();
        self.waiting.retain(|(_, other)| *other != page);
        let was_waiting = self.waiting.len() < before;
        self.called_off.extend(was_waiting.then_some(page));
        self.running
            .iter_mut()
            .filter(|running| running.page == page)
            .for_each(|running| running.is_cancelled = true);
    }

    /// Fills the lanes with the best of what waits; says what was begun.
    pub(crate) fn begin(&mut self, frame: u64) -> Vec<PageId> {
        self.waiting.sort_unstable();
        let free = self.lanes.max(1).saturating_sub(self.running.len());
        let best = self.waiting.drain(..free.min(self.waiting.len()));
        let mut begun = Vec::new();
        for (turn, page) in best {
            let slower = if self.random.chance(self.slow) { SLOWER } else { 1 };
            let due = frame + self.latency_frames * slower;
            self.running.push(Running { turn, page, due, is_cancelled: false });
            begun.push(page);
        }
        begun
    }

    /// The pages that no lane has taken yet.
    pub(crate) fn waiting(&self) -> impl Iterator<Item = PageId> + '_ {
        self.waiting.iter().map(|(_, page)| *page)
    }

    /// How many others come before a page of those that no lane has taken yet.
    pub(crate) fn place(&self, page: PageId) -> Option<usize> {
        let (own, _) = self.waiting.iter().find(|(_, other)| *other == page)?;
        Some(self.waiting.iter().filter(|(turn, _)| turn < own).count())
    }

    pub(crate) fn has(&self, page: PageId) -> bool {
        let running = self.running.iter().map(|running| running.page);
        self.waiting()
            .chain(running)
            .chain(self.called_off.iter().chain(&self.lost).copied())
            .any(|loading| loading == page)
    }

    pub(crate) fn under_way(&self) -> usize {
        self.waiting.len() + self.running.len() + self.called_off.len() + self.lost.len()
    }

    /// What arrives in a frame, best rank first. A load that was cancelled in its lane is let go of at once
    /// or, half the time, was too late to stop.
    pub(crate) fn arrivals(&mut self, frame: u64) -> Vec<(PageId, Outcome)> {
        let mut arrived: Vec<_> = self.called_off.drain(..).map(|page| (page, Outcome::Cancelled)).collect();
        let mut room = self.tiles_per_frame;
        let mut running = std::mem::take(&mut self.running);
        running.sort_unstable_by_key(|running| running.turn);
        for load in running {
            let outcome = if load.is_cancelled && self.random.chance(0.5) {
                Outcome::Cancelled
            } else if load.due > frame || room == 0 {
                self.running.push(load);
                continue;
            } else {
                room -= 1;
                let fails = self.is_broken(load.page) || self.random.chance(self.failing);
                if fails { Outcome::Failure } else { Outcome::Tile }
            };
            arrived.push((load.page, outcome));
        }
        arrived
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn page(n: u64) -> PageId {
        PageId::from_bits(n).unwrap()
    }

    #[test]
    fn the_best_rank_is_begun_first_and_what_is_begun_stays() {
        let mut loads = Loads { lanes: 2, ..Loads::new(1) };
        (0..5).for_each(|n| loads.request(page(n), 10 * (5 - n)));
        assert_eq!(loads.begin(0), [page(4), page(3)]);
        loads.rerank(page(0), 5);
        loads.rerank(page(4), 100);
        assert_eq!((loads.begin(0), loads.under_way()), (vec![], 5));
        assert_eq!(loads.arrivals(1), [(page(4), Outcome::Tile), (page(3), Outcome::Tile)]);
        assert_eq!(loads.begin(1), [page(0), page(2)]);
    }

    #[test]
    fn what_is_cancelled_while_it_waits_takes_no_lane() {
        let mut loads = Loads { lanes: 1, latency_frames: 50, ..Loads::new(1) };
        (0..3).for_each(|n| loads.request(page(n), n));
        loads.begin(0);
        loads.cancel(page(1));
        assert!(loads.has(page(1)));
        assert_eq!(loads.arrivals(0), [(page(1), Outcome::Cancelled)]);
        loads.cancel(page(0));
        let mut frames = 1..;
        let ended = frames.find_map(|frame| loads.arrivals(frame).pop()).unwrap();
        assert_eq!(ended.0, page(0));
        assert_eq!((loads.begin(60), loads.under_way()), (vec![page(2)], 1));
    }
}
