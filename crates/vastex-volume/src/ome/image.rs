//! From an image's metadata and arrays to a volume.

use std::path::PathBuf;
use std::sync::Arc;

use serde_json::Value;

use super::axes::{self, Axis, assign, fitting};
use super::levels::{Stored, check_cover, convention, origins, scales, sorted};
use super::root::ImageRoot;
use super::transforms::Diagonal;
use super::{labels, omero};
use crate::chunks::{AxisMap, Grid};
use crate::fault::{Oddities, VolumeError, VolumeFault, damaged};
use crate::json::{finite, list, text};
use crate::keys::{KeyStore, join, shown};
use crate::units;
use crate::volume::{LevelArray, LevelLeftOut, Volume, VolumeAbout, VolumeChannel, VolumeLevel};
use crate::zarr::{ZarrArray, open_array, shortened};

/// Levels that are read: as many as halve the longest side of a texture, and some.
const MOST_LEVELS: usize = 64;
/// Images of labels that are listed beside an image.
const MOST_LABELS: usize = 1000;

/// A dataset whose array is there.
struct Found {
    /// Its place in the list of datasets.
    number: usize,
    array: ZarrArray,
    stored: Stored,
    map: AxisMap,
    time_step: Option<f64>,
}

/// The datasets of an image.
struct Datasets {
    found: Vec<Found>,
    /// Those that cannot be read or are not there, by their places in the list.
    lacking: Vec<(usize, LevelLeftOut)>,
    axes: Vec<Axis>,
}

/// Opens the image whose metadata were found under a key.
pub(crate) async fn open_image(
    keys: &Arc<dyn KeyStore>,
    prefix: &str,
    root: ImageRoot,
) -> Result<Volume, VolumeError> {
    let ImageRoot { attributes, version, mut oddities } = root;
    let path = shown(&**keys, prefix);
    let multiscales = list(&attributes, "multiscales");
    let multiscale = multiscales.first().unwrap_or(&Value::Null);
    if multiscales.len() > 1 {
        oddities.push(format!("{} pyramids are listed for one image; the first is taken", multiscales.len()));
    }
    let Datasets { found, lacking, axes } =
        open_datasets(keys, prefix, &path, multiscale, &mut oddities).await?;
    let order = sorted(&found.iter().map(|found| found.stored.clone()).collect::<Vec<_>>(), &mut oddities);
    let mut by_place: Vec<Option<Found>> = found.into_iter().map(Some).collect();
    let is_listed_in_order = order.is_sorted();
    let found: Vec<Found> = order.into_iter().filter_map(|place| by_place[place].take()).collect();
    let of_found: Vec<usize> = found.iter().map(|found| found.number).collect();
    let (found, unfit) = fitting_levels(found, &path, &mut oddities);
    let datasets = list(multiscale, "datasets");
    let left_out = numbered([lacking, unfit], datasets, &of_found, is_listed_in_order);
    let stored: Vec<Stored> = found.iter().map(|found| found.stored.clone()).collect();
    let mut scales = scales(&stored, &mut oddities);
    let mut translations: Vec<[f64; 3]> = stored.iter().map(|level| level.translation).collect();
    let (map, time_step) = (found[0].map, found[0].time_step);
    let unit = one_unit(&axes, map, &mut scales, &mut translations, &mut oddities);
    let states_middles = version.as_deref().is_some_and(|version| version.starts_with("0.6"));
    let convention = convention(&scales, &translations, states_middles);
    let origins = origins(&scales, &translations, convention);
    check_cover(&stored, &scales, &origins, &mut oddities);
    let arrays: Vec<LevelArray> = found.into_iter().map(|found| level_of(found.array, found.map)).collect();
    let levels = stored.iter().zip(&arrays).enumerate().map(|(n, (stored, array))| VolumeLevel {
        path: stored.path.clone(),
        size: stored.size,
        scale: scales[n],
        origin: origins[n],
        chunk: array.grid.chunk_size(),
    });
    let levels = levels.collect();
    let channels = arrays[0].grid.channels();
    let channel_info = channel_info(&attributes, channels, &mut oddities);
    let label_colors = labels::colors(&attributes, arrays[0].dtype, &mut oddities);
    let labels = labels_beside(keys, prefix, &mut oddities).await?;
    let about = VolumeAbout {
        kind: "ome-zarr",
        version,
        name: text(multiscale, "name").filter(|name| !name.is_empty()).map(str::to_owned),
        dtype: arrays[0].dtype,
        levels,
        left_out,
        channels,
        channel_info,
        times: arrays[0].grid.times(),
        time_step,
        time_unit: map.time.and_then(|axis| axes.get(axis)?.unit.clone()),
        unit,
        convention,
        labels,
        root: PathBuf::new(),
        is_label: attributes.get("image-label").is_some(),
        label_colors,
        value_scale: None,
        downsample: text(multiscale, "type").filter(|name| !name.is_empty()).map(str::to_owned),
        oddities: oddities.into_vec(),
        path,
    };
    Ok(Volume::new(about, arrays))
}

fn level_of(array: ZarrArray, axes: AxisMap) -> LevelArray {
    let meta = array.meta();
    let grid = Grid { shape: meta.shape.clone(), chunk: meta.chunk.clone(), axes };
    LevelArray { dtype: meta.dtype, grid, source: Arc::new(array) }
}

/// Opens the arrays of all datasets. Those that are not there, or cannot be read, are left out while any is
/// left.
async fn open_datasets(
    keys: &Arc<dyn KeyStore>,
    prefix: &str,
    path: &str,
    multiscale: &Value,
    oddities: &mut Oddities,
) -> Result<Datasets, VolumeError> {
    let datasets = list(multiscale, "datasets");
    let mut named = axes::read(list(multiscale, "axes"));
    let mut found: Vec<Found> = Vec::new();
    let mut lacking: Vec<(usize, LevelLeftOut)> = Vec::new();
    let mut first_error = None;
    let mut axes: Option<Vec<Axis>> = None;
    let mut of_all: Option<Diagonal> = None;
    for (number, dataset) in datasets.iter().take(MOST_LEVELS).enumerate() {
        let of = shortened(text(dataset, "path").unwrap_or_default());
        let left = |error| (number, LevelLeftOut { number, path: of.to_string(), error });
        let Some(name) = text(dataset, "path") else {
            oddities.push("a level is listed without a path, and is left out".into());
            lacking.push(left(damaged("a level is listed without a path").at(path)));
            continue;
        };
        let array = match open_array(keys, &join(prefix, name)).await {
            Ok(Some(array)) => array,
            Ok(None) => {
                oddities.push(format!("the level '{of}' is listed and is not there; it is left out"));
                let why = VolumeFault::NoVolume("is listed as a level and is not there; copy it, too".into());
                lacking.push(left(why.at(shown(&**keys, &join(prefix, name)))));
                continue;
            }
            Err(error) => {
                oddities.push(format!("the level '{of}' is left out: {}", error.fault));
                lacking.push(left(error.clone()));
                first_error.get_or_insert(error);
                continue;
            }
        };
        let meta = array.meta();
        oddities.extend(meta.oddities.iter().map(|odd| format!("{of}: {odd}")));
        let count = meta.shape.len();
        let transformations = list(dataset, "coordinateTransformations");
        if named.is_empty() {
            let output = transformations.first().and_then(|first| first.get("output")).and_then(output_name);
            named = axes::of_system(multiscale, output);
        }
        let own = match &axes {
            Some(axes) if axes.len() == count => axes.clone(),
            Some(axes) => {
                let why = format!("has {count} axes where another has {}", axes.len());
                oddities.push(format!("the level '{of}' {why}; it is left out"));
                lacking.push(left(damaged(format!("the level '{of}' {why}")).at(path)));
                continue;
            }
            None => fitting(named.clone(), count, oddities),
        };
        let mut said = Oddities::default();
        let map = assign(&own, &meta.shape, &mut said).map_err(|fault| fault.at(path))?;
        if axes.is_none() {
            oddities.extend(said.into_vec());
            check_names(&own, &meta.names, oddities);
        }
        axes = Some(own);
        let mut diagonal = Diagonal::identity(count);
        diagonal.apply(transformations, &of, oddities);
        let of_all = of_all.get_or_insert_with(|| of_pyramid(multiscale, count, oddities));
        diagonal.then(of_all, "all levels", oddities);
        let grid = Grid { shape: meta.shape.clone(), chunk: meta.chunk.clone(), axes: map };
        let along =
            |values: &[f64], none: f64| grid.space().map(|axis| axis.map_or(none, |axis| values[axis]));
        let stored = Stored {
            path: name.into(),
            size: grid.size(),
            scale: diagonal.is_given.then(|| along(&diagonal.scale, 1.0)),
            translation: along(&diagonal.translation, 0.0),
        };
        let time_step = map.time.filter(|_| diagonal.is_given).map(|axis| diagonal.scale[axis]);
        found.push(Found { number, array, stored, map, time_step });
    }
    match (found.is_empty(), first_error) {
        (true, Some(error)) => Err(error),
        (true, None) => Err(damaged(format!(
            "none of the {} levels that its metadata list is there; copy them, too",
            datasets.len()
        ))
        .at(path)),
        (false, _) => Ok(Datasets { found, lacking, axes: axes.unwrap_or_default() }),
    }
}

/// Gives levels that are left out their numbers among all that are listed, the finest first. `found` are the
/// places in the list of all that could be opened, in that order, those among them that do not fit the others
/// (`unfit`). Those that could not be opened (`lacking`) come by the scales that are said of them, else by
/// their places in the list, if that is in order; of others nobody knows how fine they are, and they come
/// last.
fn numbered(
    [lacking, unfit]: [Vec<(usize, LevelLeftOut)>; 2],
    datasets: &[Value],
    found: &[usize],
    is_listed_in_order: bool,
) -> Vec<LevelLeftOut> {
    let said = |place: usize| datasets.get(place).and_then(said_size);
    // Scales are believed where they tell apart what is there.
    let are_sound = found.iter().map(|place| said(*place)).is_sorted_by(
        |finer, coarser| matches!((finer, coarser), (Some(finer), Some(coarser)) if *finer < coarser * 0.999),
    );
    let is_finer = |left: usize, other: usize| match (said(left), said(other)) {
        (Some(left), Some(other)) if are_sound && (left / other - 1.0).abs() > 0.001 => left < other,
        _ => is_listed_in_order && left < other,
    };
    // Behind how many of those that could be opened each comes.
    let behind = |place: usize| found.iter().take_while(|other| !is_finer(place, **other)).count();
    let mut lacking: Vec<(usize, LevelLeftOut)> =
        lacking.into_iter().map(|(place, left)| (behind(place), left)).collect();
    let are_said = are_sound && lacking.iter().all(|(_, left)| said(left.number).is_some());
    lacking.sort_by(|(count, left), (other_count, other)| {
        let sizes = [left, other].map(|left| said(left.number).filter(|_| are_said).unwrap_or_default());
        count.cmp(other_count).then(sizes[0].total_cmp(&sizes[1]))
    });
    let before = |nth: usize| lacking.iter().filter(|(count, _)| *count <= nth).count();
    let of_unfit = unfit.into_iter().filter_map(|(place, left)| {
        let nth = found.iter().position(|other| *other == place)?;
        Some(LevelLeftOut { number: nth + before(nth), ..left })
    });
    let mut numbered: Vec<LevelLeftOut> = of_unfit.collect();
    let of_lacking = lacking.into_iter().enumerate();
    numbered.extend(of_lacking.map(|(nth, (count, left))| LevelLeftOut { number: nth + count, ..left }));
    numbered.sort_by_key(|left| left.number);
    numbered
}

/// How large voxels are by the scale that a dataset says first of all.
fn said_size(dataset: &Value) -> Option<f64> {
    let mut scales = list(dataset, "coordinateTransformations").iter().map(|of| list(of, "scale"));
    let scale = scales.find(|scale| !scale.is_empty())?;
    let sides: Option<Vec<f64>> = scale.iter().map(finite).collect();
    Some(sides?.iter().product()).filter(|size: &f64| size.is_normal() && *size > 0.0)
}

/// The transformations of all levels, which come after their own ones.
fn of_pyramid(multiscale: &Value, axes: usize, oddities: &mut Oddities) -> Diagonal {
    let mut diagonal = Diagonal::identity(axes);
    // Version 0.6 has transformations between systems there, which none of the levels' own is.
    if list(multiscale, "coordinateSystems").is_empty() {
        diagonal.apply(list(multiscale, "coordinateTransformations"), "all levels", oddities);
    }
    diagonal
}

/// Version 0.6 names a system of coordinates by its name, or by an object that has it.
fn output_name(output: &Value) -> Option<&str> {
    output.as_str().or_else(|| text(output, "name"))
}

/// Says where an array names its axes otherwise than the image does.
fn check_names(axes: &[Axis], names: &[Option<String>], oddities: &mut Oddities) {
    let differs = |(axis, name): (&Axis, &Option<String>)| {
        name.as_ref().is_some_and(|name| !axis.name.is_empty() && name.to_lowercase() != axis.name)
    };
    if axes.iter().zip(names).any(differs) {
        let names: Vec<&str> = names.iter().map(|name| name.as_deref().unwrap_or("?")).collect();
        oddities.push(format!(
            "the array calls its axes {}, and the image otherwise; the image's names are taken",
            shortened(&names.join(", "))
        ));
    }
}

/// Of levels from the finest on those that have its values, channels and times, one of each size, and the
/// others, each with its place in the list.
fn fitting_levels(
    found: Vec<Found>,
    path: &str,
    oddities: &mut Oddities,
) -> (Vec<Found>, Vec<(usize, LevelLeftOut)>) {
    let key = |found: &Found| {
        let meta = found.array.meta();
        let along = |axis: Option<usize>| axis.map_or(1, |axis| meta.shape[axis]);
        (meta.dtype, along(found.map.channel), along(found.map.time))
    };
    let first = key(&found[0]);
    let (mut fitting, mut unfit): (Vec<Found>, Vec<(usize, LevelLeftOut)>) = (Vec::new(), Vec::new());
    for level in found {
        let why = match fitting.last() {
            _ if key(&level) != first => "has other values, channels or times than the finest one".to_owned(),
            Some(before) if before.stored.size == level.stored.size => {
                format!("is as large as '{}'", shortened(&before.stored.path))
            }
            _ => {
                fitting.push(level);
                continue;
            }
        };
        let of = shortened(&level.stored.path);
        let why = format!("the level '{of}' {why}");
        oddities.push(format!("{why}; it is left out"));
        let number = level.number;
        unfit.push((number, LevelLeftOut { number, path: of, error: damaged(why).at(path) }));
    }
    (fitting, unfit)
}

/// The unit of x, in which lengths along other axes are put, too, where both units are known.
fn one_unit(
    axes: &[Axis],
    map: AxisMap,
    scales: &mut [[f64; 3]],
    translations: &mut [[f64; 3]],
    oddities: &mut Oddities,
) -> Option<String> {
    let unit = |axis: Option<usize>| axes.get(axis?)?.unit.clone();
    let one = units::one_unit(&[unit(Some(map.x)), unit(Some(map.y)), unit(map.z)]);
    oddities.extend(one.oddities);
    for value in scales.iter_mut().chain(translations.iter_mut()) {
        value.iter_mut().zip(one.factors).for_each(|(length, factor)| *length *= factor);
    }
    one.unit
}

fn channel_info(attributes: &Value, channels: u64, oddities: &mut Oddities) -> Vec<VolumeChannel> {
    let mut said = omero::read(attributes, oddities);
    if !said.is_empty() && said.len() as u64 != channels {
        oddities.push(format!("omero describes {} channels, and there are {channels}", said.len()));
        said.truncate(usize::try_from(channels).unwrap_or(usize::MAX));
    }
    let info = |omero: omero::Omero| VolumeChannel {
        name: omero.label,
        color: omero.color,
        window: omero.window,
        is_active: omero.is_active,
        is_inverted: omero.is_inverted,
    };
    said.into_iter().map(info).collect()
}

/// The names of the images of labels that lie beside an image.
async fn labels_beside(
    keys: &Arc<dyn KeyStore>,
    prefix: &str,
    oddities: &mut Oddities,
) -> Result<Vec<String>, VolumeError> {
    let group = join(prefix, "labels");
    let listed = match super::root::open_root(keys, &group).await {
        Ok(super::root::Root::Images { paths, .. }) => paths,
        Ok(super::root::Root::Group) => {
            let names = keys.groups(&group, MOST_LABELS).await?;
            if !names.is_empty() {
                oddities.push("labels/ lists no labels; the groups in it are taken".into());
            }
            names
        }
        Ok(_) => Vec::new(),
        Err(error) => {
            oddities.push(format!("labels are left out: {error}"));
            Vec::new()
        }
    };
    Ok(listed.into_iter().take(MOST_LABELS).collect())
}

/// An error for a group that is no image.
pub(crate) fn no_image(path: &str) -> VolumeError {
    VolumeFault::NoVolume(
        "is a group of Zarr without metadata of an image (multiscales); name an image or an array below it"
            .into(),
    )
    .at(path)
}
