//! How the uppermost layer is compared with what lies beneath it.
//!
//! What becomes of it in a picture is in layered.wgsl.

use std::fmt;
use std::str::FromStr;
use std::time::Duration;

/// How the uppermost layer that is seen is compared with those beneath it; by default not at all. Without
/// effect where fewer than two layers are seen.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum CompareMode {
    /// The layer is seen everywhere.
    #[default]
    Off,
    /// The layer is seen to the right of a line from top to bottom, at this share of the picture's width from
    /// the left, 0 to 1.
    Swipe(f32),
    /// The layer is seen for this time in seconds, 0.05 to 60, then for the same time it is not. Pages of all
    /// layers are loaded.
    Flicker(f32),
    /// All layers that are seen, side by side in panes of one width, the lowest on the left: each pane shows
    /// the same part of the image, so that texels are where they are in the other panes.
    Beside,
    /// How far the layer's colours are from those beneath, in display values (sRGB-encoded), so many times as
    /// large, 0.01 to 1000: black where they are equal.
    Difference(f32),
}

impl CompareMode {
    /// One of each kind, as it is at first.
    pub const ALL: [CompareMode; 5] = [
        CompareMode::Off,
        CompareMode::Swipe(0.5),
        CompareMode::Flicker(0.5),
        CompareMode::Difference(4.0),
        CompareMode::Beside,
    ];

    /// The mode's name, without its number.
    pub fn name(self) -> &'static str {
        match self {
            CompareMode::Off => "off",
            CompareMode::Swipe(_) => "swipe",
            CompareMode::Flicker(_) => "flicker",
            CompareMode::Difference(_) => "difference",
            CompareMode::Beside => "beside",
        }
    }

    /// The next kind, as it is at first.
    #[must_use]
    pub fn next(self) -> CompareMode {
        let kind = CompareMode::ALL.iter().position(|other| other.name() == self.name()).unwrap_or(0);
        CompareMode::ALL[(kind + 1) % CompareMode::ALL.len()]
    }

    /// The comparison at a time that grows from picture to picture: a flicker becomes a line at one of the
    /// edges.
    #[must_use]
    pub fn at(self, time: Duration) -> CompareMode {
        match self {
            CompareMode::Flicker(seconds) => {
                let turns = (time.as_secs_f64() / f64::from(seconds.max(0.05))) as u64;
                CompareMode::Swipe(if turns.is_multiple_of(2) { 0.0 } else { 1.0 })
            }
            mode => mode,
        }
    }

    /// How long after a time something else is seen; `None` if nothing changes by itself.
    pub fn changes_after(self, time: Duration) -> Option<Duration> {
        let CompareMode::Flicker(seconds) = self else { return None };
        let period = f64::from(seconds.max(0.05));
        let left = period - time.as_secs_f64() % period;
        Some(Duration::from_secs_f64(left.clamp(0.0, 60.0)))
    }

    /// The share of the picture's width to the left of which the layer is not seen, and by how much its
    /// difference is magnified, 0 for none.
    pub(super) fn told(self) -> [f32; 2] {
        match self {
            CompareMode::Off | CompareMode::Flicker(_) | CompareMode::Beside => [0.0, 0.0],
            CompareMode::Swipe(at) => [at, 0.0],
            CompareMode::Difference(gain) => [0.0, gain],
        }
    }

    /// Returns true if the layer is seen by itself, and what lies beneath it elsewhere or at another time.
    pub(super) fn takes_turns(self) -> bool {
        matches!(self, CompareMode::Swipe(_) | CompareMode::Flicker(_))
    }
}

/// The name, and the number after a colon, as it is read.
impl fmt::Display for CompareMode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            CompareMode::Off | CompareMode::Beside => f.write_str(self.name()),
            CompareMode::Swipe(number) | CompareMode::Flicker(number) | CompareMode::Difference(number) => {
                write!(f, "{}:{number}", self.name())
            }
        }
    }
}

/// A text names no way of comparing layers, or its number is out of range.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "write off, swipe[:AT] with a share of the width from 0 to 1, flicker[:SECONDS] with 0.05 to 60, difference[:TIMES] with 0.01 \
     to 1000, or beside"
)]
pub struct ParseCompareModeError;

impl FromStr for CompareMode {
    type Err = ParseCompareModeError;

    fn from_str(text: &str) -> Result<CompareMode, ParseCompareModeError> {
        let (name, number) = text.split_once(':').map_or((text, None), |(name, number)| (name, Some(number)));
        let kind =
            CompareMode::ALL.into_iter().find(|mode| mode.name() == name).ok_or(ParseCompareModeError)?;
        let Some(number) = number else { return Ok(kind) };
        let number: f32 = number.parse().map_err(|_| ParseCompareModeError)?;
        let (mode, range) = match kind {
            CompareMode::Off | CompareMode::Beside => return Err(ParseCompareModeError),
            CompareMode::Swipe(_) => (CompareMode::Swipe(number), 0.0..=1.0),
            CompareMode::Flicker(_) => (CompareMode::Flicker(number), 0.05..=60.0),
            CompareMode::Difference(_) => (CompareMode::Difference(number), 0.01..=1000.0),
        };
        range.contains(&number).then_some(mode).ok_or(ParseCompareModeError)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn modes_are_read_as_they_are_written() {
        for mode in
            CompareMode::ALL.into_iter().chain([CompareMode::Swipe(0.25), CompareMode::Difference(64.0)])
        {
            assert_eq!(mode.to_string().parse(), Ok(mode));
        }
        assert_eq!("swipe".parse(), Ok(CompareMode::Swipe(0.5)));
        for bad in [
            "",
            "wipe",
            "off:1",
            "swipe:",
            "swipe:2",
            "swipe:nan",
            "flicker:0",
            "difference:-1",
            "difference:x",
            "beside:2",
        ] {
            assert_eq!(bad.parse::<CompareMode>(), Err(ParseCompareModeError), "{bad}");
        }
        assert_eq!(CompareMode::Difference(9.0).next(), CompareMode::Beside);
        assert_eq!(CompareMode::Beside.next(), CompareMode::Off);
    }

    #[test]
    fn what_flickers_is_seen_for_as_long_as_it_is_not() {
        let mode = CompareMode::Flicker(0.5);
        for (ms, seen, left) in [(0, 0.0, 500), (499, 0.0, 1), (500, 1.0, 500), (1250, 0.0, 250)] {
            let time = Duration::from_millis(ms);
            assert_eq!(mode.at(time), CompareMode::Swipe(seen), "{ms}");
            assert_eq!(mode.changes_after(time).unwrap().as_secs_f64(), f64::from(left) / 1000.0, "{ms}");
        }
        assert_eq!(CompareMode::Swipe(0.5).changes_after(Duration::ZERO), None);
    }
}
