//! The tests of the workspace, by what their programs list.

use std::path::Path;
use std::process::Command;

use anyhow::{Result, ensure};

use crate::limited::within;

use super::json::leaves;
use super::{LIMIT, write};

/// Writes `tests.txt`. `built` is what `cargo test --no-run --message-format=json` prints.
pub fn record(built: &str, directory: &Path) -> Result<()> {
    let mut lines = Vec::new();
    for message in built.lines().filter(|line| line.starts_with('{')) {
        let leaves = leaves(message)?;
        let value =
            |path: &str| leaves.iter().find(|leaf| leaf.path == path).map_or("", |leaf| leaf.text.as_str());
        let (executable, manifest) = (value(".executable"), value(".manifest_path"));
        if value(".profile.test") != "true" || executable.is_empty() || executable == "null" {
            continue;
        }
        let of_crate = Path::new(manifest).parent().unwrap_or(Path::new("."));
        let mut command = Command::new(executable);
        command.args(["--list", "--format", "terse"]).current_dir(of_crate);
        let listed = within(&mut command, LIMIT)?;
        ensure!(listed.status.success(), "{executable} lists no tests: {}", super::said(&listed));
        let (name, target) =
            (of_crate.file_name().unwrap_or_default().to_string_lossy(), value(".target.name"));
        let target = if value(".target.kind[]") == "test" { target } else { "lib" };
        for test in String::from_utf8_lossy(&listed.stdout).lines() {
            if let Some(test) = test.strip_suffix(": test") {
                lines.push(format!("{name} {target} {test}\n"));
            }
        }
    }
    ensure!(!lines.is_empty(), "there are no tests");
    lines.sort();
    write(&directory.join("tests.txt"), lines.concat())
}
