//! `vastex build` of whatever lies at a path: a volume, or an image.

use std::process::ExitCode;

use anyhow::{Result, bail};

use crate::args::BuildArgs;

/// Builds what is named: layers are images, whatever else lies in their files.
pub(crate) fn run(args: &BuildArgs) -> Result<ExitCode> {
    #[cfg(feature = "volumes")]
    if let Some(input) = args.input.as_ref().filter(|path| super::volume::is_described_as_volume(path)) {
        return super::build_volume::run(args, input);
    }
    if let Some(why) = args.of_volumes_alone() {
        bail!("{why}, and this is built as an image; leave it out, or name a volume");
    }
    super::build::run(args)
}
