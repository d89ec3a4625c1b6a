//! Labels over a volume in the window: which one lies at a place, and where a ray meets one.

use std::sync::Arc;

use anyhow::{Context, Result, bail};
use glam::DVec3;
use pollster::block_on;
use vastex::{Preparer, TextureSettings};
use vastex_viewer::volume::{LabelColors, OtherLabels};
use vastex_viewer::volume_scene::{LabelsPlace, VolumeFacts, VolumeLook};
use vastex_volume::{Opened, VolumeAbout, VolumeOptions, VolumeSource, open_placed};

use super::{LabelsBelow, OpenedVolume, ReadLabels};
use crate::args::LabelArgs;
use crate::commands::render_labels::place;
use crate::disk_cache;

/// Places along a ray that are looked at, at most.
const MOST_SAMPLES: f64 = 2048.0;

/// Has labels shown at first that are asked for.
pub(crate) fn shown_at_first(asked: &LabelArgs, facts: &VolumeFacts, look: &mut VolumeLook) -> Result<()> {
    if let Some(named) = &asked.labels {
        look.labels.shown = facts.labels.iter().position(|name| **named == **name);
    }
    let shown = match (look.labels.shown, &asked.labels, asked.of_labels_alone()) {
        (Some(shown), ..) => shown,
        (None, Some(named), _) => bail!(not_beside(&named.to_string_lossy(), facts)),
        (None, None, Some(option)) => bail!("{option}: it goes with --labels NAME"),
        (None, None, None) => return Ok(()),
    };
    look.labels.opacity = asked.label_opacity.unwrap_or(look.labels.opacity);
    look.labels.outlines |= asked.label_outlines;
    look.labels.selected = asked.label_selected.or(look.labels.selected);
    look.labels.others = asked.label_others.unwrap_or(look.labels.others);
    match look.labels.selected.and_then(|label| Some((label, facts.label_fault(shown, label)?))) {
        Some((label, why)) => bail!("--label-selected {label}: {why}"),
        None => Ok(()),
    }
}

/// Labels that are asked for and do not lie beside a volume.
fn not_beside(named: &str, facts: &VolumeFacts) -> String {
    let has = if facts.labels.is_empty() { "none".to_owned() } else { facts.labels.join(", ") };
    format!("--labels {named}: labels beside {} are {has}; others are drawn by `vastex render`", facts.name)
}

/// Of each of the labels that can be shown of a volume, the least and the greatest number that its values can
/// have. Where labels beside it cannot be opened, that is told when they are to be shown.
pub(super) fn bounds_of(about: &VolumeAbout) -> Vec<[i128; 2]> {
    let any = [i128::from(i64::MIN), i128::from(u64::MAX)];
    let bounds = |about: &VolumeAbout| about.dtype.bounds().map_or(any, |(least, most)| [least, most]);
    let beside = |name: &String| match vastex_volume::open(&about.labels_at(name)) {
        Ok(Opened::Volume(volume)) => bounds(volume.about()),
        _ => any,
    };
    match about.is_label {
        true => vec![bounds(about)],
        false => about.labels.iter().map(beside).collect(),
    }
}

/// Reads of labels beside a volume at a time what it takes to show them. Those of as many voxels as the image
/// lie voxel on voxel, whatever scales they name.
pub(crate) fn read_labels(
    opened: &OpenedVolume,
    (name, time): (&str, u64),
    preparer: &Preparer,
) -> Result<ReadLabels> {
    let image = opened.volume.about();
    let volume = match image.is_label {
        true => opened.volume.clone(),
        false => match open_placed(&image.labels_at(name), opened.how.origins)? {
            Opened::Volume(volume) => Arc::new(*volume),
            Opened::Images(list) => bail!("{}: {} and no labels", list.path, list.what),
        },
    };
    let about = volume.about();
    let time = if about.times > 1 { time } else { 0 };
    let options = VolumeOptions { labels: Some(true), time, ..opened.how.options(opened.brick) };
    let source = Arc::new(VolumeSource::open(volume.clone(), &options)?);
    let (of, begin) = place(about, image)?;
    let colors = Arc::new(LabelColors::new(about.label_colors.iter().copied()));
    let settings = TextureSettings { voxels: Some(source.levels().clone()), ..TextureSettings::default() };
    let tiles = disk_cache::before_volume(&source, opened.how.disk.as_ref());
    let prepared = preparer.read_blocking(tiles, settings)?;
    let bounds = about.dtype.bounds().map(|(least, most)| [least, most]);
    let bounds = bounds.with_context(|| format!("{}: {} are no labels", about.path, about.dtype.name()))?;
    let levels = Some(source.levels().clone());
    Ok(ReadLabels { source, prepared, place: LabelsPlace { of, begin, colors, bounds, levels } })
}

/// The label at a place; nothing where there is none.
pub(crate) fn at((source, of): &LabelsBelow, place: DVec3) -> Result<Option<i128>> {
    let voxel = (place - DVec3::from_array(of.begin)) / of.of.voxel;
    let world = source.levels().level(0).world_from_voxel(voxel.to_array());
    let found = block_on(source.value_at(0, world))?;
    // What is no whole number is no label, and none of these sources has it.
    Ok(found.and_then(|found| found.value.to_string().parse().ok()).filter(|label| *label != 0))
}

/// Where a ray first meets a label that is drawn, from `begin` to `end` along it.
pub(crate) fn first_along(
    labels: &LabelsBelow,
    look: &VolumeLook,
    (from, toward, pixel): (DVec3, DVec3, f64),
    [begin, end]: [f64; 2],
) -> Result<Option<DVec3>> {
    let finest = labels.1.of.voxel.min_element().max(pixel) * 0.5;
    let count = ((end - begin) / finest).ceil().clamp(1.0, MOST_SAMPLES);
    let hidden = look.labels.others == OtherLabels::Hidden;
    let selected = look.labels.selected.filter(|_| hidden);
    for nth in 0..count as u32 {
        let place = from + toward * (begin + (end - begin) * (f64::from(nth) + 0.5) / count);
        if at(labels, place)?.is_some_and(|label| selected.is_none_or(|selected| label == selected)) {
            return Ok(Some(place));
        }
    }
    Ok(None)
}
