//! Running other programs: where the clone is, which cargo to call, and what is said about it.
//!
//! What to run is decided by the callers.

use std::ffi::OsString;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;
use std::{fmt, fs};

use anyhow::{Context, Result, bail};

/// The command line is wrong; `main` prints the help text and ends with exit code 2.
#[derive(Debug)]
pub(crate) struct Usage(pub(crate) String);

impl fmt::Display for Usage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Usage {}

/// The root of the clone.
pub(crate) fn root() -> PathBuf {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR"));
    manifest.parent().unwrap_or(manifest).to_owned()
}

/// The directory into which cargo builds.
pub(crate) fn target_dir() -> PathBuf {
    // A relative CARGO_TARGET_DIR is meant from where cargo runs, which is the root here.
    root().join(std::env::var_os("CARGO_TARGET_DIR").unwrap_or_else(|| OsString::from("target")))
}

/// A program that runs in the root of the clone.
pub(crate) fn command(program: &str) -> Command {
    let mut command = Command::new(program);
    command.current_dir(root());
    command
}

/// The cargo that runs this program, as a person would call it from the root.
pub(crate) fn cargo(subcommand: &str) -> Command {
    let mut command = command(&std::env::var("CARGO").unwrap_or_else(|_| "cargo".to_owned()));
    forget_package(&mut command);
    command.arg(subcommand);
    command
}

/// Leaves out what cargo tells this package about itself: it is not true of another one, and would make some
/// build scripts run again.
pub(crate) fn forget_package(command: &mut Command) {
    let is_of_package = |name: &str| name.starts_with("CARGO_PKG_") || name.starts_with("CARGO_MANIFEST_");
    for (name, _) in std::env::vars_os() {
        if name.to_str().is_some_and(is_of_package) {
            command.env_remove(name);
        }
    }
}

/// Shows the command line and runs it with the terminal's own input and output; fails where it fails.
pub(crate) fn run(command: &mut Command) -> Result<()> {
    println!("$ {}", line(command));
    let status = command.status().with_context(|| format!("cannot start `{}`", line(command)))?;
    if !status.success() {
        bail!("`{}` failed ({status})", line(command));
    }
    Ok(())
}

/// Runs a command as [`run`] does, and returns the lines of its standard error, which are shown as they come.
pub(crate) fn run_with_stderr(command: &mut Command) -> Result<Vec<String>> {
    println!("$ {}", line(command));
    let mut child = command
        .stderr(Stdio::piped())
        .spawn()
        .with_context(|| format!("cannot start `{}`", line(command)))?;
    let mut said = Vec::new();
    for text in child.stderr.take().map(BufReader::new).into_iter().flat_map(BufRead::lines) {
        let text = text?;
        eprintln!("{text}");
        said.push(text);
    }
    let status = child.wait()?;
    if !status.success() {
        bail!("`{}` failed ({status})", line(command));
    }
    Ok(said)
}

/// Runs a program and gives what it prints on its standard output, each line of which is shown as it comes,
/// also where it fails then.
pub(crate) fn output_shown(command: &mut Command, mut shown: impl Write) -> Result<String> {
    let mut child = command
        .stdout(Stdio::piped())
        .spawn()
        .with_context(|| format!("cannot start `{}`", line(command)))?;
    let (mut printed, mut text) = (String::new(), Vec::new());
    if let Some(stdout) = child.stdout.take() {
        let mut stdout = BufReader::new(stdout);
        while stdout.read_until(b'\n', &mut text)? > 0 {
            shown.write_all(&text)?;
            printed.push_str(&String::from_utf8_lossy(&text));
            text.clear();
        }
    }
    let status = child.wait()?;
    if !status.success() {
        bail!("`{}` failed ({status})", line(command));
    }
    Ok(printed)
}

/// What a program prints on its standard output; fails where it fails.
pub(crate) fn output(command: &mut Command) -> Result<String> {
    let output = command.output().with_context(|| format!("cannot start `{}`", line(command)))?;
    if !output.status.success() {
        let told = String::from_utf8_lossy(&output.stderr);
        bail!("`{}` failed ({}): {}", line(command), output.status, told.trim());
    }
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}

/// Processor time of all programs that were started here and have ended, by Linux's account.
pub(crate) fn processor_time() -> Option<Duration> {
    let stat = fs::read_to_string("/proc/self/stat").ok()?;
    // The name, in parentheses, may contain anything. After it the 14th and 15th field are hundredths of a
    // second.
    let fields: Vec<&str> = stat.rsplit_once(')')?.1.split_whitespace().collect();
    let ticks: u64 =
        [13, 14].iter().map(|&field| fields.get(field)?.parse::<u64>().ok()).sum::<Option<u64>>()?;
    Some(Duration::from_millis(10 * ticks))
}

/// Returns true if a program starts and succeeds, silently.
pub(crate) fn succeeds(command: &mut Command) -> bool {
    let quiet = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    quiet.status().is_ok_and(|status| status.success())
}

/// Returns true if continuous integration runs this, where no step may be skipped.
pub(crate) fn is_ci() -> bool {
    std::env::var_os("CI").is_some_and(|ci| ci == "true")
}

/// Returns true if a program of this name is on the path.
pub(crate) fn on_path(program: &str) -> bool {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let file = format!("{program}{}", std::env::consts::EXE_SUFFIX);
    std::env::split_paths(&path).any(|directory| directory.join(&file).is_file())
}

fn line(command: &Command) -> String {
    let program = Path::new(command.get_program());
    let name = program.file_name().unwrap_or(command.get_program()).to_string_lossy().into_owned();
    command.get_args().fold(name, |line, argument| {
        let argument = argument.to_string_lossy();
        if argument.contains([' ', '"', '[']) {
            format!("{line} '{argument}'")
        } else {
            format!("{line} {argument}")
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(unix)]
    #[test]
    fn what_a_program_printed_before_it_failed_is_shown() {
        let mut shown = Vec::new();
        let mut script = |text| output_shown(command("sh").args(["-c", text]), &mut shown);
        assert_eq!(script("printf 'one\ntwo'").unwrap(), "one\ntwo");
        assert!(script("echo; echo FAILED; exit 3").unwrap_err().to_string().contains("failed"));
        assert_eq!(String::from_utf8_lossy(&shown), "one\ntwo\nFAILED\n");
    }
}
