//! A volume as `vastex record` draws it: as `vastex render` does, with what each frame wanted taken down.

use anyhow::Result;
use vastex::Textures;
use vastex_scenes::{Gpu, Picture};

use super::along;
use super::watch::Watch;
use crate::args::RenderVolumeArgs;
use crate::pictures::PictureOutput;

/// What was drawn.
pub(crate) struct Recorded {
    /// Whether all in view was there in the end.
    pub(crate) converged: bool,
    /// The last picture.
    pub(crate) picture: Picture,
    /// As the last frame left them, with the trace of all frames.
    pub(crate) textures: Textures,
}

/// Draws what is asked for, in lock-step.
pub(crate) fn recorded(args: &RenderVolumeArgs, gpu: &Gpu) -> Result<Recorded> {
    let (path, mut asked) = along::opened(args)?;
    let mut watch = Watch::new(args)?;
    let views = path.as_ref().map(|path| path.views(asked.volume.about(), args.size)).transpose()?;
    let (mut drawing, brick) = asked.drawing((args, views), gpu, None)?;
    drawing.textures.ahead().trace().record();
    let of_path = (path.as_ref(), &mut asked);
    let output = &mut PictureOutput::Nothing;
    let (converged, picture) = along::draw((&mut drawing, brick), of_path, output, &mut watch)?;
    Ok(Recorded { converged, picture, textures: drawing.textures })
}
