//! What `vastex export` is told.

use std::path::PathBuf;

use clap::ValueEnum;

use super::common::{PrintArgs, ThreadArgs};
use super::{ClapArgs, value_error};

/// What `vastex export` is told.
#[derive(Debug, ClapArgs)]
#[command(after_help = "\
Examples:
  vastex export earth.vastex --layout gaiasky -o earth
  vastex export slide.vastex --layout deepzoom -o slide --format png
  vastex export alps.vastex --layout gaiasky -o alps --tile-size 1024 --finest-level 6 --first-column 67 --first-row 15

The tree that gaiasky and celestia make suits both programs: levelN/tx_COLUMN_ROW.jpg, a .ctx file for Celestia, and for
Gaia Sky a .json file to copy into the object's own. Its levels have 2x1, 4x2, 8x4 .. tiles; an image of another size is
resampled to that, and it is said. Every level is taken from the container, so none is compressed twice.

The output appears when it is whole; after an error or Ctrl-C nothing is left behind.",
mut_arg("threads", |arg| arg.help("Threads that read, filter and encode [default: one for each core]")))]
pub(crate) struct ExportArgs {
    /// The container
    pub(crate) file: PathBuf,
    /// Whose tile directory to make
    #[arg(long, value_enum)]
    pub(crate) layout: LayoutName,
    /// The directory to make; if it exists, it must be empty
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: PathBuf,
    /// Image format of the tiles [default: jpg where texels can be that, else png; prototype: png]
    #[arg(long, value_enum)]
    pub(crate) format: Option<FormatName>,
    /// Quality of JPEG; from 90 on, colour is kept at full resolution
    #[arg(long, default_value_t = 90, value_name = "1..100", value_parser = clap::value_parser!(u8).range(1..=100))]
    pub(crate) quality: u8,
    /// Texels per side of a tile [default: 512; deepzoom: 254]
    #[arg(long, value_name = "TEXELS")]
    pub(crate) tile_size: Option<u32>,
    /// Texels that tiles share with their neighbours; 1 makes Gaia Sky's bordered tiles [default: 0;
    /// deepzoom: 1]
    #[arg(long, value_name = "TEXELS")]
    pub(crate) overlap: Option<u32>,
    /// gaiasky, celestia: number of the finest level [default: the first that holds the image]
    #[arg(long, value_name = "N")]
    pub(crate) finest_level: Option<u32>,
    /// gaiasky, celestia: column of the finest level at which a part of a planet begins
    #[arg(long, value_name = "N")]
    pub(crate) first_column: Option<u32>,
    /// gaiasky, celestia: row of the finest level at which a part of a planet begins
    #[arg(long, value_name = "N")]
    pub(crate) first_row: Option<u32>,
    /// Name of the layer [default: the first]
    #[arg(long, value_name = "NAME")]
    pub(crate) layer: Option<String>,
    #[command(flatten)]
    pub(crate) threads: ThreadArgs,
    #[command(flatten)]
    pub(crate) print: PrintArgs,
}

/// Whose tile directory.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum LayoutName {
    /// Gaia Sky's planet tiles, for Celestia too
    Gaiasky,
    /// Celestia's virtual texture, for Gaia Sky too
    Celestia,
    /// A .dzi file and its tiles
    Deepzoom,
    /// Full pages of 512 texels with borders of 2
    Prototype,
}

/// Image format of tiles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum FormatName {
    /// Exact
    Png,
    /// Small
    Jpg,
}

impl ExportArgs {
    /// A part of a planet needs a level in which its first tile is counted.
    pub(super) fn check(&self) -> Result<(), clap::Error> {
        if self.first_tile().is_some() && self.finest_level.is_none() {
            return Err(value_error(
                "for '--first-column <N>' and '--first-row <N>': tiles are counted in the finest level; add '--finest-level <N>'",
            ));
        }
        Ok(())
    }

    /// Where a part of a planet begins; one of both numbers is enough to make it one.
    pub(crate) fn first_tile(&self) -> Option<[u32; 2]> {
        let first = [self.first_column, self.first_row];
        first.iter().any(Option::is_some).then(|| first.map(Option::unwrap_or_default))
    }
}
