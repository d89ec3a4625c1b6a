//! What `vastex merge` is told.

use std::path::PathBuf;

use super::ClapArgs;

/// What `vastex merge` is told.
#[derive(Debug, ClapArgs)]
#[command(after_help = "\
Examples:
  vastex merge *.part -o earth.vastex
  for i in 1 2 3; do vastex build earth.tif -o $i.part --shard $i/3; done && vastex merge [123].part -o earth.vastex

The container has the very bytes that one build without --shard writes. The parts are left as they are.")]
pub(crate) struct MergeArgs {
    /// All parts of one container, in any order
    #[arg(value_name = "PART", required = true)]
    pub(crate) parts: Vec<PathBuf>,
    /// The container to make
    #[arg(short, long, value_name = "OUT.vastex")]
    pub(crate) output: PathBuf,
    /// Wait until the disk has everything
    #[arg(long)]
    pub(crate) durable: bool,
    /// Print nothing but errors
    #[arg(short, long)]
    pub(crate) quiet: bool,
    /// Print one JSON object
    #[arg(long)]
    pub(crate) json: bool,
}
