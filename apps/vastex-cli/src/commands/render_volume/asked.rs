//! From where a volume is to be seen, and what cannot be drawn of what was asked for.

use anyhow::{Result, bail};
use glam::DVec3;
use vastex_scenes::Gpu;
use vastex_viewer::VolumeViewText;
use vastex_viewer::volume::{VolumeBox, VolumeClip, VolumePlane, VolumeView};
use vastex_viewer::volume_scene::{PaneSight, VolumeFacts, VolumeLayout, VolumeLook, VolumePane, pane_rects};
use vastex_volume::{ImageList, VolumeAbout};

use super::box_of;
use crate::args::{AskedSlice, RenderVolumeArgs, Toward, VolumeScene};

/// Samples of a ray beyond which it is not looked at further (volume.wgsl).
const MOST_SAMPLES: f64 = 65_536.0;

/// What is said where one volume is needed and several are there.
pub(crate) fn no_volume(list: &ImageList) -> String {
    let first = list.images.first().map_or("", |image| image.as_str());
    format!(
        "{}: {} with {} images; name one, as in {}/{first}",
        list.path,
        list.what,
        list.images.len(),
        list.path
    )
}

pub(super) fn check_size(gpu: &Gpu, size: [u32; 2]) -> Result<()> {
    let most = gpu.device.limits().max_texture_dimension_2d;
    if size.iter().any(|side| *side > most) {
        bail!("--size {}x{}: this adapter draws pictures of {most}x{most} pixels at most", size[0], size[1]);
    }
    Ok(())
}

/// From where it is seen, and what is left of it there.
pub(super) fn view_of(args: &RenderVolumeArgs, about: &VolumeAbout) -> Result<(VolumeView, VolumeClip)> {
    let of = box_of(about)?;
    let whole = VolumeClip::default();
    match (args.on, args.slice) {
        (VolumeScene::Slices, Some(AskedSlice::Voxels { axis, voxel })) => {
            let side = of.size[usize::from(axis)];
            if voxel >= side {
                let name = ["x", "y", "z"][usize::from(axis)];
                bail!(
                    "--slice {name}={voxel}: {} has {side} planes along {name}, 0 to {}",
                    about.path,
                    side - 1
                );
            }
            return Ok((VolumeView::Slice { axis, voxel }, whole));
        }
        (VolumeScene::Slices, Some(AskedSlice::Oblique { at, normal })) => {
            let at = DVec3::from_array(at) * of.voxel;
            let plane = VolumePlane::through(&of, at, DVec3::from_array(normal), args.size);
            let Some(plane) = plane else {
                bail!("--slice: the plane does not meet {}, of {:?} voxels", about.path, of.size)
            };
            return Ok((VolumeView::Plane(plane), whole));
        }
        _ => {}
    }
    Ok(match &args.view {
        Some(Toward::Face(face)) => (VolumeView::Face(*face), whole),
        Some(Toward::View(view)) => copied(view, of, args.size),
        Some(Toward::Around { .. }) | None => {
            (args.camera(&of).map_or(VolumeView::Face(Default::default()), VolumeView::Around), whole)
        }
    })
}

/// What a view that was copied shows of a box in a picture of so many pixels: a slice where it has that
/// alone, else all of it in 3-D.
pub(super) fn copied(view: &VolumeViewText, of: VolumeBox, size: [u32; 2]) -> (VolumeView, VolumeClip) {
    let facts = VolumeFacts::of_box(of);
    let mut look = VolumeLook::first(&facts);
    // What it says of channels, labels and times is asked for as options ask for it.
    let camera = VolumeViewText { channels: None, labels: None, time: None, ..view.clone() };
    // Of a box without any there is nothing that it names and that is not there.
    drop(camera.change(&mut look, &facts));
    if look.layout == VolumeLayout::Four {
        look.layout = VolumeLayout::One(VolumePane::Space);
    }
    let panes = pane_rects(look.layout, size);
    let sight = PaneSight::of(&look, &of, &panes, &panes[0]);
    (sight.view(1), look.clip.of(&of))
}

/// Fails where rays would have more samples than are looked at.
pub(super) fn check_step(args: &RenderVolumeArgs, about: &VolumeAbout) -> Result<()> {
    let voxels: f64 = about.size().iter().map(|side| *side as f64).sum();
    let side = f64::from(args.size[0].max(args.size[1])).max(1.0);
    let longest = about.size().into_iter().max().unwrap_or(1) as f64;
    // Where voxels are smaller than pixels a coarser level is sampled.
    let samples = voxels / (longest / side).max(1.0) / args.look.step();
    if samples > MOST_SAMPLES {
        let least = args.look.step() * samples / MOST_SAMPLES;
        bail!(
            "--step {}: rays would have more than {MOST_SAMPLES} samples; write {least:.2} or more",
            args.look.step()
        );
    }
    Ok(())
}
