//! How channels are to be shown, where a file says so: names, colours, windows.

use serde_json::Value;

use crate::fault::Oddities;
use crate::json::{finite, list, text};

/// What `omero` says of a channel.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Omero {
    /// The channel's name.
    pub(super) label: Option<String>,
    /// Red, green and blue.
    pub(super) color: Option<[u8; 3]>,
    /// The stored values that are shown as dark and as bright, within the bounds that the file gives; the
    /// first is below the second.
    pub(super) window: Option<[f64; 2]>,
    /// `Some(true)` if the channel is shown at first, `Some(false)` if hidden.
    pub(super) is_active: Option<bool>,
    /// True if dark and bright are exchanged.
    pub(super) is_inverted: bool,
}

/// Channels of which more is said than of others is taken: a file with more has no names for them.
const MOST_CHANNELS: usize = 4096;

/// What `omero` says, for each channel that it has.
pub(super) fn read(attributes: &Value, oddities: &mut Oddities) -> Vec<Omero> {
    let Some(omero) = attributes.get("omero") else { return Vec::new() };
    let channels = list(omero, "channels").iter().take(MOST_CHANNELS).enumerate();
    channels.map(|(n, channel)| read_channel(n, channel, oddities)).collect()
}

fn read_channel(n: usize, channel: &Value, oddities: &mut Oddities) -> Omero {
    let color = text(channel, "color").map(|color| {
        parse_color(color).or_else(|| {
            oddities.push(format!(
                "omero: the colour of channel {n} is no number of six digits, and is left out"
            ));
            None
        })
    });
    if text(channel, "color").is_some_and(|color| color.starts_with('#')) {
        oddities.push(format!("omero: the colour of channel {n} begins with '#', which is left out"));
    }
    Omero {
        label: text(channel, "label").filter(|label| !label.is_empty()).map(str::to_owned),
        color: color.flatten(),
        window: channel.get("window").and_then(|window| read_window(n, window, oddities)),
        is_active: channel.get("active").and_then(Value::as_bool),
        is_inverted: channel.get("inverted").and_then(Value::as_bool).unwrap_or(false),
    }
}

fn parse_color(color: &str) -> Option<[u8; 3]> {
    let digits = color.trim().trim_start_matches('#');
    if !matches!(digits.len(), 6 | 8) || !digits.bytes().all(|byte| byte.is_ascii_hexdigit()) {
        return None;
    }
    let number = u32::from_str_radix(&digits[..6], 16).ok()?;
    Some([16, 8, 0].map(|shift| (number >> shift) as u8))
}

fn read_window(n: usize, window: &Value, oddities: &mut Oddities) -> Option<[f64; 2]> {
    let number = |key: &str| window.get(key).and_then(finite);
    let (low, high) = (number("min"), number("max"));
    let (Some(start), Some(end)) = (number("start").or(low), number("end").or(high)) else {
        oddities.push(format!("omero: the window of channel {n} has no numbers, and is left out"));
        return None;
    };
    let (mut from, mut to) = (start, end);
    if let (Some(low), Some(high)) = (low, high)
        && low < high
    {
        (from, to) = (from.clamp(low, high), to.clamp(low, high));
        if (from, to) != (start, end) {
            oddities.push(format!(
                "omero: the window of channel {n} reaches beyond {low} to {high}; it is cut to {from} to {to}"
            ));
        }
    }
    if from >= to {
        oddities.push(format!("omero: the window of channel {n} is empty, and is left out"));
        return None;
    }
    Some([from, to])
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn channels_are_read_with_their_faults() {
        let mut odd = Oddities::default();
        let channels = read(
            &json!({"omero": {"channels": [
                {"label": "DAPI", "color": "0000FF", "active": true, "window": {"min": 0, "max": 65535, "start": 0, "end": 1500}},
                {"label": "", "color": "#ff8000", "inverted": true, "window": {"min": 0, "max": 255, "start": -5, "end": 300}},
                {"color": "red", "window": {"start": "NaN", "end": 3}}, 7
            ]}}),
            &mut odd,
        );
        assert_eq!(channels.len(), 4);
        assert_eq!((channels[0].color, channels[0].window), (Some([0, 0, 255]), Some([0.0, 1500.0])));
        assert_eq!((channels[1].color, channels[1].window), (Some([255, 128, 0]), Some([0.0, 255.0])));
        assert!(channels[1].is_inverted && channels[1].label.is_none());
        assert_eq!((channels[2].color, channels[2].window), (None, None));
        assert_eq!(read(&json!({"omero": {"channels": "none"}}), &mut odd), []);
        let odd = odd.into_vec();
        assert_eq!(odd.len(), 4, "{odd:?}");
    }
}
