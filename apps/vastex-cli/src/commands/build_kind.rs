//! `vastex build` of whatever lies at a path: a volume, or an image.

use std::process::ExitCode;

use anyhow::{Result, bail};

use crate::args::BuildArgs;
use crate::open;

/// Builds what is named: layers are images, whatever else lies in their files.
pub(crate) fn run(args: &BuildArgs) -> Result<ExitCode> {
    let inputs = args.inputs();
    let layers = inputs.iter().map(|input| &*input.path);
    let instead = "build its image, or write a region of it with `vastex crop` and build that";
    open::refuse_generated(layers, ("built", instead))?;
    #[cfg(feature = "volumes")]
    if let Some(input) = args.input.as_ref().filter(|path| super::volume::is_described_as_volume(path)) {
        return super::build_volume::run(args, input);
    }
    if let Some(why) = args.of_volumes_alone() {
        bail!("{why}, and this is built as an image; leave it out, or name a volume");
    }
    super::build::run(args)
}
