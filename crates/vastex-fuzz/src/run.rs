//! The driver without coverage: mutations of seeds, and of inputs that a few mutations made, one after the
//! other.
//!
//! Which inputs there are follows from the seed alone, so that a case that fails is found again by its
//! number. The cases run on a thread of their own: one that does not come to an end is told from outside, and
//! its thread is left behind.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Result, bail};

use crate::mutate::mutate;
use crate::rng::Rng;
use crate::targets::Target;

/// Longer than any input takes that comes to an end, on any machine; as cargo-fuzz is told.
pub const PATIENCE: Duration = Duration::from_secs(60);

/// How long a run goes on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Limit {
    /// So many cases: the same ones every time.
    Cases(u64),
    /// As many as there is time for.
    Time(Duration),
}

/// What a run did.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Ran {
    /// Inputs that were read to the end.
    pub cases: u64,
    /// The first input that did harm.
    pub failed: Option<Failure>,
}

/// An input that did harm.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Failure {
    /// The number of its case.
    pub case: u64,
    /// Bytes of the input.
    pub input: Vec<u8>,
    /// What the input did.
    pub harm: Harm,
}

/// What an input does that it should not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Harm {
    /// The target panics.
    Panics,
    /// The target does not come to an end.
    Hangs,
}

/// What is read at the moment.
#[derive(Clone, Copy, Debug)]
enum Place {
    /// A sound input.
    Seed(usize),
    Case(u64),
}

/// What is read at the moment, and since when.
type Now = Mutex<(Place, Instant)>;

/// Reads damaged inputs until the limit is reached, the target panics, or one takes longer than `patience`.
/// Fails where the seeds are not sound.
pub fn run(target: &'static Target, seed: u64, limit: Limit, patience: Duration) -> Result<Ran> {
    let seeds = Arc::new(target.seeds()?);
    let now = Arc::new(Mutex::new((Place::Seed(0), Instant::now())));
    let (send, ended) = channel();
    let (of_thread, told) = (seeds.clone(), now.clone());
    thread::Builder::new().name(format!("fuzz-{}", target.name)).spawn(move || {
        // Nobody may be waiting any more.
        let _ = send.send(read_all(target, &of_thread, seed, limit, &told));
    })?;
    loop {
        let (place, since) = *lock(&now);
        match ended.recv_timeout(patience.saturating_sub(since.elapsed())) {
            Ok(ran) => return ran,
            Err(RecvTimeoutError::Disconnected) => bail!("{}: the thread that reads is gone", target.name),
            Err(RecvTimeoutError::Timeout) if since.elapsed() < patience => {}
            // Has it gone on meanwhile?
            Err(RecvTimeoutError::Timeout) if lock(&now).1 != since => {}
            Err(RecvTimeoutError::Timeout) => return hung(target, &seeds, seed, place),
        }
    }
}

fn hung(target: &Target, seeds: &[Vec<u8>], seed: u64, place: Place) -> Result<Ran> {
    match place {
        Place::Seed(n) => bail!("{}: the sound input {n} does not come to an end", target.name),
        Place::Case(case) => {
            let input = input_of(target, seeds, seed, case);
            Ok(Ran { cases: case, failed: Some(Failure { case, input, harm: Harm::Hangs }) })
        }
    }
}

fn read_all(target: &Target, seeds: &[Vec<u8>], seed: u64, limit: Limit, now: &Now) -> Result<Ran> {
    let (start, goes_on_with) = (Instant::now(), |place| *lock(now) = (place, Instant::now()));
    for (n, sound) in seeds.iter().enumerate() {
        goes_on_with(Place::Seed(n));
        if !passes(target, sound) {
            bail!("{}: the sound input {n} makes it panic", target.name);
        }
    }
    for case in 0.. {
        let over = match limit {
            Limit::Cases(count) => case >= count,
            Limit::Time(time) => start.elapsed() >= time,
        };
        if over {
            return Ok(Ran { cases: case, failed: None });
        }
        goes_on_with(Place::Case(case));
        let input = input_of(target, seeds, seed, case);
        if !passes(target, &input) {
            return Ok(Ran { cases: case, failed: Some(Failure { case, input, harm: Harm::Panics }) });
        }
    }
    Ok(Ran { cases: u64::MAX, failed: None })
}

/// The input of a case: a seed, damaged one to three times over.
fn input_of(target: &Target, seeds: &[Vec<u8>], seed: u64, case: u64) -> Vec<u8> {
    let mut rng = Rng::new(seed ^ case.wrapping_mul(0xd134_2543_de82_ef95));
    let mut input = seeds[rng.below(seeds.len())].clone();
    for _ in 0..1 + rng.below(6) / 3 + rng.below(6) / 5 {
        input = mutate(target, &input, rng.next());
    }
    input
}

fn passes(target: &Target, input: &[u8]) -> bool {
    // Nothing of a failed check is used afterwards.
    catch_unwind(AssertUnwindSafe(|| target.check(input))).is_ok()
}

fn lock(now: &Now) -> MutexGuard<'_, (Place, Instant)> {
    now.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::targets::Form;

    const SOUND: &[u8] = b"sound and long enough to be damaged";

    /// A target that does harm by whatever is not its seed.
    const fn target(check: fn(&[u8])) -> Target {
        Target { name: "test", form: Form::File, check, seeds: || Ok(vec![SOUND.to_vec()]) }
    }

    #[test]
    fn an_input_that_never_ends_is_told_like_one_that_panics() {
        static PANICS: Target = target(|bytes| assert_eq!(bytes, SOUND));
        static HANGS: Target = target(|bytes| {
            if bytes != SOUND {
                loop {
                    thread::park();
                }
            }
        });
        let failure = |target, patience| run(target, 1, Limit::Cases(100), patience).ok()?.failed;
        let panics = failure(&PANICS, PATIENCE).unwrap();
        // A busy machine may leave a sound input waiting for longer than the first of these.
        let is_it = |hangs: &Failure| (panics.case, &panics.input) == (hangs.case, &hangs.input);
        let mut patience = [1, 10, 60].map(Duration::from_secs).into_iter();
        let hangs = patience.find_map(|patience| failure(&HANGS, patience).filter(is_it)).unwrap();
        assert_eq!((panics.harm, hangs.harm), (Harm::Panics, Harm::Hangs));
        assert!(hangs.input != SOUND && hangs.input == input_of(&HANGS, &[SOUND.to_vec()], 1, hangs.case));
    }

    #[test]
    fn seeds_that_do_harm_are_an_error() {
        static PANICS: Target = target(|bytes| assert_ne!(bytes, SOUND));
        let error = run(&PANICS, 1, Limit::Cases(1), PATIENCE).unwrap_err().to_string();
        assert!(error.contains("the sound input 0 makes it panic"), "{error}");
    }
}
