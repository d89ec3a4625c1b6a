//! The pictures of a camera path around a volume, each drawn once all of it is there; or the one where the
//! camera stands.

use std::ops::ControlFlow;
use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use vastex_scenes::Picture;
use vastex_viewer::volume::{VolumeBox, VolumeView};
use vastex_viewer::volume_scene::{VolumeLayout, VolumePane};
use vastex_viewer::{CameraPath, VolumePlace, VolumeViewText};
use vastex_volume::VolumeAbout;

use super::asked::{Asked, copied};
use super::watch::Watch;
use super::{Drawing, box_of};
use crate::args::{RenderVolumeArgs, Toward};
use crate::commands::replay;
use crate::pictures::PictureOutput;

/// A path, and what is seen along it.
pub(super) struct Along {
    file: PathBuf,
    path: CameraPath<VolumePlace>,
    view: VolumeViewText,
    frames: u64,
}

/// Reads the path that is asked for, and opens the volume at its first time.
pub(super) fn opened(args: &RenderVolumeArgs) -> Result<(Option<Along>, Asked)> {
    let path = path_of(args)?;
    let mut asked = Asked::open(args)?;
    if let Some(path) = &path {
        path.check(asked.volume.about())?;
        asked.time = path.time(0).unwrap_or(asked.time);
    }
    Ok((path, asked))
}

/// Reads the path that is asked for.
fn path_of(args: &RenderVolumeArgs) -> Result<Option<Along>> {
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
    // One slice alone, where the path says where slices are.
    let has_slices = path.keys().iter().all(|(_, place)| place.slices.is_some());
    let pane = match view.panes {
        Some(VolumeLayout::One(pane)) if has_slices => pane,
        _ => VolumePane::Space,
    };
    let view = VolumeViewText { panes: Some(VolumeLayout::One(pane)), ..view };
    let frames = path.frames().min(args.path.frames.unwrap_or(u64::MAX));
    Ok(Some(Along { file: file.clone(), path, view, frames }))
}

impl Along {
    /// Fails where the volume does not have a time of the path.
    fn check(&self, about: &VolumeAbout) -> Result<()> {
        let latest = self.path.keys().iter().filter_map(|(_, place)| place.time).max();
        if let Some(time) = latest.filter(|time| *time >= about.times) {
            let (file, last) = (self.file.display(), about.times.saturating_sub(1));
            bail!("{file}: time={time}: {} has the times 0 to {last}", about.path);
        }
        Ok(())
    }

    /// The time in a picture, if the path says any.
    fn time(&self, frame: u64) -> Option<u64> {
        self.path.pose_of_frame(frame).time
    }

    pub(super) fn frames(&self) -> u64 {
        self.frames.max(1)
    }

    /// What each picture of it looks at: a day has millions of pictures.
    pub(super) fn views(
        &self,
        about: &VolumeAbout,
        size: [u32; 2],
    ) -> Result<impl Iterator<Item = VolumeView>> {
        let of = box_of(about)?;
        Ok((0..self.frames()).map(move |frame| self.view(frame, of, size)))
    }

    fn view(&self, frame: u64, of: VolumeBox, size: [u32; 2]) -> VolumeView {
        copied(&self.path.pose_of_frame(frame).of(&self.view), of, size).0
    }
}

/// Draws what is asked for and writes it; says whether all of it was there, and gives the last picture.
pub(super) fn draw(
    (drawing, brick): (&mut Drawing<'_>, u32),
    (along, asked): (Option<&Along>, &mut Asked),
    output: &mut PictureOutput,
    watch: &mut Watch,
) -> Result<(bool, Picture)> {
    let (of, size) = (box_of(asked.volume.about())?, drawing.canvas.size());
    let frames = along.map_or(1, Along::frames);
    let (mut converged, mut number) = (true, 0);
    loop {
        if let Some(along) = along {
            drawing.view = along.view(number, of, size);
            if let Some(time) = along.time(number).filter(|time| *time != asked.time) {
                asked.time = time;
                drawing.go_to(asked, brick, watch.disk.as_ref())?;
            }
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
