//! The metadata of an image of OME-Zarr: axes, levels and where they lie, channels, labels.
//!
//! Translations are of the middles of first voxels: each coarser level is moved by half of what its voxels
//! are larger, so that voxels lie where they do in the source. Of one level alone they are of its corner,
//! which is how readers take them where no coarser level tells.

use serde_json::{Map, Value, json};
use vastex_volume::{DType, Reduction, VolumeAbout, VolumeChannel};

use super::arrays::{Arrays, ZarrVersion};
use crate::volume::levels::Level;

/// By what an image is known to be made here.
pub(super) const METHOD: &str = "vastex build";

/// What is said of an image: `multiscales`, `omero` and, of labels, `image-label`.
pub(super) fn image(
    about: &VolumeAbout,
    arrays: &Arrays,
    levels: &[Level],
    rule: Reduction,
    name: &str,
) -> Value {
    let axes = arrays.axes;
    let space = |name: &str| match about.unit.as_deref().map(unit) {
        Some(unit) => json!({"name": name, "type": "space", "unit": unit}),
        None => json!({"name": name, "type": "space"}),
    };
    let of_axes = axes.along(
        match about.time_unit.as_deref().map(time_unit) {
            Some(unit) => json!({"name": "t", "type": "time", "unit": unit}),
            None => json!({"name": "t", "type": "time"}),
        },
        json!({"name": "c", "type": "channel"}),
        ["x", "y", "z"].map(space),
    );
    let (finest, step) = (&about.levels[0], about.time_step.unwrap_or(1.0));
    let are_of_middles = levels.iter().any(|level| level.scale != levels[0].scale);
    let inward = if are_of_middles { 0.5 } else { 0.0 };
    let datasets: Vec<Value> = levels
        .iter()
        .enumerate()
        .map(|(number, level)| {
            let scale: [f64; 3] = std::array::from_fn(|axis| finest.scale[axis] * level.scale[axis] as f64);
            let moved: [f64; 3] = std::array::from_fn(|axis| finest.origin[axis] + inward * scale[axis]);
            let mut transformations = vec![json!({"type": "scale", "scale": axes.along(step, 1.0, scale)})];
            if moved != [0.0; 3] {
                let translation = axes.along(0.0, 0.0, moved);
                transformations.push(json!({"type": "translation", "translation": translation}));
            }
            json!({"path": number.to_string(), "coordinateTransformations": transformations})
        })
        .collect();
    let mut multiscale = Map::new();
    if arrays.version == ZarrVersion::V04 {
        multiscale.insert("version".into(), json!(arrays.version.name()));
    }
    multiscale.insert("name".into(), json!(about.name.as_deref().unwrap_or(name)));
    multiscale.insert("axes".into(), Value::Array(of_axes));
    multiscale.insert("datasets".into(), Value::Array(datasets));
    multiscale.insert("type".into(), json!(rule.name()));
    multiscale.insert(
        "metadata".into(),
        json!({
            "method": METHOD,
            "version": env!("CARGO_PKG_VERSION"),
            "description": "each level is made of the next finer one, of boxes of up to 2x2x2 voxels",
        }),
    );
    let mut said = Map::new();
    said.insert("multiscales".into(), json!([multiscale]));
    if !about.channel_info.is_empty() {
        let channels = (0..about.channels).map(|n| channel(about, n)).collect::<Vec<_>>();
        said.insert("omero".into(), json!({"channels": channels, "rdefs": {"model": "color"}}));
    }
    if about.is_label {
        said.insert("image-label".into(), json!({"source": {"image": "../../"}}));
    }
    Value::Object(said)
}

/// What is said of a channel; where nothing is known, what shows all of its values in white.
fn channel(about: &VolumeAbout, number: u64) -> Value {
    let none = VolumeChannel::default();
    let known = usize::try_from(number).ok().and_then(|number| about.channel_info.get(number));
    let channel = known.unwrap_or(&none);
    let [red, green, blue] = channel.color.unwrap_or([255; 3]);
    let bounds = about.dtype.bounds().map(|(least, most)| [least as f64, most as f64]);
    let shown = channel.window.or(bounds).unwrap_or([0.0, 1.0]);
    let [low, high] = bounds.unwrap_or(shown);
    let window = match about.dtype {
        // Of 64 bits floats know only the neighbourhood.
        DType::U64 | DType::I64 => {
            json!({"min": shown[0], "max": shown[1], "start": shown[0], "end": shown[1]})
        }
        _ => json!({"min": low, "max": high, "start": shown[0], "end": shown[1]}),
    };
    json!({
        "label": channel.name.clone().unwrap_or_else(|| format!("Channel {number}")),
        "color": format!("{red:02X}{green:02X}{blue:02X}"),
        "active": channel.is_active.unwrap_or(true),
        "inverted": channel.is_inverted,
        "coefficient": 1.0,
        "family": "linear",
        "window": window,
    })
}

/// A unit by the name that the specification has for it, where it is written otherwise.
fn unit(written: &str) -> &str {
    match written.trim() {
        "µm" | "μm" | "um" | "micron" | "microns" => "micrometer",
        "nm" => "nanometer",
        "mm" => "millimeter",
        "cm" => "centimeter",
        "m" => "meter",
        "pm" => "picometer",
        "Å" | "A" => "angstrom",
        other => other,
    }
}

/// The same of a unit of time.
fn time_unit(written: &str) -> &str {
    match written.trim() {
        "s" | "sec" | "seconds" => "second",
        "ms" | "msec" => "millisecond",
        "µs" | "μs" | "us" | "usec" => "microsecond",
        "min" | "minutes" => "minute",
        "h" | "hours" => "hour",
        other => other,
    }
}

/// The files that make a directory a group, with what is said of it: their names and what is in them.
pub(super) fn group(version: ZarrVersion, said: Option<Value>) -> Vec<(&'static str, Value)> {
    match version {
        ZarrVersion::V04 => {
            let mut files = vec![(".zgroup", json!({"zarr_format": 2}))];
            files.extend(said.map(|said| (".zattrs", said)));
            files
        }
        ZarrVersion::V05 => {
            let attributes = match said {
                Some(Value::Object(mut said)) => {
                    said.insert("version".into(), json!(version.name()));
                    json!({"ome": said})
                }
                _ => json!({}),
            };
            vec![("zarr.json", json!({"zarr_format": 3, "node_type": "group", "attributes": attributes}))]
        }
    }
}

/// Returns true if metadata of a group say that it was made here.
pub(super) fn is_ours(said: &Value) -> bool {
    let images = [&said["attributes"]["ome"]["multiscales"], &said["multiscales"]];
    images.into_iter().any(|image| image[0]["metadata"]["method"] == METHOD)
}
