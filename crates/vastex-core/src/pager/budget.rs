//! The upload budget: a token bucket, so that uploads are even and a budget below one tile still gets there.
//! And fair shares: whose turn it is where several pools share a budget, of uploads or of loads; a tie goes
//! to the pool of the lower number.

/// Limits uploaded bytes: over any `n` frames at most `n * budget + max(one tile, 4 * budget)`.
///
/// ```
/// use vastex_core::UploadBucket;
/// let mut bucket = UploadBucket::new(100, 250); // less than half a tile per frame
/// assert!(bucket.take(250) && !bucket.take(250));
/// let waited = (1..10).find(|_| { bucket.begin_frame(); bucket.take(250) });
/// assert_eq!(waited, Some(1)); // 150 were left over, 100 came
/// ```
#[derive(Clone, Copy, Debug)]
pub struct UploadBucket {
    per_frame: u64,
    capacity: u64,
    tokens: u64,
}

impl UploadBucket {
    /// A full bucket for `per_frame` bytes a frame and tiles of at most `tile_bytes`.
    pub fn new(per_frame: u64, tile_bytes: u64) -> UploadBucket {
        let capacity = tile_bytes.max(per_frame.saturating_mul(4));
        UploadBucket { per_frame, capacity, tokens: capacity }
    }

    /// Another number of bytes a frame from the next frame on, for tiles of at most `tile_bytes`. What is
    /// left in the bucket stays, as far as the new bucket holds it.
    pub(crate) fn set_per_frame(&mut self, per_frame: u64, tile_bytes: u64) {
        let tokens = self.tokens;
        *self = UploadBucket::new(per_frame, tile_bytes);
        self.tokens = tokens.min(self.capacity);
    }

    /// Makes room for a tile of so many bytes, where it is larger than those before.
    pub(crate) fn allow_tile(&mut self, tile_bytes: u64) {
        let grown = tile_bytes.saturating_sub(self.capacity);
        (self.capacity, self.tokens) = (self.capacity + grown, self.tokens + grown);
    }

    /// A frame begins: adds the frame's bytes, up to the bucket's capacity.
    pub fn begin_frame(&mut self) {
        self.tokens = self.tokens.saturating_add(self.per_frame).min(self.capacity);
    }

    /// Takes `bytes` if they are there.
    pub fn take(&mut self, bytes: u64) -> bool {
        let enough = self.tokens >= bytes;
        if enough {
            self.tokens -= bytes;
        }
        enough
    }

    /// Bytes that may be uploaded now.
    pub fn available(&self) -> u64 {
        self.tokens
    }
}

/// What one of those that share a budget has to be served.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Demand {
    Nothing,
    /// Something, but others keep it from waiting for its turn.
    HeldBack,
    Waits,
}

/// Whose turn it is where several share one budget: who has had the fewest bytes.
///
/// Among those that wait all the time no two differ by more than the largest amount served at once. Who does
/// not wait saves nothing up, unless others hold it back.
#[derive(Clone, Debug, Default)]
pub(crate) struct FairShare {
    served: Vec<u64>,
}

impl FairShare {
    /// One more to share with.
    pub(crate) fn add(&mut self) {
        self.served.push(self.served.iter().copied().min().unwrap_or(0));
    }

    /// Whose turn it is among those that wait; nobody is held back.
    pub(crate) fn next(&mut self, mut is_waiting: impl FnMut(usize) -> bool) -> Option<usize> {
        self.next_of(0, |who| if is_waiting(who) { Demand::Waits } else { Demand::Nothing })
    }

    /// Whose turn it is among those that wait. Who is held back saves up to `credit` bytes. Asks for each
    /// demand twice.
    pub(crate) fn next_of(
        &mut self,
        credit: u64,
        mut demand_of: impl FnMut(usize) -> Demand,
    ) -> Option<usize> {
        let mut first: Option<usize> = None;
        for who in (0..self.served.len()).filter(|&who| demand_of(who) == Demand::Waits) {
            if first.is_none_or(|first| self.served[who] < self.served[first]) {
                first = Some(who);
            }
        }
        // Raises idle pools to the current minimum, so that they save up no more credit than they may.
        let least = self.served[first?];
        for (who, served) in self.served.iter_mut().enumerate() {
            let saved = if demand_of(who) == Demand::HeldBack { credit } else { 0 };
            *served = (*served).max(least.saturating_sub(saved));
        }
        first
    }

    /// Notes what the one whose turn it was has had.
    pub(crate) fn serve(&mut self, who: usize, bytes: u64) {
        self.served[who] = self.served[who].saturating_add(bytes);
    }
}

/// Frames in a row in which the view had to wait for the in-flight budget, after which bandwidth is short.
const SHORT_AFTER: u32 = 2;
/// Frames in a row in which it had not, after which bandwidth is no longer short.
const SPARE_AFTER: u32 = 8;

/// Whether there is bandwidth for more than the view: not where pages in view wait to be asked for since the
/// in-flight budget is full. It is short soon and spare late, so that a prediction is not drawn in every
/// other frame.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Bandwidth {
    /// In this frame a page in view was left waiting.
    pub(super) view_waits: bool,
    pub(super) is_short: bool,
    /// Frames in a row that were otherwise.
    otherwise: u32,
}

impl Bandwidth {
    pub(crate) fn begin_frame(&mut self) {
        let waited = std::mem::take(&mut self.view_waits);
        self.otherwise = if waited == self.is_short { 0 } else { self.otherwise + 1 };
        if self.otherwise >= if self.is_short { SPARE_AFTER } else { SHORT_AFTER } {
            (self.is_short, self.otherwise) = (waited, 0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn bandwidth_is_short_soon_and_spare_late() {
        let mut bandwidth = Bandwidth::default();
        let mut play = |view_waits: bool| {
            bandwidth.view_waits = view_waits;
            bandwidth.begin_frame();
            bandwidth.is_short
        };
        assert!(!play(true) && !play(false) && !play(true), "a frame alone says nothing");
        assert!(play(true), "two do");
        assert!((1..SPARE_AFTER).all(|_| play(false)) && play(true), "not until it was spare for long");
        assert!((1..SPARE_AFTER).all(|_| play(false)) && !play(false));
    }

    #[test]
    fn another_budget_brings_no_burst_with_it() {
        let mut bucket = UploadBucket::new(1000, 100);
        assert!(bucket.take(3900));
        bucket.set_per_frame(2000, 100);
        assert_eq!(bucket.available(), 100, "what was left");
        bucket.begin_frame();
        assert_eq!(bucket.available(), 2100);
        bucket.set_per_frame(10, 100);
        assert_eq!(bucket.available(), 100, "a tile still gets there");
    }

    #[test]
    fn who_is_held_back_is_served_later_and_who_had_nothing_is_not() {
        for (demand, credit, expected) in
            [(Demand::HeldBack, 1000, 60), (Demand::HeldBack, 20, 20), (Demand::Nothing, 1000, 0)]
        {
            let mut share = FairShare::default();
            (0..2).for_each(|_| share.add());
            for _ in 0..6 {
                let next = share.next_of(credit, |who| if who == 0 { Demand::Waits } else { demand });
                assert_eq!(next, Some(0));
                share.serve(0, 10);
            }
            // The last turn is what it was not told of.
            let _ = share.next_of(credit, |who| if who == 0 { Demand::Waits } else { demand });
            assert_eq!(share.served[0] - share.served[1], expected, "{demand:?}, {credit} bytes of credit");
        }
    }

    proptest! {
        #[test]
        fn those_that_wait_get_the_same(tiles in prop::collection::vec(1u64..1000, 1..8), absent in any::<Vec<(u8, u8)>>()) {
            let mut share = FairShare::default();
            tiles.iter().for_each(|_| share.add());
            // Some come late and go early; the others wait all the time.
            for (turn, &(who, _)) in absent.iter().enumerate() {
                let idle = usize::from(who) % tiles.len();
                if let Some(next) = share.next(|who| who != idle || turn % 3 == 0) {
                    share.serve(next, tiles[next]);
                }
            }
            let mut bytes = vec![0; tiles.len()];
            let behind = |bytes: &[u64]| bytes.iter().max().unwrap() - bytes.iter().min().unwrap();
            for _ in 0..500 {
                let next = share.next(|_| true).unwrap();
                share.serve(next, tiles[next]);
                bytes[next] += tiles[next];
            }
            // What somebody was ahead at first, and the largest tile.
            prop_assert!(behind(&bytes) <= 2 * tiles.iter().max().unwrap(), "{:?} of tiles of {:?}", bytes, tiles);
            prop_assert_eq!(share.next(|_| false), None);
        }
    }
}
