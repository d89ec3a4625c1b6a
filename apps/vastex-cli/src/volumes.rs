//! Volumes for the window and for pictures of it: opened, read channel by channel and time by time, and asked
//! about their values.

mod find;
mod initial_look;
mod kept;
pub(crate) mod labels;
mod listed;
mod opening;
mod pools;

use std::path::Path;
use std::sync::Arc;

use anyhow::{Result, bail};
use glam::DVec3;
use pollster::block_on;
use vastex::{Description, Prepared, Preparer, TextureSettings};
use vastex_viewer::panels::VolumeValues;
use vastex_viewer::volume::VolumeMode;
use vastex_viewer::volume_scene::{
    ChannelFacts, LabelsPlace, PointAnswer, PointAsked, PointPlace, PointValue, VolumeFacts, VolumeLook,
};
use vastex_volume::{Opened, Volume, VolumeAbout, VolumeOptions, VolumePlane, VolumeSource, open_placed};

pub(crate) use self::labels::read_labels;
use crate::commands::render_pools::brick_side;
use crate::commands::render_volume::box_of;
use crate::disk_cache;
pub(crate) use find::find as find_label;
pub(crate) use listed::Listed;
pub(crate) use opening::{OpenHow, opens_as_volume};

/// Places along a ray that a click looks at, at most.
const MOST_SAMPLES: f64 = 512.0;
/// Of what glows, how much is let through below which nothing behind it is seen.
const HIDDEN: f64 = 0.01;

/// A volume that can be shown.
pub(crate) struct OpenedVolume {
    pub(crate) volume: Arc<Volume>,
    pub(crate) facts: VolumeFacts,
    /// A channel at a time as devices hold it at most.
    held: Description,
    how: OpenHow,
    /// Voxels along a side of a brick.
    brick: u32,
}

/// Labels beside a volume, at a time, that were read so far that they can be shown.
pub(crate) struct ReadLabels {
    pub(crate) source: Arc<VolumeSource>,
    pub(crate) prepared: Prepared,
    pub(crate) place: LabelsPlace,
}

/// Labels that are shown, for questions about a place.
pub(crate) type LabelsBelow = (Arc<VolumeSource>, LabelsPlace);

/// A channel at a time that was read so far that it can be shown.
pub(crate) struct ReadChannel {
    pub(crate) source: Arc<VolumeSource>,
    pub(crate) prepared: Prepared,
    /// Its usual range, in stored values.
    pub(crate) usual: [f64; 2],
}

/// Opens a volume, and reads what is known of it. Its values are read later. [`Listed`] is the error of what
/// lists volumes.
pub(crate) fn open_volume(path: &Path, how: OpenHow) -> Result<OpenedVolume> {
    let volume = match open_placed(path, how.origins)? {
        Opened::Volume(volume) => Arc::new(*volume),
        Opened::Images(list) => return Err(Listed(list).into()),
    };
    opening::check_channels(volume.about())?;
    let mut options = how.options(VolumeOptions::default().brick);
    let open = |options: &VolumeOptions| match volume.about().is_label {
        true => {
            Ok(VolumeSource::open(volume.clone(), &VolumeOptions { labels: Some(true), ..options.clone() })?)
        }
        false => source_of(&volume, options),
    };
    let mut source = open(&options)?;
    let mut facts = facts_of(volume.about(), &source)?;
    let shown = VolumeLook::first(&facts).shown().count().max(1) as u64 * facts.times.min(4);
    let brick = brick_side(how.pool_mib.map(|mib| mib << 20), pools::bricks_of(&pools::held(&source)), shown);
    if brick != options.brick {
        options.brick = brick;
        (source, facts.brick) = (open(&options)?, brick);
        facts.levels = Some(source.levels().clone());
    }
    if how.disk.is_some() {
        disk_cache::say_not_kept(&source);
    }
    let held = pools::held(&source);
    Ok(OpenedVolume { volume, facts, held, how, brick })
}

/// A channel at a time as a source of bricks.
fn source_of(volume: &Arc<Volume>, options: &VolumeOptions) -> Result<VolumeSource> {
    let source = VolumeSource::open(volume.clone(), options)?;
    if source.is_labels() {
        bail!("{}: these are labels, whole numbers of things, and no channel", volume.about().path);
    }
    Ok(source)
}

/// What the window is told of a volume.
fn facts_of(about: &VolumeAbout, source: &VolumeSource) -> Result<VolumeFacts> {
    let level = &about.levels[0];
    let longest = level.scale.iter().copied().fold(0.0, f64::max);
    let channel = |nth: u64| {
        let said = usize::try_from(nth).ok().and_then(|nth| about.channel_info.get(nth));
        said.map_or_else(ChannelFacts::default, |said| ChannelFacts {
            name: said.name.clone(),
            color: said.color,
            is_active: said.is_active,
        })
    };
    let codes = source.codes();
    let name = about.name.clone().unwrap_or_else(|| own_name(about));
    Ok(VolumeFacts {
        name,
        of: box_of(about)?,
        origin: level.origin,
        unit_length: longest,
        unit: about.unit.clone(),
        // Labels by themselves have no channel.
        channels: (0..about.channels).filter(|_| !about.is_label).map(channel).collect(),
        labels: if about.is_label { vec![own_name(about)] } else { about.labels.clone() },
        label_bounds: labels::bounds_of(about),
        times: about.times,
        base: codes.base,
        gain: codes.gain,
        bounds: about.dtype.bounds().map(|(least, most)| [least as f64, most as f64]),
        downsample: about.downsample.clone(),
        made_by: source.made_by().map(|rule| rule.name().to_owned()),
        brick: VolumeOptions::default().brick,
        levels: Some(source.levels().clone()),
    })
}

/// The last part of the path of a volume.
fn own_name(about: &VolumeAbout) -> String {
    let path = &about.root;
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}

impl OpenedVolume {
    /// What was wrong with its metadata, and what was made of it.
    pub(crate) fn oddities(&self) -> Vec<String> {
        self.volume.about().oddities.clone()
    }
}

/// Reads of a channel at a time what it takes to show it.
pub(crate) fn read_channel(
    opened: &OpenedVolume,
    (channel, time): (usize, u64),
    preparer: &Preparer,
) -> Result<ReadChannel> {
    let options = VolumeOptions { channel: channel as u64, time, ..opened.how.options(opened.brick) };
    let source = Arc::new(source_of(&opened.volume, &options)?);
    let settings = TextureSettings { voxels: Some(source.levels().clone()), ..TextureSettings::default() };
    let tiles = disk_cache::before_volume(&source, opened.how.disk.as_ref());
    let prepared = preparer.read_blocking(tiles, settings)?;
    let usual = usual_range(&source, channel)?;
    Ok(ReadChannel { source, prepared, usual })
}

/// Which values a channel has on a coarse level.
pub(crate) fn values_of(source: &VolumeSource) -> Result<Option<VolumeValues>> {
    Ok(VolumeValues::new(block_on(source.percentiles(&VolumeValues::shares()))?))
}

/// The stored values of a channel that are dark and bright where nobody says which.
pub(crate) fn usual_range(source: &VolumeSource, channel: usize) -> Result<[f64; 2]> {
    let about = source.volume().about();
    let window = block_on(source.usual_window())?;
    let info = about.channel_info.get(channel);
    Ok(if info.is_some_and(|info| info.is_inverted) { [window[1], window[0]] } else { window })
}

/// Answers a question about a place: exact values, of the finest level.
pub(crate) fn point(
    facts: &VolumeFacts,
    look: &VolumeLook,
    (sources, labels): (&[(usize, Arc<VolumeSource>)], Option<&LabelsBelow>),
    asked: &PointAsked,
) -> Result<PointAnswer> {
    let place = match asked.place {
        PointPlace::At(place) => Some(place),
        PointPlace::Along { from, toward, pixel } => {
            let ray = (from, toward, pixel);
            let label = match (labels, span(facts, look, from, toward)) {
                (Some(labels), Some(span)) => labels::first_along(labels, look, ray, span)?,
                _ => None,
            };
            label.map_or_else(|| along(facts, look, sources, ray), |place| Ok(Some(place)))?
        }
    };
    let extent = facts.of.extent();
    let place = place.filter(|place| place.cmpge(DVec3::ZERO).all() && place.cmple(extent).all());
    let mut told =
        PointAnswer { number: asked.number, place, voxel: [0; 3], values: Vec::new(), label: None };
    let Some(place) = place else { return Ok(told) };
    told.label = labels.map(|labels| labels::at(labels, place)).transpose()?.flatten();
    for (channel, source) in sources {
        let found = block_on(source.value_at(0, in_file(facts, place)))?;
        if let Some(found) = found {
            told.voxel = found.voxel;
            let value = found.value.to_string();
            told.values.push(PointValue { channel: *channel, value, level: found.level });
        }
    }
    Ok(told)
}

/// A place of the scene's world in the file's own system.
fn in_file(facts: &VolumeFacts, place: DVec3) -> [f64; 3] {
    std::array::from_fn(|axis| facts.origin[axis] + place[axis] * facts.unit_length)
}

/// What is seen along a ray: where a channel is brightest, where most of the light comes from, or the
/// surface.
fn along(
    facts: &VolumeFacts,
    look: &VolumeLook,
    sources: &[(usize, Arc<VolumeSource>)],
    (from, toward, pixel): (DVec3, DVec3, f64),
) -> Result<Option<DVec3>> {
    let Some([begin, end]) = span(facts, look, from, toward) else { return Ok(None) };
    let finest = facts.of.voxel.min_element().max(pixel);
    let count = ((end - begin) / finest).ceil().clamp(1.0, MOST_SAMPLES);
    let step = (end - begin) / count;
    let first = from + toward * (begin + 0.5 * step);
    let mut shown = Vec::new();
    for (channel, source) in sources {
        // The coarsest level of which no voxel is larger than a step.
        let is_fine = |level: &vastex::VoxelLevel| {
            let most = level.scale.iter().copied().fold(0.0, f64::max) / facts.unit_length;
            most <= step.max(facts.of.voxel.max_element())
        };
        let level = source.levels().levels().iter().rposition(is_fine).unwrap_or(0);
        let way = (toward * step * facts.unit_length).to_array();
        let plane = VolumePlane {
            corner: in_file(facts, first),
            right: way,
            down: [0.0; 3],
            size: [count as u32, 1],
        };
        // Pixels have their places in their middles.
        let corner = std::array::from_fn(|axis| plane.corner[axis] - 0.5 * way[axis]);
        let values = block_on(source.sample_plane(level as u8, &VolumePlane { corner, ..plane }))?;
        let Some(settings) = look.channels.get(*channel) else { continue };
        shown.push((values, settings));
    }
    let x = |nth: usize, at: usize| {
        let (values, channel) = &shown[nth];
        let stored = values[at].map(f64::from).filter(|value| value.is_finite());
        stored.map(|stored| channel.shown(stored))
    };
    let places = 0..count as usize;
    let best = match look.mode {
        VolumeMode::Mip | VolumeMode::Average => {
            let most = |at: usize| (0..shown.len()).filter_map(|nth| x(nth, at)).fold(0.0, f64::max);
            places.max_by(|a, b| most(*a).total_cmp(&most(*b)))
        }
        VolumeMode::Minip => {
            let least = |at: usize| (0..shown.len()).filter_map(|nth| x(nth, at)).fold(1.0, f64::min);
            places.min_by(|a, b| least(*a).total_cmp(&least(*b)))
        }
        VolumeMode::Emission => {
            let per_length = look.density * 100.0 / facts.of.extent().max_element();
            let (mut through, mut best) = (1.0, None::<(f64, usize)>);
            for at in places {
                let tau = |nth: usize| {
                    let a = (f64::from(shown[nth].1.opacity) * x(nth, at).unwrap_or(0.0)).min(0.999);
                    -(1.0 - a).ln() * per_length
                };
                let passed = (-(0..shown.len()).map(tau).sum::<f64>() * step).exp();
                let light = through * (1.0 - passed);
                if light > best.map_or(0.0, |(most, _)| most) {
                    best = Some((light, at));
                }
                through *= passed;
                if through < HIDDEN {
                    break;
                }
            }
            best.map(|(_, at)| at)
        }
        VolumeMode::Iso => {
            let iso = look.iso_or_middle().unwrap_or(0.5);
            let is_reached = |at: usize| {
                shown.iter().any(|(values, _)| values[at].is_some_and(|value| f64::from(value) >= iso))
            };
            places.into_iter().find(|at| is_reached(*at))
        }
    };
    Ok(best.map(|at| first + toward * (at as f64 * step)))
}

/// From where to where a ray goes through what is left of the volume.
fn span(facts: &VolumeFacts, look: &VolumeLook, from: DVec3, toward: DVec3) -> Option<[f64; 2]> {
    let clip = look.clip.of(&facts.of);
    let [least, most] = [clip.corners[0].max(DVec3::ZERO), clip.corners[1].min(facts.of.extent())];
    let (mut begin, mut end) = (0.0f64, f64::INFINITY);
    for axis in 0..3 {
        if toward[axis] == 0.0 {
            if from[axis] < least[axis] || from[axis] > most[axis] {
                return None;
            }
            continue;
        }
        let ways = [least, most].map(|corner| (corner[axis] - from[axis]) / toward[axis]);
        begin = begin.max(ways[0].min(ways[1]));
        end = end.min(ways[0].max(ways[1]));
    }
    if let Some((beyond, at)) = clip.plane {
        let (along, way) = (beyond.dot(toward), at - beyond.dot(from));
        match along {
            along if along > 0.0 => end = end.min(way / along),
            along if along < 0.0 => begin = begin.max(way / along),
            _ if way < 0.0 => return None,
            _ => {}
        }
    }
    (begin < end && end.is_finite()).then_some([begin, end])
}

#[cfg(test)]
mod tests {
    use vastex_viewer::volume::OtherLabels;

    use super::*;

    fn head() -> OpenedVolume {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/volumes/head.zip");
        open_volume(&path, OpenHow::default()).unwrap()
    }

    #[test]
    fn a_volume_says_what_the_window_needs() {
        let opened = head();
        let facts = &opened.facts;
        assert_eq!((facts.of.size, facts.channels.len(), facts.times), ([98, 116, 94], 3, 1));
        assert_eq!((facts.unit_length, facts.unit.as_deref()), (2.0, Some("millimeter")));
        assert_eq!((facts.base, facts.gain, facts.bounds), (0.0, 255.0, Some([0.0, 255.0])));
        assert!(facts.channels.iter().all(|channel| channel.name.is_some()));
    }

    #[test]
    fn the_label_at_a_place_is_told() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/volumes/nuclei.zip");
        let opened = open_volume(&path, OpenHow::default()).unwrap();
        assert_eq!(opened.facts.labels, ["nuclei"]);
        let volume = vastex_volume::open(&path.join("labels/nuclei")).unwrap();
        let Opened::Volume(volume) = volume else { panic!("no volume") };
        let options = VolumeOptions { labels: Some(true), ..VolumeOptions::default() };
        let source = Arc::new(VolumeSource::open(Arc::new(*volume), &options).unwrap());
        let place = LabelsPlace {
            of: opened.facts.of,
            begin: [0.0; 3],
            colors: Arc::default(),
            bounds: [0, 0xffff],
            levels: None,
        };
        let of = opened.facts.of;
        // What is told is what is stored of the voxel.
        let mut told = 0;
        for at in [[49.5, 92.5, 30.5], [96.5, 33.5, 30.5], [64.5, 64.5, 30.5]] {
            let world = source.levels().level(0).world_from_voxel(at);
            let stored = block_on(source.value_at(0, world)).unwrap().unwrap().value.to_string();
            let below = (source.clone(), place.clone());
            let label = labels::at(&below, DVec3::from_array(at) * of.voxel).unwrap();
            assert_eq!(label.unwrap_or(0).to_string(), stored);
            told += usize::from(label.is_some());
            // Wherever it is found by its number, it is.
            if let Some(label) = label {
                let found = find_label(&below, label, || false).unwrap().unwrap();
                assert_eq!(labels::at(&below, found).unwrap(), Some(label));
            }
        }
        assert_eq!(told, 2, "two of the places have labels");
        let below = (source.clone(), place.clone());
        assert_eq!(find_label(&below, 4_000_000_000, || false).unwrap(), None);
        // What values cannot be is none of them, also where some of its bits are.
        let there = labels::at(&below, DVec3::new(49.5, 92.5, 30.5) * of.voxel).unwrap().unwrap();
        assert_eq!(find_label(&below, there + (1 << 32), || false).unwrap(), None);
        // A ray from the face on meets the first voxel that has one, or the selected one alone.
        let mut look = VolumeLook::first(&opened.facts);
        let at = DVec3::new(49.5, 92.5, 0.0) * of.voxel;
        let (ray, span) = ((at, DVec3::Z, of.voxel.x), [0.0, of.extent().z]);
        let first = labels::first_along(&below, &look, ray, span).unwrap().unwrap();
        let label = labels::at(&below, first).unwrap();
        assert!(label.is_some() && (first.x, first.y) == (at.x, at.y));
        assert_eq!(labels::at(&below, first - DVec3::Z * of.voxel.z).unwrap(), None, "the first");
        look.labels.others = OtherLabels::Hidden;
        look.labels.selected = Some(4_000_000_000);
        assert_eq!(labels::first_along(&below, &look, ray, span).unwrap(), None);
        look.labels.selected = label;
        assert_eq!(labels::first_along(&below, &look, ray, span).unwrap(), Some(first));
    }

    #[test]
    fn a_place_is_told_with_its_values_and_a_click_finds_what_is_seen() {
        let OpenedVolume { volume, facts, .. } = head();
        let mut look = VolumeLook::first(&facts);
        let of = |nth| VolumeOptions { channel: nth as u64, ..VolumeOptions::default() };
        let sources: Vec<_> =
            (0..3).map(|nth| (nth, Arc::new(source_of(&volume, &of(nth)).unwrap()))).collect();
        look.channels.iter_mut().for_each(|channel| channel.range = Some([0.0, 255.0]));
        let ask = |look: &VolumeLook, place| {
            point(&facts, look, (&sources, None), &PointAsked { number: 7, time: 0, labels: None, place })
                .unwrap()
        };
        let middle = facts.of.extent() / 2.0 + DVec3::splat(0.1);
        let told = ask(&look, PointPlace::At(middle));
        assert_eq!((told.number, told.voxel, told.values.len()), (7, [49, 58, 47], 3));
        assert!(told.values.iter().all(|value| value.level == 0 && value.value.parse::<u8>().is_ok()));
        assert_eq!(ask(&look, PointPlace::At(DVec3::splat(-1.0))).place, None);
        // Along a ray through the middle, in each mode: what is found is on the ray, within the box.
        let ray =
            PointPlace::Along { from: DVec3::new(middle.x, middle.y, -50.0), toward: DVec3::Z, pixel: 1.0 };
        for mode in VolumeMode::ALL {
            look.mode = mode;
            let told = ask(&look, ray);
            let place = told.place.unwrap_or_else(|| panic!("{mode:?}"));
            assert!(
                (place.x, place.y) == (middle.x, middle.y) && (0.0..=94.0).contains(&place.z),
                "{mode:?}"
            );
        }
        // What is cut away is not found.
        look.clip.shares[2] = [0.9, 1.0];
        look.mode = VolumeMode::Mip;
        assert!(ask(&look, ray).place.unwrap().z >= 0.9 * 94.0);
        let aside = PointPlace::Along { from: DVec3::new(-50.0, 0.0, -50.0), toward: DVec3::Z, pixel: 1.0 };
        assert_eq!(ask(&look, aside).place, None);
    }
}
