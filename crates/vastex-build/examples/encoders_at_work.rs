//! How many encoders are at work at once, as the mean over a build of block-compressed tiles, by threads and
//! pages. The encoder sleeps for as long as a slow one takes, so it needs no processor: what is seen is
//! whether locks, queues or the order of work keep threads waiting, on a machine of any size. `cargo run
//! --release -p vastex-build --features measure --example encoders_at_work -- IMAGE`
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a measurement that is run by hand")]

use std::path::PathBuf;

use vastex_build::measure::encoders_at_work;

/// The share of the threads that must be encoding.
const LEAST_SHARE: f64 = 0.9;

fn main() {
    let image = PathBuf::from(std::env::args().nth(1).unwrap());
    let dir = tempfile::tempdir().unwrap();
    let output = dir.path().join("image.vastex");
    println!("| threads | page 128 | page 256 | page 512 | at least {LEAST_SHARE} of the threads |");
    println!("|---|---|---|---|---|");
    for threads in [2, 4, 8, 16] {
        let mean = |page| encoders_at_work(&image, &output, page, threads).unwrap();
        let means = [128, 256, 512].map(mean);
        let holds = means.iter().all(|mean| *mean >= LEAST_SHARE * threads as f64);
        let [a, b, c] = means;
        let verdict = if holds { "holds" } else { "DOES NOT HOLD" };
        println!("| {threads} | {a:.2} | {b:.2} | {c:.2} | {verdict} |");
    }
}
