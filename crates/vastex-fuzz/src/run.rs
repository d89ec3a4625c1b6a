//! The driver without coverage: mutations of seeds, and of inputs that a few mutations made, one after the other.
//!
//! Which inputs there are follows from the seed alone, so that a case that fails is found again by its number.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::{Duration, Instant};

use anyhow::{Result, ensure};

use crate::mutate::mutate;
use crate::rng::Rng;
use crate::targets::Target;

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
    /// Inputs that were read.
    pub cases: u64,
    /// The first input at which the target panicked, and the number of its case.
    pub failed: Option<(u64, Vec<u8>)>,
}

/// Reads damaged inputs until the limit is reached or the target panics. Fails where the seeds are not sound.
pub fn run(target: &Target, seed: u64, limit: Limit) -> Result<Ran> {
    let (seeds, start) = (target.seeds()?, Instant::now());
    for (n, sound) in seeds.iter().enumerate() {
        ensure!(passes(target, sound), "{}: the sound input {n} makes it panic", target.name);
    }
    let mut cases = 0;
    loop {
        let over = match limit {
            Limit::Cases(count) => cases >= count,
            Limit::Time(time) => start.elapsed() >= time,
        };
        if over {
            return Ok(Ran { cases, failed: None });
        }
        let input = input_of(target, &seeds, seed, cases);
        if !passes(target, &input) {
            return Ok(Ran { cases, failed: Some((cases, input)) });
        }
        cases += 1;
    }
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
