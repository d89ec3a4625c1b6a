//! What pictures of labels must be, in `f64` over whole arrays, as docs/volumes.md says it: every plane of
//! voxels that a ray crosses is looked for, and the pieces between them are gone through in order.

use glam::DVec3;
use vastex_viewer::volume::{OtherLabels, VolumeBox, VolumeLabels, VolumeView};

use super::volume_reference::{display, light_of};

/// A level as an array.
pub(crate) struct LabelLevel {
    pub(crate) size: [u32; 3],
    /// Voxels of level 0 along one of this level.
    pub(crate) scale: [f64; 3],
    pub(crate) labels: Vec<u64>,
}

impl LabelLevel {
    /// The label of a voxel; beyond the faces that of the last one.
    pub(crate) fn voxel(&self, at: [i64; 3]) -> u64 {
        let [x, y, z]: [usize; 3] =
            std::array::from_fn(|a| at[a].clamp(0, i64::from(self.size[a]) - 1) as usize);
        self.labels[(z * self.size[1] as usize + y) * self.size[0] as usize + x]
    }

    /// The voxel that a place in the world of the labels lies in.
    fn at(&self, of: &VolumeBox, place: DVec3) -> [i64; 3] {
        std::array::from_fn(|a| (place[a] / (of.voxel[a] * self.scale[a])).floor() as i64)
    }
}

/// A picture with labels over `under`, which is codes of red, green and blue.
pub(crate) fn over(
    under: &[[f64; 3]],
    labels: &VolumeLabels,
    levels: &[LabelLevel],
    (of, view, size): (&VolumeBox, &VolumeView, [u32; 2]),
) -> Vec<[f64; 3]> {
    let rays = view.rays(of, size);
    let pixels = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x, y)));
    let drawn = pixels.zip(under).map(|((x, y), under)| {
        let (x, y) = (f64::from(x) + 0.5, f64::from(y) + 0.5);
        let along = |of: [DVec3; 3]| of[0] + of[1] * x + of[2] * y;
        let origin = along(rays.origin) - DVec3::from_array(labels.begin);
        let direction = along(rays.toward).normalize();
        let light = DVec3::from_array(under.map(|code| light_of(code / 255.0)));
        let shown = match view {
            VolumeView::Slice { axis, .. } => {
                slice(light, labels, level_at(labels, levels, rays.pixel), (origin, usize::from(*axis)))
            }
            _ => {
                let pixel = |way: f64| rays.pixel + rays.growth * way;
                ray(light, labels, levels, (origin, direction), &pixel)
            }
        };
        shown.to_array().map(|light| 255.0 * display(light))
    });
    drawn.collect()
}

fn level_at<'a>(labels: &VolumeLabels, levels: &'a [LabelLevel], pixel: f64) -> &'a LabelLevel {
    let voxel = labels.of.voxel;
    let is_fit =
        |level: &&LabelLevel| (0..3).all(|a| level.scale[a] * voxel[a] <= 1.00001 * pixel.max(voxel[a]));
    levels.iter().rev().find(is_fit).unwrap_or(&levels[0])
}

fn is_drawn(labels: &VolumeLabels, label: u64) -> bool {
    let is_hidden = labels.others == OtherLabels::Hidden && labels.selected.is_some_and(|one| one != label);
    label != 0 && !is_hidden && labels.colors.of(label)[3] > 0
}

fn mixed(light: DVec3, labels: &VolumeLabels, label: u64, lit: f64) -> DVec3 {
    let [red, green, blue, alpha] = labels.colors.of(label).map(|code| f64::from(code) / 255.0);
    let opacity = match labels.selected {
        None => f64::from(labels.opacity),
        Some(selected) if selected == label => 1.0,
        Some(_) => f64::from(labels.opacity) * 0.25,
    };
    let color = DVec3::from_array([red, green, blue].map(light_of)) * lit;
    light + (color - light) * (alpha * opacity)
}

fn slice(light: DVec3, labels: &VolumeLabels, level: &LabelLevel, (at, axis): (DVec3, usize)) -> DVec3 {
    let extent = labels.of.extent();
    if !(0..3).all(|a| (0.0..extent[a]).contains(&at[a])) {
        return light;
    }
    let voxel = level.at(&labels.of, at);
    let label = level.voxel(voxel);
    let beside = |a: usize, by: i64| {
        let mut beside = voxel;
        beside[a] += by;
        level.voxel(beside) != label
    };
    let is_edge = (0..3).filter(|a| *a != axis).any(|a| beside(a, 1) || beside(a, -1));
    match is_drawn(labels, label) && (is_edge || !labels.outlines) {
        true => mixed(light, labels, label, 1.0),
        false => light,
    }
}

fn ray(
    light: DVec3,
    labels: &VolumeLabels,
    levels: &[LabelLevel],
    (origin, direction): (DVec3, DVec3),
    pixel: &dyn Fn(f64) -> f64,
) -> DVec3 {
    let extent = labels.of.extent();
    let (mut begin, mut end) = (0.0f64, f64::INFINITY);
    let mut face = None;
    for a in 0..3 {
        if direction[a] == 0.0 {
            if !(0.0..extent[a]).contains(&origin[a]) {
                return light;
            }
            continue;
        }
        let ways = [0.0, extent[a]].map(|side| (side - origin[a]) / direction[a]);
        if ways[0].min(ways[1]) > begin {
            (begin, face) = (ways[0].min(ways[1]), Some(a));
        }
        end = end.min(ways[0].max(ways[1]));
    }
    if begin >= end {
        return light;
    }
    let level = level_at(labels, levels, pixel(begin));
    assert_eq!(level.size, level_at(labels, levels, pixel(end)).size, "one level along the ray");
    // Where planes between voxels are crossed, and which.
    let mut crossings = vec![(begin, face)];
    for a in (0..3).filter(|a| direction[*a] != 0.0) {
        let planes = (0..=level.size[a]).map(|n| f64::from(n) * level.scale[a] * labels.of.voxel[a]);
        let ways = planes.map(|plane| (plane - origin[a]) / direction[a]);
        crossings.extend(ways.filter(|way| (begin..end).contains(way)).map(|way| (way, Some(a))));
    }
    crossings.sort_by(|a, b| a.0.total_cmp(&b.0));
    let ends = crossings.iter().skip(1).map(|(way, _)| *way).chain([end]);
    let pieces: Vec<_> = crossings.iter().zip(ends).filter(|((begin, _), end)| end - begin > 1e-9).collect();
    let first = |is_one: &dyn Fn(u64) -> bool| {
        pieces.iter().find_map(|((begin, face), end)| {
            let voxel = level.at(&labels.of, origin + direction * (0.5 * (begin + end)));
            let label = level.voxel(voxel);
            is_one(label).then(|| (label, lit(level, labels, (voxel, label), *face, direction)))
        })
    };
    let mut light = light;
    if let Some(selected) = labels.selected {
        let found = first(&|label| label == selected && is_drawn(labels, label));
        light = found.map_or(light, |(label, lit)| mixed(light, labels, label, lit));
    }
    match first(&|label| is_drawn(labels, label)) {
        Some((label, lit)) if Some(label) != labels.selected => mixed(light, labels, label, lit),
        _ => light,
    }
}

/// By the side of a label that is seen, from the 26 voxels around it.
fn lit(
    level: &LabelLevel,
    labels: &VolumeLabels,
    (voxel, label): ([i64; 3], u64),
    face: Option<usize>,
    toward: DVec3,
) -> f64 {
    let mut slope = DVec3::ZERO;
    for nth in 0..27 {
        let way: [i64; 3] = [nth % 3 - 1, nth / 3 % 3 - 1, nth / 9 - 1];
        if level.voxel(std::array::from_fn(|a| voxel[a] + way[a])) == label {
            for a in 0..3 {
                let weight = (0..3).filter(|b| *b != a).map(|b| 2 - way[b].abs()).product::<i64>();
                slope[a] += (way[a] * weight) as f64 / (level.scale[a] * labels.of.voxel[a]);
            }
        }
    }
    match (slope == DVec3::ZERO, face) {
        (false, _) => 0.2 + 0.8 * slope.normalize().dot(toward).abs(),
        (true, Some(face)) => 0.2 + 0.8 * toward[face].abs(),
        (true, None) => 1.0,
    }
}
