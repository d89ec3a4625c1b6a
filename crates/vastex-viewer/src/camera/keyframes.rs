//! Camera paths that are written down: places of a camera at times, in a small text that a person can edit.
//!
//! ```text
//! vastex path 1
//! # what follows a # is for people
//! fps 30
//! 0    image:x=5400,y=2700,zoom=1
//! 2.5  image:x=6120.5,y=1310,zoom=24
//! 4    image:x=6120.5,y=1310,zoom=24,turn=90
//! ```
//!
//! The first line says what it is. A line `fps N` says how many pictures a second has (30 where none says
//! so). Every other line has a time in seconds, later than that of the line before, and where the camera is
//! then, as [`Pose::to_text`] writes it; all of them in one scene. Between two of them the camera goes
//! smoothly, and passes through each; it never goes beyond what they say, so that two alike are a rest. Zooms
//! and heights above a globe change by even factors, and angles by the shorter way round.

use std::f64::consts::TAU;

use super::places::{PathChannels, PathPlace};
use super::pose::Pose;

/// The first line of every path.
const HEAD: &str = "vastex path 1";
/// Pictures a second where nothing is said of it.
const USUAL_RATE: f64 = 30.0;
const LEAST_RATE: f64 = 0.1;
const MOST_RATE: f64 = 1000.0;
/// The latest time, in seconds, and the most lines with a time.
const LATEST: f64 = 86_400.0;
const MOST_KEYS: usize = 100_000;
/// How far what is left out of a recording may lie from where the camera was: in halves of the view's height
/// and in angles.
pub(crate) const TOLERANCE: f64 = 0.002;

/// A text is no camera path.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: {why}")]
pub struct CameraPathError {
    /// The line, counted from 1.
    pub line: usize,
    /// What is wrong there, and what to write instead.
    pub why: String,
}

/// Where a camera is at some times, and so at any time between: over an image, or around a volume
/// ([`VolumePlace`](crate::VolumePlace)).
#[derive(Clone, Debug, PartialEq)]
pub struct CameraPath<P = Pose> {
    rate: f64,
    /// In the order of their times; one at least, and all of one kind.
    keys: Vec<(f64, P)>,
    first: P,
    /// What goes smoothly from one to the next, by key.
    channels: Vec<PathChannels>,
    slopes: Vec<PathChannels>,
}

impl<P: PathPlace> CameraPath<P> {
    /// A path through poses at times in seconds, with `rate` pictures a second. `None` if there is none,
    /// where times do not grow from 0 on, or where poses are of several scenes.
    pub fn new(rate: f64, keys: Vec<(f64, P)>) -> Option<CameraPath<P>> {
        let (_, first) = *keys.first()?;
        let is_of_one_kind = keys.iter().all(|(_, pose)| pose.kind() == first.kind());
        let grows = keys.windows(2).all(|pair| pair[0].0 < pair[1].0);
        let is_timed = keys.iter().all(|(time, _)| (0.0..=LATEST).contains(time));
        let is_rated = (LEAST_RATE..=MOST_RATE).contains(&rate);
        if !(is_of_one_kind && grows && is_timed && is_rated && keys.len() <= MOST_KEYS) {
            return None;
        }
        let channels = continuous(&keys);
        let times: Vec<f64> = keys.iter().map(|(time, _)| *time).collect();
        let slopes = slopes(&times, &channels);
        Some(CameraPath { rate, keys, first, channels, slopes })
    }

    /// Reads a path whose places `parse` reads; `example` is the text of one.
    pub(crate) fn read(
        text: &str,
        parse: impl Fn(&str) -> Result<P, String>,
        example: &str,
    ) -> Result<CameraPath<P>, CameraPathError> {
        let error = |line: usize, why: String| CameraPathError { line, why };
        let (mut rate, mut keys, mut has_head) = (None, Vec::<(f64, P)>::new(), false);
        let mut last = 1;
        for (number, line) in (1..).zip(text.lines()) {
            // A byte order mark is how some editors begin.
            let line = line.trim_start_matches('\u{feff}').split('#').next().unwrap_or_default().trim();
            if line.is_empty() {
                continue;
            }
            last = number;
            if !has_head {
                if line.split_whitespace().ne(HEAD.split(' ')) {
                    return Err(error(number, format!("a camera path begins with the line '{HEAD}'")));
                }
                has_head = true;
                continue;
            }
            let (word, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
            let rest = rest.trim();
            if word == "fps" {
                let known = rest.parse().ok().filter(|rate| (LEAST_RATE..=MOST_RATE).contains(rate));
                let Some(known) = known else {
                    let why = format!(
                        "'{rest}' is no rate: write pictures a second, {LEAST_RATE} to {MOST_RATE}, as in 'fps 30'"
                    );
                    return Err(error(number, why));
                };
                if rate.replace(known).is_some() {
                    return Err(error(number, "fps is told twice".into()));
                }
                continue;
            }
            let time = word.parse::<f64>().ok().filter(|time| (0.0..=LATEST).contains(time));
            let Some(time) = time else {
                let why = format!(
                    "'{word}' is no time: write seconds, 0 to {LATEST}, and where the camera is then, as in '2.5 {example}'"
                );
                return Err(error(number, why));
            };
            let pose = parse(rest).map_err(|why| error(number, why))?;
            if let Some((before, other)) = keys.last() {
                if *before >= time {
                    return Err(error(
                        number,
                        format!("{time} s is not later than the {before} s before it"),
                    ));
                }
                if other.kind() != pose.kind() {
                    let (this, other) = (pose.kind(), other.kind());
                    let why = format!(
                        "a view of {this} after one of {other}: a path has one scene, and each line says as much as the others"
                    );
                    return Err(error(number, why));
                }
            }
            if keys.len() == MOST_KEYS {
                return Err(error(number, format!("a path has at most {MOST_KEYS} places")));
            }
            keys.push((time, pose));
        }
        if !has_head {
            return Err(error(1, format!("a camera path begins with the line '{HEAD}'")));
        }
        let none = || error(last, format!("the path has no place: add a line such as '0 {example}'"));
        CameraPath::new(rate.unwrap_or(USUAL_RATE), keys).ok_or_else(none)
    }

    /// The text of the path, whose places `text_of` writes.
    pub(crate) fn written(&self, text_of: impl Fn(&P) -> String) -> String {
        let mut text = format!("{HEAD}\n# seconds, and where the camera is then\nfps {}\n", self.rate);
        for (time, pose) in &self.keys {
            text += &format!("{time} {}\n", text_of(pose));
        }
        text
    }

    /// How long the path takes, in seconds.
    pub fn seconds(&self) -> f64 {
        self.keys.last().map_or(0.0, |(time, _)| *time)
    }

    /// Pictures that the path has, the first and the last among them.
    pub fn frames(&self) -> u64 {
        // What a rate and a time come to is a whole number wherever a person means one.
        (self.seconds() * self.rate + 1e-6).floor() as u64 + 1
    }

    /// Pictures a second.
    pub fn rate(&self) -> f64 {
        self.rate
    }

    /// The places that it passes through, with their times in seconds.
    pub fn keys(&self) -> &[(f64, P)] {
        &self.keys
    }

    /// The pose in a picture, counted from 0; the last one goes on.
    pub fn pose_of_frame(&self, frame: u64) -> P {
        self.pose(frame as f64 / self.rate)
    }

    /// The pose at a time in seconds: before the first place that one, after the last one that.
    pub fn pose(&self, time: f64) -> P {
        let after = self.keys.partition_point(|(key, _)| *key <= time);
        match (self.keys.get(after.wrapping_sub(1)), self.keys.get(after)) {
            (Some((begin, from)), Some(_)) if *begin != time => from.at(self.channels_at(time)),
            // Exactly what is written.
            (Some((_, pose)), _) | (None, Some((_, pose))) => *pose,
            (None, None) => self.first,
        }
    }

    /// What is mixed at a time in seconds.
    fn channels_at(&self, time: f64) -> PathChannels {
        let after = self.keys.partition_point(|(key, _)| *key <= time).clamp(1, self.keys.len());
        let (values, slopes) = (&self.channels[after - 1..], &self.slopes[after - 1..]);
        let (Some(next), [(begin, _), (end, _), ..]) = (values.get(1), &self.keys[after - 1..]) else {
            return values[0];
        };
        let (length, at) = (end - begin, ((time - begin) / (end - begin)).clamp(0.0, 1.0));
        std::array::from_fn(|n| {
            hermite([values[0][n], next[n]], [slopes[0][n] * length, slopes[1][n] * length], at)
        })
    }
}

impl CameraPath {
    /// Reads a path over an image of `size` texels.
    pub fn from_text(text: &str, size: [u32; 2]) -> Result<CameraPath, CameraPathError> {
        let parse = |text: &str| Pose::from_text(text, size).map_err(|fault| fault.to_string());
        CameraPath::read(text, parse, "image:x=100,y=200,zoom=3")
    }

    /// The text of the path, over an image of `size` texels.
    pub fn to_text(&self, size: [u32; 2]) -> String {
        self.written(|pose| pose.to_text(size))
    }

    /// The path of a camera that was at these poses at these times in seconds, with no more places than it
    /// takes to pass close to all of them: to a five-hundredth of the view. Where poses of another scene
    /// begin, it ends. Nothing without a pose.
    pub fn recorded(rate: f64, seen: &[(f64, Pose)]) -> Option<CameraPath> {
        CameraPath::recorded_with(rate, seen, scales_of)
    }
}

impl<P: PathPlace> CameraPath<P> {
    /// The same of other places; `scales` says how much of each channel is as far as half of a view's height
    /// at a place.
    pub(crate) fn recorded_with(
        rate: f64,
        seen: &[(f64, P)],
        scales: impl Fn(&P) -> PathChannels,
    ) -> Option<CameraPath<P>> {
        let (begin, first) = seen.first()?;
        let of_one_kind = seen.iter().take_while(|(_, pose)| pose.kind() == first.kind());
        let mut keys: Vec<(f64, P)> = Vec::new();
        for (time, pose) in of_one_kind {
            let time = ((time - begin) * 1000.0).round() / 1000.0;
            if time > LATEST || keys.len() == MOST_KEYS {
                break;
            }
            match keys.last_mut() {
                Some((before, last)) if *before >= time => *last = *pose,
                _ => keys.push((time, *pose)),
            }
        }
        let channels = continuous(&keys);
        let mut stays = vec![0, keys.len() - 1];
        stays.dedup();
        loop {
            let path = CameraPath::new(rate, stays.iter().map(|&n| keys[n]).collect())?;
            let away = |&n: &usize| {
                let place = &keys[n].1;
                distance(place, &scales(place), [&channels[n], &path.channels_at(keys[n].0)])
            };
            let farthest = |part: &[usize]| {
                let within = part[0] + 1..part[1];
                within.max_by(|a, b| away(a).total_cmp(&away(b))).filter(|n| away(n) > TOLERANCE)
            };
            let more: Vec<usize> = stays.windows(2).filter_map(farthest).collect();
            if more.is_empty() {
                return Some(path);
            }
            stays.extend(more);
            stays.sort_unstable();
        }
    }
}

/// The channels of poses, angles going on where they would begin anew.
fn continuous<P: PathPlace>(keys: &[(f64, P)]) -> Vec<PathChannels> {
    let mut all: Vec<PathChannels> = Vec::with_capacity(keys.len());
    for (_, pose) in keys {
        let mut channels = pose.channels();
        if let Some(before) = all.last() {
            for &angle in pose.angles() {
                channels[angle] -= ((channels[angle] - before[angle]) / TAU).round() * TAU;
            }
        }
        all.push(channels);
    }
    all
}

/// How much of each channel is as far as half of the view's height, and 1 of angles and of even factors.
fn scales_of(pose: &Pose) -> PathChannels {
    let view = match pose {
        Pose::Image { zoom, .. } => 1.0 / zoom,
        Pose::Plane { eye, .. } => eye.z.abs().max(1e-9),
        Pose::Globe { altitude, .. } => *altitude,
    };
    let lengths = if matches!(pose, Pose::Plane { .. }) { 3 } else { 2 };
    std::array::from_fn(|nth| if nth < lengths { view } else { 1.0 })
}

/// How far one place is from another, in views and angles.
fn distance<P: PathPlace>(place: &P, scales: &PathChannels, [a, b]: [&PathChannels; 2]) -> f64 {
    let angles = place.angles();
    let apart = |n: usize| {
        let apart = a[n] - b[n];
        if angles.contains(&n) { apart - (apart / TAU).round() * TAU } else { apart }
    };
    (0..a.len()).map(|n| (apart(n) / scales[n]).abs()).fold(0.0, f64::max)
}

/// Slopes with which curves through values go smoothly and never beyond two neighbours (after Fritsch and
/// Butland).
fn slopes(times: &[f64], values: &[PathChannels]) -> Vec<PathChannels> {
    let rise = |n: usize, c: usize| (values[n + 1][c] - values[n][c]) / (times[n + 1] - times[n]);
    let slope = |n: usize, c: usize| {
        if n == 0 || n + 1 == times.len() {
            return 0.0;
        }
        let (before, after) = (rise(n - 1, c), rise(n, c));
        if before * after <= 0.0 {
            return 0.0;
        }
        let (left, right) = (times[n] - times[n - 1], times[n + 1] - times[n]);
        let (a, b) = (2.0 * right + left, right + 2.0 * left);
        (a + b) / (a / before + b / after)
    };
    (0..times.len()).map(|n| std::array::from_fn(|c| slope(n, c))).collect()
}

/// A cubic between two values with the slopes that it has there, at 0 to 1 of the way.
fn hermite([from, to]: [f64; 2], [begins, ends]: [f64; 2], t: f64) -> f64 {
    // From the rise, so that a value that stays is exact.
    let rise = to - from;
    from + t * t * (3.0 - 2.0 * t) * rise + t * (1.0 - t) * ((1.0 - t) * begins - t * ends)
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use super::*;

    const SIZE: [u32; 2] = [1000, 500];

    const TEXT: &str = "\u{feff}vastex path 1\r
        # a comment

        fps 25   # another
        0   image:x=500,y=250,zoom=1
        2   image:x=100,y=250,zoom=16,turn=350
        3.5 image:x=100,y=250,zoom=16,turn=10
        4   image:x=100,y=50,zoom=16,turn=10,mirror=1\n";

    #[test]
    fn a_text_is_a_path_and_its_text_is_the_path_again() {
        let path = CameraPath::from_text(TEXT, SIZE).unwrap();
        assert_eq!((path.frames(), path.rate(), path.seconds(), path.keys().len()), (101, 25.0, 4.0, 4));
        assert_eq!(CameraPath::from_text(&path.to_text(SIZE), SIZE), Ok(path.clone()));
        for (time, pose) in path.keys() {
            assert_eq!(path.pose(*time), *pose, "it passes through each");
        }
        assert_eq!(path.pose(-1.0), path.pose(0.0));
        assert_eq!(path.pose_of_frame(1_000_000), path.pose(4.0));
    }

    #[test]
    fn between_two_places_a_camera_goes_on_and_never_beyond_them() {
        let path = CameraPath::from_text(TEXT, SIZE).unwrap();
        let mut before = 0.0;
        for frame in 0..=50 {
            let Pose::Image { centre, zoom, orientation } = path.pose_of_frame(frame) else { panic!() };
            assert!((0.1 - 1e-12..=0.5).contains(&centre.x) && centre.y == 0.5, "{frame}: {centre}");
            assert!(zoom >= before && zoom <= 16.0 + 1e-9, "{frame}: {zoom}");
            // From 0 to 350 degrees it turns back by 10.
            assert!(orientation.degrees() == 0.0 || orientation.degrees() >= 350.0 - 1e-9);
            before = zoom;
        }
        // What is alike at both ends stays, and 350 to 10 degrees are 20.
        let Pose::Image { zoom, orientation, .. } = path.pose(2.75) else { panic!() };
        assert!((zoom - 16.0).abs() < 1e-9);
        let degrees = orientation.degrees();
        assert!(!(10.0..=350.0).contains(&degrees), "{degrees}");
        let globe = "vastex path 1\n0 globe:lon=170,lat=0,alt=100m\n1 globe:lon=-170,lat=0,alt=10000m\n";
        let path = CameraPath::from_text(globe, SIZE).unwrap();
        let Pose::Globe { longitude, altitude, .. } = path.pose(0.5) else { panic!() };
        assert!((longitude.abs().to_degrees() - 180.0).abs() < 1e-9, "the shorter way: {longitude}");
        assert!((altitude / super::super::METRE - 1000.0).abs() < 1e-6, "an even factor: {altitude}");
        assert_eq!(path.frames(), 31);
    }

    #[test]
    fn what_is_wrong_with_a_text_is_told_by_its_line() {
        let head = "vastex path 1\n";
        for (text, line, why) in [
            ("", 1, "vastex path 1"),
            ("# only this\n\n", 1, "vastex path 1"),
            ("vastex path 2\n", 1, "begins with the line"),
            ("0 image:x=1,y=2,zoom=3", 1, "begins with the line"),
            (&*format!("{head}\n# nothing"), 1, "no place"),
            (&*format!("{head}fps fast"), 2, "'fast' is no rate"),
            (&*format!("{head}fps 0"), 2, "0.1 to 1000"),
            (&*format!("{head}fps 25\n\nfps 30"), 4, "told twice"),
            (&*format!("{head}soon image:x=1,y=2,zoom=3"), 2, "'soon' is no time"),
            (&*format!("{head}-1 image:x=1,y=2,zoom=3"), 2, "'-1' is no time"),
            (&*format!("{head}nan image:x=1,y=2,zoom=3"), 2, "'nan' is no time"),
            (&*format!("{head}0"), 2, "'' is no view"),
            (&*format!("{head}0 image:x=1,y=2"), 2, "because of 'zoom'"),
            (&*format!("{head}0 image:x=1,y=2,zoom=3\n0 image:x=1,y=2,zoom=3"), 3, "not later"),
            (&*format!("{head}0 image:x=1,y=2,zoom=3\n1 globe:lon=1,lat=2,alt=3m"), 3, "one scene"),
        ] {
            let error = CameraPath::from_text(text, SIZE).unwrap_err();
            assert!(error.line == line && error.why.contains(why), "{text:?}: {error}");
        }
    }

    #[test]
    fn a_recording_has_few_places_and_passes_close_to_all() {
        // A flight of 20 seconds at 60 pictures a second, with a rest in its middle.
        let seen: Vec<(f64, Pose)> = (0..1200)
            .map(|n| {
                let time = f64::from(n) / 60.0;
                let moved = time.min(8.0) + (time - 12.0).max(0.0);
                let centre = DVec2::new(0.5 + 0.3 * (moved / 3.0).sin(), 0.5 + 0.01 * moved);
                (time + 100.0, Pose::image(centre, (moved / 6.0).exp()))
            })
            .collect();
        let path = CameraPath::recorded(30.0, &seen).unwrap();
        assert!(path.keys().len() < 90, "{}", path.keys().len());
        for (time, pose) in &seen {
            let (seen, played) = (pose.channels(), path.pose(time - 100.0).channels());
            let away = distance(pose, &scales_of(pose), [&seen, &played]);
            assert!(away < 2.0 * TOLERANCE, "{time}: {away}");
        }
        assert_eq!(CameraPath::recorded(30.0, &[]), None);
        let one = CameraPath::recorded(30.0, &seen[..1]).unwrap();
        assert_eq!((one.frames(), one.keys()), (1, &[(0.0, seen[0].1)][..]));
        let other = [seen[0], (101.0, Pose::first(crate::Scene::Globe))];
        assert_eq!(CameraPath::recorded(30.0, &other).unwrap().keys().len(), 1);
    }
}
