//! The section `[reading]` of a settings file: how tiles are read. [`Settings`] says what each key means.

use std::time::Duration;

use serde::Deserialize;

use crate::settings::Settings;

/// The longest that a frame may decode, in milliseconds.
const MOST_MILLISECONDS: f64 = 1000.0;

/// What a file says of reading; what it does not say stays as it is.
#[derive(Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(super) struct ReadingOfFile {
    loader_threads: Option<Reads>,
    reads_at_once: Option<Reads>,
    read_time_out_s: Option<Seconds>,
    decode_time_per_frame_ms: Option<Milliseconds>,
}

impl ReadingOfFile {
    pub(super) fn lay_over(self, settings: &mut Settings) {
        let reads = |set: Option<Reads>, before| set.map_or(before, |Reads(reads)| reads);
        settings.loader_threads = reads(self.loader_threads, settings.loader_threads);
        settings.reads_at_once = reads(self.reads_at_once, settings.reads_at_once);
        if let Some(Seconds(time_out)) = self.read_time_out_s {
            settings.read_time_out = time_out;
        }
        if let Some(Milliseconds(time)) = self.decode_time_per_frame_ms {
            settings.decode_time_per_frame = time;
        }
    }
}

#[derive(Debug, Deserialize)]
#[serde(try_from = "i64")]
struct Reads(usize);

impl TryFrom<i64> for Reads {
    type Error = String;

    fn try_from(reads: i64) -> Result<Reads, String> {
        match usize::try_from(reads).ok().filter(|_| Settings::READS_AT_ONCE.contains(&reads)) {
            Some(reads) => Ok(Reads(reads)),
            None => Err(format!("it is {reads}; give it 1 to {}", Settings::READS_AT_ONCE.end())),
        }
    }
}

#[derive(Debug, Deserialize)]
#[serde(try_from = "f64")]
struct Seconds(Duration);

impl TryFrom<f64> for Seconds {
    type Error = String;

    fn try_from(seconds: f64) -> Result<Seconds, String> {
        match Settings::READ_TIME_OUT_S.contains(&seconds) {
            true => Ok(Seconds(Duration::from_secs_f64(seconds))),
            false => {
                let (least, most) = (Settings::READ_TIME_OUT_S.start(), Settings::READ_TIME_OUT_S.end());
                Err(format!("a time-out of {seconds} seconds; give it {least} to {most}"))
            }
        }
    }
}

#[derive(Debug, Deserialize)]
#[serde(try_from = "f64")]
struct Milliseconds(Duration);

impl TryFrom<f64> for Milliseconds {
    type Error = String;

    fn try_from(milliseconds: f64) -> Result<Milliseconds, String> {
        match (0.0..=MOST_MILLISECONDS).contains(&milliseconds) {
            true => Ok(Milliseconds(Duration::from_secs_f64(milliseconds / 1000.0))),
            false => Err(format!("{milliseconds} ms of a frame; give it 0 to {MOST_MILLISECONDS}")),
        }
    }
}
