//! `vastex export`: writes a container as the tile directory of another program.

use std::process::ExitCode;
use std::time::Instant;

use anyhow::Result;
use serde::Serialize;
use vastex_build::{ExportError, ExportOptions, Layout, TileFormat};
use vastex_tiles::Container;

use super::build::{Bar, INTERRUPTED, handle_interrupts};
use crate::args::{ExportArgs, FormatName, LayoutName};
use crate::{open, report};

/// As clap has it, for what only the layout or the texture shows to be impossible.
const WRONG_USAGE: u8 = 2;

pub(crate) fn run(args: &ExportArgs) -> Result<ExitCode> {
    handle_interrupts()?;
    let instead = "export a container of its image, or write a region of it with `vastex crop`";
    open::refuse_generated([&*args.file], ("exported", instead))?;
    let container = Container::open_file(&args.file)?;
    let bar = Bar::new(args.print.quiet);
    let begin = Instant::now();
    let exported = vastex_build::export(&container, &args.output, &options(args), &bar);
    bar.0.finish_and_clear();
    let exported = match exported {
        Err(ExportError::Cancelled) => {
            report::say("interrupted; nothing was left behind");
            return Ok(ExitCode::from(INTERRUPTED));
        }
        Err(ExportError::Options(why)) => {
            report::say(&format!("error: {why}"));
            return Ok(ExitCode::from(WRONG_USAGE));
        }
        exported => exported?,
    };
    if !args.print.quiet {
        let file = args.file.display();
        exported.notices.iter().for_each(|notice| report::say(&format!("note: {file}: {notice}")));
    }
    let summary = Summary {
        file: args.file.display().to_string(),
        output: args.output.display().to_string(),
        size: exported.size,
        levels: exported.levels,
        tiles: exported.tiles,
        bytes: exported.bytes,
        format: exported.format.extension(),
        seconds: begin.elapsed().as_secs_f64(),
        notices: exported.notices.iter().map(ToString::to_string).collect(),
    };
    args.print.summary(&summary, Summary::text)?;
    Ok(ExitCode::SUCCESS)
}

fn options(args: &ExportArgs) -> ExportOptions {
    let layout = match args.layout {
        LayoutName::Gaiasky => Layout::GaiaSky,
        LayoutName::Celestia => Layout::Celestia,
        LayoutName::Deepzoom => Layout::DeepZoom,
        LayoutName::Prototype => Layout::Prototype,
    };
    ExportOptions {
        format: args.format.map(|format| match format {
            FormatName::Png => TileFormat::Png,
            FormatName::Jpg => TileFormat::Jpeg,
        }),
        quality: args.quality,
        tile_size: args.tile_size,
        overlap: args.overlap,
        finest_level: args.finest_level,
        first_tile: args.first_tile(),
        layer: args.layer.clone(),
        threads: args.threads.count(),
        ..ExportOptions::new(layout)
    }
}

/// What `--json` prints.
#[derive(Serialize)]
struct Summary {
    file: String,
    output: String,
    /// Width and height of the finest level in texels.
    size: [u32; 2],
    levels: u32,
    tiles: u64,
    /// Of all tiles.
    bytes: u64,
    /// The tiles' file ending.
    format: &'static str,
    seconds: f64,
    notices: Vec<String>,
}

impl Summary {
    fn text(&self) -> String {
        let Summary { output, size: [width, height], levels, tiles, format, seconds, .. } = self;
        let bytes = report::bytes(self.bytes);
        format!(
            "{output}: {width}x{height} texels in {levels} levels; {tiles} tiles of {format}, {bytes} in {seconds:.1} s"
        )
    }
}
