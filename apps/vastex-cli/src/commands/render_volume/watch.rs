//! What is told of a run that draws a volume, and kept of it: the trace, figures of every frame, the page
//! about it, what lies in pools, why a pixel shows what it shows, and bricks on a disk.

use std::path::Path;
use std::sync::Arc;

use anyhow::Result;
use serde::Serialize;
use vastex::diagnostics::PoolDump;
use vastex::{LayerId, TextureId, Textures};
use vastex_scenes::Picture;
use vastex_tiles::DiskTier;
use vastex_viewer::stage::StageScene;

use super::Drawing;
use crate::args::RenderVolumeArgs;
use crate::commands::run_report::{self, Run, RunReport};
use crate::disk_cache;
use crate::explained::Explained;
use crate::output::Output;
use crate::places::{Inputs, PICTURE};
use crate::telemetry::StatsExport;

/// What is written at the end of a run, in the making.
pub(super) struct Watch {
    trace: Option<Output>,
    stats: StatsExport,
    report: Option<RunReport>,
    pub(super) disk: Option<Arc<DiskTier>>,
}

/// What is told at the end. Scripts rely on these names.
#[derive(Default, Serialize)]
pub(super) struct Watched {
    /// Only with `--disk-cache`.
    #[serde(skip_serializing_if = "Option::is_none")]
    disk_cache: Option<disk_cache::Summary>,
    /// What `--dump-pools` adds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pool_dump: Option<PoolDump>,
    /// What `--explain` adds.
    #[serde(skip_serializing_if = "Option::is_none")]
    explained: Option<Explained>,
}

impl Watch {
    /// Finds out whether what is asked for can be written, and opens the cache.
    pub(super) fn new(args: &RenderVolumeArgs) -> Result<Watch> {
        let watch = &args.watch;
        let files = &watch.files;
        Ok(Watch {
            trace: files.record_trace.as_deref().map(Output::at).transpose()?,
            stats: StatsExport::new(files.stats_csv.as_deref(), files.stats_json.as_deref())?,
            report: watch.report.as_deref().map(RunReport::at).transpose()?,
            disk: disk_cache::asked(&watch.disk_cache),
        })
    }

    /// The first frame is to come.
    pub(super) fn begin(&self, drawing: &mut Drawing<'_>) {
        if self.disk.is_some() {
            drawing.shown.first().into_iter().for_each(|(_, source)| disk_cache::say_not_kept(source));
        }
        if self.trace.is_some() {
            drawing.textures.ahead().trace().record();
        }
    }

    /// A frame has been played.
    pub(super) fn note(&mut self, textures: &Textures) {
        self.stats.note(textures);
        self.report.iter_mut().for_each(|report| report.note(textures));
    }

    /// Writes what was noted, and tells what is asked for of how the last frame left it.
    pub(super) fn end(&self, args: &RenderVolumeArgs, drawing: &mut Drawing<'_>) -> Result<Watched> {
        if let (Some(output), Some(trace)) = (&self.trace, drawing.textures.ahead().trace().take()?) {
            output.write(&trace.to_bytes())?;
        }
        self.stats.write()?;
        let pool_dump = args.watch.dump_pools.then(|| drawing.textures.inspect().pool_usage());
        let explained = args.watch.explain.map(|pixel| explain(drawing, pixel)).transpose()?;
        let disk_cache = self.disk.as_deref().map(disk_cache::Summary::new);
        Ok(Watched { disk_cache, pool_dump, explained })
    }
}

impl Watch {
    /// Writes the page about the run, where one is asked for. `said` are warnings and the end in words.
    pub(super) fn report(
        &self,
        args: &RenderVolumeArgs,
        (drawing, picture, is_converged): (&Drawing<'_>, &Picture, bool),
        (warnings, said): (Vec<String>, String),
    ) -> Result<()> {
        let Some(report) = &self.report else { return Ok(()) };
        let (textures, source) = (&drawing.textures, &args.source);
        let desc = drawing.renderer.desc();
        let is_one = desc.channels.len() + usize::from(desc.labels.is_some()) <= 1;
        let part = |texture: TextureId| {
            let is_it = |layer: LayerId| layer.texture() == texture && !is_one;
            if desc.labels.as_ref().is_some_and(|labels| is_it(labels.layer)) {
                let labels = args.look.labels.labels.as_deref().unwrap_or_default();
                return Some(("labels", labels.to_string_lossy().into_owned()));
            }
            let nth = desc.channels.iter().position(|channel| is_it(channel.layer))?;
            Some(("channel", drawing.shown.get(nth)?.0.channel.to_string()))
        };
        report.write_run(Run {
            title: source.display().to_string(),
            stats: &textures.stats(),
            is_converged,
            warnings,
            picture,
            overlays: Vec::new(),
            source: run_report::source_rows(textures, source, part),
            settings: settings_rows(args, textures),
            said,
        })
    }
}

/// What the run was set up with.
fn settings_rows(args: &RenderVolumeArgs, textures: &Textures) -> Vec<(String, String)> {
    let (settings, [width, height]) = (textures.inspect().settings(), args.size);
    let words: Vec<String> = std::env::args_os().map(|word| word.to_string_lossy().into_owned()).collect();
    let path = args.path.camera_path.as_ref().map(|path| ("camera path", path.display().to_string()));
    let mut rows = vec![
        ("command", words.join(" ")),
        ("scene", args.on.name().to_owned()),
        ("mode", args.look.mode().name().to_owned()),
        ("picture", format!("{width} x {height} pixels")),
        ("feedback", textures.inspect().feedback_mode().name().to_owned()),
        ("pool", args.pool_mib.map_or_else(|| "as the picture needs".to_owned(), |mib| format!("{mib} MiB"))),
        ("uploads a frame", crate::report::bytes(settings.upload_bytes_per_frame)),
    ];
    rows.extend(path);
    rows.into_iter().map(|(name, value)| (name.to_owned(), value)).collect()
}

impl Watched {
    /// The same for people, each part on lines of its own.
    pub(super) fn text(&self) -> String {
        let parts = [
            self.disk_cache.as_ref().map(disk_cache::Summary::text),
            self.pool_dump.as_ref().map(PoolDump::to_string),
            self.explained.as_ref().map(Explained::text),
        ];
        parts.into_iter().flatten().map(|part| format!("\n{part}")).collect()
    }
}

/// Why a pixel of a slice shows what it shows.
fn explain(drawing: &mut Drawing<'_>, pixel: [u32; 2]) -> Result<Explained> {
    let (renderer, size) = (&drawing.renderer, drawing.canvas.size());
    renderer.place(renderer.camera(), &drawing.gpu.queue, &drawing.textures, &drawing.view, size);
    let sampled = renderer.sampled();
    drawing.textures.pixels().explain(size, pixel, |pass, groups| {
        if let Some(group) = groups.get(sampled) {
            renderer.draw_wanted(renderer.camera(), pass, group);
        }
    })?;
    let explained = drawing.textures.pixels().wait()?.map(|explained| explained.explanations);
    Ok(Explained::new(pixel, &explained.unwrap_or_default()))
}

/// Nothing is written over what is read, and no two things into one file.
pub(super) fn check_places(args: &RenderVolumeArgs) -> Result<()> {
    let [trace, csv, json] = args.watch.files.places();
    // Labels beside the image are called by a name, which need not be that of a file.
    let labels = args.look.labels.labels.as_deref().map(Path::new).filter(|labels| labels.exists());
    let others = args.path.camera_path.iter().chain(&args.paging.settings).map(|file| &**file);
    let inputs = std::iter::once(&*args.source).chain(others).chain(labels);
    let page = args.watch.report.as_deref().map(run_report::page_in);
    Inputs::of(inputs).check(&[
        (PICTURE, args.output.as_deref()),
        trace,
        csv,
        json,
        ("report", page.as_deref()),
    ])
}
