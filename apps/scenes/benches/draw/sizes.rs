//! Textures of 2^13 to 2^31 texels per axis, in the same view and the same pool: memory, and the cost of a
//! frame.

use std::fmt::Write as _;
use std::time::Duration;

use anyhow::{Result, bail};
use glam::DVec3;
use vastex::{GeometrySpec, PoolSettings, Settings, TableChoice};
use vastex_scenes::{Pose, Scene};

use crate::stage::Stage;
use crate::world::{Bench, Part, Verdict, picture};

/// Frames within which the view converges.
const PATIENCE_FRAMES: u64 = 400;
/// Times that a frame of each is drawn, in turns.
const ROUNDS: u32 = 15;
/// Log2 of the texels per axis, and the kind of table.
const CASES: [(u32, TableChoice); 8] = [
    (13, TableChoice::Direct),
    (15, TableChoice::Direct),
    (17, TableChoice::Direct),
    (13, TableChoice::Hashed),
    (16, TableChoice::Hashed),
    (20, TableChoice::Hashed),
    (25, TableChoice::Hashed),
    (31, TableChoice::Hashed),
];

/// Of the frame of the first size, that of any other at most, on a GPU.
const ASKED: f64 = 1.1;
/// Of the least GPU memory with hashed tables from 2^16 texels on, the most at most.
const ASKED_MEMORY: f64 = 1.05;

/// A case that has converged, with the bytes that all that is its own takes.
struct Converged<'a> {
    stage: Stage<'a>,
    bytes: u64,
    least: Duration,
}

pub(crate) fn section(bench: &Bench) -> Result<Part> {
    let mut page = String::from(
        "## Sizes\n\nThe same view along a plane of textures of any size, in a pool of 32 MiB, once converged. Asked for on a GPU: the same\n\
         frame cost within 10 % per kind of table; with hashed tables all GPU memory within 5 % from 2^16 on.\n\n\
         | texels per axis | page table | pool MiB | table KiB | all GPU memory MiB | frame ms | of the first of its kind |\n\
         |---|---|---|---|---|---|---|\n",
    );
    let mut cases = CASES
        .iter()
        .map(|&(bits, table)| converged(bench, bits, table))
        .collect::<Result<Vec<Converged<'_>>>>()?;
    for _ in 0..ROUNDS {
        for case in &mut cases {
            case.least = case.least.min(case.stage.draw(false)?);
        }
    }
    let mut dearest: f64 = 0.0;
    for ((bits, table), case) in CASES.iter().zip(&cases) {
        let stats = case.stage.textures.stats();
        let first = CASES.iter().position(|(_, first)| first == table).map_or(case.least, |n| cases[n].least);
        let (mib, kib) = (|bytes: u64| bytes as f64 / f64::from(1 << 20), stats.table_bytes as f64 / 1024.0);
        writeln!(
            page,
            "| 2^{bits} | {} | {:.1} | {kib:.0} | {:.1} | {:.2} | {:.2} |",
            if *table == TableChoice::Direct { "direct" } else { "hashed" },
            mib(stats.pool_bytes),
            mib(case.bytes),
            case.least.as_secs_f64() * 1e3,
            case.least.as_secs_f64() / first.as_secs_f64(),
        )?;
        dearest = dearest.max(case.least.as_secs_f64() / first.as_secs_f64());
    }
    let what = "a frame of the dearest size, of the first of its kind of table";
    let mut verdicts = vec![Verdict::at_most(ASKED, what, dearest)];
    let large =
        CASES.iter().zip(&cases).filter(|((bits, table), _)| *bits >= 16 && *table == TableChoice::Hashed);
    let bytes: Vec<f64> = large.map(|(_, case)| case.bytes as f64).collect();
    let (least, most) = bytes.iter().fold((f64::MAX, 0.0), |(least, most), &n| (n.min(least), n.max(most)));
    if least > 0.0 {
        let what = "GPU memory of the size that takes most with a hashed table, of that which takes least, from 2^16 on";
        verdicts.push(Verdict::at_most(ASKED_MEMORY, what, most / least));
    }
    Ok((page, verdicts))
}

fn converged(bench: &Bench, bits: u32, table: TableChoice) -> Result<Converged<'_>> {
    let before = allocated(bench);
    let settings = Settings { pools: PoolSettings::of_bytes(32 << 20), ..Settings::default() };
    let shape = GeometrySpec::image(1 << bits, 1 << bits);
    let mut stage = Stage::new(bench, picture(&bench.gpu), Scene::Plane, settings, shape, table)?;
    stage.set_pose(&Pose::Plane { eye: DVec3::new(0.1, -0.9, 0.12), yaw: 0.2, pitch: 0.25 });
    for _ in 0..PATIENCE_FRAMES {
        stage.draw(true)?;
        if stage.textures.stats().converged {
            return Ok(Converged { stage, bytes: allocated(bench) - before, least: Duration::MAX });
        }
    }
    bail!("a view of 2^{bits} texels does not converge: {:?}", stage.textures.stats().pager)
}

/// Bytes that the device's allocator has given out, where there is one that says so.
fn allocated(bench: &Bench) -> u64 {
    bench.gpu.device.generate_allocator_report().map_or(0, |report| report.total_allocated_bytes)
}
