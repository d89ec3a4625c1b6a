//! The pictures of a camera path around a volume, each drawn once all of it is there; or the one where the
//! camera stands.

use std::ops::ControlFlow;

use anyhow::{Context, Result};
use vastex_scenes::Picture;
use vastex_viewer::volume::{VolumeBox, VolumeView};
use vastex_viewer::volume_scene::{VolumeLayout, VolumePane};
use vastex_viewer::{CameraPath, VolumePlace, VolumeViewText};
use vastex_volume::VolumeAbout;

use super::asked::copied;
use super::watch::Watch;
use super::{Drawing, box_of};
use crate::args::{RenderVolumeArgs, Toward};
use crate::commands::replay;
use crate::pictures::PictureOutput;

/// A path, and what is seen along it.
pub(super) struct Along {
    path: CameraPath<VolumePlace>,
    view: VolumeViewText,
    frames: u64,
}

/// Reads the path that is asked for.
pub(super) fn path_of(args: &RenderVolumeArgs) -> Result<Option<Along>> {
    let Some(file) = &args.path.camera_path else { return Ok(None) };
    let read = || -> Result<CameraPath<VolumePlace>> {
        let text =
            String::from_utf8(replay::read_bytes(file)?).context("this is no text, and so no camera path")?;
        Ok(CameraPath::of_volume(&text)?)
    };
    let path = read().with_context(|| file.display().to_string())?;
    let view = match &args.view {
        // Its camera is the path's.
        Some(Toward::View(view)) => (**view).clone(),
        _ => VolumeViewText::default(),
    };
    let view = VolumeViewText { panes: Some(VolumeLayout::One(VolumePane::Space)), ..view };
    let frames = path.frames().min(args.path.frames.unwrap_or(u64::MAX));
    Ok(Some(Along { path, view, frames }))
}

impl Along {
    fn view(&self, frame: u64, of: VolumeBox, size: [u32; 2]) -> VolumeView {
        copied(&self.path.pose_of_frame(frame).of(&self.view), of, size).0
    }
}

/// Draws what is asked for and writes it; says whether all of it was there, and gives the last picture.
pub(super) fn draw(
    drawing: &mut Drawing<'_>,
    (along, about): (Option<&Along>, &VolumeAbout),
    output: &mut PictureOutput,
    watch: &mut Watch,
) -> Result<(bool, Picture)> {
    let (of, size) = (box_of(about)?, drawing.canvas.size());
    let frames = along.map_or(1, |along| along.frames.max(1));
    let (mut converged, mut number) = (true, 0);
    loop {
        if let Some(along) = along {
            drawing.view = along.view(number, of, size);
        }
        drawing.most_frames = drawing.frames + super::MOST_FRAMES;
        converged &= drawing.play(|textures| watch.note(textures))?;
        let picture = drawing.picture()?;
        watch.note(&drawing.textures);
        number += 1;
        let is_over = number == frames || !converged;
        if output.write_frame(number - 1, &picture)? == ControlFlow::Break(()) || is_over {
            output.write_last(|| Ok(picture.clone()))?;
            return Ok((converged, picture));
        }
    }
}
