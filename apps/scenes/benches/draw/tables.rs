//! What a lookup costs by the kind of page table: direct and filled downward, direct with a loop up the
//! levels in the shader, hashed; with everything wanted resident, and with less and less of it. And what the
//! thread of the frame pays when a direct table grows.

use std::fmt::Write as _;
use std::sync::Arc;
use std::time::Duration;

use anyhow::{Context, Result, ensure};
use vastex::{
    Geometry, Pace, PoolSettings, Region, Settings, TableChoice, TextureSettings, Textures, Urgency,
};
use vastex_core::GeometrySpec;
use vastex_tiles::PropertySource;
use vastex_wgpu::TableKind;

use crate::lookups::{Lookups, PICTURE, TEXELS};
use crate::texts::Own;
use crate::world::{Bench, Part, Verdict, thread_time};

/// Of a direct table's time, that of a hashed one at most where everything wanted is resident.
const ASKED: f64 = 1.3;
/// Pages of the finest level per axis, of a texture whose table grows by that level: 4 Mi entries.
const PAGES: u32 = 1 << 11;
/// Texels of a page's side there.
const PAGE: u32 = 64;
/// Textures to which such a level comes, one after the other.
const ARRIVALS: usize = 9;
/// Frames within which one page of it is in the pool.
const PATIENCE: usize = 500;
/// Milliseconds of the frame's thread that its coming may take.
const ASKED_MS: f64 = 2.0;

pub(crate) fn section(bench: &Bench) -> Result<Part> {
    let lookups = Lookups::new(bench)?;
    let mut page = format!(
        "## Page tables\n\nMilliseconds of {}x{} trilinear samples of a texture of {TEXELS}x{TEXELS} texels, with all pages resident and with none finer than\n\
         a level, as while a view loads; in brackets over the first column. Asked for: hashed at most {ASKED} once converged.\n\n\
         | resident | direct, filled downward | direct, loop in the shader | hashed |\n\
         |---|---|---|---|\n",
        PICTURE[0], PICTURE[1],
    );
    let mut verdicts = Vec::new();
    for finest in [0, 1, 2, 3, 5] {
        let resident = lookups.resident(finest);
        let filled = lookups.table(TableKind::Direct, &resident)?;
        let unfilled = lookups.unfilled(&resident)?;
        let hashed = lookups.table(TableKind::Hashed, &resident)?;
        let taken = lookups.measure(&[
            lookups.case(&filled, None),
            lookups.case(&unfilled, Some(Own::Loop)),
            lookups.case(&hashed, None),
        ]);
        let first = taken[0];
        if finest == 0 {
            let what = "a lookup by a hashed table, of one by a direct table";
            verdicts.push(Verdict::at_most(ASKED, what, taken[2] / first));
        }
        let [_, others @ ..] = taken.map(|ms| format!("{ms:.2} ({:.2})", ms / first));
        let name =
            if finest == 0 { "everything wanted".to_owned() } else { format!("from level {finest} on") };
        writeln!(page, "| {name} | {first:.2} | {} |", others.join(" | "))?;
    }
    let mut arrivals = (0..ARRIVALS).map(|_| arrival(bench)).collect::<Result<Vec<Duration>>>()?;
    arrivals.sort();
    let [least, median, most] = [0, ARRIVALS / 2, ARRIVALS - 1].map(|nth| arrivals[nth].as_secs_f64() * 1e3);
    writeln!(
        page,
        "\nThe update in which a level of {PAGES}x{PAGES} entries comes to a direct table takes {median:.2} ms of the processor time of the frame's \
         thread ({least:.2} to {most:.2} in {ARRIVALS} textures, one after the other): the arena is doubled and the level filled by the \
         adapter. Asked for: at most {ASKED_MS} ms, on this machine's processor, whatever the adapter."
    )?;
    let what = "ms of the frame's thread for the update in which a level of 4 Mi entries comes";
    verdicts.push(Verdict::at_most(ASKED_MS, what, median));
    Ok((page, verdicts))
}

/// Processor time of the update in which the finest level's entries come to the table of a texture that has
/// had none of them.
fn arrival(bench: &Bench) -> Result<Duration> {
    let (device, queue) = (&bench.gpu.device, &bench.gpu.queue);
    let settings = Settings {
        pools: PoolSettings::of_bytes(8 << 20),
        pace: Pace::LockStep { latency_frames: 1 },
        ..Settings::default()
    };
    let mut textures = Textures::new(device, queue, settings)?;
    let spec = GeometrySpec { page: PAGE, ..GeometrySpec::image(PAGES * PAGE, PAGES * PAGE) };
    let source = Arc::new(PropertySource::new(Geometry::new(spec)?));
    let direct = TextureSettings { page_table: TableChoice::Direct, ..TextureSettings::default() };
    let texture = textures.add(textures.preparer().read_blocking(source, direct)?)?;
    // What its other levels take comes first.
    let coarser = Region::image(0..1, 0..1).on_levels(1..=u8::MAX);
    frames_until_there(&mut textures, texture, &coarser, |_, _| Ok(()))?;
    let level = u64::from(PAGES).pow(2) * 4;
    let mut taken = None;
    let finest = Region::image(0..1, 0..1).on_levels(0..=0);
    frames_until_there(&mut textures, texture, &finest, |grown, time| {
        if grown >= level {
            ensure!(taken.is_none(), "the table grew twice by so much");
            taken = Some(time);
        }
        Ok(())
    })?;
    taken.context("the table did not grow by the finest level")
}

/// Frames until a region is in the pool; `look` is told by how many bytes the page tables grew in each, and
/// what it took of this thread.
fn frames_until_there(
    textures: &mut Textures,
    texture: vastex::TextureId,
    region: &Region,
    mut look: impl FnMut(u64, Duration) -> Result<()>,
) -> Result<()> {
    let ticket = textures.ahead().prefetch(texture, region, Urgency::default())?;
    for _ in 0..PATIENCE {
        let before = textures.stats().table_bytes;
        let start = thread_time();
        textures.update()?;
        let time = thread_time().saturating_sub(start);
        look(textures.stats().table_bytes.saturating_sub(before), time)?;
        let progress = ticket.progress();
        if progress.resident == progress.pages {
            return Ok(());
        }
        while textures.poll_event().is_some() {}
    }
    anyhow::bail!("not all pages came: {:?}", ticket.progress())
}
