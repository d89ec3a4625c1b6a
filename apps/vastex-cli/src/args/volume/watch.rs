//! What `vastex render` of a volume is to tell and keep beside the picture: the words that images have.

use std::path::PathBuf;

use clap::Args as ClapArgs;

use super::super::render::RunFilesArgs;
use super::super::{DiskCacheArgs, parse_pixel, value_error};

/// What is told of a run, and kept.
#[derive(Clone, Debug, ClapArgs)]
pub(crate) struct VolumeWatchArgs {
    #[command(flatten)]
    pub(crate) files: RunFilesArgs,
    /// Tell what is in each pool at the end: bricks by texture and level, the largest first; with --json as
    /// `pool_dump`
    #[arg(long)]
    pub(crate) dump_pools: bool,
    /// Of a slice, explain a pixel of the picture, counted from the top left: the brick that it wants, what
    /// is shown instead and what that waits for; with --json as `explained`
    #[arg(long, value_name = "X,Y", value_parser = parse_pixel)]
    pub(crate) explain: Option<[u32; 2]>,
    #[command(flatten)]
    pub(crate) disk_cache: DiskCacheArgs,
    /// Write a page about the run into this directory, DIR/index.html: the last picture, what each frame did,
    /// settings and warnings. A ray has many bricks, so that no overlays stand on it
    #[arg(long, value_name = "DIR")]
    pub(crate) report: Option<PathBuf>,
}

impl VolumeWatchArgs {
    /// Checks that what is asked for can be had of a picture of so many pixels, of a slice or of rays.
    pub(super) fn check(&self, is_slice: bool, [width, height]: [u32; 2]) -> Result<(), clap::Error> {
        match self.explain {
            Some(_) if !is_slice => Err(value_error(
                "'--explain': a ray meets many bricks, and a pixel of a slice one; use it with --on slices",
            )),
            Some([x, y]) if x >= width || y >= height => Err(value_error(&format!(
                "'{x},{y}' for '--explain <X,Y>': the picture has {width}x{height} pixels, counted from 0,0"
            ))),
            _ => Ok(()),
        }
    }
}
