//! `vastex render`: a scene without a window, its last picture as a PNG file, and figures about the run.

use std::collections::BTreeMap;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Duration;

use anyhow::{Context, Result, bail};
use serde::Serialize;
use vastex::diagnostics::{FrameStats, PoolDump};
use vastex::prefetch::PrefetchSets;
use vastex::{Event, Pace, PageId, PoolId, Settings, Textures, TileSource};
use vastex_core::Dims;
use vastex_scenes::{
    Comparison, Gpu, Offscreen, OffscreenError, Outcome, ReferenceKind, Until, headless_gpu,
};
use vastex_tiles::DiskTier;

use crate::args::{RenderArgs, SceneArgs};
use crate::commands::replay;
use crate::explained::Explained;
use crate::open::Opened;
use crate::output::Output;
use crate::telemetry::StatsExport;
use crate::{disk_cache, gpu, open, report, shortage};

pub(crate) fn run(args: &RenderArgs) -> Result<ExitCode> {
    let source = args.scene.source.display().to_string();
    check_places(args)?;
    let mut outputs = Outputs {
        picture: args.output.as_deref().map(Output::at).transpose()?,
        trace: args.record_trace.as_deref().map(Output::at).transpose()?,
        stats: StatsExport::new(args)?,
    };
    let sets = args.prefetch_sets.as_deref().map(read_sets).transpose()?;
    let Opened { tiles, disk } = open::open(&args.scene)?;
    let over = open::open_over(&args.scene)?;
    let gpu = headless_gpu()?;
    gpu::report_refusals(&gpu);
    let mut offscreen =
        offscreen(args, frame_settings(args)?, &gpu, (tiles, &over)).context(source.clone())?;
    sets.map(|sets| offscreen.prefetch_by(sets)).transpose().context(source.clone())?;
    let outcome = draw(args, &mut offscreen, &mut outputs, disk.as_deref(), gpu.adapter_name());
    let outcome = outcome.context(source.clone())?;
    if args.frames.is_some() || outcome.converged {
        return Ok(ExitCode::SUCCESS);
    }
    let missing = outcome.stats.pager.missing;
    report::say(&format!(
        "error: {source}: not converged, {missing} pages are missing; try a larger --upload-kib-per-frame or fewer \
         --latency-frames"
    ));
    Ok(ExitCode::FAILURE)
}

/// What a scene without a window is set up with.
pub(crate) fn frame_settings(args: &RenderArgs) -> Result<Settings> {
    let pace = match args.realtime {
        true => Pace::Realtime,
        false => Pace::LockStep { latency_frames: args.latency_frames },
    };
    Ok(Settings { pace, fade: Duration::from_millis(args.fade_ms), ..settings(&args.scene)? })
}

/// The scene, set up as the command line says.
pub(crate) fn offscreen(
    args: &RenderArgs,
    settings: Settings,
    gpu: &Gpu,
    (tiles, over): (Arc<dyn TileSource>, &[Arc<dyn TileSource>]),
) -> Result<Offscreen> {
    let (shown, scene, size) = (args.scene.shown(), args.scene.scene(), args.scene.size);
    let mut offscreen = Offscreen::showing_together(&shown, gpu, tiles, over, scene, size, settings)?;
    if let Some(pose) = args.scene.pose(offscreen.image_size()) {
        offscreen.stand_at(pose);
    }
    offscreen.show(args.views)?;
    offscreen.look_ahead(args.predict);
    Ok(offscreen)
}

fn read_sets(file: &std::path::Path) -> Result<PrefetchSets> {
    let sets = replay::read_bytes(file).and_then(|bytes| Ok(PrefetchSets::from_bytes(&bytes)?));
    sets.with_context(|| file.display().to_string())
}

/// Nothing is written over the source, and no two things into one file.
fn check_places(args: &RenderArgs) -> Result<()> {
    let source = args.scene.source.display();
    let named = [
        ("picture", &args.output),
        ("trace", &args.record_trace),
        ("CSV file", &args.stats_csv),
        ("JSON file", &args.stats_json),
    ];
    let places: Vec<_> =
        named.into_iter().filter_map(|(what, place)| Some((what, place.as_deref()?))).collect();
    for (nth, (what, place)) in places.iter().enumerate() {
        for source in std::iter::once(&args.scene.source).chain(&args.scene.layers.over) {
            if is_same_file(place, source) {
                let source = source.display();
                bail!("{source}: is the source as well as the output; choose another name for the output");
            }
        }
        if let Some((other, _)) = places[..nth].iter().find(|(_, other)| other == place) {
            bail!(
                "{source}: the {other} and the {what} would be one file; choose another name for one of them"
            );
        }
    }
    Ok(())
}

/// What is to be written at the end.
struct Outputs {
    picture: Option<Output>,
    trace: Option<Output>,
    stats: StatsExport,
}

/// Plays the path, writes what is to be written, and tells how it went.
fn draw(
    args: &RenderArgs,
    offscreen: &mut Offscreen,
    outputs: &mut Outputs,
    disk: Option<&DiskTier>,
    adapter: String,
) -> Result<Outcome> {
    let shown: Vec<_> = offscreen.textures().inspect().textures().collect();
    let files = std::iter::once(&args.scene.source).chain(&args.scene.layers.over);
    for (texture, file) in shown.into_iter().zip(files) {
        offscreen.textures_mut().texture_mut(texture)?.set_name(file.display().to_string());
    }
    args.estimate.estimating().into_iter().for_each(|estimating| offscreen.estimate(estimating));
    if outputs.trace.is_some() {
        offscreen.textures_mut().trace().record();
    }
    let until = args.frames.map_or(Until::Converged, Until::Frames);
    let mut troubles = Troubles::default();
    let outcome = offscreen.run(args.camera_path, until, |textures, events| {
        outputs.stats.note(textures);
        troubles.note(events);
    })?;
    troubles.say(&args.scene.source.display().to_string(), offscreen.textures());
    if let Some(output) = &outputs.picture {
        let picture = args
            .scene
            .overlay
            .map_or_else(|| Ok(offscreen.picture()), |overlay| offscreen.overlay(overlay))?;
        output.write_picture(&picture)?;
    }
    if let (Some(output), Some(trace)) = (&outputs.trace, offscreen.textures_mut().trace().take()?) {
        output.write(&trace.to_bytes())?;
    }
    outputs.stats.write()?;
    // What is told of the pools is as the last frame left them.
    let pools = args.dump_pools.then(|| offscreen.textures().inspect().pool_usage());
    let explained =
        args.explain.map(|pixel| Ok::<_, OffscreenError>((pixel, offscreen.explain(pixel)?))).transpose()?;
    let compared = if args.compare { Some(offscreen.compare()?) } else { None };
    let mut summary = Summary::new(&outcome, offscreen.share_at_wanted_level()?, adapter, compared);
    summary.disk_cache = disk.map(disk_cache::Summary::new);
    summary.pools = pools;
    summary.explained = explained.map(|(pixel, explained)| Explained::new(pixel, &explained));
    match args.json {
        true => report::print_json(&summary)?,
        false => report::print(&summary.text())?,
    }
    Ok(outcome)
}

/// What every scene is set up with, in a window or without.
pub(crate) fn settings(args: &SceneArgs) -> Result<Settings> {
    let mut settings = Settings {
        picture: args.size,
        upload_bytes_per_frame: args.upload_kib_per_frame << 10,
        filter: args.filter,
        feedback: args.feedback,
        whole_bytes: args.whole_kib << 10,
        share_contents: !args.no_sharing,
        ..Settings::default()
    };
    args.settings.iter().try_for_each(|file| settings.read(file))?;
    if let Some(mib) = args.pool_mib {
        settings.pools.set_bytes(mib << 20);
    }
    args.reading.lay_over(&mut settings);
    Ok(settings)
}

fn is_same_file(a: &std::path::Path, b: &std::path::Path) -> bool {
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}

/// What keeps the picture from being as sharp as it should be.
#[derive(Default)]
struct Troubles {
    /// The pages that failed and have not recovered, and why.
    failed: BTreeMap<PageId, String>,
    /// The newest of each pool that is too small.
    shortages: BTreeMap<PoolId, Event>,
}

impl Troubles {
    fn note(&mut self, events: Vec<Event>) {
        for event in events {
            match event {
                Event::Failed { page, why, .. } => drop(self.failed.insert(page, why)),
                Event::Recovered { page, .. } => drop(self.failed.remove(&page)),
                Event::Oversubscribed { pool, .. } | Event::PoolReduced { pool, .. } => {
                    self.shortages.insert(pool, event);
                }
                _ => {}
            }
        }
    }

    fn say(&self, source: &str, textures: &Textures) {
        for (page, why) in &self.failed {
            let pos = page.pos(Dims::D2);
            let source = report::file_of(textures, *page).unwrap_or(source);
            report::say(&format!("{source}: {pos} failed, a coarser one is shown instead: {why}"));
        }
        // Where the view has come to fit meanwhile, the picture is as it should be.
        let pools = textures.stats().pools;
        let coarse = pools.iter().filter(|pool| pool.pager.bias_eighths > 0);
        for shortage in coarse.filter_map(|pool| shortage::text(self.shortages.get(&pool.pool)?, textures)) {
            report::say(&format!("{source}: {shortage}"));
        }
    }
}

/// What `--json` prints. Scripts rely on these names.
#[derive(Serialize)]
struct Summary {
    converged: bool,
    frames: u64,
    tiles_loaded: u64,
    tiles_evicted: u64,
    /// Loaded again within 60 frames of their eviction.
    tiles_reloaded: u64,
    /// The tiles of the working set at mip bias 0: pages of the same content have one.
    pages_wanted: u32,
    pages_resident: u32,
    /// Those that needed no load, since their content was in a slot already.
    pages_shared: u64,
    pages_failed: u32,
    pixels_degenerate: u32,
    pool_slots: u32,
    pool_occupied: u32,
    pool_bytes: u64,
    bytes_uploaded: u64,
    table_bytes_sent: u64,
    feedback_bytes_read: u64,
    /// Levels.
    mip_bias: f64,
    /// Of the covered pixels, at mip bias 0.
    share_at_wanted_level: f64,
    adapter: String,
    /// Only with `--disk-cache`.
    #[serde(skip_serializing_if = "Option::is_none")]
    disk_cache: Option<disk_cache::Summary>,
    #[serde(flatten)]
    compared: Option<Compared>,
    /// What `--dump-pools` adds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pools: Option<PoolDump>,
    /// What `--explain` adds.
    #[serde(skip_serializing_if = "Option::is_none")]
    explained: Option<Explained>,
}

/// What `--compare` adds.
#[derive(Serialize)]
struct Compared {
    psnr_db: f64,
    /// In steps of 1/255.
    max_error: u8,
    share_within_1_255: f64,
    share_beyond_3_255: f64,
    /// What drew the picture to compare with.
    reference: &'static str,
    /// Levels by which that picture is coarser than what is wanted: the mip bias, which is in force in both.
    reference_mip_bias: f64,
}

impl Summary {
    fn new(
        outcome: &Outcome,
        share_at_wanted_level: f64,
        adapter: String,
        compared: Option<(Comparison, ReferenceKind)>,
    ) -> Summary {
        let FrameStats { frame, pager, pool_bytes, table_bytes_sent, feedback_bytes_read, .. } =
            outcome.stats;
        Summary {
            converged: outcome.converged,
            frames: frame,
            tiles_loaded: pager.loaded,
            tiles_evicted: pager.evicted,
            tiles_reloaded: pager.reloaded,
            pages_wanted: pager.wanted,
            pages_resident: pager.resident,
            pages_shared: pager.shared,
            pages_failed: pager.failed,
            pixels_degenerate: outcome.stats.degenerate_pixels,
            pool_slots: pager.slots,
            pool_occupied: pager.occupied,
            pool_bytes,
            bytes_uploaded: pager.uploaded_bytes,
            table_bytes_sent,
            feedback_bytes_read,
            mip_bias: f64::from(pager.bias_eighths) / 8.0,
            share_at_wanted_level,
            adapter,
            disk_cache: None,
            pools: None,
            explained: None,
            compared: compared.map(|(comparison, reference)| Compared {
                psnr_db: comparison.psnr_db,
                max_error: comparison.max_error,
                share_within_1_255: comparison.share_within_1_255,
                share_beyond_3_255: comparison.share_beyond_3_255,
                reference: match reference {
                    ReferenceKind::Gpu => "gpu",
                    ReferenceKind::Cpu => "cpu",
                },
                reference_mip_bias: f64::from(pager.bias_eighths) / 8.0,
            }),
        }
    }

    fn text(&self) -> String {
        let state = if self.converged { "converged" } else { "not converged" };
        let mut rows = vec![
            format!("{state} after {} frames on {}", self.frames, self.adapter),
            format!(
                "tiles: {} loaded, {} evicted, {} reloaded; pages: {} wanted, {} resident, {} failed",
                self.tiles_loaded,
                self.tiles_evicted,
                self.tiles_reloaded,
                self.pages_wanted,
                self.pages_resident,
                self.pages_failed
            ),
            format!(
                "pool: {} of {} slots occupied, {}; mip bias {}; {} of the pixels at the wanted level",
                self.pool_occupied,
                self.pool_slots,
                report::bytes(self.pool_bytes),
                self.mip_bias,
                report::percent(self.share_at_wanted_level)
            ),
        ];
        rows.extend(self.disk_cache.as_ref().map(disk_cache::Summary::text));
        if let Some(Compared { psnr_db, max_error, share_within_1_255, reference, .. }) = &self.compared {
            let within = report::percent(*share_within_1_255);
            let biased = match self.mip_bias {
                0.0 => String::new(),
                bias => format!(", drawn {bias} levels coarser than wanted as well"),
            };
            rows.push(format!(
                "beside an ordinary texture ({reference}{biased}): {psnr_db:.1} dB, {within} within 1/255, largest error \
                 {max_error}/255"
            ));
        }
        rows.extend(self.pools.as_ref().map(PoolDump::to_string));
        rows.extend(self.explained.as_ref().map(Explained::text));
        rows.join("\n")
    }
}
