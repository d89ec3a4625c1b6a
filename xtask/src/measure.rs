//! Measuring other programs: wall time, CPU time, peak memory and bytes written of one run, and medians of
//! several.
//!
//! The numbers come from GNU time, which reads them from the kernel when the program has ended. What is
//! measured and how it is compared is the business of the benchmarks.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Instant;

use anyhow::{Context, Result, bail};

use crate::shell;

/// Where GNU time is; the shell's own `time` knows nothing of memory.
pub(crate) const GNU_TIME: &str = "/usr/bin/time";

/// What one run of a program cost.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Run {
    /// From start to end, in seconds.
    pub(crate) wall: f64,
    /// User and system time of all threads, in seconds.
    pub(crate) cpu: f64,
    /// The largest resident set, in units of 10^6 bytes.
    pub(crate) peak_mb: f64,
    /// The size of the file or directory that it wrote, in units of 10^6 bytes.
    pub(crate) written_mb: f64,
}

/// Runs a program once, its output removed beforehand so that each run writes a new file. What was written
/// before is on the disk by then, so that nobody waits for another's bytes.
pub(crate) fn run(program: &str, arguments: &[String], output: &Path) -> Result<Run> {
    remove(output).with_context(|| format!("cannot remove {}", output.display()))?;
    shell::command("sync").status().context("cannot start sync")?;
    let report = report_path(output);
    let mut command = shell::command(GNU_TIME);
    command.args(["-f", "%U %S %M", "-o"]).arg(&report).arg(program).args(arguments);
    let start = Instant::now();
    run_quietly(&mut command)?;
    let wall = start.elapsed().as_secs_f64();
    let text =
        std::fs::read_to_string(&report).with_context(|| format!("cannot read {}", report.display()))?;
    let (cpu, peak_mb) =
        parse_report(&text).with_context(|| format!("{GNU_TIME} is not GNU time: it wrote '{text}'"))?;
    let written = size(output).with_context(|| format!("{program} has not written {}", output.display()))?;
    Ok(Run { wall, cpu, peak_mb, written_mb: written as f64 / 1e6 })
}

/// Removes a file or a directory, if there is one.
fn remove(path: &Path) -> std::io::Result<()> {
    match path.is_dir() {
        true => std::fs::remove_dir_all(path),
        false if path.exists() => std::fs::remove_file(path),
        false => Ok(()),
    }
}

/// Bytes of a file, or of all files in a directory.
fn size(path: &Path) -> std::io::Result<u64> {
    let metadata = std::fs::metadata(path)?;
    if !metadata.is_dir() {
        return Ok(metadata.len());
    }
    std::fs::read_dir(path)?.map(|entry| size(&entry?.path())).sum()
}

/// A number of a JSON object, the first of its name.
pub(crate) fn number(json: &str, name: &str) -> Option<f64> {
    let rest = json.split_once(&format!("\"{name}\":"))?.1;
    rest.split([',', '}']).next()?.trim().parse().ok()
}

/// The median of every column by itself. `runs` must not be empty.
pub(crate) fn medians(runs: &[Run]) -> Run {
    let column = |of: fn(&Run) -> f64| median(runs.iter().map(of).collect());
    Run {
        wall: column(|run| run.wall),
        cpu: column(|run| run.cpu),
        peak_mb: column(|run| run.peak_mb),
        written_mb: column(|run| run.written_mb),
    }
}

/// The middle value, or the mean of the two in the middle; 0 of nothing.
pub(crate) fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    match values.len() {
        0 => 0.0,
        odd if odd % 2 == 1 => values[middle],
        _ => (values[middle - 1] + values[middle]) / 2.0,
    }
}

fn report_path(output: &Path) -> PathBuf {
    let mut name = output.as_os_str().to_owned();
    name.push(".time");
    PathBuf::from(name)
}

fn run_quietly(command: &mut Command) -> Result<()> {
    let output = command.stdin(Stdio::null()).stdout(Stdio::null()).output();
    let output = output.with_context(|| format!("cannot start {GNU_TIME}"))?;
    if !output.status.success() {
        let arguments: Vec<_> =
            command.get_args().skip(4).map(|argument| argument.to_string_lossy()).collect();
        bail!("`{}` failed: {}", arguments.join(" "), String::from_utf8_lossy(&output.stderr).trim());
    }
    Ok(())
}

/// CPU seconds and peak megabytes from the last line of "user system kibibytes".
fn parse_report(text: &str) -> Option<(f64, f64)> {
    let numbers: Vec<f64> =
        text.lines().last()?.split_whitespace().map_while(|word| word.parse().ok()).collect();
    match numbers[..] {
        [user, system, kibibytes] => Some((user + system, kibibytes * 1024.0 / 1e6)),
        _ => None,
    }
}

/// Says for a page of figures when they were measured, and of which commit. Changes of documents are none:
/// other figures may just have been written there.
pub(crate) fn stamp() -> Result<String> {
    let git = |arguments: &[&str]| shell::output(shell::command("git").args(arguments));
    let status = ["status", "--porcelain", "--untracked-files=no", "--", ":/", ":(exclude,top)docs"];
    let changed = if git(&status)?.trim().is_empty() { "" } else { ", with changes that are not committed" };
    let commit = git(&["rev-parse", "--short", "HEAD"])?;
    let date = shell::output(shell::command("date").args(["-u", "+%F"]))?;
    Ok(format!("Measured on {} at commit {}{changed}.\n", date.trim(), commit.trim()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_report_is_read_and_anything_else_refused() {
        assert_eq!(parse_report("1.50 0.25 1000\n"), Some((1.75, 1.024)));
        assert_eq!(parse_report(""), None);
        assert_eq!(parse_report("1.50 0.25\n"), None);
        assert_eq!(parse_report("Command terminated by signal 9\n"), None);
    }

    #[test]
    fn a_median_is_the_middle() {
        assert_eq!(median(vec![3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(vec![4.0, 1.0, 2.0, 3.0]), 2.5);
    }

    #[test]
    fn medians_are_taken_by_column() {
        let run = |wall, cpu| Run { wall, cpu, peak_mb: 1.0, written_mb: 2.0 };
        assert_eq!(medians(&[run(1.0, 9.0), run(2.0, 8.0), run(3.0, 7.0)]), run(2.0, 8.0));
    }
}
