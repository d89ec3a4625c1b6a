//! Labels in pictures of volumes: which are meant, where they lie, and what their pool may take.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context, Result, bail};
use vastex::{LayerId, PoolRule, PoolTuning, TextureSettings, Textures, TileSource};
use vastex_viewer::volume::{LabelColors, LabelTurns, VolumeBox, VolumeLabels};
use vastex_volume::{Opened, Volume, VolumeAbout, VolumeOptions, VolumeSource, open_placed};

use super::volume::no_volume;
use crate::args::{OriginsArgs, RenderVolumeArgs};
use crate::report;

/// Labels that are drawn.
pub(super) struct Labels {
    pub(super) source: Arc<VolumeSource>,
    /// Their box, and where it begins, in the world of the picture.
    of: VolumeBox,
    begin: [f64; 3],
    selected: Option<u64>,
    colors: Arc<LabelColors>,
}

impl Labels {
    /// The labels that are asked for over a volume: those that are named, or the volume itself where it is
    /// one of labels. `None` if there are none. They are opened once for all times.
    pub(super) fn volume(args: &RenderVolumeArgs, image: &Arc<Volume>) -> Result<Option<Arc<Volume>>> {
        let (about, asked) = (image.about(), &args.look.labels);
        // Of labels by themselves a view says how they look, and which they are is known.
        let of_view = args.look.of_view.labels;
        let own_name = about.root.file_name();
        let is_own = |named: &OsStr| of_view == Some(true) || own_name == Some(named);
        match (&asked.labels, about.is_label) {
            (None, true) if of_view == Some(false) => Ok(None),
            (Some(named), true) if is_own(named) => Ok(Some(image.clone())),
            (Some(_), true) => bail!(
                "--labels: {} is a volume of labels itself; name the image that they lie beside as the source",
                about.path
            ),
            (None, true) => Ok(Some(image.clone())),
            (Some(named), false) => open_named(named, about, args.look.origins).map(Some),
            (None, false) => match asked.of_labels_alone() {
                None => Ok(None),
                Some(option) => bail!("{option}: it goes with --labels NAME, {}", listed(about)),
            },
        }
    }

    /// Labels of a volume at a time, in bricks of so many voxels a side, over an image.
    pub(super) fn open(
        args: &RenderVolumeArgs,
        (volume, about): (&Arc<Volume>, &VolumeAbout),
        (brick, time): (u32, u64),
    ) -> Result<Labels> {
        let (of_labels, asked) = (volume.about(), &args.look.labels);
        let time = if of_labels.times > 1 { time } else { 0 };
        let options = VolumeOptions {
            labels: Some(true),
            time,
            brick,
            cache: args.cache(),
            // As of channels: what is kept serves other runs, else only what is seen is made.
            makes_all: args.cache().is_some(),
            ..VolumeOptions::default()
        };
        let text = format!("note: {}: its coarsest stored level is read", of_labels.path);
        let source = report::say_if_slow(&text, || VolumeSource::open(volume.clone(), &options))?;
        let (of, begin) = place(of_labels, about)?;
        let selected = asked.label_selected.map(|label| selected(label, of_labels)).transpose()?;
        let colors = Arc::new(LabelColors::new(of_labels.label_colors.iter().copied()));
        Ok(Labels { source: Arc::new(source), of, begin, selected, colors })
    }

    /// The rule for the pool of labels, of so many bytes.
    pub(super) fn pool(&self, bytes: u64) -> PoolRule {
        let format = self.source.description().layers[0].format;
        let tuning =
            PoolTuning { bytes: Some(bytes), allow_size_scale: Some(false), ..PoolTuning::default() };
        PoolRule { formats: Some(vec![format]), tuning, ..PoolRule::default() }
    }

    /// Where they lie in the world of the picture: their box, and its first corner.
    pub(super) fn place(&self) -> (VolumeBox, [f64; 3]) {
        (self.of, self.begin)
    }

    /// How many turns of loops a ray takes for them at most.
    pub(super) fn turns(&self, args: &RenderVolumeArgs) -> LabelTurns {
        let others = args.look.labels.label_others.unwrap_or_default();
        self.colors.turns(self.selected.map(|_| others))
    }

    /// Adds them to textures, as they are to be shown.
    pub(super) fn add(
        &self,
        args: &RenderVolumeArgs,
        textures: &mut Textures,
        is_alone: bool,
    ) -> Result<VolumeLabels> {
        let voxels = Some(self.source.levels().clone());
        let own = TextureSettings { voxels, ..TextureSettings::default() };
        let tiles: Arc<dyn TileSource> = self.source.clone();
        let prepared = textures.preparer().read_blocking(tiles, own)?;
        let layer: LayerId = textures.add_volume(prepared)?.into();
        let usual = if is_alone { 1.0 } else { 0.5 };
        Ok(VolumeLabels {
            begin: self.begin,
            opacity: args.look.labels.label_opacity.unwrap_or(usual),
            outlines: args.look.labels.label_outlines,
            selected: self.selected,
            others: args.look.labels.label_others.unwrap_or_default(),
            colors: self.colors.clone(),
            ..VolumeLabels::new(layer, self.of)
        })
    }
}

/// Those beside an image by their name, or any by their path. What is said of the image's translations is
/// said of the labels beside it, and of no others.
fn open_named(named: &OsStr, about: &VolumeAbout, origins: OriginsArgs) -> Result<Arc<Volume>> {
    let mut convention = None;
    let shown = named.to_string_lossy();
    let path = match about.labels.iter().any(|name| **name == *named) {
        true => {
            convention = origins.convention();
            about.labels_at(&shown)
        }
        // Within an archive there is no such file.
        false if Path::new(named).ancestors().any(|path| !path.as_os_str().is_empty() && path.exists()) => {
            PathBuf::from(named)
        }
        false => bail!("--labels {shown}: {}, and there is no such file", listed(about)),
    };
    match open_placed(&path, convention).with_context(|| format!("--labels {shown}"))? {
        Opened::Volume(volume) => Ok(Arc::new(*volume)),
        Opened::Images(list) => bail!("--labels {shown}: {}", no_volume(&list)),
    }
}

/// Which labels lie beside an image.
fn listed(about: &VolumeAbout) -> String {
    match about.labels.is_empty() {
        true => format!("no labels lie beside {}; give the path of others", about.path),
        false => format!("{} has the labels {}", about.path, about.labels.join(", ")),
    }
}

/// The box of labels in the world of an image's picture, and where it begins. Those of as many voxels as the
/// image lie voxel on voxel, whatever scales they name; others where their lengths, put in the image's unit,
/// say. Units that cannot be compared are refused.
pub(crate) fn place(labels: &VolumeAbout, image: &VolumeAbout) -> Result<(VolumeBox, [f64; 3])> {
    let (own, of_image) = (&labels.levels[0], &image.levels[0]);
    let mut size = [0; 3];
    for (side, voxels) in size.iter_mut().zip(own.size) {
        *side =
            u32::try_from(voxels).with_context(|| format!("{}: a side of {voxels} voxels", labels.path))?;
    }
    let longest = of_image.scale.iter().copied().fold(0.0, f64::max);
    if own.size == of_image.size {
        return Ok((VolumeBox::new(size, of_image.scale.map(|side| side / longest)), [0.0; 3]));
    }
    let unit = labels.unit_in(image).with_context(|| {
        let unit = |about: &VolumeAbout| about.unit.clone().unwrap_or_default();
        format!(
            "{}: its voxels are told in '{}' and those of {} in '{}', which cannot be compared; write both in units of length, as \
             micrometer, or labels of as many voxels as the image has",
            labels.path,
            unit(labels),
            image.path,
            unit(image)
        )
    })?;
    let begin = std::array::from_fn(|axis| (own.origin[axis] * unit - of_image.origin[axis]) / longest);
    Ok((VolumeBox::new(size, own.scale.map(|side| side * unit / longest)), begin))
}

/// A label as it stands in tiles.
fn selected(label: i128, about: &VolumeAbout) -> Result<u64> {
    let dtype = about.dtype;
    let Some((least, most)) = dtype.bounds() else {
        bail!("{}: labels are whole numbers, and these are {}", about.path, dtype.name());
    };
    if !(least..=most).contains(&label) {
        bail!("--label-selected {label}: values of {} ({}) are {least} to {most}", about.path, dtype.name());
    }
    Ok(if dtype.bytes() < 8 { u64::from(label as i64 as u32) } else { label as u64 })
}

#[cfg(test)]
mod tests {
    use vastex_volume::VolumeLevel;

    use super::*;

    fn about(unit: Option<&str>, size: u64, scale: f64, origin: f64) -> VolumeAbout {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/volumes/head.zip");
        let Opened::Volume(volume) = vastex_volume::open(&path).unwrap() else { panic!("no volume") };
        let level = VolumeLevel {
            size: [size; 3],
            scale: [scale; 3],
            origin: [origin; 3],
            ..volume.about().levels[0].clone()
        };
        VolumeAbout { levels: vec![level], unit: unit.map(str::to_owned), ..volume.about().clone() }
    }

    #[test]
    fn labels_lie_where_their_unit_says() {
        let image = about(Some("micrometer"), 40, 2.0, 10.0);
        for (unit, scale, origin) in
            [(Some("nm"), 4000.0, 30_000.0), (Some("µm"), 4.0, 30.0), (None, 4.0, 30.0)]
        {
            let (of, begin) = place(&about(unit, 20, scale, origin), &image).unwrap();
            assert_eq!(of.size, [20; 3]);
            let near = |found: [f64; 3], side: f64| found.iter().all(|found| (found - side).abs() < 1e-9);
            // The image's voxels are 1 long.
            assert!(near(of.voxel.to_array(), 2.0) && near(begin, 10.0), "{unit:?}: {of:?} at {begin:?}");
        }
        let error = place(&about(Some("pixel"), 20, 4.0, 0.0), &image).unwrap_err().to_string();
        assert!(error.contains("'pixel'") && error.contains("'micrometer'"), "{error}");
        // Voxel on voxel, whatever is said.
        let (of, begin) = place(&about(Some("pixel"), 40, 9.0, 5.0), &image).unwrap();
        assert_eq!((of.voxel.to_array(), begin), ([1.0; 3], [0.0; 3]));
    }
}
