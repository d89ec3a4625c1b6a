//! What `--compare` compares a picture of a volume with: the same volume as one brick for each channel, an
//! ordinary 3-D texture with nothing to look up and no borders.

use std::sync::Arc;

use anyhow::{Context, Result, bail};
use vastex::{LevelRule, TileSource, VolumeFilters};
use vastex_scenes::{Comparison, Gpu, Picture};
use vastex_viewer::volume::{VolumeClip, VolumeView};
use vastex_volume::{Volume, VolumeSource};

use super::{Drawing, box_of, source_of};
use crate::args::{AskedChannel, RenderVolumeArgs};
use crate::commands::compared::Compared;
use crate::commands::render_pools::{MOST_BYTES, PoolBytes, brick_bytes, bytes_for_all};
use crate::report;

/// Compares a picture that was drawn `mip_bias` levels coarser than wanted.
pub(super) fn compare(
    args: &RenderVolumeArgs,
    gpu: &Gpu,
    (volume, channels): (&Arc<Volume>, &[AskedChannel]),
    view: (VolumeView, VolumeClip),
    (picture, mip_bias): (&Picture, f64),
) -> Result<Compared> {
    let size = volume.about().size();
    let longest = size.into_iter().max().unwrap_or(1);
    let most = u64::from(gpu.device.limits().max_texture_dimension_3d);
    // Its levels lie beside one another in the brick.
    if 2 * longest > most {
        bail!(
            "--compare: {} has {longest} voxels along a side, and this adapter's 3-D textures hold {} with their levels; \
             compare a smaller volume",
            volume.about().path,
            most / 2
        );
    }
    let brick = u32::try_from(longest.next_power_of_two()).context("a side of the volume")?;
    let sources = channels.iter().map(|channel| source_of(args, volume, (channel, args.look.time()), brick));
    let sources: Vec<Arc<VolumeSource>> = sources.collect::<Result<_>>()?;
    let filters = VolumeFilters::of(&gpu.device, &gpu.queue);
    let of_channel = |source: &Arc<VolumeSource>| {
        source.description().geometry.page_count() * brick_bytes(source, filters)
    };
    let bytes: u64 = sources.iter().map(of_channel).sum();
    if bytes > MOST_BYTES {
        bail!(
            "--compare: {} would take {} as ordinary textures, more than the {} that are taken for them; compare a smaller \
             volume or fewer channels",
            volume.about().path,
            report::bytes(bytes),
            report::bytes(MOST_BYTES)
        );
    }
    // So much that no picture of it is coarser.
    let room = bytes_for_all(&sources, (&gpu.device.limits(), filters));
    let room = room.unwrap_or(bytes + bytes / sources.len().max(1) as u64);
    let pools = PoolBytes { channels: room, labels: 0, is_bounded: false };
    let shown = (box_of(volume.about())?, channels, &sources[..]);
    let mut drawing = Drawing::new(args, gpu, shown, None, view, (pools, None))?;
    drawing.set_levels(LevelRule { bias: mip_bias as f32, ..LevelRule::default() });
    let is_whole = drawing.play(|_| ())? && drawing.textures.stats().pager.bias_eighths == 0;
    if !is_whole {
        bail!(
            "--compare: {} does not fit {} of this adapter as ordinary textures; compare a smaller volume",
            volume.about().path,
            report::bytes(room)
        );
    }
    Ok(Compared::new(&Comparison::of(picture, &drawing.picture()?), "gpu", mip_bias))
}
