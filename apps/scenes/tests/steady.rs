//! What a frame leaves behind: nothing.
//!
//! In a process of its own, whose memory is nobody else's.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "clippy takes helpers of tests for production code")]

use std::sync::Arc;

use vastex::source::{PlanetImage, PlanetSource};
use vastex::{FeedbackMode, Filter, Pace, PoolSettings, Settings};
use vastex_scenes::{Offscreen, Path, Scene, Until, headless_gpu};

/// Frames before memory is looked at: caches fill, and the view is there.
const FIRST: u64 = 100;
/// Frames over which it may not grow, and by how much for each it may seem to.
const FRAMES: u64 = 200;
const MOST_PER_FRAME: u64 = 32 << 10;

/// Bytes of main memory that the process takes.
fn resident_bytes() -> u64 {
    let statm = std::fs::read_to_string("/proc/self/statm").unwrap();
    let pages: u64 = statm.split(' ').nth(1).unwrap().parse().unwrap();
    pages * 4096
}

#[test]
fn memory_does_not_grow_with_frames() {
    let gpu = headless_gpu().unwrap_or_else(|why| panic!("{why}; `cargo xtask test` installs one"));
    for (bits, feedback) in [
        (12, FeedbackMode::Separate),
        (12, FeedbackMode::Raw),
        (12, FeedbackMode::Inline),
        // With a hashed page table.
        (20, FeedbackMode::Separate),
    ] {
        let image = PlanetImage { size: [2, 1], texels: vec![[90, 140, 70, 255], [40, 60, 160, 255]] };
        let planet = Arc::new(PlanetSource::new(image, bits).unwrap());
        let settings = Settings {
            pools: PoolSettings::of_bytes(8 << 20),
            filter: Filter::Trilinear,
            pace: Pace::LockStep { latency_frames: 1 },
            feedback: Some(feedback),
            ..Settings::default()
        };
        let mut offscreen = Offscreen::new(&gpu, planet, Scene::Plane, [96, 54], settings).unwrap();
        let mut grown_by = |frames| {
            let before = resident_bytes();
            for _ in 0..frames {
                offscreen.run(Path::Still, Until::Frames(1), |_, _| ()).unwrap();
                offscreen.picture();
            }
            resident_bytes().saturating_sub(before)
        };
        grown_by(FIRST);
        let grown = grown_by(FRAMES);
        assert!(
            grown < FRAMES * MOST_PER_FRAME,
            "2^{bits}, {feedback:?}: {} KiB a frame",
            grown / FRAMES / 1024
        );
    }
}
