//! What a container says of the volume in it beside its shape: as JSON, both ways.

use serde_json::{Value, json};
use vastex_core::Level;
use vastex_tiles::ContainerVolume;

use crate::json::{finite, list, text};
use crate::reduce::Reduction;
use crate::values::DType;
use crate::volume::{Convention, Volume, VolumeChannel, VolumeLevel};

/// Channels of which something is said at most.
const MOST_CHANNELS: usize = 4096;
/// Bytes of a name that are kept.
const MOST_NAME: usize = 1000;

/// The number that a kind of values has in a container: its place among [`DType::ALL`], from 1 on.
fn number_of(dtype: DType) -> u8 {
    DType::ALL.iter().position(|other| *other == dtype).map_or(0, |place| place as u8 + 1)
}

/// The kind of values of a number.
pub(super) fn dtype_of(number: u8) -> Option<DType> {
    DType::ALL.get(usize::from(number).checked_sub(1)?).copied()
}

/// What a container that is made of a volume says of it. `fill` are the bytes of one value, and `times` how
/// many times are built; `None` if there are more channels or times than a container can have.
pub fn container_volume(volume: &Volume, rule: Reduction, fill: &[u8]) -> Option<ContainerVolume> {
    let about = volume.about();
    let level = &about.levels[0];
    let mut bytes = [0; 8];
    bytes.iter_mut().zip(fill).for_each(|(to, from)| *to = *from);
    let channels: Vec<Value> = about.channel_info.iter().take(MOST_CHANNELS).map(channel_value).collect();
    let said = json!({
        "name": about.name.as_deref().map(shortened),
        "unit": about.unit.as_deref().map(shortened),
        "time_step": about.time_step,
        "time_unit": about.time_unit.as_deref().map(shortened),
        "scale": level.scale,
        "origin": level.origin,
        "convention": about.convention.name(),
        "label": about.is_label,
        "value_scale": about.value_scale,
        "downsample": rule.name(),
        "channels": channels,
    });
    Some(ContainerVolume {
        channels: about.channels.try_into().ok()?,
        times: about.times.try_into().ok()?,
        values: number_of(about.dtype),
        fill: bytes,
        about: said.to_string(),
    })
}

fn shortened(name: &str) -> &str {
    let mut end = name.len().min(MOST_NAME);
    while !name.is_char_boundary(end) {
        end -= 1;
    }
    &name[..end]
}

fn channel_value(channel: &VolumeChannel) -> Value {
    let color = channel.color.map(|[red, green, blue]| format!("{red:02X}{green:02X}{blue:02X}"));
    json!({
        "name": channel.name.as_deref().map(shortened),
        "color": color,
        "window": channel.window,
        "active": channel.is_active,
        "inverted": channel.is_inverted,
    })
}

/// What is said.
pub(super) struct About {
    pub(super) name: Option<String>,
    pub(super) unit: Option<String>,
    pub(super) time_step: Option<f64>,
    pub(super) time_unit: Option<String>,
    scale: [f64; 3],
    origin: [f64; 3],
    pub(super) convention: Convention,
    pub(super) is_label: bool,
    pub(super) value_scale: Option<[f64; 2]>,
    pub(super) downsample: Option<String>,
    pub(super) channels: Vec<VolumeChannel>,
}

impl About {
    /// Reads it; what makes no sense is said, and is as if it were not there.
    pub(super) fn read(said: &str, oddities: &mut Vec<String>) -> About {
        let said: Value = serde_json::from_str(said).unwrap_or_else(|error| {
            oddities.push(format!("what the container says of the volume is no sound JSON: {error}"));
            Value::Null
        });
        let numbers = |key: &str| numbers::<3>(&said[key]);
        let scale = numbers("scale").filter(|scale| scale.iter().all(|side| *side > 0.0));
        if scale.is_none() {
            oddities.push("the container says no size of voxels; 1 is taken".into());
        }
        let owned =
            |value: &Value, key: &str| text(value, key).filter(|name| !name.is_empty()).map(str::to_owned);
        About {
            name: owned(&said, "name"),
            unit: owned(&said, "unit"),
            time_step: finite(&said["time_step"]).filter(|step| *step > 0.0),
            time_unit: owned(&said, "time_unit"),
            scale: scale.unwrap_or([1.0; 3]),
            origin: numbers("origin").unwrap_or_default(),
            convention: match text(&said, "convention") {
                Some("center") => Convention::Center,
                _ => Convention::Corner,
            },
            is_label: said["label"].as_bool().unwrap_or(false),
            value_scale: self::numbers::<2>(&said["value_scale"]),
            downsample: owned(&said, "downsample"),
            channels: list(&said, "channels").iter().take(MOST_CHANNELS).map(channel).collect(),
        }
    }
}

/// So many finite numbers.
fn numbers<const N: usize>(value: &Value) -> Option<[f64; N]> {
    let numbers: Vec<f64> = value.as_array()?.iter().map(finite).collect::<Option<_>>()?;
    numbers.try_into().ok()
}

fn channel(said: &Value) -> VolumeChannel {
    let digits = text(said, "color").filter(|color| color.len() == 6);
    let number = digits.and_then(|digits| u32::from_str_radix(digits, 16).ok());
    VolumeChannel {
        name: text(said, "name").filter(|name| !name.is_empty()).map(str::to_owned),
        color: number.map(|number| [16, 8, 0].map(|shift| (number >> shift) as u8)),
        window: numbers::<2>(&said["window"]).filter(|[low, high]| low < high),
        is_active: said["active"].as_bool(),
        is_inverted: said["inverted"].as_bool().unwrap_or(false),
    }
}

/// A level where the volume says that its voxels lie.
pub(super) fn level_of(about: &About, level: &Level, number: u8, chunk: [u64; 3]) -> VolumeLevel {
    VolumeLevel {
        path: number.to_string(),
        size: level.size.map(u64::from),
        scale: std::array::from_fn(|axis| about.scale[axis] * level.scale[axis] as f64),
        origin: about.origin,
        chunk,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kinds_of_values_have_numbers() {
        for dtype in DType::ALL {
            assert_eq!(dtype_of(number_of(dtype)), Some(dtype));
        }
        assert_eq!((dtype_of(0), dtype_of(13)), (None, None));
    }

    #[test]
    fn what_makes_no_sense_is_left_out() {
        let mut odd = Vec::new();
        for said in [
            "",
            "[]",
            "{\"scale\": [1, 2]}",
            "{\"scale\": [1, -2, 3]}",
            "{\"channels\": [7, {\"color\": \"ä\"}]}",
        ] {
            let about = About::read(said, &mut odd);
            assert_eq!((about.scale, about.origin), ([1.0; 3], [0.0; 3]), "{said}");
        }
        assert_eq!(odd.len(), 6);
        assert_eq!(shortened(&"ä".repeat(600)).len(), 1000);
    }
}
