//! A source with planned faults, for tests of everything that stands before a source.

use std::collections::HashMap;
use std::future::poll_fn;
use std::sync::{Arc, Mutex};
use std::task::Poll;
use std::time::Duration;

use vastex_core::{Description, PagePos};

use crate::ground::hash::seeded;
use crate::ground::sync::{MaybeSend, MaybeSync, lock};
use crate::sources::{ReadError, ReadFuture, SourceKey, TileSource};
use crate::tile::Tile;

/// A planned fault of one read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Injection {
    /// The store fails.
    Fail,
    /// The source has no such tile.
    NoSuchTile,
    /// The tile lacks its last byte, so that it does not decode.
    Corrupt,
    /// Another tile comes instead.
    Replace(Tile),
    /// The read takes so much longer, and blocks its thread. Not for browsers, where nothing may wait.
    Delay(Duration),
    /// The read suspends so many times before it goes on.
    Suspend(u32),
    /// The source panics.
    Panic,
}

/// How often each fault happens, from 0 (never) to 1 (always), for [`Faults::seeded`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FaultRates {
    /// Share of reads that fail.
    pub fail: f64,
    /// Share of reads that give a corrupt tile.
    pub corrupt: f64,
    /// Share of reads that suspend, and how many times each suspends.
    pub suspend: (f64, u32),
    /// Share of reads that are slow, and how much longer each takes.
    pub delay: (f64, Duration),
}

/// A decorator that injects faults and delays into the reads of a source.
///
/// The plan is asked with the page and the number of the attempt at it, counted from 0, so that faults are
/// the same in every run.
pub struct Faults<S, P> {
    source: S,
    plan: P,
    attempts: Mutex<HashMap<PagePos, u32>>,
}

impl<S, P: Fn(PagePos, u32) -> Option<Injection>> Faults<S, P> {
    /// Puts faults before `source`: `plan` says which read goes wrong, and how.
    pub fn new(source: S, plan: P) -> Faults<S, P> {
        Faults { source, plan, attempts: Mutex::default() }
    }

    /// The number of reads begun so far, over all pages.
    pub fn reads(&self) -> u64 {
        lock(&self.attempts).values().copied().map(u64::from).sum()
    }

    fn next_injection(&self, pos: PagePos) -> Option<Injection> {
        let mut attempts = lock(&self.attempts);
        let count = attempts.entry(pos).or_default();
        *count += 1;
        let attempt = *count - 1;
        drop(attempts);
        (self.plan)(pos, attempt)
    }
}

impl<S> Faults<S, ()> {
    /// Puts random faults before `source`, which are the same for the same seed, page and attempt.
    pub fn seeded(
        source: S,
        seed: u64,
        rates: FaultRates,
    ) -> Faults<S, impl Fn(PagePos, u32) -> Option<Injection> + Send + Sync> {
        Faults::new(source, move |pos, attempt| {
            let key = [u32::from(pos.level), pos.x, pos.y, pos.z, attempt].map(u32::to_le_bytes).concat();
            let mut left = seeded(seed, &key) as f64 / u64::MAX as f64;
            let injections = [
                (rates.fail, Injection::Fail),
                (rates.corrupt, Injection::Corrupt),
                (rates.suspend.0, Injection::Suspend(rates.suspend.1)),
                (rates.delay.0, Injection::Delay(rates.delay.1)),
            ];
            injections.into_iter().find_map(|(rate, injection)| {
                left -= rate;
                (left < 0.0).then_some(injection)
            })
        })
    }
}

impl<S, P> TileSource for Faults<S, P>
where
    S: TileSource,
    P: Fn(PagePos, u32) -> Option<Injection> + MaybeSend + MaybeSync,
{
    fn behind(&self) -> Option<&dyn TileSource> {
        Some(&self.source)
    }

    fn description(&self) -> &Arc<Description> {
        self.source.description()
    }

    /// `None`: the tiles are not the source's where the plan changes them.
    fn identity(&self) -> Option<SourceKey> {
        None
    }

    fn read(&self, pos: PagePos) -> ReadFuture<'_> {
        Box::pin(async move {
            match self.next_injection(pos) {
                None => self.source.read(pos).await,
                Some(Injection::Fail) => {
                    let (place, error) = ("fault injection".into(), "a planned failure".into());
                    Err(ReadError::Store { pos, place, error })
                }
                Some(Injection::NoSuchTile) => Err(ReadError::NoSuchTile { pos }),
                Some(Injection::Corrupt) => {
                    let mut tile = self.source.read(pos).await?;
                    tile.bytes.truncate(tile.bytes.len().saturating_sub(1));
                    Ok(tile)
                }
                Some(Injection::Replace(tile)) => Ok(tile),
                Some(Injection::Delay(time)) => {
                    std::thread::sleep(time);
                    self.source.read(pos).await
                }
                Some(Injection::Suspend(times)) => {
                    suspend(times).await;
                    self.source.read(pos).await
                }
                #[allow(clippy::panic, reason = "this is what the plan asks for")]
                Some(Injection::Panic) => panic!("a planned panic"),
            }
        })
    }
}

/// Suspends so many times, waking at once.
async fn suspend(mut times: u32) {
    poll_fn(|context| {
        if times == 0 {
            return Poll::Ready(());
        }
        times -= 1;
        context.waker().wake_by_ref();
        Poll::Pending
    })
    .await;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conformance;
    use crate::sources::PropertySource;
    use pollster::block_on;
    use vastex_core::{Geometry, GeometrySpec};

    fn source() -> PropertySource {
        PropertySource::new(
            Geometry::new(GeometrySpec { page: 20, ..GeometrySpec::image(300, 200) }).unwrap(),
        )
    }

    #[test]
    fn a_plan_without_faults_changes_nothing() {
        assert_eq!(conformance(&Faults::new(source(), |_, _| None)), Ok(()));
        assert_eq!(conformance(&Faults::new(source(), |_, _| Some(Injection::Suspend(3)))), Ok(()));
    }

    #[test]
    fn seeded_faults_come_at_their_rates_and_repeat() {
        let rates = FaultRates { fail: 0.2, corrupt: 0.1, ..FaultRates::default() };
        let outcomes = |seed| {
            let faults = Faults::seeded(source(), seed, rates);
            let pages: Vec<_> = faults.description().geometry.pages().collect();
            let outcomes: Vec<_> = pages.iter().map(|&pos| block_on(faults.read(pos)).ok()).collect();
            assert_eq!(faults.reads(), pages.len() as u64);
            outcomes
        };
        let first = outcomes(1);
        let failed = first.iter().filter(|tile| tile.is_none()).count() as f64 / first.len() as f64;
        assert!((0.1..0.3).contains(&failed), "{failed}");
        assert_eq!(first, outcomes(1));
        assert_ne!(first, outcomes(2));
    }

    #[test]
    fn a_page_that_fails_at_first_recovers() {
        let faults = Faults::new(source(), |_, attempt| (attempt < 2).then_some(Injection::Fail));
        let pos = PagePos::new_2d(0, 3, 3);
        let outcomes = [(); 3].map(|()| block_on(faults.read(pos)).is_ok());
        assert_eq!(outcomes, [false, false, true]);
    }
}
