//! When something could be seen of a file, how long frames took, and what idling costs: for `cargo xtask
//! bench view`.

use std::time::{Duration, Instant};

use serde::Serialize;

/// How long the window stays when nothing happens any more, so that it can be measured what that costs.
const IDLE: Duration = Duration::from_secs(3);

/// How long the window waits for as long a pause between frames. A message that goes may ask for a frame.
const IDLE_AT_LAST: Duration = Duration::from_secs(12);

/// Times of one file.
pub(super) struct Times {
    /// When the program began, and when it began to open the file: by then it has a device.
    begun: Instant,
    opened: Instant,
    preview: Option<Instant>,
    source: Option<Instant>,
    sharp: Option<Instant>,
    last: Option<Instant>,
    /// Between frames that followed one another without a pause, from the first to the one that was sharp.
    frames: Vec<Duration>,
    /// When the picture was sharp, and the processor time of the program by then.
    settled: Option<(Instant, Duration)>,
    /// When the last frame was drawn after that, and the processor time of the program by then.
    idle: Option<(Instant, Duration)>,
}

/// What scripts read. Times are milliseconds from the call to open.
#[derive(Serialize)]
struct Report {
    /// From the start of the program to the call to open.
    start_ms: f64,
    preview_ms: Option<f64>,
    source_ms: Option<f64>,
    sharp_ms: Option<f64>,
    frames: usize,
    frame_p95_ms: f64,
    frame_worst_ms: f64,
    /// Share of a processor while nothing happens.
    idle: Option<f64>,
}

impl Times {
    pub(super) fn new(begun: Instant) -> Times {
        Times {
            begun,
            opened: Instant::now(),
            preview: None,
            source: None,
            sharp: None,
            last: None,
            frames: Vec::new(),
            settled: None,
            idle: None,
        }
    }

    /// A frame is on the screen: of the source or of its preview, and the last one that changes anything or
    /// not. `follows` says that the one before asked for it, and so nothing was waited for between them.
    pub(super) fn note_frame(&mut self, is_source: bool, is_settled: bool, follows: bool) {
        let now = Instant::now();
        if self.sharp.is_some() {
            self.idle = processor_time().map(|spent| (now, spent));
            return;
        }
        if let Some(before) = self.last.replace(now).filter(|_| follows) {
            self.frames.push(now - before);
        }
        let first = if is_source { &mut self.source } else { &mut self.preview };
        first.get_or_insert(now);
        if is_source && is_settled {
            self.sharp = Some(now);
            self.settled = processor_time().map(|spent| (now, spent));
            self.idle = self.settled;
        }
    }

    /// When there is nothing left to measure, once that is known.
    pub(super) fn end(&self) -> Option<Instant> {
        let sharp = self.sharp?;
        let last = self.idle.map_or(sharp, |(at, _)| at);
        Some((last + IDLE).min(sharp + IDLE_AT_LAST))
    }

    /// Returns true if there is nothing left to measure.
    pub(super) fn are_over(&self) -> bool {
        self.are_over_at(Instant::now())
    }

    fn are_over_at(&self, now: Instant) -> bool {
        self.end().is_some_and(|end| end <= now)
    }

    /// The times as one JSON object.
    pub(super) fn json(&self) -> serde_json::Result<String> {
        let ms = |time: Duration| 1000.0 * time.as_secs_f64();
        let since = |at: Option<Instant>| at.map(|at| ms(at - self.opened));
        let mut frames = self.frames.clone();
        frames.sort();
        let nth = |share: f64| {
            frames.get(((frames.len() as f64 * share) as usize).min(frames.len().saturating_sub(1)))
        };
        let spent = |(since, before): (Instant, Duration)| {
            let spent = processor_time()?.checked_sub(before)?;
            Some(spent.as_secs_f64() / since.elapsed().as_secs_f64())
        };
        serde_json::to_string(&Report {
            start_ms: ms(self.opened - self.begun),
            preview_ms: since(self.preview),
            source_ms: since(self.source),
            sharp_ms: since(self.sharp),
            frames: frames.len(),
            frame_p95_ms: nth(0.95).copied().map_or(0.0, ms),
            frame_worst_ms: frames.last().copied().map_or(0.0, ms),
            // Where there was no such pause, nothing idled: all is counted.
            idle: self.idle.filter(|(at, _)| at.elapsed() >= IDLE).or(self.settled).and_then(spent),
        })
    }
}

/// Processor time of this program so far, where the system says so.
fn processor_time() -> Option<Duration> {
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    // The name, in parentheses, may contain anything. After it the 12th and 13th field are hundredths of a
    // second.
    let fields: Vec<&str> = stat.rsplit_once(')')?.1.split_whitespace().collect();
    let ticks: u64 =
        [11, 12].iter().map(|&field| fields.get(field)?.parse::<u64>().ok()).sum::<Option<u64>>()?;
    Some(Duration::from_millis(10 * ticks))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_told_from_the_call_to_open() {
        let mut times = Times::new(Instant::now());
        assert!(times.end().is_none());
        times.note_frame(false, false, false);
        // Nothing moved, until the source was there.
        times.note_frame(false, true, false);
        times.note_frame(true, false, true);
        times.note_frame(true, true, true);
        times.note_frame(true, true, true);
        assert!(times.end().is_some_and(|end| end > Instant::now()) && !times.are_over());
        let report: serde_json::Value = serde_json::from_str(&times.json().unwrap()).unwrap();
        assert_eq!(report["frames"], 2, "no pause counts, and nothing once it is sharp");
        let [preview, source, sharp] =
            ["preview_ms", "source_ms", "sharp_ms"].map(|name| report[name].as_f64().unwrap());
        assert!(preview <= source && source <= sharp, "{report}");
    }

    /// Three seconds without a frame are what is measured, and a frame begins them anew.
    #[cfg(target_os = "linux")]
    #[test]
    fn idling_is_measured_from_the_last_frame_on() {
        let mut times = Times::new(Instant::now());
        times.note_frame(true, true, false);
        let (sharp, before) = (times.sharp.unwrap(), times.idle.unwrap().1);
        let at = |seconds| sharp + Duration::from_secs(seconds);
        for (now, last, is_over) in [(5, 3, false), (5, 1, true), (11, 10, false), (13, 12, true)] {
            times.idle = Some((at(last), before));
            assert_eq!(times.are_over_at(at(now)), is_over, "{now} s, the last frame at {last} s");
        }
        times.note_frame(true, true, false);
        assert!(times.idle.is_some_and(|(last, _)| last < at(12)), "a frame was drawn just now");
    }
}
