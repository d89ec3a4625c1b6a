//! `vastex render`: a scene without a window, its last picture or all of a path, and figures about the run.

mod in_parts;
mod troubles;

use std::process::ExitCode;
use std::time::Duration;

use anyhow::{Context, Result};
use serde::Serialize;
use vastex::diagnostics::{FrameStats, PoolDump};
use vastex::prefetch::PrefetchSets;
use vastex::{Event, Pace, Settings, Textures};
use vastex_scenes::{
    Comparison, Gpu, Offscreen, OffscreenError, Outcome, Path as CameraPath, Picture, Pose, ReferenceKind,
    Scene, SceneImage, Until, headless_gpu,
};
use vastex_tiles::DiskTier;
use vastex_viewer::CameraPath as WrittenPath;

use crate::args::{CameraMotion, RenderArgs, SceneArgs};
use crate::commands::compared::Compared;
use crate::commands::replay;
use crate::commands::run_report::{self, RunReport};
use crate::explained::Explained;
use crate::open::Opened;
use crate::output::Output;
use crate::pictures::PictureOutput;
use crate::places::{Inputs, PICTURE};
use crate::telemetry::StatsExport;
use crate::{disk_cache, gpu, open, report};
pub(crate) use troubles::Troubles;

pub(crate) fn run(args: &RenderArgs) -> Result<ExitCode> {
    let source = args.scene.source.display().to_string();
    args.scene.check_of_image()?;
    check_places(args)?;
    let mut outputs = Outputs {
        pictures: PictureOutput::new(args)?,
        report: args.report.as_deref().map(RunReport::at).transpose()?,
        trace: args.files.record_trace.as_deref().map(Output::at).transpose()?,
        stats: StatsExport::new(args.files.stats_csv.as_deref(), args.files.stats_json.as_deref())?,
    };
    let sets = args.prefetch_sets.as_deref().map(read_sets).transpose()?;
    let Opened { image, disk } = open::open(&args.scene)?;
    let over = open::open_over(&args.scene)?;
    let motion = motion(args, image.size)?;
    let images = (image, &*over);
    let gpu = headless_gpu()?;
    gpu::report_refusals(&gpu);
    let scene = motion.scene(args.scene.scene());
    if let Some(most) = in_parts::most_side(args, &gpu) {
        let pictures = &mut outputs.pictures;
        let drawn = in_parts::run(args, (&motion, scene), &gpu, images, (pictures, most));
        return Ok(exit_code(args, &drawn.context(source.clone())?));
    }
    let mut offscreen =
        offscreen_on(scene, args, frame_settings(args)?, &gpu, images).context(source.clone())?;
    sets.map(|sets| offscreen.prefetch_by(sets)).transpose().context(source.clone())?;
    let outcome = draw(args, &motion, &mut offscreen, &mut outputs, (disk.as_deref(), gpu.adapter_name()));
    let outcome = outcome.context(source.clone())?;
    Ok(exit_code(args, &outcome))
}

/// How the program ends after a run. What is missing is said.
fn exit_code(args: &RenderArgs, outcome: &Outcome) -> ExitCode {
    if args.frames.is_some() || outcome.converged {
        return ExitCode::SUCCESS;
    }
    let (source, missing) = (args.scene.source.display(), outcome.stats.pager.missing);
    report::say(&format!(
        "error: {source}: not converged, {missing} pages are missing; try a larger --upload-kib-per-frame or fewer \
         --latency-frames"
    ));
    ExitCode::FAILURE
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
#[cfg(feature = "record")]
pub(crate) fn offscreen(
    args: &RenderArgs,
    settings: Settings,
    gpu: &Gpu,
    images: (SceneImage, &[SceneImage]),
) -> Result<Offscreen> {
    offscreen_on(args.scene.scene(), args, settings, gpu, images)
}

fn offscreen_on(
    scene: Scene,
    args: &RenderArgs,
    settings: Settings,
    gpu: &Gpu,
    images: (SceneImage, &[SceneImage]),
) -> Result<Offscreen> {
    let (shown, size) = (open::shown(&args.scene), args.scene.size());
    let mut offscreen = Offscreen::showing_together(&shown, gpu, images, scene, size, settings)?;
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

/// Nothing is written over what is read, and no two things into one file.
fn check_places(args: &RenderArgs) -> Result<()> {
    let path = match &args.camera_path {
        CameraMotion::File(file) => Some(&**file),
        CameraMotion::BuiltIn(_) => None,
    };
    let others = path.into_iter().chain(args.prefetch_sets.as_deref());
    let others = others.chain(args.scene.settings.iter().map(|file| &**file));
    let sources = std::iter::once(&*args.scene.source).chain(args.scene.files_over());
    let page = args.report.as_deref().map(run_report::page_in);
    let [trace, csv, json] = args.files.places();
    Inputs::of(sources.chain(others)).check(&[
        (PICTURE, args.output.as_deref()),
        trace,
        csv,
        json,
        ("report", page.as_deref()),
    ])
}

/// What is to be written at the end.
struct Outputs {
    pictures: PictureOutput,
    report: Option<RunReport>,
    trace: Option<Output>,
    stats: StatsExport,
}

/// How the camera moves, over an image that is open.
enum Motion {
    BuiltIn(CameraPath),
    Written(WrittenPath),
}

impl Motion {
    /// The scene that it is in, where `asked` is asked for.
    fn scene(&self, asked: Scene) -> Scene {
        match self {
            Motion::BuiltIn(_) => asked,
            Motion::Written(path) => path.pose(0.0).scene(asked),
        }
    }

    /// Where the camera is in each frame of a scene.
    fn poses<'a>(&'a self, args: &RenderArgs, offscreen: &Offscreen) -> impl Fn(u64) -> Pose + use<'a> {
        let (scene, image) = (offscreen.renderer().scene(), offscreen.renderer().image_aspect());
        let still = args.scene.pose(offscreen.image_size());
        move |frame| match self {
            Motion::BuiltIn(CameraPath::Still) => still.unwrap_or_else(|| Pose::first(scene)),
            Motion::BuiltIn(path) => path.pose(scene, image, frame),
            Motion::Written(path) => path.pose_of_frame(frame),
        }
    }

    fn frames(&self) -> u64 {
        match self {
            Motion::BuiltIn(path) => path.frames(),
            Motion::Written(path) => path.frames(),
        }
    }
}

/// Reads the path of the camera.
fn motion(args: &RenderArgs, image: [u32; 2]) -> Result<Motion> {
    let file = match &args.camera_path {
        CameraMotion::BuiltIn(path) => return Ok(Motion::BuiltIn(*path)),
        CameraMotion::File(file) => file,
    };
    let path = file_text(file).and_then(|text| Ok(WrittenPath::from_text(&text, image)?));
    Ok(Motion::Written(path.with_context(|| file.display().to_string())?))
}

fn file_text(file: &std::path::Path) -> Result<String> {
    String::from_utf8(replay::read_bytes(file)?).context("this is no text, and so no camera path")
}

/// Plays the path, writes what is to be written, and tells how it went.
fn draw(
    args: &RenderArgs,
    motion: &Motion,
    offscreen: &mut Offscreen,
    outputs: &mut Outputs,
    (disk, adapter): (Option<&DiskTier>, String),
) -> Result<Outcome> {
    name_textures(args, offscreen)?;
    args.estimate.estimating().into_iter().for_each(|estimating| offscreen.estimate(estimating));
    if outputs.trace.is_some() {
        offscreen.textures_mut().ahead().trace().record();
    }
    let mut troubles = Troubles::default();
    let Outputs { pictures, report, trace, stats } = outputs;
    let watch = |textures: &Textures, events| {
        stats.note(textures);
        report.iter_mut().for_each(|report| report.note(textures));
        troubles.note(events);
    };
    let outcome = match pictures.is_sequence() {
        true => draw_sequence(args, motion, offscreen, pictures, watch)?,
        false => play(args, motion, offscreen, watch)?,
    };
    let source = args.scene.source.display().to_string();
    let said = troubles.texts(&source, offscreen.textures());
    said.iter().for_each(|said| report::say(said));
    pictures.write_last(|| picture_of(args, offscreen))?;
    if let (Some(output), Some(trace)) = (trace, offscreen.textures_mut().ahead().trace().take()?) {
        output.write(&trace.to_bytes())?;
    }
    stats.write()?;
    // What is told of the pools is as the last frame left them.
    let usage = (args.dump_pools || report.is_some()).then(|| offscreen.textures().inspect().pool_usage());
    let explained =
        args.explain.map(|pixel| Ok::<_, OffscreenError>((pixel, offscreen.explain(pixel)?))).transpose()?;
    let compared = if args.compare { Some(offscreen.compare()?) } else { None };
    let mut summary = Summary::new(&outcome, offscreen.share_at_wanted_level()?, adapter, compared);
    summary.disk_cache = disk.map(disk_cache::Summary::new);
    summary.explained = explained.map(|(pixel, explained)| Explained::new(pixel, &explained));
    if let Some(report) = report {
        let told = summary.text();
        report.write(args, offscreen, &said, (&outcome, &told, usage.as_ref()))?;
    }
    summary.pools = usage.filter(|_| args.dump_pools);
    print_summary(args, &summary)?;
    Ok(outcome)
}

/// Gives textures the names of their files.
fn name_textures(args: &RenderArgs, offscreen: &mut Offscreen) -> Result<()> {
    let shown: Vec<_> = offscreen.textures().inspect().textures().collect();
    let files = std::iter::once(&*args.scene.source).chain(args.scene.files_over());
    for (texture, file) in shown.into_iter().zip(files) {
        offscreen.textures_mut().texture_mut(texture)?.set_name(file.display().to_string());
    }
    Ok(())
}

/// Prints how a run went.
fn print_summary(args: &RenderArgs, summary: &Summary) -> Result<()> {
    match args.json {
        true => report::print_json(summary),
        // Pictures go there.
        false if args.output.as_deref().is_some_and(|output| output.as_os_str() == "-") => {
            report::say(&summary.text());
            Ok(())
        }
        false => report::print(&summary.text()),
    }
}

/// Plays the path to its end, or so many frames as are asked for.
fn play(
    args: &RenderArgs,
    motion: &Motion,
    offscreen: &mut Offscreen,
    watch: impl FnMut(&Textures, Vec<Event>),
) -> Result<Outcome> {
    let until = args.frames.map_or(Until::Converged, Until::Frames);
    Ok(match motion {
        Motion::BuiltIn(path) => offscreen.run(*path, until, watch)?,
        Motion::Written(path) => {
            offscreen.run_along(path.frames(), |frame| path.pose_of_frame(frame), until, watch)?
        }
    })
}

/// Draws every picture of the path, or so many as are asked for, each once everything in view is loaded.
fn draw_sequence(
    args: &RenderArgs,
    motion: &Motion,
    offscreen: &mut Offscreen,
    pictures: &mut PictureOutput,
    mut watch: impl FnMut(&Textures, Vec<Event>),
) -> Result<Outcome> {
    let pose = motion.poses(args, offscreen);
    let mut converged = true;
    let mut number = 0;
    loop {
        let outcome = offscreen.run_along(1, |_| pose(number), Until::Converged, &mut watch)?;
        converged &= outcome.converged;
        let is_read = pictures.write_frame(number, &picture_of(args, offscreen)?)?;
        number += 1;
        if is_read.is_break() || number >= args.frames.unwrap_or(motion.frames()) {
            return Ok(Outcome { converged, ..outcome });
        }
    }
}

/// The picture of the last frame, or its overlay.
fn picture_of(args: &RenderArgs, offscreen: &Offscreen) -> Result<Picture> {
    Ok(match args.scene.overlay() {
        None => offscreen.picture(),
        Some(overlay) => offscreen.overlay(overlay)?,
    })
}

/// What every scene is set up with, in a window or without.
pub(crate) fn settings(args: &SceneArgs) -> Result<Settings> {
    let usual = Settings::default();
    let mut settings = Settings {
        picture: args.size(),
        upload_bytes_per_frame: args
            .upload_kib_per_frame
            .map_or(usual.upload_bytes_per_frame, |kib| kib << 10),
        filter: args.filter(),
        feedback: args.feedback,
        whole_bytes: args.whole_kib << 10,
        share_contents: !args.no_sharing,
        ..usual
    };
    args.settings.iter().try_for_each(|file| settings.read(file))?;
    if let Some(mib) = args.pool_mib {
        settings.pools.set_bytes(mib << 20);
    }
    args.reading.lay_over(&mut settings);
    Ok(settings)
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
    /// Parts that were drawn, where the picture was drawn in parts: what is wanted is that of all of them
    /// together, the mip bias and what is resident the most of any.
    #[serde(skip_serializing_if = "Option::is_none")]
    parts: Option<u32>,
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
            parts: None,
            disk_cache: None,
            pools: None,
            explained: None,
            compared: compared.map(|(comparison, reference)| {
                let reference = match reference {
                    ReferenceKind::Gpu => "gpu",
                    ReferenceKind::Cpu => "cpu",
                };
                Compared::new(&comparison, reference, f64::from(pager.bias_eighths) / 8.0)
            }),
        }
    }

    fn text(&self) -> String {
        let state = if self.converged { "converged" } else { "not converged" };
        let parts = self.parts.map_or_else(String::new, |parts| format!(", in {parts} parts"));
        let mut rows = vec![
            format!("{state} after {} frames on {}{parts}", self.frames, self.adapter),
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
        rows.extend(self.compared.as_ref().map(Compared::text));
        rows.extend(self.pools.as_ref().map(PoolDump::to_string));
        rows.extend(self.explained.as_ref().map(Explained::text));
        rows.join("\n")
    }
}
