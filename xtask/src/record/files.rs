//! What the program makes of fixed inputs, as hashes: a line for each file that it leaves, and for each thing
//! that it says of it.

use std::fmt::Write;
use std::fs;
use std::path::Path;
use std::process::Command;
use std::sync::Mutex;

use anyhow::{Context, Result};
use twox_hash::XxHash3_128;

use crate::limited::within;

use super::steps::{self, Step};
use super::{LIMIT, Program, at_once, clean, files_under, inputs, make, said, write};

/// Takes the steps, all or those named, and writes `files.txt` into `directory`. `desk` is where they work;
/// `fuzzer` has the small sound files, `assets` the images of the real Earth; without them there are none of
/// these.
pub fn record(
    program: &Program,
    fuzzer: Option<&Path>,
    assets: Option<&Path>,
    desk: &Path,
    directory: &Path,
    only: &[&str],
) -> Result<()> {
    let desk = make(desk)?;
    let input = make(&desk.join("in"))?;
    inputs::make(&input)?;
    let mut steps = steps::all();
    if let Some(fuzzer) = fuzzer {
        steps.extend(steps::of_seeds(&inputs::seeds(fuzzer, &input)?));
    }
    if let Some(assets) = assets {
        for (asset, name) in ASSETS {
            fs::copy(assets.join(asset), input.join(name)).with_context(|| asset.to_owned())?;
        }
        inputs::touch(&input)?;
    } else {
        steps.retain(|step| !ASSETS.iter().any(|(_, name)| name.starts_with(&format!("{}.", step.name))));
    }
    steps.retain(|step| only.is_empty() || only.contains(&step.name.as_str()));
    let lines = Mutex::new(Vec::new());
    let work = make(&desk.join("work"))?;
    at_once(&steps, |step| {
        let told = take(program, &work, step)?;
        lines.lock().map_err(|_| anyhow::anyhow!("a step panicked"))?.extend(told);
        Ok(())
    })?;
    let mut lines = lines.into_inner()?;
    lines.sort();
    write(&directory.join("files.txt"), lines.concat())?;
    fs::remove_dir_all(&desk).with_context(|| format!("cannot remove {}", desk.display()))
}

const ASSETS: [(&str, &str); 2] =
    [("earth-color-10800x5400.jpg", "earth.jpg"), ("earth-elevation-1080x540-u16.png", "elevation.png")];

/// Takes a step in a directory of its own. What it left, and what was said of what it made.
fn take(program: &Program, work: &Path, step: &Step) -> Result<Vec<String>> {
    let directory = make(&work.join(&step.name))?;
    let mut lines = Vec::new();
    for (number, command) in step.commands.iter().enumerate() {
        if let Some(state) = command.strip_prefix("state ") {
            hash(&directory, &format!("{} {state}", step.name), &mut lines)?;
            continue;
        }
        let output = within(&mut of(program, command, &directory), LIMIT)?;
        let code = output.status.code().map_or("a signal".to_owned(), |code| code.to_string());
        let says = match output.status.success() {
            true => notes(&output.stderr),
            false => format!("ended with {code}: {}\n", said(&output)),
        };
        // Some messages name files as the system does.
        let says = says.replace(&format!("{}/", directory.display()), "");
        for (nth, says) in says.lines().enumerate() {
            lines.push(format!("{} command {number} line {nth}: {says}\n", step.name));
        }
    }
    hash(&directory, &step.name, &mut lines)?;
    fs::remove_dir_all(directory)?;
    Ok(lines)
}

/// A command of a step.
fn of(program: &Program, command: &str, directory: &Path) -> Command {
    let command = command.replace('%', "../../in");
    let (blocks, words) = match command.strip_prefix("short ").and_then(|rest| rest.split_once(' ')) {
        Some((blocks, words)) => (Some(blocks), words),
        None => (None, command.as_str()),
    };
    let mut started = match blocks {
        None => program.command(directory),
        Some(blocks) => {
            let mut shell = Command::new("sh");
            clean(&mut shell);
            shell.args(["-c", &format!("trap '' XFSZ; ulimit -f {blocks}; exec \"$@\""), "sh"]);
            shell.arg(&program.path).current_dir(directory);
            shell
        }
    };
    started.args(words.split_whitespace());
    started
}

/// What was said of the images.
fn notes(stderr: &[u8]) -> String {
    let text = String::from_utf8_lossy(stderr);
    text.lines().filter(|line| line.contains("note: ")).map(|line| format!("{line}\n")).collect()
}

/// A line for each file that lies there: its hash and its bytes.
fn hash(directory: &Path, name: &str, lines: &mut Vec<String>) -> Result<()> {
    for file in files_under(directory)? {
        let bytes = fs::read(directory.join(&file)).with_context(|| file.clone())?;
        let mut line = String::new();
        // Writing to a string cannot fail.
        let _ = writeln!(line, "{name} {file}: {:032x} {} bytes", XxHash3_128::oneshot(&bytes), bytes.len());
        lines.push(line);
    }
    Ok(())
}
