//! Which channels of a volume are to be seen and from where, what cannot be drawn of what was asked for, and
//! how it is put into textures.

use std::sync::Arc;

use anyhow::{Context, Result, bail};
use glam::DVec3;
use vastex::VolumeFilters;
use vastex_scenes::Gpu;
use vastex_tiles::DiskTier;
use vastex_viewer::VolumeViewText;
use vastex_viewer::volume::{FIRST_CHANNELS, MOST_CHANNELS, VolumeBox, VolumeClip, VolumePlane, VolumeView};
use vastex_viewer::volume_scene::{PaneSight, VolumeFacts, VolumeLayout, VolumeLook, VolumePane, pane_rects};
use vastex_volume::{Opened, Volume, VolumeAbout, VolumeOptions, VolumeSource, levels_of, open_placed};

use super::super::render_labels::Labels;
use super::super::render_pools::{brick_side, large_bricks, pool_bytes};
use super::super::volume::no_volume;
use super::steps::{bounds_of, check};
use super::{Drawing, box_of, source_of};
use crate::args::{AskedChannel, AskedSlice, RenderVolumeArgs, Toward, VolumeScene};

/// What is to be seen of a volume, which is open.
pub(super) struct Asked {
    pub(super) volume: Arc<Volume>,
    /// The labels over it, if any are shown, which keep what is read of them from time to time.
    labels: Option<Arc<Volume>>,
    pub(super) channels: Vec<AskedChannel>,
    pub(super) view: (VolumeView, VolumeClip),
    /// The time, from 0.
    pub(super) time: u64,
}

impl Asked {
    /// Opens the volume, and finds out whether it has what is asked for.
    pub(super) fn open(args: &RenderVolumeArgs) -> Result<Asked> {
        let volume = match open_placed(&args.source, args.look.origins.convention())? {
            Opened::Volume(volume) => Arc::new(*volume),
            Opened::Images(list) => bail!(no_volume(&list)),
        };
        let view = view_of(args, volume.about())?;
        let VolumeOptions { brick, border, .. } = VolumeOptions::default();
        levels_of(volume.about(), brick, border)?;
        let channels = channels_of(args, volume.about())?;
        let labels = Labels::volume(args, &volume)?;
        Ok(Asked { volume, labels, channels, view, time: args.look.time() })
    }

    /// Puts what is seen into textures, with the disk cache before it, and gives the side of its bricks in
    /// voxels; fails where a ray of a picture would be cut, of the views of a path if there is one.
    pub(super) fn drawing<'a>(
        &self,
        (args, path): (&'a RenderVolumeArgs, Option<impl Iterator<Item = VolumeView>>),
        gpu: &'a Gpu,
        disk: Option<&Arc<DiskTier>>,
    ) -> Result<(Drawing<'a>, u32)> {
        let (source, about) = (args.source.display().to_string(), self.volume.about());
        check_size(gpu, args.size)?;
        let filters = VolumeFilters::of(&gpu.device, &gpu.queue);
        let large = large_bricks(about, filters)?;
        let pool = args.pool_mib.map(|mib| mib << 20);
        let brick = brick_side(pool, large, self.channels.len().max(1) as u64);
        let labels = self.labels(args, brick)?;
        if args.compare && labels.is_some() {
            bail!("--compare: labels are compared with nothing; compare the image without them");
        }
        if self.channels.is_empty() && labels.is_none() {
            bail!("{source}: the view shows no channel and no labels of it, so there is nothing to be drawn");
        }
        let (own, clip) = &self.view;
        let shown = (about, self.channels.len(), clip);
        let bounds = bounds_of(args, gpu.is_processor(), (shown, brick), labels.as_ref())?;
        let checked = match path {
            Some(mut path) => path.try_for_each(|view| check(&bounds, &view, args.size)),
            None => check(&bounds, own, args.size),
        };
        checked.context(source.clone())?;
        let sources = self.sources(args, brick)?;
        let of_labels = labels.as_ref().map_or(&[][..], |labels| std::slice::from_ref(&labels.source));
        let bytes = pool_bytes(args, (&gpu.device.limits(), filters), [&sources, of_labels])?;
        let shown = (box_of(about)?, &self.channels[..], &sources[..]);
        let drawing = Drawing::new(args, gpu, shown, labels.as_ref(), self.view, (bytes, disk));
        Ok((drawing.context(source)?, brick))
    }

    /// The channels at the time.
    pub(super) fn sources(&self, args: &RenderVolumeArgs, brick: u32) -> Result<Vec<Arc<VolumeSource>>> {
        let of = |channel| source_of(args, &self.volume, (channel, self.time), brick);
        self.channels.iter().map(of).collect()
    }

    /// The labels over them at the time, if any are shown.
    pub(super) fn labels(&self, args: &RenderVolumeArgs, brick: u32) -> Result<Option<Labels>> {
        let of = |labels| Labels::open(args, (labels, self.volume.about()), (brick, self.time));
        self.labels.as_ref().map(of).transpose()
    }
}

/// The channels that are shown: those that are asked for, else those that the file shows at first, else the
/// first ones.
fn channels_of(args: &RenderVolumeArgs, about: &VolumeAbout) -> Result<Vec<AskedChannel>> {
    if about.is_label {
        return match args.look.channels.is_empty() {
            true => Ok(Vec::new()),
            false => {
                bail!("--channels: {} is a volume of labels, which have colours of their own", about.path)
            }
        };
    }
    if args.look.of_view.no_channels {
        return Ok(Vec::new());
    }
    if !args.look.channels.is_empty() {
        for asked in &args.look.channels {
            if asked.channel >= about.channels {
                let last = about.channels - 1;
                bail!("--channels {}: {} has the channels 0 to {last}", asked.channel, about.path);
            }
        }
        return Ok(args.look.channels.clone());
    }
    let active =
        about.channel_info.iter().zip(0..about.channels).filter(|(info, _)| info.is_active == Some(true));
    let active: Vec<AskedChannel> =
        active.map(|(_, channel)| AskedChannel::new(channel)).take(MOST_CHANNELS).collect();
    match active.is_empty() {
        true => Ok((0..about.channels.min(FIRST_CHANNELS as u64)).map(AskedChannel::new).collect()),
        false => Ok(active),
    }
}

fn check_size(gpu: &Gpu, size: [u32; 2]) -> Result<()> {
    let most = gpu.device.limits().max_texture_dimension_2d;
    if size.iter().any(|side| *side > most) {
        bail!("--size {}x{}: this adapter draws pictures of {most}x{most} pixels at most", size[0], size[1]);
    }
    Ok(())
}

/// From where it is seen, and what is left of it there.
fn view_of(args: &RenderVolumeArgs, about: &VolumeAbout) -> Result<(VolumeView, VolumeClip)> {
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
