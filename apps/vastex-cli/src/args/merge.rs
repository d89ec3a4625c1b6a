//! What `vastex merge` is told.

use std::path::PathBuf;

use super::ClapArgs;
use super::common::{DiskArgs, PrintArgs};

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
    #[command(flatten)]
    pub(crate) disk: DiskArgs,
    #[command(flatten)]
    pub(crate) print: PrintArgs,
}
