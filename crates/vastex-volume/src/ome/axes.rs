//! Axes: which of an array's is x, y, z, a channel or a time, by their types first, then by their names.

use serde_json::Value;

use crate::chunks::AxisMap;
use crate::fault::{Oddities, VolumeFault, damaged};
use crate::json::{list, text};
use crate::zarr::shortened;

/// The axes that versions 0.1 and 0.2 have.
const OLD: [&str; 5] = ["t", "c", "z", "y", "x"];

/// What metadata say of an axis.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Axis {
    /// In small letters.
    pub(crate) name: String,
    /// `space`, `time`, `channel` or whatever else, in small letters.
    pub(crate) kind: Option<String>,
    pub(crate) unit: Option<String>,
}

/// The axes of names alone.
pub(crate) fn axes_of_names(names: &[Option<String>]) -> Vec<Axis> {
    let axis = |name: &Option<String>| Axis {
        name: name.clone().unwrap_or_default().to_lowercase(),
        ..Axis::default()
    };
    names.iter().map(axis).collect()
}

/// The axes that a list of them names: of objects, or, in version 0.3, of texts.
pub(super) fn read(axes: &[Value]) -> Vec<Axis> {
    let lowered = |value: &Value, key: &str| text(value, key).map(str::to_lowercase);
    let axis = |value: &Value| match value.as_str() {
        Some(name) => Axis { name: name.to_lowercase(), ..Axis::default() },
        None => Axis {
            name: lowered(value, "name").unwrap_or_default(),
            kind: lowered(value, "type"),
            unit: text(value, "unit").map(str::to_owned),
        },
    };
    axes.iter().map(axis).collect()
}

/// The axes of a system of coordinates of version 0.6: of the one with that name, else of the first.
pub(super) fn of_system(multiscale: &Value, name: Option<&str>) -> Vec<Axis> {
    let systems = list(multiscale, "coordinateSystems");
    let named = name.and_then(|name| systems.iter().find(|system| text(system, "name") == Some(name)));
    named.or(systems.first()).map_or(Vec::new(), |system| read(list(system, "axes")))
}

/// As many axes as an array has: those that are named, or the old ones where there are none.
pub(super) fn fitting(mut axes: Vec<Axis>, count: usize, oddities: &mut Oddities) -> Vec<Axis> {
    if axes.is_empty() {
        let names: Vec<&str> = OLD.iter().copied().skip(OLD.len().saturating_sub(count)).collect();
        if count != OLD.len() {
            oddities.push(format!(
                "no axes are named, and the array has {count}: {} are taken",
                names.join(", ")
            ));
        }
        axes = names.iter().map(|name| Axis { name: (*name).into(), ..Axis::default() }).collect();
    }
    if axes.len() != count {
        oddities.push(format!(
            "{} axes are named, and the array has {count}: the last ones are taken",
            axes.len()
        ));
        axes.drain(..axes.len().saturating_sub(count));
        while axes.len() < count {
            axes.insert(0, Axis::default());
        }
    }
    axes
}

/// Finds out which axis is what. Axes that mean nothing known are read at 0, which is said where they are
/// longer than that.
pub(crate) fn assign(axes: &[Axis], shape: &[u64], oddities: &mut Oddities) -> Result<AxisMap, VolumeFault> {
    let named = |names: &[&str], axis: &Axis| names.contains(&axis.name.as_str());
    let find = |kind: &str, names: &[&str]| {
        let typed = axes.iter().position(|axis| axis.kind.as_deref() == Some(kind));
        typed.or_else(|| axes.iter().position(|axis| !is_spatial(axis) && named(names, axis)))
    };
    let time = find("time", &["t", "time", "frame"]);
    let channel = find("channel", &["c", "channel", "channels", "ch"]).filter(|axis| Some(*axis) != time);
    let of_space = |axis: &usize| {
        let is_other = Some(*axis) == time || Some(*axis) == channel;
        let is_unnamed = axes[*axis].kind.is_none() && axes[*axis].name.is_empty();
        !is_other && (is_spatial(&axes[*axis]) || named(&["x", "y", "z"], &axes[*axis]) || is_unnamed)
    };
    let spatial: Vec<usize> = (0..axes.len()).filter(of_space).collect();
    let by_name = |name: &str| spatial.iter().copied().find(|axis| axes[*axis].name == name);
    let (x, y, z) = match (by_name("x"), by_name("y"), by_name("z")) {
        // Without z, a third axis of space is it.
        (Some(x), Some(y), z) => {
            (x, y, z.or_else(|| spatial.iter().copied().rev().find(|axis| *axis != x && *axis != y)))
        }
        _ => {
            let mut last = spatial.iter().rev().copied();
            let (Some(x), Some(y)) = (last.next(), last.next()) else {
                let names: Vec<&str> = axes.iter().map(|axis| axis.name.as_str()).collect();
                return Err(damaged(format!(
                    "among the axes '{}' are not two of space; name x and y among them",
                    shortened(&names.join(", "))
                )));
            };
            oddities
                .push("no axes of space are called x and y; the last ones are taken for x, y and z".into());
            (x, y, last.next())
        }
    };
    let map = AxisMap { x, y, z, channel, time };
    let used = [Some(x), Some(y), z, channel, time];
    for (axis, side) in shape.iter().enumerate() {
        if !used.contains(&Some(axis)) && *side > 1 {
            oddities.push(format!(
                "the axis '{}' of {side} is none of t, c, z, y and x: only its first place is read",
                shortened(&axes[axis].name)
            ));
        }
    }
    Ok(map)
}

fn is_spatial(axis: &Axis) -> bool {
    axis.kind.as_deref() == Some("space")
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn assigned(axes: &Value, shape: &[u64]) -> ([Option<usize>; 5], Vec<String>) {
        let mut oddities = Oddities::default();
        let axes = fitting(read(axes.as_array().unwrap()), shape.len(), &mut oddities);
        let map = assign(&axes, shape, &mut oddities).unwrap();
        ([map.time, map.channel, map.z, Some(map.y), Some(map.x)], oddities.into_vec())
    }

    #[test]
    fn types_come_before_names() {
        let axes = json!([
            {"name": "z", "type": "channel"}, {"name": "depth", "type": "space"}, {"name": "Y", "type": "space"},
            {"name": "X", "type": "space", "unit": "nanometer"}
        ]);
        assert_eq!(assigned(&axes, &[2, 3, 4, 5]), ([None, Some(0), Some(1), Some(2), Some(3)], vec![]));
    }

    #[test]
    fn old_versions_and_odd_names_are_understood() {
        assert_eq!(assigned(&json!([]), &[1; 5]), ([Some(0), Some(1), Some(2), Some(3), Some(4)], vec![]));
        assert_eq!(
            assigned(&json!(["c", "y", "x"]), &[1; 3]),
            ([None, Some(0), None, Some(1), Some(2)], vec![])
        );
        assert_eq!(assigned(&json!(["y", "x"]), &[1; 2]).0, [None, None, None, Some(0), Some(1)]);
        assert_eq!(assigned(&json!(["x", "y", "z"]), &[1; 3]).0, [None, None, Some(2), Some(1), Some(0)]);
        let (map, odd) = assigned(&json!([]), &[1; 3]);
        assert!(map == [None, None, Some(0), Some(1), Some(2)] && odd.len() == 1);
        let unnamed = json!([{"type": "space", "name": "a"}, {"type": "space", "name": "b"}, {"type": "space", "name": "c"}]);
        let (map, odd) = assigned(&unnamed, &[1; 3]);
        assert!(map == [None, None, Some(0), Some(1), Some(2)] && odd.len() == 1, "{map:?} {odd:?}");
        let (map, odd) = assigned(&json!(["phase", "c", "y", "x"]), &[3, 2, 1, 1]);
        assert!(
            map == [None, Some(1), None, Some(2), Some(3)] && odd[0].contains("'phase' of 3"),
            "{map:?} {odd:?}"
        );
    }

    #[test]
    fn a_line_is_no_volume() {
        let axes = read(&[json!("c"), json!("x")]);
        assert!(assign(&axes, &[1, 1], &mut Oddities::default()).is_err());
    }
}
