//! How `render` and `view` read tiles.

use std::time::Duration;

use clap::Args as ClapArgs;
use vastex::Settings;

#[derive(Clone, Debug, ClapArgs)]
pub(crate) struct ReadingArgs {
    /// Reads of the source that may be under way at once, whatever the settings say; 8 by default, and always
    /// 8 with --direct
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(Settings::READS_AT_ONCE))]
    reads_at_once: Option<u16>,
    /// Seconds after which a read that has not come back counts as failed, whatever the settings say; 30 by
    /// default. A failed page is shown by a coarser one and tried again
    #[arg(long, value_name = "SECONDS", value_parser = parse_seconds)]
    read_time_out_s: Option<Duration>,
}

impl ReadingArgs {
    /// Lays what was said over the settings.
    pub(crate) fn lay_over(&self, settings: &mut Settings) {
        settings.reads_at_once = self.reads_at_once.map_or(settings.reads_at_once, usize::from);
        settings.read_time_out = self.read_time_out_s.unwrap_or(settings.read_time_out);
    }
}

fn parse_seconds(text: &str) -> Result<Duration, String> {
    let allowed = Settings::READ_TIME_OUT_S;
    let seconds = text.parse::<f64>().ok().filter(|seconds| allowed.contains(seconds));
    let seconds = seconds.map(Duration::from_secs_f64);
    seconds.ok_or_else(|| format!("give it {} to {}", allowed.start(), allowed.end()))
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;
    use crate::args::{Args, Command};
    use crate::commands::render::settings;

    /// The settings of a picture that is drawn with these words, and with a file that says this.
    fn settings_of(words: &[&str], file: &str) -> Settings {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("vastex.toml");
        std::fs::write(&path, file).unwrap();
        let path = path.display().to_string();
        let args = [&["vastex", "render", "earth.vastex", "--settings", &path], words].concat();
        match Args::try_parse_from(args).unwrap().command {
            Command::Render(args) => settings(&args.scene).unwrap(),
            other => panic!("{other:?}"),
        }
    }

    fn reading(settings: &Settings) -> (usize, usize, Duration, Duration) {
        let Settings { loader_threads, reads_at_once, read_time_out, decode_time_per_frame, .. } = settings;
        (*loader_threads, *reads_at_once, *read_time_out, *decode_time_per_frame)
    }

    #[test]
    fn options_have_the_last_word_files_come_before_and_defaults_first() {
        let defaults = Settings::default();
        assert_eq!(reading(&settings_of(&[], "")), reading(&defaults));
        let file = "[reading]\nloader_threads = 3\nreads_at_once = 5\nread_time_out_s = 1.5\ndecode_time_per_frame_ms = 2\n";
        let of_file = settings_of(&[], file);
        let [time_out, decode] = [1500, 2].map(Duration::from_millis);
        assert_eq!(reading(&of_file), (3, 5, time_out, decode));
        let words = ["--reads-at-once", "20", "--read-time-out-s", "0.25"];
        assert_eq!(reading(&settings_of(&words, file)), (3, 20, Duration::from_millis(250), decode));
        assert_eq!(settings_of(&words[..2], "").read_time_out, defaults.read_time_out);
    }

    #[test]
    fn what_is_out_of_range_is_refused() {
        for words in [["--reads-at-once", "0"], ["--read-time-out-s", "0"], ["--read-time-out-s", "soon"]] {
            let args = [&["vastex", "render", "earth.vastex"][..], &words].concat();
            let error = Args::try_parse_from(args).unwrap_err().to_string();
            assert!(error.contains(words[0]) && error.contains(words[1]), "{error}");
        }
    }
}
