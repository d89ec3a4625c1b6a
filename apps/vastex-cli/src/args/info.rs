//! What `vastex info` is told.

use std::path::PathBuf;

use super::{CacheArgs, ClapArgs, OriginsArgs, parse_size};

/// What `vastex info` is told.
#[derive(Debug, ClapArgs)]
#[command(after_help = "\
Examples:
  vastex info earth.vastex
  vastex info earth.vastex --json | jq .tiles
  vastex info earth.vastex --estimate 1920x1080
  vastex info slide.svs                       # levels, label and macro image, size of a texel, magnification
  vastex info earth.jpg                       # what an image's header says
  vastex info cells.zarr --json | jq .oddities   # of a volume: levels, channels, times, and what was wrong (docs/volumes.md)")]
pub(crate) struct InfoArgs {
    /// The container, a TIFF pyramid, an image, a volume, a tile directory, or planet:BITS[:IMAGE]
    pub(crate) file: PathBuf,
    /// Say how large a pool a picture of this size needs, and how that follows
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    pub(crate) estimate: Option<[u32; 2]>,
    /// Of a volume, count absent bricks, though that may list 67 million files of a level, or read a million
    /// indices of shards
    #[arg(long)]
    pub(crate) count: bool,
    /// Print one JSON object
    #[arg(long)]
    pub(crate) json: bool,
    #[command(flatten)]
    pub(crate) cache: CacheArgs,
    #[command(flatten)]
    pub(crate) origins: OriginsArgs,
}
