//! How far a command is, on a terminal only: a bar, the pace so far, and the time that is left at that pace.

use std::fmt::Write;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressState, ProgressStyle};

/// Before that a pace says more about how the work began than about how it goes on.
const FIRST_PACE: Duration = Duration::from_millis(1500);

/// A bar of so many `unit`s ("row", "tile"), or none where it is to be `hidden`. What is done to them is said
/// before the count.
pub(crate) fn bar(hidden: bool, what: &str, unit: &'static str) -> ProgressBar {
    let bar = if hidden { ProgressBar::hidden() } else { ProgressBar::new(0) };
    let template = format!("{{bar:32}} {{percent:>3}} %  {what}{{pos}} of {{len}} {unit}s{{msg}}{{pace}}");
    if let Ok(style) = ProgressStyle::with_template(&template) {
        bar.set_style(style.with_key("pace", move |state: &ProgressState, text: &mut dyn Write| {
            let _ = text.write_str(&pace(state.pos(), state.len().unwrap_or(0), state.elapsed(), unit));
        }));
    }
    bar
}

/// The mean pace so far and the time that is left; nothing at the beginning and at the end.
fn pace(done: u64, total: u64, elapsed: Duration, unit: &str) -> String {
    if done == 0 || done >= total || elapsed < FIRST_PACE {
        return String::new();
    }
    let rate = done as f64 / elapsed.as_secs_f64();
    let shown = if rate < 10.0 { format!("{rate:.1}") } else { format!("{rate:.0}") };
    let left = ((total - done) as f64 / rate).ceil() as u64;
    let left = if left < 120 { format!("{left} s") } else { format!("{} min", left.div_ceil(60)) };
    format!(", {shown} {unit}s/s, {left} left")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pace_is_told_once_there_is_one() {
        let after = |done, seconds| pace(done, 1000, Duration::from_secs_f64(seconds), "row");
        assert_eq!(after(0, 60.0), "", "no rate of 0 and no time left of 0");
        assert_eq!(after(10, 0.1), "");
        assert_eq!(after(100, 2.0), ", 50 rows/s, 18 s left");
        assert_eq!(after(1, 2.0), ", 0.5 rows/s, 34 min left");
        assert_eq!(after(1000, 20.0), "");
    }
}
