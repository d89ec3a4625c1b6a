//! `vastex render --report DIR`: a page about a run, with its pictures, what each frame did, settings, the
//! source, and what went wrong.

mod graph;
mod page;

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use vastex::diagnostics::{Cell, FrameStats, PoolDump, PoolRecord};
use vastex::{TextureId, Textures};
use vastex_core::Dims;
use vastex_scenes::{Offscreen, Outcome, Overlay, Picture};
use vastex_viewer::ViewText;

use crate::args::{CameraMotion, RenderArgs};
use crate::output::{Output, encode};
use crate::report;
use graph::{Graph, Line, Unit, number};
use page::Page;

/// Pools that have lines of their own.
const MOST_POOLS: usize = 6;

/// A page in the making.
pub(crate) struct RunReport {
    output: Output,
    /// The records of each frame, those of a frame one after the other.
    records: Vec<PoolRecord>,
}

/// What a page says of a run at its end.
pub(crate) struct Run<'a> {
    /// What was drawn.
    pub(crate) title: String,
    pub(crate) stats: &'a FrameStats,
    pub(crate) is_converged: bool,
    /// What went wrong, and what to do.
    pub(crate) warnings: Vec<String>,
    /// The last picture.
    pub(crate) picture: &'a Picture,
    /// Overlays with their names and what they tell, as PNG.
    pub(crate) overlays: Vec<(String, String, Vec<u8>)>,
    pub(crate) source: Vec<(String, String)>,
    pub(crate) settings: Vec<(String, String)>,
    /// What the program said at the end.
    pub(crate) said: String,
}

impl RunReport {
    /// Makes the directory, and finds out whether the page can be written.
    pub(crate) fn at(directory: &Path) -> Result<RunReport> {
        fs::create_dir_all(directory).with_context(|| {
            format!("{}: this directory cannot be made; choose another place", directory.display())
        })?;
        let page = page_in(directory);
        // First, for a pipe would be waited for.
        let output = Output::at(&page)?;
        let is_another = |found: Vec<u8>| !String::from_utf8_lossy(&found).contains(page::MARK);
        if fs::read(&page).is_ok_and(is_another) {
            bail!("{}: is a page of somebody else; choose another directory", page.display());
        }
        Ok(RunReport { output, records: Vec::new() })
    }

    /// A frame has been played.
    pub(crate) fn note(&mut self, textures: &Textures) {
        self.records.extend(textures.inspect().telemetry().newest().copied());
    }

    /// Writes the page. `warnings` are what the run said, `told` is how it ended in words.
    pub(crate) fn write(
        &self,
        args: &RenderArgs,
        offscreen: &Offscreen,
        warnings: &[String],
        (outcome, told, pools): (&Outcome, &str, Option<&PoolDump>),
    ) -> Result<()> {
        let overlays = [
            (Overlay::Levels, "which level each pixel shows: the finest red, coarser ones towards blue"),
            (Overlay::Deficit, "how many levels what is shown falls short of what is wanted"),
            (Overlay::Pages, "the borders of the pages that the picture is put together from"),
            (Overlay::Atlas, "the slots of the pool, with the tiles that lie in them"),
        ];
        let mut drawn = Vec::new();
        for (overlay, about) in overlays {
            // Some have nothing to show, of several layers for instance.
            if let Ok(picture) = offscreen.overlay(overlay) {
                drawn.push((overlay.name().to_owned(), about.to_owned(), encode(&picture)?));
            }
        }
        let mut warnings = warnings.to_vec();
        if !outcome.converged {
            let missing = outcome.stats.pager.missing;
            warnings.push(format!(
                "The last picture is not all there: {missing} pages in view are missing. More --frames, or a larger --upload-kib-per-frame, lets them come."
            ));
        }
        let textures = offscreen.textures();
        self.write_run(Run {
            title: args.scene.source.display().to_string(),
            stats: &outcome.stats,
            is_converged: outcome.converged,
            warnings,
            picture: &offscreen.picture(),
            overlays: drawn,
            source: source_rows(textures, &args.scene.source, |_| None),
            settings: settings_rows(args, offscreen),
            said: pools.map_or_else(|| told.to_owned(), |pools| format!("{told}\n\n{pools}")),
        })
    }

    /// Writes the page of a run.
    pub(crate) fn write_run(&self, run: Run<'_>) -> Result<()> {
        let stats = run.stats;
        let chip = |name: &str, value: String| (name.to_owned(), value);
        let count = |value: u64| number(Unit::Count, value as f64);
        let page = Page {
            title: run.title,
            chips: vec![
                chip("frames", count(stats.frame)),
                chip("all there", if run.is_converged { "yes".into() } else { "no".into() }),
                chip("tiles loaded", count(stats.pager.loaded)),
                chip("tiles evicted", count(stats.pager.evicted)),
                chip("bytes uploaded", report::bytes(stats.pager.uploaded_bytes)),
                chip("GPU memory of pools", report::bytes(stats.pool_bytes)),
                chip("mip bias", number(Unit::Levels, f64::from(stats.pager.bias_eighths) / 8.0)),
            ],
            warnings: run.warnings,
            picture: encode(run.picture)?,
            graphs: self.graphs().iter().map(Graph::html).collect(),
            overlays: run.overlays,
            tables: vec![("The source".into(), run.source), ("Settings".into(), run.settings)],
            said: run.said,
        };
        self.output.write(page.html().as_bytes())
    }

    fn graphs(&self) -> Vec<Graph> {
        let line = |name: &str, column: &str| Line { name: name.into(), values: self.summed(column) };
        let graph = |title: &str, about, unit, lines| Graph { title: title.into(), about, unit, lines };
        let pools = self.pools();
        let of_each = |column: &str| -> Vec<Line> {
            let pool = |&pool: &u64| {
                let name = if pools.len() == 1 { column.replace('_', " ") } else { format!("pool {pool}") };
                Line { name, values: self.of_pool(pool, column) }
            };
            pools.iter().take(MOST_POOLS).map(pool).collect()
        };
        let slots = |pool: &u64| {
            let title =
                if pools.len() == 1 { "Slots of the pool".into() } else { format!("Slots of pool {pool}") };
            let of = |name: &str, column| Line { name: name.into(), values: self.of_pool(*pool, column) };
            let lines = vec![
                of("all", "slots"),
                of("occupied", "occupied"),
                of("wanted", "wanted_at_bias"),
                of("locked", "locked"),
            ];
            Graph {
                title,
                about: "all there are, with a tile in them, needed by the view, and not free to go",
                unit: Unit::Count,
                lines,
            }
        };
        let mut graphs = vec![
            graph(
                "Loads",
                "pages asked for, uploaded and evicted in each frame",
                Unit::Count,
                vec![
                    line("asked for", "requests"),
                    line("uploaded", "uploads"),
                    line("evicted", "evictions"),
                ],
            ),
            graph(
                "Missing",
                "pages in view that are not there yet",
                Unit::Count,
                vec![line("missing", "missing")],
            ),
            graph(
                "In flight",
                "bytes of tiles that are being read, or wait to be uploaded",
                Unit::Bytes,
                vec![line("in flight", "in_flight_bytes")],
            ),
            graph(
                "Uploads",
                "bytes copied to the GPU in each frame",
                Unit::Bytes,
                vec![line("uploaded", "upload_bytes")],
            ),
            graph(
                "Share at the wanted level",
                "of the pixels of the view",
                Unit::Share,
                of_each("share_at_wanted"),
            ),
            graph(
                "Mip bias",
                "levels that the view is coarser so that it fits",
                Unit::Levels,
                of_each("bias"),
            ),
        ];
        graphs.extend(pools.iter().take(MOST_POOLS).map(slots));
        graphs
    }

    /// The numbers of all pools, in their order.
    fn pools(&self) -> Vec<u64> {
        let mut pools: Vec<u64> = self.records.iter().map(pool_of).collect();
        pools.sort_unstable();
        pools.dedup();
        pools
    }

    /// What a column has of a pool, for each frame in which the pool was there.
    fn of_pool(&self, pool: u64, column: &str) -> Vec<Option<f64>> {
        let of_it = self.records.iter().filter(|record| pool_of(record) == pool);
        of_it.map(|record| cell(record, column)).collect()
    }

    /// The sum over all pools, for each frame.
    fn summed(&self, column: &str) -> Vec<Option<f64>> {
        let frames = self.records.chunk_by(|a, b| a.pager.frame == b.pager.frame);
        frames
            .map(|records| records.iter().filter_map(|record| cell(record, column)).reduce(|a, b| a + b))
            .collect()
    }
}

/// Where the page of a directory lies.
pub(crate) fn page_in(directory: &Path) -> PathBuf {
    directory.join("index.html")
}

fn pool_of(record: &PoolRecord) -> u64 {
    record.pager.pool.number().into()
}

fn cell(record: &PoolRecord, column: &str) -> Option<f64> {
    match record.columns().find(|(name, _)| *name == column)?.1 {
        Cell::Count(count) => Some(count as f64),
        Cell::Real(number) => Some(number),
        Cell::Empty => None,
    }
}

/// What is known of a source, of which there are these textures. `part` says of one which part of a volume
/// it is, and its name, where there are several.
pub(crate) fn source_rows(
    textures: &Textures,
    source: &Path,
    part: impl Fn(TextureId) -> Option<(&'static str, String)>,
) -> Vec<(String, String)> {
    let mut rows = Vec::new();
    let mut row = |name: &str, value: String| rows.push((name.to_owned(), value));
    for (n, texture) in textures.inspect().textures().enumerate() {
        let Ok(shown) = textures.texture(texture) else { continue };
        let described = shown.description();
        let geometry = &described.geometry;
        let [width, height, depth] = geometry.size();
        match part(texture) {
            Some((kind, name)) => row(kind, name),
            None if n > 0 => row("over it", shown.name().unwrap_or_default().to_owned()),
            None => {}
        }
        match geometry.dims() {
            Dims::D2 => row("texels", format!("{width} x {height}")),
            Dims::D3 => row("voxels", format!("{width} x {height} x {depth}")),
        }
        row("levels", geometry.levels().len().to_string());
        let layers = described.layers.iter().map(|layer| format!("{} ({})", layer.name, layer.format.name()));
        row("layers", layers.collect::<Vec<_>>().join(", "));
        row(
            "pages",
            format!(
                "{} of {} texels with {} of border",
                geometry.page_count(),
                geometry.page()[0],
                geometry.border()[0]
            ),
        );
        row("bytes of a tile", report::bytes(described.tile_bytes() as u64));
    }
    if let Ok(file) = fs::metadata(source)
        && file.is_file()
    {
        row("bytes of the file", report::bytes(file.len()));
    }
    rows
}

/// What the run was set up with.
fn settings_rows(args: &RenderArgs, offscreen: &Offscreen) -> Vec<(String, String)> {
    let settings = offscreen.textures().inspect().settings();
    let scene = &args.scene;
    let [width, height] = scene.size();
    let camera = match &args.camera_path {
        CameraMotion::BuiltIn(path) => path.name().to_owned(),
        CameraMotion::File(file) => file.display().to_string(),
    };
    let (shown, of) = (scene.shown(), offscreen.renderer().scene());
    let count = offscreen.textures().inspect().textures().count();
    let view = ViewText::of(offscreen.pose(), of, &shown, scene.overlay(), count);
    let view = view.to_text(offscreen.image_size());
    let words: Vec<String> = std::env::args_os().map(|word| word.to_string_lossy().into_owned()).collect();
    [
        ("command", words.join(" ")),
        ("scene", offscreen.renderer().scene().name().to_owned()),
        ("picture", format!("{width} x {height} pixels")),
        ("camera path", camera),
        ("last view", view),
        ("filter", scene.filter().to_string()),
        ("feedback", offscreen.textures().inspect().feedback_mode().name().to_owned()),
        (
            "pool",
            scene.pool_mib.map_or_else(|| "as the picture needs".to_owned(), |mib| format!("{mib} MiB")),
        ),
        ("uploads a frame", report::bytes(settings.upload_bytes_per_frame)),
        (
            "frames that a load takes",
            if args.realtime { "as long as it takes".into() } else { args.latency_frames.to_string() },
        ),
    ]
    .map(|(name, value)| (name.to_owned(), value))
    .into()
}
